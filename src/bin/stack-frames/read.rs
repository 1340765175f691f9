//! Reads stacks, and frames out of arrays that others have written.

use crate::layout::SCHEMA;
use crate::layout::{CHANNEL, LAYER, MASK, METADATA, Part, SAMPLES, SIGMA};
use cyanometer::error::{Error, Result};
use cyanometer::formats::format::{SampleReader, SampleType};
use cyanometer::formats::places::{FRAME_OF, STACK_DESCRIPTION};
use cyanometer::formats::register;
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::Metadata;
use cyanometer::text::counted;
use cyanometer::units::QuantityKind;
use half::f16;
use serde_json::Value;
use std::collections::VecDeque;
use std::fmt::Display;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use zarrs::array::{
    Array, ArrayBytes, ArrayCreateError, ArrayError, ArrayShardedExt, ArrayShardedReadableExt,
    ArrayShardedReadableExtCache, ArrayToBytesCodecTraits, ChunkShape, CodecChain, CodecMetadataOptions, CodecOptions,
    DataType, data_type,
};
use zarrs::filesystem::FilesystemStore;
use zarrs::group::Group;
use zarrs::metadata::v3::MetadataV3;
use zarrs::storage::{ReadableStorageTraits, StoreKey};

/// What is kept decoded of an array, besides the chunk that was read last: those of other columns, channels and frames that chunks of
/// other programs have.
const KEPT_BYTES: usize = 64 << 20;
/// What is decoded together may be so large.
const MAX_CHUNK_BYTES: u64 = 1 << 30;
/// Shards whose index is kept.
const KEPT_SHARDS: usize = 64;
/// What may be along an axis of channels.
const MAX_CHANNELS: u64 = 1 << 16;

/// A stack that is read: one of ours, or an array of another program.
pub struct Stack {
    name: String,
    arrays: Vec<StoredArray>,
    /// The metadata of each frame; none in arrays of others.
    records: Option<Records>,
    geometry: Geometry,
    own_tags: Metadata,
    frames: u64,
}

/// Metadata of frames, and those that were read last.
struct Records {
    array: Array<FilesystemStore>,
    kept: Mutex<(u64, Vec<String>)>,
}

/// An array of samples.
struct StoredArray {
    array: Array<FilesystemStore>,
    part: Part,
    /// Where frame, row, column and channel are among its axes.
    axes: [Option<usize>; 4],
    /// The shape of what is decoded together: an inner chunk of a shard, or a chunk.
    chunk: ChunkShape,
    shards: Option<Shards>,
    /// Whether every chunk must be there.
    is_ours: bool,
    kept: Mutex<VecDeque<Decoded>>,
}

/// A chunk by its indices, and its bytes.
type Decoded = (Vec<u64>, Arc<Vec<u8>>);

/// How inner chunks are found and decoded.
struct Shards {
    indices: ArrayShardedReadableExtCache,
    codecs: CodecChain,
}

impl Stack {
    /// Opens a stack, or an array that another program has written, of version 3 or 2: rows and columns, and frames or channels, or
    /// both.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is neither, or damaged; [`Error::Usage`] for what this run writes.
    pub fn open(path: &Path) -> Result<Arc<Self>> {
        let name = path.display().to_string();
        let description = path.join(STACK_DESCRIPTION);
        if let Ok(about) = std::fs::metadata(&description) {
            register::note_input(&about, &name)?;
        }
        let store = FilesystemStore::new(path).map_err(|error| unreadable(&name, &error))?;
        let store = Arc::new(store);
        let found: Value = match std::fs::read(&description) {
            Ok(text) => serde_json::from_slice(&text).map_err(|error| unreadable(&name, &error))?,
            Err(_) if path.join(".zgroup").is_file() => Value::from_iter([("node_type", "group")]),
            Err(_) => Value::Null,
        };
        if found["node_type"] != "group" {
            return Self::of_array(&store, &name).map(Arc::new);
        }
        match found["attributes"]["schema"].as_str() {
            Some(SCHEMA) => Self::of_ours(&store, &found["attributes"], &name).map(Arc::new),
            Some(other) => {
                Err(Error::format(&name, format!("it is of the schema `{other}`; this version reads `{SCHEMA}`")))
            }
            None => {
                let group = Group::open(store, "/").map_err(|error| unreadable(&name, &error))?;
                let paths = group.child_array_paths().unwrap_or_default();
                let names: Vec<&str> = paths.iter().map(|path| path.as_str().trim_start_matches('/')).collect();
                let problem = match names.first() {
                    Some(first) => format!(
                        "it is another program's group of arrays, {}; name one of them, as in {}",
                        names.join(", "),
                        path.join(first).display()
                    ),
                    None => "it is a group without arrays".into(),
                };
                Err(Error::format(&name, problem))
            }
        }
    }

    /// How many frames it has.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The stack as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    fn of_ours(store: &Arc<FilesystemStore>, attributes: &Value, name: &str) -> Result<Self> {
        let damaged = |what: &str| Error::format(name, format!("{what}; it is no stack, or damaged"));
        let open = |array: &str| {
            let found = Array::open(store.clone(), &format!("/{array}"));
            found.map_err(|error| unreadable(name, &format!("its array `{array}`: {error}")))
        };
        let is_there = |array: &str| {
            let key = StoreKey::new(format!("{array}/{STACK_DESCRIPTION}"));
            key.is_ok_and(|key| store.size_key(&key).is_ok_and(|size| size.is_some()))
        };
        let names = attributes["channels"].as_array().map(Vec::as_slice).unwrap_or_default();
        let channels: Vec<String> = names.iter().filter_map(|name| Some(name.as_str()?.to_owned())).collect();
        let (mut arrays, mut next, mut form) = (Vec::new(), 0, None);
        let parts = [(SAMPLES, Some(CHANNEL)), (SIGMA, Some(LAYER)), (MASK, None)];
        for (array, axis) in parts.into_iter().filter(|(array, _)| *array == SAMPLES || is_there(array)) {
            let found = open(array)?;
            let axes = ["frame", "row", "column"].into_iter().chain(axis);
            let named = found.dimension_names().iter().flatten().map(|name| name.as_deref().unwrap_or_default());
            if !named.eq(axes.clone()) {
                return Err(damaged(&format!("the axes of `{array}` are not {}", axes.collect::<Vec<_>>().join(", "))));
            }
            let count = axis.map_or(1, |_| usize::try_from(found.shape()[3]).unwrap_or(usize::MAX));
            let [frames, rows, columns] = [found.shape()[0], found.shape()[1], found.shape()[2]];
            if *form.get_or_insert([frames, rows, columns]) != [frames, rows, columns] {
                return Err(damaged(&format!("`{array}` has another shape than `{SAMPLES}`")));
            }
            let end = count.saturating_add(next);
            let axes = [Some(0), Some(1), Some(2), axis.map(|_| 3)];
            let layout = (array, axis, next..end);
            next = end;
            arrays.push(StoredArray::of(found, layout, axes, true, name)?);
        }
        if next != channels.len() {
            return Err(damaged(&format!(
                "its arrays have not the {} that it names",
                counted(channels.len() as u64, "channels")
            )));
        }
        let records = open(METADATA)?;
        let [frames, rows, columns] = form.unwrap_or_default();
        if records.shape() != [frames] || *records.data_type() != data_type::string() {
            return Err(damaged(&format!("its metadata are not of {}", counted(frames, "frames"))));
        }
        let origin = |at: usize| attributes["origin"][at].as_i64().and_then(|at| i32::try_from(at).ok());
        let origin = [origin(0), origin(1)].map(Option::unwrap_or_default);
        let geometry = Geometry { origin, ..geometry(columns, rows, channels, name)? };
        let records = Some(Records { array: records, kept: Mutex::new((u64::MAX, Vec::new())) });
        let own_tags = Metadata::new(QuantityKind::Unspecified);
        Ok(Self { name: name.to_owned(), arrays, records, geometry, own_tags, frames })
    }

    /// A single array, by the names of its axes, or, where they have none, as rows and columns, with frames before and channels
    /// behind them.
    fn of_array(store: &Arc<FilesystemStore>, name: &str) -> Result<Self> {
        let array = Array::open(store.clone(), "/").map_err(|error| match error {
            ArrayCreateError::MissingMetadata => Error::format(name, "it is neither a stack nor another array of Zarr"),
            other => unreadable(name, &other),
        })?;
        let shape = array.shape().to_vec();
        let axes = axes_of(array.dimension_names().as_deref(), shape.len()).ok_or_else(|| {
            let named: Vec<&str> = array.dimension_names().iter().flatten().filter_map(Option::as_deref).collect();
            let found = match shape.len() {
                count if named.len() == count => format!("its axes are {}", named.join(", ")),
                1 => "it has a single axis".into(),
                count => format!("it has {count} axes, some without names"),
            };
            Error::format(
                name,
                format!("{found}; wanted are row, column, or frame, row, column, channel, in this order"),
            )
        })?;
        let along = |axis: Option<usize>| axis.map_or(1, |axis| shape[axis]);
        let [frames, rows, columns, channels] = axes.map(along);
        let names = match channels {
            1 => vec!["Y".to_owned()],
            3 => ["R", "G", "B"].map(str::to_owned).to_vec(),
            4 => ["R", "G", "B", "A"].map(str::to_owned).to_vec(),
            0..=MAX_CHANNELS => (0..channels).map(|channel| format!("C{channel}")).collect(),
            _ => return Err(Error::format(name, format!("it has {channels} channels; no frame has so many"))),
        };
        let geometry = geometry(columns, rows, names, name)?;
        let layout = (SAMPLES, axes[3].map(|_| CHANNEL), 0..geometry.channels.len());
        let arrays = vec![StoredArray::of(array, layout, axes, false, name)?];
        let own_tags = Metadata::new(QuantityKind::Unspecified);
        Ok(Self { name: name.to_owned(), arrays, records: None, geometry, own_tags, frames })
    }

    /// The metadata of a frame.
    fn record(&self, index: u64) -> Result<Option<String>> {
        let Some(Records { array, kept }) = &self.records else { return Ok(None) };
        let chunk = array.chunk_shape(&[0]).map_err(|error| unreadable(&self.name, &error))?[0].get();
        let (kept_chunk, kept) = &mut *kept.lock().unwrap_or_else(PoisonError::into_inner);
        if *kept_chunk != index / chunk {
            let found = array.retrieve_chunk_if_exists(&[index / chunk]).map_err(|error| self.damaged(&error))?;
            *kept = found.ok_or_else(|| self.missing(&array.chunk_key(&[index / chunk])))?;
            *kept_chunk = index / chunk;
        }
        // A chunk has as many as it says, or was not decoded.
        Ok(kept.get(usize::try_from(index % chunk).unwrap_or(usize::MAX)).cloned())
    }

    fn damaged(&self, error: &ArrayError) -> Error {
        unreadable(&self.name, error)
    }

    fn missing(&self, key: &StoreKey) -> Error {
        Error::format(&self.name, format!("`{key}` is missing"))
    }
}

/// Rows, columns and channels as a frame has them.
fn geometry(columns: u64, rows: u64, channels: Vec<String>, name: &str) -> Result<Geometry> {
    let most = i32::MAX.unsigned_abs().into();
    let [width, height] =
        [columns, rows].map(|count| if count > most { 0 } else { usize::try_from(count).unwrap_or(0) });
    if width == 0 || height == 0 || channels.is_empty() {
        let count = channels.len();
        return Err(Error::format(name, format!("{columns}x{rows} pixels of {count} channels are no frame")));
    }
    Ok(Geometry { width, height, origin: [0, 0], channels })
}

/// Where frame, row, column and channel are among axes; none where these are others, or in another order.
fn axes_of(names: Option<&[Option<String>]>, count: usize) -> Option<[Option<usize>; 4]> {
    const KNOWN: [&[&str]; 4] = [
        &["frame", "time", "t", "exposure", "index"],
        &["row", "y", "line"],
        &["column", "col", "x"],
        &["channel", "c", "band", "rgb"],
    ];
    let names: Vec<&str> = names.into_iter().flatten().map(|name| name.as_deref().unwrap_or_default()).collect();
    if names.iter().all(|name| name.is_empty()) {
        return match count {
            2 => Some([None, Some(0), Some(1), None]),
            3 => Some([Some(0), Some(1), Some(2), None]),
            4 => Some([Some(0), Some(1), Some(2), Some(3)]),
            _ => None,
        };
    }
    let mut axes = [None; 4];
    let mut next = 0;
    for (at, name) in names.iter().enumerate() {
        let place = (next..KNOWN.len()).find(|place| KNOWN[*place].contains(&name.to_ascii_lowercase().as_str()))?;
        axes[place] = Some(at);
        next = place + 1;
    }
    (names.len() == count && axes[1].is_some() && axes[2].is_some()).then_some(axes)
}

/// How samples of a type are stored; none of types that are not read.
fn sample_type(stored: &DataType) -> Option<SampleType> {
    let known = [
        (data_type::uint8(), SampleType::U8),
        (data_type::int8(), SampleType::I8),
        (data_type::uint16(), SampleType::U16),
        (data_type::int16(), SampleType::I16),
        (data_type::uint32(), SampleType::U32),
        (data_type::int32(), SampleType::I32),
        (data_type::float16(), SampleType::F16),
        (data_type::float32(), SampleType::F32),
        (data_type::float64(), SampleType::F64),
    ];
    known.into_iter().find_map(|(known, found)| (known == *stored).then_some(found))
}

impl StoredArray {
    fn of(
        array: Array<FilesystemStore>,
        (part, axis, channels): (&'static str, Option<&'static str>, std::ops::Range<usize>),
        axes: [Option<usize>; 4],
        is_ours: bool,
        name: &str,
    ) -> Result<Self> {
        let stored = sample_type(array.data_type()).ok_or_else(|| {
            let described = serde_json::to_value(array.metadata()).unwrap_or_default();
            let kind = &described["data_type"];
            let kind = kind.as_str().or_else(|| kind["name"].as_str()).unwrap_or("unknown");
            let problem = format!(
                "its samples are of type {kind}, which is not read; numbers of 32 bits or fewer are, and float64"
            );
            Error::format(name, problem)
        })?;
        let first = vec![0; array.dimensionality()];
        let chunk = array.chunk_shape(&first).map_err(|error| unreadable(name, &error))?;
        let inner = array.subchunk_shape().filter(|_| array.is_exclusively_sharded());
        let shards = inner.is_some().then(|| Shards::of(&array, name)).transpose()?;
        let chunk = inner.unwrap_or(chunk);
        let sizes = chunk.iter().map(|size| size.get());
        let bytes = sizes.fold(stored.bytes() as u64, u64::saturating_mul);
        if bytes > MAX_CHUNK_BYTES {
            let size = bytes >> 20;
            return Err(Error::format(name, format!("its chunks are of {size} MiB; none may be larger than 1 GiB")));
        }
        let part = Part { name: part, axis, channels, stored };
        Ok(Self { array, part, axes, chunk, shards, is_ours, kept: Mutex::default() })
    }

    /// The size of a chunk along an axis of frame, row, column and channel.
    fn size(&self, axis: usize) -> usize {
        self.axes[axis].map_or(1, |axis| usize::try_from(self.chunk[axis].get()).unwrap_or(usize::MAX))
    }

    /// Fills planes, of `row_samples` a row of the frame, with some rows of a frame.
    fn fill(&self, stack: &Stack, frame: u64, first: usize, samples: &mut [f32]) -> Result<()> {
        let Geometry { width, .. } = stack.geometry;
        let row_samples = stack.geometry.row_samples();
        let count = self.part.channels.len();
        let [frames, rows, columns, channels] = [0, 1, 2, 3].map(|axis| self.size(axis));
        let frames = frames as u64;
        let (end, bytes) = (first + samples.len() / row_samples, self.part.stored.bytes());
        for row in (first / rows * rows..end).step_by(rows) {
            for column in (0..width).step_by(columns) {
                for channel in (0..count).step_by(channels) {
                    let place =
                        [frame / frames, (row / rows) as u64, (column / columns) as u64, (channel / channels) as u64];
                    let chunk = self.chunk_at(stack, place)?;
                    let in_frame = usize::try_from(frame % frames).unwrap_or_default() * rows;
                    for y in row.max(first)..(row + rows).min(end) {
                        let start = (in_frame + y - row) * columns * channels * bytes;
                        let pixels = &chunk[start..start + columns * channels * bytes];
                        let target = &mut samples[(y - first) * row_samples..][..row_samples];
                        for plane in channel..(channel + channels).min(count) {
                            let target = &mut target[(self.part.channels.start + plane) * width..][..width];
                            let target = &mut target[column..(column + columns).min(width)];
                            self.take(target, pixels, plane - channel, &stack.name)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes one channel of pixels.
    fn take(&self, target: &mut [f32], pixels: &[u8], channel: usize, name: &str) -> Result<()> {
        let step = self.size(3);
        match self.part.stored {
            SampleType::U8 => pick(target, pixels, channel, step, |[byte]: [u8; 1]| byte.into()),
            SampleType::I8 => pick(target, pixels, channel, step, |bytes| i8::from_ne_bytes(bytes).into()),
            SampleType::U16 => pick(target, pixels, channel, step, |bytes| u16::from_ne_bytes(bytes).into()),
            SampleType::I16 => pick(target, pixels, channel, step, |bytes| i16::from_ne_bytes(bytes).into()),
            SampleType::U32 => pick(target, pixels, channel, step, |bytes| to_sample(u32::from_ne_bytes(bytes).into())),
            SampleType::I32 => pick(target, pixels, channel, step, |bytes| to_sample(i32::from_ne_bytes(bytes).into())),
            SampleType::F16 => pick(target, pixels, channel, step, |bytes| f16::from_ne_bytes(bytes).to_f32()),
            SampleType::F32 => pick(target, pixels, channel, step, f32::from_ne_bytes),
            SampleType::F64 => {
                let mut is_beyond = false;
                pick(target, pixels, channel, step, |bytes| {
                    let (double, single) = (f64::from_ne_bytes(bytes), to_sample(f64::from_ne_bytes(bytes)));
                    is_beyond |= single.is_infinite() && double.is_finite();
                    single
                });
                if is_beyond {
                    return Err(Error::format(name, "it has samples beyond 3.4e38, the largest of single precision"));
                }
            }
        }
        Ok(())
    }

    /// A chunk, whole and with its checksum held; places are those of frame, row, column and channel.
    fn chunk_at(&self, stack: &Stack, place: [u64; 4]) -> Result<Arc<Vec<u8>>> {
        let mut indices = vec![0; self.array.dimensionality()];
        for (axis, index) in self.axes.iter().zip(place) {
            axis.iter().for_each(|axis| indices[*axis] = index);
        }
        let kept = &mut *self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, chunk)) = kept.iter().find(|(known, _)| *known == indices) {
            return Ok(chunk.clone());
        }
        let chunk = Arc::new(self.decode(stack, &indices)?);
        let most = if self.is_ours { 0 } else { KEPT_BYTES / chunk.len().max(1) };
        while kept.len() > most {
            kept.pop_front();
        }
        kept.push_back((indices, chunk.clone()));
        Ok(chunk)
    }

    fn decode(&self, stack: &Stack, indices: &[u64]) -> Result<Vec<u8>> {
        let failed = |error: &dyn Display| unreadable(&stack.name, error);
        if self.is_ours {
            self.check_there(stack, indices)?;
        }
        let options = CodecOptions::default().with_concurrent_target(rayon::current_num_threads());
        let (stored, zero) = (self.array.data_type(), self.array.fill_value());
        let count = self.chunk.iter().map(|size| size.get()).product();
        let decoded = match &self.shards {
            None => self.array.retrieve_chunk_opt::<ArrayBytes<'static>>(indices, &options).map_err(|e| failed(&e))?,
            Some(Shards { indices: known, codecs }) => {
                if known.len() > KEPT_SHARDS {
                    known.clear();
                }
                match self.array.retrieve_encoded_subchunk(known, indices).map_err(|e| failed(&e))? {
                    Some(bytes) => {
                        let decoded = codecs.decode(bytes.into(), &self.chunk, stored, zero, &options);
                        decoded.map_err(|e| failed(&e))?
                    }
                    None => ArrayBytes::new_fill_value(stored, count, zero).map_err(|e| failed(&e))?,
                }
            }
        };
        let bytes = decoded.into_fixed().map_err(|e| failed(&e))?.into_owned();
        let expected = count.saturating_mul(self.part.stored.bytes() as u64);
        if bytes.len() as u64 == expected {
            return Ok(bytes);
        }
        Err(failed(&format!("a chunk has {} bytes, where {expected} are wanted", bytes.len())))
    }

    /// Makes sure that the shard of a chunk is there: Zarr takes what is not for zero.
    fn check_there(&self, stack: &Stack, indices: &[u64]) -> Result<()> {
        let shard = self.array.chunk_shape(&vec![0; indices.len()]).map_err(|error| unreadable(&stack.name, &error))?;
        let sizes = shard.iter().zip(&self.chunk).map(|(shard, chunk)| (shard.get() / chunk.get()).max(1));
        let shard: Vec<u64> = indices.iter().zip(sizes).map(|(index, chunks)| index / chunks).collect();
        let key = self.array.chunk_key(&shard);
        match self.array.storage().size_key(&key).map_err(|error| unreadable(&stack.name, &error))? {
            Some(_) => Ok(()),
            None => Err(stack.missing(&key)),
        }
    }
}

impl Shards {
    fn of(array: &Array<FilesystemStore>, name: &str) -> Result<Self> {
        let codec = array.codecs().array_to_bytes_codec().configuration_v3(&CodecMetadataOptions::default());
        let inner = codec.and_then(|found| found.get("codecs").cloned()).unwrap_or_default();
        let inner: Vec<MetadataV3> = serde_json::from_value(inner).map_err(|error| unreadable(name, &error))?;
        let codecs = CodecChain::from_metadata(&inner).map_err(|error| unreadable(name, &error))?;
        Ok(Self { indices: ArrayShardedReadableExtCache::new(array), codecs })
    }
}

/// A frame of a stack.
pub struct StackedFrame {
    stack: Arc<Stack>,
    index: u64,
    record: Option<String>,
    next_row: usize,
}

impl StackedFrame {
    /// Opens a frame, counted from 0.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where there is no such frame; [`Error::Format`] where its metadata are damaged.
    pub fn open(stack: &Arc<Stack>, index: u64) -> Result<Self> {
        if index >= stack.frames {
            let problem =
                format!("{}: it has no frame {index}; it has {}", stack.name, counted(stack.frames, "frames"));
            return Err(Error::Usage(problem));
        }
        Ok(Self { stack: stack.clone(), index, record: stack.record(index)?, next_row: 0 })
    }

    /// What messages call it.
    pub fn name(&self) -> String {
        let Self { stack, index, .. } = self;
        if *index == 0 { stack.name.clone() } else { format!("{}{FRAME_OF}{index}", stack.name) }
    }
}

impl SampleReader for StackedFrame {
    fn geometry(&self) -> &Geometry {
        &self.stack.geometry
    }

    fn stored_as(&self) -> Option<SampleType> {
        self.stack.arrays.first().map(|array| array.part.stored)
    }

    fn natural_rows(&self) -> usize {
        self.stack.arrays.first().map_or(1, |array| array.size(1))
    }

    fn embedded(&self) -> Option<&str> {
        self.record.as_deref()
    }

    fn describes_samples(&self) -> bool {
        true
    }

    fn own_tags(&self) -> &Metadata {
        &self.stack.own_tags
    }

    fn notes(&self) -> &[String] {
        &[]
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let first = samples.len();
        samples.resize(first + rows * self.stack.geometry.row_samples(), 0.0);
        for array in &self.stack.arrays {
            array.fill(&self.stack, self.index, self.next_row, &mut samples[first..])?;
        }
        self.next_row += rows;
        Ok(())
    }
}

/// Takes every `step`-th sample, from one on.
fn pick<const N: usize>(
    target: &mut [f32],
    bytes: &[u8],
    from: usize,
    step: usize,
    mut sample: impl FnMut([u8; N]) -> f32,
) {
    for (target, bytes) in target.iter_mut().zip(bytes.as_chunks().0.iter().skip(from).step_by(step)) {
        *target = sample(*bytes);
    }
}

fn unreadable(name: &str, error: &dyn Display) -> Error {
    Error::format(name, format!("it cannot be read: {error}"))
}

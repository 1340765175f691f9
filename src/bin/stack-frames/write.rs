//! Writes stacks: frame after frame, a shard of each array in memory at a time, whole or not at all.

use crate::layout::SCHEMA;
use crate::layout::{CHANNEL, LAYER, MASK, METADATA, Part, SAMPLES, SIGMA, Shards, parts};
use cyanometer::error::{Error, Result};
use cyanometer::formats::atomic::{AtomicDirectory, filling};
use cyanometer::formats::digest::SamplesDigest;
use cyanometer::formats::format::SampleType;
use cyanometer::formats::output::{SampleKind, doubt_of_codes};
use cyanometer::formats::places::STACK_DESCRIPTION;
use cyanometer::formats::{free_space, register, yaml};
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FrameHeader, SamplesRecord};
use cyanometer::stages::saturation::bits;
use cyanometer::stream::{Counts, RowSource};
use cyanometer::units::QuantityKind;
use half::f16;
use serde_json::{Map, Value, json};
use std::fmt;
use std::io;
use std::path::Path;
use std::sync::Arc;
use zarrs::array::codec::{Crc32cCodec, GzipCodec};
use zarrs::array::{
    Array, ArrayBuilder, ArrayBytes, ArrayError, ArrayMetadataOptions, BytesToBytesCodecTraits, CodecOptions,
    FillValue, IntoArrayBytes, data_type,
};
use zarrs::filesystem::FilesystemStore;
use zarrs::storage::StorageError;

/// Metadata of so many frames are in one chunk.
const RECORDS_PER_CHUNK: usize = 1024;
/// How hard gzip tries: beyond it noise takes longer and no less room.
const GZIP_LEVEL: u32 = 4;

/// How a stack is written.
#[derive(Debug, Clone, Copy, Default)]
pub struct StackOptions {
    /// Sample type; by default 16-bit integers for codes, 32-bit floats for others.
    pub samples: Option<SampleKind>,
    /// Whether chunks are compressed, by gzip.
    pub is_compressed: bool,
}

/// A stack that is being written.
pub struct StackWriter {
    directory: AtomicDirectory,
    store: Arc<FilesystemStore>,
    options: StackOptions,
    /// None before the first frame, whose form all others have.
    form: Option<Form>,
    records: Vec<String>,
    frames: u64,
}

/// What all frames have in common, and the arrays that their samples go to.
struct Form {
    first: FrameHeader,
    stored: SampleType,
    arrays: Vec<ShardedArray>,
}

impl StackWriter {
    /// Begins a stack; one that is there stays until the new one is complete.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where frames of it are being read; [`Error::Format`] for what is there and is no stack; [`Error::Disk`].
    pub fn create(path: &Path, options: StackOptions) -> Result<Self> {
        let name = path.display().to_string();
        check_replaceable(path, &name)?;
        let directory = AtomicDirectory::create(path)?;
        let store = FilesystemStore::new(directory.path())
            .map_err(|error| Error::format(&name, format!("it cannot be written: {error}")))?;
        Ok(Self { directory, store: Arc::new(store), options, form: None, records: Vec::new(), frames: 0 })
    }

    /// Adds a frame, of which nothing is read yet.
    ///
    /// # Errors
    ///
    /// Those of the frame; [`Error::Format`] for a frame of another form than the first; [`Error::Data`] for samples that the
    /// stack's type does not hold; [`Error::Disk`].
    pub fn add(&mut self, frame: &mut dyn RowSource) -> Result<()> {
        let header = frame.header().clone();
        let form = match &mut self.form {
            Some(form) => {
                form.check(&header)?;
                form
            }
            None => self.form.insert(Form::of(&header, &self.store, self.options, self.directory.name())?),
        };
        let geometry = &header.geometry;
        if !self.options.is_compressed {
            let bytes = form.arrays.iter().map(|array| array.part.row_bytes(geometry.width) as u64).sum::<u64>();
            free_space::check_directory(
                self.directory.path(),
                self.directory.name(),
                bytes.saturating_mul(geometry.height as u64),
            )?;
        }
        let (mut digest, mut rows, mut left) = (SamplesDigest::new(), Vec::new(), geometry.height);
        let step = geometry.step_rows(frame.natural_rows()).max(1);
        while left > 0 {
            rows.clear();
            frame.read(step.min(left), &mut rows)?;
            form.round(&mut rows, geometry, &header.name)?;
            digest.update_rows(&rows, geometry);
            for row in rows.chunks_exact(geometry.row_samples()) {
                form.arrays.iter_mut().try_for_each(|array| array.push(row))?;
            }
            left -= step.min(left);
        }
        let mut metadata = header.metadata;
        // What is counted of a file's samples stands in its sidecar.
        let known = metadata.samples.take().unwrap_or_else(|| Counts::default().record(String::new()));
        let one_value = digest.is_of_one_value();
        metadata.samples = Some(SamplesRecord { digest: digest.finish(), one_value, ..known });
        self.records.push(yaml::write_metadata(&metadata)?);
        self.frames += 1;
        if self.records.len() == RECORDS_PER_CHUNK { self.write_records() } else { Ok(()) }
    }

    /// Ends the stack and gives it its name; tells how many frames it has.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] where there are none; [`Error::Disk`]. Nothing is left behind then.
    pub fn finish(mut self) -> Result<u64> {
        let Some(Form { first, arrays, .. }) = self.form.take() else {
            return Err(Error::Data(format!("{}: a stack has a frame or more; none came", self.directory.name())));
        };
        if !self.records.is_empty() {
            self.write_records()?;
        }
        let name = self.directory.name();
        let names = |part: &Part| part.channels.clone().map(|index| first.channel_name(index).to_owned()).collect();
        for array in arrays {
            if let Some(axis) = array.part.axis {
                write_names(&self.store, axis, names(&array.part), name)?;
            }
            array.finish(self.frames)?;
        }
        self.describe_group(&first)?;
        self.directory.commit()?;
        Ok(self.frames)
    }

    /// Writes the description of the group, which has those of all arrays, as xarray looks for them.
    fn describe_group(&self, first: &FrameHeader) -> Result<()> {
        let (path, name) = (self.directory.path(), self.directory.name());
        let failed = |e: io::Error| Error::disk(name, "write", e);
        let mut arrays = Map::new();
        for array in [CHANNEL, LAYER, MASK, METADATA, SAMPLES, SIGMA] {
            let description = path.join(array).join(STACK_DESCRIPTION);
            if description.is_file() {
                let text = std::fs::read(&description).map_err(failed)?;
                let read = serde_json::from_slice::<Value>(&text).map_err(|error| unwritable(name, &error))?;
                arrays.insert(array.to_owned(), read);
            }
        }
        let group = json!({
            "zarr_format": 3,
            "node_type": "group",
            "attributes": {
                "schema": SCHEMA,
                "quantity": first.metadata.quantity,
                "unit": first.metadata.unit,
                "origin": first.geometry.origin,
                "channels": first.geometry.channels,
                "software": format!("cyanometer {}", env!("CARGO_PKG_VERSION")),
            },
            "consolidated_metadata": {"kind": "inline", "must_understand": false, "metadata": arrays},
        });
        let _one = filling();
        std::fs::write(path.join(STACK_DESCRIPTION), format!("{group:#}\n")).map_err(failed)
    }

    /// Writes the metadata of the last frames.
    fn write_records(&mut self) -> Result<()> {
        let name = self.directory.name();
        let mut records = std::mem::take(&mut self.records);
        records.resize(RECORDS_PER_CHUNK, String::new());
        let mut builder = ArrayBuilder::new([self.frames], [RECORDS_PER_CHUNK as u64], data_type::string(), "");
        builder.bytes_to_bytes_codecs(vec![Arc::new(Crc32cCodec::new())]);
        let array = built(builder, &["frame"], Map::new(), &self.store, METADATA, name)?;
        store(&array, &[self.frames.div_ceil(RECORDS_PER_CHUNK as u64) - 1], records, name)
    }
}

/// Makes sure that nothing lies at a place, or a stack of ours that is not being read.
fn check_replaceable(path: &Path, name: &str) -> Result<()> {
    let Ok(about) = std::fs::symlink_metadata(path) else { return Ok(()) };
    let description = path.join(STACK_DESCRIPTION);
    let is_ours = std::fs::read(&description).is_ok_and(|text| {
        serde_json::from_slice::<Value>(&text).is_ok_and(|found| found["attributes"]["schema"] == SCHEMA)
    });
    if !is_ours {
        let what = if about.is_dir() { "a directory" } else { "a file" };
        return Err(Error::format(
            name,
            format!("{what} is there that is no stack; name another output, or remove it"),
        ));
    }
    std::fs::metadata(&description).map_or(Ok(()), |about| register::check_output(&about, name))
}

impl Form {
    fn of(header: &FrameHeader, store: &Arc<FilesystemStore>, options: StackOptions, name: &str) -> Result<Self> {
        let metadata = &header.metadata;
        let are_codes = metadata.quantity == QuantityKind::Adu && metadata.demosaic.is_none();
        let are_whole = are_codes && metadata.correction.is_none() && metadata.average.is_none();
        let stored = match options.samples {
            None if are_whole => SampleType::U16,
            None | Some(SampleKind::F32) => SampleType::F32,
            Some(SampleKind::F16) => SampleType::F16,
            Some(SampleKind::U16) => SampleType::U16,
        };
        if stored == SampleType::F16 {
            doubt_of_codes(name, header);
        }
        let attributes = Map::from_iter([
            ("long_name".to_owned(), json!(metadata.quantity.to_string())),
            ("units".to_owned(), json!(metadata.unit)),
        ]);
        let array = |part: Part| {
            let attributes = if part.name == SAMPLES { attributes.clone() } else { Map::new() };
            ShardedArray::create(part, attributes, &header.geometry, store, options.is_compressed, name)
        };
        let parts = parts(&header.geometry.channels, !metadata.history.is_empty(), stored);
        Ok(Self { first: header.clone(), stored, arrays: parts.into_iter().map(array).collect::<Result<_>>()? })
    }

    /// Refuses a frame that cannot stand in the same arrays.
    fn check(&self, frame: &FrameHeader) -> Result<()> {
        let form = |frame: &FrameHeader| {
            let Geometry { width, height, origin: [x, y], channels } = &frame.geometry;
            let unit = &frame.metadata.unit;
            let channels = channels.join(", ");
            format!("{width}x{height} at {x},{y}, {channels} of {} in {unit}", frame.metadata.quantity)
        };
        let [its, theirs] = [frame, &self.first].map(form);
        if its == theirs {
            return Ok(());
        }
        let first = &self.first.name;
        Err(frame.refuse(format!("it is {its}, but {first} is {theirs}; frames of a stack have one form")))
    }

    /// Makes of rows what a reader will get.
    fn round(&self, rows: &mut [f32], geometry: &Geometry, name: &str) -> Result<()> {
        let planes = self.arrays.first().map_or(0, |array| array.part.channels.len()) * geometry.width;
        let samples = rows.chunks_exact_mut(geometry.row_samples()).flat_map(|row| &mut row[..planes]);
        match self.stored {
            SampleType::U16 => match samples.into_iter().find(|sample| **sample != f32::from(code(**sample))) {
                None => Ok(()),
                Some(sample) => Err(Error::Data(format!(
                    "{name}: the sample {sample} is no whole number from 0 to 65535, which u16 would keep; store f32"
                ))
                .change(&["sample_type"])),
            },
            SampleType::F16 => {
                for sample in samples {
                    let rounded = f16::from_f32(*sample).to_f32();
                    if rounded.is_infinite() && sample.is_finite() {
                        return Err(Error::Data(format!(
                            "{name}: the sample {sample} would become infinite as f16, which ends at 65504; store f32"
                        ))
                        .change(&["sample_type"]));
                    }
                    *sample = rounded;
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

/// An array whose shards are filled row by row.
struct ShardedArray {
    array: Array<FilesystemStore>,
    part: Part,
    geometry: Geometry,
    shards: Shards,
    /// The shard that fills, zero where no sample came; samples in the machine's own order of bytes.
    buffer: Vec<u8>,
    is_empty: bool,
    /// The frame that fills, and its next row.
    frame: usize,
    row: usize,
    name: String,
}

impl ShardedArray {
    fn create(
        part: Part,
        attributes: Map<String, Value>,
        geometry: &Geometry,
        store: &Arc<FilesystemStore>,
        is_compressed: bool,
        name: &str,
    ) -> Result<Self> {
        let row_bytes = part.row_bytes(geometry.width);
        let shards = Shards::of(geometry.height, row_bytes);
        let mut shape = part.shape(shards.frames as u64, geometry);
        shape[1] = shards.rows as u64;
        let (kind, zero) = match part.stored {
            SampleType::U8 => (data_type::uint8(), FillValue::from(0_u8)),
            SampleType::U16 => (data_type::uint16(), FillValue::from(0_u16)),
            SampleType::F16 => (data_type::float16(), FillValue::from(f16::ZERO)),
            _ => (data_type::float32(), FillValue::from(0.0_f32)),
        };
        let mut builder = ArrayBuilder::new(part.shape(1, geometry), shape.clone(), kind, zero);
        (shape[0], shape[1]) = (1, shards.chunk_rows as u64);
        let gzip = GzipCodec::new(GZIP_LEVEL).map_err(|error| unwritable(name, &error))?;
        let gzip: Option<Arc<dyn BytesToBytesCodecTraits>> = is_compressed.then(|| Arc::new(gzip) as _);
        let codecs = gzip.into_iter().chain([Arc::new(Crc32cCodec::new()) as _]).collect();
        builder.subchunk_shape(shape).bytes_to_bytes_codecs(codecs);
        let axes: Vec<&str> = part.axes().collect();
        let array = built(builder, &axes, attributes, store, part.name, name)?;
        let buffer = vec![0; shards.frames * shards.rows * row_bytes];
        let (geometry, name) = (geometry.clone(), name.to_owned());
        Ok(Self { array, part, geometry, shards, buffer, is_empty: true, frame: 0, row: 0, name })
    }

    /// Adds the next row, of all channels of the frame.
    fn push(&mut self, row: &[f32]) -> Result<()> {
        let Shards { rows, frames, .. } = self.shards;
        let Geometry { width, height, .. } = self.geometry;
        let bytes = self.part.row_bytes(width);
        let start = (self.frame % frames * rows + self.row % rows) * bytes;
        let target = &mut self.buffer[start..start + bytes];
        let planes = &row[self.part.channels.start * width..self.part.channels.end * width];
        match self.part.stored {
            SampleType::U8 => interleave(target, planes, width, |mark| [bits(mark).to_le_bytes()[0]]),
            SampleType::U16 => interleave(target, planes, width, |sample| code(sample).to_ne_bytes()),
            SampleType::F16 => interleave(target, planes, width, |sample| f16::from_f32(sample).to_ne_bytes()),
            _ => interleave(target, planes, width, f32::to_ne_bytes),
        }
        self.is_empty = false;
        self.row += 1;
        let ends_frame = self.row == height;
        if (ends_frame || self.row.is_multiple_of(rows)) && (self.frame + 1).is_multiple_of(frames) {
            self.store()?;
        }
        if ends_frame {
            (self.frame, self.row) = (self.frame + 1, 0);
        }
        Ok(())
    }

    /// Writes the shard that the last row went to.
    fn store(&mut self) -> Result<()> {
        let place = match self.row {
            0 => [self.frame - 1, self.geometry.height - 1],
            row => [self.frame, row - 1],
        };
        let [frame, row] = [place[0] / self.shards.frames, place[1] / self.shards.rows].map(|index| index as u64);
        let channel = self.part.axis.map(|_| 0);
        let indices: Vec<u64> = [frame, row, 0].into_iter().chain(channel).collect();
        let shape = self.part.shape(place[0] as u64 + 1, &self.geometry);
        self.array.set_shape(shape).map_err(|error| unwritable(&self.name, &error))?;
        store(&self.array, &indices, ArrayBytes::new_flen(&self.buffer), &self.name)?;
        self.buffer.fill(0);
        self.is_empty = true;
        Ok(())
    }

    /// Writes what is left, and the description of the array.
    fn finish(mut self, frames: u64) -> Result<()> {
        if !self.is_empty {
            self.store()?;
        }
        let shape = self.part.shape(frames, &self.geometry);
        self.array.set_shape(shape).map_err(|error| unwritable(&self.name, &error))?;
        describe(&self.array, &self.name)
    }
}

/// The code nearest to a sample.
fn code(sample: f32) -> u16 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "what lies beyond is not what it was, which is told"
    )]
    let code = sample as u16;
    code
}

/// Lays planes out pixel by pixel.
fn interleave<const N: usize>(target: &mut [u8], planes: &[f32], width: usize, bytes: impl Fn(f32) -> [u8; N]) {
    let pixel = target.len() / width.max(1);
    for (channel, plane) in planes.chunks_exact(width.max(1)).enumerate() {
        for (pixel, sample) in target.chunks_exact_mut(pixel).zip(plane) {
            pixel[channel * N..][..N].copy_from_slice(&bytes(*sample));
        }
    }
}

/// An array that is described in the store.
fn built(
    mut builder: ArrayBuilder,
    axes: &[&'static str],
    attributes: Map<String, Value>,
    store: &Arc<FilesystemStore>,
    array: &str,
    name: &str,
) -> Result<Array<FilesystemStore>> {
    builder.attributes(attributes).dimension_names(Some(axes.iter().copied()));
    let array = builder.build(store.clone(), &format!("/{array}")).map_err(|error| unwritable(name, &error))?;
    describe(&array, name)?;
    Ok(array)
}

fn describe(array: &Array<FilesystemStore>, name: &str) -> Result<()> {
    let options = ArrayMetadataOptions::default().with_include_zarrs_metadata(false);
    let _one = filling();
    array.store_metadata_opt(&options).map_err(|error| of_storage(name, &error))
}

/// Writes names along an axis.
fn write_names(store: &Arc<FilesystemStore>, axis: &'static str, names: Vec<String>, name: &str) -> Result<()> {
    let count = names.len() as u64;
    let builder = ArrayBuilder::new([count], [count], data_type::string(), "");
    let array = built(builder, &[axis], Map::new(), store, axis, name)?;
    self::store(&array, &[0], names, name)
}

/// Writes a chunk or shard, which is there then, whatever it holds: one that is not is missing.
fn store<'a>(
    array: &Array<FilesystemStore>,
    indices: &[u64],
    elements: impl IntoArrayBytes<'a>,
    name: &str,
) -> Result<()> {
    let elements = elements.into_array_bytes(array.data_type()).map_err(|error| unwritable(name, &error))?;
    let options = CodecOptions::default()
        .with_concurrent_target(rayon::current_num_threads())
        .with_store_empty_chunks(elements.is_fill_value(array.fill_value()));
    let _one = filling();
    array.store_chunk_opt(indices, elements, &options).map_err(|error| match &error {
        ArrayError::StorageError(error) => of_storage(name, error),
        other => unwritable(name, other),
    })
}

fn of_storage(name: &str, error: &StorageError) -> Error {
    match error {
        StorageError::IOError(error) => {
            let plain = error.raw_os_error().map_or_else(|| error.kind().into(), io::Error::from_raw_os_error);
            Error::disk(name, "write", plain)
        }
        other => unwritable(name, other),
    }
}

fn unwritable(name: &str, error: &dyn fmt::Display) -> Error {
    Error::format(name, format!("it cannot be written: {error}"))
}

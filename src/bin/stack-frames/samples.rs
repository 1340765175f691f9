//! Arrays of samples in a store: chunk by chunk, of any type that frames can be of.

use crate::layout::Part;
use cyanometer::error::{Error, Result};
use cyanometer::formats::format::SampleType;
use cyanometer::frame::{Geometry, to_sample};
use half::f16;
use std::collections::VecDeque;
use std::fmt::Display;
use std::sync::{Arc, Mutex, PoisonError};
use zarrs::array::{
    Array, ArrayBytes, ArrayShardedExt, ArrayShardedReadableExt, ArrayShardedReadableExtCache, ArrayToBytesCodecTraits,
    ChunkShape, CodecChain, CodecMetadataOptions, CodecOptions, DataType, data_type,
};
use zarrs::filesystem::FilesystemStore;
use zarrs::metadata::v3::MetadataV3;
use zarrs::storage::{ReadableStorageTraits, StoreKey};

/// What is kept decoded of an array, besides the chunk that was read last: those of other columns, channels and frames that chunks of
/// other programs have.
const KEPT_BYTES: usize = 64 << 20;
/// What is decoded together may be so large.
const MAX_CHUNK_BYTES: u64 = 1 << 30;
/// Shards whose index is kept.
const KEPT_SHARDS: usize = 64;

/// An array of samples.
pub(super) struct StoredArray {
    /// What messages call the stack.
    name: String,
    array: Array<FilesystemStore>,
    pub(super) part: Part,
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

/// How samples of a type are stored; none of types that are not read.
fn sample_type(stored: &DataType) -> Option<SampleType> {
    let known = [
        (data_type::uint8(), SampleType::U8),
        (data_type::int8(), SampleType::I8),
        (data_type::uint16(), SampleType::U16),
        (data_type::int16(), SampleType::I16),
        (data_type::uint32(), SampleType::U32),
        (data_type::int32(), SampleType::I32),
        (data_type::uint64(), SampleType::U64),
        (data_type::int64(), SampleType::I64),
        (data_type::float16(), SampleType::F16),
        (data_type::float32(), SampleType::F32),
        (data_type::float64(), SampleType::F64),
    ];
    known.into_iter().find_map(|(known, found)| (known == *stored).then_some(found))
}

impl StoredArray {
    pub(super) fn of(
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
        Ok(Self { name: name.to_owned(), array, part, axes, chunk, shards, is_ours, kept: Mutex::default() })
    }

    /// The size of a chunk along an axis of frame, row, column and channel.
    pub(super) fn size(&self, axis: usize) -> usize {
        self.axes[axis].map_or(1, |axis| usize::try_from(self.chunk[axis].get()).unwrap_or(usize::MAX))
    }

    /// Fills planes of a frame, which is `whole` with those of other arrays, with some of its rows.
    pub(super) fn fill(&self, whole: &Geometry, frame: u64, first: usize, samples: &mut [f32]) -> Result<()> {
        let width = whole.width;
        let row_samples = whole.row_samples();
        let count = self.part.channels.len();
        let [frames, rows, columns, channels] = [0, 1, 2, 3].map(|axis| self.size(axis));
        let frames = frames as u64;
        let (end, bytes) = (first + samples.len() / row_samples, self.part.stored.bytes());
        for row in (first / rows * rows..end).step_by(rows) {
            for column in (0..width).step_by(columns) {
                for channel in (0..count).step_by(channels) {
                    let place =
                        [frame / frames, (row / rows) as u64, (column / columns) as u64, (channel / channels) as u64];
                    let chunk = self.chunk_at(place)?;
                    let in_frame = usize::try_from(frame % frames).unwrap_or_default() * rows;
                    for y in row.max(first)..(row + rows).min(end) {
                        let start = (in_frame + y - row) * columns * channels * bytes;
                        let pixels = &chunk[start..start + columns * channels * bytes];
                        let target = &mut samples[(y - first) * row_samples..][..row_samples];
                        for plane in channel..(channel + channels).min(count) {
                            let target = &mut target[(self.part.channels.start + plane) * width..][..width];
                            let target = &mut target[column..(column + columns).min(width)];
                            self.take(target, pixels, plane - channel)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes one channel of pixels.
    fn take(&self, target: &mut [f32], pixels: &[u8], channel: usize) -> Result<()> {
        let step = self.size(3);
        match self.part.stored {
            SampleType::U8 => pick(target, pixels, channel, step, |[byte]: [u8; 1]| byte.into()),
            SampleType::I8 => pick(target, pixels, channel, step, |bytes| i8::from_ne_bytes(bytes).into()),
            SampleType::U16 => pick(target, pixels, channel, step, |bytes| u16::from_ne_bytes(bytes).into()),
            SampleType::I16 => pick(target, pixels, channel, step, |bytes| i16::from_ne_bytes(bytes).into()),
            SampleType::U32 => pick(target, pixels, channel, step, |bytes| to_sample(u32::from_ne_bytes(bytes).into())),
            SampleType::I32 => pick(target, pixels, channel, step, |bytes| to_sample(i32::from_ne_bytes(bytes).into())),
            SampleType::U64 => pick(target, pixels, channel, step, |bytes| u64::from_ne_bytes(bytes) as f32),
            SampleType::I64 => pick(target, pixels, channel, step, |bytes| i64::from_ne_bytes(bytes) as f32),
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
                    return Err(Error::format(
                        &self.name,
                        "it has samples beyond 3.4e38, the largest of single precision",
                    ));
                }
            }
        }
        Ok(())
    }

    /// A chunk, whole and with its checksum held; places are those of frame, row, column and channel.
    fn chunk_at(&self, place: [u64; 4]) -> Result<Arc<Vec<u8>>> {
        let mut indices = vec![0; self.array.dimensionality()];
        for (axis, index) in self.axes.iter().zip(place) {
            axis.iter().for_each(|axis| indices[*axis] = index);
        }
        let kept = &mut *self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, chunk)) = kept.iter().find(|(known, _)| *known == indices) {
            return Ok(chunk.clone());
        }
        let chunk = Arc::new(self.decode(&indices)?);
        let most = if self.is_ours { 0 } else { KEPT_BYTES / chunk.len().max(1) };
        while kept.len() > most {
            kept.pop_front();
        }
        kept.push_back((indices, chunk.clone()));
        Ok(chunk)
    }

    fn decode(&self, indices: &[u64]) -> Result<Vec<u8>> {
        let failed = |error: &dyn Display| unreadable(&self.name, error);
        if self.is_ours {
            self.check_there(indices)?;
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
    fn check_there(&self, indices: &[u64]) -> Result<()> {
        let shard = self.array.chunk_shape(&vec![0; indices.len()]).map_err(|error| unreadable(&self.name, &error))?;
        let sizes = shard.iter().zip(&self.chunk).map(|(shard, chunk)| (shard.get() / chunk.get()).max(1));
        let shard: Vec<u64> = indices.iter().zip(sizes).map(|(index, chunks)| index / chunks).collect();
        let key = self.array.chunk_key(&shard);
        match self.array.storage().size_key(&key).map_err(|error| unreadable(&self.name, &error))? {
            Some(_) => Ok(()),
            None => Err(missing(&self.name, &key)),
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

pub(super) fn unreadable(name: &str, error: &dyn Display) -> Error {
    Error::format(name, format!("it cannot be read: {error}"))
}

/// The complaint about a part of a store that is not there.
pub(super) fn missing(name: &str, key: &StoreKey) -> Error {
    Error::format(name, format!("`{key}` is missing"))
}

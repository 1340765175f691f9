//! Uncompressed scanlines: their bytes straight to rows and back, and where files keep them.

use super::ExrSamples;
use exr::compression::Compression;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use half::f16;
use half::slice::HalfFloatSliceExt;

/// Bytes before the samples of a block: its y coordinate and its size, little-endian.
const HEAD_BYTES: usize = 8;

/// How the rows of an uncompressed part are laid out in its blocks, a row each.
pub(super) struct Straight {
    width: usize,
    /// The data window's first row.
    top: i32,
    samples: ExrSamples,
    /// For each channel of the rows, where its line begins in a block.
    lines: Vec<usize>,
    /// Bytes of a block with its head.
    pub block_bytes: usize,
}

impl Straight {
    /// The layout of part `part`, where it is one that needs no decoding: uncompressed scanlines in a file of one part, all
    /// f32 or all f16. `order` has, for each channel of the rows, its place in the file's list.
    pub fn of(meta: &MetaData, part: usize, order: &[usize]) -> Option<Self> {
        let header: &Header = &meta.headers[part];
        let is_plain = header.compression == Compression::Uncompressed && header.blocks == BlockDescription::ScanLines;
        if !is_plain || header.deep || meta.requirements.is_multilayer() {
            return None;
        }
        let samples = match header.channels.uniform_sample_type? {
            SampleType::F32 => ExrSamples::F32,
            SampleType::F16 => ExrSamples::F16,
            SampleType::U32 => return None,
        };
        let width = header.layer_size.width();
        let line_bytes = width.checked_mul(samples.bytes())?;
        let lines = order.iter().map(|place| HEAD_BYTES + place * line_bytes).collect();
        let block_bytes = HEAD_BYTES + header.max_block_byte_size();
        Some(Self { width, top: header.own_attributes.layer_position.y(), samples, lines, block_bytes })
    }

    /// Whether the head of a block is that of row `row`, whole.
    pub fn is_row(&self, block: &[u8], row: usize) -> bool {
        let [y, size] = [0, 4].map(|at| block[at..at + 4].first_chunk().map(|bytes| i32::from_le_bytes(*bytes)));
        let is_whole = size.and_then(|size| usize::try_from(size).ok()) == Some(self.block_bytes - HEAD_BYTES);
        is_whole && y.is_some_and(|y| i64::from(y) == i64::from(self.top) + row as i64)
    }

    /// Appends the row in a block, channel by channel.
    pub fn append(&self, block: &[u8], samples: &mut Vec<f32>) {
        for &start in &self.lines {
            let line = &block[start..start + self.width * self.samples.bytes()];
            match self.samples {
                ExrSamples::F32 => samples.extend(line.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes))),
                ExrSamples::F16 => append_halves(line, samples),
            }
        }
    }
}

/// Appends samples stored as f16, little-endian.
fn append_halves(line: &[u8], samples: &mut Vec<f32>) {
    let (mut halves, mut floats) = ([f16::ZERO; 256], [0.0; 256]);
    for some in line.as_chunks().0.chunks(halves.len()) {
        for (half, bytes) in halves.iter_mut().zip(some) {
            *half = f16::from_le_bytes(*bytes);
        }
        halves[..some.len()].convert_to_f32_slice(&mut floats[..some.len()]);
        samples.extend_from_slice(&floats[..some.len()]);
    }
}

/// Stores samples little-endian in `bytes`, which has their size.
pub(super) fn encode(line: &[f32], kind: ExrSamples, bytes: &mut [u8]) {
    match kind {
        ExrSamples::F32 => {
            for (to, sample) in bytes.as_chunks_mut().0.iter_mut().zip(line) {
                *to = sample.to_le_bytes();
            }
        }
        ExrSamples::F16 => {
            let mut halves = [f16::ZERO; 256];
            for (to, some) in bytes.chunks_mut(2 * halves.len()).zip(line.chunks(halves.len())) {
                halves[..some.len()].convert_from_f32_slice(some);
                for (to, half) in to.as_chunks_mut().0.iter_mut().zip(&halves) {
                    *to = half.to_le_bytes();
                }
            }
        }
    }
}

/// Where the blocks of a part begin in its file.
pub(super) enum Offsets {
    /// One behind another, all of one size; so no list is kept, however high the frame is.
    Even { first: u64, step: u64, count: u64 },
    /// Anywhere.
    Listed(Vec<u64>),
}

impl Offsets {
    /// No blocks yet.
    pub fn new() -> Self {
        Self::Even { first: 0, step: 0, count: 0 }
    }

    /// Adds the offset of the next block.
    pub fn push(&mut self, offset: u64) {
        match self {
            Self::Even { first, step, count } => {
                if *count == 0 {
                    *first = offset;
                } else if *count == 1 && offset > *first {
                    *step = offset - *first;
                } else if *count < 2 || step.checked_mul(*count).and_then(|d| first.checked_add(d)) != Some(offset) {
                    let mut listed: Vec<u64> = (0..*count).map(|index| *first + *step * index).collect();
                    listed.push(offset);
                    *self = Self::Listed(listed);
                    return;
                }
                *count += 1;
            }
            Self::Listed(listed) => listed.push(offset),
        }
    }

    /// Where block `index` begins.
    pub fn at(&self, index: usize) -> u64 {
        match self {
            Self::Even { first, step, .. } => first + step * index as u64,
            Self::Listed(listed) => listed[index],
        }
    }

    /// How many blocks of `bytes` bytes stand one behind another from block `index` on; at least that one, and not more
    /// than `most`.
    pub fn run(&self, index: usize, bytes: usize, most: usize) -> usize {
        match self {
            Self::Even { step, .. } if *step == bytes as u64 => most,
            Self::Even { .. } => 1,
            Self::Listed(listed) => {
                let pairs = listed[index..].windows(2).take(most - 1);
                1 + pairs.take_while(|pair| pair[0].checked_add(bytes as u64) == Some(pair[1])).count()
            }
        }
    }

    /// The smallest and the largest, where there are any, and whether any two are the same.
    pub fn extent(&self) -> (Option<(u64, u64)>, bool) {
        match self {
            Self::Even { count: 0, .. } => (None, false),
            Self::Even { first, step, count } => (Some((*first, first + step * (count - 1))), false),
            Self::Listed(listed) => {
                let mut sorted = listed.clone();
                sorted.sort_unstable();
                let twice = sorted.windows(2).any(|pair| pair[0] == pair[1]);
                (sorted.first().copied().zip(sorted.last().copied()), twice)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_kept_whether_even_or_not() {
        let given: [&[u64]; 8] = [
            &[],
            &[7],
            &[7, 7],
            &[9, 7],
            &[100, 110, 120, 130],
            &[100, 110, 120, 131, 141],
            &[100, 90, 80],
            &[u64::MAX - 1, u64::MAX, 3, 13],
        ];
        for offsets in given {
            let mut kept = Offsets::new();
            offsets.iter().for_each(|offset| kept.push(*offset));
            let found: Vec<u64> = (0..offsets.len()).map(|index| kept.at(index)).collect();
            assert_eq!(found, offsets);
            let ends = offsets.iter().min().copied().zip(offsets.iter().max().copied());
            let twice = offsets.len() == 2 && offsets[0] == offsets[1];
            assert_eq!(kept.extent(), (ends, twice), "{offsets:?}");
            for index in 0..offsets.len() {
                let follow = offsets[index..].windows(2).take_while(|pair| pair[0].wrapping_add(10) == pair[1]).count();
                let most = offsets.len() - index;
                assert_eq!(kept.run(index, 10, most), 1 + follow, "{offsets:?} {index}");
                assert_eq!(kept.run(index, 10, 1), 1);
            }
        }
    }

    #[test]
    fn halves_go_there_and_back() {
        let line: Vec<f32> = (0..1000_i16).map(|i| f32::from(i) / 8.0).chain([f32::INFINITY, -0.0]).collect();
        let mut bytes = vec![0; 2 * line.len()];
        encode(&line, ExrSamples::F16, &mut bytes);
        let mut back = Vec::new();
        append_halves(&bytes, &mut back);
        assert_eq!(back, line);
    }
}

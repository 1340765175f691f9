//! Stacks of frames on disk: Zarr stores of version 3, whose chunks lie together in shards, so that a million frames are some
//! thousand files. numpy's world reads them as they are (xarray, dask, napari).
//!
//! A store is a group with the attributes `schema`, [`SCHEMA`], `origin`, the column and row on the sensor of the first sample, and
//! `channels`, the names of all channels of a frame as its file has them; and with these arrays, the names of whose axes are given:
//!
//! | array | axes | |
//! |---|---|---|
//! | `samples` | frame, row, column, channel | samples, `float32`, `float16` or `uint16` |
//! | `channel` | channel | what its channels are: X, Y, Z of XYZ, which files keep as R, G, B |
//! | `sigma` | frame, row, column, layer | what tells how uncertain samples are, `float32`; where frames have it |
//! | `layer` | layer | names of its layers |
//! | `mask` | frame, row, column | marks of pixels, `uint8`; where frames have them |
//! | `metadata` | frame | the metadata of each frame, YAML, as a sidecar has them |
//!
//! An inner chunk is some rows of one frame; a shard holds many frames where they are small, and a part of one where they are large.

use cyanometer::formats::format::SampleType;
use cyanometer::frame::Geometry;
use cyanometer::sigma::is_layer;
use cyanometer::stages::saturation::MASK_LAYER;
use std::ops::Range;

/// The schema of a store of ours, an attribute of its group.
pub const SCHEMA: &str = "cyanometer-stack/1";

/// The size that an inner chunk aims at: what is decoded together.
const CHUNK_BYTES: usize = 1 << 20;
/// The size that a shard aims at: what is one file, and what is held while it fills.
const SHARD_BYTES: usize = 16 << 20;

/// An array of a stack, which has some channels of each frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    pub name: &'static str,
    /// The name of its last axis; none where it has no such axis.
    pub axis: Option<&'static str>,
    /// Its channels among those of the frame.
    pub channels: Range<usize>,
    pub stored: SampleType,
}

/// The samples of a frame.
pub const SAMPLES: &str = "samples";
/// What tells how uncertain they are.
pub const SIGMA: &str = "sigma";
/// Marks of pixels.
pub const MASK: &str = "mask";
/// The metadata of each frame.
pub const METADATA: &str = "metadata";
/// The axis of channels, and the array of their names.
pub const CHANNEL: &str = "channel";
/// The axis of layers, and the array of their names.
pub const LAYER: &str = "layer";

/// The parts of frames with these channels: samples, then layers of their uncertainty, then, in frames of ours, marks.
pub fn parts(channels: &[String], is_ours: bool, stored: SampleType) -> Vec<Part> {
    let has_mask = is_ours && channels.len() > 1 && channels.last().is_some_and(|last| last == MASK_LAYER);
    let unmarked = channels.len() - usize::from(has_mask);
    let planes = channels[..unmarked].iter().position(|name| is_layer(name)).unwrap_or(unmarked);
    // Layers among planes are planes of somebody else.
    let are_layers = planes > 0 && channels[planes..unmarked].iter().all(|name| is_layer(name));
    let planes = if are_layers { planes } else { unmarked };
    let part = |name, axis, channels: Range<usize>, stored| Part { name, axis, channels, stored };
    let all = [
        part(SAMPLES, Some(CHANNEL), 0..planes, stored),
        part(SIGMA, Some(LAYER), planes..unmarked, SampleType::F32),
        part(MASK, None, unmarked..channels.len(), SampleType::U8),
    ];
    all.into_iter().filter(|part| !part.channels.is_empty()).collect()
}

impl Part {
    /// The names of its axes.
    pub fn axes(&self) -> impl Iterator<Item = &'static str> {
        ["frame", "row", "column"].into_iter().chain(self.axis)
    }

    /// The shape of an array that has so many frames.
    pub fn shape(&self, frames: u64, geometry: &Geometry) -> Vec<u64> {
        let channels = self.axis.map(|_| self.channels.len() as u64);
        [frames, geometry.height as u64, geometry.width as u64].into_iter().chain(channels).collect()
    }

    /// Bytes of one row of all its channels.
    pub fn row_bytes(&self, width: usize) -> usize {
        width * self.channels.len() * self.stored.bytes()
    }
}

/// Rows and frames of inner chunks and shards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shards {
    /// Rows of an inner chunk, which is of one frame.
    pub chunk_rows: usize,
    /// Rows of a shard.
    pub rows: usize,
    /// Frames of a shard.
    pub frames: usize,
}

impl Shards {
    /// Those of frames of so many rows of so many bytes: many frames in a shard, or, where one is larger, some of its rows.
    pub fn of(height: usize, row_bytes: usize) -> Self {
        let (height, row_bytes) = (height.max(1), row_bytes.max(1));
        // Chunks of a frame are about alike, so that the last has few rows that the frame has not.
        let even = |rows: usize, most: usize| rows.div_ceil(rows.div_ceil(most));
        let chunk_rows = even(height, (CHUNK_BYTES / row_bytes).clamp(1, height));
        let chunks = height.div_ceil(chunk_rows);
        let chunk_bytes = chunk_rows * row_bytes;
        if chunks * chunk_bytes <= SHARD_BYTES {
            return Self { chunk_rows, rows: chunks * chunk_rows, frames: SHARD_BYTES / (chunks * chunk_bytes) };
        }
        let rows = chunk_rows * even(chunks, (SHARD_BYTES / chunk_bytes).clamp(1, chunks));
        Self { chunk_rows, rows, frames: 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(channels: &[&str], is_ours: bool) -> Vec<(&'static str, Range<usize>)> {
        let channels: Vec<String> = channels.iter().map(|name| (*name).to_owned()).collect();
        parts(&channels, is_ours, SampleType::F32).into_iter().map(|part| (part.name, part.channels)).collect()
    }

    #[test]
    fn layers_lie_beside_samples() {
        let all = ["X", "Y", "Z", "covariance.XX", "sigma.R", "mask"];
        assert_eq!(named(&all, true), [(SAMPLES, 0..3), (SIGMA, 3..5), (MASK, 5..6)]);
        // What others call so may be anything.
        assert_eq!(named(&["Y", "mask"], false), [(SAMPLES, 0..2)]);
        assert_eq!(named(&["sigma.R", "Y"], true), [(SAMPLES, 0..2)]);
        assert_eq!(named(&["Y", "mask"], true), [(SAMPLES, 0..1), (MASK, 1..2)]);
    }

    /// Whatever the size, chunks fill shards, shards cover frames, and no shard is larger than asked for but by a chunk of one row.
    #[test]
    fn shards_are_of_bounded_size() {
        for height in [1, 2, 47, 48, 999, 1000, 3040, 70_000] {
            for row_bytes in [1, 64 * 2, 1332 * 4, 4056 * 12, 70_000 * 12, 100 << 20] {
                let Shards { chunk_rows, rows, frames } = Shards::of(height, row_bytes);
                assert!(chunk_rows >= 1 && frames >= 1 && rows.is_multiple_of(chunk_rows), "{height} {row_bytes}");
                assert!(chunk_rows == 1 || chunk_rows * row_bytes <= CHUNK_BYTES);
                assert!(rows == chunk_rows || frames * rows * row_bytes <= SHARD_BYTES);
                assert!(frames == 1 || rows >= height);
                // Rows that no frame has are fewer than the chunks of a frame.
                assert!(height.div_ceil(chunk_rows) * chunk_rows - height < height.div_ceil(chunk_rows));
            }
        }
        assert_eq!(Shards::of(48, 64 * 2), Shards { chunk_rows: 48, rows: 48, frames: 2730 });
    }
}

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

mod layout;
mod read;
mod write;

pub use read::{Stack, StackedFrame};
pub use write::{StackOptions, StackWriter};

/// The schema of a store of ours, an attribute of its group.
pub const SCHEMA: &str = "cyanometer-stack/1";

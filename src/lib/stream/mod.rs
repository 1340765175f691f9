//! Frames in motion: a [`Stage`] maps bands to bands; [`run`] drives one from a source of rows to a sink.

mod counts;
mod drive;
mod memory;
mod stage;

pub use counts::Counts;
pub use drive::run;
pub use memory::MemoryFrame;
pub use stage::{RowSink, RowSource, Stage};

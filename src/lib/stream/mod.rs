//! Frames in motion: a [`Stage`] maps bands to bands; [`run`] drives one from a source of rows to a sink, [`fold()`] takes in
//! the rows of one or several sources.

mod bands;
mod counts;
mod drive;
mod fold;
mod memory;
mod outlet;
mod passing;
mod stage;
#[cfg(test)]
mod tests;
mod through;

pub use bands::Band;
pub use counts::Counts;
pub use drive::run;
pub use fold::{fold, fold_into};
pub use memory::MemoryFrame;
pub use outlet::Outlet;
pub use passing::Passing;
pub use stage::{Footprint, RowSink, RowSource, Stage};
pub use through::Through;

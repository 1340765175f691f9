//! What the studies share: the camera that they are about, frames in memory and what stages make of them, and how pages
//! are written.
//!
//! The studies are the programs of this crate. `scripts/reproduce` and `scripts/error-vs-runtime` run those that write
//! `docs/reproduction` and `docs/error-vs-runtime.md`; `scripts/bench` runs the other two.

pub mod camera;
pub mod frames;
pub mod pages;

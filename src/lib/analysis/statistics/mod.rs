//! Statistics of frames and regions, beside what propagation predicts.
//!
//! [`measure()`] reads a frame and sums up its regions; what it saw of each is laid beside what is predicted, and tested by
//! [`check`]. [`patches`] does so for the patches of a chart.

mod assessment;
mod cell_drift;
mod cells;
pub mod check;
mod deviates;
mod expectation;
mod grids;
mod groups;
pub mod histogram;
mod laws;
mod levels;
mod lines;
mod measure;
mod over_frames;
pub mod patches;
pub mod portrait;
mod region;
mod repeated_check;
mod repeated_report;
mod report;
mod tally;
mod verdict;
mod watch;

pub use laws::Laws;
pub use measure::{measure, measure_among, measure_with_portrait};
pub use over_frames::{OverFrames, OverFramesSettings};
pub use region::Region;
pub use repeated_report::{RepeatedChannel, RepeatedRegion, RepeatedReport};
pub use report::{ChannelReport, RegionReport, Report};
pub use verdict::Verdict;
pub use watch::{MarkedRows, Saturated};

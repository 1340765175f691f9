//! Dark frames whose samples are cut off at code 0.

use super::frames::DarkFrames;
use crate::metadata::AverageRecord;
use crate::numerics::averages::{CLIP, Combine, Kept};
use crate::stream::RowSource;

/// What is wrong with frames without light whose samples are cut off at code 0.
#[derive(Debug, Clone, PartialEq)]
pub struct CutOff {
    /// The first of them.
    pub name: String,
    /// The share of their samples at 0.
    pub share: f64,
    /// What their average is too high by, ADU.
    pub excess_adu: f64,
}

impl<S: RowSource> DarkFrames<S> {
    /// By how much what came off so far is too high on average, as its frames are cut off at code 0, and the share of their samples there; none
    /// where next to nothing is, or it does not follow.
    pub fn cut_off(&self) -> Option<CutOff> {
        /// Of less the tails of no law are known.
        const LEAST_SHARE: f64 = 0.01;
        /// Samples that scatter over so many codes are averaged as any.
        const MANY_CODES: f64 = 16.0;
        let mut found: Option<CutOff> = None;
        for (frames, record) in self.averages() {
            let Some(codes) = frames.lowest_codes().filter(|codes| codes.share() > LEAST_SHARE) else { continue };
            let AverageRecord { frames: count, combine, .. } = record.average;
            // Each code of a mean is cut off; of a median that is the middle of them.
            let kept = match combine {
                Combine::Median => Kept::of(combine, count, CLIP, MANY_CODES).variance,
                Combine::Mean | Combine::Clipped => 1.0,
            };
            let (Some(excess), Some(first)) = (codes.excess(kept), frames.frames().next()) else { continue };
            let excess_adu = record.weight * excess + found.as_ref().map_or(0.0, |found| found.excess_adu);
            found = Some(CutOff { name: first.header().name.clone(), share: codes.share(), excess_adu });
        }
        found
    }
}

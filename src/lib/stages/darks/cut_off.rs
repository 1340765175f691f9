//! Dark frames whose samples are cut off at code 0.

use super::frames::DarkFrames;
use crate::metadata::{AverageRecord, CutOffRecord};
use crate::numerics::averages::{CLIP, Combine, Kept};
use crate::numerics::cut_off::AtZero;
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
        let mut found: Option<CutOff> = None;
        for (frames, record) in self.averages() {
            // Averages tell it of the codes that they were made of.
            let averages =
                frames.frames().map(|frame| frame.header().metadata.average.and_then(|average| average.cut_off));
            let told = mean_of(averages);
            let own = || frames.lowest_codes().and_then(|codes| of_codes(codes, record.average));
            let (Some(cut), Some(first)) = (told.or_else(own), frames.frames().next()) else { continue };
            let excess_adu = record.weight * cut.excess_adu + found.as_ref().map_or(0.0, |found| found.excess_adu);
            found = Some(CutOff { name: first.header().name.clone(), share: cut.share, excess_adu });
        }
        found
    }
}

/// How far codes that are averaged so are cut off at 0; none where next to nothing is, or it does not follow.
pub fn of_codes(codes: AtZero, average: AverageRecord) -> Option<CutOffRecord> {
    /// Of less the tails of no law are known.
    const LEAST_SHARE: f64 = 0.01;
    /// Samples that scatter over so many codes are averaged as any.
    const MANY_CODES: f64 = 16.0;
    let AverageRecord { frames, combine, .. } = average;
    // Each code of a mean is cut off; of a median that is the middle of them.
    let kept = match combine {
        Combine::Median => Kept::of(combine, frames, CLIP, MANY_CODES).variance,
        Combine::Mean | Combine::Clipped => 1.0,
    };
    let excess_adu = codes.excess(kept).filter(|_| codes.share() > LEAST_SHARE)?;
    Some(CutOffRecord { share: codes.share(), excess_adu })
}

/// The mean of what averages tell, those that tell nothing being cut off nowhere; none where none tells anything.
pub fn mean_of(averages: impl IntoIterator<Item = Option<CutOffRecord>>) -> Option<CutOffRecord> {
    let (mut count, mut sum) = (0.0, [0.0; 2]);
    for average in averages {
        count += 1.0;
        let own = average.map_or([0.0; 2], |average| [average.share, average.excess_adu]);
        sum = [sum[0] + own[0], sum[1] + own[1]];
    }
    let [share, excess_adu] = sum.map(|sum| sum / count);
    (share > 0.0).then_some(CutOffRecord { share, excess_adu })
}

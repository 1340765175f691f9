//! Hot pixels and photosites that jump, of which a correction left some out, beside what is predicted of all.

use super::pixels::photosite_of;
use super::tails::State;
use super::taps;
use crate::metadata::FrameHeader;

/// What standard deviations count that may be out of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOutTails {
    /// Whether the defects were found, by how they stand out; else they are of a list, which may be of others.
    pub are_found: bool,
    /// The standard deviation of samples without light where none is left out, over that where all are.
    pub at_most: f64,
}

/// Whether defects were taken out of a frame whose sensor has hot pixels or random telegraph signals, and what these make of a standard
/// deviation; none of other frames, and of those whose noise is not known.
pub fn left_out_tails(frame: &FrameHeader) -> Option<LeftOutTails> {
    let defects = frame.metadata.correction.as_ref()?.defects.as_ref()?;
    let (photosite, _) = photosite_of(&taps::as_if_one(frame)).ok().filter(|(photosite, _)| photosite.has_tails())?;
    let others = photosite.at(&State { hot: 0.0, trap: 0.0 });
    let at_most = (photosite.variance_by_few(0.0) / others.variance_by_few(0.0)).sqrt();
    Some(LeftOutTails { are_found: defects.found_beyond.is_some(), at_most })
}

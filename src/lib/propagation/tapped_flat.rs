//! Flat fields of sensors that are read through several amplifiers: what is recorded of them, and what is not told.

use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::{FlatRecord, FrameHeader};

/// Why nothing is said of flat fields of which too little is recorded.
const UNRECORDED: &str = "it was divided by a flat field of a sensor that is read through several amplifiers (`taps`), and nothing tells how many \
                          photosites of each its level is the mean of; correct the frame anew";

/// Why nothing is said of what exposures have in common that were divided by flat fields.
pub(super) const FLATTENED: &str = "it was divided by a flat field of a sensor that is read through several amplifiers (`taps`), of which single \
                                    frames are told, and not what their exposures have in common";

/// Why pixels have no standard deviations where the flat field that divided them was lit unevenly.
pub(super) const UNEVENLY_FLATTENED: &str = "it was divided by a flat field that was not lit evenly, of a sensor that is read through several \
                                             amplifiers (`taps`); light the flat field evenly";

/// The flat field by which a frame was divided; none where it was not.
pub(super) fn flat_of(frame: &FrameHeader) -> Option<&FlatRecord> {
    frame.metadata.correction.as_ref().and_then(|correction| correction.flat.as_ref())
}

/// Makes sure that enough is recorded of the flat field that divided a frame.
///
/// # Errors
///
/// [`Unpredictable::Beyond`].
pub(super) fn check_flat(frame: &FrameHeader) -> Predicted<()> {
    let is_told = |flat: &FlatRecord| flat.area.is_some() && !flat.tap_photosites.is_empty();
    if frame.taps().is_none() || flat_of(frame).is_none_or(is_told) {
        Ok(())
    } else {
        Err(Unpredictable::Beyond(UNRECORDED))
    }
}

//! The verdict on all tests of a frame together.

use super::check::{Subject, Test};
use crate::error::{Error, Result};
use crate::numerics::significance;
use serde::Serialize;

/// The verdict on all tests together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Verdict {
    /// Chance of a false alarm that is accepted.
    pub level: f64,
    /// Number of tests.
    pub tests: usize,
    /// Smallest probability.
    pub smallest_p: f64,
    /// The same, corrected for the number of tests: 1 − (1 − p)ⁿ.
    pub corrected_p: f64,
    /// Whether it is no smaller than the level.
    pub passed: bool,
    /// Whether no sample should scatter: values were compared with values, and no law of noise was tested.
    #[serde(skip_serializing_if = "is_scattered")]
    pub is_noiseless: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
fn is_scattered(is_noiseless: &bool) -> bool {
    !*is_noiseless
}

impl Verdict {
    /// The verdict on the regions of a frame, each its tests and the pixels that are not finite; `why` says what keeps
    /// predictions from being made, where something does.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] where there is nothing to test.
    pub fn of<'a>(
        regions: impl Iterator<Item = (&'a [Test], u64)> + Clone,
        level: f64,
        frame: &str,
        why: Option<&str>,
    ) -> Result<Self> {
        if regions.clone().next().is_none() || regions.clone().any(|(tests, _)| tests.is_empty()) {
            let why = why.map_or(String::new(), |why| format!("; here {why}"));
            return Err(Error::Data(format!(
                "{frame}: nothing can be checked: a prediction needs a uniform scene and metadata that say what was done \
                 to it, up to XYZ, xyY or L*a*b*{why}"
            )));
        }
        if let Some((_, not_finite)) = regions.clone().find(|(_, not_finite)| *not_finite > 0) {
            return Err(Error::Data(format!(
                "{frame}: nothing can be checked: {not_finite} pixels are NaN or infinite"
            )));
        }
        let all = regions.clone().flat_map(|(tests, _)| tests);
        let (tests, smallest_p) = all.fold((0, 1.0_f64), |(count, least), test| (count + 1, least.min(test.p)));
        let corrected_p = significance::of_smallest(smallest_p, tests);
        let is_noiseless =
            regions.flat_map(|(tests, _)| tests).all(|test| test.subject == Subject::Deviation && test.expected == 0.0);
        Ok(Self { level, tests, smallest_p, corrected_p, passed: corrected_p >= level, is_noiseless })
    }

    /// Nothing where the check is passed.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] where it is not.
    pub fn judge(self, frame: &str) -> Result<()> {
        if self.passed {
            return Ok(());
        }
        Err(Error::Data(format!(
            "{frame}: it is not as predicted: the least likely of {} statistics has p = {:.2e}, corrected for their number \
             {:.2e}, below the level {:e}",
            self.tests, self.smallest_p, self.corrected_p, self.level
        )))
    }
}

//! What is counted while samples pass.

use crate::metadata::SamplesRecord;
use crate::text::counted;

/// What a stage counts while samples pass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Photosites whose charge was clipped at full well.
    pub full_well: u64,
    /// Samples clipped to the smallest code.
    pub clipped_low: u64,
    /// Samples clipped to the largest code.
    pub clipped_high: u64,
    /// Samples that are NaN or infinite.
    pub not_finite: u64,
    /// Expected electrons below zero.
    pub negative: u64,
    /// Demosaicked values without a green to divide by, or beyond the range of samples.
    pub undefined_hue: u64,
    /// Pixels whose green, by which smooth hue transition divides, is less than ten times its noise.
    pub dim_green: u64,
    /// Colors outside sRGB.
    pub out_of_gamut: u64,
    /// Colors more than ten times as bright as the white that they refer to.
    pub far_above_white: u64,
    /// Colors without a correlated color temperature.
    pub off_locus: u64,
    /// Colors without a chromaticity, whose coordinates are those of white.
    pub no_chromaticity: u64,
    /// Pixels whose noise cannot be propagated.
    pub propagation_void: u64,
    /// Samples at or above the level from which they are full.
    pub saturated_samples: u64,
    /// Pixels that were made of such samples.
    pub saturated_pixels: u64,
    /// Defective photosites.
    pub defective: u64,
    /// Those among them that were interpolated.
    pub corrected: u64,
    /// Pixels that were made of samples that are marked for another reason than saturation.
    pub marked_pixels: u64,
}

impl Counts {
    /// The sums of two counts.
    pub fn plus(self, other: Self) -> Self {
        Self {
            full_well: self.full_well + other.full_well,
            clipped_low: self.clipped_low + other.clipped_low,
            clipped_high: self.clipped_high + other.clipped_high,
            not_finite: self.not_finite + other.not_finite,
            negative: self.negative + other.negative,
            undefined_hue: self.undefined_hue + other.undefined_hue,
            dim_green: self.dim_green + other.dim_green,
            out_of_gamut: self.out_of_gamut + other.out_of_gamut,
            far_above_white: self.far_above_white + other.far_above_white,
            off_locus: self.off_locus + other.off_locus,
            no_chromaticity: self.no_chromaticity + other.no_chromaticity,
            propagation_void: self.propagation_void + other.propagation_void,
            saturated_samples: self.saturated_samples + other.saturated_samples,
            saturated_pixels: self.saturated_pixels + other.saturated_pixels,
            defective: self.defective + other.defective,
            corrected: self.corrected + other.corrected,
            marked_pixels: self.marked_pixels + other.marked_pixels,
        }
    }

    /// The record for a sidecar: what did not happen is left out.
    pub fn record(self, digest: String) -> SamplesRecord {
        let some = |count: u64| (count > 0).then_some(count);
        SamplesRecord {
            digest,
            one_value: false,
            full_well: some(self.full_well),
            clipped_low: some(self.clipped_low),
            clipped_high: some(self.clipped_high),
            not_finite: some(self.not_finite),
            negative: some(self.negative),
            undefined_hue: some(self.undefined_hue),
            dim_green: some(self.dim_green),
            out_of_gamut: some(self.out_of_gamut),
            far_above_white: some(self.far_above_white),
            off_locus: some(self.off_locus),
            no_chromaticity: some(self.no_chromaticity),
            propagation_void: some(self.propagation_void),
            saturated: some(self.saturated_samples + self.saturated_pixels),
            defective: some(self.defective),
            corrected: some(self.corrected),
            marked: some(self.marked_pixels),
        }
    }

    /// What a sidecar says of samples; whether those or pixels were saturated it does not tell.
    pub fn recorded(record: &SamplesRecord) -> Self {
        let count = Option::unwrap_or_default;
        Self {
            full_well: count(record.full_well),
            clipped_low: count(record.clipped_low),
            clipped_high: count(record.clipped_high),
            not_finite: count(record.not_finite),
            negative: count(record.negative),
            undefined_hue: count(record.undefined_hue),
            dim_green: count(record.dim_green),
            out_of_gamut: count(record.out_of_gamut),
            far_above_white: count(record.far_above_white),
            off_locus: count(record.off_locus),
            no_chromaticity: count(record.no_chromaticity),
            propagation_void: count(record.propagation_void),
            saturated_samples: count(record.saturated),
            saturated_pixels: 0,
            defective: count(record.defective),
            corrected: count(record.corrected),
            marked_pixels: count(record.marked),
        }
    }

    /// What a user should hear about, one sentence each.
    pub fn warnings(self) -> Vec<String> {
        // What was clipped here is saturated; that is said once.
        let only_met = self.saturated_samples > self.full_well.max(self.clipped_high);
        [
            (if only_met { self.saturated_samples } else { 0 }, "samples are saturated, at full well or the white level"),
            (
                self.saturated_pixels,
                "pixels were made of saturated samples: their values are wrong, and their uncertainty is \
                 infinite",
            ),
            (self.defective - self.corrected.min(self.defective), "defective photosites were not interpolated: no neighbor of their class is good"),
            (self.corrected, "defective photosites were interpolated from others of their class, and marked"),
            (
                self.marked_pixels,
                "pixels were made of defective or interpolated samples: they are marked, and their uncertainty, which --sigma tells, \
                 is infinite",
            ),
            (self.full_well, "photosites were clipped at full well"),
            (self.clipped_low, "samples were clipped to the smallest code"),
            (self.clipped_high, "samples were clipped to the largest code"),
            (self.not_finite, "samples are NaN or infinite"),
            (self.negative, "expected signals below zero were taken as zero"),
            (
                self.undefined_hue,
                "values had no green to divide by, lay beyond the range of samples, or stand beside one that is NaN or infinite; \
                 bilinear ones stand in",
            ),
            (
                self.dim_green,
                "pixels have a green of less than ten times its noise, by which smooth hue transition divides: their red and \
                 blue are biased; other methods do not divide",
            ),
            (self.out_of_gamut, "colors lie outside sRGB and were clipped"),
            (
                self.far_above_white,
                "colors are more than ten times as bright as their white, L* above 234: is its luminance meant? --white-luminance is \
                 in cd/m2; by default it is that at which the camera saturates",
            ),
            (
                self.off_locus,
                "colors have no correlated color temperature, which is NaN: they lie more than 0.05 from black bodies, or beyond \
                 1000 K to 1000000 K",
            ),
            (
                self.no_chromaticity,
                "colors have no chromaticity, for X + Y + Z (of u and v X + 15 Y + 3 Z) is not above 0: x and y are those of white, u* and v* \
                 are 0, and their standard deviations infinite",
            ),
            (
                self.propagation_void,
                "pixels have standard deviations that do not hold: of a green too near its noise to divide by, which say only that they \
                 are large; of a median or clipped mean of codes that scatter over so few that it hangs on where in a code it lies; or none (NaN), \
                 where sums over hot pixels or random telegraph signals would take too long",
            ),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| counted(count, what))
        .collect()
    }
}

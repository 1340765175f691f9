//! Exposures that are averaged and whose codes are cut off at 0, as those of dark frames whose bias is no higher than their noise.

use super::correction_doubts::LEAST_EXCESS_ADU;
use super::frame_levels::FrameLevels;
use crate::metadata::{AverageRecord, CutOffRecord, FrameHeader, Scene, TakenAs};
use crate::numerics::cut_off::AtZero;
use crate::stages::darks::cut_off;
use crate::text::percent_in_decimals;
use crate::units::QuantityKind;

/// What is seen of the lowest codes of exposures.
#[derive(Debug, Default)]
pub(super) struct Floor {
    codes: AtZero,
    sum: f64,
    /// Exposures whose samples are no codes, or are averages already.
    others: u32,
    before: Vec<Option<CutOffRecord>>,
}

impl Floor {
    /// Takes in an exposure by its samples, and what it tells of those that it is an average of.
    pub(super) fn take(&mut self, levels: &FrameLevels, before: Option<CutOffRecord>) {
        match levels.lowest_codes() {
            Some((sum, codes)) => (self.codes, self.sum) = (self.codes.plus(codes), self.sum + sum),
            None => self.others += 1,
        }
        self.before.push(before);
    }

    /// How far the codes that go into an average are cut off at 0; none where next to nothing is, or it does not follow.
    pub(super) fn cut_off(&self, first: &FrameHeader, average: AverageRecord) -> Option<CutOffRecord> {
        let metadata = &first.metadata;
        let are_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified)
            && metadata.correction.is_none()
            && metadata.demosaic.is_none();
        let told = cut_off::mean_of(self.before.iter().copied());
        let own = || cut_off::of_codes(self.codes, average).filter(|_| self.others == 0);
        told.or_else(own).filter(|_| are_codes)
    }

    /// A warning of such an average, where no light fell on its exposures as far as they tell, or their codes are of the one law by which it
    /// is told what they are too high by: pictures have dark places too.
    pub(super) fn doubt(&self, first: &FrameHeader, cut: CutOffRecord) -> Option<String> {
        let metadata = &first.metadata;
        let is_dark = matches!(metadata.taken_as, Some(TakenAs::Dark | TakenAs::Bias))
            || metadata.scene.as_ref().is_some_and(Scene::is_dark);
        (cut.excess_adu > LEAST_EXCESS_ADU && (is_dark || self.are_of_one_law())).then(|| {
            format!(
                "{}: {} % of the samples of these exposures are 0, where codes are cut off; as far as they are normal their average is {:.2} ADU too \
                 high, and what it comes off as a dark frame too low by as much; have the camera add an offset",
                first.name,
                percent_in_decimals(cut.share, 0),
                cut.excess_adu
            )
        })
    }

    /// Whether the mean of all codes is that of the normal law which the lowest tell.
    fn are_of_one_law(&self) -> bool {
        /// Standard deviations: a few hot photosites, and shares of few.
        const NEAR: f64 = 0.5;
        let law = self.codes.law().zip(self.codes.excess(1.0));
        law.is_some_and(|([mean, std], excess)| (self.sum / self.codes.count - mean - excess).abs() < NEAR * std)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::numerics::averages::Combine;

    /// Codes of a normal law of mean 1 and standard deviation 2 by its quantiles, and the same with a scene beside that is much brighter.
    #[test]
    fn codes_of_one_law_are_told_and_dark_places_of_pictures_not() {
        use statrs::distribution::{ContinuousCDF, Normal};
        let law = Normal::new(1.0, 2.0).unwrap();
        let quantile = |place: u32| law.inverse_cdf((f64::from(place) + 0.5) / 4e4);
        #[expect(clippy::cast_possible_truncation, reason = "small codes")]
        let dark: Vec<f32> = (0..40_000).map(|place| quantile(place).round().max(0.0) as f32).collect();
        let first = |taken_as| {
            let metadata = Metadata { taken_as, ..Metadata::new(QuantityKind::Adu) };
            FrameHeader { name: "a".into(), geometry: Geometry::new(200, 200, &["Y"]), metadata }
        };
        let average = AverageRecord { frames: 2, combine: Combine::Mean, clip: None };
        let floor_of = |light: f32| {
            let mut floor = Floor::default();
            for _ in 0..2 {
                let mut levels = FrameLevels::of("a");
                levels.take(&dark);
                levels.take(&vec![light; if light > 0.0 { 40_000 } else { 0 }]);
                floor.take(&levels, None);
            }
            floor
        };
        let floor = floor_of(0.0);
        let cut = floor.cut_off(&first(None), average).unwrap();
        // E max(y, 0) - mean of normal numbers, before rounding: s phi(m/s) - m Phi(-m/s); rounding moves it by 1/24 of the density at 0.
        let (s, m) = (2.0_f64, 1.0);
        let density = (-m * m / (2.0 * s * s)).exp() / (s * std::f64::consts::TAU.sqrt());
        let wanted = s * s * density - m * law.cdf(0.0);
        assert!((cut.excess_adu - wanted).abs() < 0.02, "{cut:?} {wanted}");
        let doubt = floor.doubt(&first(None), cut).unwrap();
        assert!(doubt.starts_with("a: 40 % of the samples"), "{doubt}");
        let floor = floor_of(900.0);
        let cut = floor.cut_off(&first(None), average).unwrap();
        assert_eq!(floor.doubt(&first(None), cut), None);
        assert!(floor.doubt(&first(Some(TakenAs::Bias)), cut).is_some());
        // An average of averages has what these had.
        let mut floor = Floor::default();
        let mut levels = FrameLevels::of("a");
        levels.take(&[0.5, 2.25]);
        floor.take(&levels, Some(CutOffRecord { share: 0.2, excess_adu: 0.5 }));
        floor.take(&levels, None);
        assert_eq!(floor.cut_off(&first(None), average), Some(CutOffRecord { share: 0.1, excess_adu: 0.25 }));
    }
}

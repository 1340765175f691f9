//! What the photosites of a row, or of a column, share, in the covariance of a demosaicked pixel.

use super::covariance::{Covariance, PAIRS};
use super::lines::LineTerms;
use super::photosite::Photosite;
use super::pixel_drift::{DriftLoads, PixelDrift};
use super::pixel_gains::{PixelGains, phase_at};
use crate::frame::Geometry;
use crate::metadata::AverageRecord;
use crate::stages::demosaic::weights::WeightTable;

/// What photosites share by rows and by columns, at any pixel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PixelLines {
    /// Gains of the covariances of pairs of classes, in rows and in columns.
    gains: Vec<PixelGains<{ 2 * PAIRS.len() }>>,
    terms: [LineTerms; 2],
    drift: Option<PixelDrift>,
    photosite: Photosite,
    average: Option<AverageRecord>,
}

/// What photosites share at some level.
#[derive(Debug, Clone, Copy)]
pub(super) struct AtLevel {
    /// The covariances of pairs of classes in a row, then in a column, less the drift of these.
    shared: [f64; 2 * PAIRS.len()],
    /// What samples of each class have of the drift.
    drift: DriftLoads,
}

impl PixelLines {
    /// Of the photosites of a frame, an average or not, of which such places are the kinds of pixels; `gain` is the slope of the photosite at
    /// a place of the frame, relative to that of all.
    pub fn of(
        photosite: Photosite,
        average: Option<&AverageRecord>,
        table: &WeightTable,
        kinds: &[[usize; 2]],
        geometry: &Geometry,
        gain: impl Fn([isize; 2]) -> f64,
    ) -> Self {
        let pattern = Some(table.pattern());
        let drift =
            photosite.drifts().then(|| PixelDrift::of(&photosite, average, pattern, table, kinds, geometry, &gain));
        let [rows, columns] = photosite.line_terms(average);
        Self {
            gains: kinds.iter().map(|&at| PixelGains::of_lines(table, at, geometry, &gain)).collect(),
            terms: [drift.as_ref().map_or(rows, |drift| drift.off(rows)), columns],
            drift,
            photosite,
            average: average.copied(),
        }
    }

    /// What photosites share at levels of codes above black, where such a share of light fell on the flat field.
    pub fn at(&self, level: [f64; 3], share: f64) -> AtLevel {
        let full_well_e = self.photosite.model.full_well_e;
        // `max` drops what is no number.
        let expected_e = [0, 1, 2].map(|k| self.photosite.expected_of(k, level[k].max(0.0)).max(0.0).min(full_well_e));
        let is_divided = self.photosite.flat.is_some();
        let x = self.photosite.line_signals(expected_e).map(|signal| if is_divided { signal / share } else { signal });
        let dark_e = self.photosite.model.dark_e;
        let of_codes = |e: f64| self.photosite.adc.map_or(1.0, |adc| adc.sample_per_e(e + dark_e));
        let scales = self.photosite.flat.map_or([1.0; 3], |flat| flat.ratios);
        let slopes: [f64; 3] = std::array::from_fn(|k| scales[k] * of_codes(expected_e[k]));
        let shared = std::array::from_fn(|index| {
            let [k, l] = PAIRS[index % PAIRS.len()];
            slopes[k] * slopes[l] * self.terms[index / PAIRS.len()].at(x[k], x[l])
        });
        let ratios = self.photosite.ratios(expected_e);
        let of_rows = self.photosite.drift_loads(ratios.map(|ratio| ratio / share), slopes, self.average.as_ref());
        let drift = DriftLoads { of_rows, of_level: self.photosite.level_loads(ratios, slopes) };
        AtLevel { shared, drift }
    }

    /// What photosites of such levels share with others, of their variance, where their slope is that of all.
    pub fn of_sites(&self, AtLevel { shared, drift: loads }: &AtLevel) -> [f64; 3] {
        std::array::from_fn(|class| {
            let own = PAIRS.iter().position(|pair| *pair == [class, class]).unwrap_or_default();
            let drift = self.drift.as_ref().map_or(0.0, |_| loads.of_site(class));
            shared[own] + shared[PAIRS.len() + own] + drift
        })
    }

    /// What of the covariance of a pixel of a kind, in a row of the frame, photosites of such levels make by what they share.
    pub fn covariance(&self, kind: usize, row: usize, level: &AtLevel, hues: Option<[f64; 3]>) -> Covariance {
        let of_lines = self.gains[kind].covariance(level.shared, hues);
        match &self.drift {
            Some(drift) => {
                let of_drift = drift.covariance(kind, row, &level.drift, hues);
                std::array::from_fn(|pair| of_lines[pair] + of_drift[pair])
            }
            None => of_lines,
        }
    }
}

impl PixelGains<{ 2 * PAIRS.len() }> {
    /// Those of what pairs of classes share in rows, then in columns.
    fn of_lines(table: &WeightTable, at: [usize; 2], geometry: &Geometry, gain: impl Fn([isize; 2]) -> f64) -> Self {
        let phase = phase_at(at, geometry);
        let class = |offset| table.class(phase, offset) as usize;
        let gained = |(offset, weight): ([isize; 2], f64)| {
            let place = [0, 1].map(|axis| at[axis].cast_signed() + offset[axis]);
            (offset, weight * gain(place))
        };
        Self::by(table, at, geometry, |a, b| {
            let mut sums = [0.0; 2 * PAIRS.len()];
            for (here, weight) in a.sites().map(gained) {
                for (there, other) in b.sites().map(gained) {
                    let [k, l] = [class(here), class(there)];
                    let pair = PAIRS.iter().position(|pair| *pair == [k.min(l), k.max(l)]).unwrap_or_default();
                    sums[pair] += if here[1] == there[1] { weight * other } else { 0.0 };
                    sums[PAIRS.len() + pair] += if here[0] == there[0] { weight * other } else { 0.0 };
                }
            }
            sums
        })
    }
}

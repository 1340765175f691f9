//! What a drift of the black level makes of frames that were divided by a flat field.
//!
//! Row y of a frame is off by α_y, and of its flat field by φ_y, each a drift of its own but for what the same averages that came off both have;
//! so a quotient of class k is off by K (α_y − x_k φ_y), as by any line ([`super::divided_lines`]), and rows near each other hang together.
//! Of the numbers of a knot, of variance 1,
//!
//! α = √c z,  φ = (g z + √(c s − g²) z′)/√c
//!
//! with c and s the variances of α and of φ, and g their covariance. The mean ⟨φ⟩ over the rows of the level, b̄_k of these for a class,
//! moves all samples of the class together by K x_k ⟨φ⟩: with what rows of a frame have, b̄ of these, the mean of a frame has
//!
//! K² \[D b̄·b̄ + 2 P b̄·b̄_k + Q b̄_k·b̄_k],  P = x (g − x s),  Q = x² s
//!
//! where D = c − 2 x g + x² s, exact at whatever rows. Of a drift so slow that it is one number of a frame the noise of the flat field cancels.

use super::drift::{DriftRows, KnotMeans, NUMBERS};
use super::masters::{Dark, LevelLines};
use super::photosite::Photosite;
use crate::cfa::{CfaPattern, Class};
use crate::frame::Geometry;
use crate::metadata::{AverageRecord, FrameHeader};

/// What is a number times another of each knot.
type Numbers = [f64; NUMBERS];

fn dot(one: Numbers, other: Numbers) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

impl Photosite {
    /// c, g and s of an average of exposures, where it is one, before any slope.
    pub(super) fn drift_terms(&self, average: Option<&AverageRecord>) -> [f64; 3] {
        let of_frame = self.drift_e2(average);
        let Some(flat) = &self.flat else { return [of_frame, 0.0, 0.0] };
        let drift = |dark: &Dark| dark.model.lines.black_drift_e.powi(2);
        let of_average = |dark: &Dark| dark.weight.powi(2) * dark.kept()[0] * drift(dark);
        // Lines have the same noise at all levels.
        let kept = flat.levels.map_or_else(|| flat.frames.kept()[0], |levels| levels.at(1.0).variance);
        let of_flat = kept * drift(&flat.frames) + flat.darks.iter().flatten().map(of_average).sum::<f64>();
        let of_both = |[a, b]: [Dark; 2]| a.weight * b.weight * a.kept()[0] * drift(&a);
        [of_frame, flat.in_both(&self.darks).map(of_both).sum(), of_flat]
    }

    /// α and φ by the numbers of a knot.
    fn drift_numbers(&self, average: Option<&AverageRecord>) -> [Numbers; 2] {
        let [c, g, s] = self.drift_terms(average);
        let root = c.sqrt();
        let shared = if root > 0.0 { g / root } else { 0.0 };
        [[root, 0.0], [shared, (s - shared * shared).max(0.0).sqrt()]]
    }

    /// What samples of R, G and B, of such ratios to the flat field and slopes to the charge, have of the numbers of a knot.
    pub(super) fn drift_loads(
        &self,
        ratios: [f64; 3],
        slopes: [f64; 3],
        average: Option<&AverageRecord>,
    ) -> [Numbers; 3] {
        let [of_frame, of_flat] = self.drift_numbers(average);
        [0, 1, 2].map(|k| [0, 1].map(|number| slopes[k] * (of_frame[number] - ratios[k] * of_flat[number])))
    }

    /// What the level of the flat field has of these, with the mean over its rows for each knot.
    pub(super) fn level_loads(&self, ratios: [f64; 3], slopes: [f64; 3]) -> [Numbers; 3] {
        let [_, of_flat] = self.drift_numbers(None);
        [0, 1, 2].map(|k| of_flat.map(|number| slopes[k] * ratios[k] * number))
    }

    /// What the drift adds to the covariance of what all samples of R, G and B of a frame are off together, less what photosites have of that one
    /// by one.
    pub(super) fn level_of_drift(&self, expected_e: [f64; 3], frame: &FrameHeader) -> [[f64; 3]; 3] {
        let mut found = [[0.0; 3]; 3];
        let level = self.flat.filter(|_| self.drifts()).and_then(|flat| Some((flat, flat.level_lines?)));
        let Some((flat, lines)) = level else { return found };
        let slopes = [self.slope(); 3];
        let ratios = self.ratios(expected_e);
        let [of_lines, of_level] = [self.drift_loads(ratios, slopes, None), self.level_loads(ratios, slopes)];
        let pattern = pattern_of(frame);
        let rows = rows_of(&frame.geometry);
        let means = [0, 1, 2].map(|k| KnotMeans::of(&rows_of_class(rows, pattern, k), self.drift_rows()));
        let levels = level_means(&lines, pattern, self.drift_rows());
        for (k, row) in found.iter_mut().enumerate() {
            for (l, sum) in row.iter_mut().enumerate() {
                let [of_both, with] = [dot(of_lines[k], of_level[l]), dot(of_level[k], of_lines[l])];
                let of_levels = dot(of_level[k], of_level[l]);
                let one = if k == l { flat.photosites[k].max(1.0).recip() } else { 0.0 };
                *sum = of_both * (means[k].between(&levels[l]) - one)
                    + with * (levels[k].between(&means[l]) - one)
                    + of_levels * (levels[k].between(&levels[l]) - one);
            }
        }
        found
    }
}

/// The filters that photosites of a frame are behind, or were.
pub(super) fn pattern_of(frame: &FrameHeader) -> Option<CfaPattern> {
    let metadata = &frame.metadata;
    let of_pixels = metadata.demosaic.as_ref().map(|record| record.cfa);
    of_pixels.or_else(|| metadata.cfa.and_then(|array| array.bayer()))
}

/// The first row of a frame on the sensor, and how many it has.
fn rows_of(geometry: &Geometry) -> [i64; 2] {
    let [_, first, _, rows] = geometry.on_sensor();
    [first, rows]
}

/// What the levels of R, G and B have of each knot.
pub(super) fn level_means(lines: &LevelLines, pattern: Option<CfaPattern>, rows_per_knot: f64) -> [KnotMeans; 3] {
    let (rows, pattern) = (lines.rows.unwrap_or_default(), pattern.filter(|_| lines.is_array));
    [0, 1, 2].map(|k| KnotMeans::of(&rows_of_class(rows, pattern, k), rows_per_knot))
}

/// Those of so many rows from one of the sensor on that have photosites of a class: green ones are in all.
fn rows_of_class([first, rows]: [i64; 2], pattern: Option<CfaPattern>, class: usize) -> DriftRows {
    let count = |rows: i64| usize::try_from(rows).unwrap_or_default();
    let has = |pattern: CfaPattern, y: i64| [0, 1].iter().any(|x| pattern.class(*x, y) as usize == class);
    match pattern.filter(|_| class != Class::Green as usize) {
        None => DriftRows { first, step: 1, count: count(rows), columns: 1.0 },
        Some(pattern) => {
            let skipped = if has(pattern, first) { 0 } else { 1 };
            DriftRows { first: first + skipped, step: 2, count: count((rows - skipped + 1) / 2), columns: 1.0 }
        }
    }
}

//! What photosites of a row, or of a column, have in common of frames that were divided by a flat field.
//!
//! A row adds α to what is read of the charge of a frame and φ to that of its flat field, and its response is 1 + γ times that of others
//! in both. To first order a quotient y = A ⟨F⟩/F of class k is off by
//!
//! K \[α − x φ + (E − x F_e) γ],  x = E A/E F
//!
//! E and F_e the light of frame and flat field: gains cancel but for what dark signal is left in either. So far rows and columns are lines
//! like others. Besides, ⟨F⟩ moves all samples of the class in a frame together, by
//!
//! K x ⟨φ + F_e γ⟩
//!
//! the mean over the lines of whole cells. Of a whole frame the noise of the flat field cancels in the mean, as it does of photosites by
//! themselves, and what its gains have moves the level, as they would that of a frame without a flat field. Rows that drift are not drawn apart:
//! what that makes of the level is in [`super::divided_drift`].

use super::charge::sensitivity;
use super::lines::Axis;
use super::masters::{Dark, Drawn, MOST_DARKS};
use super::photosite::Photosite;
use super::unpredictable::{Predicted, Unpredictable};
use crate::frame::Geometry;
use crate::stages::noise::NoiseModel;
use nalgebra::{Matrix3, Vector3};

/// Why nothing is said of a drift where rows do not all count in the level.
const UNEVEN: &str = "it was divided by a flat field, and the black level drifts along rows (`black_drift_e`): of some rows so many photosites are \
                      defective, or saturated, that nothing tells how far that moves its level";

/// Why nothing is said where it is not recorded what the level is of.
const UNRECORDED: &str = "it was divided by a flat field whose rows or columns share noise or gains, and nothing tells of how many its level is the \
                          mean; correct the frame anew";

/// Why nothing is said of gains that show in how samples scatter.
const GAINS: &str = "it was divided by a flat field, and rows or columns differ so much in response that the noise of photosites does from one to \
                     the next; how far the variance of a frame scatters by that is not predicted";

/// What a line adds to the readings of a frame, to those of the flat field, and to the response, and what R, G and B have of these.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Added {
    covariance: Matrix3<f64>,
    of_lines: [Vector3<f64>; 3],
}

impl Added {
    /// What a photosite of one class shares with one of another, each by what it has of these, before the slope.
    pub fn between(&self, [k, l]: [usize; 2], other: &Self) -> f64 {
        self.of_lines[k].dot(&(self.covariance * other.of_lines[l]))
    }
}

impl Photosite {
    /// Makes sure that it is known how far rows and columns move the level of a flat field, and that they do nothing else to a frame of such
    /// a size.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`].
    pub(super) fn check_level(&self, expected_e: [f64; 3], geometry: &Geometry) -> Predicted<()> {
        let Some(flat) = self.flat.filter(|_| self.has_lines()) else { return Ok(()) };
        if flat.level_lines.is_none() {
            return Err(Unpredictable::Beyond(UNRECORDED));
        }
        self.check_level_of_drift()?;
        if self.gains_show(expected_e, geometry) { Err(Unpredictable::Beyond(GAINS)) } else { Ok(()) }
    }

    /// Makes sure that it is known how far a drift moves the level of a flat field.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`].
    pub(super) fn check_level_of_drift(&self) -> Predicted<()> {
        let Some(flat) = self.flat.filter(|_| self.drifts()) else { return Ok(()) };
        match flat.level_lines.filter(|level| level.rows.is_some()) {
            None => Err(Unpredictable::Beyond(UNRECORDED)),
            Some(level) if !level.are_rows_even() => Err(Unpredictable::Beyond(UNEVEN)),
            Some(_) => Ok(()),
        }
    }

    /// Whether the noise of photosites follows the response of their row, or column, so that the variance of a frame scatters by that: by more
    /// than 3 % of what chance leaves.
    ///
    /// n (dv/dγ)² s² > 0.06 · 2 v²        n photosites of a line, s the rms of its response
    fn gains_show(&self, expected_e: [f64; 3], geometry: &Geometry) -> bool {
        let (Some(adc), Some(flat)) = (&self.adc, &self.flat) else { return false };
        let noise = |class: usize, response: f64| {
            let site = [response, 1.0];
            let above = Drawn::codes(&self.model, adc, expected_e[class], site).less(&self.darks, adc, site);
            let below = flat.drawn(adc, flat.expected_e[class], site);
            (above.variance + (above.mean / below.mean).powi(2) * below.variance) / (below.mean * below.mean)
        };
        self.follows_gains(geometry, 2.0, noise)
    }

    /// The same of what is drawn anew in so many exposures that are divided by one flat field.
    pub(super) fn gains_show_over(&self, expected_e: [f64; 3], geometry: &Geometry, frames: u32) -> bool {
        let Some(adc) = self.adc.as_ref().filter(|_| self.flat.is_some()) else { return false };
        let noise = |class: usize, response: f64| {
            Drawn::codes(&self.model, adc, expected_e[class], [response, 1.0]).variance / (response * response)
        };
        self.follows_gains(geometry, 2.0 / f64::from(frames.max(2) - 1), noise)
    }

    /// Whether the noise of a class follows the response of its lines so much, beside a relative variance that chance leaves of that of one
    /// photosite.
    fn follows_gains(&self, geometry: &Geometry, chance: f64, noise: impl Fn(usize, f64) -> f64) -> bool {
        const NEGLIGIBLE: f64 = 0.06;
        let along = [geometry.width, geometry.height].map(|length| length as f64);
        let shows = |axis: Axis, length: f64| {
            let [_, _, response] = axis.parts(&self.model.lines);
            let slope = |class: usize| noise(class, 1.0 + response) / noise(class, 1.0) - 1.0;
            response > 0.0 && (0..3).any(|class| length * slope(class).powi(2) > NEGLIGIBLE * chance)
        };
        Axis::ALL.into_iter().zip(along).any(|(axis, length)| shows(axis, length))
    }

    /// What three photosites of R, G and B share by a row, or by a column, in e².
    pub(super) fn shared_by_quotients(&self, axis: Axis, expected_e: [f64; 3]) -> Option<Matrix3<f64>> {
        let added = self.added_by(axis, expected_e)?;
        Some(Matrix3::from_fn(|k, l| added.between([k, l], &added)))
    }

    /// The covariance of what all samples of R, G and B in a frame are off together, as rows and columns move the level of the flat field, less
    /// what photosites have of that one by one.
    pub(super) fn level_covariance(&self, expected_e: [f64; 3]) -> [[f64; 3]; 3] {
        let mut sum = [[0.0; 3]; 3];
        let Some(flat) = self.flat.filter(|_| self.has_lines()) else { return sum };
        let Some(level_lines) = flat.level_lines else { return sum };
        let ratios = self.ratios(expected_e);
        for (index, axis) in Axis::ALL.into_iter().enumerate() {
            let Some((covariance, of_lines)) = self.line_parts(axis, expected_e) else { continue };
            let of_level = [0, 1, 2].map(|k| Vector3::new(0.0, ratios[k], ratios[k] * flat.expected_e[k]));
            let between = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(covariance * b));
            for (k, row) in sum.iter_mut().enumerate() {
                for (l, sum) in row.iter_mut().enumerate() {
                    let of_both = between(&of_lines[k], &of_level[l]) + between(&of_level[k], &of_lines[l]);
                    let one = if k == l { flat.photosites[k].max(1.0).recip() } else { 0.0 };
                    let shared = level_lines.shared(index, [k, l]) - one;
                    *sum += self.slope().powi(2) * shared * (of_both + between(&of_level[k], &of_level[l]));
                }
            }
        }
        sum
    }

    /// The covariance of what a line adds to a frame, to its flat field and to the response of both, the drift of rows apart, and what R, G and
    /// B have of these before the slope.
    pub(super) fn line_parts(&self, axis: Axis, expected_e: [f64; 3]) -> Option<(Matrix3<f64>, [Vector3<f64>; 3])> {
        let Added { mut covariance, of_lines, .. } = self.added_by(axis, expected_e)?;
        if axis == Axis::Row {
            let [of_frame, of_both, of_flat] = self.drift_terms(None);
            covariance -= Matrix3::new(of_frame, of_both, 0.0, of_both, of_flat, 0.0, 0.0, 0.0, 0.0);
        }
        Some((covariance, of_lines))
    }

    /// x of R, G and B: what is left of codes over the flat field; none of what was not divided.
    pub(super) fn ratios(&self, expected_e: [f64; 3]) -> [f64; 3] {
        let Some(flat) = &self.flat else { return [0.0; 3] };
        let slope = self.slope();
        let [left_e, left_in_flat_e] = [
            left_e(&self.model, &self.darks, flat.levels_adu[0] / slope),
            left_e(&flat.frames.model, &flat.darks, flat.levels_adu[1] / slope),
        ];
        [0, 1, 2].map(|k| (expected_e[k] + left_e) / (flat.expected_e[k] + left_in_flat_e))
    }

    /// What a line adds to quotients of R, G and B, and to their level, before the slope; none of what was not divided.
    pub(super) fn added_by(&self, axis: Axis, expected_e: [f64; 3]) -> Option<Added> {
        let flat = self.flat.as_ref()?;
        let terms = self.terms(axis);
        let [.., response] = axis.parts(&self.model.lines);
        let ratios = self.ratios(expected_e);
        let ratio = |k: usize| ratios[k];
        Some(Added {
            covariance: Matrix3::new(
                terms.constant,
                -terms.linear,
                0.0,
                -terms.linear,
                terms.square,
                0.0,
                0.0,
                0.0,
                response * response,
            ),
            of_lines: [0, 1, 2].map(|k| Vector3::new(1.0, -ratio(k), expected_e[k] - ratio(k) * flat.expected_e[k])),
        })
    }
}

/// The dark signal that averages, and a level, leave in a frame: a mean over photosites.
fn left_e(model: &NoiseModel, darks: &[Option<Dark>; MOST_DARKS], level_e: f64) -> f64 {
    let dark_e = |model: &NoiseModel| model.dark_e * sensitivity(model.dcnu).0 + model.tails.mean_hot_e();
    dark_e(model) - darks.iter().flatten().map(|dark| dark.weight * dark_e(&dark.model)).sum::<f64>() - level_e
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::{AdcRecord, FrameHeader, Metadata, PoissonKind};
    use crate::propagation::masters::{Flat, LevelLines};
    use crate::propagation::moments::Equations;
    use crate::stages::noise::{LineNoise, Tails};
    use crate::units::QuantityKind;

    const LINES: LineNoise = LineNoise {
        row_noise_e: 7.0,
        column_noise_e: 3.0,
        black_drift_e: 0.0,
        black_drift_rows: 0.0,
        dsnu_e: 2.0,
        dsnu_row_e: 5.0,
        dsnu_column_e: 4.0,
        prnu_row: 0.0,
        prnu_column: 0.0,
    };

    /// Three planes of 80 rows and 60 columns, of 2000, 6000 and 15 000 e⁻ over 9000; the dark signal of bias frames, which is none, came off
    /// all.
    fn divided(lines: LineNoise) -> Photosite {
        let model = NoiseModel {
            dark_e: 0.0,
            dcnu: 0.0,
            prnu: 0.01,
            read_noise_e: 8.0,
            full_well_e: 60_000.0,
            dark_shot: true,
            signal_shot: true,
            poisson: PoissonKind::Exact,
            lines,
            tails: Tails::default(),
        };
        let bias = Dark { is_bias: true, ..Dark::mean_of(model, 5) };
        let flat = Flat {
            expected_e: [9000.0; 3],
            photosites: [1e15; 3],
            counted_share: [1.0; 3],
            frames: Dark::mean_of(model, 2),
            levels: None,
            darks: [Some(bias), None, None],
            shares_masters: false,
            level_lines: Some(LevelLines { lines: [80.0, 60.0], is_array: false, rows: Some([0, 80]) }),
            ratios: [1.0; 3],
            levels_adu: [0.0; 2],
        };
        let site = Photosite::of_electrons(model, Equations::Exact).digitized(AdcRecord::new(14, 600.0, 0.25));
        Photosite { darks: [Some(bias), None, None], flat: Some(flat), ..site }
    }

    const LIGHT: [f64; 3] = [2000.0, 6000.0, 15_000.0];

    /// The noise of the flat field is as good as none in the mean of a whole frame, and its offsets are; what lines add to the frame and to
    /// what came off stays: K² r² (1 + 1/5), of a row over 80 and of a column over 60, between all classes.
    #[test]
    fn noise_of_flats_cancels_in_whole_frames() {
        let site = divided(LINES);
        let [row, column] = Axis::ALL.map(|axis| site.shared_by_quotients(axis, LIGHT).unwrap());
        let level = site.level_covariance(LIGHT);
        let square = 0.25 * 0.25;
        let expected = square * 1.2 * (49.0 / 80.0 + 9.0 / 60.0);
        for k in 0..3 {
            for l in 0..3 {
                let found = square * (row[(k, l)] / 80.0 + column[(k, l)] / 60.0) + level[k][l];
                assert!((found / expected - 1.0).abs() < 1e-9, "{k} {l}: {found} {expected}");
            }
        }
    }

    /// Of a drift that is one number of a frame nothing of the flat field is left in the mean of the frame, between all classes: K² d² (1 + 1/5).
    #[test]
    fn slow_drifts_of_flats_cancel() {
        let site = divided(LineNoise { black_drift_e: 6.0, black_drift_rows: 1e9, ..LineNoise::default() });
        let geometry = Geometry::new(60, 80, &["R", "G", "B"]);
        let frame = FrameHeader { name: "test".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
        let level = site.level_of_drift(LIGHT, &frame);
        let loads = site.drift_loads(site.ratios(LIGHT), [0.25; 3], None);
        let expected = 0.25 * 0.25 * 1.2 * 36.0;
        for (k, l) in (0..9).map(|pair| (pair / 3, pair % 3)) {
            let found = loads[k][0] * loads[l][0] + loads[k][1] * loads[l][1] + level[k][l];
            assert!((found / expected - 1.0).abs() < 1e-6, "{k} {l}: {found} {expected}");
        }
    }

    /// Gains come off each photosite, and move the level as they would that of a frame that was not divided: by s of it in each line.
    #[test]
    fn gains_move_the_level() {
        let gains = LineNoise { prnu_row: 0.004, prnu_column: 0.003, ..LineNoise::default() };
        let site = divided(gains);
        assert!(Axis::ALL.iter().all(|axis| site.shared_by_quotients(*axis, LIGHT).unwrap().abs().max() < 1e-12));
        let level = site.level_covariance(LIGHT);
        let of_lines = 0.004_f64.powi(2) / 80.0 + 0.003_f64.powi(2) / 60.0;
        for (k, l) in (0..9).map(|pair| (pair / 3, pair % 3)) {
            let expected = 0.25 * LIGHT[k] * 0.25 * LIGHT[l] * of_lines;
            assert!((level[k][l] / expected - 1.0).abs() < 1e-9, "{k} {l}: {} {expected}", level[k][l]);
        }
    }

    /// Red and blue photosites share no row and no column; green ones are in every one.
    #[test]
    fn classes_of_an_array_share_lines() {
        let lines = LevelLines { lines: [40.0, 30.0], is_array: true, rows: None };
        // Of 40 rows of cells red has 40 rows, green 80.
        assert_eq!([[0, 0], [1, 1], [0, 1], [0, 2]].map(|pair| lines.shared(0, pair) * 80.0), [2.0, 1.0, 1.0, 0.0]);
    }
}

//! Sampled spectra: curves, libraries of radiances, and sums over wavelength.

mod between;

pub use between::{Along, Between};

use crate::error::{Error, Result};
use crate::numerics::quadrature::{self, Rule};
use crate::units::WavelengthUnit;
use ndarray::{Array1, Array2, ArrayView1, Axis};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Wavelengths that are all shorter than this, in nm, look like micrometers: no sensor behind a lens sees them.
pub const SHORTEST_NM: f64 = 100.0;

/// Says that the mean wavelengths of R, G and B, nm, are not in the order of their names.
pub fn not_in_order([red, green, blue]: [f64; 3]) -> String {
    format!(
        "the mean wavelengths of R, G and B are {red:.0}, {green:.0} and {blue:.0} nm, which is not the order of their names"
    )
}

/// An even grid of wavelengths, and the rule that sums over it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WavelengthGrid {
    /// First wavelength in nm.
    pub start_nm: f64,
    /// Last wavelength in nm.
    pub end_nm: f64,
    /// Distance of neighbors in nm.
    pub step_nm: f64,
    /// The rule.
    #[serde(default)]
    pub quadrature: Rule,
}

impl Default for WavelengthGrid {
    /// 360 to 830 nm in steps of 1 nm, summed as they are: Eq. 5a of \[HP2005].
    fn default() -> Self {
        Self { start_nm: 360.0, end_nm: 830.0, step_nm: 1.0, quadrature: Rule::Rectangle }
    }
}

impl fmt::Display for WavelengthGrid {
    /// As options have it: START:END:STEP.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.start_nm, self.end_nm, self.step_nm)
    }
}

impl WavelengthGrid {
    /// The wavelengths in nm with the weight of each in nm.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] when the grid is empty, runs backward, does not end on a step or has over 10⁶ points, or when
    /// the rule does not fit the number of points.
    pub fn points(&self) -> Result<(Vec<f64>, Vec<f64>)> {
        let Self { start_nm, end_nm, step_nm, quadrature } = *self;
        let in_range = start_nm > 0.0 && end_nm >= start_nm && end_nm.is_finite() && step_nm > 0.0;
        let steps = (end_nm - start_nm) / step_nm;
        if !in_range || !(0.0..1e6).contains(&steps) {
            return Err(Error::Usage(format!(
                "{self} nm make no grid; give START:END:STEP, such as {}",
                Self::default()
            )));
        }
        if end_nm < SHORTEST_NM {
            return Err(Error::Usage(format!("{self} nm look like micrometers; give nm, such as {}", Self::default())));
        }
        if (steps - steps.round()).abs() > 1e-6 {
            return Err(Error::Usage(format!("{self} nm do not end on a step; change the end or the step")));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to lie in 0..10⁶")]
        let intervals = steps.round() as usize;
        let wavelengths = (0..=intervals).map(|i| start_nm + i as f64 * step_nm).collect();
        Ok((wavelengths, quadrature::weights(quadrature, intervals + 1, step_nm)?))
    }
}

impl WavelengthGrid {
    /// Whether of some samples two neighbors lie closer on the grid than its steps: what is between steps would be missed.
    pub fn is_coarser_than(&self, sampled_nm: &[f64]) -> bool {
        let is_closer = |pair: &[f64]| pair[1] - pair[0] < self.step_nm * (1.0 - 1e-6);
        sampled_nm.windows(2).any(|pair| pair[1] > self.start_nm && pair[0] < self.end_nm && is_closer(pair))
    }

    /// The wavelengths in nm, with the weight of each in nm, of the integral over the extent of the grid that is exact where
    /// no more than five factors are linear between `knots_nm`, in any order.
    pub fn points_between(&self, knots_nm: impl IntoIterator<Item = f64>) -> (Vec<f64>, Vec<f64>) {
        let inside = |nm: &f64| *nm > self.start_nm && *nm < self.end_nm;
        let mut knots: Vec<f64> = knots_nm.into_iter().filter(inside).chain([self.start_nm, self.end_nm]).collect();
        knots.sort_by(f64::total_cmp);
        knots.dedup();
        quadrature::between(&knots)
    }
}

/// A function of wavelength, known at some wavelengths and linear between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    wavelength_nm: Vec<f64>,
    values: Vec<f64>,
}

impl Curve {
    /// A curve through `values` at `wavelength_nm`.
    ///
    /// # Errors
    ///
    /// What is wrong with the table, in words: too short, not ascending, not finite.
    pub fn new(wavelength_nm: Vec<f64>, values: Vec<f64>) -> std::result::Result<Self, String> {
        check_wavelengths(&wavelength_nm)?;
        if values.len() != wavelength_nm.len() {
            return Err(format!("{} values for {} wavelengths", values.len(), wavelength_nm.len()));
        }
        match values.iter().position(|value| !value.is_finite()) {
            Some(at) => Err(format!("the value at {} nm is not a finite number", wavelength_nm[at])),
            None => Ok(Self { wavelength_nm, values }),
        }
    }

    /// The value at a wavelength in nm; zero beyond the table.
    pub fn at(&self, wavelength_nm: f64) -> f64 {
        neighbors(&self.wavelength_nm, wavelength_nm)
            .map_or(0.0, |parts| parts.iter().map(|&(index, share)| share * self.values[index]).sum())
    }

    /// The wavelengths in nm between which it is linear.
    pub fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelength_nm
    }

    /// The curve with zeros for what is below zero by no more than the rounding of its largest value, as sums leave it.
    #[must_use]
    pub fn without_rounding(mut self) -> Self {
        self.values = rounded_to_zero(self.values);
        self
    }

    /// The smallest and the largest value.
    pub fn extremes(&self) -> (f64, f64) {
        self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
    }
}

/// Values with zeros for what is below zero by no more than the rounding of the largest.
pub fn rounded_to_zero(mut values: Vec<f64>) -> Vec<f64> {
    let least = -f64::EPSILON * values.iter().copied().fold(0.0, f64::max);
    values.iter_mut().filter(|value| (least..0.0).contains(*value)).for_each(|value| *value = 0.0);
    values
}

/// Checks that wavelengths are positive, finite and strictly ascending.
///
/// # Errors
///
/// What is wrong, in words.
pub fn check_wavelengths(wavelength_nm: &[f64]) -> std::result::Result<(), String> {
    if wavelength_nm.is_empty() {
        return Err("it has no wavelengths".into());
    }
    if let Some(bad) = wavelength_nm.iter().find(|&&nm| !(nm > 0.0 && nm.is_finite())) {
        return Err(format!("{bad} is no wavelength in nm"));
    }
    match wavelength_nm.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some(pair) => Err(format!("wavelengths must ascend, but {} nm follows {} nm", pair[1], pair[0])),
        None => Ok(()),
    }
}

/// The two samples that a wavelength lies between, with the share of each; none beyond the table.
fn neighbors(table: &[f64], wavelength_nm: f64) -> Option<[(usize, f64); 2]> {
    let above = table.partition_point(|&nm| nm < wavelength_nm);
    if above == table.len() {
        return None;
    }
    if table[above] == wavelength_nm {
        return Some([(above, 1.0), (above, 0.0)]);
    }
    if above == 0 {
        return None;
    }
    let share = (wavelength_nm - table[above - 1]) / (table[above] - table[above - 1]);
    Some([(above - 1, 1.0 - share), (above, share)])
}

/// The wavelength in nm that a channel's name states, as in `S0.550,000000nm` or `S0.0,550um` \[Fichet2021], or the center of its bin, as in
/// `400.00-410.00nm` (Mitsuba 0.6); none for channels of another kind.
pub fn channel_wavelength_nm(channel: &str) -> Option<f64> {
    let is_wavelength = |nm: &f64| *nm > 0.0 && nm.is_finite();
    if let Some([begin, end]) = channel_bin_nm(channel) {
        return Some(f64::midpoint(begin, end));
    }
    let stated = channel.strip_prefix("S0.")?;
    let number = |text: &str| text.replace(',', ".").parse::<f64>().ok();
    let nm = match stated.strip_suffix("nm") {
        Some(nm) => number(nm)?,
        None => WavelengthUnit::Micrometer.nm(number(stated.strip_suffix("um")?)?),
    };
    Some(nm).filter(is_wavelength)
}

/// Whether a channel is named as \[Fichet2021] has it, in a unit of wavelength or frequency that is not read: `S0.545,1THz`.
pub fn is_channel_of_another_unit(channel: &str) -> bool {
    let Some(stated) = channel.strip_prefix("S0.") else { return false };
    let unit = stated.trim_start_matches(|symbol: char| symbol.is_ascii_digit() || symbol == ',' || symbol == '.');
    unit.len() < stated.len()
        && (unit.ends_with("Hz") || unit.ends_with('m'))
        && channel_wavelength_nm(channel).is_none()
}

/// Where the bin in nm that a channel's name states begins and ends, as in `400.00-410.00nm`, perhaps behind a layer's name.
pub fn channel_bin_nm(channel: &str) -> Option<[f64; 2]> {
    let (begin, end) = channel.strip_suffix("nm")?.split_once('-')?;
    // Each number has a point of its own; what stands before it is the layer.
    let begin = begin.rsplit('.').nth(1).map_or(begin, |_| {
        let point = begin.rfind('.').unwrap_or_default();
        begin[..point].rfind('.').map_or(begin, |layer| &begin[layer + 1..])
    });
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let number = |text: &str| text.parse::<f64>().ok().filter(|_| is_number(text));
    let bin = [number(begin)?, number(end)?];
    (0.0 < bin[0] && bin[0] < bin[1] && bin[1].is_finite()).then_some(bin)
}

/// Weights on a radiance's own samples that give a sum over another grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Folded {
    /// One weight per sample of the radiance.
    pub weights: Vec<f64>,
    /// Share of the summed absolute weight that lies where the radiance has no samples (taken as zero there).
    pub uncovered: f64,
}

/// Folds weights on the wavelengths `grid_nm` onto the wavelengths `sampled_nm` of a radiance.
///
/// Σ_g w_g L(λ_g) with L linear between its samples is linear in the samples, so it is Σ_j w′_j L_j.
pub fn fold(sampled_nm: &[f64], grid_nm: &[f64], weights: &[f64]) -> Folded {
    let mut folded = vec![0.0; sampled_nm.len()];
    let (mut covered, mut total) = (0.0, 0.0);
    for (&nm, &weight) in grid_nm.iter().zip(weights) {
        total += weight.abs();
        if let Some(parts) = neighbors(sampled_nm, nm) {
            covered += weight.abs();
            for (index, share) in parts {
                folded[index] += weight * share;
            }
        }
    }
    let uncovered = if total > 0.0 { 1.0 - covered / total } else { 0.0 };
    Folded { weights: folded, uncovered }
}

/// Samples beside each other in a chart of so many that come in no rows of their own: the smallest divisor that makes it at
/// least as wide as high.
pub fn chart_columns(samples: usize) -> usize {
    (1..=samples).find(|&width| samples.is_multiple_of(width) && width * width >= samples).unwrap_or(1)
}

/// Radiances on one grid of wavelengths.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::data::{load_observer, load_sensor};
/// use cyanometer::analysis::characterization::signals;
/// use cyanometer::spectrum::{SpectralLibrary, WavelengthGrid};
/// use ndarray::Array2;
///
/// // A library of one spectrum that is the same at all wavelengths, and of twice that.
/// let wavelength_nm: Vec<f64> = (360..=830).map(f64::from).collect();
/// let radiance = Array2::from_shape_fn((2, wavelength_nm.len()), |(sample, _)| 1e-6 * (sample + 1) as f64);
/// let library = SpectralLibrary { wavelength_nm, radiance, columns: 2 };
/// assert_eq!(library.sample(1)?[100], 2e-6);
///
/// // Equal energy lies at (⅓, ⅓), and twice the light is twice the signal.
/// let camera = load_sensor("kaf-5101ce")?;
/// let seen = signals(&library, &camera.sensor, camera.response()?, &load_observer()?, &WavelengthGrid::default())?;
/// let [x, y, z] = [0, 1, 2].map(|i| seen.xyz[(0, i)]);
/// assert!((x / (x + y + z) - 1.0 / 3.0).abs() < 1e-4);
/// assert!((seen.camera[(1, 0)] / seen.camera[(0, 0)] - 2.0).abs() < 1e-12);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralLibrary {
    /// Wavelengths in nm, ascending.
    pub wavelength_nm: Vec<f64>,
    /// Spectral radiance in W cm⁻² sr⁻¹ nm⁻¹, shape samples × wavelengths.
    pub radiance: Array2<f64>,
    /// Samples in a row of the image they come from; [`chart_columns`] for a table.
    pub columns: usize,
}

impl SpectralLibrary {
    /// One radiance, a sample for each wavelength.
    pub fn of_one(wavelength_nm: Vec<f64>, radiance: Vec<f64>) -> Self {
        let samples = Array1::from_vec(radiance).insert_axis(Axis(0));
        Self { wavelength_nm, radiance: samples, columns: 1 }
    }

    /// One radiance of the library.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] when there is no such sample.
    pub fn sample(&self, index: usize) -> Result<ArrayView1<'_, f64>> {
        if index >= self.radiance.nrows() {
            return Err(Error::Usage(format!(
                "there is no sample {index}: the library has samples 0 to {}",
                self.radiance.nrows() - 1
            )));
        }
        Ok(self.radiance.row(index))
    }
}

/// The CIE 1931 2° standard observer x̄, ȳ, z̄.
#[derive(Debug, Clone, PartialEq)]
pub struct Observer {
    /// Color-matching functions x̄, ȳ, z̄.
    pub matching: [Curve; 3],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channel_names_state_wavelengths() {
        assert_eq!(channel_wavelength_nm("S0.550,000000nm"), Some(550.0));
        assert_eq!(channel_wavelength_nm("S0.550.5nm"), Some(550.5));
        assert_eq!(channel_wavelength_nm("S0.0,550000um"), Some(550.0));
        assert_eq!(channel_wavelength_nm("400.00-410.00nm"), Some(405.0));
        assert_eq!(channel_wavelength_nm("direct.400.00-410.00nm"), Some(405.0));
        for other in
            ["R", "S1.550,0nm", "S0.nm", "S0.-1nm", "T.550,0nm", "410.00-400.00nm", "-410.00nm", "a-bnm", "x.1-nm"]
        {
            assert_eq!(channel_wavelength_nm(other), None);
        }
        assert!(["S0.545,1THz", "S0.5,5mm", "S0.0,0000005m"].into_iter().all(is_channel_of_another_unit));
        assert!(
            !["S0.550,0nm", "S0.0,55um", "S0.nm", "S1.545,1THz", "S0.1,0"].into_iter().any(is_channel_of_another_unit)
        );
    }

    #[test]
    fn charts_are_whole_rectangles_near_a_square() {
        assert_eq!([1, 2, 4, 12, 912, 1600, 13].map(chart_columns), [1, 2, 2, 4, 38, 40, 13]);
    }

    #[test]
    fn the_default_grid_is_the_papers() {
        let (wavelengths, weights) = WavelengthGrid::default().points().unwrap();
        assert_eq!((wavelengths.len(), wavelengths[0], wavelengths[470]), (471, 360.0, 830.0));
        assert_eq!(weights.iter().sum::<f64>(), 471.0);
    }

    #[test]
    fn folding_and_interpolating_give_the_same_sum() {
        let sampled = [400.0, 410.0, 430.0, 500.0];
        let values = [1.0, 3.0, -2.0, 5.0];
        let curve = Curve::new(sampled.to_vec(), values.to_vec()).unwrap();
        let grid: Vec<f64> = (0..120).map(|i| 395.0 + f64::from(i)).collect();
        let weights: Vec<f64> = grid.iter().map(|nm| (nm / 100.0).sin()).collect();
        let direct: f64 = grid.iter().zip(&weights).map(|(&nm, w)| w * curve.at(nm)).sum();
        let folded = fold(&sampled, &grid, &weights);
        let sum: f64 = folded.weights.iter().zip(values).map(|(w, v)| w * v).sum();
        assert!((direct - sum).abs() < 1e-12 * direct.abs().max(1.0));
        assert!(folded.uncovered > 0.0 && folded.uncovered < 0.3);
    }

    #[test]
    fn grids_that_make_no_sense_are_refused() {
        let grid = |start_nm, end_nm, step_nm| WavelengthGrid { start_nm, end_nm, step_nm, ..Default::default() };
        for bad in [
            grid(830.0, 360.0, 1.0),
            grid(360.0, 830.0, 0.0),
            grid(360.0, 830.0, f64::NAN),
            grid(360.0, 830.5, 1.0),
            grid(0.36, 0.83, 0.01),
        ] {
            assert!(bad.points().is_err(), "{bad:?}");
        }
    }
}

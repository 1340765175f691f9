//! The uncertainty of each pixel of a frame, from the sensor's noise model at the pixel's own level.
//!
//! Scenes need not be uniform: each pixel's demosaicked R, G and B tell the signal of the photosites around it, the noise
//! model their variances, and the weights of its phase (folded back at the edges) its covariance. What varies within the
//! reach of the weights, three photosites, is taken as level.

use super::charge;
use super::covariance::{Covariance, PAIRS};
use super::frame::{corrected, quantity_of_sites};
use super::lines::LineTerms;
use super::moments::Equations;
use super::photosite::Photosite;
use super::repeated::average_of;
use super::smooth_hue;
use crate::cfa::Class;
use crate::error::Result;
use crate::frame::Geometry;
use crate::metadata::{AdcRecord, AverageRecord, FrameHeader, NoiseRecord};
use crate::names::Named;
use crate::random::Source;
use crate::stages::demosaic::Method;
use crate::stages::demosaic::stencil::{Stencil, phase};
use crate::stages::demosaic::weights::WeightTable;
use crate::stages::noise::NoiseModel;
use crate::units::QuantityKind;
use rayon::prelude::*;

/// Tells the covariance of the demosaicked R, G and B of a pixel from its place and level.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelNoise {
    columns: Places,
    rows: Places,
    /// Gains of the pixels of each row class and, within, each column class.
    gains: Vec<PixelGains>,
    /// The same of what whole rows, columns and sites are off together, and its variances; none where the black level has none.
    of_black: Option<(Vec<PixelGains>, [f64; 3])>,
    /// What photosites share by rows and by columns; none where they share nothing.
    of_lines: Option<PixelLines>,
    depends_on_hue: bool,
    variances: [LevelVariance; 3],
    /// What no light reads in the frame, in the unit of its samples.
    black: f64,
}

/// Which columns, or rows, are alike: all near the edges differ, those between repeat with the array's period.
#[derive(Debug, Clone, PartialEq)]
struct Places {
    length: usize,
    reach: usize,
    /// One place of each kind.
    examples: Vec<usize>,
}

impl Places {
    fn new(length: usize, reach: usize) -> Self {
        let examples = if length <= 2 * reach + 2 {
            (0..length).collect()
        } else {
            (0..reach + 2).chain(length - reach..length).collect()
        };
        Self { length, reach, examples }
    }

    fn kind(&self, place: usize) -> usize {
        let Self { length, reach, .. } = *self;
        if length <= 2 * reach + 2 || place < reach {
            place
        } else if place >= length - reach {
            reach + 2 + place - (length - reach)
        } else {
            reach + (place - reach) % 2
        }
    }
}

/// Gains of three variances, those of the classes or of the black level, for the six covariances, as polynomials in the pixel's
/// hues: with weights f + ρ h, cov(k, m) = Σ \[f f + ρ_k h f + ρ_m f h + ρ_k ρ_m h h] σ².
#[derive(Debug, Clone, PartialEq)]
struct PixelGains<const N: usize = 3>([[[f64; N]; 4]; 6]);

/// What photosites share by rows and by columns, at any pixel.
#[derive(Debug, Clone, PartialEq)]
struct PixelLines {
    /// Gains of the covariances of pairs of classes, in rows and in columns.
    gains: Vec<PixelGains<{ 2 * PAIRS.len() }>>,
    terms: [LineTerms; 2],
    photosite: Photosite,
}

impl PixelLines {
    /// The covariances of pairs of classes at levels above black.
    fn at(&self, level: [f64; 3]) -> [f64; 2 * PAIRS.len()] {
        let full_well_e = self.photosite.model.full_well_e;
        // `max` drops what is no number.
        let expected_e = level.map(|level| self.photosite.expected_at(level.max(0.0)).max(0.0).min(full_well_e));
        let x = self.photosite.line_signals(expected_e);
        let dark_e = self.photosite.model.dark_e;
        let slope = expected_e.map(|e| self.photosite.adc.map_or(1.0, |adc| adc.sample_per_e(e + dark_e)));
        std::array::from_fn(|index| {
            let [k, l] = PAIRS[index % PAIRS.len()];
            slope[k] * slope[l] * self.terms[index / PAIRS.len()].at(x[k], x[l])
        })
    }
}

impl PixelGains<{ 2 * PAIRS.len() }> {
    /// Those of what pairs of classes share in rows, then in columns.
    fn of_lines(table: &WeightTable, at: [usize; 2], geometry: &Geometry) -> Self {
        let phase = phase_at(at, geometry);
        let class = |offset| table.class(phase, offset) as usize;
        Self::by(table, at, geometry, |a, b| {
            let mut sums = [0.0; 2 * PAIRS.len()];
            for (here, weight) in a.sites() {
                for (there, other) in b.sites() {
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

impl PixelGains {
    /// Those of the classes.
    fn new(table: &WeightTable, at: [usize; 2], geometry: &Geometry) -> Self {
        let phase = phase_at(at, geometry);
        let class = |offset| table.class(phase, offset) as usize;
        Self::by(table, at, geometry, |a, b| {
            let mut sums = [0.0; 3];
            for (offset, weight) in a.sites() {
                sums[class(offset)] += weight * b.at(offset);
            }
            sums
        })
    }

    /// Those of what the photosites of a row, of a column and of a site of 2×2 have in common.
    fn of_black(table: &WeightTable, at: [usize; 2], geometry: &Geometry) -> Self {
        let is_even = |distance: isize| distance & 1 == 0;
        Self::by(table, at, geometry, |a, b| {
            let mut sums = [0.0; 3];
            for ([x, y], weight) in a.sites() {
                for ([other_x, other_y], other) in b.sites() {
                    let both = weight * other;
                    sums[0] += if y == other_y { both } else { 0.0 };
                    sums[1] += if x == other_x { both } else { 0.0 };
                    sums[2] += if is_even(x - other_x) && is_even(y - other_y) { both } else { 0.0 };
                }
            }
            sums
        })
    }
}

impl<const N: usize> PixelGains<N> {
    fn by(
        table: &WeightTable,
        at: [usize; 2],
        geometry: &Geometry,
        dot: impl Fn(&Stencil, &Stencil) -> [f64; N],
    ) -> Self {
        let phase = phase_at(at, geometry);
        let folded = |stencil: &Stencil| stencil.folded(at, [geometry.width, geometry.height]);
        let [fixed, of_hue] = [table.fixed(phase), table.of_hue(phase)].map(|stencils| stencils.each_ref().map(folded));
        Self(PAIRS.map(|[k, m]| {
            [
                dot(&fixed[k], &fixed[m]),
                dot(&of_hue[k], &fixed[m]),
                dot(&fixed[k], &of_hue[m]),
                dot(&of_hue[k], &of_hue[m]),
            ]
        }))
    }

    fn covariance(&self, variances: [f64; N], hues: Option<[f64; 3]>) -> Covariance {
        let sum = |gains: &[f64; N]| {
            let (first, rest) = (gains[0] * variances[0], gains.iter().zip(variances).skip(1));
            rest.fold(first, |sum, (gain, variance)| sum + gain * variance)
        };
        let mut covariance = [0.0; 6];
        for ((value, [k, m]), gains) in covariance.iter_mut().zip(PAIRS).zip(&self.0) {
            *value = sum(&gains[0]);
            if let Some(hue) = hues {
                *value += hue[k] * sum(&gains[1]) + hue[m] * sum(&gains[2]) + hue[k] * hue[m] * sum(&gains[3]);
            }
        }
        covariance
    }
}

fn phase_at(at: [usize; 2], geometry: &Geometry) -> usize {
    let origin = geometry.origin.map(i64::from);
    phase(origin[0] + at[0] as i64, origin[1] + at[1] as i64)
}

/// Variance of a photosite against its level above black, linear between equally spaced levels.
///
/// Variance is a parabola in the level away from saturation, so a table of 1024 steps is off by less than
/// prnu² step²/4 ≈ 0.02 e² of several hundred.
#[derive(Debug, Clone, PartialEq)]
struct LevelVariance {
    step: f64,
    values: Vec<f64>,
    /// The level below which an average hangs on where in a code it lies, which no level of a pixel tells.
    told_from: f64,
}

const STEPS: usize = 1024;

impl LevelVariance {
    /// Of R, G and B, which differ where flat fields do.
    fn of_classes(photosite: &Photosite, average: Option<&AverageRecord>, largest: f64) -> [Self; 3] {
        match photosite.flat {
            None => {
                let all = Self::new(photosite, 0, average, largest);
                [all.clone(), all.clone(), all]
            }
            Some(_) => [0, 1, 2].map(|class| Self::new(photosite, class, average, largest)),
        }
    }

    fn new(photosite: &Photosite, class: usize, average: Option<&AverageRecord>, largest: f64) -> Self {
        // Patterns that are cut off at zero take long to predict, and their variances are smooth.
        let is_rectified = photosite.model.response().max(photosite.model.dcnu) > 0.2;
        let steps = if is_rectified || photosite.has_tails() { STEPS / 8 } else { STEPS };
        let step = largest / steps as f64;
        let one = |expected_e: f64| {
            if photosite.flat.is_some() {
                return photosite.variance_divided(class, expected_e);
            }
            if photosite.has_tails() {
                return photosite.moments(expected_e).moments.variance;
            }
            let Some(adc) = photosite.adc else { return photosite.moments(expected_e).moments.variance };
            if photosite.darks[0].is_some() {
                return photosite.less_dark(&adc, expected_e, false).moments.variance;
            }
            let electrons = photosite.model.dark_e + expected_e;
            let slope = adc.sample_per_e(electrons);
            let charge = charge::charge(&photosite.model, expected_e).variance + photosite.model.added().powi(2);
            // Below half a code what rounding does hangs on the fraction of a code, which no pixel's level tells.
            if charge.sqrt() * slope < 0.5 * adc.sample_slope(adc.level_at(electrons)) {
                charge * slope * slope + adc.rounding_at(electrons)
            } else {
                photosite.moments(expected_e).moments.variance
            }
        };
        let variance = |index: usize| {
            let expected_e = photosite.expected_at(index as f64 * step);
            let one = one(expected_e);
            average.map_or(one, |record| photosite.variance_of_average(class, expected_e, one, record))
        };
        let is_by_code = |index: &usize| {
            let expected_e = photosite.expected_at(*index as f64 * step);
            let is_by_code = |record| photosite.is_average_by_code(expected_e, record);
            average.is_some_and(is_by_code) && !photosite.is_spread_over_codes(expected_e)
        };
        let told_from = match (0..=steps).rev().find(is_by_code) {
            Some(last) if last == steps => f64::INFINITY,
            Some(last) => (last + 1) as f64 * step,
            None => f64::NEG_INFINITY,
        };
        Self { step, values: (0..=steps).into_par_iter().map(variance).collect(), told_from }
    }

    /// The variance at a level; below zero as at zero, beyond the last as there.
    fn at(&self, level: f64) -> f64 {
        let steps = self.values.len() - 1;
        let place = (level / self.step).clamp(0.0, steps as f64);
        // A level that is not finite has a neighbor's variance, as its sample has no meaning; `min` and `max` drop NaN.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1024; NaN becomes 0")]
        let index = (place as usize).min(steps - 1);
        let share = if place.is_nan() { 0.0 } else { place - index as f64 };
        self.values[index] + share * (self.values[index + 1] - self.values[index])
    }
}

impl PixelNoise {
    /// The noise of the pixels of a demosaicked frame.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::MissingKey`] where the metadata name no sensor, exposure or converter, or no read-out of the sensor;
    /// [`crate::error::Error::Order`] for a frame that is not demosaicked.
    pub fn of(frame: &FrameHeader) -> Result<Self> {
        let metadata = &frame.metadata;
        let record = metadata.demosaic.as_ref().ok_or_else(|| {
            frame.out_of_order(
                format!("it holds {}, and nothing says how it was demosaicked", frame.holds()),
                "demosaic",
            )
        })?;
        let method = Method::named(&record.method)
            .ok_or_else(|| frame.refuse(format!("it was demosaicked by `{}`, a method unknown here", record.method)))?;
        let (photosite, black) = photosite_of(frame)?;
        let largest = photosite.model.full_well_e * photosite.slope();
        let table = WeightTable::of(method, record.cfa);
        let columns = Places::new(frame.geometry.width, method.reach());
        let rows = Places::new(frame.geometry.height, method.reach());
        let places = || rows.examples.iter().flat_map(|&y| columns.examples.iter().map(move |&x| [x, y]));
        let gains = |gains: fn(&WeightTable, [usize; 2], &Geometry) -> PixelGains| -> Vec<PixelGains> {
            places().map(|at| gains(table, at, &frame.geometry)).collect()
        };
        photosite.check_tails([0.0; 3]).map_err(|why| frame.refuse(why.to_string()))?;
        photosite.check_lines().map_err(|why| frame.refuse(why.to_string()))?;
        let average = match &metadata.average {
            Some(record) => {
                let record =
                    average_of(frame, record, quantity_of_sites(frame)).map_err(|why| frame.refuse(why.to_string()))?;
                photosite.check_average(&record).map_err(|why| frame.refuse(why.to_string()))?;
                Some(record)
            }
            None => None,
        };
        let of_lines = photosite.has_lines().then(|| PixelLines {
            gains: places().map(|at| PixelGains::of_lines(table, at, &frame.geometry)).collect(),
            terms: photosite.line_terms(average.as_ref()),
            photosite,
        });
        let of_black = metadata
            .black_noise
            .map(|noise| (gains(PixelGains::of_black), [noise.row_adu2, noise.column_adu2, noise.site_adu2]));
        let gains = gains(PixelGains::new);
        let variances = LevelVariance::of_classes(&photosite, average.as_ref(), largest);
        Ok(Self { columns, rows, gains, of_black, of_lines, depends_on_hue: table.depends_on_hue(), variances, black })
    }

    /// The covariance of the pixel in column `x` and row `y` of the frame, whose samples are `rgb`; and whether
    /// propagation holds there.
    ///
    /// Where smooth hue transition divides by a green that is lost in noise, the covariance is that of the hue which
    /// green would make at its noise, and says only that it is large. Where a median or clipped mean of codes scatters over less than
    /// a code, it is that of an average over all places in a code.
    pub fn covariance(&self, [x, y]: [usize; 2], rgb: [f64; 3]) -> (Covariance, bool) {
        let kind = self.rows.kind(y) * self.columns.examples.len() + self.columns.kind(x);
        let level = rgb.map(|sample| sample - self.black);
        let all = |mut variances: [f64; 3], hues: Option<[f64; 3]>| {
            let shared = self.of_lines.as_ref().map(|lines| (&lines.gains[kind], lines.at(level)));
            if let Some((_, shared)) = &shared {
                for (k, variance) in variances.iter_mut().enumerate() {
                    let own = PAIRS.iter().position(|pair| *pair == [k, k]).unwrap_or_default();
                    *variance = (*variance - shared[own] - shared[PAIRS.len() + own]).max(0.0);
                }
            }
            let mut covariance = self.gains[kind].covariance(variances, hues);
            if let Some((gains, shared)) = shared {
                let more = gains.covariance(shared, hues);
                covariance.iter_mut().zip(more).for_each(|(covariance, more)| *covariance += more);
            }
            if let Some((gains, of_black)) = &self.of_black {
                let more = gains[kind].covariance(*of_black, hues);
                covariance.iter_mut().zip(more).for_each(|(covariance, more)| *covariance += more);
            }
            covariance
        };
        let variances = [0, 1, 2].map(|class| self.variances[class].at(level[class]));
        let is_told = !(0..3).any(|class| level[class] < self.variances[class].told_from);
        if !self.depends_on_hue {
            return (all(variances, None), is_told);
        }
        let green = level[Class::Green as usize];
        let first_order = smooth_hue::FirstOrder::of(level, variances);
        let floor = variances[Class::Green as usize].sqrt() / 2.0;
        let divisor = if green > floor { green } else { floor.max(f64::MIN_POSITIVE) };
        let hues = level.map(|level| {
            let hue = level.max(0.0) / divisor;
            if hue.is_finite() { hue } else { 1.0 }
        });
        (all(variances, Some(hues)), is_told && first_order.holds)
    }
}

/// The photosites that a demosaicked frame was made of, and what no light reads in it, in the unit of its samples.
fn photosite_of(frame: &FrameHeader) -> Result<(Photosite, f64)> {
    let metadata = &frame.metadata;
    if metadata.is_transferred() || metadata.correction.as_ref().is_some_and(|correction| correction.cte.is_some()) {
        return Err(frame.refuse(
            "its charge was transferred, and what that does to noise differs from place to place; no standard \
             deviations can be told",
        ));
    }
    let readout = frame.readout()?;
    let noise = match &metadata.noise {
        Some(noise) => noise.clone(),
        None => whole_noise(frame)?,
    };
    let model = NoiseModel::of(frame, &noise)?;
    let photosite = Photosite::of_electrons(model, Equations::Exact);
    let found = match metadata.quantity {
        QuantityKind::Electrons | QuantityKind::ExpectedElectrons => (photosite, metadata.dark_signal_e.unwrap_or(0.0)),
        _ => {
            let adc = metadata.adc.unwrap_or_else(|| AdcRecord::of_readout(readout));
            let codes = corrected(frame, photosite.digitized(adc)).map_err(|why| frame.refuse(why.to_string()))?;
            (codes, frame.uniform_black_adu()?)
        }
    };
    Ok(found)
}

/// The level above black below which the green of a frame demosaicked by smooth hue transition is less than
/// [`smooth_hue::VOID_BELOW`] times its noise; none for other methods, and where the noise is not known.
pub fn dim_green_below(frame: &FrameHeader) -> Option<f64> {
    let record = frame.metadata.demosaic.as_ref()?;
    if Method::named(&record.method) != Some(Method::SmoothHue) {
        return None;
    }
    let (photosite, black) = photosite_of(frame).ok()?;
    let slope = photosite.slope();
    let mut level = 0.0;
    // Rises to where a level is so many times its noise; the noise rises as its root.
    for _ in 0..40 {
        let charge = charge::charge(&photosite.model, level / slope).variance + photosite.model.added().powi(2);
        let rounding = if photosite.adc.is_some() { 1.0 / 12.0 } else { 0.0 };
        level = smooth_hue::VOID_BELOW * (charge * slope * slope + rounding).sqrt() / 2.0;
    }
    Some(black + level).filter(|level| level.is_finite())
}

/// Everything that the sensor's noise is made of, for a frame whose metadata do not say what was drawn.
fn whole_noise(frame: &FrameHeader) -> Result<NoiseRecord> {
    let readout = frame.readout()?;
    let temperature_k = readout.temperature_k;
    Ok(NoiseRecord {
        sources: Source::ALL.to_vec(),
        seed: 0,
        sensor_seed: 0,
        frame: 0,
        temperature_k,
        dark_e: readout.dark_current_e_per_s(temperature_k) * frame.exposure()?.exposure_s,
        hot_pixel_e: readout.hot_pixel_e_per_s(temperature_k) * frame.exposure()?.exposure_s,
        poisson: crate::metadata::PoissonKind::Exact,
        cte: None,
    })
}

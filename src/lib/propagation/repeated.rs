//! Exposures of one scene: what is drawn anew in each, what is the same in all, and what their average keeps of both.
//!
//! Over exposures a photosite has the mean m and the cumulants v, k₃ and k₄, which differ from photosite to photosite as the
//! fixed patterns make them. E v is the temporal variance, Var m the fixed one. The mean of N exposures has, over photosites,
//!
//! - κ₂ = Var m + E v/N
//! - κ₃ = κ₃(m) + 3 cov(v, m)/N + E k₃/N²
//! - κ₄ = κ₄(m) + 6 κ(v, m, m)/N + \[4 cov(k₃, m) + 3 Var v]/N² + E k₄/N³
//!
//! by the law of total cumulance \[Brillinger1969], so that all follows from a single exposure, N = 1, less what averaging takes
//! off. The variance s² of N exposures of one photosite about their mean has
//!
//! - E s² = E v,  Var s² = 2 E v²/(N − 1) + E k₄/N + Var v
//!
//! E v is the whole variance less that of the pattern, exact wherever these are. The other cumulants, which only tell how far
//! measured variances scatter, are sums over the sensitivities of photosites, of which each is taken to read a normal charge.

use super::charge::{charge_at, sensitivities};
use super::law::Law;
use super::masters::{Dark, MOST_DARKS, kept};
use super::moments::{Equations, LineCovariance, Prediction};
use super::photosite::Photosite;
use super::reading::{Reading, codes_of};
use super::unlike::{Temporal, Unlike, UnlikeSums};
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::{AdcRecord, AverageRecord, ExposuresRecord, FrameHeader};
use crate::names::Named;
use crate::numerics::averages::{CLIP, Kept};
use crate::numerics::normal::MeanVariance;
use crate::stages::demosaic::Method;
use crate::stages::noise::LineNoise;
use crate::units::QuantityKind;

/// Why nothing is said of averages that are no means where photosites share noise.
const NO_MEANS: &str = "medians and clipped means of exposures whose rows or columns share noise, or that have hot pixels or random \
                        telegraph signals, follow no formula here";

/// The standard deviation, in codes, of what is drawn anew below which the means of photosites show how codes are rounded: what
/// that does to their variance is less than e^(−4π²σ²)/2π², 10⁻⁵ of a squared code.
const VISIBLE: f64 = 0.46;

/// Why nothing is said of averages that were digitized.
const BEFORE_THE_CONVERTER: &str = "it was averaged as electrons, and digitized then, which no camera does";

/// Why nothing is said of averages of pixels that are no means.
const NO_MEANS_OF_PIXELS: &str = "it is the median or clipped mean of frames that were demosaicked, whose channels it mixes; average \
                                  before demosaicking";

/// Why nothing is said of averages of what is curved.
const CURVED: &str = "it is an average of what is curved in the samples of photosites: hues, or colors that are not linear; average \
                      before these are made";

/// Whether what a frame holds is linear in the samples of its photosites.
pub(super) fn is_linear(frame: &FrameHeader) -> bool {
    let metadata = &frame.metadata;
    let of_method =
        metadata.demosaic.as_ref().is_none_or(|record| Method::named(&record.method) != Some(Method::SmoothHue));
    let quantities = [
        QuantityKind::ExpectedElectrons,
        QuantityKind::Electrons,
        QuantityKind::Adu,
        QuantityKind::Xyz,
        QuantityKind::LinearSrgb,
    ];
    of_method && quantities.contains(&metadata.quantity)
}

/// How the exposures were averaged that a frame is made of, whose photosites held such a quantity.
///
/// # Errors
///
/// [`Unpredictable::Beyond`] where no formula follows the average through what was done since.
pub(super) fn average_of(
    frame: &FrameHeader,
    record: &ExposuresRecord,
    of_sites: QuantityKind,
) -> Predicted<AverageRecord> {
    let is_before = matches!(record.quantity, QuantityKind::Electrons | QuantityKind::ExpectedElectrons);
    let mut averaged = frame.clone();
    averaged.metadata.quantity = record.quantity;
    if is_before && of_sites == QuantityKind::Adu {
        return Err(Unpredictable::Beyond(BEFORE_THE_CONVERTER));
    }
    if record.demosaicked && !is_linear(&averaged) {
        return Err(Unpredictable::Beyond(CURVED));
    }
    if record.demosaicked && !is_mean(&record.average()) {
        return Err(Unpredictable::Beyond(NO_MEANS_OF_PIXELS));
    }
    Ok(record.average())
}

/// Whether an average is the mean of its frames.
fn is_mean(record: &AverageRecord) -> bool {
    kept(record.combine, record.frames, record.clip.unwrap_or(CLIP), 16.0) == Kept::of_mean(record.frames)
}

impl Photosite {
    /// Makes sure that a formula is known for an average of exposures.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`].
    pub(super) fn check_average(&self, record: &AverageRecord) -> Predicted<()> {
        let is_known = is_mean(record) || !(self.has_lines() || self.has_tails());
        if is_known { Ok(()) } else { Err(Unpredictable::Beyond(NO_MEANS)) }
    }

    /// The variance of an average of exposures of which one has the variance `one`.
    pub(super) fn variance_of_average(&self, class: usize, expected_e: f64, one: f64, record: &AverageRecord) -> f64 {
        let of_one = Prediction::of_cumulants(0.0, one, 0.0, 0.0);
        self.temporal(class, expected_e).averaged(&of_one, record).moments.variance
    }

    /// What is drawn anew in each exposure at photosites of the class R, G or B, what rows and columns share apart.
    fn temporal(&self, class: usize, expected_e: f64) -> Temporal {
        if let Some((_, found)) = self.flat.and_then(|_| self.divided_over(class, expected_e)) {
            return found;
        }
        let one = Self { darks: [None; MOST_DARKS], flat: None, ..*self };
        let rounding = one.adc.map_or(0.0, |adc| adc.rounding_at(one.model.dark_e + expected_e));
        let unlike = (!one.has_tails()).then(|| one.unlike(expected_e));
        let variance = one.temporal_variance(expected_e);
        Temporal { variance, rounding: rounding.min(variance), unlike, lines: LineCovariance::default() }
    }

    /// E v of samples that nothing came off.
    fn temporal_variance(&self, expected_e: f64) -> f64 {
        let whole = self.moments(expected_e).moments.variance;
        let shows_codes = |adc: &AdcRecord| Dark::mean_of(self.model, 1).std_codes(adc, expected_e) < VISIBLE;
        let fixed = match self.adc.filter(|_| !self.has_tails() && self.equations == Equations::Exact) {
            Some(adc) if shows_codes(&adc) => self.shared(&adc, (expected_e, None), (self, None), true).light,
            _ => self.fixed_variance(expected_e),
        };
        (whole - fixed).clamp(0.0, whole)
    }

    fn unlike(&self, expected_e: f64) -> Unlike {
        let law = Law::of(&self.model, expected_e);
        let [lights, darks] = [self.model.response(), self.model.dcnu].map(sensitivities);
        let mut sums = UnlikeSums::default();
        for (&(x, of_x), &(u, of_u)) in lights.iter().flat_map(|x| darks.iter().map(move |u| (x, u))) {
            let charge = charge_at(&self.model, expected_e, [x, u]);
            let MeanVariance { mean, variance } = charge.clipped_above(law.full_well_e);
            let share = if charge.variance > 0.0 { (variance / charge.variance).sqrt() } else { 0.0 };
            let (reading, slope) = match self.adc {
                Some(adc) => (law.of_codes(&adc, codes_of(&adc)), adc.sample_per_e(mean)),
                None => (law.of_electrons(), 1.0),
            };
            let moments = Reading { noise_e: self.model.read_noise(), ..reading }.at(mean, variance);
            let found = Prediction::about(0.0, &moments);
            // What counts are skewed by; where they are cut off, less.
            let shot = charge.scaled(slope * share);
            let sample =
                [found.moments.mean, found.moments.variance, found.third + shot.third, found.fourth() + shot.fourth];
            sums.add(of_x * of_u, sample);
        }
        sums.found().1
    }
}

impl Photosite {
    /// What is drawn anew in each exposure at photosites of such signals, by classes.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`] where no formula tells what rows and columns share.
    pub(super) fn temporal_of(&self, expected_e: [f64; 3]) -> Predicted<[Temporal; 3]> {
        let lines = if self.has_lines() {
            let mut one = Self { darks: [None; MOST_DARKS], flat: None, ..*self };
            let temporal =
                LineNoise { dsnu_row_e: 0.0, dsnu_column_e: 0.0, prnu_row: 0.0, prnu_column: 0.0, ..self.model.lines };
            one.model.lines = temporal;
            one.lines(expected_e)?
        } else {
            [LineCovariance::default(); 3]
        };
        Ok([0, 1, 2].map(|k| Temporal { lines: lines[k], ..self.temporal(k, expected_e[k]) }))
    }

    /// What an average of exposures keeps of samples of which one exposure has such moments.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`] where no formula tells.
    pub(super) fn averaged(
        &self,
        moments: [Prediction; 3],
        expected_e: [f64; 3],
        record: &AverageRecord,
    ) -> Predicted<[Prediction; 3]> {
        self.check_average(record)?;
        let temporal = self.temporal_of(expected_e)?;
        Ok([0, 1, 2].map(|k| temporal[k].averaged(&moments[k], record)))
    }
}

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
//! measured variances scatter, are sums over photosites and their counts ([`population`](super::population)); so are medians of
//! codes that scatter over less than a code, or are far from normal.

use super::anew::drawn_anew;
use super::counts::Charge;
use super::law::Law;
use super::masters::{Dark, MOST_DARKS, kept};
use super::moments::{Equations, LineCovariance, Prediction};
use super::photosite::Photosite;
use super::reading::codes_of;
use super::unlike::Temporal;
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::{AdcRecord, AverageRecord, ExposuresRecord, FrameHeader};
use crate::names::Named;
use crate::numerics::averages::{CLIP, Combine, Kept};
use crate::numerics::normal::cumulative;
use crate::stages::demosaic::Method;
use crate::stages::noise::{LineNoise, NoiseModel};
use crate::units::QuantityKind;

/// Why nothing is said of averages that are no means where photosites share noise.
const NO_MEANS: &str = "medians and clipped means of exposures whose rows or columns share noise, or that have hot pixels or random \
                        telegraph signals, follow no formula here";

/// The standard deviation, in codes, of what is drawn anew below which the means of photosites show how codes are rounded: what
/// that does to their variance is less than e^(−4π²σ²)/2π², 10⁻⁵ of a squared code.
const VISIBLE: f64 = 0.46;

/// The same where full well or an end of the codes is within reach.
const VISIBLE_AT_ENDS: f64 = 4.0;

/// Why nothing is said of clipped means of codes of little noise.
pub(super) const CLIPPED_BY_CODE: &str = "the noise of its exposures, over few codes, makes what their clipped mean leaves out hang on \
                                          where in a code the mean of each photosite lies; use `--combine mean`";

/// Why nothing is said of medians of codes of little noise.
pub(super) const MEDIAN_BY_CODE: &str = "the noise of its exposures, over few codes, makes their median hang on where in a code the mean \
                                         of each photosite lies, and that is not told; use `--combine mean`";

/// Why nothing is said of averages of what is far from normal.
const FAR_FROM_NORMAL: &str = "full well or an end of the codes cuts off its exposures, or they hold few electrons, and no formula tells \
                               what their median or clipped mean keeps; use `--combine mean`";

/// Why nothing is said of averages that were digitized.
const BEFORE_THE_CONVERTER: &str = "it was averaged as electrons, and digitized then, which no camera does";

/// Why nothing is said of averages of pixels that are no means.
const NO_MEANS_OF_PIXELS: &str = "it is the median or clipped mean of frames that were demosaicked, whose channels it mixes; average \
                                  before demosaicking";

/// Why nothing is said of medians of exposures of unlike light.
const UNLIKE_LEVELS: &str = "it is the median or clipped mean of exposures whose light differed by more than their noise, the exposure in \
                             the middle rather than an average; use `--combine mean`";

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
    if record.unlike_levels > 0.0 {
        return Err(Unpredictable::Beyond(UNLIKE_LEVELS));
    }
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

/// What rows and columns have anew in each exposure.
pub(super) fn without_fixed(lines: LineNoise) -> LineNoise {
    LineNoise { dsnu_row_e: 0.0, dsnu_column_e: 0.0, prnu_row: 0.0, prnu_column: 0.0, ..lines }
}

/// Whether an average is the mean of its frames.
fn is_mean(record: &AverageRecord) -> bool {
    kept(record.combine, record.frames, record.clip.unwrap_or(CLIP), 16.0) == Kept::of_mean(record.frames)
}

impl Photosite {
    /// One exposure, of which nothing came off.
    #[must_use]
    pub(super) fn one_exposure(&self) -> Self {
        Self { darks: [None; MOST_DARKS], flat: None, ..*self }
    }

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
        self.temporal(class, expected_e, false).averaged(&of_one, record).moments.variance
    }

    /// What is drawn anew in each exposure at photosites of the class R, G or B, what rows and columns share apart; where it is asked,
    /// how photosites differ.
    pub(super) fn temporal(&self, class: usize, expected_e: f64, is_told: bool) -> Temporal {
        if let Some((_, found)) = self.flat.and_then(|_| self.divided_over(class, expected_e)) {
            return found;
        }
        let one = self.one_exposure();
        let rounding = one.adc.map_or(0.0, |adc| adc.rounding_at(one.model.dark_e + expected_e));
        let unlike = (is_told && !one.has_tails()).then(|| one.unlike(expected_e));
        let whole = one.moments(expected_e);
        let variance = one.temporal_variance(expected_e, whole.moments.variance);
        Temporal {
            variance,
            rounding: rounding.min(variance),
            unlike,
            single: [whole.third, whole.fourth()],
            lines: LineCovariance::default(),
        }
    }

    /// Whether the means of photosites over exposures show how codes are rounded: of most, or of so many that have no sensitivity to light,
    /// or to dark current, and less noise with it, that the variance of all shows what half a code does to theirs.
    ///
    /// p d > 10⁻³ v        p their share, d how far they lie from the mean in codes, v what is drawn anew at most, in squared codes
    fn shows_codes(&self, adc: &AdcRecord, expected_e: f64) -> bool {
        const SHOWS: f64 = 1e-3;
        let std_codes = |model: NoiseModel, expected_e: f64| Dark::mean_of(model, 1).std_codes(adc, expected_e);
        let most = std_codes(self.model, expected_e);
        let law = Law::of(&self.model, expected_e);
        let are_apart = |charge: &Charge, (model, expected_e): (NoiseModel, f64)| {
            charge.is_rectified(law.full_well_e)
                && cumulative(-1.0 / charge.pattern) * adc.adu_per_e * charge.rate > SHOWS * most * most
                && std_codes(model, expected_e) < VISIBLE
        };
        !self.is_rare
            && (most < VISIBLE
                || !self.has_tails() && law.counts_show(adc, VISIBLE)
                || are_apart(&law.light, (self.model, 0.0))
                || are_apart(&law.dark, (NoiseModel { dark_e: 0.0, ..self.model }, expected_e)))
    }

    /// E v of samples that nothing came off.
    pub(super) fn temporal_variance(&self, expected_e: f64, whole: f64) -> f64 {
        let adc = self.adc.filter(|_| self.equations == Equations::Exact);
        let anew = match adc {
            Some(adc) if self.has_tails() && self.shows_codes(&adc, expected_e) => self.mixed_temporal(expected_e),
            Some(adc) if !self.has_tails() && (self.shows_codes(&adc, expected_e) || self.ends(&adc, expected_e)) => {
                self.codes_anew(&adc, expected_e, whole)
            }
            Some(adc) if !self.has_tails() => whole - self.shared(&adc, (expected_e, None), (self, None), false).light,
            _ => whole - self.fixed_variance(expected_e),
        };
        // What takes too long is no number.
        if (whole - anew).is_nan() { f64::NAN } else { anew.clamp(0.0, whole) }
    }

    /// Whether they show it where full well, or an end of the codes, cuts off more than next to none; of few, where full well cuts off most,
    /// as the shot noise of others hides it.
    fn ends(&self, adc: &AdcRecord, expected_e: f64) -> bool {
        const NEXT_TO_NONE: f64 = 1e-7;
        const MOST: f64 = 0.5;
        if self.is_rare {
            return false;
        }
        let law = Law::of(&self.model, expected_e);
        let are_full = |share: f64| law.reaches_full_well() && law.reaches(law.full_well_e) > share;
        // Of full photosites nothing but read noise is drawn anew.
        let shows_full = adc.adu_per_e * self.model.read_noise() < VISIBLE;
        if self.model.tails.are_few {
            return shows_full && are_full(MOST);
        }
        if Dark::mean_of(self.model, 1).std_codes(adc, expected_e) >= VISIBLE_AT_ENDS {
            return shows_full && are_full(NEXT_TO_NONE);
        }
        let [lower, upper] = [0.0, f64::from(adc.top_code())].map(|code| adc.electrons_at(code));
        are_full(NEXT_TO_NONE)
            || !law.is_within(adc)
                && (law.is_read_from(upper) > NEXT_TO_NONE || law.is_read_from(lower) < 1.0 - NEXT_TO_NONE)
    }

    /// E v of codes.
    fn codes_anew(&self, adc: &AdcRecord, expected_e: f64, whole: f64) -> f64 {
        let law = Law { read_noise_e: self.model.read_noise(), ..Law::of(&self.model, expected_e) };
        drawn_anew(&law, adc, codes_of(adc), self.model.offsets()).of(whole)
    }
}

impl Photosite {
    /// What is drawn anew in each exposure at photosites of such signals, by classes.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`] where no formula tells what rows and columns share.
    pub(super) fn temporal_of(&self, expected_e: [f64; 3]) -> Predicted<[Temporal; 3]> {
        let one = self.one_exposure();
        let lines = match one.has_lines() {
            true => {
                let [whole, fixed] = [one.lines(expected_e)?, one.fixed_lines(expected_e)?];
                let scales = self.flat.map_or([1.0; 3], |flat| flat.ratios);
                [0, 1, 2].map(|k| whole[k].less(&fixed[k]).scaled(scales.map(|scale| scales[k] * scale)))
            }
            false => [LineCovariance::default(); 3],
        };
        let found = [0, 1, 2].map(|k| Temporal { lines: lines[k], ..self.temporal(k, expected_e[k], true) });
        let is_known = self.flat.is_some() || found.iter().all(|temporal| !temporal.variance.is_nan());
        if is_known { Ok(found) } else { Err(Unpredictable::Beyond(self.why_too_long())) }
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
        let mut found = [0, 1, 2].map(|k| temporal[k].averaged(&moments[k], record));
        if is_mean(record) || self.has_lines() || self.has_tails() {
            return Ok(found);
        }
        for (class, average) in found.iter_mut().enumerate() {
            if let Some(exact) = self.no_mean(expected_e[class], record)? {
                *average = Prediction { common: average.common, lines: average.lines, ..exact };
            }
        }
        Ok(found)
    }

    /// The law of a median that no formula of normal samples tells; none where one does.
    fn no_mean(&self, expected_e: f64, record: &AverageRecord) -> Predicted<Option<Prediction>> {
        let is_by_code = self.is_average_by_code(expected_e, record) && !self.is_spread_over_codes(expected_e);
        if !is_by_code && !self.is_far_from_normal(expected_e) {
            return Ok(None);
        }
        let why = match record.combine {
            _ if !is_by_code => FAR_FROM_NORMAL,
            Combine::Clipped => CLIPPED_BY_CODE,
            Combine::Median | Combine::Mean => MEDIAN_BY_CODE,
        };
        let is_told = record.combine == Combine::Median
            && self.equations == Equations::Exact
            && self.darks[0].is_none()
            && self.flat.is_none();
        let exact = if is_told { self.median_of(expected_e, record.frames) } else { None };
        exact.map(Some).ok_or(Unpredictable::Beyond(why))
    }
}

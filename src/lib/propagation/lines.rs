//! What photosites of a row, or of a column, have in common, and what becomes of it through the converter and corrections.
//!
//! The reading of a photosite of class k is y_k(x, u, v), with x what is its own, and of its row the normal numbers u, by which
//! its response differs, and v, which are added to its charge. Another of class l in the same row shares u and v alone, so
//! that
//!
//! cov(y_k, y_l) = cov(m_k(u, v), m_l(u, v)),  m_k(u, v) = E\[y_k | u, v]
//!
//! and so for columns. Where nothing is clipped and what is a photosite's own blurs the codes, m is straight:
//!
//! R_kl = K² \[Σ_j c_jk c_jl σ_j² + f_k f_l δ² + E_k E_l s²]
//!
//! K in ADU per e⁻ (1 of electrons), σ the temporal noise of rows, δ their fixed offsets, s their relative response, E the
//! signal. j goes over the frame itself, with c = 1, and over the averages that came off it, with c² what the average keeps of
//! the variance, times its weight squared; f is what the fixed offsets of these leave. Those of a flat field count in
//! proportion to y_k/F_k, to first order, and it takes s off. The share of R that comes of rounding is below e^(−4π²σ²)/2π² of a squared code, σ
//! what is a photosite's own in codes: 3·10⁻⁸ from [`BLURRED`] on.
//!
//! Elsewhere m follows from the law of a photosite ([`Law`]) and the covariance is a sum over u and v. Brighter rows have more
//! shot noise; m takes it for that of their light, (1 + s u) E: off by s u/2 of its rms where full well cuts it, and of second
//! order elsewhere.
//!
//! The covariance matrix of all photosites of a frame is then block plus low rank: D + Σ_rows Z R Zᵀ + Σ_columns Z S Zᵀ, Z
//! telling the classes, D diagonal with the variance of each less R_kk + S_kk.

use super::blur::is_blurred;
use super::charge::charge;
use super::curved::NODES;
use super::law::Law;
use super::masters::Dark;
use super::moments::{Equations, LineCovariance};
use super::photosite::Photosite;
use super::unpredictable::{Predicted, TOO_LONG, Unpredictable};
use crate::metadata::{AdcRecord, AverageRecord};
use crate::numerics::averages::Combine;
use crate::numerics::normal::density;
use crate::stages::noise::{LineNoise, NoiseModel};
use nalgebra::Matrix3;

/// The standard deviation, in codes, of what is a photosite's own from which codes follow what it shares as straight lines do.
pub(super) const BLURRED: f64 = 0.6;

/// The same from which they do so on the mean: e^(−4π²σ²)/2π² is 2·10⁻⁵ of a squared code.
const BLURRED_ON_AVERAGE: f64 = 0.45;

/// Values of what is shared that are gone through at most.
pub(super) const MOST_NODES: usize = 800;

/// Why nothing is said of what rows and columns share where more would be needed.
pub(super) const TOO_COARSE: &str = "what rows or columns share goes over many codes, and what each photosite has of its own blurs \
                                     none of them; give the sensor read noise";

/// Why nothing is said of averages that are no means.
const NO_MEANS: &str = "medians and clipped means of frames whose rows or columns share noise follow no formula here; use \
                        `--combine mean`";

/// Why nothing is said of offsets that show how codes are rounded.
const OFFSETS_SHOW: &str = "photosites have fixed offsets, and the noise of the dark or bias frames, over less than a code, makes \
                            what they leave of these hang on where in a code each mean lies; more of them do not help, amplification \
                            before the converter does";

/// Why nothing is said of a drift that codes follow on a curve.
pub(super) const DRIFT_CUT: &str = "its black level drifts along rows, and full well, an end of the codes or a step of them cuts what rows share \
                         by that";

/// Why nothing is said of a drift that the curve of a converter bends.
const DRIFT_BENT: &str =
    "its black level drifts along rows, and the curve of the converter (`linearization`) bends what rows share by that";

/// Why the paper says nothing.
const NOT_IN_THE_PAPER: &str = "the paper has no equations for noise of rows and columns, nor for fixed offsets";

/// Along rows or along columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    Row,
    Column,
}

impl Axis {
    pub const ALL: [Self; 2] = [Self::Row, Self::Column];

    /// Temporal noise in e⁻, fixed offsets in e⁻, and relative response.
    pub fn parts(self, lines: &LineNoise) -> [f64; 3] {
        match self {
            Self::Row => {
                let LineNoise { row_noise_e, black_drift_e, .. } = *lines;
                let temporal = if black_drift_e > 0.0 { row_noise_e.hypot(black_drift_e) } else { row_noise_e };
                [temporal, lines.dsnu_row_e, lines.prnu_row]
            }
            Self::Column => [lines.column_noise_e, lines.dsnu_column_e, lines.prnu_column],
        }
    }

    /// The model without them.
    pub fn without(self, model: &NoiseModel) -> NoiseModel {
        let lines = match self {
            Self::Row => {
                LineNoise { row_noise_e: 0.0, black_drift_e: 0.0, dsnu_row_e: 0.0, prnu_row: 0.0, ..model.lines }
            }
            Self::Column => LineNoise { column_noise_e: 0.0, dsnu_column_e: 0.0, prnu_column: 0.0, ..model.lines },
        };
        NoiseModel { lines, ..*model }
    }
}

/// What is a photosite's own of the noise.
fn own(model: &NoiseModel) -> NoiseModel {
    NoiseModel { lines: LineNoise { dsnu_e: model.lines.dsnu_e, ..LineNoise::default() }, ..*model }
}

/// The model with what rows and columns have anew in each exposure drawn for each photosite apart.
fn anew_apart(model: &NoiseModel) -> NoiseModel {
    let lines =
        LineNoise { row_noise_e: 0.0, column_noise_e: 0.0, black_drift_e: 0.0, black_drift_rows: 0.0, ..model.lines };
    NoiseModel { read_noise_e: model.read_noise(), lines, ..*model }
}

impl Photosite {
    /// All averages that its samples follow from.
    pub(super) fn averages(&self) -> impl Iterator<Item = &Dark> {
        let flat = self.flat.iter().flat_map(|flat| std::iter::once(&flat.frames).chain(flat.darks.iter().flatten()));
        self.darks.iter().flatten().chain(flat)
    }

    /// All models of noise that its samples follow from.
    pub(super) fn models(&self) -> impl Iterator<Item = &NoiseModel> {
        std::iter::once(&self.model).chain(self.averages().map(|dark| &dark.model))
    }

    /// Makes sure that formulas are known for what rows and columns share, and for fixed offsets, at a level that is known to a fraction of a
    /// code, or is not.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`].
    pub(super) fn check_lines(&self, is_level_known: bool) -> Predicted<()> {
        if self.models().all(|model| model.lines.is_none()) {
            return Ok(());
        }
        if self.equations == Equations::Paper {
            return Err(Unpredictable::Beyond(NOT_IN_THE_PAPER));
        }
        let is_shared = |dark: &Dark| Axis::ALL.iter().any(|axis| axis.parts(&dark.model.lines)[0] > 0.0);
        if self.averages().any(|dark| is_shared(dark) && dark.frames > 2 && dark.combine != Combine::Mean) {
            return Err(Unpredictable::Beyond(NO_MEANS));
        }
        let Some(adc) = self.adc else { return Ok(()) };
        let shows = |dark: &Dark| {
            let of_dark = self.of_dark(dark);
            dark.model.offsets() > 0.0
                && (of_dark.visible_median(dark, &adc).is_some() || self.rounds_as(&adc, 0.0, dark, &of_dark))
        };
        // Those of photosites alone are integrated over.
        let of_sites = |model: &NoiseModel| LineNoise { dsnu_e: 0.0, ..model.lines }.is_none();
        let is_integrated = is_level_known && self.models().all(of_sites);
        if !is_integrated && self.darks.iter().flatten().any(shows) {
            return Err(Unpredictable::Beyond(OFFSETS_SHOW));
        }
        Ok(())
    }

    /// Whether photosites of a row or of a column share anything.
    pub(super) fn has_lines(&self) -> bool {
        self.models().any(|model| model.lines.has_lines())
    }

    /// Makes sure that formulas are known for what photosites of these signals share.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`].
    pub(super) fn check_shared(&self, expected_e: [f64; 3]) -> Predicted<()> {
        if self.has_lines() { self.regime(expected_e).map(drop) } else { Ok(()) }
    }

    /// What photosites of these signals share with others of their rows and columns, in squared units of their samples.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`] where no formula tells.
    pub(super) fn lines(&self, expected_e: [f64; 3]) -> Predicted<[LineCovariance; 3]> {
        if !self.has_lines() {
            return Ok([LineCovariance::default(); 3]);
        }
        let Some(slopes) = self.line_slopes(expected_e)? else {
            let [row, column] = Axis::ALL.map(|axis| self.curved(&[axis], expected_e));
            return Ok(self.by_class(&row?, &column?, [self.slope(); 3]));
        };
        let [row, column] = Axis::ALL.map(|axis| self.straight(axis, expected_e, slopes));
        let mut found = self.by_class(&row, &column, slopes[0]);
        if self.flat.is_some() && self.drifts() {
            let loads = self.drift_loads(self.ratios(expected_e), slopes[0], None);
            let of_class = |k: usize| loads.map(|other| loads[k].iter().zip(other).map(|(a, b)| a * b).sum());
            found.iter_mut().enumerate().for_each(|(k, lines)| lines.drift = of_class(k));
        }
        Ok(found)
    }

    /// Slopes of the samples of each class to what is added to their lines, and to what these have more of the light; none where they follow
    /// it on a curve.
    ///
    /// # Errors
    ///
    /// As [`Self::lines`].
    pub(super) fn line_slopes(&self, expected_e: [f64; 3]) -> Predicted<Option<[[f64; 3]; 2]>> {
        let regime = self.regime(expected_e)?;
        let found = match regime {
            Regime::Curved => None,
            _ if self.has_tails() => Some(self.slopes_of_unlike(expected_e)?),
            Regime::Straight => Some([[self.slope(); 3]; 2]),
            Regime::OnAverage => Some([expected_e.map(|expected_e| self.mean_slope(expected_e)); 2]),
        };
        let scales = self.flat.map_or([1.0; 3], |flat| flat.ratios);
        Ok(found.map(|slopes| slopes.map(|slopes| [0, 1, 2].map(|k| scales[k] * slopes[k]))))
    }

    /// The same photosites over exposures: their means, in which all that rows and columns have anew is noise like that of their own.
    #[must_use]
    pub(super) fn over_exposures(&self) -> Self {
        let darks = self.darks.map(|dark| dark.map(|dark| Dark { model: anew_apart(&dark.model), ..dark }));
        Self { model: anew_apart(&self.model), darks, ..*self }
    }

    /// What of that is the same in every exposure: what the means share that photosites have over exposures, in which all that rows and
    /// columns have anew is noise like that of their own.
    ///
    /// # Errors
    ///
    /// As [`Self::lines`].
    pub(super) fn fixed_lines(&self, expected_e: [f64; 3]) -> Predicted<[LineCovariance; 3]> {
        self.over_exposures().lines(expected_e)
    }

    /// Whether photosites of these signals follow what they share on a curve.
    pub(super) fn is_curved_in_lines(&self, expected_e: [f64; 3]) -> Predicted<bool> {
        Ok(self.regime(expected_e)? == Regime::Curved)
    }

    /// What is shared as each class has it, with the part of the drift by such slopes to the charge.
    fn by_class(&self, row: &Matrix3<f64>, column: &Matrix3<f64>, slopes: [f64; 3]) -> [LineCovariance; 3] {
        let [drift, drift_rows] = [self.drift_e2(None), self.drift_rows()];
        let of_class = |matrix: &Matrix3<f64>, k: usize| [0, 1, 2].map(|l| matrix[(k, l)]);
        [0, 1, 2].map(|k| LineCovariance {
            row: of_class(row, k),
            column: of_class(column, k),
            drift: [0, 1, 2].map(|l| drift * slopes[k] * slopes[l]),
            drift_rows,
            ..LineCovariance::default()
        })
    }

    /// The variance of the drift of its black level along rows, with that of what came off; of an average of exposures where there is one.
    pub(super) fn drift_e2(&self, average: Option<&AverageRecord>) -> f64 {
        let of_dark = |dark: &Dark| dark.weight.powi(2) * dark.kept()[0] * dark.model.lines.black_drift_e.powi(2);
        let of_darks: f64 = self.darks.iter().flatten().map(of_dark).sum();
        self.model.lines.black_drift_e.powi(2) * kept_of_one(average) + of_darks
    }

    /// Rows from one knot of the drift to the next; 0 where there is none.
    pub(super) fn drift_rows(&self) -> f64 {
        self.models().map(|model| model.lines.black_drift_rows).fold(0.0, f64::max)
    }

    /// Whether its black level drifts along rows, or that of what came off.
    pub(super) fn drifts(&self) -> bool {
        self.models().any(|model| model.lines.black_drift_e > 0.0)
    }

    /// Those of photosites that are unlike each other, to first order in what is shared: of hot ones that are full the gain of a row is
    /// nothing, and of readings beyond the codes its noise.
    fn slopes_of_unlike(&self, expected_e: [f64; 3]) -> Predicted<[[f64; 3]; 2]> {
        let slope = self.slope();
        let of_offsets =
            expected_e.map(|expected_e| slope * self.mean_of(expected_e, |site| site.share_read(expected_e)));
        let of_gains =
            expected_e.map(|expected_e| slope * self.mean_of(expected_e, |site| site.share_open(expected_e)));
        if of_offsets.iter().chain(&of_gains).any(|share| share.is_nan()) {
            return Err(Unpredictable::Beyond(TOO_LONG));
        }
        Ok([of_offsets, of_gains])
    }

    /// The share of readings that are within the codes.
    fn share_read(&self, expected_e: f64) -> f64 {
        let law = Law::of(&self.model, expected_e);
        match self.adc {
            Some(adc) if !law.is_within(&adc) => {
                let [low, high] = [0.0, f64::from(adc.top_code())].map(|code| law.is_read_from(adc.electrons_at(code)));
                low - high
            }
            _ => 1.0,
        }
    }

    /// The share of them whose charge is below full well too.
    fn share_open(&self, expected_e: f64) -> f64 {
        let law = Law::of(&self.model, expected_e);
        let full = if law.reaches_full_well() { law.reaches(self.model.full_well_e) } else { 0.0 };
        self.share_read(expected_e).min(1.0 - full)
    }

    fn mean_slope(&self, expected_e: f64) -> f64 {
        self.adc.map_or(1.0, |adc| Law::of(&self.model, expected_e).mean_slope(&adc))
    }

    /// How what is shared is told, where it is.
    fn regime(&self, expected_e: [f64; 3]) -> Predicted<Regime> {
        let is_corrected = self.darks[0].is_some() || self.flat.is_some();
        let own = own(&self.model);
        let laws = expected_e.map(|expected_e| Law::of(&self.model, expected_e));
        // Full well and sensitivities of zero cut off the charge, and what is added comes to it thereafter: they bend gains alone.
        let has_gains = self.model.lines.has_gains();
        let is_full = expected_e.iter().any(|expected_e| self.nears_full_well(*expected_e));
        let is_cut = has_gains && (is_full || laws.iter().any(|law| law.light.is_rectified(law.full_well_e)));
        let is_blurred = |adc: &AdcRecord, least: f64| {
            expected_e.iter().zip(&laws).all(|(expected_e, law)| is_blurred(&own, law, adc, *expected_e, least))
        };
        let is_within = |adc: &AdcRecord| !adc.is_bent() && laws.iter().all(|law| law.is_nearly_within(adc));
        // Of full photosites nothing blurs codes but what is added.
        let is_cut_in_codes = |adc: &AdcRecord| is_cut || is_full && adc.adu_per_e * own.added() < BLURRED;
        let found = match &self.adc {
            None => Some(if is_cut { Regime::Curved } else { Regime::Straight }),
            Some(adc) if !is_cut_in_codes(adc) && is_within(adc) && is_blurred(adc, BLURRED) => Some(Regime::Straight),
            Some(_) if !is_corrected => Some(Regime::Curved),
            Some(adc) => is_blurred(adc, BLURRED_ON_AVERAGE).then_some(Regime::OnAverage),
        };
        match found {
            Some(Regime::Curved) if self.drifts() => {
                let is_reached =
                    |adc: &AdcRecord| is_cut_in_codes(adc) || laws.iter().any(|law| !law.is_nearly_within(adc));
                let is_bent = self.adc.as_ref().is_some_and(|adc| adc.is_bent() && !is_reached(adc));
                Err(Unpredictable::Beyond(if is_bent { DRIFT_BENT } else { DRIFT_CUT }))
            }
            Some(regime) => Ok(regime),
            None => Err(Unpredictable::Beyond(TOO_COARSE)),
        }
    }

    /// Whether so many photosites are full that what they share is told by fewer: one in 10¹³ or more.
    pub(super) fn nears_full_well(&self, expected_e: f64) -> bool {
        const DEVIATIONS: f64 = 7.5;
        // Counts are skewed: so many more are as rare.
        const SKEWED_E: f64 = 30.0;
        let charge = charge(&self.model, expected_e);
        charge.mean + DEVIATIONS * charge.variance.max(0.0).sqrt() + SKEWED_E >= self.model.full_well_e
    }

    /// R of the straight codes, of such slopes.
    fn straight(&self, axis: Axis, expected_e: [f64; 3], [of_offsets, of_gains]: [[f64; 3]; 2]) -> Matrix3<f64> {
        if let Some(shared) = self.shared_by_quotients(axis, expected_e) {
            return Matrix3::from_fn(|k, l| of_offsets[k] * of_offsets[l] * shared[(k, l)]);
        }
        let terms = self.terms(axis);
        let at = |k: usize| (expected_e[k], [of_offsets[k], of_gains[k]]);
        Matrix3::from_fn(|k, l| terms.between(at(k), at(l)))
    }

    /// What [`LineTerms`] are of: the signals, or with a flat field y/F, by which what is in the flat field counts.
    pub(super) fn line_signals(&self, expected_e: [f64; 3]) -> [f64; 3] {
        let Some(flat) = &self.flat else { return expected_e };
        [0, 1, 2].map(|k| expected_e[k] / flat.expected_e[k])
    }

    /// What two photosites share by rows, or by columns, before any slope.
    pub(super) fn terms(&self, axis: Axis) -> LineTerms {
        let parts = |model: &NoiseModel| axis.parts(&model.lines);
        let averages = |darks: &'_ [Option<Dark>]| -> Vec<Dark> { darks.iter().flatten().copied().collect() };
        let darks = averages(&self.darks);
        let temporal = |dark: &Dark| dark.weight * dark.weight * dark.kept()[0] * parts(&dark.model)[0].powi(2);
        let left = |own: &NoiseModel, darks: &[Dark]| {
            parts(own)[1] - darks.iter().map(|dark| dark.weight * parts(&dark.model)[1]).sum::<f64>()
        };
        let light = parts(&self.model)[0].powi(2) + darks.iter().map(temporal).sum::<f64>();
        let offset = left(&self.model, &darks);
        let constant = light + offset * offset;
        let Some(flat) = &self.flat else {
            return LineTerms { constant, linear: 0.0, square: parts(&self.model)[2].powi(2) };
        };
        let of_flat = averages(&flat.darks);
        // Lines have the same noise at all levels.
        let of_frames = flat.levels.map_or_else(|| flat.frames.kept()[0], |levels| levels.at(1.0).variance);
        let of_frames = of_frames * parts(&flat.frames.model)[0].powi(2);
        let divisor = of_frames + of_flat.iter().map(temporal).sum::<f64>();
        let of_divisor = left(&flat.frames.model, &of_flat);
        let of_both = |[a, b]: [Dark; 2]| a.weight * b.weight * a.kept()[0] * parts(&a.model)[0].powi(2);
        let in_both: f64 = flat.in_both(&self.darks).map(of_both).sum();
        let square = divisor + of_divisor * of_divisor;
        LineTerms { constant, linear: -in_both - offset * of_divisor, square }
    }

    /// The terms of rows and of columns, of an average of exposures where there is one.
    pub(super) fn line_terms(&self, average: Option<&AverageRecord>) -> [LineTerms; 2] {
        Axis::ALL.map(|axis| {
            let terms = self.terms(axis);
            terms.less((1.0 - kept_of_one(average)) * axis.parts(&self.model.lines)[0].powi(2))
        })
    }
}

/// The share of the temporal variance of an exposure that an average keeps.
fn kept_of_one(average: Option<&AverageRecord>) -> f64 {
    average.map_or(1.0, |record| 1.0 / f64::from(record.frames.max(1)))
}

/// The signal of a photosite, and its slopes to what is added to its lines and to what these have more of the light.
pub(super) type Site = (f64, [f64; 2]);

/// What two photosites of signals x and y in one row, or column, share, in e²: a + b (x + y) + c x y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LineTerms {
    pub constant: f64,
    pub linear: f64,
    pub square: f64,
}

impl LineTerms {
    pub fn at(&self, x: f64, y: f64) -> f64 {
        self.between((x, [1.0; 2]), (y, [1.0; 2]))
    }

    /// The same of samples, of such signals and slopes to what is added to their lines and to what these have more of the light.
    pub fn between(&self, (x, [of_offsets, of_gains]): Site, (y, [with_offsets, with_gains]): Site) -> f64 {
        of_offsets * with_offsets * (self.constant + self.linear * (x + y))
            + of_gains * with_gains * self.square * x * y
    }

    /// The same of sums of samples: what their slopes are together, and their slopes times signals.
    pub fn of_sums(&self, [a, b]: [f64; 2], [other_a, other_b]: [f64; 2]) -> f64 {
        self.constant * a * other_a + self.linear * (a * other_b + b * other_a) + self.square * b * other_b
    }

    /// Less what does not hang on signals.
    pub fn less(&self, constant: f64) -> Self {
        Self { constant: self.constant - constant, ..*self }
    }
}

/// How samples follow what is shared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Regime {
    Straight,
    OnAverage,
    Curved,
}

/// Why nothing is said of it where codes show.
pub(super) const COARSE_LINES: &str = "it shows how codes are rounded, which hot pixels or random telegraph signals beside noise of rows or columns \
                            hide from no formula here; give the sensor read noise";

/// Standard normal numbers and their weights for a function that is smooth on the scale of `blur` of what they are times
/// `spread`.
pub(super) fn nodes(spread: f64, blur: f64) -> Vec<(f64, f64)> {
    /// Steps to the scale of the product of the density and two such functions: the error of the sum is below e^(−2π²·1.05²), 4·10⁻¹⁰.
    const STEPS: f64 = 1.05;
    const REACH: f64 = 6.5;
    if spread <= 0.0 {
        return vec![(0.0, 1.0)];
    }
    // Gauss's nodes where what is shared is the lesser part: what they leave out of a variance goes with the square, the fourth
    // and higher powers of the ratio.
    let ratio = spread / blur;
    if ratio <= 0.05 {
        let third = 3.0_f64.sqrt();
        return vec![(0.0, 2.0 / 3.0), (-third, 1.0 / 6.0), (third, 1.0 / 6.0)];
    }
    // Of two signs the covariance is off by 6·10⁻⁸ of itself.
    if ratio <= 0.3 {
        return NODES.to_vec();
    }
    let scale = (1.0 + 2.0 * ratio * ratio).sqrt().recip();
    let step = scale / STEPS;
    let steps = (REACH / step).ceil();
    if steps > MOST_NODES as f64 {
        return vec![(0.0, 0.0); MOST_NODES + 1];
    }
    let mut found = Vec::new();
    let mut z = -steps * step;
    while z <= steps * step + 0.5 * step {
        found.push((z, density(z)));
        z += step;
    }
    let sum: f64 = found.iter().map(|(_, weight)| weight).sum();
    found.iter_mut().for_each(|(_, weight)| *weight /= sum);
    found
}

//! The variance of a photosite, cause by cause.

use super::charge::sensitivity;
use super::law::Law;
use super::masters::{Dark, MOST_DARKS};
use super::moments::Equations;
use super::pattern::Shared;
use super::photosite::Photosite;
use super::unpredictable::{OFFSETS_TOO_LONG, PATTERNS_TOO_LONG, Predicted, TOO_LONG, Unpredictable};
use crate::camera::readout::ReadOut;
use crate::metadata::AdcRecord;
use crate::numerics::averages::Combine;
use crate::stages::noise::{LineNoise, NoiseModel};
use serde::Serialize;

/// A cause of variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Shot noise of the light.
    SignalShot,
    /// Photo-response non-uniformity, a fixed pattern.
    Prnu,
    /// Non-uniformity of the response from row to row, a fixed pattern.
    PrnuRow,
    /// Non-uniformity of the response from column to column, a fixed pattern.
    PrnuColumn,
    /// Shot noise of the dark signal.
    DarkShot,
    /// Dark-current non-uniformity, a fixed pattern.
    Dcnu,
    /// Shot noise as the patterns scale it, the cross terms λ s² that Eq. 11 of \[HP2005] drops.
    ShotTimesPattern,
    /// Read noise.
    Read,
    /// Noise that the photosites of a row have in common.
    RowNoise,
    /// Noise that the photosites of a column have in common.
    ColumnNoise,
    /// Offsets of photosites, a fixed pattern.
    Dsnu,
    /// Offsets of rows, a fixed pattern.
    DsnuRow,
    /// Offsets of columns, a fixed pattern.
    DsnuColumn,
    /// Full well, which takes from the variance.
    FullWell,
    /// Rounding to whole codes.
    Quantization,
    /// The ends of the range of codes, which take from the variance.
    Rails,
    /// Differences of the dark signal of hot photosites, a fixed pattern.
    HotPixels,
    /// Random telegraph signals of some photosites.
    Rts,
    /// Drift of the black level along rows.
    BlackDrift,
    /// Gains and offsets of the amplifiers that a sensor is read through, a fixed pattern.
    Taps,
    /// What full well, rounding and the ends of the range take from the fixed patterns, or add to them.
    ClippedPattern,
    /// What is curved in a color takes from its variance, or adds to it: of what is drawn anew in each exposure.
    Curvature,
    /// The same of what fixed patterns alone make of it, a fixed pattern.
    CurvedPattern,
}

impl Cause {
    /// All causes, in the order in which they act.
    pub const ALL: [Self; 23] = [
        Self::SignalShot,
        Self::Prnu,
        Self::PrnuRow,
        Self::PrnuColumn,
        Self::DarkShot,
        Self::Dcnu,
        Self::ShotTimesPattern,
        Self::Read,
        Self::RowNoise,
        Self::ColumnNoise,
        Self::Dsnu,
        Self::DsnuRow,
        Self::DsnuColumn,
        Self::FullWell,
        Self::Quantization,
        Self::Rails,
        Self::HotPixels,
        Self::Rts,
        Self::BlackDrift,
        Self::Taps,
        Self::ClippedPattern,
        Self::Curvature,
        Self::CurvedPattern,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::SignalShot => "signal_shot",
            Self::Prnu => "prnu",
            Self::PrnuRow => "prnu_row",
            Self::PrnuColumn => "prnu_column",
            Self::DarkShot => "dark_shot",
            Self::Dcnu => "dcnu",
            Self::ShotTimesPattern => "shot_times_pattern",
            Self::Read => "read",
            Self::RowNoise => "row_noise",
            Self::ColumnNoise => "column_noise",
            Self::Dsnu => "dsnu",
            Self::DsnuRow => "dsnu_row",
            Self::DsnuColumn => "dsnu_column",
            Self::FullWell => "full_well",
            Self::Quantization => "quantization",
            Self::Rails => "rails",
            Self::HotPixels => "hot_pixels",
            Self::Rts => "rts",
            Self::BlackDrift => "black_drift",
            Self::Taps => "taps",
            Self::ClippedPattern => "clipped_pattern",
            Self::Curvature => "curvature",
            Self::CurvedPattern => "curved_pattern",
        }
    }

    /// Whether it is the same in every exposure of one sensor.
    pub fn is_fixed_pattern(self) -> bool {
        PATTERNS.contains(&self)
            || OFFSETS.contains(&self)
            || matches!(self, Self::HotPixels | Self::Taps | Self::ClippedPattern | Self::CurvedPattern)
    }

    /// Whether photosites of a row (0), or of a column (1), share it; none where each has its own.
    pub fn shared_by(self) -> Option<usize> {
        match self {
            Self::RowNoise | Self::BlackDrift | Self::DsnuRow | Self::PrnuRow => Some(0),
            Self::ColumnNoise | Self::DsnuColumn | Self::PrnuColumn => Some(1),
            _ => None,
        }
    }

    /// What a sensor says of a cause that few sensors have; none of others.
    pub fn optional(self, readout: &ReadOut) -> Option<f64> {
        match self {
            Self::RowNoise => Some(readout.row_noise_e),
            Self::ColumnNoise => Some(readout.column_noise_e),
            Self::Dsnu => Some(readout.dsnu_e),
            Self::DsnuRow => Some(readout.dsnu_row_e),
            Self::DsnuColumn => Some(readout.dsnu_column_e),
            Self::PrnuRow => Some(readout.prnu_row),
            Self::PrnuColumn => Some(readout.prnu_column),
            Self::HotPixels => Some(readout.hot_pixel_share),
            Self::Rts => Some(readout.rts_share),
            Self::BlackDrift => Some(readout.black_drift_e),
            Self::Taps => Some(if readout.taps.is_some() { 1.0 } else { 0.0 }),
            _ => None,
        }
    }
}

/// Fixed patterns of the charge.
const PATTERNS: [Cause; 4] = [Cause::Prnu, Cause::PrnuRow, Cause::PrnuColumn, Cause::Dcnu];

/// What is added to the charge as it is read.
const ADDED: [Cause; 8] = [
    Cause::Read,
    Cause::Rts,
    Cause::RowNoise,
    Cause::ColumnNoise,
    Cause::BlackDrift,
    Cause::Dsnu,
    Cause::DsnuRow,
    Cause::DsnuColumn,
];

/// Fixed patterns of it.
const OFFSETS: [Cause; 3] = [Cause::Dsnu, Cause::DsnuRow, Cause::DsnuColumn];

/// Variances by cause, in the order of [`Cause::ALL`]; they add up to the whole variance.
pub type Budget = [f64; Cause::ALL.len()];

fn sum_of(budget: &Budget, causes: &[Cause]) -> f64 {
    causes.iter().map(|cause| budget[*cause as usize]).sum()
}

/// The share of a variance that is left of it below which its causes are told in proportion: their differences would be lost in
/// rounding.
const NEXT_TO_NOTHING: f64 = 1e-6;

/// The causes of what full well leaves of a charge that is next to always full: patterns and shot noise share it as they would
/// without full well.
fn share_what_is_left(mut budget: Budget, fixed: f64, whole: f64) -> Budget {
    let read = sum_of(&budget, &ADDED);
    let shot = [Cause::SignalShot, Cause::DarkShot, Cause::ShotTimesPattern];
    for (causes, left) in [(&PATTERNS[..], fixed), (&shot[..], whole - fixed - read)] {
        let sum = sum_of(&budget, causes);
        for cause in causes.iter().filter(|_| sum > 0.0) {
            budget[*cause as usize] *= (left / sum).max(0.0);
        }
    }
    budget[Cause::FullWell as usize] = whole - budget.iter().sum::<f64>();
    budget
}

/// Causes that are found as differences of others.
const DIFFERENCES: [Cause; 4] = [Cause::FullWell, Cause::Quantization, Cause::Rails, Cause::ClippedPattern];

/// The share of all causes below which a difference of them is rounding.
const ROUNDED_AWAY: f64 = 1e-14;

impl Photosite {
    /// The variance of its samples by cause, in e² or ADU².
    pub fn budget(&self, expected_e: f64) -> Budget {
        if self.has_tails() {
            return self.mixed_budget(expected_e);
        }
        match self.adc {
            Some(adc) if self.darks[0].is_some() => self.less_dark_budget(&adc, expected_e),
            Some(adc) => self.digitized_budget(&adc, expected_e),
            None => self.charge_budget(expected_e),
        }
    }

    /// The same, where it does not take too long.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`].
    pub fn causes(&self, expected_e: f64) -> Predicted<Budget> {
        let mut budget = self.told_apart(self.budget(expected_e), expected_e);
        if budget.iter().any(|variance| variance.is_nan()) {
            return Err(Unpredictable::Beyond(self.why_too_long()));
        }
        let all: f64 = budget.iter().map(|variance| variance.abs()).sum();
        for cause in DIFFERENCES {
            let found = &mut budget[cause as usize];
            *found = if found.abs() < ROUNDED_AWAY * all { 0.0 } else { *found };
        }
        Ok(budget)
    }

    /// Why what takes too long does.
    pub(super) fn why_too_long(&self) -> &'static str {
        match self.has_tails() {
            true => TOO_LONG,
            false if self.models().any(|model| model.offsets() > 0.0) => OFFSETS_TOO_LONG,
            false => PATTERNS_TOO_LONG,
        }
    }

    /// The same with what rounding does to the means of photosites as part of the fixed pattern, so that the causes of either kind add up
    /// to what is drawn anew in each exposure, and to what is not.
    fn told_apart(&self, mut budget: Budget, expected_e: f64) -> Budget {
        let is_told = self.adc.is_some() && self.flat.is_none() && self.equations == Equations::Exact;
        let are_means = self.darks.iter().flatten().all(|dark| dark.combine == Combine::Mean);
        if !is_told || !are_means {
            return budget;
        }
        let temporal_of =
            |site: Self, expected_e: f64| site.temporal_variance(expected_e, site.moments(expected_e).moments.variance);
        let of_dark = |dark: &Dark| dark.weight.powi(2) * temporal_of(self.of_dark(dark), 0.0) / f64::from(dark.frames);
        let light = Self { darks: [None; MOST_DARKS], ..*self };
        let temporal = temporal_of(light, expected_e) + self.darks.iter().flatten().map(of_dark).sum::<f64>();
        let whole: f64 = budget.iter().sum();
        let told: f64 =
            Cause::ALL.iter().filter(|cause| !cause.is_fixed_pattern()).map(|cause| budget[*cause as usize]).sum();
        let fixed = told - at_most(temporal, whole);
        if fixed.is_nan() || fixed.abs() > 1e-9 * whole {
            budget[Cause::Quantization as usize] -= fixed;
            budget[Cause::ClippedPattern as usize] += fixed;
        }
        budget
    }

    /// The variance, over photosites, of the means that each has over exposures.
    pub(super) fn fixed_variance(&self, expected_e: f64) -> f64 {
        let budget = self.budget(expected_e);
        Cause::ALL.iter().filter(|cause| cause.is_fixed_pattern()).map(|cause| budget[*cause as usize]).sum()
    }

    /// Less averages of dark frames: what is drawn anew in each adds, of dark frames what the average keeps; of the pattern,
    /// which is the same in all, stays what the two do not share.
    fn less_dark_budget(&self, adc: &AdcRecord, expected_e: f64) -> Budget {
        let light = self.digitized_budget(adc, expected_e);
        let of_dark = |dark: &Dark| {
            let kept = dark.kept().map(|kept| dark.weight.powi(2) * kept);
            (kept, self.of_dark(dark).digitized_budget(adc, 0.0))
        };
        let darks: Vec<([f64; 2], Budget)> = self.darks.iter().flatten().map(of_dark).collect();
        let mut budget = Cause::ALL.map(|cause| match cause {
            Cause::Dcnu | Cause::ClippedPattern => 0.0,
            Cause::Dsnu | Cause::DsnuRow | Cause::DsnuColumn => light[cause as usize] * self.offset_left(cause).powi(2),
            _ => {
                let kept = |kept: &[f64; 2]| kept[usize::from(cause == Cause::Quantization)];
                light[cause as usize] + darks.iter().map(|(of, dark)| kept(of) * dark[cause as usize]).sum::<f64>()
            }
        });
        let left = self.less_dark(adc, expected_e, true).moments.variance - budget.iter().sum::<f64>();
        let is_left = left.abs() > 1e-9 * (sum_of(&light, &PATTERNS) + sum_of(&light, &OFFSETS));
        budget[Cause::ClippedPattern as usize] = if is_left { left } else { 0.0 };
        budget
    }

    /// The share of fixed offsets that the averages which came off leave.
    fn offset_left(&self, cause: Cause) -> f64 {
        let part = |model: &NoiseModel| match cause {
            Cause::Dsnu => model.lines.dsnu_e,
            Cause::DsnuRow => model.lines.dsnu_row_e,
            _ => model.lines.dsnu_column_e,
        };
        let own = part(&self.model);
        let off: f64 = self.darks.iter().flatten().map(|dark| dark.weight * part(&dark.model)).sum();
        if own > 0.0 { 1.0 - off / own } else { 0.0 }
    }

    /// The variance of the charge and of its read noise, in e².
    fn charge_budget(&self, expected_e: f64) -> Budget {
        let mut budget = self.unclipped_budget(expected_e);
        let law = Law::of(&self.model, expected_e);
        if self.equations == Equations::Exact && law.reaches_full_well() {
            let unclipped: f64 = budget.iter().sum();
            let reading = law.of_electrons();
            let patterns = sum_of(&budget, &PATTERNS);
            let whole = law.predict(&reading).moments.variance;
            let fixed = Shared::of_one(&law, &reading).min(whole);
            if fixed < NEXT_TO_NOTHING * patterns || whole < NEXT_TO_NOTHING * unclipped {
                return share_what_is_left(budget, fixed, whole);
            }
            budget[Cause::ClippedPattern as usize] = fixed - patterns;
            budget[Cause::FullWell as usize] = whole - unclipped - (fixed - patterns);
        }
        budget
    }

    /// The causes before anything is clipped.
    fn unclipped_budget(&self, expected_e: f64) -> Budget {
        let model = &self.model;
        let exact = self.equations == Equations::Exact;
        let product = |rate: f64, shot: bool, sigma: f64| {
            let mean = if exact { sensitivity(sigma).0 } else { 1.0 };
            let pattern = self.pattern(sigma);
            let shot = if shot { rate } else { 0.0 };
            [mean * mean * shot, pattern * rate * rate, if exact { pattern * shot } else { 0.0 }]
        };
        let light = product(expected_e, model.signal_shot, model.response());
        let dark = product(model.dark_e, model.dark_shot, model.dcnu);
        let mut budget = [0.0; Cause::ALL.len()];
        let mut set = |cause: Cause, variance: f64| budget[cause as usize] = variance;
        set(Cause::SignalShot, light[0]);
        let LineNoise { prnu_row, prnu_column, .. } = model.lines;
        let square = model.response().powi(2);
        for (cause, part) in [(Cause::PrnuRow, prnu_row), (Cause::PrnuColumn, prnu_column)] {
            set(cause, if part > 0.0 { light[1] * part * part / square } else { 0.0 });
        }
        let own = if model.lines.has_gains() { model.prnu * model.prnu / square } else { 1.0 };
        set(Cause::Prnu, light[1] * own);
        set(Cause::DarkShot, dark[0]);
        set(Cause::Dcnu, dark[1]);
        set(Cause::ShotTimesPattern, light[2] + dark[2]);
        set(Cause::Read, model.read_noise_e.powi(2));
        set(Cause::Rts, model.tails.trap_variance());
        set(Cause::RowNoise, model.lines.row_noise_e.powi(2));
        set(Cause::ColumnNoise, model.lines.column_noise_e.powi(2));
        set(Cause::BlackDrift, model.lines.black_drift_e.powi(2));
        set(Cause::Dsnu, model.lines.dsnu_e.powi(2));
        set(Cause::DsnuRow, model.lines.dsnu_row_e.powi(2));
        set(Cause::DsnuColumn, model.lines.dsnu_column_e.powi(2));
        budget
    }

    /// The variance of the codes, in ADU².
    fn digitized_budget(&self, adc: &AdcRecord, expected_e: f64) -> Budget {
        let square = adc.sample_per_e(self.model.dark_e + expected_e).powi(2);
        let mut budget = self.charge_budget(expected_e).map(|variance| variance * square);
        if self.equations == Equations::Exact {
            let charge: f64 = budget.iter().sum();
            let law = Law::of(&self.model, expected_e);
            let whole = self.adu(adc, expected_e).moments.variance;
            let endless = law.endless_variance(adc).unwrap_or(whole);
            budget[Cause::Quantization as usize] = endless - charge;
            if !law.is_plain(adc) {
                let patterns = sum_of(&budget, &PATTERNS) + sum_of(&budget, &OFFSETS);
                let fixed = whole - self.temporal_variance(expected_e, whole);
                let clipped = fixed - patterns;
                let further = clipped - budget[Cause::ClippedPattern as usize];
                // What takes too long is no number, and stays none.
                let is_told = further.is_nan() || further.abs() > 1e-9 * patterns;
                budget[Cause::ClippedPattern as usize] += if is_told { further } else { 0.0 };
                // What the ends and rounding do to patterns is none of what they do to the rest.
                let own = if is_told { further } else { 0.0 };
                let of_ends = if endless == whole { Cause::Quantization } else { Cause::Rails };
                budget[of_ends as usize] -= own;
            }
            budget[Cause::Rails as usize] += whole - endless;
        }
        budget
    }
}

/// The lesser of two; a `value` that is no number, as what takes too long, stays none, which `min` would drop.
fn at_most(value: f64, most: f64) -> f64 {
    if value > most { most } else { value }
}

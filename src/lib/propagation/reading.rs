//! What is asked of a photosite's charge: the moments of its electrons or codes, or the chance to be beyond a level.

use super::bent;
use super::memory::Print;
use crate::metadata::AdcRecord;
use crate::numerics::normal::cumulative;
use crate::numerics::rounding::{REACH, Rounding, SMOOTH, about};

/// Moments 1 to 4 about the center of a reading.
pub(super) type Moments = [f64; 4];

/// What is asked of charge that meets its read noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    /// What is asked.
    pub asked: Asked,
    /// Read noise, rms e⁻.
    pub noise_e: f64,
    /// What moments are about.
    pub center: f64,
    /// What is added to every charge, e⁻.
    pub offset_e: f64,
    /// Read noise in codes from which rounding is a uniform error.
    pub smooth_from: f64,
}

impl Print for Reading {
    fn print(&self, before: u64) -> u64 {
        let [lower, upper] = self.rails_e();
        [self.noise_e, self.center, self.offset_e, self.smooth_from, lower, upper].print(before)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Asked {
    /// Moments of the electrons.
    Electrons,
    /// Moments of the codes between these.
    Codes(AdcRecord, Rounding),
    /// What the ends take from moments of straight codes whose rounding is a uniform error.
    Taken(AdcRecord, Rounding),
    /// The probability to be beyond a charge, as the first moment.
    Beyond(f64),
}

/// The codes of a converter.
pub(super) fn codes_of(adc: &AdcRecord) -> Rounding {
    Rounding { lowest: 0.0, highest: f64::from(adc.top_code()) }
}

/// Codes without ends.
pub(super) const ENDLESS: Rounding = Rounding { lowest: f64::NEG_INFINITY, highest: f64::INFINITY };

impl Reading {
    /// Electrons about a charge.
    pub fn electrons(noise_e: f64, center: f64) -> Self {
        Self { asked: Asked::Electrons, noise_e, center, offset_e: 0.0, smooth_from: SMOOTH }
    }

    /// Codes between ends, about the code of a charge.
    pub fn codes(adc: AdcRecord, ends: Rounding, noise_e: f64, about_e: f64) -> Self {
        let center = adc.sample(ends.code(adc.level_at(about_e)));
        Self { asked: Asked::Codes(adc, ends), noise_e, center, offset_e: 0.0, smooth_from: SMOOTH }
    }

    /// Whether a charge and read noise exceed a level.
    pub fn beyond(noise_e: f64, level_e: f64) -> Self {
        Self { asked: Asked::Beyond(level_e), noise_e, center: 0.0, offset_e: 0.0, smooth_from: SMOOTH }
    }

    /// The same of charges that are off by so many electrons more.
    pub fn off_by(&self, offset_e: f64) -> Self {
        Self { offset_e: self.offset_e + offset_e, ..*self }
    }

    /// The same of so few that rounding may be a uniform error where nothing ends, whatever the noise.
    pub fn coarse(&self) -> Self {
        Self { smooth_from: 0.0, ..*self }
    }

    /// The slope by the charge, and the variance and fourth cumulant of the error, of a reading that is straight but for its ends; none of
    /// others.
    pub fn straight(&self) -> Option<[f64; 3]> {
        self.straight_where(|_| false)
    }

    /// The same where something else hides the codes.
    pub fn straight_where(&self, are_hidden: impl Fn(&AdcRecord) -> bool) -> Option<[f64; 3]> {
        let square = self.noise_e * self.noise_e;
        match self.asked {
            Asked::Electrons => Some([1.0, square, 0.0]),
            Asked::Codes(adc, _) if !self.is_bent() && (self.visible_code_e().is_none() || are_hidden(&adc)) => {
                Some([adc.adu_per_e, adc.adu_per_e * adc.adu_per_e * square + 1.0 / 12.0, -1.0 / 120.0])
            }
            _ => None,
        }
    }

    /// What the ends take from what is asked; none where noise does not hide the codes.
    pub fn taken(&self) -> Option<Self> {
        match self.asked {
            Asked::Codes(adc, ends) if !self.is_bent() && adc.adu_per_e * self.noise_e >= SMOOTH => {
                Some(Self { asked: Asked::Taken(adc, ends), ..*self })
            }
            _ => None,
        }
    }

    /// Charges within which the ends take nothing from what is read of a normal law, less what it reaches; none of other readings.
    pub fn idle_e(&self) -> [f64; 2] {
        match self.asked {
            Asked::Taken(..) => {
                let ([lower, upper], reach) = (self.rails_e(), REACH * self.noise_e);
                [lower + reach, upper - reach]
            }
            _ => [f64::INFINITY, f64::NEG_INFINITY],
        }
    }

    /// Whether rounding is taken for a uniform error whatever the noise.
    pub fn is_coarse(&self) -> bool {
        self.smooth_from < SMOOTH
    }

    /// Whether what is asked are codes that are not straight.
    pub fn is_bent(&self) -> bool {
        matches!(self.asked, Asked::Codes(adc, _) if adc.linearization.is_some())
    }

    /// Whether nothing that is told apart has an end.
    pub fn is_endless(&self) -> bool {
        self.rails_e() == [f64::NEG_INFINITY, f64::INFINITY]
    }

    /// Whether what is asked is to be beyond a level that no charge up to `most` reaches.
    pub fn is_never_beyond(&self, most: f64) -> bool {
        matches!(self.asked, Asked::Beyond(level) if most + self.offset_e + REACH * self.noise_e < level)
    }

    /// The moments at a charge whose own variance is `variance`.
    pub fn at(&self, electrons: f64, variance: f64) -> Moments {
        let variance = variance + self.noise_e * self.noise_e;
        let electrons = electrons + self.offset_e;
        match self.asked {
            Asked::Electrons => about(electrons - self.center, variance, 0.0),
            Asked::Codes(adc, ends) if adc.linearization.is_some() => {
                bent::moments(&adc, ends, electrons, variance.sqrt(), self.center)
            }
            Asked::Codes(adc, ends) => {
                ends.moments(adc.level_at(electrons), adc.adu_per_e * variance.sqrt(), self.center)
            }
            Asked::Taken(adc, ends) => {
                ends.taken_by_ends(adc.level_at(electrons), adc.adu_per_e * variance.sqrt(), self.center)
            }
            Asked::Beyond(level) => {
                let share = if variance > 0.0 {
                    cumulative((electrons - level) / variance.sqrt())
                } else if electrons > level {
                    1.0
                } else {
                    0.0
                };
                [share, 0.0, 0.0, 0.0]
            }
        }
    }

    /// The first of these moments, in less time.
    pub fn mean_at(&self, electrons: f64, variance: f64) -> f64 {
        match self.asked {
            Asked::Codes(adc, ends) if adc.linearization.is_none() => {
                let std_e = (variance + self.noise_e * self.noise_e).sqrt();
                ends.mean(adc.level_at(electrons + self.offset_e), adc.adu_per_e * std_e, self.center)
            }
            _ => self.at(electrons, variance)[0],
        }
    }

    /// The same where rounding is as good as a uniform error, and nothing ends.
    pub fn smooth_at(&self, electrons: f64) -> Moments {
        match self.asked {
            Asked::Codes(adc, _) => {
                let electrons = electrons + self.offset_e;
                let (slope, step) = (adc.sample_per_e(electrons), adc.sample_slope(adc.level_at(electrons)));
                let variance = (slope * self.noise_e).powi(2) + step * step / 12.0;
                about(adc.sample_at(electrons) - self.center, variance, -step.powi(4) / 120.0)
            }
            _ => self.at(electrons, 0.0),
        }
    }

    /// The slope by the charge and the variance of the error of readings that are straight from one charge to another; none where
    /// codes show, are not straight, or end.
    pub fn straight_between(&self, low: f64, high: f64) -> Option<(f64, f64)> {
        let [slope, variance, _] = self.straight()?;
        let ([lower, upper], reach) = (self.rails_e(), REACH * self.noise_e);
        (low - reach > lower && high + reach < upper).then_some((slope, variance))
    }

    /// How far from a charge, up (`direction` 1) or down (−1), the chance to be beyond a level is one number, to 10⁻¹⁷; none of other
    /// readings.
    pub fn even_from(&self, electrons: f64, direction: f64) -> Option<f64> {
        let Asked::Beyond(level) = self.asked else { return None };
        let end = level - self.offset_e + direction * REACH * self.noise_e;
        Some((direction * (end - electrons)).max(0.0))
    }

    /// Whether all charges between two are read as one code, with their read noise.
    pub fn is_one(&self, least: f64, most: f64) -> bool {
        let reach = REACH * self.noise_e;
        let [least, most] = [least, most].map(|electrons| electrons + self.offset_e);
        match self.asked {
            Asked::Codes(adc, ends) => ends.code(adc.level_at(least - reach)) == ends.code(adc.level_at(most + reach)),
            _ => false,
        }
    }

    /// Whether no end is near what is read of a charge whose own variance is `variance`.
    pub fn is_free_at(&self, electrons: f64, variance: f64) -> bool {
        let reach = REACH * variance.sqrt();
        let [lower, upper] = self.ends_e();
        let code = self.visible_code_e().unwrap_or(0.0);
        electrons - reach - code > lower && electrons + reach + code < upper
    }

    /// Electrons to the width of a code, the narrower of those at the two ends; none where there is none, or read noise hides
    /// it.
    pub fn visible_code_e(&self) -> Option<f64> {
        let width = |adc: &AdcRecord| {
            let of_end = |edge: f64| adc.electrons_at(edge + 1.0) - adc.electrons_at(edge);
            match adc.linearization {
                None => 1.0 / adc.adu_per_e,
                Some(_) => of_end(-0.5).min(of_end(f64::from(adc.top_code()) - 0.5)),
            }
        };
        match self.asked {
            Asked::Codes(adc, _) if self.noise_e < self.smooth_from * width(&adc) => Some(width(&adc)),
            _ => None,
        }
    }

    /// The charge that is read as a level of the converter.
    fn charge_at(&self, adc: &AdcRecord, level: f64) -> f64 {
        adc.electrons_at(level) - self.offset_e
    }

    /// The charges from the lowest to the highest end of what is told apart, read noise included.
    pub fn ends_e(&self) -> [f64; 2] {
        let reach = REACH * self.noise_e;
        match self.asked {
            Asked::Electrons => [f64::NEG_INFINITY, f64::INFINITY],
            Asked::Codes(adc, ends) | Asked::Taken(adc, ends) => {
                let [low, high] = [ends.lowest - 0.5, ends.highest + 0.5].map(|code| self.charge_at(&adc, code));
                [low - reach, high + reach]
            }
            Asked::Beyond(level) => [level - reach - self.offset_e, level + reach - self.offset_e],
        }
    }

    /// The same charges, less read noise: where moments no longer follow the charge.
    pub fn rails_e(&self) -> [f64; 2] {
        match self.asked {
            Asked::Electrons => [f64::NEG_INFINITY, f64::INFINITY],
            Asked::Codes(adc, ends) | Asked::Taken(adc, ends) => {
                [ends.lowest, ends.highest].map(|code| self.charge_at(&adc, code))
            }
            Asked::Beyond(level) => [level - self.offset_e; 2],
        }
    }

    /// The first edge between two codes above a charge.
    pub fn edge_above(&self, electrons: f64) -> f64 {
        match self.asked {
            Asked::Codes(adc, _) => self.charge_at(&adc, (adc.level_at(electrons + self.offset_e) + 0.5).floor() + 0.5),
            _ => f64::INFINITY,
        }
    }

    /// The edge next above another; `code` is the width of the narrowest code.
    pub fn edge_beyond(&self, edge: f64, code: f64) -> f64 {
        // Beyond the codes none may be.
        if self.is_bent() { self.edge_above(edge + 0.25 * code).max(edge + 0.25 * code) } else { edge + code }
    }

    /// That next below.
    pub fn edge_below(&self, edge: f64, code: f64) -> f64 {
        match self.asked {
            Asked::Codes(adc, _) if self.is_bent() => {
                let level = adc.level_at(edge - 0.25 * code + self.offset_e);
                self.charge_at(&adc, (level - 0.5).floor() + 0.5)
            }
            _ => edge - code,
        }
    }

    /// The same without the highest code.
    pub fn without_highest(&self) -> Self {
        match self.asked {
            Asked::Codes(adc, ends) => {
                let ends = Rounding { highest: f64::INFINITY, ..ends };
                Self { asked: Asked::Codes(adc, ends), ..*self }
            }
            _ => *self,
        }
    }
}

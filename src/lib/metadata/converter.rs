//! The converter of a frame's codes: which charge a code stands for.

use crate::camera::linearity::Linearization;
use crate::camera::readout::ReadOut;
use crate::camera::taps::Taps;
use serde::{Deserialize, Serialize};

/// The converter as it was set, and whether its codes were made straight since.
///
/// Codes are whole numbers from 0 to 2^bits − 1: the nearest to bias + b(K n), n the charge in e⁻, K the slope, and b the
/// inverse of the linearization, where there is one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AdcRecord {
    /// Bits.
    pub bits: u32,
    /// Bias in ADU.
    pub bias_adu: f64,
    /// Slope in ADU per e⁻; that of straight codes.
    pub adu_per_e: f64,
    /// What makes its codes straight; none where they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linearization: Option<Linearization>,
    /// Whether samples are codes that were made straight.
    #[serde(default, skip_serializing_if = "std::ops::Not::not", rename = "linearized")]
    pub is_linearized: bool,
    /// White level in ADU before anything was subtracted, where it was set below the highest code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white_adu: Option<f64>,
}

impl AdcRecord {
    /// A converter whose codes are straight.
    pub const fn new(bits: u32, bias_adu: f64, adu_per_e: f64) -> Self {
        Self { bits, bias_adu, adu_per_e, linearization: None, is_linearized: false, white_adu: None }
    }

    /// Checks that it is possible.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn check(&self) -> Result<(), String> {
        if !(1..=16).contains(&self.bits) {
            return Err(format!("a converter of {} bits is impossible here; give 1 to 16", self.bits));
        }
        if !self.bias_adu.is_finite() {
            return Err(format!("a bias of {} ADU is impossible", self.bias_adu));
        }
        if !(self.adu_per_e > 0.0 && self.adu_per_e.is_finite()) {
            return Err(format!("a slope of {} ADU per electron is impossible; give one above 0", self.adu_per_e));
        }
        Ok(())
    }

    /// The converter of a sensor as the description of its read-out has it.
    pub fn of_readout(readout: &ReadOut) -> Self {
        let straight = Self::new(readout.bits, readout.bias_adu, readout.adu_per_e);
        Self { linearization: readout.linearization, ..straight }
    }

    /// The same whose white level was set, unless that is the highest code or above it.
    #[must_use]
    pub fn with_white(self, white_adu: f64) -> Self {
        let is_below = white_adu < self.sample(self.top_code().into());
        Self { white_adu: is_below.then_some(white_adu), ..self }
    }

    /// By how much samples of full well are below white ones.
    pub fn full_below_white(&self, full_well_e: f64) -> f64 {
        let white = self.white_adu.unwrap_or_else(|| self.sample(self.top_code().into()));
        (white - self.sample(self.full_code(full_well_e))).max(0.0)
    }

    /// The converter behind one of the amplifiers of a sensor, as it is set for all: K g for K, and K g o more than its bias.
    #[must_use]
    pub fn of_tap(self, taps: &Taps, tap: usize) -> Self {
        let adu_per_e = self.adu_per_e * taps.gain(tap);
        Self { adu_per_e, bias_adu: self.bias_adu + adu_per_e * taps.offset_e(tap), ..self }
    }

    /// Those behind all amplifiers of a sensor; itself of one that has one.
    pub fn of_taps(self, taps: Option<&Taps>) -> Vec<Self> {
        taps.map_or_else(|| vec![self], |taps| (0..taps.count()).map(|tap| self.of_tap(taps, tap)).collect())
    }

    /// Whether its samples are not proportional to charge.
    pub fn is_bent(&self) -> bool {
        self.linearization.is_some() && !self.is_linearized
    }

    /// The largest code, 2^bits − 1.
    pub fn top_code(&self) -> u32 {
        (1 << self.bits) - 1
    }

    /// From the lower edge of the lowest code to the upper edge of the highest, above the bias.
    pub fn range(&self) -> [f64; 2] {
        [-0.5, f64::from(self.top_code()) + 0.5].map(|edge| edge - self.bias_adu)
    }

    /// A level of codes, made straight, above the bias.
    fn above_bias(&self, code: f64) -> f64 {
        let above = code - self.bias_adu;
        self.linearization.map_or(above, |curve| curve.extended(above, self.range()))
    }

    /// The charge that a level of codes stands for, in e⁻.
    pub fn electrons_at(&self, code: f64) -> f64 {
        self.above_bias(code) / self.adu_per_e
    }

    /// The level of a charge among the codes, before it is rounded.
    pub fn level_at(&self, electrons: f64) -> f64 {
        let above = self.adu_per_e * electrons;
        self.bias_adu + self.linearization.map_or(above, |curve| curve.bent(above, self.range()))
    }

    /// The sample of a level of codes: the code, or what it was made straight to.
    pub fn sample(&self, code: f64) -> f64 {
        if self.is_linearized { self.bias_adu + self.above_bias(code) } else { code }
    }

    /// How much the sample of a level of codes rises with the code.
    pub fn sample_slope(&self, code: f64) -> f64 {
        if self.is_linearized { self.straightening(code) } else { 1.0 }
    }

    /// How many straight ADU one of the code makes at a level of codes; beyond them as at their ends.
    fn straightening(&self, code: f64) -> f64 {
        let [from, to] = self.range();
        self.linearization.map_or(1.0, |curve| curve.slope((code - self.bias_adu).clamp(from, to)))
    }

    /// The sample of a charge, before it is rounded.
    pub fn sample_at(&self, electrons: f64) -> f64 {
        if self.is_bent() { self.level_at(electrons) } else { self.bias_adu + self.adu_per_e * electrons }
    }

    /// The charge by which one sample exceeds another, in e⁻.
    pub fn electrons_between(&self, lower: f64, upper: f64) -> f64 {
        if self.is_bent() {
            self.electrons_at(upper) - self.electrons_at(lower)
        } else {
            (upper - lower) / self.adu_per_e
        }
    }

    /// How much the sample of a charge rises with it, in ADU per e⁻.
    pub fn sample_per_e(&self, electrons: f64) -> f64 {
        let bend = if self.is_bent() { self.straightening(self.level_at(electrons)) } else { 1.0 };
        self.adu_per_e / bend
    }

    /// The variance of a uniform rounding of the samples at a charge, ADU².
    pub fn rounding_at(&self, electrons: f64) -> f64 {
        self.sample_slope(self.level_at(electrons)).powi(2) / 12.0
    }

    /// The lowest code of a full photosite: the largest, or that of full well (electrons) where it is smaller. A full well that is
    /// made of a code reads that code, whatever its last digit lost.
    pub fn full_code(&self, full_well_e: f64) -> f64 {
        const LOST: f64 = 1e-9;
        let level = self.level_at(full_well_e);
        f64::from(self.top_code()).min((level + LOST * level.abs()).floor())
    }
}

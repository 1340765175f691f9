//! What the law of a photosite's charge is made of.

use super::counts::Charge;
use super::memory::Print;

/// The law of the charge of one class of photosites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Law {
    pub light: Charge,
    pub dark: Charge,
    pub full_well_e: f64,
    pub read_noise_e: f64,
    /// Amplitude of what readings are off by in half of the exposures, up or down.
    pub trap_e: f64,
    /// Whether it is of few photosites, so that what sums over it leave out counts by their share.
    pub are_few: bool,
}

impl Print for Law {
    fn print(&self, before: u64) -> u64 {
        let numbers = [self.full_well_e, self.read_noise_e, self.trap_e, f64::from(u8::from(self.are_few))];
        ([self.light, self.dark], numbers).print(before)
    }
}

/// A normal law among those that make up the law of the charge, before full well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    pub mean: f64,
    pub std: f64,
    pub weight: f64,
    /// Where it is cut off below, for a charge of so many full wells that the law would otherwise reach far below zero; −∞ for
    /// others.
    pub floor: f64,
}

/// Full wells of a charge from which its laws are cut off at floors, which leave out the pattern of what the floors are.
pub(super) const MANY_WELLS: f64 = 30.0;

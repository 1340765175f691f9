//! The amplitudes of hot photosites and of jumps over which the moments of [tails](super::tails) are sums.

use super::amplitudes::{Knee, REACH, Ripples, Rounded, Wanted, is_read_as_charge, nodes, telling};
use super::charge::charge;
use super::law::Law;
use super::memory::Memory;
use super::photosite::Photosite;
use crate::stages::noise::{NoiseModel, Tails};
use std::rc::Rc;

/// Amplitudes, in units of their mean, and weights.
pub(super) type Nodes = Rc<[(f64, f64)]>;

impl Photosite {
    /// Charges at which what is read bends: full well, and the ends of the codes that it does not hide.
    fn levels_e(&self) -> impl Iterator<Item = f64> {
        let ends = self.adc.map(|adc| [0.0, f64::from(adc.top_code())].map(|code| adc.electrons_at(code)));
        let full_e = self.model.full_well_e;
        let most_e = full_e + 12.0 * self.model.added() + REACH * self.most(|tails| tails.rts_e);
        let ends = ends.into_iter().flatten().filter(move |level| *level <= most_e);
        std::iter::once(full_e).chain(ends).filter(|level| level.is_finite())
    }

    /// Amplitudes of hot photosites, as many as tell what is wanted; none of too many.
    pub(super) fn hot_nodes(&self, expected_e: f64, wanted: Wanted) -> Option<Nodes> {
        thread_local! { static KNOWN: Memory<(Photosite, f64, f64), Option<Nodes>> = const { Memory::new() }; }
        let key = (*self, expected_e, f64::from(wanted as u8));
        KNOWN.with(|known| known.recall(key, |_| self.find_hot_nodes(expected_e, wanted).map(Nodes::from)))
    }

    fn find_hot_nodes(&self, expected_e: f64, wanted: Wanted) -> Option<Vec<(f64, f64)>> {
        let mut knees: Vec<Knee> = Vec::new();
        let mut ripples = Ripples::default();
        let mut share = 0.0_f64;
        for (model, light_e) in self.frames(expected_e).filter(|(model, _)| model.tails.has_hot()) {
            let hot_e = model.tails.hot_e;
            let cold = charge(model, light_e);
            knees.extend(self.levels_e().map(|level_e| {
                let shot = if model.dark_shot { (level_e - cold.mean).max(1.0) } else { 0.0 };
                let width = (cold.variance + shot + model.added().powi(2) + model.tails.rts_e.powi(2)).sqrt();
                // Jumps bend it apart from the rest.
                let reach = if model.tails.has_rts() { 24.0 } else { 9.0 };
                Knee { at: (level_e - cold.mean) / hot_e, width: width / hot_e, reach }
            }));
            // So bright few are that it does not matter whether they are cut off.
            let variance = cold.variance + model.added().powi(2);
            let of_squares = model.tails.hot_share * hot_e * hot_e / variance;
            let is_told = is_read_as_charge(self.adc, model.full_well_e, [cold.mean, variance]);
            share = if is_told { share.max(of_squares).max(model.tails.hot_share) } else { f64::INFINITY };
            let farthest = telling(of_squares);
            knees.retain(|knee| knee.at - 3.0 * knee.width < farthest);
            if let Some(adc) = self.adc.filter(|_| wanted == Wanted::Moments) {
                let law = Law { trap_e: 0.0, ..Law::of(model, light_e) };
                let of = Rounded {
                    share: model.tails.hot_share,
                    mean_e: hot_e,
                    is_counted: model.dark_shot,
                    adu_per_e: adc.adu_per_e,
                };
                ripples.add(&of, |angle| law.damping(angle));
            }
        }
        nodes(&knees, &ripples, share, wanted)
    }

    /// Amplitudes of jumps, as many as tell what is wanted; none of too many.
    pub(super) fn trap_nodes(&self, expected_e: f64, wanted: Wanted) -> Option<Nodes> {
        thread_local! { static KNOWN: Memory<(Photosite, f64, f64), Option<Nodes>> = const { Memory::new() }; }
        let key = (*self, expected_e, f64::from(wanted as u8));
        KNOWN.with(|known| known.recall(key, |_| self.find_trap_nodes(expected_e, wanted).map(Nodes::from)))
    }

    fn find_trap_nodes(&self, expected_e: f64, wanted: Wanted) -> Option<Vec<(f64, f64)>> {
        let Some(adc) = self.adc else { return nodes(&[], &Ripples::default(), 0.0, wanted) };
        let mut knees = Vec::new();
        let mut ripples = Ripples::default();
        let mut share = 0.0_f64;
        for (model, light_e) in self.frames(expected_e).filter(|(model, _)| model.tails.has_rts()) {
            let amplitude_e = model.tails.rts_e;
            let cold = charge(model, light_e);
            let mean_e = cold.mean.min(model.full_well_e);
            let width = (cold.variance + model.added().powi(2)).sqrt();
            let of_squares = model.tails.rts_share * (amplitude_e / width).powi(2);
            let is_told = is_read_as_charge(self.adc, model.full_well_e, [cold.mean, width * width]);
            share = if is_told { share.max(of_squares).max(model.tails.rts_share) } else { f64::INFINITY };
            let ends = [0.0, f64::from(adc.top_code())].map(|code| adc.electrons_at(code));
            knees.extend(ends.map(|end| Knee {
                at: (end - mean_e).abs() / amplitude_e,
                width: width / amplitude_e,
                reach: 24.0,
            }));
            if wanted != Wanted::Moments {
                continue;
            }
            let quiet = NoiseModel { tails: Tails::default(), ..*model };
            let law = Law::of(&quiet, light_e);
            let of = Rounded {
                share: model.tails.rts_share,
                mean_e: amplitude_e,
                is_counted: false,
                adu_per_e: adc.adu_per_e,
            };
            ripples.add(&of, |angle| law.least_damping(angle));
        }
        nodes(&knees, &ripples, share, wanted)
    }
}

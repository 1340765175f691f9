//! What panels of a figure share: the classes or channels of a unit with their colors, what deviations are counted from, and words of
//! what lies outside.

use crate::analysis::statistics::portrait::{Likeness, Portrait};
use crate::plot::Color;
use crate::report::in_digits;
use crate::units::typeset;

/// How much higher an axis is than what it shows.
pub(super) const HEADROOM: f64 = 1.08;

/// Classes or channels that share an axis, by their places, and its unit; empty where it is 1.
pub(super) struct Scale {
    pub(super) places: Vec<usize>,
    pub(super) unit: String,
}

impl Scale {
    /// The unit behind words.
    pub(super) fn with_unit(&self, words: &str) -> String {
        if self.unit.is_empty() { words.to_owned() } else { format!("{words} / {}", self.unit) }
    }

    /// The classes or channels, with the color of each.
    pub(super) fn groups<'a>(&self, portrait: &'a Portrait) -> impl Iterator<Item = (Color, &'a Likeness)> {
        self.places.iter().map(|place| (color(portrait, *place), &portrait.groups[*place]))
    }
}

/// One scale for all classes or channels, or for each unit.
pub(super) fn scales(portrait: &Portrait) -> Vec<Scale> {
    let shown = |unit: &str| if ["1", "unspecified"].contains(&unit) { String::new() } else { typeset(unit) };
    let units: Vec<&str> = portrait.unit.split(", ").collect();
    let all = portrait.groups.len();
    if units.len() != all {
        return vec![Scale { places: (0..all).collect(), unit: shown(&portrait.unit) }];
    }
    let mut scales: Vec<Scale> = Vec::new();
    for (place, unit) in units.into_iter().map(shown).enumerate() {
        match scales.iter_mut().find(|scale| scale.unit == unit) {
            Some(scale) => scale.places.push(place),
            None => scales.push(Scale { places: vec![place], unit }),
        }
    }
    scales
}

/// What a panel says of what lies outside it.
pub(super) fn outside(count: u64, all: u64, what: &str, farthest: f64) -> String {
    if count == 0 {
        return String::new();
    }
    format!("{count} of {all} {what} beyond the axes, as far as {}", in_digits(farthest, 3).replace('-', "−"))
}

/// The color of a class or channel.
pub(super) fn color(portrait: &Portrait, index: usize) -> Color {
    match portrait.groups.len() {
        3 => [Color::Vermillion, Color::Green, Color::Blue][index],
        _ => Color::of_index(index),
    }
}

/// Where deviations of a group are counted from: the predicted mean, or that of what was seen.
pub(super) fn reference(group: &Likeness) -> Option<f64> {
    group.predicted.as_ref().map(|predicted| predicted.mean).or_else(|| group.mean())
}

pub(super) fn words_of_reference(portrait: &Portrait) -> &'static str {
    if portrait.groups.iter().all(|group| group.predicted.is_some()) {
        "sample − predicted mean"
    } else {
        "sample − mean"
    }
}

/// Of two deviations the larger.
pub(super) fn farther(one: f64, other: f64) -> f64 {
    if other.abs() > one.abs() { other } else { one }
}

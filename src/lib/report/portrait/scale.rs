//! What panels of a figure share: the classes or channels of a unit with their colors, what deviations are counted from, and words of
//! what lies outside.

use crate::analysis::statistics::portrait::{Likeness, Portrait};
use crate::plot::Color;
use crate::text::in_digits;
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

/// A line of a color.
pub(super) type Colored = (Color, Vec<[f64; 2]>);

/// Lines less those that lie on others but for a hundredth of a height: dashes over dashes look solid. What stands for several is black.
pub(super) fn apart(lines: Vec<Colored>, height: f64) -> Vec<Colored> {
    const SAME: f64 = 0.01;
    let lies_on = |one: &[[f64; 2]], other: &[[f64; 2]]| {
        one.iter().all(|[x, y]| (y - between(other, *x)).abs() <= SAME * height.abs())
    };
    let mut kept: Vec<Colored> = Vec::new();
    for (color, line) in lines {
        match kept.iter_mut().find(|(_, other)| lies_on(&line, other) && lies_on(other, &line)) {
            Some((color, _)) => *color = Color::Black,
            None => kept.push((color, line)),
        }
    }
    kept
}

/// The height of a line at a place; 0 beyond its ends, as of what fades.
fn between(line: &[[f64; 2]], x: f64) -> f64 {
    let pair = line.windows(2).find(|pair| (pair[0][0]..=pair[1][0]).contains(&x));
    match pair {
        Some([[from, low], [to, high]]) if to > from => low + (x - from) / (to - from) * (high - low),
        _ => line.iter().find(|[at, _]| *at == x).map_or(0.0, |[_, y]| *y),
    }
}

/// Of two deviations the larger.
pub(super) fn farther(one: f64, other: f64) -> f64 {
    if other.abs() > one.abs() { other } else { one }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_on_others_are_drawn_once() {
        let law = |shift: f64, scale: f64| -> Vec<[f64; 2]> {
            (0..40).map(f64::from).map(|x| x + shift).map(|x| [x, scale * (-0.02 * (x - 20.0).powi(2)).exp()]).collect()
        };
        let lines = vec![
            (Color::Vermillion, law(0.0, 1.0)),
            (Color::Green, law(0.5, 1.005)),
            (Color::Blue, law(0.0, 1.2)),
            (Color::Purple, vec![[3.0, 0.0], [9.0, 0.0]]),
        ];
        let kept = apart(lines, 1.2);
        let colors: Vec<Color> = kept.iter().map(|(color, _)| *color).collect();
        assert_eq!(colors, [Color::Black, Color::Blue, Color::Purple]);
    }
}

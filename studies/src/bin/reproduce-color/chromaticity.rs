//! Colors of skies in the CIE 1931 diagram, and how far from them a camera's colors are.

use cyanometer::color::locus;
use cyanometer::plot::{Anchor, Arrangement, Axis, Color, Marks, Note, Panel, Plot};
use cyanometer::spectrum::Observer;

/// The color of a sky, and what a camera makes of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyColor {
    /// Its chromaticity x, y.
    pub xy: [f64; 2],
    /// The chromaticity that the camera gives.
    pub fitted_xy: [f64; 2],
    /// The CIE 1994 difference of the two colors.
    pub delta_e_94: f64,
}

/// What x and y span unless skies lie outside.
const SPAN: [f64; 2] = [0.20, 0.42];

/// Errors of a few thousandths are drawn so many times as long: at their own length points would hide them.
const LONGER: f64 = 5.0;

/// The diameter of the circle of the largest difference, in pixels.
const LARGEST_CIRCLE: f64 = 32.0;

/// Draws chromaticities of skies: with lines to those that a camera gives, between the loci of black bodies, daylight
/// and clear skies, and in the entire diagram (small, in a corner); and beside it with circles in proportion to the
/// differences.
///
/// The sky `kept`, whose color the camera's matrix keeps exactly, has a mark and a name.
pub fn chromaticity(skies: &[SkyColor], kept: Option<usize>, observer: &Observer, title: &str) -> Plot {
    let span = span(skies);
    let panels = vec![errors(skies, kept, observer, span), differences(skies, span)];
    Plot { title: title.into(), panels, arrangement: Arrangement::SideBySide }
}

fn errors(skies: &[SkyColor], kept: Option<usize>, observer: &Observer, span: [f64; 2]) -> Panel {
    let mut panel = panel(span, "colors and errors");
    let black_bodies = black_bodies(observer);
    let error = |sky: &SkyColor| {
        let end = [0, 1].map(|axis| sky.xy[axis] + LONGER * (sky.fitted_xy[axis] - sky.xy[axis]));
        Note::Line { points: vec![sky.xy, end], color: Color::Vermillion }
    };
    panel.notes = skies.iter().map(error).collect();
    panel.notes.extend(diagram(skies, &black_bodies, observer, span));
    panel.add("black bodies", Color::Black, Marks::Line(black_bodies));
    panel.add("daylight (CIE)", Color::Orange, Marks::Line(curve(locus::DAYLIGHT_X, locus::daylight)));
    panel.add("measured clear skies", Color::Green, Marks::Dashed(curve(locus::CLEAR_SKY_X, locus::clear_sky)));
    // For the legend: the errors are notes.
    panel.add(&format!("error of the camera × {LONGER}"), Color::Vermillion, Marks::Line(Vec::new()));
    panel.add("skies", Color::Blue, Marks::Points(places(skies)));
    if let Some(sky) = kept.and_then(|index| skies.get(index)) {
        panel.add("", Color::Black, Marks::Points(vec![sky.xy]));
        panel.name(sky.xy, "kept exactly", Color::Black);
    }
    panel
}

fn differences(skies: &[SkyColor], span: [f64; 2]) -> Panel {
    let mut panel = panel(span, "differences ΔE₉₄");
    let color = Color::Vermillion;
    let largest = skies.iter().map(|sky| sky.delta_e_94).filter(|value| value.is_finite()).fold(0.0, f64::max);
    if largest > 0.0 {
        let scale = LARGEST_CIRCLE / largest;
        let circle = |at, difference| Note::Circle { at, diameter: scale * difference, color };
        panel.notes = skies.iter().map(|sky| circle(sky.xy, sky.delta_e_94)).collect();
        for (row, (difference, label)) in sample_differences(largest).into_iter().enumerate() {
            let along = |part: f64| span[0] + part * (span[1] - span[0]);
            let y = along(0.24 - 0.08 * row as f64);
            panel.notes.push(circle([along(0.7), y], difference));
            panel.notes.push(Note::Text { at: [along(0.76), y], anchor: Anchor::Start, text: label });
        }
    }
    panel.add("skies", Color::Blue, Marks::Points(places(skies)));
    panel
}

/// The entire diagram, small, in the upper left corner of a panel.
fn diagram(skies: &[SkyColor], black_bodies: &[[f64; 2]], observer: &Observer, span: [f64; 2]) -> Vec<Note> {
    const END: f64 = 0.9;
    let side = 0.3 * (span[1] - span[0]);
    let corner = [span[0] + 0.4 * side, span[1] - 1.15 * side];
    let at = |xy: [f64; 2]| [0, 1].map(|axis| corner[axis] + side * xy[axis] / END);
    let line = |points: &[[f64; 2]], color| Note::Line { points: points.iter().map(|&xy| at(xy)).collect(), color };
    let mut notes = vec![
        line(&[[0.0, 0.0], [END, 0.0], [END, END], [0.0, END], [0.0, 0.0]], Color::Black),
        line(&locus::boundary(observer), Color::Gray),
        line(black_bodies, Color::Black),
    ];
    notes.extend(skies.iter().map(|sky| Note::Circle { at: at(sky.xy), diameter: 1.0, color: Color::Blue }));
    for value in [0.0, 0.4, 0.8] {
        notes.push(line(&[[value, 0.0], [value, 0.02]], Color::Black));
        notes.push(line(&[[0.0, value], [0.02, value]], Color::Black));
        let text = |at, anchor| Note::Text { at, anchor, text: value.to_string() };
        notes.push(text(at([value, -0.1]), Anchor::Middle));
        notes.push(text(at([-0.04, value]), Anchor::End));
    }
    notes
}

fn places(skies: &[SkyColor]) -> Vec<[f64; 2]> {
    skies.iter().map(|sky| sky.xy).collect()
}

/// What both axes span, so that all skies are seen.
fn span(skies: &[SkyColor]) -> [f64; 2] {
    let seen = skies.iter().flat_map(|sky| sky.xy.into_iter().chain(sky.fitted_xy)).filter(|value| value.is_finite());
    seen.fold(SPAN, |[low, high], value| [low.min(value - 0.01), high.max(value + 0.01)])
}

fn panel([low, high]: [f64; 2], title: &str) -> Panel {
    let axis = |label| Axis::linear(label).range(low, high);
    Panel { title: title.into(), equal_scale: true, ..Panel::new(axis("x"), axis("y")) }
}

/// From 2000 K upward, in even steps of 1/T, as the locus runs.
fn black_bodies(observer: &Observer) -> Vec<[f64; 2]> {
    const COLDEST_K: f64 = 2000.0;
    const STEPS: u32 = 100;
    let warmth = |step: u32| COLDEST_K * f64::from(STEPS) / f64::from(step);
    (1..=STEPS).map(|step| locus::planckian(observer, warmth(step))).collect()
}

fn curve([first, last]: [f64; 2], y: fn(f64) -> f64) -> Vec<[f64; 2]> {
    (0..=60).map(|step| first + (last - first) * f64::from(step) / 60.0).map(|x| [x, y(x)]).collect()
}

/// Round differences up to the largest, with what the legend says: about all, half and a fifth of it.
fn sample_differences(largest: f64) -> Vec<(f64, String)> {
    let power = largest.log10().floor();
    #[expect(clippy::cast_possible_truncation, reason = "the logarithm of a double")]
    let exponent = power as i32;
    // 1, 2 and 5 times powers of ten, the largest first.
    let steps = (exponent - 2..=exponent).rev().flat_map(|ten| [5, 2, 1].map(|digit| (digit, ten)));
    let samples = steps.map(|(digit, ten)| {
        let value = f64::from(digit) * 10_f64.powi(ten);
        let decimals = usize::try_from(-ten).unwrap_or(0);
        (value, format!("ΔE₉₄ = {value:.decimals$}"))
    });
    samples.filter(|(value, _)| *value <= largest).take(3).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cyanometer::formats::data::load_observer;

    /// The skies of the library, and errors of a few thousandths that vanish at one of them.
    fn skies() -> Vec<SkyColor> {
        let table = include_str!("../../../../sample_data/skies/sky912_meta.csv");
        let rows = table.lines().filter(|row| row.starts_with(|c: char| c.is_ascii_digit()));
        let sky = |row: &str| {
            let cells: Vec<f64> = row.split(',').skip(10).map(|cell| cell.parse().unwrap()).collect();
            let [x, y] = [cells[0], cells[1]];
            let [along, across] = [0.05 * (x - 0.28), 0.3 * (x - 0.28) * (x - 0.36)];
            let fitted_xy = [x + along + across, y + along - across];
            SkyColor { xy: [x, y], fitted_xy, delta_e_94: 300.0 * along.hypot(across) }
        };
        rows.map(sky).collect()
    }

    fn notes(panel: &Panel, color: Color) -> impl Iterator<Item = &Note> {
        panel.notes.iter().filter(move |note| match note {
            Note::Line { color: its, .. } | Note::Circle { color: its, .. } => *its == color,
            Note::Text { .. } => false,
        })
    }

    #[test]
    fn lines_lead_from_each_sky_to_what_the_camera_makes_of_it() {
        let skies = skies();
        assert_eq!(skies.len(), 912);
        let plot = chromaticity(&skies, Some(7), &load_observer().unwrap(), "Skies and a camera");
        let [errors, _] = &plot.panels[..] else { panic!("two panels") };
        for (sky, note) in skies.iter().zip(notes(errors, Color::Vermillion)) {
            let Note::Line { points, .. } = note else { panic!("{note:?}") };
            assert_eq!(points[0], sky.xy);
            let longer = [0, 1].map(|axis| (points[1][axis] - sky.xy[axis]) / LONGER + sky.xy[axis]);
            assert!((0..2).all(|axis| (longer[axis] - sky.fitted_xy[axis]).abs() < 1e-12), "{note:?}");
        }
        // The sky that is kept has a name.
        assert!(matches!(&errors.names[..], [name] if name.at == skies[7].xy), "{:?}", errors.names);
    }

    #[test]
    fn circles_go_with_the_differences() {
        let skies = skies();
        let plot = chromaticity(&skies, None, &load_observer().unwrap(), "Skies and a camera");
        let circles: Vec<([f64; 2], f64)> = notes(&plot.panels[1], Color::Vermillion)
            .filter_map(|note| if let Note::Circle { at, diameter, .. } = note { Some((*at, *diameter)) } else { None })
            .collect();
        // Three more explain the sizes.
        assert_eq!(circles.len(), 915);
        let largest = skies.iter().map(|sky| sky.delta_e_94).fold(0.0, f64::max);
        for (sky, (at, diameter)) in skies.iter().zip(&circles) {
            assert_eq!(*at, sky.xy);
            assert!((diameter / LARGEST_CIRCLE - sky.delta_e_94 / largest).abs() < 1e-12);
        }
    }

    #[test]
    fn the_small_diagram_covers_no_sky() {
        let skies = skies();
        let observer = load_observer().unwrap();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for note in diagram(&skies, &black_bodies(&observer), &observer, span(&skies)) {
            let points = match note {
                Note::Line { points, .. } => points,
                Note::Circle { at, .. } | Note::Text { at, .. } => vec![at],
            };
            for at in points {
                low = [0, 1].map(|axis| low[axis].min(at[axis]));
                high = [0, 1].map(|axis| high[axis].max(at[axis]));
            }
        }
        assert!((0..2).all(|axis| low[axis] > SPAN[0] && high[axis] < SPAN[1]), "{low:?} {high:?}");
        let covers = |[x, y]: [f64; 2]| (low[0]..high[0]).contains(&x) && (low[1]..high[1]).contains(&y);
        assert_eq!(skies.iter().filter(|sky| covers(sky.xy) || covers(sky.fitted_xy)).count(), 0);
    }

    #[test]
    fn no_skies_and_skies_without_numbers_make_a_plot_all_the_same() {
        let observer = load_observer().unwrap();
        let nowhere = SkyColor { xy: [f64::NAN; 2], fitted_xy: [f64::INFINITY; 2], delta_e_94: f64::NAN };
        for (skies, kept) in [(vec![], Some(3)), (vec![nowhere], Some(0))] {
            let plot = chromaticity(&skies, kept, &observer, "");
            assert!(!plot.svg().contains("NaN"));
            assert!(plot.png().is_ok());
        }
    }

    #[test]
    fn sample_circles_are_round_numbers_up_to_the_largest() {
        let labels = |largest| sample_differences(largest).into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(labels(3.7), ["ΔE₉₄ = 2", "ΔE₉₄ = 1", "ΔE₉₄ = 0.5"]);
        assert_eq!(labels(0.05), ["ΔE₉₄ = 0.05", "ΔE₉₄ = 0.02", "ΔE₉₄ = 0.01"]);
        assert_eq!(labels(30.0), ["ΔE₉₄ = 20", "ΔE₉₄ = 10", "ΔE₉₄ = 5"]);
    }
}

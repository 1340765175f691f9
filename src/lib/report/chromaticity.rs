//! Colors of skies in the CIE 1931 diagram, and how far from them a camera's colors are.

use super::plot::{Arrangement, Arrow, Axis, CircleSize, Color, Corner, Inset, Marks, Panel, Plot};
use crate::color::locus;
use crate::spectrum::Observer;

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

/// The diameter of the circle of the largest difference, in pixels.
const LARGEST_CIRCLE: f64 = 32.0;

/// Draws chromaticities of skies: with lines to those that a camera gives, between the loci of black bodies, daylight
/// and clear skies, in the entire diagram (inset); and beside it with circles in proportion to the differences.
///
/// An arrow points at the sky `kept`, whose color the camera's matrix keeps exactly.
pub fn chromaticity(skies: &[SkyColor], kept: Option<usize>, observer: &Observer, title: &str) -> Plot {
    let black_bodies = black_bodies(observer);
    let mut lines = panel(skies, "colors and errors");
    let errors = skies.iter().map(|sky| [sky.xy[0], sky.xy[1], sky.fitted_xy[0], sky.fitted_xy[1]]);
    let places: Vec<[f64; 2]> = skies.iter().map(|sky| sky.xy).collect();
    lines.add("black bodies", Color::Black, Marks::Line(black_bodies.clone()));
    lines.add("daylight (CIE)", Color::Orange, Marks::Line(curve(locus::DAYLIGHT_X, locus::daylight)));
    lines.add("measured clear skies", Color::Vermillion, Marks::Dashed(curve(locus::CLEAR_SKY_X, locus::clear_sky)));
    lines.add("error of the camera", Color::Gray, Marks::Segments(errors.collect()));
    lines.add("skies", Color::Blue, Marks::Points(places.clone()));
    if let Some(sky) = kept.and_then(|index| skies.get(index)) {
        lines.add("", Color::Black, Marks::Points(vec![sky.xy]));
        lines.arrows.push(arrow(sky.xy));
    }

    let axis = |label| Axis::linear(label).range(0.0, 0.9);
    let mut entire = Panel::new(axis("x"), axis("y"));
    entire.equal_scale = true;
    entire.add("", Color::Gray, Marks::Line(locus::boundary(observer)));
    entire.add("", Color::Black, Marks::Line(black_bodies));
    entire.add("", Color::Blue, Marks::Points(places.clone()));
    lines.inset = Some(Box::new(Inset { panel: entire, corner: Corner::TopLeft, share: 0.46 }));

    let mut circles = panel(skies, "differences ΔE₉₄");
    let largest = skies.iter().map(|sky| sky.delta_e_94).filter(|value| value.is_finite()).fold(0.0, f64::max);
    if largest > 0.0 {
        let scale = LARGEST_CIRCLE / largest;
        let circle = |sky: &SkyColor| [sky.xy[0], sky.xy[1], scale * sky.delta_e_94];
        circles.add("", Color::Vermillion, Marks::Circles(skies.iter().map(circle).collect()));
        circles.circle_sizes = sample_differences(largest)
            .into_iter()
            .map(|(difference, label)| CircleSize { diameter: scale * difference, label, color: Color::Vermillion })
            .collect();
    }
    circles.add("skies", Color::Blue, Marks::Points(places));
    Plot { title: title.into(), panels: vec![lines, circles], arrangement: Arrangement::SideBySide }
}

fn panel(skies: &[SkyColor], title: &str) -> Panel {
    let seen = skies.iter().flat_map(|sky| sky.xy.into_iter().chain(sky.fitted_xy)).filter(|value| value.is_finite());
    let [low, high] = seen.fold(SPAN, |[low, high], value| [low.min(value - 0.01), high.max(value + 0.01)]);
    let axis = |label| Axis::linear(label).range(low, high);
    Panel { title: title.into(), equal_scale: true, ..Panel::new(axis("x"), axis("y")) }
}

/// From 2000 K upwards, in even steps of 1/T, as the locus runs.
fn black_bodies(observer: &Observer) -> Vec<[f64; 2]> {
    const COLDEST_K: f64 = 2000.0;
    const STEPS: u32 = 100;
    let warmth = |step: u32| COLDEST_K * f64::from(STEPS) / f64::from(step);
    (1..=STEPS).map(|step| locus::planckian(observer, warmth(step))).collect()
}

fn curve([first, last]: [f64; 2], y: fn(f64) -> f64) -> Vec<[f64; 2]> {
    (0..=60).map(|step| first + (last - first) * f64::from(step) / 60.0).map(|x| [x, y(x)]).collect()
}

/// An arrow from below and the right, where no sky is.
fn arrow(to: [f64; 2]) -> Arrow {
    Arrow { from: [to[0] + 0.02, to[1] - 0.025], to, label: "kept exactly".into(), color: Color::Black }
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
    use crate::formats::data::load_observer;

    /// The skies of the library, and errors of a few thousandths that vanish at one of them.
    fn skies() -> Vec<SkyColor> {
        let table = include_str!("../../../sample_data/skies/sky912_meta.csv");
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

    #[test]
    fn skies_loci_errors_and_circles_are_drawn() {
        let skies = skies();
        assert_eq!(skies.len(), 912);
        let kept = (0..912).min_by(|&a, &b| skies[a].delta_e_94.total_cmp(&skies[b].delta_e_94));
        let plot = chromaticity(&skies, kept, &load_observer().unwrap(), "Skies and a camera");
        if let Some(directory) = std::env::var_os("CYANOMETER_PLOTS") {
            for end in ["svg", "png"] {
                plot.write(&std::path::Path::new(&directory).join(format!("chromaticity.{end}")), None).unwrap();
            }
        }
        let svg = plot.svg();
        for text in ["black bodies", "measured clear skies", "daylight (CIE)", "kept exactly", "ΔE₉₄ = "] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(svg.matches("<circle").count() >= 4 * 912);
        assert!(!svg.contains("NaN"));
        assert!(plot.png().is_ok());
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

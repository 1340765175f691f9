//! What the patterns of a measured camera look like.

use crate::analysis::photon_transfer::{PatternFigure, PatternView};
use crate::plot::{Axis, Color, Marks, Panel};
use crate::requests::photon_transfer::MeasuredCamera;

/// Below this share of a photosite, or this share of all, the normal law is not drawn.
const LEAST_COUNT: f64 = 0.5;

/// A class that is shown.
struct Shown<'a> {
    name: &'a str,
    color: Color,
    view: &'a PatternView,
    figure: &'a PatternFigure,
    /// From the unit of the view to that of the panels.
    scale: f64,
}

/// A pattern of all classes.
struct Pattern<'a> {
    name: &'static str,
    unit: &'static str,
    classes: Vec<Shown<'a>>,
}

/// Spectrograms, profiles, histograms and accumulated histograms, along rows beside along columns.
pub fn pattern_panels(camera: &MeasuredCamera) -> Vec<Panel> {
    let patterns = [(0, "PRNU", "%"), (1, "DSNU", "e\u{207B}")].map(|(which, name, unit)| {
        let shown = camera.classes.iter().zip(&camera.patterns).enumerate().filter_map(|(index, (class, views))| {
            let view = views[which].as_ref()?;
            let scale = if which == 0 { 100.0 } else { 1.0 / class.values?.gain };
            let color = color(&class.name, index);
            Some(Shown { name: &class.name, color, view, figure: view.figure.as_ref()?, scale })
        });
        Pattern { name, unit, classes: shown.collect() }
    });
    let of = |kind: fn(&Pattern<'_>) -> [Panel; 2]| patterns.iter().flat_map(kind);
    of(|pattern| pattern.spectrograms())
        .chain(of(|pattern| pattern.profiles()))
        .chain(of(|pattern| pattern.histograms()))
        .collect()
}

/// The color of a class, that of its filter where it has one.
pub fn color(name: &str, index: usize) -> Color {
    match name {
        "R" => Color::Vermillion,
        "G" => Color::Green,
        "B" => Color::Blue,
        _ => Color::of_index(index),
    }
}

fn scaled(points: &[[f64; 2]], [x_scale, y_scale]: [f64; 2]) -> Vec<[f64; 2]> {
    points.iter().map(|[x, y]| [x * x_scale, y * y_scale]).collect()
}

impl Pattern<'_> {
    fn panel(&self, what: &str, x: Axis, y: Axis) -> Panel {
        Panel { title: format!("{}, {what}", self.name), ..Panel::new(x, y) }
    }

    fn spectrograms(&self) -> [Panel; 2] {
        [("horizontal spectrogram", 0), ("vertical spectrogram", 1)].map(|(what, axis)| {
            let mut panel = self.panel(
                what,
                Axis::linear("frequency / cycles per photosite"),
                Axis::log10(&format!("power / {}\u{B2}", self.unit)),
            );
            for Shown { name, color, figure, scale, .. } in &self.classes {
                let power = scaled(figure.spectra[axis].get(1..).unwrap_or_default(), [1.0, scale * scale]);
                panel.add(name, *color, Marks::Line(power));
            }
            panel
        })
    }

    /// Means of columns, and of rows; those of several classes one above the other.
    fn profiles(&self) -> [Panel; 2] {
        [("horizontal profile", "column", 0), ("vertical profile", "row", 1)].map(|(what, place, axis)| {
            let label = format!("mean behind the filter / {}", self.unit);
            let mut panel = self.panel(what, Axis::linear(place), Axis::linear(&label));
            let reach = |shown: &Shown| {
                let far = shown.view.profiles[axis].iter().map(|[_, mean]| mean.abs()).fold(0.0, f64::max);
                far * shown.scale
            };
            let apart = rounded_up(2.0 * self.classes.iter().map(reach).fold(0.0, f64::max));
            for (index, Shown { name, color, view, scale, .. }) in self.classes.iter().enumerate() {
                let lowered = index as f64 * apart;
                let means = view.profiles[axis].iter().map(|[at, mean]| [*at, mean * scale - lowered]);
                let name = match (index, self.classes.len()) {
                    (0, _) => (*name).to_owned(),
                    _ => format!("{name}, less {lowered}"),
                };
                panel.add(&name, *color, Marks::Line(means.collect()));
            }
            panel
        })
    }

    fn histograms(&self) -> [Panel; 2] {
        let mut plain = self.panel(
            "logarithmic histogram",
            Axis::linear(&format!("deviation behind the filter / {}", self.unit)),
            Axis::log10("photosites"),
        );
        let mut accumulated = self.panel(
            "accumulated histogram",
            Axis::linear(&format!("absolute deviation behind the filter / {}", self.unit)),
            Axis::log10("share of photosites beyond / %"),
        );
        for Shown { name, color, figure, scale, .. } in &self.classes {
            let law = if self.classes.len() == 1 { Color::Vermillion } else { *color };
            let law_name = if self.classes.len() == 1 { "normal law" } else { "" };
            plain.add(name, *color, Marks::Points(scaled(&figure.histogram, [*scale, 1.0])));
            let normal = figure.normal.iter().filter(|[_, count]| *count > LEAST_COUNT).copied().collect::<Vec<_>>();
            plain.add(law_name, law, Marks::Dashed(scaled(&normal, [*scale, 1.0])));
            accumulated.add(name, *color, Marks::Points(scaled(&figure.accumulated, [*scale, 100.0])));
            let least = figure.accumulated.first().map_or(0.0, |[_, share]| *share * LEAST_COUNT);
            let normal = figure.normal_accumulated.iter().filter(|[_, share]| *share > least).copied();
            let normal = normal.collect::<Vec<_>>();
            accumulated.add(law_name, law, Marks::Dashed(scaled(&normal, [*scale, 100.0])));
        }
        if self.classes.len() > 1 {
            for panel in [&mut plain, &mut accumulated] {
                // For the legend: each class has its own, in its color.
                panel.add("normal law", Color::Black, Marks::Dashed(Vec::new()));
            }
        }
        [plain, accumulated]
    }
}

/// The next number of one digit and zeros.
fn rounded_up(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let unit = 10_f64.powf(value.log10().floor());
    // What division leaves behind the digits is not shown.
    let digits = (value / unit).ceil();
    if unit < 1.0 { digits / unit.recip().round() } else { digits * unit }
}

//! The curves of a measured camera.

use crate::analysis::photon_transfer::ClassFindings;
use crate::plot::{Axis, Color, Marks, Panel, Plot};
use crate::requests::photon_transfer::MeasuredCamera;

/// Draws, one beside the other, variance against signal with the line of the gain, signal against light, deviations from the straight
/// line, and signal-to-noise ratio.
pub fn camera_page(camera: &MeasuredCamera) -> Plot {
    let mut transfer = Panel::new(Axis::linear("signal above dark / ADU"), Axis::linear("temporal variance above dark / ADU\u{B2}"));
    let mut response = Panel::new(Axis::linear(light_label(camera)), Axis::linear("signal above dark / ADU"));
    let mut straight = Panel::new(Axis::linear(light_label(camera)), Axis::linear("deviation from the line / %"));
    let mut ratio = Panel::new(Axis::log10("signal / e\u{207B}"), Axis::log10("signal-to-noise ratio"));
    for (index, class) in camera.classes.iter().enumerate() {
        let color = color(&class.name, index);
        add_transfer(&mut transfer, class, color);
        let lit = class.curve.iter().filter_map(|point| Some([point.photons.or(point.exposure_s)?, point.signal_adu]));
        response.add(&class.name, color, Marks::Points(lit.collect()));
        if let Some(linearity) = &class.linearity {
            let deviations = linearity.deviations.iter().map(|[light, deviation]| [*light, 100.0 * deviation]);
            straight.add(&class.name, color, Marks::Points(deviations.collect()));
        }
        add_ratio(&mut ratio, class, color);
    }
    let mut plot = Plot::new(&format!("Photon transfer of {}", camera.list), transfer);
    plot.panels.extend([response, straight, ratio].into_iter().filter(|panel| !panel.series.is_empty()));
    plot
}

fn light_label(camera: &MeasuredCamera) -> &'static str {
    let has_photons = camera.classes.iter().flat_map(|class| &class.curve).any(|point| point.photons.is_some());
    if has_photons { "photons per photosite" } else { "exposure time / s" }
}

fn color(name: &str, index: usize) -> Color {
    match name {
        "R" => Color::Vermillion,
        "G" => Color::Green,
        "B" => Color::Blue,
        _ => Color::of_index(index),
    }
}

fn add_transfer(panel: &mut Panel, class: &ClassFindings, color: Color) {
    let points = |is_fitted: bool| {
        let wanted = class.curve.iter().filter(move |point| point.is_fitted == is_fitted);
        wanted.map(|point| [point.signal_adu, point.variance_adu2]).collect::<Vec<_>>()
    };
    panel.add(&class.name, color, Marks::Points(points(true)));
    let others = points(false);
    if !others.is_empty() {
        panel.add(&format!("{}, not fitted", class.name), Color::Gray, Marks::Points(others));
    }
    if let Some(values) = class.values {
        let most = class.curve.iter().filter(|point| point.is_fitted).map(|point| point.signal_adu).fold(0.0, f64::max);
        panel.add(&format!("{}, K {:.5}", class.name, values.gain), color, Marks::Line(vec![[0.0, 0.0], [most, values.gain * most]]));
    }
}

fn add_ratio(panel: &mut Panel, class: &ClassFindings, color: Color) {
    let Some(values) = class.values else { return };
    let dark = values.dark_variance.unwrap_or(0.0);
    let measured = class.curve.iter().filter(|point| point.signal_adu > 0.0 && point.variance_adu2 + dark > 0.0);
    let points = measured.map(|point| [point.signal_adu / values.gain, point.signal_adu / (point.variance_adu2 + dark).sqrt()]);
    panel.add(&class.name, color, Marks::Points(points.collect()));
}

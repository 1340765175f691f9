//! The curves of a measured camera.

use crate::analysis::photon_transfer::ClassFindings;
use crate::plot::{Arrangement, Axis, Color, Marks, Panel, Plot};
use crate::requests::photon_transfer::MeasuredCamera;

/// Draws, two beside each other: variance against signal with the line of the gain, signal against light, deviations from the straight
/// line, signal-to-noise ratio; then spectrograms, profiles and histograms of the patterns under light and in the dark.
pub fn camera_page(camera: &MeasuredCamera) -> Plot {
    let mut transfer =
        Panel::new(Axis::linear("signal above dark / ADU"), Axis::linear("temporal variance above dark / ADU\u{B2}"));
    let mut response = Panel::new(Axis::linear(light_label(camera)), Axis::linear("signal above dark / ADU"));
    let mut straight = Panel::new(Axis::linear(light_label(camera)), Axis::linear("deviation from the line / %"));
    let mut ratio = Panel::new(Axis::log10("signal / e\u{207B}"), Axis::log10("signal-to-noise ratio"));
    transfer.title = "Photon transfer".into();
    response.title = "Response".into();
    straight.title = "Linearity".into();
    ratio.title = "Signal to noise".into();
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
    let mut panels = vec![transfer, response, straight, ratio];
    for (which, name, unit) in [(0, "PRNU", "%"), (1, "DSNU", "e\u{207B}")] {
        panels.extend(patterns(camera, which, name, unit));
    }
    panels.retain(|panel| !panel.series.is_empty());
    let title = format!("Photon transfer of {}", camera.list);
    let mut panels = panels.into_iter();
    let first = panels.next().unwrap_or_else(|| Panel::new(Axis::linear(""), Axis::linear("")));
    let mut plot = Plot::new(&title, first);
    plot.panels.extend(panels);
    plot.arrangement = Arrangement::Pairs;
    plot
}

/// Spectrogram, profiles and histogram of a pattern.
fn patterns(camera: &MeasuredCamera, which: usize, name: &str, unit: &str) -> [Panel; 3] {
    let label = |of: &str| format!("{of} / {unit}");
    let mut spectrum = Panel::new(
        Axis::linear("frequency / cycles per photosite of the class"),
        Axis::log10(&format!("power / {unit}\u{B2}")),
    );
    let mut profile = Panel::new(Axis::linear("column or row"), Axis::linear(&label("mean behind the filter")));
    let mut histogram = Panel::new(Axis::linear(&label("deviation behind the filter")), Axis::log10("photosites"));
    spectrum.title = format!("{name}, spectrogram");
    profile.title = format!("{name}, profiles");
    histogram.title = format!("{name}, histogram");
    for (index, (class, views)) in camera.classes.iter().zip(&camera.patterns).enumerate() {
        let (Some(view), Some(values)) = (&views[which], class.values) else { continue };
        let color = color(&class.name, index);
        // The two directions of a single class are told apart by color too.
        let other = if camera.classes.len() == 1 { Color::Vermillion } else { color };
        let scale = if which == 0 { 100.0 } else { 1.0 / values.gain };
        let scaled =
            |points: &[[f64; 2]], factor: f64| points.iter().map(|[x, y]| [*x, y * factor]).collect::<Vec<_>>();
        let [along_rows, along_columns] = &view.spectra;
        spectrum.add(&format!("{}, rows", class.name), color, Marks::Line(scaled(&along_rows[1..], scale * scale)));
        spectrum.add(
            &format!("{}, columns", class.name),
            other,
            Marks::Dashed(scaled(&along_columns[1..], scale * scale)),
        );
        profile.add(&format!("{}, columns", class.name), color, Marks::Line(scaled(&view.profiles[0], scale)));
        profile.add(&format!("{}, rows", class.name), other, Marks::Dashed(scaled(&view.profiles[1], scale)));
        let along = |points: &[[f64; 2]]| points.iter().map(|[x, y]| [x * scale, *y]).collect::<Vec<_>>();
        histogram.add(&class.name, color, Marks::Points(along(&view.histogram)));
        let law = along(&view.normal).into_iter().filter(|[_, count]| *count > 0.1);
        histogram.add(&format!("{}, normal law", class.name), color, Marks::Line(law.collect()));
    }
    [spectrum, profile, histogram]
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
        panel.add(
            &format!("{}, K {:.5}", class.name, values.gain),
            color,
            Marks::Line(vec![[0.0, 0.0], [most, values.gain * most]]),
        );
    }
}

fn add_ratio(panel: &mut Panel, class: &ClassFindings, color: Color) {
    let Some(values) = class.values else { return };
    let dark = values.dark_variance.unwrap_or(0.0);
    let most = class.get("saturation_e").map_or(f64::INFINITY, |saturation| saturation.high * values.gain);
    let is_whole = |signal: f64| signal > 0.0 && signal <= most;
    let measured = class.curve.iter().filter(|point| is_whole(point.signal_adu) && point.variance_adu2 + dark > 0.0);
    let points =
        measured.map(|point| [point.signal_adu / values.gain, point.signal_adu / (point.variance_adu2 + dark).sqrt()]);
    panel.add(&class.name, color, Marks::Points(points.collect()));
}

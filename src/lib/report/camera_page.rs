//! The page of a measured camera, in the order of the data sheet of \[EMVA1288].

use super::camera_patterns::{color, pattern_panels};
use crate::analysis::photon_transfer::{ClassFindings, CurvePoint};
use crate::plot::{Arrangement, Axis, Color, Marks, Panel, Plot, ReferenceLine, Region};
use crate::requests::photon_transfer::MeasuredCamera;

/// Levels with so large a share of samples at the largest code have less noise than their light.
const CLIPPED: f64 = 1e-3;
/// Points of a drawn curve.
const STEPS: u32 = 100;

/// Draws, two beside each other: variance against signal with the line of the gain, signal against light, linearity and the deviations
/// from the straight line, signal-to-noise ratio with that of an ideal camera, dark current; then of the patterns under light and in
/// the dark spectrograms, profiles, histograms with the normal law, and accumulated histograms.
pub fn camera_page(camera: &MeasuredCamera) -> Plot {
    let mut panels = vec![
        transfer(camera),
        sensitivity(camera),
        linearity(camera),
        deviation(camera),
        signal_to_noise(camera),
        dark_current(camera),
    ];
    panels.extend(pattern_panels(camera));
    panels.retain(|panel| !panel.series.is_empty());
    let title = format!("Photon transfer of {}", camera.list);
    let mut panels = panels.into_iter();
    let first = panels.next().unwrap_or_else(|| Panel::new(Axis::linear(""), Axis::linear("")));
    let mut plot = Plot::new(&title, first);
    plot.panels.extend(panels);
    plot.arrangement = Arrangement::Pairs;
    plot
}

fn classes(camera: &MeasuredCamera) -> impl Iterator<Item = (&ClassFindings, Color)> {
    camera.classes.iter().enumerate().map(|(index, class)| (class, color(&class.name, index)))
}

fn titled(title: &str, x: Axis, y: Axis) -> Panel {
    Panel { title: title.into(), ..Panel::new(x, y) }
}

/// Whether light is told by photons rather than by exposure times; none where it is not told, or one time is that of all.
fn light(camera: &MeasuredCamera) -> Option<bool> {
    let points = || camera.classes.iter().flat_map(|class| &class.curve);
    if points().any(|point| point.photons.is_some()) {
        return Some(true);
    }
    let times = || points().filter_map(|point| point.exposure_s);
    let first = times().next()?;
    times().any(|time| (time - first).abs() > 1e-6 * first).then_some(false)
}

fn light_of(point: &CurvePoint, by_photons: bool) -> Option<f64> {
    if by_photons { point.photons } else { point.exposure_s }
}

fn light_axis(by_photons: bool) -> Axis {
    Axis::linear(if by_photons { "photons per photosite" } else { "exposure time / s" })
}

fn transfer(camera: &MeasuredCamera) -> Panel {
    let mut panel = titled(
        "Photon transfer",
        Axis::linear("signal above dark / ADU"),
        Axis::linear("temporal variance above dark / ADU\u{B2}"),
    );
    let mut others = Vec::new();
    for (class, color) in classes(camera) {
        let [fitted, rest] = [true, false].map(|is_fitted| {
            let wanted = class.curve.iter().filter(|point| point.is_fitted == is_fitted);
            wanted.map(|point| [point.signal_adu, point.variance_adu2]).collect::<Vec<_>>()
        });
        let most = fitted.iter().map(|[signal, _]| *signal).fold(0.0, f64::max);
        let gain = class.values.map(|values| values.gain);
        let name = gain.map_or_else(|| class.name.clone(), |gain| format!("{}, K {gain:.5}", class.name));
        others.extend(rest);
        panel.add(&name, color, Marks::Points(fitted));
        if let Some(gain) = gain {
            panel.add("", color, Marks::Line(vec![[0.0, 0.0], [most, gain * most]]));
        }
    }
    if !others.is_empty() {
        panel.add("not fitted", Color::Gray, Marks::Points(others));
    }
    panel
}

fn sensitivity(camera: &MeasuredCamera) -> Panel {
    let by_photons = light(camera);
    let mut panel =
        titled("Sensitivity", light_axis(by_photons.unwrap_or(true)), Axis::linear("signal above dark / ADU"));
    let Some(by_photons) = by_photons else { return panel };
    for (class, color) in classes(camera) {
        let at = |point: &CurvePoint| Some([light_of(point, by_photons)?, point.signal_adu]);
        let responsivity = class.values.and_then(|values| values.responsivity).filter(|_| by_photons);
        let name =
            responsivity.map_or_else(|| class.name.clone(), |of_light| format!("{}, R {of_light:.5}", class.name));
        panel.add(&name, color, Marks::Points(class.curve.iter().filter_map(at).collect()));
        if let Some(responsivity) = responsivity {
            let most = class.curve.iter().filter(|point| point.is_fitted).filter_map(|p| p.photons).fold(0.0, f64::max);
            panel.add("", color, Marks::Line(vec![[0.0, 0.0], [most, responsivity * most]]));
        }
    }
    panel
}

fn linearity(camera: &MeasuredCamera) -> Panel {
    let by_photons = light(camera).unwrap_or(true);
    let mut panel = titled("Linearity", light_axis(by_photons), Axis::linear("signal above dark / ADU"));
    for (class, color) in classes(camera) {
        let Some(linearity) = &class.linearity else { continue };
        let [low, high] =
            [linearity.deviations.first(), linearity.deviations.last()].map(|end| end.map_or(0.0, |[light, _]| *light));
        let within = class.curve.iter().filter_map(|point| Some([light_of(point, by_photons)?, point.signal_adu]));
        let within = within.filter(|[light, _]| (low..=high).contains(light));
        panel.add(&format!("{}, 5 to 95 % of saturation", class.name), color, Marks::Points(within.collect()));
        let line = [low, high].map(|light| [light, linearity.line.at(light)]);
        panel.add("", color, Marks::Line(line.to_vec()));
    }
    panel
}

fn deviation(camera: &MeasuredCamera) -> Panel {
    let axis = light_axis(light(camera).unwrap_or(true));
    let mut panel = titled("Deviation from linearity", axis, Axis::linear("deviation from the line / %"));
    for (class, color) in classes(camera) {
        if let Some(linearity) = &class.linearity {
            let deviations = linearity.deviations.iter().map(|[light, deviation]| [*light, 100.0 * deviation]);
            panel.add(&class.name, color, Marks::LineAndPoints(deviations.collect()));
        }
    }
    if !panel.series.is_empty() {
        panel.horizontal_lines.push(ReferenceLine { at: 0.0, label: String::new() });
    }
    panel
}

/// Signal over temporal noise of levels that are not clipped, with the law of the numbers that were measured, and without any noise
/// but that of light.
fn signal_to_noise(camera: &MeasuredCamera) -> Panel {
    let mut panel =
        titled("Signal-to-noise ratio", Axis::log10("signal / e\u{207B}"), Axis::log10("signal-to-noise ratio"));
    let mut ends: Option<[f64; 2]> = None;
    for (class, color) in classes(camera) {
        let Some(values) = class.values else { continue };
        let dark = values.dark_variance.unwrap_or(0.0);
        let most = class.get("saturation_e").map_or(f64::INFINITY, |saturation| saturation.value);
        let electrons = |point: &CurvePoint| point.signal_adu / values.gain;
        let is_whole = |point: &&CurvePoint| {
            point.signal_adu > 0.0
                && point.variance_adu2 + dark > 0.0
                && point.clipped <= CLIPPED
                && electrons(point) <= most
        };
        let shown: Vec<[f64; 2]> = class
            .curve
            .iter()
            .filter(is_whole)
            .map(|point| [electrons(point), point.signal_adu / (point.variance_adu2 + dark).sqrt()])
            .collect();
        let (low, high) =
            shown.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), [x, _]| (low.min(*x), high.max(*x)));
        if shown.is_empty() {
            continue;
        }
        let low = class.get("threshold_e").map_or(low, |threshold| threshold.value.min(low));
        let high = if most.is_finite() { most.max(high) } else { high };
        let (from, to) = ends.map_or((low, high), |[from, to]| (from.min(low), to.max(high)));
        ends = Some([from, to]);
        let noise = dark / (values.gain * values.gain);
        let law = |signal: f64| [signal, signal / (noise + signal).sqrt()];
        panel.add(&class.name, color, Marks::Points(shown));
        panel.add("", color, Marks::Line(along([low, high]).map(law).collect()));
        // The pattern is noise of a single frame too.
        if let (1, Some(prnu), Some(dsnu)) = (camera.classes.len(), class.get("prnu"), class.get("dsnu_e")) {
            let total = |signal: f64| {
                [signal, signal / (noise + signal + dsnu.value.powi(2) + (prnu.value * signal).powi(2)).sqrt()]
            };
            panel.add("with the pattern", Color::Vermillion, Marks::Dashed(along([low, high]).map(total).collect()));
        }
    }
    if let Some(ends) = ends {
        let ideal = along(ends).map(|signal| [signal, signal.sqrt()]).collect();
        panel.add("ideal", Color::Black, Marks::Dashed(ideal));
    }
    if let [class] = camera.classes.as_slice() {
        panel.regions.extend(dynamic_range(class));
    }
    panel
}

/// From the threshold to saturation.
fn dynamic_range(class: &ClassFindings) -> Option<Region> {
    let [threshold, saturation, range] =
        ["threshold_e", "saturation_e", "dynamic_range"].map(|key| class.get(key).map(|found| found.value));
    let label = format!("dynamic range {:.1} dB", 20.0 * range?.log10());
    Some(Region { from: threshold?, to: saturation?, label, color: Color::SkyBlue })
}

/// Places at equal factors.
fn along([low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    (0..=STEPS).map(move |step| low * (high / low).powf(f64::from(step) / f64::from(STEPS)))
}

/// What darks of several times have above none: signal, and variance in the same unit.
fn dark_current(camera: &MeasuredCamera) -> Panel {
    let mut panel =
        titled("Dark current", Axis::linear("exposure time / s"), Axis::linear("above no exposure / e\u{207B}"));
    for (class, color) in classes(camera) {
        let Some(values) = class.values else { continue };
        let (Some(black), Some(slope)) = (values.dark_mean, values.dark_slope) else { continue };
        let most = class.darks.iter().filter_map(|dark| dark.exposure_s).fold(0.0, f64::max);
        let means =
            class.darks.iter().filter_map(|dark| Some([dark.exposure_s?, (dark.mean_adu - black) / values.gain]));
        panel.add(&format!("{}, mean", class.name), color, Marks::Points(means.collect()));
        panel.add("", color, Marks::Line(vec![[0.0, 0.0], [most, slope / values.gain * most]]));
        let (1, Some(silent), Some(rise)) = (camera.classes.len(), values.dark_variance, values.dark_variance_slope)
        else {
            continue;
        };
        let square = values.gain * values.gain;
        let noise =
            class.darks.iter().filter_map(|dark| Some([dark.exposure_s?, (dark.variance_adu2 - silent) / square]));
        panel.add(&format!("{}, variance", class.name), Color::Vermillion, Marks::Points(noise.collect()));
        panel.add("", Color::Vermillion, Marks::Dashed(vec![[0.0, 0.0], [most, rise / square * most]]));
    }
    panel
}

//! The photon transfer curve: noise against signal, and which cause rules where.

use crate::chain::ChainPrediction;
use crate::plot::{Axis, Color, Marks, Panel, Plot, ReferenceLine, Region};
use crate::propagation::budget::Cause;
use crate::requests::prediction::TransferCurve;

/// Draws the noise of the brightest class in electrons against its signal, one level after another, with the ranges
/// where read-out and dark signal, shot noise, or the fixed pattern of the response is the largest.
pub fn photon_transfer(curve: &TransferCurve) -> Plot {
    let TransferCurve { sensor, class: shown, full_well_e, levels } = curve;
    let class = *shown as usize;
    let signal = |level: &ChainPrediction| level.electrons[class];
    let curve = |noise: &dyn Fn(&ChainPrediction) -> f64| -> Vec<[f64; 2]> {
        levels.iter().map(|level| [signal(level), noise(level)]).collect()
    };
    let part = |causes: &'static [Cause]| {
        move |level: &ChainPrediction| {
            let stage = &level.stages[0];
            let chosen = stage.causes.iter().filter(|entry| causes.contains(&entry.cause));
            chosen.map(|entry| entry.variance[class]).sum::<f64>().sqrt()
        }
    };
    let floor = part(&[Cause::Read, Cause::DarkShot, Cause::Dcnu]);
    let shot = part(&[Cause::SignalShot]);
    let pattern = part(&[Cause::Prnu]);
    let mut panel = Panel::new(Axis::log10("signal / e\u{207B}"), Axis::log10("noise, rms / e\u{207B}"));
    panel.add("all", Color::Black, Marks::Line(curve(&|level| level.stages[0].std[class])));
    panel.add("read-out and dark signal", Color::Vermillion, Marks::Dashed(curve(&floor)));
    panel.add("shot", Color::Blue, Marks::Dashed(curve(&shot)));
    panel.add("fixed pattern", Color::Green, Marks::Dashed(curve(&pattern)));
    let regimes = [("read", Color::Vermillion), ("shot", Color::Blue), ("fixed pattern", Color::Green)];
    let ruling = |level: &ChainPrediction| {
        let noise = [floor(level), shot(level), pattern(level)];
        (0..regimes.len()).max_by(|&a, &b| noise[a].total_cmp(&noise[b])).unwrap_or_default()
    };
    // A regime ends half way, in the logarithm, to the first level of the next.
    let mut start = 0;
    while start < levels.len() {
        let ruler = ruling(&levels[start]);
        let end = (start..levels.len()).find(|&i| ruling(&levels[i]) != ruler).unwrap_or(levels.len());
        let border = |i: usize| (signal(&levels[i - 1]) * signal(&levels[i])).sqrt();
        let (label, color) = regimes[ruler];
        panel.regions.push(Region {
            from: if start == 0 { 0.0 } else { border(start) },
            to: if end == levels.len() { f64::INFINITY } else { border(end) },
            label: label.into(),
            color,
        });
        start = end;
    }
    panel.vertical_lines.push(ReferenceLine { at: *full_well_e, label: "full well".into() });
    Plot::new(&format!("Photon transfer of {sensor}, class {}", shown.letter()), panel)
}

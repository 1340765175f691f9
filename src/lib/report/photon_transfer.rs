//! The photon transfer curve: noise against signal, and which cause rules where.

use crate::chain::ChainPrediction;
use crate::plot::{Axis, Color, Marks, Panel, Plot, ReferenceLine, Region};
use crate::propagation::budget::Cause;
use crate::requests::prediction::TransferCurve;

/// Draws the noise of the brightest class in electrons against its signal, one level after another, with the ranges
/// where read-out and dark signal, shot noise, or the fixed pattern of the response is the largest. What full well clips is
/// dashed and in a range of its own.
pub fn photon_transfer(curve: &TransferCurve) -> Plot {
    let TransferCurve { sensor, class: shown, full_well_e, levels } = curve;
    let class = *shown as usize;
    let signal = |level: &ChainPrediction| level.electrons[class];
    let (held, clipped) = split_where_clipped(levels, class);
    let clip = clipped.first().map_or(f64::INFINITY, signal);
    let curve = |noise: &dyn Fn(&ChainPrediction) -> f64| -> Vec<[f64; 2]> {
        held.iter().map(|level| [signal(level), noise(level)]).collect()
    };
    let part = |causes: &'static [Cause]| {
        move |level: &ChainPrediction| {
            let stage = &level.stages[0];
            let chosen = stage.causes.iter().filter(|entry| causes.contains(&entry.cause));
            chosen.map(|entry| entry.variance[class]).sum::<f64>().sqrt()
        }
    };
    let floor = part(&[
        Cause::Read,
        Cause::RowNoise,
        Cause::ColumnNoise,
        Cause::Dsnu,
        Cause::DsnuRow,
        Cause::DsnuColumn,
        Cause::DarkShot,
        Cause::Dcnu,
        Cause::HotPixels,
        Cause::Rts,
        Cause::BlackDrift,
        Cause::Taps,
    ]);
    let shot = part(&[Cause::SignalShot]);
    let pattern = part(&[Cause::Prnu, Cause::PrnuRow, Cause::PrnuColumn]);
    let mut panel = Panel::new(Axis::log10("signal / e\u{207B}"), Axis::log10("noise, rms / e\u{207B}"));
    let all =
        |levels: &[ChainPrediction]| levels.iter().map(|level| [signal(level), level.stages[0].std[class]]).collect();
    panel.add("all", Color::Black, Marks::Line(all(held)));
    if !clipped.is_empty() {
        panel.add("all, clipped by full well", Color::Black, Marks::Dashed(all(clipped)));
    }
    panel.add("read-out and dark signal", Color::Vermillion, Marks::Dashed(curve(&floor)));
    panel.add("shot", Color::Blue, Marks::Dashed(curve(&shot)));
    panel.add("fixed pattern", Color::Green, Marks::Dashed(curve(&pattern)));
    let regimes = [("read", Color::Vermillion), ("shot", Color::Blue), ("fixed pattern", Color::Green)];
    let ruling = |level: &ChainPrediction| {
        let noise = [floor(level), shot(level), pattern(level)];
        (0..regimes.len()).max_by(|&a, &b| noise[a].total_cmp(&noise[b])).unwrap_or_default()
    };
    panel.regions.extend(regimes_of(held, &signal, &ruling).into_iter().map(|(ruler, from, to)| {
        let (label, color) = regimes[ruler];
        Region { from, to: if clipped.is_empty() { to } else { to.min(clip) }, label: label.into(), color }
    }));
    if !clipped.is_empty() {
        panel.regions.push(Region { from: clip, to: f64::INFINITY, label: "clipped".into(), color: Color::Gray });
    }
    panel.vertical_lines.push(ReferenceLine { at: *full_well_e, label: "full well".into() });
    Plot::new(&format!("Photon transfer of {sensor}, class {}", shown.letter()), panel)
}

/// The levels below the first that full well clips, and the others, with the last of the former.
fn split_where_clipped(levels: &[ChainPrediction], class: usize) -> (&[ChainPrediction], &[ChainPrediction]) {
    /// A share of saturated samples that bends the curve by less than its line is wide.
    const FEW: f64 = 1e-3;
    let is_clipped = |level: &ChainPrediction| level.stages[0].saturated.is_some_and(|shares| shares[class] > FEW);
    let first = levels.iter().position(is_clipped).unwrap_or(levels.len());
    if first == levels.len() { (levels, &[]) } else { (&levels[..first], &levels[first.saturating_sub(1)..]) }
}

/// Which cause rules from where to where. A regime ends half way, in the logarithm, to the first level of the next.
fn regimes_of(
    levels: &[ChainPrediction],
    signal: &dyn Fn(&ChainPrediction) -> f64,
    ruling: &dyn Fn(&ChainPrediction) -> usize,
) -> Vec<(usize, f64, f64)> {
    let border = |i: usize| (signal(&levels[i - 1]) * signal(&levels[i])).sqrt();
    let (mut found, mut start) = (Vec::new(), 0);
    while start < levels.len() {
        let ruler = ruling(&levels[start]);
        let end = (start..levels.len()).find(|&i| ruling(&levels[i]) != ruler).unwrap_or(levels.len());
        let from = if start == 0 { 0.0 } else { border(start) };
        found.push((ruler, from, if end == levels.len() { f64::INFINITY } else { border(end) }));
        start = end;
    }
    found
}

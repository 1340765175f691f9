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
    panel.series.retain(|series| !series.marks.is_empty());
    let regimes = [("read", Color::Vermillion), ("shot", Color::Blue), ("fixed pattern", Color::Green)];
    let noises = |level: &ChainPrediction| [floor(level), shot(level), pattern(level)];
    panel.regions.extend(regimes_of(held, &signal, &noises).into_iter().map(|(ruler, from, to)| {
        let (label, color) = regimes[ruler];
        Region { from, to: if clipped.is_empty() { to } else { to.min(clip) }, label: label.into(), color }
    }));
    if !clipped.is_empty() {
        panel.regions.push(Region { from: clip, to: f64::INFINITY, label: "clipped".into(), color: Color::Gray });
    }
    let of_held: Vec<[f64; 2]> = held.iter().map(|level| [level.stages[0].std[class], floor(level)]).collect();
    if let Some((low, high)) = noise_range(levels, &of_held, class) {
        panel.y = panel.y.range(low, high);
    }
    panel.vertical_lines.push(ReferenceLine { at: *full_well_e, label: "full well".into() });
    Plot::new(&format!("Photon transfer of {sensor}, class {}", shown.letter()), panel)
}

/// The range of noise that matters: from below the least that is not clipped, and what read-out adds to it unless that is next to
/// nothing, to above the largest; where all is clipped, three decades from there. None without noise.
fn noise_range(levels: &[ChainPrediction], held: &[[f64; 2]], class: usize) -> Option<(f64, f64)> {
    const BELOW: f64 = 7.0;
    const ABOVE: f64 = 1.5;
    /// Parts of the least noise, and of the largest, below which nothing matters.
    const NEXT_TO_NOTHING: f64 = 1e-3;
    let least = |values: &mut dyn Iterator<Item = f64>| values.filter(|value| *value > 0.0).reduce(f64::min);
    let highest = levels.iter().map(|level| level.stages[0].std[class]).fold(0.0, f64::max);
    let low = match least(&mut held.iter().map(|[all, _]| *all)) {
        Some(all) => {
            let floor = least(&mut held.iter().map(|[_, floor]| *floor)).filter(|floor| *floor > NEXT_TO_NOTHING * all);
            floor.map_or(f64::INFINITY, |floor| floor / 2.0).min(all / BELOW)
        }
        None => NEXT_TO_NOTHING * highest,
    };
    (highest > 0.0).then_some((low, ABOVE * highest))
}

/// The levels below the first that full well clips, and the others, with the last of the former.
fn split_where_clipped(levels: &[ChainPrediction], class: usize) -> (&[ChainPrediction], &[ChainPrediction]) {
    /// A share of saturated samples that bends the curve by less than its line is wide.
    const FEW: f64 = 1e-3;
    let is_clipped = |level: &ChainPrediction| level.stages[0].saturated.is_some_and(|shares| shares[class] > FEW);
    let first = levels.iter().position(is_clipped).unwrap_or(levels.len());
    if first == levels.len() { (levels, &[]) } else { (&levels[..first], &levels[first.saturating_sub(1)..]) }
}

/// Which cause rules from where to where. A regime ends where the curves of two causes cross, drawn straight in the logarithm from level
/// to level.
fn regimes_of(
    levels: &[ChainPrediction],
    signal: &dyn Fn(&ChainPrediction) -> f64,
    noises: &dyn Fn(&ChainPrediction) -> [f64; 3],
) -> Vec<(usize, f64, f64)> {
    let ruling = |level: &ChainPrediction| {
        let noise = noises(level);
        (0..noise.len()).max_by(|&a, &b| noise[a].total_cmp(&noise[b])).unwrap_or_default()
    };
    let border = |i: usize| {
        let [before, behind] = [&levels[i - 1], &levels[i]];
        if signal(before) <= 0.0 {
            return 0.0;
        }
        let [old, new] = [ruling(before), ruling(behind)];
        let lead = |level: &ChainPrediction| (noises(level)[old] / noises(level)[new]).ln();
        let share = lead(before) / (lead(before) - lead(behind));
        // Where a cause has no noise its curve begins at the next level.
        let share = if (0.0..=1.0).contains(&share) { share } else { 0.5 };
        (signal(before).ln() * (1.0 - share) + signal(behind).ln() * share).exp()
    };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::requests::options::SignalLevel;
    use crate::requests::prediction::{NoisePrediction, Sweep};

    fn panel(sensor: Option<&str>, sweep: Option<&str>) -> Panel {
        let level = SignalLevel { electrons: Some([1.0, 4.0, 2.0]), ..SignalLevel::default() };
        let sweep = sweep.map(|text| Sweep::parse(text).unwrap());
        let mut wanted = NoisePrediction { level, sweep, ..NoisePrediction::default() };
        if let Some(name) = sensor {
            wanted.subject.sensor.sensor = name.into();
        }
        let curve = wanted.run().unwrap().transfer_curve().unwrap();
        photon_transfer(&curve).panels.remove(0)
    }

    /// A sensor without read noise: what full well leaves of its noise beyond is next to nothing, and no axis reaches down to it.
    #[test]
    fn axes_show_what_matters() {
        for (sensor, sweep) in [
            (None, None),
            (Some("imx219"), None),
            (Some("imx219"), Some("10:20000:50log")),
            (None, Some("10:1000:50log")),
            (None, Some("45000:90000:20lin")),
        ] {
            let panel = panel(sensor, sweep);
            let (low, high) = panel.y.range.unwrap();
            assert!(low > 1e-3 && high / low < 1e6, "{sensor:?} {sweep:?}: {low} to {high}");
            let points = |name: &str| {
                let series = panel.series.iter().find(|series| series.name == name);
                series.map_or(Vec::new(), |series| match &series.marks {
                    Marks::Line(points) | Marks::Dashed(points) => points.clone(),
                    _ => Vec::new(),
                })
            };
            for [signal, noise] in points("all") {
                assert!((low..=high).contains(&noise), "{sensor:?} {sweep:?}: {noise} at {signal}");
            }
            // The read noise of the default sensor lies within.
            let read = points("read-out and dark signal").first().map_or(f64::INFINITY, |[_, noise]| *noise);
            assert!(read == 0.0 || low < read, "{low} {read}");
        }
    }

    /// A floor and a noise that grows as the root of the signal are straight in the logarithm: they cross at one place, however few levels
    /// are drawn.
    #[test]
    fn regimes_part_where_curves_cross() {
        let border = |sweep: &str| panel(None, Some(sweep)).regions[0].to;
        let fine = border("10:30000:500log");
        for sweep in ["10:30000:50log", "10:30000:5log", "1:30000:20lin"] {
            assert!((border(sweep) / fine - 1.0).abs() < 1e-3, "{sweep}: {} {fine}", border(sweep));
        }
    }
}

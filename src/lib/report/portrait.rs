//! Figures of a region: its histogram, profiles, autocorrelation and chromaticities beside what is predicted.

use crate::analysis::statistics::RegionReport;
use crate::analysis::statistics::portrait::{Foreseen, Likeness, Portrait};
use crate::color::xyy_about;
use crate::numerics::normal::cumulative;
use crate::plot::{Arrangement, Axis, Color, Marks, Panel, Plot, ReferenceLine};
use crate::units::{QuantityKind, typeset};
use nalgebra::{Matrix2, Matrix3};
use std::f64::consts::TAU;

/// Bins of a histogram are about so many of its standard deviations wide, and reach so many to both sides.
const BIN: f64 = 0.2;
const REACH: f64 = 5.0;
/// How much higher an axis is than what it shows.
const HEADROOM: f64 = 1.08;
/// The share of a normal law of two variables within its ellipse.
const WITHIN: f64 = 0.95;

/// Draws a region of a frame: the histogram of each class or channel with the predicted law, means of columns and rows with the
/// predicted band of ±σ of a mean, the autocorrelation along x and y beside the predicted, and of XYZ the chromaticities with the
/// ellipses of the measured and of the predicted covariance.
pub fn portrait(portrait: &Portrait, region: &RegionReport) -> Plot {
    let unsaid = without_spread(portrait);
    let mut panels = vec![unsaid.map_or_else(|| histogram(portrait), in_words)];
    panels.extend(chromaticity(portrait, region));
    panels.extend((0..2).map(|axis| profile(portrait, axis)));
    if unsaid.is_none() {
        panels.extend((0..2).map(|axis| correlation(portrait, axis)));
    }
    // Panels without a number say nothing.
    let says = |panel: &Panel| !panel.has_axes || panel.series.iter().any(|series| !series.marks.is_empty());
    panels.retain(says);
    let size = format!("{} × {}", portrait.region.width, portrait.region.height);
    let title = format!("{}: {}, {size}", portrait.name(), portrait.holds);
    Plot { title, panels, arrangement: Arrangement::Pairs }
}

/// The color of a class or channel.
fn color(portrait: &Portrait, index: usize) -> Color {
    match portrait.groups.len() {
        3 => [Color::Vermillion, Color::Green, Color::Blue][index],
        _ => Color::of_index(index),
    }
}

/// The unit of a group in brackets behind a name; nothing where it is 1.
fn with_unit(portrait: &Portrait, words: &str) -> String {
    match portrait.unit.as_str() {
        "1" | "unspecified" => words.to_owned(),
        unit => format!("{words} / {}", typeset(unit)),
    }
}

/// Where deviations of a group are counted from: the predicted mean, or that of what was seen.
fn reference(group: &Likeness) -> Option<f64> {
    group.predicted.as_ref().map(|predicted| predicted.mean).or_else(|| group.mean())
}

fn words_of_reference(portrait: &Portrait) -> &'static str {
    if portrait.groups.iter().all(|group| group.predicted.is_some()) {
        "sample − predicted mean"
    } else {
        "sample − mean"
    }
}

/// Why there is no histogram; none where there is one.
fn without_spread(portrait: &Portrait) -> Option<&'static str> {
    if portrait.groups.iter().all(|group| group.mean().is_none()) {
        return Some("No pixel is left to show: all are saturated, marked or no finite numbers.");
    }
    let is_constant = |group: &Likeness| group.std().is_none_or(|std| std <= 0.0);
    let all = portrait.groups.iter().all(is_constant);
    all.then_some("All samples of a class or channel are the same: there is neither a histogram nor a correlation.")
}

/// A panel that only says something.
fn in_words(text: &str) -> Panel {
    let axis = || Axis::linear("").range(0.0, 1.0);
    let mut panel = Panel::new(axis(), axis());
    panel.title = text.into();
    panel.has_axes = false;
    panel
}

fn histogram(portrait: &Portrait) -> Panel {
    let mut panel = Panel::new(
        Axis::linear(&with_unit(portrait, words_of_reference(portrait))),
        Axis::linear(&match portrait.unit.as_str() {
            "1" | "unspecified" => "density".to_owned(),
            unit => format!("share per {}", typeset(unit)),
        }),
    );
    let (mut highest, mut laws) = (0.0_f64, Vec::new());
    for (index, group) in portrait.groups.iter().enumerate() {
        let (Some(reference), Some(std)) = (reference(group), group.std().filter(|std| *std > 0.0)) else { continue };
        #[expect(clippy::cast_possible_truncation, reason = "a few bins; casts saturate")]
        let times = ((BIN * std / group.histogram.width).round() as i64).max(1);
        let bins = group.histogram.merged(times);
        let total = bins.total() as f64;
        let is_shown = |begin: f64| (begin - reference).abs() <= REACH * std + bins.width;
        let (mut steps, mut predicted) = (Vec::new(), Vec::new());
        let shown: Vec<i64> = bins.counts.keys().copied().filter(|bin| is_shown(bins.begin(*bin))).collect();
        let (Some(first), Some(last)) = (shown.first(), shown.last()) else { continue };
        for bin in *first..=*last {
            let (from, to) = (bins.begin(bin), bins.begin(bin + 1));
            let count = bins.counts.get(&bin).copied().unwrap_or(0);
            let density = count as f64 / total / bins.width;
            highest = highest.max(density);
            steps.extend([[from - reference, density], [to - reference, density]]);
            if let Some(foreseen) = &group.predicted {
                let middle = 0.5 * (from + to) - reference;
                predicted.push([middle, share_between(foreseen, portrait.is_whole, from, to) / bins.width]);
            }
        }
        panel.add(&group.name, color(portrait, index), Marks::Line(steps));
        laws.extend(group.predicted.as_ref().map(|foreseen| (words_of_law(foreseen, portrait.is_whole), predicted)));
    }
    for (index, (words, predicted)) in laws.into_iter().enumerate() {
        panel.add(if index == 0 { &words } else { "" }, Color::Black, Marks::Dashed(predicted));
    }
    if highest > 0.0 {
        panel.y = panel.y.range(0.0, HEADROOM * highest);
    }
    panel
}

/// What the predicted law is called.
fn words_of_law(foreseen: &Foreseen, is_whole: bool) -> String {
    let law = if foreseen.stds.len() > 1 { "predicted: normal by phase" } else { "predicted: normal" };
    if is_whole { format!("{law}, rounded") } else { law.to_owned() }
}

/// The predicted share of samples between two edges: of whole numbers that of rounded ones, whose edges lie between codes; there
/// rounding is no part of the spread before.
fn share_between(foreseen: &Foreseen, is_whole: bool, from: f64, to: f64) -> f64 {
    const ROUNDING: f64 = 1.0 / 12.0;
    /// Of samples that all but round to one code.
    const LEAST: f64 = 1e-4;
    let below = |edge: f64| {
        let of = |std: &f64| {
            let variance = if is_whole { (std * std - ROUNDING).max(LEAST) } else { std * std };
            cumulative((edge - foreseen.mean) / variance.sqrt())
        };
        foreseen.stds.iter().map(of).sum::<f64>() / foreseen.stds.len() as f64
    };
    below(to) - below(from)
}

/// Means of columns (axis 0) or rows (axis 1).
fn profile(portrait: &Portrait, axis: usize) -> Panel {
    let one = ["column", "row"][axis];
    let along = match portrait.groups.first().map_or(1, |group| group.profiles[axis].step) {
        1 => one.to_owned(),
        step => format!("{one}, {step} together"),
    };
    let words = words_of_reference(portrait).replace("sample", "mean").replace("− mean", "− that of all");
    let mut panel = Panel::new(Axis::linear(&along), Axis::linear(&with_unit(portrait, &words)));
    let mut bands = Vec::new();
    for (index, group) in portrait.groups.iter().enumerate() {
        let Some(reference) = reference(group) else { continue };
        let points: Vec<[f64; 2]> = group.profiles[axis].points().map(|[at, mean]| [at, mean - reference]).collect();
        let Some(([first, _], [last, _])) = points.first().copied().zip(points.last().copied()) else { continue };
        panel.add("", color(portrait, index), Marks::Line(points));
        let band = group.predicted.as_ref().and_then(|foreseen| foreseen.profile_std);
        bands.extend(band.map(|stds| (color(portrait, index), stds[axis], [first, last])));
    }
    if !bands.is_empty() {
        // For the legend: each class or channel has its own, in its color.
        panel.add("predicted ±σ of a mean", Color::Black, Marks::Dashed(Vec::new()));
    }
    for (color, std, [first, last]) in bands {
        for bound in [std, -std] {
            panel.add("", color, Marks::Dashed(vec![[first, bound], [last, bound]]));
        }
    }
    panel
}

/// Correlations along x (axis 0) or y (axis 1).
fn correlation(portrait: &Portrait, axis: usize) -> Panel {
    /// How far groups stand beside each other, as a part of the distance of lags.
    const APART: f64 = 0.14;
    let label = ["distance along x / pixels", "distance along y / pixels"][axis];
    let mut panel = Panel::new(Axis::linear(label), Axis::linear("correlation"));
    let mut lines: Vec<(Color, Vec<[f64; 2]>)> = Vec::new();
    for (index, group) in portrait.groups.iter().enumerate() {
        let correlations = &group.correlations[axis];
        let Some(step) = correlations.first().map(|first| first.lag as f64) else { continue };
        let beside = APART * step * (index as f64 - 0.5 * (portrait.groups.len() - 1) as f64);
        let seen = || correlations.iter().filter_map(|one| Some((one.lag as f64 + beside, one.value?, one.error)));
        panel.add(
            &group.name,
            color(portrait, index),
            Marks::Points(seen().map(|(lag, value, _)| [lag, value]).collect()),
        );
        let bars = seen().map(|(lag, value, error)| [lag, value - error, value + error]).collect();
        panel.add("", color(portrait, index), Marks::ErrorBars(bars));
        if let Some(foreseen) = group.predicted.as_ref().and_then(|predicted| predicted.correlations.as_ref()) {
            let at = |(lag, value): (usize, &f64)| [(lag + 1) as f64 * step, *value];
            let line = foreseen[axis].iter().enumerate().map(at).collect();
            lines.push((color(portrait, index), line));
        }
    }
    let ends = panel.series.iter().flat_map(|series| match &series.marks {
        Marks::ErrorBars(bars) => bars.clone(),
        _ => Vec::new(),
    });
    let [low, high] =
        ends.fold([0.0, 0.0], |[low, high], [_, below, above]| [f64::min(low, below), f64::max(high, above)]);
    if !lines.is_empty() {
        panel.add("predicted", Color::Black, Marks::Dashed(Vec::new()));
    }
    for (color, line) in lines {
        panel.add("", color, Marks::Dashed(line));
    }
    panel.y = panel.y.range(low - 0.05 * (high - low), low + HEADROOM * (high - low));
    panel.horizontal_lines.push(ReferenceLine { at: 0.0, label: String::new() });
    panel
}

/// Chromaticities of pixels of XYZ, and the ellipses that hold 95 % of normal ones.
fn chromaticity(portrait: &Portrait, region: &RegionReport) -> Option<Panel> {
    if portrait.quantity != QuantityKind::Xyz || portrait.groups.len() != 3 {
        return None;
    }
    let mut panel = Panel::new(Axis::linear("x"), Axis::linear("y"));
    panel.equal_scale = true;
    let place = |[x, y, z]: [f64; 3]| [x / (x + y + z), y / (x + y + z)];
    let pixels: Vec<[f64; 2]> = portrait.pixels.iter().copied().map(place).collect();
    panel.add(&format!("{} of the pixels", pixels.len()), Color::SkyBlue, Marks::Points(pixels));
    let measured = portrait.groups.iter().map(Likeness::mean).collect::<Option<Vec<_>>>();
    let covariance = region.covariance.as_deref();
    let ellipses = [
        ("measured, 95 %", Color::Blue, measured.as_deref(), covariance),
        (
            "predicted, 95 %",
            Color::Vermillion,
            portrait
                .groups
                .iter()
                .map(|group| Some(group.predicted.as_ref()?.mean))
                .collect::<Option<Vec<_>>>()
                .as_deref(),
            region.predicted_covariance.as_deref(),
        ),
    ]
    .map(|(name, color, mean, covariance)| Some((name, color, ellipse(mean?, covariance?)?)));
    for (name, color, points) in ellipses.into_iter().flatten() {
        let marks = if color == Color::Blue { Marks::Line(points) } else { Marks::Dashed(points) };
        panel.add(name, color, marks);
    }
    Some(panel)
}

/// The ellipse of chromaticities about a mean of XYZ with a covariance, to first order.
///
/// With Σ′ = J Σ Jᵀ of x, y and its root L Lᵀ = Σ′, points are those of the mean and √(−2 ln 0.05) L (cos φ, sin φ).
fn ellipse(mean: &[f64], covariance: &[Vec<f64>]) -> Option<Vec<[f64; 2]>> {
    const POINTS: u32 = 72;
    let about = xyy_about([*mean.first()?, *mean.get(1)?, *mean.get(2)?])?;
    let known = covariance.iter().take(3).all(|row| row.len() >= 3) && covariance.len() >= 3;
    let covariance = known.then(|| Matrix3::from_fn(|i, j| covariance[i][j]))?;
    let spread = about.jacobian * covariance * about.jacobian.transpose();
    let root = Matrix2::new(spread[(0, 0)], spread[(0, 1)], spread[(1, 0)], spread[(1, 1)]).cholesky()?.l();
    let radius = (-2.0 * (1.0 - WITHIN).ln()).sqrt();
    let point = |step: u32| {
        let angle = TAU * f64::from(step) / f64::from(POINTS);
        let [dx, dy] = (root * nalgebra::Vector2::new(angle.cos(), angle.sin()) * radius).into();
        [about.value[0] + dx, about.value[1] + dy]
    };
    Some((0..=POINTS).map(point).collect())
}

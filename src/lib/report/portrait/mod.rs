//! Figures of a region: its histogram, profiles, autocorrelation and chromaticities beside what is predicted.

use super::in_digits;
use crate::analysis::statistics::RegionReport;
use crate::analysis::statistics::histogram::Histogram;
use crate::analysis::statistics::portrait::{Foreseen, Likeness, Portrait};
use crate::color::xyy_about;
use crate::numerics::normal::cumulative;
use crate::plot::{Arrangement, Axis, Color, Marks, Panel, Plot, ReferenceLine};
use crate::units::{QuantityKind, typeset};
use nalgebra::{Matrix2, Matrix3};
use std::f64::consts::TAU;

/// The middle of a histogram leaves out this share of the samples at each end; what is shown reaches this part of its width
/// beyond: of a normal law 2.6 and 5.2 standard deviations.
const LEFT_OUT: f64 = 0.005;
const BEYOND: f64 = 0.5;
/// So many bins make the middle; of a normal law they are about 0.2 standard deviations wide.
const BINS: f64 = 26.0;
/// Rows or columns far from all others are few up to this part of them; pixels are few that are so dim that the quotients which
/// chromaticities are scatter without end.
const FEW_LINES: f64 = 0.05;
const FEW_PIXELS: f64 = 0.25;
/// How much higher an axis is than what it shows.
const HEADROOM: f64 = 1.08;
/// The share of a normal law of two variables within its ellipse.
const WITHIN: f64 = 0.95;

/// Draws a region of a frame: the histogram of each class or channel with the predicted law, means of columns and rows with the
/// predicted band of ±σ of a mean, the autocorrelation along x and y beside the predicted, and of XYZ the chromaticities with the
/// ellipses of the measured and of the predicted covariance.
///
/// Channels of several units have panels of their own. A few samples far from all others do not make the scale; a panel says how
/// many lie outside.
pub fn portrait(portrait: &Portrait, region: &RegionReport) -> Plot {
    let unsaid = without_spread(portrait);
    let scales = scales(portrait);
    let mut panels: Vec<Panel> = match unsaid {
        Some(text) => vec![in_words(text)],
        None => scales.iter().map(|scale| histogram(portrait, scale)).collect(),
    };
    panels.extend(chromaticity(portrait, region));
    panels.extend(scales.iter().flat_map(|scale| (0..2).map(move |axis| profile(portrait, scale, axis))));
    if unsaid.is_none() {
        panels.extend((0..2).map(|axis| correlation(portrait, axis)));
    }
    // Panels without a number say nothing.
    let says = |panel: &Panel| !panel.has_axes || panel.series.iter().any(|series| !series.marks.is_empty());
    panels.retain(says);
    let size = format!("{} × {}", portrait.region.width, portrait.region.height);
    let left_out = left_out(portrait, region).map_or(String::new(), |words| format!("; {words}"));
    let title = format!("{}: {}, {size}{left_out}", portrait.name(), portrait.holds);
    Plot { title, panels, arrangement: Arrangement::Pairs }
}

/// What of the pixels of a region is not shown, in words; none where all are.
fn left_out(portrait: &Portrait, region: &RegionReport) -> Option<String> {
    let all = (portrait.region.width * portrait.region.height) as f64;
    let without = match portrait.quantity {
        QuantityKind::Cct => "have no CCT",
        _ => "are not finite",
    };
    let saturated = if region.leaves_saturated_out { region.saturated } else { 0 };
    let others = region.defective.max(region.corrected) + region.beyond_model;
    let parts: Vec<String> = [(region.not_finite, without), (saturated, "saturated"), (others, "marked")]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{} % {what}", in_digits(100.0 * count as f64 / all, 2)))
        .collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

/// Classes or channels that share an axis, by their places, and its unit; empty where it is 1.
struct Scale {
    places: Vec<usize>,
    unit: String,
}

impl Scale {
    /// The unit behind words.
    fn with_unit(&self, words: &str) -> String {
        if self.unit.is_empty() { words.to_owned() } else { format!("{words} / {}", self.unit) }
    }

    /// The classes or channels, with the color of each.
    fn groups<'a>(&self, portrait: &'a Portrait) -> impl Iterator<Item = (Color, &'a Likeness)> {
        self.places.iter().map(|place| (color(portrait, *place), &portrait.groups[*place]))
    }
}

/// One scale for all classes or channels, or for each unit.
fn scales(portrait: &Portrait) -> Vec<Scale> {
    let shown = |unit: &str| if ["1", "unspecified"].contains(&unit) { String::new() } else { typeset(unit) };
    let units: Vec<&str> = portrait.unit.split(", ").collect();
    let all = portrait.groups.len();
    if units.len() != all {
        return vec![Scale { places: (0..all).collect(), unit: shown(&portrait.unit) }];
    }
    let mut scales: Vec<Scale> = Vec::new();
    for (place, unit) in units.into_iter().map(shown).enumerate() {
        match scales.iter_mut().find(|scale| scale.unit == unit) {
            Some(scale) => scale.places.push(place),
            None => scales.push(Scale { places: vec![place], unit }),
        }
    }
    scales
}

/// From where to where most values lie where a few are far off: within four times the range of their middle half about it. None
/// where more than `part` of them are, or none.
fn most(values: impl Iterator<Item = f64>, part: f64) -> Option<[f64; 2]> {
    /// Values that are too few to tell.
    const FEW: usize = 8;
    const FENCE: f64 = 4.0;
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    if count < FEW {
        return None;
    }
    let [low, high] = [sorted[count / 4], sorted[count - 1 - count / 4]];
    let reach = FENCE * (high - low);
    sorted.retain(|value| (low - reach..=high + reach).contains(value));
    let far = count - sorted.len();
    let are_few = far > 0 && (far == 1 || far as f64 <= part * count as f64);
    let ends = sorted.first().copied().zip(sorted.last().copied());
    ends.filter(|_| are_few && low < high).map(|(low, high)| [low, high])
}

/// What a panel says of what lies outside it.
fn outside(count: u64, all: u64, what: &str, farthest: f64) -> String {
    if count == 0 {
        return String::new();
    }
    format!("{count} of {all} {what} beyond the axes, as far as {}", in_digits(farthest, 3).replace('-', "−"))
}

/// The color of a class or channel.
fn color(portrait: &Portrait, index: usize) -> Color {
    match portrait.groups.len() {
        3 => [Color::Vermillion, Color::Green, Color::Blue][index],
        _ => Color::of_index(index),
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

fn histogram(portrait: &Portrait, scale: &Scale) -> Panel {
    let density = if scale.unit.is_empty() { "density".to_owned() } else { format!("share per {}", scale.unit) };
    let x = Axis::linear(&scale.with_unit(words_of_reference(portrait)));
    let mut panel = Panel::new(x, Axis::linear(&density));
    let (mut highest, mut heaped, mut laws) = (0.0_f64, 0.0_f64, Vec::new());
    let (mut beyond, mut all, mut farthest) = (0, 0, 0.0_f64);
    let mut piles = Vec::new();
    for (color, group) in scale.groups(portrait) {
        let Some(reference) = reference(group) else { continue };
        let Some([from, to]) = group.histogram.middle(LEFT_OUT) else { continue };
        #[expect(clippy::cast_possible_truncation, reason = "a few bins; casts saturate")]
        let times = (((to - from) / BINS / group.histogram.width).round() as i64).max(1);
        let bins = group.histogram.merged(times);
        let total = bins.total();
        let room = BEYOND * (to - from) + bins.width;
        let is_shown = |bin: i64| (from - room..to + room).contains(&bins.begin(bin));
        let shown: Vec<i64> = bins.counts.keys().copied().filter(|bin| is_shown(*bin)).collect();
        let (Some(first), Some(last)) = (shown.first(), shown.last()) else { continue };
        let (mut steps, mut predicted) = (Vec::new(), Vec::new());
        let pile = Pile::of(&bins);
        for bin in *first..=*last {
            let (from, to) = (bins.begin(bin), bins.begin(bin + 1));
            let density = bins.counts.get(&bin).copied().unwrap_or(0) as f64 / total as f64 / bins.width;
            match pile {
                Some(pile) if pile.bin == bin => heaped = heaped.max(density),
                _ => highest = highest.max(density),
            }
            steps.extend([[from - reference, density], [to - reference, density]]);
            if let Some(foreseen) = group.predicted.as_ref().filter(|_| pile.is_none()) {
                let middle = 0.5 * (from + to) - reference;
                predicted.push([middle, share_between(foreseen, portrait.is_whole, from, to) / bins.width]);
            }
        }
        panel.add(&with_mean(group, reference, &scale.unit), color, Marks::Line(steps));
        piles.extend(pile.map(|pile| pile.words(&group.name)));
        laws.extend(
            group
                .predicted
                .as_ref()
                .filter(|_| pile.is_none())
                .map(|foreseen| (words_of_law(foreseen, portrait.is_whole), predicted)),
        );
        let within: u64 = bins.counts.range(first..=last).map(|(_, count)| count).sum();
        (beyond, all) = (beyond + total - within, all + total);
        let ends = bins.ends.map(|end| end - reference);
        farthest = ends.into_iter().filter(|_| within < total).fold(farthest, farther);
    }
    for (index, (words, predicted)) in laws.into_iter().enumerate() {
        panel.add(if index == 0 { &words } else { "" }, Color::Black, Marks::Dashed(predicted));
    }
    // Heaps alone make the scale themselves.
    if highest == 0.0 {
        piles.clear();
        highest = heaped;
    }
    if highest > 0.0 {
        panel.y = panel.y.range(0.0, HEADROOM * highest);
    }
    let words = outside(beyond, all, "samples", farthest);
    panel.title = [words].into_iter().chain(piles).filter(|words| !words.is_empty()).collect::<Vec<_>>().join("; ");
    panel
}

/// Samples at an end of the range, such as saturated ones, so many that all others would be next to nothing beside them; they
/// reach beyond the axis, and follow no normal law.
#[derive(Debug, Clone, Copy)]
struct Pile {
    bin: i64,
    is_highest: bool,
    share: f64,
}

impl Pile {
    fn of(bins: &Histogram) -> Option<Self> {
        /// So many times as high as any other bin.
        const HIGH: u64 = 3;
        let (&first, &last) = (bins.counts.keys().next()?, bins.counts.keys().next_back()?);
        let count = |bin: i64| bins.counts.get(&bin).copied().unwrap_or(0);
        let others = |end: i64| bins.counts.iter().filter(|(bin, _)| **bin != end).map(|(_, count)| *count).max();
        let is_high = |end: i64| others(end).is_none_or(|others| count(end) > HIGH * others);
        let end = [last, first].into_iter().find(|end| is_high(*end))?;
        let share = count(end) as f64 / bins.total() as f64;
        Some(Self { bin: end, is_highest: end == last, share })
    }

    fn words(self, name: &str) -> String {
        let end = if self.is_highest { "highest" } else { "lowest" };
        format!("{} % of {name} in its {end} bin, beyond the axis", in_digits(100.0 * self.share, 2))
    }
}

/// The name of a class or channel with the mean that deviations are counted from.
fn with_mean(group: &Likeness, mean: f64, unit: &str) -> String {
    let mean = in_digits(mean, 5).replace('-', "−");
    format!("{}, mean {mean} {unit}", group.name).trim_end().to_owned()
}

/// Of two deviations the larger.
fn farther(one: f64, other: f64) -> f64 {
    if other.abs() > one.abs() { other } else { one }
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

/// Means of columns (axis 0) or rows (axis 1); nothing of a single one.
fn profile(portrait: &Portrait, scale: &Scale, axis: usize) -> Panel {
    let one = ["column", "row"][axis];
    let along = match portrait.groups.first().map_or(1, |group| group.profiles[axis].step) {
        1 => one.to_owned(),
        step => format!("{one}, {step} together"),
    };
    let words = words_of_reference(portrait).replace("sample", "mean").replace("− mean", "− that of all");
    let mut panel = Panel::new(Axis::linear(&along), Axis::linear(&scale.with_unit(&words)));
    // Columns and rows are those of the frame.
    let corner = [portrait.region.x, portrait.region.y][axis] as f64;
    let (mut bands, mut means) = (Vec::new(), Vec::new());
    for (color, group) in scale.groups(portrait) {
        let Some(reference) = reference(group) else { continue };
        let points: Vec<[f64; 2]> =
            group.profiles[axis].points().map(|[at, mean]| [corner + at, mean - reference]).collect();
        let [[first, _], .., [last, _]] = points[..] else { continue };
        means.extend(points.iter().map(|[_, mean]| *mean));
        panel.add(&group.name, color, Marks::Line(points));
        let band = group.predicted.as_ref().and_then(|foreseen| foreseen.profile_std);
        bands.extend(band.map(|stds| (color, stds[axis], [first, last])));
    }
    if let Some([low, high]) = most(means.iter().copied(), FEW_LINES) {
        const MARGIN: f64 = 0.05;
        let widest = bands.iter().map(|(_, std, _)| *std).fold(0.0, f64::max);
        let [low, high] = [f64::min(low, -widest), f64::max(high, widest)];
        let margin = MARGIN * (high - low);
        let far = means.iter().copied().filter(|mean| !(low - margin..=high + margin).contains(mean));
        let farthest = far.clone().fold(0.0, farther);
        panel.title = outside(far.count() as u64, means.len() as u64, &format!("means of {one}s"), farthest);
        panel.y = panel.y.range(low, high).widened(MARGIN);
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

/// Correlations along x (axis 0) or y (axis 1); nothing where there are no pairs.
fn correlation(portrait: &Portrait, axis: usize) -> Panel {
    /// How far groups stand beside each other, as a part of the distance of lags.
    const APART: f64 = 0.14;
    let label = ["distance along x / pixels", "distance along y / pixels"][axis];
    let mut panel = Panel::new(Axis::linear(label), Axis::linear("correlation"));
    let mut lines: Vec<(Color, Vec<[f64; 2]>)> = Vec::new();
    for (index, group) in portrait.groups.iter().enumerate() {
        let correlations = &group.correlations[axis];
        let Some(step) = correlations.first().map(|first| first.lag as f64) else { continue };
        if correlations.iter().all(|one| one.value.is_none()) {
            continue;
        }
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
    let is_place = |place: &[f64; 2]| place.iter().all(|coordinate| coordinate.is_finite());
    let pixels: Vec<[f64; 2]> = portrait.pixels.iter().copied().map(place).filter(is_place).collect();
    if pixels.is_empty() {
        return None;
    }
    let ranges = [0, 1].map(|axis| most(pixels.iter().map(|pixel| pixel[axis]), FEW_PIXELS));
    panel.add(&format!("{} of the pixels", pixels.len()), Color::SkyBlue, Marks::Points(pixels.clone()));
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
    keep_most(&mut panel, &pixels, ranges);
    Some(panel)
}

/// Ends the axes of chromaticities where those of most pixels end, or the ellipses, where a few pixels are far off.
fn keep_most(panel: &mut Panel, pixels: &[[f64; 2]], ranges: [Option<[f64; 2]>; 2]) {
    if ranges.iter().all(Option::is_none) {
        return;
    }
    let ellipses: Vec<[f64; 2]> = panel
        .series
        .iter()
        .filter_map(|series| match &series.marks {
            Marks::Line(points) | Marks::Dashed(points) => Some(points.clone()),
            _ => None,
        })
        .flatten()
        .collect();
    let range = |axis: usize| {
        let own = ranges[axis].unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
        let others = if ranges[axis].is_some() { [].iter() } else { pixels.iter() };
        let all = ellipses.iter().chain(others).map(|point| point[axis]).filter(|value| value.is_finite());
        let [low, high] = all.fold(own, |[low, high], value| [low.min(value), high.max(value)]);
        let room = 0.05 * (high - low);
        [low - room, high + room]
    };
    let [x, y] = [range(0), range(1)];
    let is_within = |pixel: &&[f64; 2]| (x[0]..=x[1]).contains(&pixel[0]) && (y[0]..=y[1]).contains(&pixel[1]);
    let far = pixels.len() - pixels.iter().filter(is_within).count();
    panel.x = panel.x.clone().range(x[0], x[1]);
    panel.y = panel.y.clone().range(y[0], y[1]);
    panel.title = if far > 0 { format!("{far} of {} pixels beyond the axes", pixels.len()) } else { String::new() };
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

//! Figures of a region: its histogram, profiles, autocorrelation and chromaticities beside what is predicted.

mod histogram;
mod scale;

use crate::analysis::statistics::RegionReport;
use crate::analysis::statistics::portrait::{Likeness, Portrait};
use crate::color::xyy_about;
use crate::plot::{Arrangement, Axis, Color, Marks, Panel, Plot, ReferenceLine};
use crate::text::percent;
use crate::units::QuantityKind;
use histogram::histogram;
use nalgebra::{Matrix2, Matrix3};
use scale::{HEADROOM, Scale, apart, color, farther, outside, reference, scales, words_of_reference};
use std::f64::consts::TAU;

/// Rows or columns far from all others are few up to this part of them; pixels are few that are so dim that the quotients which
/// chromaticities are scatter without end.
const FEW_LINES: f64 = 0.05;
const FEW_PIXELS: f64 = 0.25;
/// The axis of a profile reaches to so many steps of a sample, a 32-bit float, at least: less is their rounding.
const FINEST_STEPS: f64 = 8.0;
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
        .map(|(count, what)| format!("{} % {what}", percent(count as f64 / all, 2)))
        .collect();
    (!parts.is_empty()).then(|| parts.join(", "))
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
    let mut finest = 0.0_f64;
    for (color, group) in scale.groups(portrait) {
        let Some(reference) = reference(group) else { continue };
        finest = finest.max(f64::from(f32::EPSILON) * reference.abs());
        let points: Vec<[f64; 2]> =
            group.profiles[axis].points().map(|[at, mean]| [corner + at, deviation(mean, reference)]).collect();
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
    let extremes = means.iter().copied().chain(bands.iter().map(|(_, std, _)| *std)).fold(0.0, farther).abs();
    if extremes > 0.0 && extremes < FINEST_STEPS * finest {
        panel.y = panel.y.range(-FINEST_STEPS * finest, FINEST_STEPS * finest);
    }
    if !bands.is_empty() {
        // For the legend: each class or channel has its own, in its color.
        panel.add("predicted ±σ of a mean", Color::Black, Marks::Dashed(Vec::new()));
    }
    let widest = bands.iter().map(|(_, std, _)| *std).fold(0.0, f64::max);
    let upper = bands.into_iter().map(|(color, std, [first, last])| (color, vec![[first, std], [last, std]])).collect();
    for (color, line) in apart(upper, widest) {
        let lower = line.iter().map(|[at, std]| [*at, -std]).collect();
        panel.add("", color, Marks::Dashed(line));
        panel.add("", color, Marks::Dashed(lower));
    }
    panel
}

/// A mean less that of all: 0 where the two are alike but for the rounding of their sums.
fn deviation(mean: f64, reference: f64) -> f64 {
    const ROUNDING: f64 = 1e-12;
    let deviation = mean - reference;
    if deviation.abs() <= ROUNDING * reference.abs() { 0.0 } else { deviation }
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
    for (color, line) in apart(lines, high - low) {
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
    end_axes(&mut panel, &pixels, ranges);
    Some(panel)
}

/// Ends the axes of chromaticities where those of most pixels end, or the ellipses, where a few pixels are far off; both are of one scale, and
/// neither is much shorter than the other.
fn end_axes(panel: &mut Panel, pixels: &[[f64; 2]], ranges: [Option<[f64; 2]>; 2]) {
    /// A panel of less has no room for its legend and numbers.
    const LEAST: f64 = 0.7;
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
    let own = [range(0), range(1)];
    let longest = own.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    let [x, y] = own.map(|[low, high]| {
        let room = (0.5 * (LEAST * longest - (high - low))).max(0.0);
        [low - room, high + room]
    });
    if longest <= 0.0 {
        return;
    }
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

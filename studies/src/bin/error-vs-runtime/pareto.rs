//! Choices on a plane of run time and error, and the front of those that no other beats.

use cyanometer::plot::{Axis, Color, Marks, Panel, Series};

/// A setting that a user may choose.
#[derive(Clone)]
pub struct Choice {
    /// What stands beside its point; may be empty.
    pub label: String,
    /// Run time.
    pub time: f64,
    /// Error.
    pub error: f64,
}

impl Choice {
    /// A choice.
    pub fn new(label: impl Into<String>, time: f64, error: f64) -> Self {
        Self { label: label.into(), time, error }
    }
}

/// Choices that look alike in a plot.
#[derive(Clone)]
pub struct Group {
    /// What the legend says.
    pub name: String,
    /// The choices.
    pub choices: Vec<Choice>,
}

impl Group {
    /// A group.
    pub fn new(name: impl Into<String>, choices: Vec<Choice>) -> Self {
        Self { name: name.into(), choices }
    }
}

/// The choices that no other beats in time without being worse in error, from fast to slow.
pub fn front<'a>(choices: impl Iterator<Item = &'a Choice>) -> Vec<&'a Choice> {
    let mut sorted: Vec<&Choice> = choices.filter(|choice| choice.error.is_finite()).collect();
    sorted.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.error.total_cmp(&b.error)));
    let mut best = f64::INFINITY;
    sorted.retain(|choice| {
        let is_better = choice.error < best;
        best = best.min(choice.error);
        is_better
    });
    sorted
}

/// A panel of choices with their front. Errors below `foot` are shown there: a logarithmic axis has no zero.
pub fn panel(title: &str, [time, error]: [&str; 2], groups: &[Group], foot: f64) -> Panel {
    let shown = |choice: &Choice| [choice.time, choice.error.max(foot)];
    let all = || groups.iter().flat_map(|group| &group.choices).filter(|choice| choice.error.is_finite());
    let range = |place: usize| {
        let (low, high) = all().map(shown).fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), point| {
            (low.min(point[place]), high.max(point[place]))
        });
        // Room for labels.
        let room = (high / low).max(3.0).powf(0.1);
        (low / room, high * room)
    };
    let (x, y) = (range(0), range(1));
    let mut panel = Panel::new(Axis::log10(time).range(x.0, x.1), Axis::log10(error).range(y.0, y.1));
    panel.title = title.into();
    // A staircase: what is reached within a time.
    let mut steps: Vec<[f64; 2]> = Vec::new();
    for choice in front(all()) {
        let [time, error] = shown(choice);
        if let Some(&[_, above]) = steps.last() {
            steps.push([time, above]);
        }
        steps.push([time, error]);
    }
    if let (Some(&[_, last]), Some(&[first, _])) = (steps.last(), steps.first()) {
        steps.insert(0, [first, y.1]);
        steps.push([x.1, last]);
    }
    for (index, group) in groups.iter().enumerate() {
        panel.add(&group.name, Color::of_index(index), Marks::Points(group.choices.iter().map(shown).collect()));
    }
    // Names on the front find their places first.
    let is_best = |choice: &Choice| front(all()).iter().any(|best| std::ptr::eq(*best, choice));
    let colors = (0..).map(Color::of_index);
    let named = groups.iter().zip(colors).flat_map(|(group, color)| group.choices.iter().map(move |c| (c, color)));
    let named = named.filter(|(choice, _)| choice.error.is_finite() && !choice.label.is_empty());
    let (mut first, others): (Vec<_>, Vec<_>) = named.partition(|(choice, _)| is_best(choice));
    first.extend(others);
    for (choice, color) in first {
        panel.name(shown(choice), &choice.label, color);
    }
    panel.series.insert(0, Series { name: "Pareto front".into(), color: Color::Gray, marks: Marks::Line(steps) });
    panel
}

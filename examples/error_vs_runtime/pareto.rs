//! Choices on a plane of run time and error, and the front of those that no other beats.

use cyanometer::report::plot::{Arrow, Axis, Color, Marks, Panel};

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
pub fn panel(title: &str, time: &str, error: &str, groups: &[Group], foot: f64) -> Panel {
    let shown = |choice: &Choice| [choice.time, choice.error.max(foot)];
    let all = || groups.iter().flat_map(|group| &group.choices).filter(|choice| choice.error.is_finite());
    let range = |place: usize| {
        let (low, high) = all().map(shown).fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), point| {
            (low.min(point[place]), high.max(point[place]))
        });
        // Room for labels, more where decades are few.
        let room = (high / low).max(10.0).powf(0.1);
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
    panel.add("Pareto front", Color::Gray, Marks::Line(steps));
    for (index, group) in groups.iter().enumerate() {
        let color = Color::of_index(index);
        panel.add(&group.name, color, Marks::Points(group.choices.iter().map(shown).collect()));
        for choice in group.choices.iter().filter(|choice| !choice.label.is_empty() && choice.error.is_finite()) {
            // An arrow of no length is a label at its place.
            let at = shown(choice);
            panel.arrows.push(Arrow { from: at, to: at, label: choice.label.clone(), color });
        }
    }
    panel
}

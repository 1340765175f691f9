//! What can be said of a panel before its place is known: its rulers, and the room that labels need about its frame.

use super::figure::Panel;
use super::font;
use super::legend::Legend;
use super::ruler::{Ruler, Tick};
use super::style::{FOOT, LABEL, LINE, MARGIN, RIGHT, TEXT, TICK};

/// A panel's rulers and margins.
pub(super) struct Room<'a> {
    pub x: Ruler,
    pub y: Ruler,
    pub top_labels: Vec<TopLabel<'a>>,
    /// To the left of the frame, for ticks and the label.
    pub left: f64,
    /// Above the frame, for the title and labels.
    pub top: f64,
    /// Below the frame, for ticks' labels and the axis's.
    pub bottom: f64,
    /// The legend, where it stands between the title and the labels above the frame.
    pub legend: Option<Legend<'a>>,
    /// How far the title and the legend reach down.
    pub head: f64,
    /// The title, in as many lines as the cell needs.
    pub title: Vec<String>,
}

/// A label above the frame.
pub(super) struct TopLabel<'a> {
    pub text: &'a str,
    /// The middle of what it names, from 0 to 1.
    middle: f64,
}

impl<'a> Room<'a> {
    /// Measures a panel for a cell of some size.
    pub fn new(panel: &'a Panel, cell_width: f64, cell_height: f64) -> Self {
        let x = Ruler::new(&panel.x, panel.series.iter().flat_map(|series| series.marks.xs()));
        let lines = panel.horizontal_lines.iter().map(|line| line.at);
        let y = Ruler::new(&panel.y, panel.series.iter().flat_map(|series| series.marks.ys()).chain(lines));
        let bottom = TICK + LINE + FOOT + if panel.x.label.is_empty() { 0.0 } else { LABEL };
        let label_width = |tick: &Tick| tick.label.as_ref().map_or(0.0, |label| font::width(label, TEXT));
        let widest = y_ticks(&y, cell_height, bottom).iter().map(label_width).fold(0.0, f64::max);
        let label = if panel.y.label.is_empty() { 0.0 } else { LABEL };
        let left = MARGIN + label + 12.0 + widest + TICK + 4.0;

        let top_labels = top_labels(panel, &x);
        let rows = arrange(&top_labels, 0.0, cell_width - left - RIGHT).iter().map(|(row, _)| row + 1).max();
        let title = font::lines(&panel.title, LABEL, cell_width - 2.0 * MARGIN);
        let head = 8.0 + if title.is_empty() { 0.0 } else { 10.0 + LABEL + LINE * (title.len() - 1) as f64 };
        let top = head + rows.map_or(0.0, |rows| rows as f64 * LINE + 2.0);
        Self { x, y, top_labels, left, top, bottom, legend: None, head, title }
    }

    /// Makes room for the legend above the frame.
    pub fn put_legend_above(&mut self, panel: &'a Panel, cell_width: f64) {
        const GAP: f64 = 8.0;
        let legend = Legend::of(panel, &self.x, &self.y)
            .map(|legend| legend.spread(cell_width - self.left - RIGHT, cell_width - MARGIN - RIGHT));
        if let Some(legend) = &legend {
            let height = legend.size()[1] + GAP;
            (self.top, self.head) = (self.top + height, self.head + height);
        }
        self.legend = legend;
    }
}

/// The ticks of the y axis of a panel in a cell of some height.
pub(super) fn y_ticks(ruler: &Ruler, cell_height: f64, bottom: f64) -> Vec<Tick> {
    const APART: f64 = 48.0;
    ruler.ticks(((cell_height - bottom - LINE) / APART).floor())
}

/// As many ticks as have room for their labels along an x axis of some width.
pub(super) fn x_ticks(ruler: &Ruler, width: f64) -> Vec<Tick> {
    const APART: f64 = 70.0;
    let fits = |ticks: &[Tick]| {
        let mut end = f64::NEG_INFINITY;
        ticks.iter().all(|tick| {
            let Some(label) = &tick.label else { return true };
            let half = 0.5 * font::width(label, TEXT);
            let place = tick.place * width;
            let fits = end + 12.0 <= place - half;
            end = place + half;
            fits
        })
    };
    let mut count = (width / APART).floor().max(1.0);
    loop {
        let ticks = ruler.ticks(count);
        if count <= 1.0 || fits(&ticks) {
            return ticks;
        }
        count -= 1.0;
    }
}

/// What stands above the frame, from left to right: names of regions and of vertical lines.
fn top_labels<'a>(panel: &'a Panel, x: &Ruler) -> Vec<TopLabel<'a>> {
    let regions = panel.regions.iter().filter_map(|region| {
        let (from, to) = (x.place_within(region.from)?, x.place_within(region.to)?);
        (from < to).then_some(TopLabel { text: &region.label, middle: 0.5 * (from + to) })
    });
    let lines = panel.vertical_lines.iter().filter_map(|line| {
        let middle = x.place(line.at).filter(|place| (0.0..=1.0).contains(place))?;
        Some(TopLabel { text: &line.label, middle })
    });
    let mut labels: Vec<TopLabel> = regions.chain(lines).filter(|label| !label.text.is_empty()).collect();
    labels.sort_by(|a, b| a.middle.total_cmp(&b.middle));
    labels
}

/// The row, from below, and the left end of each label: as near as can be to what it names, beside or above the others.
pub(super) fn arrange(labels: &[TopLabel], left: f64, width: f64) -> Vec<(usize, f64)> {
    let mut ends: Vec<f64> = Vec::new();
    let place = |label: &TopLabel| {
        let long = font::width(label.text, TEXT);
        let start = (left + label.middle * width - 0.5 * long).min(left + width - long).max(left);
        let free = ends.iter().position(|end| *end + 10.0 <= start);
        let row = free.unwrap_or_else(|| {
            ends.push(f64::NEG_INFINITY);
            ends.len() - 1
        });
        ends[row] = start + long;
        (row, start)
    };
    labels.iter().map(place).collect()
}

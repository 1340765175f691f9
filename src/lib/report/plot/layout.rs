//! Where everything of a plot goes.

use super::axis::{Ruler, Tick};
use super::drawing::{Anchor, Drawing, Ink, Outline, Point, Rect, Stroke, Text};
use super::{Arrangement, Color, Marks, Panel, Plot, Series, font};

const TITLE_SIZE: f64 = 18.0;
const LABEL_SIZE: f64 = 15.0;
const TEXT_SIZE: f64 = 13.0;
/// From the baseline of digits to their middle, as a part of the size.
const MIDDLE: f64 = 0.365;
/// The distance of lines of text.
const LINE: f64 = 19.0;
const MARGIN: f64 = 14.0;
const TICK: f64 = 5.0;
const SWATCH: f64 = 30.0;

const TEXT_RGB: [u8; 3] = [0x22, 0x22, 0x22];
const FRAME: Stroke = Stroke { ink: Ink { rgb: [0x44; 3], opacity: 1.0 }, width: 1.0, dashes: &[] };
const GRID: Stroke = Stroke { ink: Ink { rgb: [0; 3], opacity: 0.14 }, width: 1.0, dashes: &[] };
const MINOR_GRID: Stroke = Stroke { ink: Ink { rgb: [0; 3], opacity: 0.05 }, width: 1.0, dashes: &[] };
const REFERENCE: Stroke = Stroke { ink: Ink { rgb: [0x33; 3], opacity: 1.0 }, width: 1.2, dashes: &[2.0, 3.0] };
const DASHES: &[f64] = &[7.0, 4.0];

/// Coordinates end here; beyond, the rounding of 32-bit floats would show.
const FAR: f64 = 1e5;

fn ink(color: Color, opacity: f64) -> Ink {
    Ink { rgb: color.rgb(), opacity }
}

fn line(color: Color, width: f64, dashes: &'static [f64]) -> Stroke {
    Stroke { ink: ink(color, 1.0), width, dashes }
}

/// Lays a plot out.
pub(super) fn draw(plot: &Plot) -> Drawing {
    // 900 × 600 for one panel; of several, each gets somewhat less.
    let count = plot.panels.len().max(1);
    let title_height = if plot.title.is_empty() { 0.0 } else { TITLE_SIZE + 12.0 };
    let (columns, cell_width, cell_height) = match (plot.arrangement, count) {
        (_, 1) => (1, 900.0, 600.0 - title_height - MARGIN),
        (Arrangement::Stacked, _) => (1, 900.0, 400.0),
        (Arrangement::SideBySide, _) => (count, 640.0, 500.0),
    };
    let rows = count.div_ceil(columns);
    let width = cell_width * columns as f64;
    let height = title_height + MARGIN + cell_height * rows as f64;
    let mut drawing = Drawing::new(width, height, &plot.title);
    let baseline = MARGIN + TITLE_SIZE;
    text(&mut drawing, &plot.title, [0.5 * width, baseline], TITLE_SIZE, Anchor::Middle);

    let measured: Vec<Measured> =
        plot.panels.iter().map(|panel| Measured::new(panel, cell_width, cell_height)).collect();
    let widest = measured.iter().map(|panel| panel.left).fold(0.0, f64::max);
    let tallest = measured.iter().map(|panel| panel.top).fold(0.0, f64::max);
    for (index, (panel, measured)) in plot.panels.iter().zip(&measured).enumerate() {
        let (column, row) = (index % columns, index / columns);
        let cell = Rect {
            left: column as f64 * cell_width,
            top: title_height + MARGIN + row as f64 * cell_height,
            width: cell_width,
            height: cell_height,
        };
        // Edges of panels that share a row or a column are aligned.
        let (left, top) = if columns == 1 { (widest, measured.top) } else { (measured.left, tallest) };
        Pane::new(panel, measured, cell, left, top).draw(&mut drawing);
    }
    drawing
}

fn text(drawing: &mut Drawing, text: &str, at: Point, size: f64, anchor: Anchor) {
    drawing.text(Text { text: text.into(), at, size, anchor, upwards: false, rgb: TEXT_RGB });
}

/// A label above the frame, before its place is known.
struct TopLabel<'a> {
    text: &'a str,
    /// The middle of what it names, from 0 to 1.
    middle: f64,
}

/// What of a panel can be said before its place is known.
struct Measured<'a> {
    x: Ruler,
    y: Ruler,
    y_ticks: Vec<Tick>,
    top_labels: Vec<TopLabel<'a>>,
    /// Room to the left of the frame, for ticks and the label.
    left: f64,
    /// Room above the frame, for the title and labels.
    top: f64,
}

/// Room to the right of the frame, for half a tick's label.
const RIGHT: f64 = 28.0;
/// Room below the frame, for ticks' labels and the axis's.
const BOTTOM: f64 = TICK + LINE + LABEL_SIZE + 17.0;

impl<'a> Measured<'a> {
    fn new(panel: &'a Panel, cell_width: f64, cell_height: f64) -> Self {
        let x = Ruler::new(&panel.x, panel.series.iter().flat_map(|series| series.marks.xs()), false);
        let lines = panel.horizontal_lines.iter().map(|line| line.at);
        let y_values = panel.series.iter().flat_map(|series| series.marks.ys()).chain(lines);
        let has_bars = panel.series.iter().any(|series| matches!(series.marks, Marks::Bars { .. }));
        let y = Ruler::new(&panel.y, y_values, has_bars);
        let y_ticks = y.ticks(((cell_height - BOTTOM - LINE) / 48.0).floor());
        let label_width = |tick: &Tick| tick.label.as_ref().map_or(0.0, |label| font::width(label, TEXT_SIZE));
        let widest = y_ticks.iter().map(label_width).fold(0.0, f64::max);
        let left = MARGIN + LABEL_SIZE + 12.0 + widest + TICK + 4.0;

        let mut top_labels: Vec<TopLabel> = Vec::new();
        for region in panel.regions.iter().filter(|region| !region.label.is_empty()) {
            if let Some((from, to)) = x.place_within(region.from).zip(x.place_within(region.to))
                && from < to
            {
                top_labels.push(TopLabel { text: &region.label, middle: 0.5 * (from + to) });
            }
        }
        for line in panel.vertical_lines.iter().filter(|line| !line.label.is_empty()) {
            if let Some(place) = x.place(line.at).filter(|place| (0.0..=1.0).contains(place)) {
                top_labels.push(TopLabel { text: &line.label, middle: place });
            }
        }
        top_labels.sort_by(|a, b| a.middle.total_cmp(&b.middle));
        let rows =
            arrange(&top_labels, 0.0, cell_width - left - RIGHT).iter().map(|(row, _)| row + 1).max().unwrap_or(0);
        let title = if panel.title.is_empty() { 0.0 } else { LABEL_SIZE + 10.0 };
        let top = 8.0 + title + if rows > 0 { rows as f64 * LINE + 2.0 } else { 0.0 };
        Self { x, y, y_ticks, top_labels, left, top }
    }
}

/// The row, from below, and the left end of each label: as near as can be to what it names, beside or above the others.
fn arrange(labels: &[TopLabel], left: f64, width: f64) -> Vec<(usize, f64)> {
    let mut ends: Vec<f64> = Vec::new();
    let place = |label: &TopLabel| {
        let long = font::width(label.text, TEXT_SIZE);
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

impl Marks {
    fn points(&self) -> &[[f64; 2]] {
        match self {
            Self::Line(points) | Self::Dashed(points) | Self::Points(points) | Self::LineAndPoints(points) => points,
            Self::Bars { tops, .. } => tops,
            Self::Band(_) | Self::ErrorBars(_) => &[],
        }
    }

    fn ranges(&self) -> &[[f64; 3]] {
        match self {
            Self::Band(ranges) | Self::ErrorBars(ranges) => ranges,
            _ => &[],
        }
    }

    /// All that the x axis should reach.
    fn xs(&self) -> impl Iterator<Item = f64> {
        let half = if let Self::Bars { width, .. } = self { 0.5 * width } else { 0.0 };
        let points = self.points().iter().flat_map(move |[x, _]| [x - half, x + half]);
        points.chain(self.ranges().iter().map(|[x, ..]| *x))
    }

    /// All that the y axis should reach.
    fn ys(&self) -> impl Iterator<Item = f64> {
        let ground = matches!(self, Self::Bars { .. }).then_some(0.0);
        let points = self.points().iter().map(|[_, y]| *y);
        points.chain(self.ranges().iter().flat_map(|[_, low, high]| [*low, *high])).chain(ground)
    }
}

/// A panel in its place.
struct Pane<'a> {
    panel: &'a Panel,
    measured: &'a Measured<'a>,
    cell: Rect,
    /// The frame between the axes.
    area: Rect,
}

impl<'a> Pane<'a> {
    fn new(panel: &'a Panel, measured: &'a Measured<'a>, cell: Rect, left: f64, top: f64) -> Self {
        // Whole pixels and a half keep thin lines sharp.
        let area = Rect {
            left: (cell.left + left).floor() + 0.5,
            top: (cell.top + top).floor() + 0.5,
            width: (cell.width - left - RIGHT).floor(),
            height: (cell.height - top - BOTTOM).floor(),
        };
        Self { panel, measured, cell, area }
    }

    fn at_x(&self, place: f64) -> f64 {
        (self.area.left + place * self.area.width).clamp(-FAR, FAR)
    }

    fn at_y(&self, place: f64) -> f64 {
        (self.area.bottom() - place * self.area.height).clamp(-FAR, FAR)
    }

    fn x(&self, value: f64) -> Option<f64> {
        self.measured.x.place(value).map(|place| self.at_x(place))
    }

    fn y(&self, value: f64) -> Option<f64> {
        self.measured.y.place(value).map(|place| self.at_y(place))
    }

    /// The points that the axes can show.
    fn points(&self, points: &[[f64; 2]]) -> Vec<Point> {
        points.iter().filter_map(|[x, y]| Some([self.x(*x)?, self.y(*y)?])).collect()
    }

    /// The ranges that the axes can show, as `[x, low, high]` on the canvas.
    fn ranges(&self, ranges: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let range = |[x, low, high]: &[f64; 3]| {
            let foot = || self.measured.y.place_within(*low).map(|place| self.at_y(place));
            Some([self.x(*x)?, self.y(*low).or_else(foot)?, self.y(*high)?])
        };
        ranges.iter().filter_map(range).collect()
    }

    /// The bars that the axes can show, as rectangles.
    fn bars(&self, width: f64, tops: &[[f64; 2]]) -> Vec<Vec<Point>> {
        let foot = self.measured.y.place_within(0.0).map_or(self.area.bottom(), |place| self.at_y(place));
        let bar = |[x, y]: &[f64; 2]| {
            let end = |x| self.measured.x.place_within(x).map(|place| self.at_x(place));
            let (left, right, top) = (end(x - 0.5 * width)?, end(x + 0.5 * width)?, self.y(*y)?);
            Some(vec![[left, foot], [left, top], [right, top], [right, foot]])
        };
        tops.iter().filter_map(bar).filter(|corners| corners[0][0] < corners[2][0]).collect()
    }

    fn draw(&self, drawing: &mut Drawing) {
        self.draw_regions(drawing);
        self.draw_axes(drawing);
        drawing.within(self.area, |drawing| {
            for series in &self.panel.series {
                self.draw_areas(drawing, series);
            }
            for series in &self.panel.series {
                self.draw_lines(drawing, series);
            }
        });
        for series in &self.panel.series {
            if let Marks::Points(points) | Marks::LineAndPoints(points) = &series.marks {
                let radius = if points.len() > 100 { 2.5 } else { 4.0 };
                for at in self.points(points).into_iter().filter(|at| self.area.contains(*at)) {
                    draw_mark(drawing, series.color, at, radius);
                }
            }
        }
        for line in &self.panel.vertical_lines {
            if let Some(x) = self.x(line.at).filter(|x| (self.area.left..=self.area.right()).contains(x)) {
                drawing.stroke(Outline::Line(vec![[x, self.area.top], [x, self.area.bottom()]]), REFERENCE);
            }
        }
        for line in &self.panel.horizontal_lines {
            if let Some(y) = self.y(line.at).filter(|y| (self.area.top..=self.area.bottom()).contains(y)) {
                drawing.stroke(Outline::Line(vec![[self.area.left, y], [self.area.right(), y]]), REFERENCE);
            }
        }
        drawing.stroke(Outline::Polygons(vec![self.area.corners()]), FRAME);
        self.draw_top_labels(drawing);
        let mut covered = self.covered();
        self.draw_legend(drawing, &mut covered);
        self.draw_line_labels(drawing, &mut covered);
    }

    fn draw_regions(&self, drawing: &mut Drawing) {
        for region in &self.panel.regions {
            let x = &self.measured.x;
            let Some((from, to)) = x.place_within(region.from).zip(x.place_within(region.to)) else { continue };
            if from >= to {
                continue;
            }
            let (left, right) = (self.at_x(from), self.at_x(to));
            let shade = Rect { left, top: self.area.top, width: right - left, height: self.area.height };
            drawing.fill(Outline::Polygons(vec![shade.corners()]), ink(region.color, 0.12));
            // A firm stripe at the top says where the pale shade ends.
            let stripe = Rect { top: self.area.top - 4.0, height: 4.0, left: left + 0.5, width: right - left - 1.0 };
            drawing.fill(Outline::Polygons(vec![stripe.corners()]), ink(region.color, 0.85));
        }
    }

    fn draw_axes(&self, drawing: &mut Drawing) {
        let Rect { left, top, .. } = self.area;
        let (right, bottom) = (self.area.right(), self.area.bottom());
        for tick in self.x_ticks() {
            let x = self.at_x(tick.place);
            let (grid, length) = if tick.label.is_some() { (GRID, TICK) } else { (MINOR_GRID, 0.6 * TICK) };
            drawing.stroke(Outline::Line(vec![[x, top], [x, bottom]]), grid);
            drawing.stroke(Outline::Line(vec![[x, bottom], [x, bottom + length]]), FRAME);
            let label = tick.label.unwrap_or_default();
            text(drawing, &label, [x, bottom + TICK + TEXT_SIZE + 3.0], TEXT_SIZE, Anchor::Middle);
        }
        for tick in &self.measured.y_ticks {
            let y = self.at_y(tick.place);
            let (grid, length) = if tick.label.is_some() { (GRID, TICK) } else { (MINOR_GRID, 0.6 * TICK) };
            drawing.stroke(Outline::Line(vec![[left, y], [right, y]]), grid);
            drawing.stroke(Outline::Line(vec![[left - length, y], [left, y]]), FRAME);
            let label = tick.label.as_deref().unwrap_or_default();
            text(drawing, label, [left - TICK - 4.0, y + MIDDLE * TEXT_SIZE], TEXT_SIZE, Anchor::End);
        }
        let (center, middle) = (left + 0.5 * self.area.width, top + 0.5 * self.area.height);
        let foot = bottom + TICK + LINE + LABEL_SIZE + 3.0;
        text(drawing, &self.panel.x.label, [center, foot], LABEL_SIZE, Anchor::Middle);
        drawing.text(Text {
            text: self.panel.y.label.clone(),
            at: [self.cell.left + MARGIN + LABEL_SIZE, middle],
            size: LABEL_SIZE,
            anchor: Anchor::Middle,
            upwards: true,
            rgb: TEXT_RGB,
        });
        let title = [center, self.cell.top + 6.0 + LABEL_SIZE];
        text(drawing, &self.panel.title, title, LABEL_SIZE, Anchor::Middle);
    }

    /// As many ticks as have room for their labels.
    fn x_ticks(&self) -> Vec<Tick> {
        let fits = |ticks: &[Tick]| {
            let mut end = f64::NEG_INFINITY;
            ticks.iter().all(|tick| {
                let Some(label) = &tick.label else { return true };
                let half = 0.5 * font::width(label, TEXT_SIZE);
                let place = tick.place * self.area.width;
                let fits = end + 12.0 <= place - half;
                end = place + half;
                fits
            })
        };
        let most = (self.area.width / 70.0).floor().max(1.0);
        let mut count = most;
        loop {
            let ticks = self.measured.x.ticks(count);
            if count <= 1.0 || fits(&ticks) {
                return ticks;
            }
            count -= 1.0;
        }
    }

    fn draw_areas(&self, drawing: &mut Drawing, series: &Series) {
        match &series.marks {
            Marks::Band(ranges) => {
                let ranges = self.ranges(ranges);
                if ranges.len() < 2 {
                    return;
                }
                let along = ranges.iter().map(|[x, low, _]| [*x, *low]);
                let back = ranges.iter().rev().map(|[x, _, high]| [*x, *high]);
                drawing.fill(Outline::Polygons(vec![along.chain(back).collect()]), ink(series.color, 0.25));
            }
            Marks::Bars { width, tops } => {
                let bars = self.bars(*width, tops);
                let Some(bar) = bars.first() else { return };
                // Bars of a few pixels would be all edge.
                let is_wide = bar[2][0] - bar[0][0] >= 6.0;
                let (fill, edge) = (ink(series.color, 0.45), line(series.color, 0.75, &[]));
                if is_wide {
                    drawing.shape(Outline::Polygons(bars), fill, edge);
                } else {
                    drawing.fill(Outline::Polygons(bars), fill);
                }
            }
            _ => {}
        }
    }

    fn draw_lines(&self, drawing: &mut Drawing, series: &Series) {
        match &series.marks {
            Marks::Line(points) | Marks::LineAndPoints(points) => {
                drawing.stroke(Outline::Line(self.points(points)), line(series.color, 2.0, &[]));
            }
            Marks::Dashed(points) => {
                drawing.stroke(Outline::Line(self.points(points)), line(series.color, 2.0, DASHES));
            }
            Marks::ErrorBars(ranges) => {
                self.ranges(ranges).into_iter().for_each(|range| draw_error_bar(drawing, series.color, range));
            }
            Marks::Points(_) | Marks::Band(_) | Marks::Bars { .. } => {}
        }
    }

    fn draw_top_labels(&self, drawing: &mut Drawing) {
        let labels = &self.measured.top_labels;
        for (label, (row, start)) in labels.iter().zip(arrange(labels, self.area.left, self.area.width)) {
            let at = [start, self.area.top - 9.0 - row as f64 * LINE];
            text(drawing, label.text, at, TEXT_SIZE, Anchor::Start);
        }
    }

    /// Places within the frame that are better not covered, a few pixels apart.
    fn covered(&self) -> Vec<Point> {
        const STEP: f64 = 5.0;
        let mut covered = Vec::new();
        let mut walk = |from: Point, to: Point| {
            let steps = (f64::hypot(to[0] - from[0], to[1] - from[1]) / STEP).ceil().clamp(1.0, 4000.0);
            let mut along = 0.0;
            while along <= steps {
                let part = along / steps;
                covered.push([from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]);
                along += 1.0;
            }
        };
        for series in &self.panel.series {
            match &series.marks {
                Marks::Line(points) | Marks::Dashed(points) | Marks::LineAndPoints(points) => {
                    self.points(points).windows(2).for_each(|pair| walk(pair[0], pair[1]));
                }
                Marks::Points(points) => self.points(points).into_iter().for_each(|at| walk(at, at)),
                Marks::Bars { width, tops } => {
                    for bar in self.bars(*width, tops) {
                        let center = 0.5 * (bar[0][0] + bar[2][0]);
                        walk([center, bar[0][1]], [center, bar[1][1]]);
                    }
                }
                Marks::Band(ranges) | Marks::ErrorBars(ranges) => {
                    self.ranges(ranges).into_iter().for_each(|[x, low, high]| walk([x, low], [x, high]));
                }
            }
        }
        for line in &self.panel.vertical_lines {
            if let Some(x) = self.x(line.at) {
                walk([x, self.area.top], [x, self.area.bottom()]);
            }
        }
        for line in &self.panel.horizontal_lines {
            if let Some(y) = self.y(line.at) {
                walk([self.area.left, y], [self.area.right(), y]);
            }
        }
        covered.retain(|at| self.area.contains(*at));
        covered
    }

    /// Draws the legend where it covers least; of equal places, in a corner.
    fn draw_legend(&self, drawing: &mut Drawing, covered: &mut Vec<Point>) {
        let named: Vec<&Series> = self.panel.series.iter().filter(|series| !series.name.is_empty()).collect();
        if named.is_empty() {
            return;
        }
        let longest = named.iter().map(|series| font::width(&series.name, TEXT_SIZE)).fold(0.0, f64::max);
        let (width, height) = (8.0 + SWATCH + 8.0 + longest + 10.0, named.len() as f64 * LINE + 8.0);
        let (free_x, free_y) = (self.area.width - width - 20.0, self.area.height - height - 20.0);
        // Corners first, then the other places of a grid; the first of the best is taken.
        const STEPS: [f64; 9] = [1.0, 0.0, 0.875, 0.125, 0.75, 0.25, 0.625, 0.375, 0.5];
        let places = STEPS.iter().flat_map(|along| STEPS.iter().map(move |up| (*along, *up)));
        let at = |(along, up): (f64, f64)| Rect {
            left: (self.area.left + 10.0 + along * free_x.max(0.0)).round() + 0.5,
            top: (self.area.top + 10.0 + (1.0 - up) * free_y.max(0.0)).round() + 0.5,
            width,
            height,
        };
        let Some(rect) = places.map(at).min_by_key(|rect| cost(*rect, covered)) else { return };
        drawing.shape(
            Outline::Polygons(vec![rect.corners()]),
            Ink { rgb: [0xff; 3], opacity: 0.88 },
            Stroke { ink: Ink { rgb: [0; 3], opacity: 0.25 }, width: 1.0, dashes: &[] },
        );
        for (index, series) in named.iter().enumerate() {
            let middle = rect.top + 4.0 + (index as f64 + 0.5) * LINE;
            let left = rect.left + 8.0;
            draw_swatch(drawing, series, [left, middle]);
            let baseline = [left + SWATCH + 8.0, middle + MIDDLE * TEXT_SIZE];
            text(drawing, &series.name, baseline, TEXT_SIZE, Anchor::Start);
        }
        cover(rect, covered);
    }

    /// Writes beside horizontal lines what they are, at the end where it covers least.
    fn draw_line_labels(&self, drawing: &mut Drawing, covered: &mut Vec<Point>) {
        for line in self.panel.horizontal_lines.iter().filter(|line| !line.label.is_empty()) {
            let Some(y) = self.y(line.at).filter(|y| (self.area.top..=self.area.bottom()).contains(y)) else {
                continue;
            };
            let width = font::width(&line.label, TEXT_SIZE);
            let (left, right) = (self.area.left + 8.0, self.area.right() - 8.0 - width);
            let center = 0.5 * (left + right);
            let (above, below) = (y - 3.0 - TEXT_SIZE, y + 3.0);
            let places = [right, left, center].into_iter().flat_map(|left| [above, below].map(|top| (left, top)));
            let rect = places
                .map(|(left, top)| Rect { left, top, width, height: TEXT_SIZE })
                .filter(|rect| rect.top > self.area.top && rect.bottom() < self.area.bottom())
                .min_by_key(|rect| cost(Rect { height: TEXT_SIZE - 4.0, top: rect.top + 2.0, ..*rect }, covered));
            if let Some(rect) = rect {
                let baseline = rect.top + TEXT_SIZE * 0.85;
                text(drawing, &line.label, [rect.left, baseline], TEXT_SIZE, Anchor::Start);
                cover(rect, covered);
            }
        }
    }
}

/// How much a rectangle with some room about it would cover.
fn cost(rect: Rect, covered: &[Point]) -> usize {
    let room = Rect { left: rect.left - 4.0, top: rect.top - 4.0, width: rect.width + 8.0, height: rect.height + 8.0 };
    covered.iter().filter(|at| room.contains(**at)).count()
}

/// Adds a rectangle to what is better not covered.
fn cover(rect: Rect, covered: &mut Vec<Point>) {
    let mut y = rect.top;
    while y <= rect.bottom() {
        let mut x = rect.left;
        while x <= rect.right() {
            covered.push([x, y]);
            x += 5.0;
        }
        y += 5.0;
    }
}

/// Draws a point: each color has a form of its own.
fn draw_mark(drawing: &mut Drawing, color: Color, [x, y]: Point, radius: f64) {
    let polygon = |corners: &[Point]| {
        Outline::Polygons(vec![corners.iter().map(|[dx, dy]| [x + dx * radius, y + dy * radius]).collect()])
    };
    let outline = match color {
        Color::Blue | Color::Black | Color::Yellow | Color::Gray => Outline::Circle([x, y], radius),
        Color::Vermillion => polygon(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
        Color::Green => polygon(&[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]]),
        Color::Purple => polygon(&[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]]),
        Color::Orange => polygon(&[[0.0, 1.2], [1.1, -0.8], [-1.1, -0.8]]),
        Color::SkyBlue => polygon(&[[-1.1, 0.0], [-0.5, -1.0], [0.5, -1.0], [1.1, 0.0], [0.5, 1.0], [-0.5, 1.0]]),
    };
    // A white rim keeps points apart from each other and from lines of their color.
    drawing.shape(
        outline,
        ink(color, 1.0),
        Stroke { ink: Ink { rgb: [0xff; 3], opacity: 0.9 }, width: 0.8, dashes: &[] },
    );
}

fn draw_error_bar(drawing: &mut Drawing, color: Color, [x, low, high]: [f64; 3]) {
    let cap = |y| [[x - 3.0, y], [x + 3.0, y]];
    for ends in [[[x, low], [x, high]], cap(low), cap(high)] {
        drawing.stroke(Outline::Line(ends.to_vec()), line(color, 1.2, &[]));
    }
}

/// Draws what the legend shows of a series; `at` is its left end.
fn draw_swatch(drawing: &mut Drawing, series: &Series, [left, y]: Point) {
    let stroke = |dashes| (Outline::Line(vec![[left, y], [left + SWATCH, y]]), line(series.color, 2.0, dashes));
    let block = Rect { left, top: y - 5.0, width: SWATCH, height: 10.0 };
    let block = Outline::Polygons(vec![block.corners()]);
    let center = left + 0.5 * SWATCH;
    match &series.marks {
        Marks::Line(_) | Marks::LineAndPoints(_) => {
            let (outline, stroke) = stroke(&[]);
            drawing.stroke(outline, stroke);
        }
        Marks::Dashed(_) => {
            let (outline, stroke) = stroke(DASHES);
            drawing.stroke(outline, stroke);
        }
        Marks::Bars { .. } => drawing.shape(block, ink(series.color, 0.45), line(series.color, 0.75, &[])),
        Marks::Band(_) => drawing.fill(block, ink(series.color, 0.25)),
        Marks::ErrorBars(_) => draw_error_bar(drawing, series.color, [center, y + 6.0, y - 6.0]),
        Marks::Points(_) => {}
    }
    if matches!(series.marks, Marks::Points(_) | Marks::LineAndPoints(_)) {
        draw_mark(drawing, series.color, [center, y], 4.0);
    }
}

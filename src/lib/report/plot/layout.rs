//! Where everything of a plot goes.

use super::axis::{Ruler, Tick};
use super::drawing::{Anchor, Drawing, Ink, Outline, Point, Rect, Stroke, Text};
use super::{Arrangement, Arrow, CircleSize, Color, Corner, Inset, Marks, Panel, Plot, Series, font};

const TITLE_SIZE: f64 = 18.0;
const TEXT_SIZE: f64 = 13.0;
/// From the baseline of digits to their middle, as a part of the size.
const MIDDLE: f64 = 0.365;
/// The distance of lines of text.
const LINE: f64 = 19.0;
const MARGIN: f64 = 14.0;
const SWATCH: f64 = 30.0;

/// The sizes of a panel and its type.
#[derive(Debug, Clone, Copy)]
struct Style {
    /// Axes' labels and the panel's title.
    label: f64,
    /// Numbers and names.
    text: f64,
    /// The distance of lines of text.
    line: f64,
    tick: f64,
    /// Room to the left of the y axis's label.
    margin: f64,
    /// Room below the x axis's label, for what goes below the baseline and the next panel.
    foot: f64,
    /// Room to the right of the frame, for half a tick's label.
    right: f64,
    /// The distance of ticks with labels, at least: of x, of y.
    apart: [f64; 2],
    /// Widths of lines and sizes of points, as parts of the usual.
    weight: f64,
}

const USUAL: Style = Style {
    label: 15.0,
    text: TEXT_SIZE,
    line: LINE,
    tick: 5.0,
    margin: MARGIN,
    foot: 17.0,
    right: 28.0,
    apart: [70.0, 48.0],
    weight: 1.0,
};

/// Of insets.
const SMALL: Style = Style {
    label: 11.0,
    text: 10.0,
    line: 14.0,
    tick: 3.0,
    margin: 2.0,
    foot: 4.0,
    right: 10.0,
    apart: [24.0, 24.0],
    weight: 0.6,
};

impl Style {
    /// Room below the frame, for ticks' labels and the axis's.
    fn bottom(&self, panel: &Panel) -> f64 {
        let label = if panel.x.label.is_empty() { 0.0 } else { self.label };
        self.tick + self.line + label + self.foot
    }

    /// Room to the left of the frame, for the axis's label and ticks' labels of this width.
    fn left(&self, panel: &Panel, widest: f64) -> f64 {
        let label = if panel.y.label.is_empty() { 0.0 } else { self.label };
        self.margin + label + 12.0 * self.weight + widest + self.tick + 4.0
    }
}

const TEXT_RGB: [u8; 3] = [0x22, 0x22, 0x22];
const FRAME: Stroke = Stroke { ink: Ink { rgb: [0x44; 3], opacity: 1.0 }, width: 1.0, dashes: &[] };
const GRID: Stroke = Stroke { ink: Ink { rgb: [0; 3], opacity: 0.14 }, width: 1.0, dashes: &[] };
const MINOR_GRID: Stroke = Stroke { ink: Ink { rgb: [0; 3], opacity: 0.05 }, width: 1.0, dashes: &[] };
const REFERENCE: Stroke = Stroke { ink: Ink { rgb: [0x33; 3], opacity: 1.0 }, width: 1.2, dashes: &[2.0, 3.0] };
const DASHES: &[f64] = &[7.0, 4.0];
/// The width of segments and circles.
const THIN: f64 = 1.0;

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
        plot.panels.iter().map(|panel| Measured::new(panel, USUAL, cell_width, cell_height)).collect();
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
    style: Style,
    x: Ruler,
    y: Ruler,
    top_labels: Vec<TopLabel<'a>>,
    /// Room to the left of the frame, for ticks and the label.
    left: f64,
    /// Room above the frame, for the title and labels.
    top: f64,
}

impl<'a> Measured<'a> {
    fn new(panel: &'a Panel, style: Style, cell_width: f64, cell_height: f64) -> Self {
        let x = Ruler::new(&panel.x, panel.series.iter().flat_map(|series| series.marks.xs()), false);
        let lines = panel.horizontal_lines.iter().map(|line| line.at);
        let y_values = panel.series.iter().flat_map(|series| series.marks.ys()).chain(lines);
        let has_bars = panel.series.iter().any(|series| matches!(series.marks, Marks::Bars { .. }));
        let y = Ruler::new(&panel.y, y_values, has_bars);
        let y_ticks = ticks_upwards(&y, panel, style, cell_height);
        let label_width = |tick: &Tick| tick.label.as_ref().map_or(0.0, |label| font::width(label, style.text));
        let widest = y_ticks.iter().map(label_width).fold(0.0, f64::max);
        let left = style.left(panel, widest);

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
            arrange(&top_labels, style, 0.0, cell_width - left - style.right).iter().map(|(row, _)| row + 1).max();
        let title = if panel.title.is_empty() { 0.0 } else { style.label + 10.0 };
        let top = 8.0 + title + rows.map_or(0.0, |rows| rows as f64 * style.line + 2.0);
        Self { style, x, y, top_labels, left, top }
    }
}

/// The ticks of the y axis of a panel in a cell of some height.
fn ticks_upwards(ruler: &Ruler, panel: &Panel, style: Style, cell_height: f64) -> Vec<Tick> {
    ruler.ticks(((cell_height - style.bottom(panel) - style.line) / style.apart[1]).floor())
}

/// The row, from below, and the left end of each label: as near as can be to what it names, beside or above the others.
fn arrange(labels: &[TopLabel], style: Style, left: f64, width: f64) -> Vec<(usize, f64)> {
    let mut ends: Vec<f64> = Vec::new();
    let place = |label: &TopLabel| {
        let long = font::width(label.text, style.text);
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
            Self::Band(_) | Self::ErrorBars(_) | Self::Segments(_) | Self::Circles(_) => &[],
        }
    }

    fn ranges(&self) -> &[[f64; 3]] {
        match self {
            Self::Band(ranges) | Self::ErrorBars(ranges) => ranges,
            _ => &[],
        }
    }

    fn segments(&self) -> &[[f64; 4]] {
        if let Self::Segments(segments) = self { segments } else { &[] }
    }

    fn circles(&self) -> &[[f64; 3]] {
        if let Self::Circles(circles) = self { circles } else { &[] }
    }

    /// All that the x axis should reach.
    fn xs(&self) -> impl Iterator<Item = f64> {
        let half = if let Self::Bars { width, .. } = self { 0.5 * width } else { 0.0 };
        let points = self.points().iter().flat_map(move |[x, _]| [x - half, x + half]);
        let ends = self.segments().iter().flat_map(|[x0, _, x1, _]| [*x0, *x1]);
        points.chain(self.ranges().iter().chain(self.circles()).map(|[x, ..]| *x)).chain(ends)
    }

    /// All that the y axis should reach.
    fn ys(&self) -> impl Iterator<Item = f64> {
        let ground = matches!(self, Self::Bars { .. }).then_some(0.0);
        let points = self.points().iter().map(|[_, y]| *y).chain(self.circles().iter().map(|[_, y, _]| *y));
        let ends = self.segments().iter().flat_map(|[_, y0, _, y1]| [*y0, *y1]);
        points.chain(ends).chain(self.ranges().iter().flat_map(|[_, low, high]| [*low, *high])).chain(ground)
    }
}

/// A panel in its place.
struct Pane<'a> {
    panel: &'a Panel,
    measured: &'a Measured<'a>,
    style: Style,
    cell: Rect,
    /// The frame between the axes.
    area: Rect,
}

impl<'a> Pane<'a> {
    fn new(panel: &'a Panel, measured: &'a Measured<'a>, mut cell: Rect, left: f64, top: f64) -> Self {
        let style = measured.style;
        let (width, height) = (cell.width - left - style.right, cell.height - top - style.bottom(panel));
        if panel.equal_scale && panel.x.scale == panel.y.scale {
            let scale = f64::min(width / measured.x.span(), height / measured.y.span());
            let (narrow, low) = (scale * measured.x.span(), scale * measured.y.span());
            if narrow > 0.1 * width && low > 0.1 * height {
                // What is left over is shared between both sides.
                let (beside, above) = (width - narrow, height - low);
                cell = Rect {
                    left: cell.left + 0.5 * beside,
                    top: cell.top + 0.5 * above,
                    width: cell.width - beside,
                    height: cell.height - above,
                };
            }
        }
        // Whole pixels and a half keep thin lines sharp.
        let area = Rect {
            left: (cell.left + left).floor() + 0.5,
            top: (cell.top + top).floor() + 0.5,
            width: (cell.width - left - style.right).floor(),
            height: (cell.height - top - style.bottom(panel)).floor(),
        };
        Self { panel, measured, style, cell, area }
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

    /// The segments that the axes can show.
    fn segments(&self, segments: &[[f64; 4]]) -> Vec<[Point; 2]> {
        let segment = |[x0, y0, x1, y1]: &[f64; 4]| Some([[self.x(*x0)?, self.y(*y0)?], [self.x(*x1)?, self.y(*y1)?]]);
        segments.iter().filter_map(segment).collect()
    }

    /// The circles that the axes can show, as centers and radii.
    fn circles(&self, circles: &[[f64; 3]]) -> Vec<(Point, f64)> {
        let circle = |[x, y, diameter]: &[f64; 3]| {
            let radius = (0.0..=FAR).contains(diameter).then_some(0.5 * diameter)?;
            Some(([self.x(*x)?, self.y(*y)?], radius))
        };
        circles.iter().filter_map(circle).collect()
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
                let radius = self.style.weight * point_radius(points.len());
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
        if self.is_inset() {
            self.panel.arrows.iter().for_each(|arrow| self.draw_arrow(drawing, arrow, &mut Vec::new()));
            return;
        }
        let mut covered = self.covered();
        if let Some(inset) = &self.panel.inset {
            cover(self.draw_inset(drawing, inset), &mut covered);
        }
        self.draw_legend(drawing, &mut covered);
        for arrow in &self.panel.arrows {
            self.draw_arrow(drawing, arrow, &mut covered);
        }
        self.draw_line_labels(drawing, &mut covered);
    }

    /// Draws a small panel in a corner and returns what it covers.
    fn draw_inset(&self, drawing: &mut Drawing, inset: &Inset) -> Rect {
        const GAP: f64 = 6.0;
        let share = if inset.share.is_nan() { 0.0 } else { inset.share.clamp(0.0, 1.0) };
        let (width, height) = (share * (self.area.width - 2.0 * GAP), share * (self.area.height - 2.0 * GAP));
        let measured = Measured::new(&inset.panel, SMALL, width, height);
        let pane = |left: f64, top: f64| {
            Pane::new(&inset.panel, &measured, Rect { left, top, width, height }, measured.left, measured.top)
        };
        // Its axes may make it smaller than its share; then it moves into the corner.
        let Rect { width: narrow, height: low, .. } = pane(0.0, 0.0).cell;
        let is_left = matches!(inset.corner, Corner::TopLeft | Corner::BottomLeft);
        let is_top = matches!(inset.corner, Corner::TopLeft | Corner::TopRight);
        let left = if is_left { self.area.left + GAP } else { self.area.right() - GAP - narrow };
        let top = if is_top { self.area.top + GAP } else { self.area.bottom() - GAP - low };
        let pane = pane(left - 0.5 * (width - narrow), top - 0.5 * (height - low));
        if pane.area.width < 1.0 || pane.area.height < 1.0 {
            return Rect { left, top, width: 0.0, height: 0.0 };
        }
        drawing.fill(Outline::Polygons(vec![pane.cell.corners()]), Ink { rgb: [0xff; 3], opacity: 1.0 });
        pane.draw(drawing);
        pane.cell
    }

    fn is_inset(&self) -> bool {
        self.style.weight < 1.0
    }

    /// The ends of an arrow that the axes can show.
    fn arrow_ends(&self, arrow: &Arrow) -> Option<[Point; 2]> {
        let [[x0, y0], [x1, y1]] = [arrow.from, arrow.to];
        self.segments(&[[x0, y0, x1, y1]]).pop()
    }

    fn draw_arrow(&self, drawing: &mut Drawing, arrow: &Arrow, covered: &mut Vec<Point>) {
        const BEFORE: f64 = 5.0;
        const HEAD: [f64; 2] = [11.0, 4.0];
        let [length, half] = HEAD.map(|size| size * self.style.weight);
        let Some([from, to]) = self.arrow_ends(arrow) else { return };
        let distance = f64::hypot(to[0] - from[0], to[1] - from[1]);
        if distance > BEFORE + length {
            let [along_x, along_y] = [0, 1].map(|i| (to[i] - from[i]) / distance);
            let at = |before: f64, aside: f64| {
                [to[0] - before * along_x - aside * along_y, to[1] - before * along_y + aside * along_x]
            };
            let neck = BEFORE + length;
            drawing.within(self.area, |drawing| {
                let shaft = Outline::Line(vec![from, at(neck, 0.0)]);
                drawing.stroke(shaft, line(arrow.color, 1.5 * self.style.weight, &[]));
                let head = vec![at(BEFORE, 0.0), at(neck, half), at(neck, -half)];
                drawing.fill(Outline::Polygons(vec![head]), ink(arrow.color, 1.0));
            });
        }
        if let Some(rect) = self.arrow_label(&arrow.label, [from, to], covered) {
            text(drawing, &arrow.label, [rect.left, rect.top + 0.87 * rect.height], self.style.text, Anchor::Start);
            cover(rect, covered);
        }
    }

    /// Where the label of an arrow goes: about its tail within the frame, where it covers least; of equal places, away
    /// from the head.
    fn arrow_label(&self, label: &str, [from, to]: [Point; 2], covered: &[Point]) -> Option<Rect> {
        if label.is_empty() || !self.area.contains(from) {
            return None;
        }
        let (across, down) = (to[0] - from[0], to[1] - from[1]);
        let (width, height) = (font::width(label, self.style.text), self.style.text);
        let rect = |left: f64, top: f64| Rect { left, top, width, height };
        let left = rect(from[0] - 5.0 - width, from[1] - 0.5 * height);
        let right = rect(from[0] + 5.0, from[1] - 0.5 * height);
        let above = rect(from[0] - 0.5 * width, from[1] - 4.0 - height);
        let below = rect(from[0] - 0.5 * width, from[1] + 4.0);
        let beside = if across > 0.0 { [left, right] } else { [right, left] };
        let over = if down > 0.0 { [above, below] } else { [below, above] };
        let places = if across.abs() > down.abs() {
            [beside[0], over[0], over[1], beside[1]]
        } else {
            [over[0], beside[0], beside[1], over[1]]
        };
        let inside = |rect: Rect| Rect {
            left: rect.left.min(self.area.right() - 4.0 - width).max(self.area.left + 4.0),
            top: rect.top.min(self.area.bottom() - 4.0 - height).max(self.area.top + 4.0),
            ..rect
        };
        places.into_iter().map(inside).min_by_key(|rect| cost(*rect, covered))
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
        let Style { label: label_size, text: text_size, line, tick: length, .. } = self.style;
        let (right, bottom) = (self.area.right(), self.area.bottom());
        for tick in self.x_ticks() {
            let x = self.at_x(tick.place);
            let (grid, mark) = if tick.label.is_some() { (GRID, length) } else { (MINOR_GRID, 0.6 * length) };
            drawing.stroke(Outline::Line(vec![[x, top], [x, bottom]]), grid);
            drawing.stroke(Outline::Line(vec![[x, bottom], [x, bottom + mark]]), FRAME);
            let label = tick.label.unwrap_or_default();
            text(drawing, &label, [x, bottom + length + text_size + 3.0], text_size, Anchor::Middle);
        }
        for tick in ticks_upwards(&self.measured.y, self.panel, self.style, self.cell.height) {
            let y = self.at_y(tick.place);
            let (grid, mark) = if tick.label.is_some() { (GRID, length) } else { (MINOR_GRID, 0.6 * length) };
            drawing.stroke(Outline::Line(vec![[left, y], [right, y]]), grid);
            drawing.stroke(Outline::Line(vec![[left - mark, y], [left, y]]), FRAME);
            let label = tick.label.as_deref().unwrap_or_default();
            text(drawing, label, [left - length - 4.0, y + MIDDLE * text_size], text_size, Anchor::End);
        }
        let (center, middle) = (left + 0.5 * self.area.width, top + 0.5 * self.area.height);
        let foot = bottom + length + line + label_size + 3.0 * self.style.weight;
        text(drawing, &self.panel.x.label, [center, foot], label_size, Anchor::Middle);
        drawing.text(Text {
            text: self.panel.y.label.clone(),
            at: [self.cell.left + self.style.margin + label_size, middle],
            size: label_size,
            anchor: Anchor::Middle,
            upwards: true,
            rgb: TEXT_RGB,
        });
        let title = [center, self.cell.top + 6.0 + label_size];
        text(drawing, &self.panel.title, title, label_size, Anchor::Middle);
    }

    /// As many ticks as have room for their labels.
    fn x_ticks(&self) -> Vec<Tick> {
        let fits = |ticks: &[Tick]| {
            let mut end = f64::NEG_INFINITY;
            ticks.iter().all(|tick| {
                let Some(label) = &tick.label else { return true };
                let half = 0.5 * font::width(label, self.style.text);
                let place = tick.place * self.area.width;
                let fits = end + 12.0 * self.style.weight <= place - half;
                end = place + half;
                fits
            })
        };
        let most = (self.area.width / self.style.apart[0]).floor().max(1.0);
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
        let width = 2.0 * self.style.weight;
        match &series.marks {
            Marks::Line(points) | Marks::LineAndPoints(points) => {
                drawing.stroke(Outline::Line(self.points(points)), line(series.color, width, &[]));
            }
            Marks::Dashed(points) => {
                drawing.stroke(Outline::Line(self.points(points)), line(series.color, width, DASHES));
            }
            Marks::ErrorBars(ranges) => {
                self.ranges(ranges).into_iter().for_each(|range| draw_error_bar(drawing, series.color, range));
            }
            Marks::Segments(segments) => {
                for ends in self.segments(segments) {
                    drawing.stroke(Outline::Line(ends.to_vec()), line(series.color, THIN * self.style.weight, &[]));
                }
            }
            Marks::Circles(circles) => {
                for (center, radius) in self.circles(circles) {
                    let stroke = line(series.color, THIN * self.style.weight, &[]);
                    drawing.stroke(Outline::Circle(center, radius), stroke);
                }
            }
            Marks::Points(_) | Marks::Band(_) | Marks::Bars { .. } => {}
        }
    }

    fn draw_top_labels(&self, drawing: &mut Drawing) {
        let labels = &self.measured.top_labels;
        for (label, (row, start)) in labels.iter().zip(arrange(labels, self.style, self.area.left, self.area.width)) {
            let at = [start, self.area.top - 9.0 - row as f64 * self.style.line];
            text(drawing, label.text, at, self.style.text, Anchor::Start);
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
                Marks::Segments(segments) => self.segments(segments).into_iter().for_each(|[from, to]| walk(from, to)),
                Marks::Circles(circles) => {
                    for ([x, y], radius) in self.circles(circles) {
                        walk([x - radius, y], [x + radius, y]);
                        walk([x, y - radius], [x, y + radius]);
                    }
                }
            }
        }
        for [from, to] in self.panel.arrows.iter().filter_map(|arrow| self.arrow_ends(arrow)) {
            walk(from, to);
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
        if named.is_empty() && self.panel.circle_sizes.is_empty() {
            return;
        }
        let sizes = &self.panel.circle_sizes;
        let names = named.iter().map(|series| &series.name).chain(sizes.iter().map(|size| &size.label));
        let longest = names.map(|name| font::width(name, TEXT_SIZE)).fold(0.0, f64::max);
        let largest = sizes.iter().map(drawn_diameter).fold(0.0, f64::max);
        let swatch = f64::max(SWATCH, largest);
        let size_heights = sizes.iter().map(|size| f64::max(LINE, drawn_diameter(size) + 4.0));
        let rows: Vec<f64> = named.iter().map(|_| LINE).chain(size_heights).collect();
        let (width, height) = (8.0 + swatch + 8.0 + longest + 10.0, rows.iter().sum::<f64>() + 8.0);
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
        let left = rect.left + 8.0;
        let mut top = rect.top + 4.0;
        for (index, row) in rows.iter().enumerate() {
            let middle = top + 0.5 * row;
            let name = if let Some(series) = named.get(index) {
                draw_swatch(drawing, series, [left + 0.5 * (swatch - SWATCH), middle]);
                &series.name
            } else {
                let size = &sizes[index - named.len()];
                let circle = Outline::Circle([left + 0.5 * swatch, middle], 0.5 * drawn_diameter(size));
                drawing.stroke(circle, line(size.color, THIN, &[]));
                &size.label
            };
            let baseline = [left + swatch + 8.0, middle + MIDDLE * TEXT_SIZE];
            text(drawing, name, baseline, TEXT_SIZE, Anchor::Start);
            top += row;
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

/// The diameter of a circle in the legend; what is no size is none.
fn drawn_diameter(size: &CircleSize) -> f64 {
    if size.diameter.is_nan() { 0.0 } else { size.diameter.clamp(0.0, 100.0) }
}

/// The more points, the smaller.
fn point_radius(count: usize) -> f64 {
    match count {
        0..=100 => 4.0,
        101..=500 => 2.5,
        _ => 1.6,
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
        Stroke { ink: Ink { rgb: [0xff; 3], opacity: 0.9 }, width: f64::min(0.8, 0.32 * radius), dashes: &[] },
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
        Marks::Segments(_) => {
            let ends = vec![[center - 8.0, y + 4.0], [center + 8.0, y - 4.0]];
            drawing.stroke(Outline::Line(ends), line(series.color, 1.2 * THIN, &[]));
        }
        Marks::Circles(_) => drawing.stroke(Outline::Circle([center, y], 5.0), line(series.color, THIN, &[])),
        Marks::Points(_) => {}
    }
    if matches!(series.marks, Marks::Points(_) | Marks::LineAndPoints(_)) {
        draw_mark(drawing, series.color, [center, y], 4.0);
    }
}

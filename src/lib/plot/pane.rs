//! A panel in its place: from values to pixels, and all that is drawn within and about the frame.

use super::drawing::{Drawing, Outline, Point, Rect};
use super::figure::{Anchor, Marks, Note, Panel, Region, Series};
use super::font;
use super::legend::{Covered, Legend, draw_line_label};
use super::marks::{Look, draw_error_bar, draw_mark, point_radius};
use super::names::{Obstacles, Placed, place};
use super::room::{Room, arrange, x_ticks, y_ticks};
use super::style::{
    FRAME, GRID, LABEL, LINE, MARGIN, MIDDLE, MINOR_GRID, REFERENCE, RIGHT, TEXT, TICK, dashes, ink, line, write,
    write_upward,
};

/// Coordinates end here; beyond, the rounding of 32-bit floats would show.
const FAR: f64 = 1e5;

/// A panel in its place.
pub(super) struct Pane<'a> {
    panel: &'a Panel,
    room: &'a Room<'a>,
    cell: Rect,
    /// The frame between the axes.
    area: Rect,
}

impl<'a> Pane<'a> {
    /// Puts a panel into a cell, with so much room to the left of its frame and above it.
    pub fn new(panel: &'a Panel, room: &'a Room<'a>, mut cell: Rect, left: f64, top: f64) -> Self {
        let (width, height) = (cell.width - left - RIGHT, cell.height - top - room.bottom);
        if panel.equal_scale && panel.x.scale == panel.y.scale {
            let scale = f64::min(width / room.x.span(), height / room.y.span());
            let (narrow, low) = (scale * room.x.span(), scale * room.y.span());
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
            width: (cell.width - left - RIGHT).floor(),
            height: (cell.height - top - room.bottom).floor(),
        };
        Self { panel, room, cell, area }
    }

    fn at_x(&self, place: f64) -> f64 {
        (self.area.left + place * self.area.width).clamp(-FAR, FAR)
    }

    fn at_y(&self, place: f64) -> f64 {
        (self.area.bottom() - place * self.area.height).clamp(-FAR, FAR)
    }

    fn x(&self, value: f64) -> Option<f64> {
        self.room.x.place(value).map(|place| self.at_x(place))
    }

    fn y(&self, value: f64) -> Option<f64> {
        self.room.y.place(value).map(|place| self.at_y(place))
    }

    /// `None` for a point that the axes cannot show.
    fn point(&self, [x, y]: [f64; 2]) -> Option<Point> {
        Some([self.x(x)?, self.y(y)?])
    }

    /// The points that the axes can show.
    fn points(&self, points: &[[f64; 2]]) -> Vec<Point> {
        points.iter().filter_map(|point| self.point(*point)).collect()
    }

    /// The ranges that the axes can show, as `[x, low, high]` on the canvas.
    fn ranges(&self, ranges: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let range = |[x, low, high]: &[f64; 3]| {
            let foot = || self.room.y.place_within(*low).map(|place| self.at_y(place));
            Some([self.x(*x)?, self.y(*low).or_else(foot)?, self.y(*high)?])
        };
        ranges.iter().filter_map(range).collect()
    }

    /// Where vertical lines stand that are within the frame.
    fn vertical_lines(&self) -> impl Iterator<Item = f64> {
        let places = self.panel.vertical_lines.iter().filter_map(|line| self.x(line.at));
        places.filter(|x| (self.area.left..=self.area.right()).contains(x))
    }

    /// Where horizontal lines lie that are within the frame, with their names.
    fn horizontal_lines(&self) -> impl Iterator<Item = (f64, &str)> {
        let places =
            self.panel.horizontal_lines.iter().filter_map(|line| Some((self.y(line.at)?, line.label.as_str())));
        places.filter(|(y, _)| (self.area.top..=self.area.bottom()).contains(y))
    }

    /// Draws all, from the bottom up.
    pub fn draw(&self, drawing: &mut Drawing) {
        if !self.panel.has_axes {
            return self.write_alone(drawing);
        }
        self.panel.regions.iter().for_each(|region| self.draw_region(drawing, region));
        self.draw_ticks(drawing);
        self.draw_names(drawing);
        drawing.within(self.area, |drawing| {
            self.panel.notes.iter().for_each(|note| self.draw_note(drawing, note));
            self.panel.series.iter().for_each(|series| self.draw_lines(drawing, series));
        });
        let look = self.look();
        self.panel.series.iter().for_each(|series| self.draw_points(drawing, series, look));
        let Rect { left, top, .. } = self.area;
        for x in self.vertical_lines() {
            drawing.stroke(Outline::Line(vec![[x, top], [x, self.area.bottom()]]), REFERENCE);
        }
        for (y, _) in self.horizontal_lines() {
            drawing.stroke(Outline::Line(vec![[left, y], [self.area.right(), y]]), REFERENCE);
        }
        drawing.stroke(self.area.outline(), FRAME);
        self.draw_top_labels(drawing);
        self.panel.notes.iter().for_each(|note| self.write_note(drawing, note));
        let mut covered = self.covered();
        self.names(&mut covered).iter().for_each(|name| name.draw(drawing));
        self.draw_legend(drawing, look, &mut covered);
        for (y, label) in self.horizontal_lines() {
            draw_line_label(drawing, label, y, self.area, &mut covered);
        }
    }

    /// Writes the title of a panel without axes in its middle, in as many lines as its cell needs.
    fn write_alone(&self, drawing: &mut Drawing) {
        let lines = font::lines(&self.panel.title, LABEL, self.cell.width - 2.0 * MARGIN);
        let center = self.cell.left + 0.5 * self.cell.width;
        let first = self.area.top + 0.5 * (self.area.height - LINE * (lines.len().saturating_sub(1)) as f64);
        for (index, text) in lines.iter().enumerate() {
            write(drawing, text, [center, first + LINE * index as f64], LABEL, Anchor::Middle);
        }
    }

    /// Whether the legend covers nothing within the frame, or there is none.
    pub fn has_room_for_legend(&self) -> bool {
        let mut covered = self.covered();
        self.names(&mut covered);
        self.legend().is_none_or(|legend| legend.place_within(self.area, &covered).is_some())
    }

    fn legend(&self) -> Option<Legend<'a>> {
        Legend::of(self.panel, &self.room.x, &self.room.y)
    }

    fn draw_legend(&self, drawing: &mut Drawing, look: Look, covered: &mut Covered) {
        if let Some(legend) = &self.room.legend {
            let (width, right) = (legend.size()[0], self.cell.right() - RIGHT);
            let left = self.area.left.min(right - width).max(self.cell.left).floor() + 0.5;
            let top = self.area.top - self.room.top + self.room.head - legend.size()[1] - 8.0;
            legend.draw(drawing, [left, top], look);
        } else if let Some(legend) = self.legend()
            && let Some(rect) = legend.place_within(self.area, covered)
        {
            legend.draw(drawing, [rect.left, rect.top], look);
            covered.add(rect);
        }
    }

    /// Middles of marks within the frame, with the series of each.
    fn marks(&self) -> Vec<(usize, Point)> {
        let all = self.panel.series.iter().enumerate().flat_map(|(index, series)| match &series.marks {
            Marks::Points(points) | Marks::LineAndPoints(points) => {
                self.points(points).into_iter().map(|at| (index, at)).collect()
            }
            _ => Vec::new(),
        });
        all.filter(|(_, at)| self.area.contains(*at)).collect()
    }

    /// Open where a point of one series would hide one of another.
    fn look(&self) -> Look {
        let marks = self.marks();
        let (few, apart) = (100 * self.panel.series.len(), point_radius(0));
        let hides = |(index, [x, y]): &(usize, Point)| {
            let near = |[a, b]: &Point| f64::hypot(a - x, b - y) < apart;
            marks.iter().any(|(other, at)| other > index && near(at))
        };
        if marks.len() <= few && marks.iter().any(hides) { Look::Open } else { Look::Solid }
    }

    /// Places for names, which are then covered.
    fn names(&self, covered: &mut Covered) -> Vec<Placed> {
        let named = self.panel.names.iter().filter_map(|name| Some((self.point(name.at)?, name)));
        let named: Vec<_> = named.filter(|(at, _)| self.area.contains(*at)).collect();
        let marks: Vec<Point> = self.marks().into_iter().map(|(_, at)| at).collect();
        let placed = place(&named, &Obstacles { area: self.area, marks: &marks, lines: covered });
        for name in &placed {
            covered.add(name.rect);
            name.leader.iter().for_each(|[from, to]| covered.walk(*from, *to));
        }
        placed
    }

    fn draw_region(&self, drawing: &mut Drawing, region: &Region) {
        let x = &self.room.x;
        let Some((from, to)) = x.place_within(region.from).zip(x.place_within(region.to)) else { return };
        if from >= to {
            return;
        }
        let (left, right) = (self.at_x(from), self.at_x(to));
        let shade = Rect { left, top: self.area.top, width: right - left, height: self.area.height };
        drawing.fill(shade.outline(), ink(region.color, 0.12));
        // A firm stripe at the top says where the pale shade ends.
        let stripe = Rect { top: self.area.top - 4.0, height: 4.0, left: left + 0.5, width: right - left - 1.0 };
        drawing.fill(stripe.outline(), ink(region.color, 0.85));
    }

    /// Draws the grid, ticks and their numbers.
    fn draw_ticks(&self, drawing: &mut Drawing) {
        let Rect { left, top, .. } = self.area;
        let (right, bottom) = (self.area.right(), self.area.bottom());
        for tick in x_ticks(&self.room.x, self.area.width) {
            let x = self.at_x(tick.place);
            let (grid, mark) = if tick.label.is_some() { (GRID, TICK) } else { (MINOR_GRID, 0.6 * TICK) };
            drawing.stroke(Outline::Line(vec![[x, top], [x, bottom]]), grid);
            drawing.stroke(Outline::Line(vec![[x, bottom], [x, bottom + mark]]), FRAME);
            let label = tick.label.as_deref().unwrap_or_default();
            write(drawing, label, [x, bottom + TICK + TEXT + 3.0], TEXT, Anchor::Middle);
        }
        for tick in y_ticks(&self.room.y, self.cell.height, self.room.bottom) {
            let y = self.at_y(tick.place);
            let (grid, mark) = if tick.label.is_some() { (GRID, TICK) } else { (MINOR_GRID, 0.6 * TICK) };
            drawing.stroke(Outline::Line(vec![[left, y], [right, y]]), grid);
            drawing.stroke(Outline::Line(vec![[left - mark, y], [left, y]]), FRAME);
            let label = tick.label.as_deref().unwrap_or_default();
            write(drawing, label, [left - TICK - 4.0, y + MIDDLE * TEXT], TEXT, Anchor::End);
        }
    }

    /// Writes what the axes are, and the title.
    fn draw_names(&self, drawing: &mut Drawing) {
        let center = self.area.left + 0.5 * self.area.width;
        let middle = self.area.top + 0.5 * self.area.height;
        let foot = self.area.bottom() + TICK + LINE + LABEL + 3.0;
        write(drawing, &self.panel.x.label, [center, foot], LABEL, Anchor::Middle);
        write_upward(drawing, &self.panel.y.label, [self.cell.left + MARGIN + LABEL, middle], LABEL);
        // Above the middle of the frame, or as near to it as the cell has room, all lines alike.
        let widest = self.room.title.iter().map(|line| font::width(line, LABEL)).fold(0.0, f64::max);
        let half = 0.5 * widest + MARGIN;
        let [first, last] = [self.cell.left + half, self.cell.right() - half];
        let middle = if first <= last { center.clamp(first, last) } else { 0.5 * (first + last) };
        for (index, line) in self.room.title.iter().enumerate() {
            let baseline = self.cell.top + 6.0 + LABEL + LINE * index as f64;
            write(drawing, line, [middle, baseline], LABEL, Anchor::Middle);
        }
    }

    fn draw_lines(&self, drawing: &mut Drawing, series: &Series) {
        match &series.marks {
            Marks::Line(points) | Marks::LineAndPoints(points) => {
                drawing.stroke(Outline::Line(self.points(points)), line(series.color, 2.0, &[]));
            }
            Marks::Dashed(points) => {
                drawing.stroke(Outline::Line(self.points(points)), line(series.color, 2.0, dashes(series.color)));
            }
            Marks::ErrorBars(ranges) => {
                self.ranges(ranges).into_iter().for_each(|range| draw_error_bar(drawing, series.color, range));
            }
            Marks::Points(_) => {}
        }
    }

    fn draw_points(&self, drawing: &mut Drawing, series: &Series, look: Look) {
        let (Marks::Points(points) | Marks::LineAndPoints(points)) = &series.marks else { return };
        let radius = point_radius(points.len());
        for at in self.points(points).into_iter().filter(|at| self.area.contains(*at)) {
            draw_mark(drawing, series.color, at, radius, look);
        }
    }

    fn draw_top_labels(&self, drawing: &mut Drawing) {
        let labels = &self.room.top_labels;
        for (label, (row, start)) in labels.iter().zip(arrange(labels, self.area.left, self.area.width)) {
            let at = [start, self.area.top - 9.0 - row as f64 * LINE];
            write(drawing, label.text, at, TEXT, Anchor::Start);
        }
    }

    /// The center and the radius of a circle that the axes can show.
    fn circle(&self, at: [f64; 2], diameter: f64) -> Option<(Point, f64)> {
        let radius = (0.0..=FAR).contains(&diameter).then_some(0.5 * diameter)?;
        Some((self.point(at)?, radius))
    }

    fn draw_note(&self, drawing: &mut Drawing, note: &Note) {
        const WIDTH: f64 = 1.0;
        match note {
            Note::Line { points, color } => {
                drawing.stroke(Outline::Line(self.points(points)), line(*color, WIDTH, &[]));
            }
            Note::Circle { at, diameter, color } => {
                if let Some((center, radius)) = self.circle(*at, *diameter) {
                    drawing.stroke(Outline::Circle(center, radius), line(*color, WIDTH, &[]));
                }
            }
            Note::Text { .. } => {}
        }
    }

    fn write_note(&self, drawing: &mut Drawing, note: &Note) {
        if let Note::Text { at, anchor, text } = note
            && let Some([x, y]) = self.point(*at).filter(|at| self.area.contains(*at))
        {
            write(drawing, text, [x, y + MIDDLE * TEXT], TEXT, *anchor);
        }
    }

    /// Places within the frame that are better not covered.
    fn covered(&self) -> Covered {
        let mut covered = Covered::default();
        for series in &self.panel.series {
            match &series.marks {
                Marks::Line(points) | Marks::Dashed(points) | Marks::LineAndPoints(points) => {
                    self.points(points).windows(2).for_each(|pair| covered.walk(pair[0], pair[1]));
                }
                Marks::Points(points) => self.points(points).into_iter().for_each(|at| covered.walk(at, at)),
                Marks::ErrorBars(ranges) => {
                    self.ranges(ranges).into_iter().for_each(|[x, low, high]| covered.walk([x, low], [x, high]));
                }
            }
        }
        self.panel.notes.iter().for_each(|note| self.cover_note(note, &mut covered));
        self.vertical_lines().for_each(|x| covered.walk([x, self.area.top], [x, self.area.bottom()]));
        self.horizontal_lines().for_each(|(y, _)| covered.walk([self.area.left, y], [self.area.right(), y]));
        covered.keep_within(self.area);
        covered
    }

    fn cover_note(&self, note: &Note, covered: &mut Covered) {
        match note {
            Note::Line { points, .. } => {
                self.points(points).windows(2).for_each(|pair| covered.walk(pair[0], pair[1]));
            }
            Note::Circle { at, diameter, .. } => {
                if let Some(([x, y], radius)) = self.circle(*at, *diameter) {
                    covered.walk([x - radius, y], [x + radius, y]);
                    covered.walk([x, y - radius], [x, y + radius]);
                }
            }
            Note::Text { at, anchor, text } => {
                let width = font::width(text, TEXT);
                let before = match anchor {
                    Anchor::Start => 0.0,
                    Anchor::Middle => 0.5 * width,
                    Anchor::End => width,
                };
                if let Some([x, y]) = self.point(*at) {
                    covered.add(Rect { left: x - before, top: y - 0.5 * TEXT, width, height: TEXT });
                }
            }
        }
    }
}

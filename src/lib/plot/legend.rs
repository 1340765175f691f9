//! Where the legend and names of lines go: where they cover least.

use super::drawing::{Drawing, Ink, Point, Rect, Stroke};
use super::figure::{Anchor, Marks, Panel, Series};
use super::font;
use super::marks::{Look, draw_swatch};
use super::ruler::Ruler;
use super::style::{LINE, MIDDLE, SWATCH, TEXT, write};

/// Places on the canvas that are better not covered, a few pixels apart.
#[derive(Debug, Default, Clone)]
pub(super) struct Covered {
    places: Vec<Point>,
}

impl Covered {
    const STEP: f64 = 5.0;

    /// Adds a straight line.
    pub fn walk(&mut self, from: Point, to: Point) {
        let steps = (f64::hypot(to[0] - from[0], to[1] - from[1]) / Self::STEP).ceil().clamp(1.0, 4000.0);
        let mut along = 0.0;
        while along <= steps {
            let part = along / steps;
            self.places.push([from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]);
            along += 1.0;
        }
    }

    /// Adds a rectangle.
    pub fn add(&mut self, rect: Rect) {
        let mut y = rect.top;
        while y <= rect.bottom() {
            self.walk([rect.left, y], [rect.right(), y]);
            y += Self::STEP;
        }
    }

    /// Forgets what lies outside.
    pub fn keep_within(&mut self, area: Rect) {
        self.places.retain(|at| area.contains(*at));
    }

    /// How much a rectangle with some room about it would cover.
    pub fn cost(&self, rect: Rect) -> usize {
        let room =
            Rect { left: rect.left - 4.0, top: rect.top - 4.0, width: rect.width + 8.0, height: rect.height + 8.0 };
        self.places.iter().filter(|at| room.contains(**at)).count()
    }
}

/// What a legend says, and how large it is.
pub(super) struct Legend<'a> {
    named: Vec<&'a Series>,
    /// Their names, as long as there is room for.
    names: Vec<String>,
    /// Of each column.
    widths: Vec<f64>,
    rows: usize,
}

impl<'a> Legend<'a> {
    /// The legend of a panel on its rulers in one column, of the series that are seen there; `None` where none of them has a name.
    pub fn of(panel: &'a Panel, x: &Ruler, y: &Ruler) -> Option<Self> {
        let is_listed = |series: &&Series| !series.name.is_empty() && is_seen(&series.marks, x, y);
        let named: Vec<&Series> = panel.series.iter().filter(is_listed).collect();
        let rows = named.len();
        let names: Vec<String> = named.iter().map(|series| series.name.clone()).collect();
        (rows > 0).then(|| Self { widths: widths(&names, rows), named, names, rows })
    }

    /// The same in as many columns as have room in a width, all about equally long, and with names that are no longer than `most` has
    /// room for.
    pub fn spread(self, width: f64, most: f64) -> Self {
        let short = |name: &String| font::shortened(name, TEXT, most - BESIDE_NAME);
        let names: Vec<String> = self.names.iter().map(short).collect();
        let fits = |rows: &usize| widths(&names, *rows).iter().sum::<f64>() <= width;
        let rows = (1..self.rows).find(fits).unwrap_or(self.rows);
        Self { widths: widths(&names, rows), names, rows, ..self }
    }

    /// Width and height.
    pub fn size(&self) -> [f64; 2] {
        [self.widths.iter().sum(), LINE * self.rows as f64 + 8.0]
    }

    /// Where it covers nothing within the frame, at best in a corner; `None` where there is no such place.
    pub fn place_within(&self, area: Rect, covered: &Covered) -> Option<Rect> {
        let [width, height] = self.size();
        let (free_x, free_y) = (area.width - width - 20.0, area.height - height - 20.0);
        if free_x < 0.0 || free_y < 0.0 {
            return None;
        }
        // Corners first, then the other places of a grid; the first that is free is taken.
        const STEPS: [f64; 9] = [1.0, 0.0, 0.875, 0.125, 0.75, 0.25, 0.625, 0.375, 0.5];
        let places = STEPS.iter().flat_map(|along| STEPS.iter().map(move |up| (*along, *up)));
        let at = |(along, up): (f64, f64)| Rect {
            left: (area.left + 10.0 + along * free_x).round() + 0.5,
            top: (area.top + 10.0 + (1.0 - up) * free_y).round() + 0.5,
            width,
            height,
        };
        places.map(at).find(|rect| covered.cost(*rect) == 0)
    }

    /// Draws it with its upper left corner at a place.
    pub fn draw(&self, drawing: &mut Drawing, [left, top]: Point, look: Look) {
        let [width, height] = self.size();
        drawing.shape(
            Rect { left, top, width, height }.outline(),
            Ink { rgb: [0xff; 3], opacity: 0.88 },
            Stroke { ink: Ink { rgb: [0; 3], opacity: 0.25 }, width: 1.0, dashes: &[] },
        );
        for (index, (series, name)) in self.named.iter().zip(&self.names).enumerate() {
            let (column, row) = (index / self.rows, index % self.rows);
            let middle = top + 4.0 + (row as f64 + 0.5) * LINE;
            let left = left + 8.0 + self.widths[..column].iter().sum::<f64>();
            draw_swatch(drawing, series, [left, middle], look);
            let baseline = [left + SWATCH + 8.0, middle + MIDDLE * TEXT];
            write(drawing, name, baseline, TEXT, Anchor::Start);
        }
    }
}

/// Whether any of what is drawn for a series lies within the axes; what has no marks is for the legend alone.
fn is_seen(marks: &Marks, x: &Ruler, y: &Ruler) -> bool {
    let place = |[at_x, at_y]: &[f64; 2]| Some([x.place(*at_x)?, y.place(*at_y)?]);
    let is_within = |place: f64| (0.0..=1.0).contains(&place);
    match marks {
        none if none.is_empty() => true,
        Marks::Line(points) | Marks::Dashed(points) | Marks::LineAndPoints(points) => {
            let places: Vec<Point> = points.iter().filter_map(place).collect();
            places.windows(2).any(|pair| crosses(pair[0], pair[1]))
                || places.first().is_some_and(|at| crosses(*at, *at))
        }
        Marks::Points(points) => points.iter().filter_map(place).any(|at| at.into_iter().all(is_within)),
        Marks::ErrorBars(ranges) => ranges.iter().any(|[at_x, low, high]| {
            let foot = || y.place_within(*low);
            let ends = x.place(*at_x).zip(y.place(*low).or_else(foot)).zip(y.place(*high));
            ends.is_some_and(|((at, low), high)| crosses([at, low], [at, high]))
        }),
    }
}

/// Whether a straight line touches the square from 0 to 1 [Liang and Barsky, ACM Trans. Graph. 3 (1984), 1].
fn crosses(from: Point, to: Point) -> bool {
    let (mut begin, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (start, step) = (from[axis], to[axis] - from[axis]);
        if step == 0.0 {
            if !(0.0..=1.0).contains(&start) {
                return false;
            }
            continue;
        }
        let [one, other] = [-start / step, (1.0 - start) / step];
        (begin, end) = (begin.max(one.min(other)), end.min(one.max(other)));
    }
    begin <= end
}

/// What a column takes beside names.
const BESIDE_NAME: f64 = SWATCH + 26.0;

/// The width of each column of so many rows.
fn widths(names: &[String], rows: usize) -> Vec<f64> {
    let of = |name: &String| font::width(name, TEXT) + BESIDE_NAME;
    names.chunks(rows).map(|column| column.iter().map(of).fold(0.0, f64::max)).collect()
}

/// Writes beside a horizontal line at `y` what it is, at the end where it covers least.
pub(super) fn draw_line_label(drawing: &mut Drawing, label: &str, y: f64, area: Rect, covered: &mut Covered) {
    if label.is_empty() {
        return;
    }
    let width = font::width(label, TEXT);
    let (left, right) = (area.left + 8.0, area.right() - 8.0 - width);
    let center = 0.5 * (left + right);
    let (above, below) = (y - 3.0 - TEXT, y + 3.0);
    let places = [right, left, center].into_iter().flat_map(|left| [above, below].map(|top| (left, top)));
    let rect = places
        .map(|(left, top)| Rect { left, top, width, height: TEXT })
        .filter(|rect| rect.top > area.top && rect.bottom() < area.bottom())
        .min_by_key(|rect| covered.cost(Rect { height: TEXT - 4.0, top: rect.top + 2.0, ..*rect }));
    if let Some(rect) = rect {
        write(drawing, label, [rect.left, rect.top + TEXT * 0.85], TEXT, Anchor::Start);
        covered.add(rect);
    }
}

//! What a plot shows: panels, axes, series and what else stands between the axes.

/// A figure: one panel or several.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// What stands above all; may be empty.
    pub title: String,
    /// The panels, top to bottom or left to right.
    pub panels: Vec<Panel>,
    /// How several panels are arranged.
    pub arrangement: Arrangement,
}

/// How the panels of a plot are arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Arrangement {
    /// One below the other, their left edges aligned.
    #[default]
    Stacked,
    /// One beside the other.
    SideBySide,
    /// Two beside each other, row by row; of an odd number the first is as wide as two.
    Pairs,
}

/// Two axes and what is shown between them.
///
/// Whatever an axis cannot show (not finite, or not positive on a logarithmic one) is left out, and a line goes on from
/// the point before it to the point after.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What stands above the panel; may be empty.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is shown, later ones above earlier ones.
    pub series: Vec<Series>,
    /// Shaded ranges of x.
    pub regions: Vec<Region>,
    /// Vertical lines, at values of x.
    pub vertical_lines: Vec<ReferenceLine>,
    /// Horizontal lines, at values of y.
    pub horizontal_lines: Vec<ReferenceLine>,
    /// Thin shapes and words, above all series.
    pub notes: Vec<Note>,
    /// Words beside points, the most important first.
    pub names: Vec<Name>,
    /// Whether a unit (on logarithmic axes: a factor) is equally long on both axes. The panel becomes narrower or lower;
    /// where less than a tenth of it would be left, it stays as it is.
    pub equal_scale: bool,
    /// Whether axes are drawn, with all between them; without, the title stands alone.
    pub has_axes: bool,
}

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps are equally long.
    Linear,
    /// Equal factors are equally long.
    Log10,
    /// Equal steps of the inverse are equally long, as those of color temperatures are about equally visible.
    Reciprocal,
}

/// What one direction of a panel means.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity and its unit.
    pub label: String,
    /// How values are spread.
    pub scale: Scale,
    /// The lowest and the highest value; from what is shown where there is none (or none that makes sense).
    pub range: Option<(f64, f64)>,
}

/// Numbers that belong together, and how they are shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What the legend says; a series without a name, or with marks of which the axes show nothing, is not in the legend.
    pub name: String,
    /// The color, which also chooses the form of points.
    pub color: Color,
    /// The numbers.
    pub marks: Marks,
}

/// What is drawn for a series. Points are `[x, y]`.
#[derive(Debug, Clone, PartialEq)]
pub enum Marks {
    /// A line through the points, in their order.
    Line(Vec<[f64; 2]>),
    /// A dashed line.
    Dashed(Vec<[f64; 2]>),
    /// A mark at every point.
    Points(Vec<[f64; 2]>),
    /// A line and a mark at every point.
    LineAndPoints(Vec<[f64; 2]>),
    /// A vertical bar with caps at every `[x, low, high]`. What a logarithmic axis cannot show of a lower end reaches down
    /// to its foot.
    ErrorBars(Vec<[f64; 3]>),
}

/// A shaded range of x, such as a regime of noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Where it begins; −∞, or 0 on a logarithmic axis, for the edge of the panel.
    pub from: f64,
    /// Where it ends; ∞ for the edge of the panel.
    pub to: f64,
    /// What stands above it; may be empty.
    pub label: String,
    /// The color, of which the shade is a pale one.
    pub color: Color,
}

/// A line across the panel at one value.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceLine {
    /// The value; a line outside the range of its axis is not drawn.
    pub at: f64,
    /// What stands beside it; may be empty.
    pub label: String,
}

/// A thin shape or a word at places of the panel, `[x, y]` in the units of its axes. It is drawn within the frame and does
/// not widen the axes; the legend keeps away from it.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// A straight line from point to point.
    Line {
        /// The points.
        points: Vec<[f64; 2]>,
        /// The color.
        color: Color,
    },
    /// A circle.
    Circle {
        /// Its center.
        at: [f64; 2],
        /// Its diameter in pixels.
        diameter: f64,
        /// The color.
        color: Color,
    },
    /// A word, left out where its place is outside the frame.
    Text {
        /// Where it stands, half way up its digits.
        at: [f64; 2],
        /// Which part of it stands there.
        anchor: Anchor,
        /// What it says.
        text: String,
    },
}

/// A word that belongs to a point. It stands where it covers no mark, no other word and, if that can be, no line; at the end of
/// a thin line where there is no such place beside its point. Points so near to each other that their marks touch share a
/// word that all of them have.
#[derive(Debug, Clone, PartialEq)]
pub struct Name {
    /// The point, `[x, y]` in the units of the axes.
    pub at: [f64; 2],
    /// What it says.
    pub text: String,
    /// The color, that of the point.
    pub color: Color,
}

/// Which part of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Its left end.
    Start,
    /// Its middle.
    Middle,
    /// Its right end.
    End,
}

/// The colors of Okabe and Ito, which the color-blind can tell apart (<https://jfly.uni-koeln.de/color/>), and a gray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Color {
    /// #0072B2.
    Blue,
    /// #D55E00.
    Vermillion,
    /// #009E73.
    Green,
    /// #CC79A7.
    Purple,
    /// #E69F00.
    Orange,
    /// #56B4E9.
    SkyBlue,
    /// #000000.
    Black,
    /// #F0E442; pale on white, for areas rather than lines.
    Yellow,
    /// #777777.
    Gray,
}

impl Plot {
    /// A plot of one panel.
    pub fn new(title: &str, panel: Panel) -> Self {
        Self { title: title.into(), panels: vec![panel], arrangement: Arrangement::Stacked }
    }
}

impl Panel {
    /// A panel that shows nothing yet.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            title: String::new(),
            x,
            y,
            series: Vec::new(),
            regions: Vec::new(),
            vertical_lines: Vec::new(),
            horizontal_lines: Vec::new(),
            notes: Vec::new(),
            names: Vec::new(),
            equal_scale: false,
            has_axes: true,
        }
    }

    /// Adds a series; see [`Series`].
    pub fn add(&mut self, name: &str, color: Color, marks: Marks) {
        self.series.push(Series { name: name.into(), color, marks });
    }

    /// Names a point; see [`Name`].
    pub fn name(&mut self, at: [f64; 2], text: &str, color: Color) {
        self.names.push(Name { at, text: text.into(), color });
    }
}

impl Axis {
    /// A linear axis as long as what is shown.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), scale: Scale::Linear, range: None }
    }

    /// A logarithmic axis as long as what is shown.
    pub fn log10(label: &str) -> Self {
        Self { label: label.into(), scale: Scale::Log10, range: None }
    }

    /// The same axis from one value to another.
    pub fn range(self, low: f64, high: f64) -> Self {
        Self { range: Some((low, high)), ..self }
    }

    /// The same axis with this part of its range more at each end.
    #[must_use]
    pub fn widened(self, part: f64) -> Self {
        let range = self.range.map(|(low, high)| (low - part * (high - low), high + part * (high - low)));
        Self { range, ..self }
    }
}

impl Marks {
    pub(super) fn points(&self) -> &[[f64; 2]] {
        match self {
            Self::Line(points) | Self::Dashed(points) | Self::Points(points) | Self::LineAndPoints(points) => points,
            Self::ErrorBars(_) => &[],
        }
    }

    pub(super) fn ranges(&self) -> &[[f64; 3]] {
        if let Self::ErrorBars(ranges) = self { ranges } else { &[] }
    }

    /// Whether there is nothing to show.
    pub fn is_empty(&self) -> bool {
        self.points().is_empty() && self.ranges().is_empty()
    }

    /// All that the x axis should reach.
    pub(super) fn xs(&self) -> impl Iterator<Item = f64> {
        self.points().iter().map(|[x, _]| *x).chain(self.ranges().iter().map(|[x, ..]| *x))
    }

    /// All that the y axis should reach.
    pub(super) fn ys(&self) -> impl Iterator<Item = f64> {
        let ends = self.ranges().iter().flat_map(|[_, low, high]| [*low, *high]);
        self.points().iter().map(|[_, y]| *y).chain(ends)
    }
}

impl Color {
    /// The color for the series of this number, from 0; after seven they begin again.
    pub fn of_index(index: usize) -> Self {
        const CYCLE: [Color; 7] =
            [Color::Blue, Color::Vermillion, Color::Green, Color::Purple, Color::Orange, Color::SkyBlue, Color::Black];
        CYCLE[index % CYCLE.len()]
    }

    pub(super) fn rgb(self) -> [u8; 3] {
        match self {
            Self::Blue => [0x00, 0x72, 0xb2],
            Self::Vermillion => [0xd5, 0x5e, 0x00],
            Self::Green => [0x00, 0x9e, 0x73],
            Self::Purple => [0xcc, 0x79, 0xa7],
            Self::Orange => [0xe6, 0x9f, 0x00],
            Self::SkyBlue => [0x56, 0xb4, 0xe9],
            Self::Black => [0x00, 0x00, 0x00],
            Self::Yellow => [0xf0, 0xe4, 0x42],
            Self::Gray => [0x77, 0x77, 0x77],
        }
    }
}

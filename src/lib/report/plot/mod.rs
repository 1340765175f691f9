//! Plots: curves, points and histograms on linear or logarithmic axes, as SVG and as PNG.
//!
//! A [`Plot`] says what is shown; where the margins, ticks, labels and the legend go follows from it. Both files hold the
//! same drawing. A PNG needs no font of the system: one is embedded.

mod axis;
mod drawing;
mod font;
mod layout;

use crate::error::{Error, Result};
use crate::formats::files::FileId;
use crate::formats::output::write_bytes;
pub use axis::{Axis, Scale, power_of_ten};
use std::path::Path;

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
    /// Arrows, above all series.
    pub arrows: Vec<Arrow>,
    /// What the diameters of circles mean, for the legend.
    pub circle_sizes: Vec<CircleSize>,
    /// Whether a unit (on logarithmic axes: a factor) is equally long on both axes. The panel becomes narrower or lower;
    /// where less than a tenth of it would be left, it stays as it is.
    pub equal_scale: bool,
    /// A small panel in a corner of this one.
    pub inset: Option<Box<Inset>>,
}

/// An arrow from one point of a panel to another. Its ends do not widen the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrow {
    /// Where it begins.
    pub from: [f64; 2],
    /// What it points at; the tip stops a few pixels before.
    pub to: [f64; 2],
    /// What stands where it begins; may be empty.
    pub label: String,
    /// The color.
    pub color: Color,
}

/// A circle in the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct CircleSize {
    /// Its diameter in pixels.
    pub diameter: f64,
    /// What a circle of this size means.
    pub label: String,
    /// The color.
    pub color: Color,
}

/// A small panel within another, on white.
#[derive(Debug, Clone, PartialEq)]
pub struct Inset {
    /// What is shown: without legend, and without an inset of its own.
    pub panel: Panel,
    /// Where it is.
    pub corner: Corner,
    /// The part of the width and of the height of the frame that it takes with its labels, from 0 to 1.
    pub share: f64,
}

/// A corner of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corner {
    /// Above, left.
    TopLeft,
    /// Above, right.
    TopRight,
    /// Below, left.
    BottomLeft,
    /// Below, right.
    BottomRight,
}

/// Numbers that belong together, and how they are shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What the legend says; a series without a name is not in the legend.
    pub name: String,
    /// The color, which also chooses the form of points.
    pub color: Color,
    /// The numbers.
    pub marks: Marks,
}

/// What is drawn for a series. Points are `[x, y]`, ranges `[x, low, high]`.
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
    /// A bar about every x, from zero (or the foot of a logarithmic axis) to y.
    Bars {
        /// The width of a bar, in the unit of x.
        width: f64,
        /// Where bars stand and end.
        tops: Vec<[f64; 2]>,
    },
    /// The area between two curves. What a logarithmic axis cannot show of a lower end reaches down to its foot.
    Band(Vec<[f64; 3]>),
    /// A vertical bar with caps at every x; lower ends as for bands.
    ErrorBars(Vec<[f64; 3]>),
    /// Straight thin lines, each from `[x0, y0]` to `[x1, y1]`: `[x0, y0, x1, y1]`.
    Segments(Vec<[f64; 4]>),
    /// Thin circles: `[x, y, diameter]`, the diameter in pixels. See [`Panel::circle_sizes`].
    Circles(Vec<[f64; 3]>),
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

impl Color {
    /// The color for the series of this number, from 0; after seven they begin again.
    pub fn of_index(index: usize) -> Self {
        const CYCLE: [Color; 7] =
            [Color::Blue, Color::Vermillion, Color::Green, Color::Purple, Color::Orange, Color::SkyBlue, Color::Black];
        CYCLE[index % CYCLE.len()]
    }

    fn rgb(self) -> [u8; 3] {
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
            arrows: Vec::new(),
            circle_sizes: Vec::new(),
            equal_scale: false,
            inset: None,
        }
    }

    /// Adds a series; see [`Series`].
    pub fn add(&mut self, name: &str, color: Color, marks: Marks) {
        self.series.push(Series { name: name.into(), color, marks });
    }
}

/// The file formats of plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotFormat {
    /// Scalable vector graphics.
    Svg,
    /// Portable network graphics.
    Png,
}

impl PlotFormat {
    /// The format that the extension of a name asks for. Programs ask before they do long work.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for any but `.svg` and `.png`.
    pub fn of_path(path: &Path) -> Result<Self> {
        match path.extension().map(|end| end.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::Usage(format!(
                "{}: a plot is written as SVG or PNG; end the name in .svg or .png",
                path.display()
            ))),
        }
    }
}

impl Plot {
    /// A plot of one panel.
    pub fn new(title: &str, panel: Panel) -> Self {
        Self { title: title.into(), panels: vec![panel], arrangement: Arrangement::Stacked }
    }

    /// The plot as an SVG document. Its text is text, in DejaVu Sans or what the viewer has instead.
    pub fn svg(&self) -> String {
        layout::draw(self).svg()
    }

    /// The plot as a PNG, one pixel for each unit of the SVG: 900 × 600 for a single panel.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] when so many panels make no picture.
    pub fn png(&self) -> Result<Vec<u8>> {
        layout::draw(self).png()
    }

    /// Writes the plot to a file, as its extension says. `input` is the file that was read, if it is one.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for an extension other than `.svg` and `.png`, or where the output is the input; [`Error::Disk`].
    pub fn write(&self, path: &Path, input: Option<&(FileId, String)>) -> Result<()> {
        let bytes = match PlotFormat::of_path(path)? {
            PlotFormat::Svg => self.svg().into_bytes(),
            PlotFormat::Png => self.png()?,
        };
        write_bytes(path, &bytes, input)
    }
}

#[cfg(test)]
mod tests;

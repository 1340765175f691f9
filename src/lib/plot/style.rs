//! Sizes in pixels, inks and type, the same for all plots.

use super::drawing::{Drawing, Ink, Point, Stroke, Text};
use super::figure::{Anchor, Color};

/// Type: the plot's title, panels' titles and axes' labels, numbers and names: large enough to be read where a plot of 900
/// pixels is shown with 500.
pub(super) const TITLE: f64 = 19.0;
pub(super) const LABEL: f64 = 17.0;
pub(super) const TEXT: f64 = 16.0;
/// The distance of lines of text.
pub(super) const LINE: f64 = 21.0;
/// The same of the plot's title.
pub(super) const TITLE_LINE: f64 = 25.0;
/// From the baseline of digits to their middle, as a part of the size.
pub(super) const MIDDLE: f64 = 0.365;

/// Room above the title and to the left of the y axis's label.
pub(super) const MARGIN: f64 = 14.0;
/// Room to the right of the frame, for half a tick's label.
pub(super) const RIGHT: f64 = 28.0;
/// Room below the x axis's label, for what goes below the baseline and the next panel.
pub(super) const FOOT: f64 = 17.0;
pub(super) const TICK: f64 = 5.0;
/// The width of what the legend shows of a series.
pub(super) const SWATCH: f64 = 30.0;

pub(super) const TEXT_RGB: [u8; 3] = [0x22; 3];
pub(super) const FRAME: Stroke = Stroke { ink: Ink { rgb: [0x44; 3], opacity: 1.0 }, width: 1.0, dashes: &[] };
pub(super) const GRID: Stroke = Stroke { ink: Ink { rgb: [0; 3], opacity: 0.14 }, width: 1.0, dashes: &[] };
pub(super) const MINOR_GRID: Stroke = Stroke { ink: Ink { rgb: [0; 3], opacity: 0.05 }, width: 1.0, dashes: &[] };
pub(super) const REFERENCE: Stroke =
    Stroke { ink: Ink { rgb: [0x33; 3], opacity: 1.0 }, width: 1.2, dashes: &[2.0, 3.0] };

/// Dashes of a color: lines can be told apart in a gray print too.
pub(super) fn dashes(color: Color) -> &'static [f64] {
    match color {
        Color::Blue => &[8.0, 4.0],
        Color::Gray => &[7.0, 7.0],
        Color::Vermillion => &[14.0, 4.0],
        Color::Green => &[4.0, 3.0],
        Color::Purple => &[10.0, 3.0, 2.0, 3.0],
        Color::Orange => &[14.0, 3.0, 2.0, 3.0, 2.0, 3.0],
        Color::SkyBlue => &[2.0, 2.0],
        Color::Black | Color::Yellow => &[6.0, 4.0],
    }
}

pub(super) fn ink(color: Color, opacity: f64) -> Ink {
    Ink { rgb: color.rgb(), opacity }
}

pub(super) fn line(color: Color, width: f64, dashes: &'static [f64]) -> Stroke {
    Stroke { ink: ink(color, 1.0), width, dashes }
}

/// Writes a line of text, its baseline at a place.
pub(super) fn write(drawing: &mut Drawing, text: &str, at: Point, size: f64, anchor: Anchor) {
    drawing.text(Text { text: text.into(), at, size, anchor, upward: false, rgb: TEXT_RGB });
}

/// Writes a line of text from bottom to top.
pub(super) fn write_upward(drawing: &mut Drawing, text: &str, at: Point, size: f64) {
    drawing.text(Text { text: text.into(), at, size, anchor: Anchor::Middle, upward: true, rgb: TEXT_RGB });
}

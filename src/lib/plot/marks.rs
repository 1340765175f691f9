//! How series look, between the axes and in the legend.

use super::drawing::{Drawing, Ink, Outline, Point, Stroke};
use super::figure::{Color, Marks, Series};
use super::style::{SWATCH, dashes, ink, line};

/// The more points, the smaller.
pub(super) fn point_radius(count: usize) -> f64 {
    match count {
        0..=100 => 5.0,
        101..=500 => 2.5,
        _ => 1.6,
    }
}

/// The points of a panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Look {
    /// Filled.
    Solid,
    /// Little more than outlines, for points that lie over each other.
    Open,
}

/// Draws a point: each color has a form of its own.
pub(super) fn draw_mark(drawing: &mut Drawing, color: Color, [x, y]: Point, radius: f64, look: Look) {
    let polygon = |corners: &[Point]| {
        Outline::Polygon(corners.iter().map(|[dx, dy]| [x + dx * radius, y + dy * radius]).collect())
    };
    let outline = match color {
        Color::Blue | Color::Yellow => Outline::Circle([x, y], radius),
        Color::Black => polygon(&[[-1.2, -0.4], [0.0, -1.3], [1.2, -0.4], [0.75, 1.0], [-0.75, 1.0]]),
        Color::Gray => polygon(&[[-1.2, -0.6], [1.2, -0.6], [1.2, 0.6], [-1.2, 0.6]]),
        Color::Vermillion => polygon(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
        Color::Green => polygon(&[[0.0, -1.1], [1.1, 0.9], [-1.1, 0.9]]),
        Color::Purple => polygon(&[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]]),
        Color::Orange => polygon(&[[0.0, 1.1], [1.1, -0.9], [-1.1, -0.9]]),
        Color::SkyBlue => polygon(&[[-1.1, 0.0], [-0.5, -1.0], [0.5, -1.0], [1.1, 0.0], [0.5, 1.0], [-0.5, 1.0]]),
    };
    // A white rim keeps points apart from each other and from lines of their color.
    let rim = Stroke { ink: Ink { rgb: [0xff; 3], opacity: 0.9 }, width: f64::min(0.8, 0.32 * radius), dashes: &[] };
    match look {
        Look::Solid => drawing.shape(outline, ink(color, 1.0), rim),
        Look::Open => drawing.shape(outline, ink(color, 0.15), line(color, 1.6, &[])),
    }
}

pub(super) fn draw_error_bar(drawing: &mut Drawing, color: Color, [x, low, high]: [f64; 3]) {
    let cap = |y| [[x - 3.0, y], [x + 3.0, y]];
    for ends in [[[x, low], [x, high]], cap(low), cap(high)] {
        drawing.stroke(Outline::Line(ends.to_vec()), line(color, 1.2, &[]));
    }
}

/// Draws what the legend shows of a series; `at` is its left end.
pub(super) fn draw_swatch(drawing: &mut Drawing, series: &Series, [left, y]: Point, look: Look) {
    let ends = || Outline::Line(vec![[left, y], [left + SWATCH, y]]);
    let center = left + 0.5 * SWATCH;
    match &series.marks {
        Marks::Line(_) | Marks::LineAndPoints(_) => drawing.stroke(ends(), line(series.color, 2.0, &[])),
        Marks::Dashed(_) => drawing.stroke(ends(), line(series.color, 2.0, dashes(series.color))),
        Marks::ErrorBars(_) => draw_error_bar(drawing, series.color, [center, y + 6.0, y - 6.0]),
        Marks::Points(_) => {}
    }
    if matches!(series.marks, Marks::Points(_) | Marks::LineAndPoints(_)) {
        draw_mark(drawing, series.color, [center, y], 5.0, look);
    }
}

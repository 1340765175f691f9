//! Where the panels of a plot go.

use super::drawing::{Drawing, Rect};
use super::figure::{Anchor, Arrangement, Plot};
use super::pane::Pane;
use super::room::Room;
use super::style::{MARGIN, TITLE, write};

/// Lays a plot out.
pub(super) fn draw(plot: &Plot) -> Drawing {
    // 900 × 600 for one panel; of several, each gets somewhat less.
    let count = plot.panels.len().max(1);
    let title_height = if plot.title.is_empty() { 0.0 } else { TITLE + 12.0 };
    let (columns, cell_width, cell_height) = match (plot.arrangement, count) {
        (_, 1) => (1, 900.0, 600.0 - title_height - MARGIN),
        (Arrangement::Stacked, _) => (1, 900.0, 400.0),
        (Arrangement::SideBySide, _) => (count, 640.0, 500.0),
    };
    let rows = count.div_ceil(columns);
    let width = cell_width * columns as f64;
    let height = title_height + MARGIN + cell_height * rows as f64;
    let mut drawing = Drawing::new(width, height, &plot.title);
    write(&mut drawing, &plot.title, [0.5 * width, MARGIN + TITLE], TITLE, Anchor::Middle);

    let rooms: Vec<Room> = plot.panels.iter().map(|panel| Room::new(panel, cell_width, cell_height)).collect();
    let widest = rooms.iter().map(|room| room.left).fold(0.0, f64::max);
    let tallest = rooms.iter().map(|room| room.top).fold(0.0, f64::max);
    for (index, (panel, room)) in plot.panels.iter().zip(&rooms).enumerate() {
        let (column, row) = (index % columns, index / columns);
        let cell = Rect {
            left: column as f64 * cell_width,
            top: title_height + MARGIN + row as f64 * cell_height,
            width: cell_width,
            height: cell_height,
        };
        // Edges of panels that share a row or a column are aligned.
        let (left, top) = if columns == 1 { (widest, room.top) } else { (room.left, tallest) };
        Pane::new(panel, room, cell, left, top).draw(&mut drawing);
    }
    drawing
}

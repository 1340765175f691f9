//! Where the panels of a plot go.

use super::drawing::{Drawing, Rect};
use super::figure::{Anchor, Arrangement, Panel, Plot};
use super::font;
use super::pane::Pane;
use super::room::Room;
use super::style::{MARGIN, TITLE, TITLE_LINE, write};

/// Lays a plot out.
pub(super) fn draw(plot: &Plot) -> Drawing {
    // 900 × 600 for one panel; of several, each gets somewhat less.
    let count = plot.panels.len().max(1);
    let (columns, cell_width, cell_height) = match (plot.arrangement, count) {
        (_, 1) => (1, 900.0, 600.0),
        (Arrangement::Stacked, _) => (1, 900.0, 400.0),
        (Arrangement::SideBySide, _) => (count, 560.0, 500.0),
        (Arrangement::Pairs, _) => (2, 520.0, 390.0),
    };
    let width = cell_width * columns as f64;
    let title = font::lines(&plot.title, TITLE, width - 2.0 * MARGIN);
    let title_height = match title.len() {
        0 => 0.0,
        lines => TITLE + 12.0 + TITLE_LINE * (lines - 1) as f64,
    };
    // A single panel is as high as what the title leaves, of at most two lines.
    let cell_height = match count {
        1 => (cell_height - title_height - MARGIN).max(cell_height - MARGIN - TITLE - 12.0 - TITLE_LINE),
        _ => cell_height,
    };
    // The first panel of an odd number takes two places.
    let is_wide = |index: usize| plot.arrangement == Arrangement::Pairs && count > 1 && count % 2 == 1 && index == 0;
    let rows = (count + usize::from(is_wide(0))).div_ceil(columns);
    let height = title_height + MARGIN + cell_height * rows as f64;
    let mut drawing = Drawing::new(width, height, &plot.title);
    for (index, line) in title.iter().enumerate() {
        let baseline = MARGIN + TITLE + TITLE_LINE * index as f64;
        write(&mut drawing, line, [0.5 * width, baseline], TITLE, Anchor::Middle);
    }

    let width_of = |index: usize| if is_wide(index) { 2.0 * cell_width } else { cell_width };
    let panels = plot.panels.iter().enumerate();
    let mut rooms: Vec<Room> = panels.map(|(index, panel)| Room::new(panel, width_of(index), cell_height)).collect();
    let cell_of = |index: usize| {
        let place = if is_wide(0) && index > 0 { index + 1 } else { index };
        let (column, row) = (place % columns, place / columns);
        Rect {
            left: column as f64 * cell_width,
            top: title_height + MARGIN + row as f64 * cell_height,
            width: width_of(index),
            height: cell_height,
        }
    };
    let widest = rooms.iter().map(|room| room.left).fold(0.0, f64::max);
    let row_of = |index: usize| (index + usize::from(is_wide(0) && index > 0)) / columns;
    let tallest = |rooms: &[Room], row: usize| {
        let of_row = rooms.iter().enumerate().filter(|(index, _)| row_of(*index) == row);
        of_row.map(|(_, room)| room.top).fold(0.0, f64::max)
    };
    // Edges of panels that share a row or a column are aligned.
    let edges = |rooms: &[Room], index: usize| match plot.arrangement {
        Arrangement::Pairs => (widest, tallest(rooms, row_of(index))),
        _ if columns == 1 => (widest, rooms[index].top),
        _ => (rooms[index].left, tallest(rooms, 0)),
    };
    // A legend that has no room within the frame stands above it, and lowers the frames beside it, where others may then have none.
    loop {
        let lacks = |(index, panel): (usize, &Panel)| {
            let (room, (left, top)) = (&rooms[index], edges(&rooms, index));
            let has = room.legend.is_some() || Pane::new(panel, room, cell_of(index), left, top).has_room_for_legend();
            (!has).then_some(index)
        };
        let lacking: Vec<usize> = plot.panels.iter().enumerate().filter_map(lacks).collect();
        if lacking.is_empty() {
            break;
        }
        lacking.into_iter().for_each(|index| rooms[index].put_legend_above(&plot.panels[index], width_of(index)));
    }
    for (index, (panel, room)) in plot.panels.iter().zip(&rooms).enumerate() {
        let (left, top) = edges(&rooms, index);
        Pane::new(panel, room, cell_of(index), left, top).draw(&mut drawing);
    }
    drawing
}

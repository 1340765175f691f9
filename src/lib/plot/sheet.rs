//! Pictures of pixels with words about them: a bar that says what colors mean, captions, several in a grid.

use super::drawing::{Drawing, Ink, Outline, Rect, Stroke, Text};
use super::figure::{Anchor, Axis, Scale};
use super::font;
use super::png::painted;
use super::ruler::{Ruler, Tick};
use super::style::{FRAME, MIDDLE, TEXT_RGB, TICK};
use crate::error::{Error, Result};

/// The side in pixels from which on words grow with the picture, so that they can be read where it is shown smaller.
const PLAIN_SIDE: f64 = 640.0;
/// Lengths at that size: white about a picture, type, the distance of lines, and the bar.
const MARGIN: f64 = 12.0;
/// Between columns, so that captions as wide as their columns stay apart.
const COLUMN_GAP: f64 = 28.0;
const TEXT: f64 = 13.0;
const LINE: f64 = 17.0;
/// What stands above a bar: a line, and room to its topmost number.
const TITLE: f64 = 25.0;
const BAR_GAP: f64 = 12.0;
const BAR_WIDTH: f64 = 16.0;
const LEAST_BAR: f64 = 80.0;
/// First lines of captions, names, are at least so wide before they are shortened, and others before they are parted.
const LEAST_NAME: f64 = 220.0;
const LEAST_LINE: f64 = 460.0;

/// Pixels, three bytes each, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pixels {
    /// Columns and rows.
    pub size: [usize; 2],
    /// R, G and B of each.
    pub rgb: Vec<u8>,
}

/// What the colors of a picture mean.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleBar {
    /// The quantity and its unit.
    pub label: String,
    /// The numbers of the first and of the last color.
    pub range: (f64, f64),
    /// How the numbers between are spread over the colors.
    pub scale: Scale,
    /// The colors, at equal steps.
    pub colors: Vec<[u8; 3]>,
    /// The color of what is no number, and what that is called; none where there is no such pixel.
    pub missing: Option<([u8; 3], String)>,
    /// The number that all are, and how it is written; none where they differ.
    pub only: Option<(f64, String)>,
}

impl ScaleBar {
    fn ruler(&self) -> Ruler {
        let axis = Axis { label: String::new(), scale: self.scale, range: Some(self.range) };
        // A range too narrow to be one is that about its numbers.
        Ruler::new(&axis, [self.range.0, self.range.1].into_iter())
    }

    /// The color of each finite number, beyond the ends that of the nearest; of others `missing`.
    pub(crate) fn colors_of(&self, missing: [u8; 3]) -> impl Fn(f32) -> [u8; 3] {
        let (ruler, last) = (self.ruler(), (self.colors.len() - 1) as f64);
        move |number| {
            let place = ruler.place_within(f64::from(number)).filter(|_| number.is_finite());
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the colors")]
            place.map_or(missing, |place| self.colors[(place * last).round() as usize])
        }
    }
}

/// A picture and what is said of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// The picture.
    pub picture: Pixels,
    /// The bar to the right of it.
    pub bar: Option<ScaleBar>,
    /// What it is called, the first line below it, which loses its middle where it is wider than all else; may be empty.
    pub name: String,
    /// More lines below it, parted where they are wider than the picture and than people read.
    pub caption: Vec<String>,
}

/// Lengths for words of one size.
#[derive(Clone, Copy)]
struct Type {
    /// How many times as large as plain.
    scale: f64,
}

/// Pictures in a grid of so many columns, row by row, with their bars and captions on white.
///
/// # Errors
///
/// [`Error::Data`] where there would be too many pixels.
pub fn sheet(tiles: &[Tile], columns: usize) -> Result<Pixels> {
    let longest = tiles.iter().flat_map(|tile| tile.picture.size).max().unwrap_or(1) as f64;
    let size = Type { scale: (longest / PLAIN_SIDE).max(1.0) };
    let blocks: Vec<Block> = tiles.iter().map(|tile| Block::of(tile, size)).collect();
    let columns = columns.clamp(1, tiles.len().max(1));
    let [margin, gap] = [MARGIN, COLUMN_GAP].map(|length| size.of(length).ceil());
    let width = blocks.iter().map(|block| block.width).fold(0.0, f64::max);
    let heights: Vec<f64> =
        blocks.chunks(columns).map(|row| row.iter().map(|block| block.height).fold(0.0, f64::max)).collect();
    let whole =
        [2.0 * margin + columns as f64 * (width + gap) - gap, margin + heights.iter().map(|h| h + margin).sum::<f64>()];
    let mut drawing = Drawing::new(whole[0], whole[1], "");
    let mut pasted = Vec::new();
    let mut top = margin;
    for (row, height) in blocks.chunks(columns).zip(&heights) {
        for (column, block) in row.iter().enumerate() {
            let left = margin + column as f64 * (width + gap);
            block.draw(&mut drawing, &mut pasted, [left, top], width);
        }
        top += height + margin;
    }
    paste(&drawing, &pasted)
}

/// Paints a drawing and lays pictures over it.
fn paste(drawing: &Drawing, pasted: &[([usize; 2], &Pixels)]) -> Result<Pixels> {
    let canvas = painted(drawing).ok_or_else(|| {
        let size = format!("{:.0}x{:.0}", drawing.width, drawing.height);
        Error::Usage(format!("a picture of {size} with words about it is too large; make it smaller")).change(&["fit"])
    })?;
    let size = [canvas.width() as usize, canvas.height() as usize];
    let mut rgb: Vec<u8> = canvas.data().chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied()).collect();
    drop(canvas);
    for ([left, top], picture) in pasted {
        let row_bytes = 3 * picture.size[0];
        for (y, row) in picture.rgb.chunks_exact(row_bytes).enumerate() {
            rgb[3 * ((top + y) * size[0] + left)..][..row_bytes].copy_from_slice(row);
        }
    }
    Ok(Pixels { size, rgb })
}

/// A tile that knows how large it is.
struct Block<'a> {
    tile: &'a Tile,
    size: Type,
    width: f64,
    height: f64,
    bar: Option<Bar>,
    /// All that stands below the picture.
    lines: Vec<String>,
}

/// A bar that knows how large it is.
struct Bar {
    ticks: Vec<Tick>,
    pixels: Pixels,
    /// How far it and its numbers reach beyond the picture.
    width: f64,
}

impl Type {
    fn of(self, length: f64) -> f64 {
        length * self.scale
    }

    fn width(self, text: &str) -> f64 {
        font::width(text, self.of(TEXT))
    }

    fn write(self, drawing: &mut Drawing, text: &str, at: [f64; 2], anchor: Anchor) {
        let (text, size) = (text.to_owned(), self.of(TEXT));
        drawing.text(Text { text, at, size, anchor, upward: false, rgb: TEXT_RGB });
    }

    fn frame(self) -> Stroke {
        Stroke { width: self.scale.round(), ..FRAME }
    }

    /// Lines, each in as many as it needs; empty ones stay.
    fn parted(self, lines: &[String], width: f64) -> Vec<String> {
        let of = |line: &String| match font::lines(line, self.of(TEXT), width) {
            none if none.is_empty() => vec![String::new()],
            lines => lines,
        };
        lines.iter().flat_map(of).collect()
    }

    /// A text without its middle where it is too wide.
    fn shortened(self, text: &str, width: f64) -> String {
        let letters: Vec<char> = text.chars().collect();
        let cut = |kept: usize| -> String {
            let (head, tail) = (kept.div_ceil(2), kept / 2);
            letters[..head].iter().chain(&['…']).chain(&letters[letters.len() - tail..]).collect()
        };
        if self.width(text) <= width {
            return text.to_owned();
        }
        (0..letters.len()).rev().map(cut).find(|text| self.width(text) <= width).unwrap_or_default()
    }
}

impl<'a> Block<'a> {
    fn of(tile: &'a Tile, size: Type) -> Self {
        let [columns, rows] = tile.picture.size.map(|side| side as f64);
        let bar = tile.bar.as_ref().map(|bar| Bar::of(bar, rows, size));
        let beside = bar.as_ref().map_or(0.0, |bar| bar.width);
        let title = tile.bar.as_ref().map_or(0.0, |bar| size.width(&bar.label));
        let name = size.width(&tile.name).min(size.of(LEAST_NAME));
        let whole = (columns + beside).max(title);
        let caption = size.parted(&tile.caption, whole.max(size.of(LEAST_LINE)));
        let widest = caption.iter().map(|line| size.width(line)).fold(name, f64::max);
        let width = whole.max(widest);
        let lines: Vec<String> =
            Some(tile.name.clone()).filter(|name| !name.is_empty()).into_iter().chain(caption).collect();
        let above = if bar.is_some() { size.of(TITLE) } else { 0.0 };
        let below = tile.bar.as_ref().and_then(|bar| bar.missing.as_ref()).map_or(0.0, |_| size.of(LINE));
        let of_bar = bar.as_ref().map_or(0.0, |bar| bar.pixels.size[1] as f64 + below + size.of(0.5 * LINE));
        let height = above + rows.max(of_bar) + size.of(LINE) * lines.len() as f64;
        Self { tile, size, width: width.ceil(), height: height.ceil(), bar, lines }
    }

    fn draw(
        &'a self,
        drawing: &mut Drawing,
        pasted: &mut Vec<([usize; 2], &'a Pixels)>,
        [left, top]: [f64; 2],
        width: f64,
    ) {
        let (size, picture) = (self.size, &self.tile.picture);
        let (mut top, bottom) = (top, top + self.height);
        if let (Some(bar), Some(meaning)) = (&self.bar, &self.tile.bar) {
            top = (top + size.of(TITLE)).round();
            let right = left + (picture.size[0] as f64 + bar.width).max(size.width(&meaning.label));
            size.write(drawing, &meaning.label, [right, top - size.of(0.9 * TEXT)], Anchor::End);
            let beside = left + picture.size[0] as f64 + size.of(BAR_GAP).round();
            bar.draw(drawing, pasted, meaning, [beside, top], size);
        }
        paste_framed(drawing, pasted, picture, [left, top], size);
        let first = bottom - size.of(LINE) * self.lines.len() as f64;
        for (index, line) in self.lines.iter().enumerate() {
            let baseline = first + size.of(LINE * (index as f64 + 0.85));
            size.write(drawing, &size.shortened(line, width), [left, baseline], Anchor::Start);
        }
    }
}

impl Bar {
    /// A bar as high as the picture, or as its numbers need.
    fn of(meaning: &ScaleBar, height: f64, size: Type) -> Self {
        let height = height.max(size.of(LEAST_BAR)).round();
        let ruler = meaning.ruler();
        let most = (height / size.of(2.6 * TEXT)).clamp(3.0, 12.0);
        let apart = size.of(LINE) / height;
        let mut ticks = ruler.ticks_between_ends(most, apart);
        if let Some((only, label)) = &meaning.only
            && let Some(place) = ruler.place_within(*only)
        {
            ticks.retain(|tick| (tick.place - place).abs() >= apart);
            ticks.push(Tick { place, label: Some(label.clone()) });
        }
        let widest = ticks.iter().filter_map(|tick| tick.label.as_deref()).map(|label| size.width(label));
        let widest = widest.chain(meaning.missing.iter().map(|(_, name)| size.width(name))).fold(0.0, f64::max);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few pixels")]
        let [columns, rows] = [size.of(BAR_WIDTH).round() as usize, height as usize];
        let last = meaning.colors.len().saturating_sub(1);
        let color = |row: usize| meaning.colors[last - (row * last + (rows - 1) / 2) / (rows - 1).max(1)];
        let rgb = (0..rows).flat_map(|row| std::iter::repeat_n(color(row), columns)).flatten().collect();
        let width = size.of(BAR_GAP).round() + columns as f64 + size.of(TICK + 4.0) + widest;
        Self { ticks, pixels: Pixels { size: [columns, rows], rgb }, width: width.ceil() }
    }

    fn draw<'a>(
        &'a self,
        drawing: &mut Drawing,
        pasted: &mut Vec<([usize; 2], &'a Pixels)>,
        meaning: &ScaleBar,
        [left, top]: [f64; 2],
        size: Type,
    ) {
        let [width, height] = self.pixels.size.map(|side| side as f64);
        paste_framed(drawing, pasted, &self.pixels, [left, top], size);
        let right = left + width;
        let words = right + size.of(TICK + 4.0);
        for tick in &self.ticks {
            let y = top + (1.0 - tick.place) * height;
            drawing.stroke(Outline::Line(vec![[right, y], [right + size.of(TICK), y]]), size.frame());
            let label = tick.label.as_deref().unwrap_or_default();
            size.write(drawing, label, [words, y + size.of(MIDDLE * TEXT)], Anchor::Start);
        }
        if let Some((rgb, name)) = &meaning.missing {
            let swatch = Rect { left, top: top + height + size.of(8.0), width, height: size.of(TEXT) };
            drawing.shape(swatch.outline(), Ink { rgb: *rgb, opacity: 1.0 }, size.frame());
            size.write(drawing, name, [words, swatch.bottom() - size.of(1.5)], Anchor::Start);
        }
    }
}

/// Lays a picture over the drawing, with a thin frame about it.
fn paste_framed<'a>(
    drawing: &mut Drawing,
    pasted: &mut Vec<([usize; 2], &'a Pixels)>,
    picture: &'a Pixels,
    [left, top]: [f64; 2],
    size: Type,
) {
    let [width, height] = picture.size.map(|side| side as f64);
    let around = 0.5 * size.frame().width;
    let frame =
        Rect { left: left - around, top: top - around, width: width + 2.0 * around, height: height + 2.0 * around };
    drawing.stroke(frame.outline(), size.frame());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole places on the canvas")]
    pasted.push(([left as usize, top as usize], picture));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(size: [usize; 2], rgb: [u8; 3], bar: bool, caption: &[&str]) -> Tile {
        let picture = Pixels { size, rgb: rgb.repeat(size[0] * size[1]) };
        let colors = (0..=255).map(|code| [code, 0, 0]).collect();
        let meaning = ScaleBar {
            label: "Y / cd m⁻²".into(),
            range: (0.0, 10.0),
            scale: Scale::Linear,
            colors,
            missing: None,
            only: None,
        };
        let name = caption.first().map(|name| (*name).to_owned()).unwrap_or_default();
        let caption = caption.iter().skip(1).map(|line| (*line).to_owned()).collect();
        Tile { picture, bar: bar.then_some(meaning), name, caption }
    }

    fn count(sheet: &Pixels, is: impl Fn([u8; 3]) -> bool) -> usize {
        sheet.rgb.as_chunks::<3>().0.iter().filter(|pixel| is(**pixel)).count()
    }

    #[test]
    fn every_pixel_of_a_picture_is_on_the_sheet_and_nothing_lies_over_it() {
        let (red, blue) = ([200, 10, 10], [10, 10, 200]);
        let tiles = [tile([40, 30], red, true, &["a"]), tile([300, 20], blue, false, &["b", "c"])];
        for columns in 1..=3 {
            let made = sheet(&tiles, columns).unwrap();
            assert_eq!(made.rgb.len(), 3 * made.size[0] * made.size[1]);
            assert_eq!(count(&made, |pixel| pixel == red), 40 * 30);
            assert_eq!(count(&made, |pixel| pixel == blue), 300 * 20);
        }
    }

    #[test]
    fn a_bar_runs_from_the_last_color_down_to_the_first() {
        let made = sheet(&[tile([50, 256], [0, 255, 0], true, &[])], 1).unwrap();
        let left = 12 + 50 + 12 + 8;
        let column: Vec<[u8; 3]> =
            (0..made.size[1]).map(|y| made.rgb.as_chunks::<3>().0[y * made.size[0] + left]).collect();
        let bar: Vec<u8> = column
            .windows(256)
            .find(|rows| rows[0] == [255, 0, 0] && rows[255] == [0, 0, 0])
            .unwrap()
            .iter()
            .map(|c| c[0])
            .collect();
        assert!(bar.is_sorted_by(|a, b| a > b));
    }

    #[test]
    fn a_bar_has_two_numbers_or_more() {
        for high in [0.3, 1.7, 3.4, 4.9, 9.9, 19.0, 77.0] {
            for low in [0.0, 0.31, 0.6, 0.87, 0.95].map(|part| part * high) {
                let tile = tile([20, 20], [9; 3], true, &[]);
                let meaning = ScaleBar { range: (low, high), ..tile.bar.clone().unwrap() };
                let bar = Bar::of(&meaning, 20.0, Type { scale: 1.0 });
                let labels = bar.ticks.iter().filter(|tick| tick.label.is_some()).count();
                assert!((2..9).contains(&labels), "{low} {high}: {:?}", bar.ticks);
            }
        }
    }

    #[test]
    fn long_words_lose_their_middle_and_stay_within() {
        let size = Type { scale: 1.0 };
        let long = "a".repeat(300) + "end.exr";
        let short = size.shortened(&long, 200.0);
        assert!(size.width(&short) <= 200.0 && short.ends_with("end.exr") && short.contains('…'), "{short}");
        assert_eq!(size.shortened("a", 200.0), "a");
        assert!(sheet(&[tile([10, 10], [9; 3], false, &[&long])], 1).unwrap().size[0] < 400);
    }
}

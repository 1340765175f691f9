//! A small picture of a raw image, made while its rows pass by.

use super::signals::CameraColor;
use crate::camera::levels::BlackLevels;
use crate::cfa::{Class, FilterArray};
use crate::color::srgb_encode;
use crate::frame::Geometry;

/// Most columns, and most rows, of the picture.
const MOST_SIDE: usize = 256;

/// Means of the signals of R, G and B over blocks of photosites, in sRGB: the picture that a converter would make of the
/// frame with nothing but its tags. Planes behind other filters than R, G and B, or none, give gray.
#[derive(Debug)]
pub(super) struct Preview {
    cfa: FilterArray,
    origin: [i64; 2],
    size: [usize; 2],
    /// Columns and rows of the picture.
    pub sides: [usize; 2],
    /// Photosites beside and below each other in a block; the last ones take what is left over.
    block: usize,
    black: Option<BlackLevels>,
    /// ADU above black that are white.
    range: f64,
    color: Option<CameraColor>,
    /// Sum and number of samples, by block of the row of blocks that is being filled, and class.
    sums: Vec<[(f64, u32); 3]>,
    row: usize,
    rgb: Vec<u8>,
}

impl Preview {
    /// A picture of a frame behind an array, where `range` ADU above black are white.
    pub fn new(
        geometry: &Geometry,
        cfa: FilterArray,
        black: Option<BlackLevels>,
        range: f64,
        color: Option<CameraColor>,
    ) -> Self {
        let size = [geometry.width, geometry.height];
        let [columns, rows] = cfa.period();
        let period = (columns.max(rows)..).find(|n| n % columns == 0 && n % rows == 0).unwrap_or(columns * rows);
        let block = size[0].max(size[1]).div_ceil(MOST_SIDE).next_multiple_of(period);
        let sides = size.map(|side| (side / block).max(1));
        Self {
            cfa,
            origin: geometry.origin.map(i64::from),
            size,
            sides,
            block,
            black,
            range,
            color: color.filter(|_| cfa.has_three_classes()),
            sums: vec![[(0.0, 0); 3]; sides[0]],
            row: 0,
            rgb: Vec::with_capacity(3 * sides[0] * sides[1]),
        }
    }

    /// Takes the next rows.
    pub fn take(&mut self, samples: &[f32]) {
        for line in samples.chunks_exact(self.size[0]) {
            self.take_row(line);
            self.row += 1;
            let is_last = self.row == self.size[1];
            let done = self.rgb.len() / (3 * self.sides[0]);
            if is_last || (self.row.is_multiple_of(self.block) && done + 1 < self.sides[1]) {
                self.finish_blocks();
            }
        }
    }

    /// The picture, `[row][column][channel]`.
    pub fn finish(self) -> Vec<u8> {
        self.rgb
    }

    fn take_row(&mut self, line: &[f32]) {
        let black = self.black.as_ref().map(|black| black.row(self.row));
        let y = self.origin[1] + self.row as i64;
        let is_color = self.cfa.has_three_classes();
        let period = self.cfa.period()[0];
        let classes: Vec<usize> = (0..period as i64)
            .map(|x| self.cfa.class(self.origin[0] + x, y).filter(|_| is_color).unwrap_or(Class::Green) as usize)
            .collect();
        let last = self.sides[0] - 1;
        for (x, sample) in line.iter().enumerate().filter(|(_, sample)| sample.is_finite()) {
            let (sum, count) = &mut self.sums[(x / self.block).min(last)][classes[x % period]];
            *sum += f64::from(*sample) - black.map_or(0.0, |black| black.at(x));
            *count += 1;
        }
    }

    /// Ends a row of blocks.
    fn finish_blocks(&mut self) {
        for block in &mut self.sums {
            let means = block.map(|(sum, count)| (count > 0).then(|| sum / f64::from(count) / self.range));
            *block = [(0.0, 0); 3];
            // Narrow frames lack classes; planes without colors are green alone.
            let any = means[1].or(means[0]).or(means[2]).unwrap_or(0.0);
            let signals = means.map(|mean| mean.unwrap_or(any));
            let linear = match &self.color {
                Some(color) => color.srgb_from_camera.map(|row| (0..3).map(|k| row[k] * signals[k]).sum()),
                None => signals,
            };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 255, and whole")]
            self.rgb.extend(linear.map(|linear| (255.0 * srgb_encode(linear.clamp(0.0, 1.0))).round() as u8));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(
        size: [usize; 2],
        origin: [i32; 2],
        cfa: &str,
        sample: impl Fn(usize, usize) -> f32,
    ) -> ([usize; 2], Vec<u8>) {
        let geometry = Geometry { origin, ..Geometry::new(size[0], size[1], &["Y"]) };
        let black = BlackLevels::uniform_at(100.0);
        let mut preview = Preview::new(&geometry, cfa.parse().unwrap(), Some(black), 1000.0, None);
        for y in 0..size[1] {
            preview.take(&(0..size[0]).map(|x| sample(x, y)).collect::<Vec<_>>());
        }
        let sides = preview.sides;
        (sides, preview.finish())
    }

    #[test]
    fn blocks_have_the_means_of_their_classes() {
        // R, G and B at black, white and beyond; the frame starts with green.
        let rggb = |x: usize, y: usize| [[100.0, 1100.0], [1100.0, 9000.0]][(y + 1) % 2][x % 2];
        let (sides, rgb) = picture([601, 403], [2, 1], "rggb", rggb);
        assert_eq!(sides, [150, 100]);
        assert_eq!(rgb, [0, 255, 255].repeat(150 * 100));
        // 0.2140 is about half of full scale in sRGB.
        assert_eq!(picture([5, 1], [0, 0], "monochrome", |_, _| 315.0), ([5, 1], vec![128; 15]));
        let (sides, rgb) = picture([1, 2000], [0, 0], "rggb", |_, y| if y % 2 == 0 { 1100.0 } else { 100.0 });
        assert_eq!((sides, rgb), ([1, 250], [255, 0, 0].repeat(250)));
    }

    #[test]
    fn samples_that_are_no_numbers_are_passed_over() {
        let (_, rgb) = picture([4, 2], [0, 0], "rggb", |x, _| if x < 2 { f32::NAN } else { 1100.0 });
        assert_eq!(rgb, [0, 0, 0, 255, 255, 255]);
    }

    #[test]
    fn sides_are_bounded() {
        for (size, cfa) in
            [([10_000, 3], "rggb"), ([257, 256], "rggb"), ([3000, 2999], "6x6:GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG")]
        {
            let (sides, rgb) = picture(size, [0, 0], cfa, |_, _| 0.0);
            assert!(sides.iter().all(|side| (1..=256).contains(side)) && rgb.len() == 3 * sides[0] * sides[1]);
        }
    }
}

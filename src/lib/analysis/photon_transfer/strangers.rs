//! Frames of a level whose fixed pattern is not that of the others, as of one that is turned or mirrored.
//!
//! With ȳ the mean of L frames and a_k = y_k − ȳ, the slope of a_k over ȳ is, row by row, that by which the pattern of a frame is more
//! than that of all: about 0 of frames alike. Of one that has another pattern of as much variance it is
//!
//! −(L − 1)(L − 2)/((L − 1)² + 1)
//!
//! of that share of the variance of ȳ which is pattern, not noise. The median over the rows leaves alone what few photosites do: hot ones that
//! blink, and rays that hit one frame.

use crate::numerics::robust::median;
use crate::numerics::variance_components::MeanSquares;

/// Fewer frames do not tell which of them is another.
const LEAST: usize = 4;

/// Slopes of frames over their mean, row by row.
#[derive(Debug, Default)]
pub struct RowSlopes {
    frames: usize,
    /// Of the frames of a row, then those of the next.
    slopes: Vec<f64>,
}

impl RowSlopes {
    /// Of so many frames.
    pub fn new(frames: usize) -> Self {
        Self { frames: if frames < LEAST { 0 } else { frames }, slopes: Vec::new() }
    }

    /// Adds a frame of a row, whose mean has such a sum of squares about its mean, of which the frame has such a product with it.
    #[inline(always)]
    pub fn add(&mut self, product: f64, squares: f64) {
        if self.frames > 0 && squares > 0.0 {
            self.slopes.push(product / squares);
        }
    }

    /// The frames whose pattern is not that of the others, of a grid of so many columns and rows, its pattern and its noise.
    pub fn strangers(
        mut self,
        [columns, rows]: [usize; 2],
        spatial: &MeanSquares,
        temporal: &MeanSquares,
    ) -> Vec<usize> {
        /// Where the pattern is less of the variance of the mean, noise hides it.
        const SHARE: f64 = 0.2;
        /// A slope is half of what that of another pattern is.
        const HALF: f64 = 0.5;
        /// Standard deviations that are beyond chance.
        const BEYOND: f64 = 8.0;
        /// Rows of which a median is worth the name.
        const ROWS: usize = 8;
        /// The median of normal numbers scatters by so much more than their mean, a variance.
        const OF_MEDIAN: f64 = std::f64::consts::FRAC_PI_2;
        if self.frames == 0 || self.slopes.len() < ROWS * self.frames {
            return Vec::new();
        }
        let count = self.frames as f64;
        // Within rows: what columns and photosites have.
        let of_columns = spatial.columns.value * (columns as f64 - 1.0);
        let of_rest = spatial.rest.value * (columns as f64 - 1.0) * (rows as f64 - 1.0);
        let within = of_columns + of_rest;
        let noise = temporal.rest.value / count * (columns as f64 - 1.0) * rows as f64;
        let share = 1.0 - noise / within;
        if share.is_nan() || share < SHARE {
            return Vec::new();
        }
        let wanted = share * (count - 1.0) * (count - 2.0) / ((count - 1.0).powi(2) + 1.0);
        let variance = (temporal.columns.value * of_columns + temporal.rest.value * of_rest) / (within * within);
        let least = (HALF * wanted).max(BEYOND * (OF_MEDIAN * variance).sqrt());
        let is_stranger = |frame: &usize| {
            let mut own: Vec<f64> = self.slopes.iter().skip(*frame).step_by(self.frames).copied().collect();
            median(&mut own) < -least
        };
        let found: Vec<usize> = (0..self.frames).filter(is_stranger).collect();
        self.slopes.clear();
        found
    }
}

/// The excess kurtosis of temporal noise at single photosites, and what it scatters by, a variance, from sums of the squares q of the departures of
/// `frames` samples about their mean, and of q², over `count` photosites.
///
/// Var q = σ⁴ (2 (L − 1) + γ (L − 1)²/L),  ⟨q⟩ = σ² (L − 1)
///
/// Photosites of unlike noise make it larger.
pub fn excess([sum, squares]: [f64; 2], frames: usize, count: f64) -> [f64; 2] {
    let (frames, freedom) = (frames as f64, frames as f64 - 1.0);
    let mean = sum / count;
    let ratio = (squares / count - mean * mean) / (2.0 * mean * mean / freedom);
    let factor = 2.0 * frames / freedom;
    [factor * (ratio - 1.0), factor * factor * (2.0 + 12.0 / freedom) / count]
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::survey::survey;
    use crate::frame::{Geometry, to_sample};
    use crate::metadata::{FrameHeader, Metadata};
    use crate::random::philox::philox4x32_10;
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;

    const SIDE: usize = 64;

    /// A number of mean 0 and variance 1: the sum of 12 uniform ones.
    pub fn normal(place: usize, frame: u32, key: u32) -> f64 {
        let words = (0..3).flat_map(|part| philox4x32_10([u32::try_from(place).unwrap(), frame, part, key], [8, 9]));
        words.map(|word| f64::from(word) / 4_294_967_296.0).sum::<f64>() - 6.0
    }

    fn frames(count: u32, sample: impl Fn(usize, u32) -> f64) -> Vec<MemoryFrame> {
        let of = |frame: u32| {
            let geometry = Geometry::new(SIDE, SIDE, &["Y"]);
            let header = FrameHeader { name: "a".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
            let code = |place: usize| to_sample((200.0 + sample(place, frame)).round());
            MemoryFrame::new(header, (0..SIDE * SIDE).map(code).collect())
        };
        (0..count).map(of).collect()
    }

    /// Of frames of a pattern of 4 ADU and noise of 6 the one that is turned is told, among 16 and among 4; none of frames alike, of which one
    /// column in four has noise of its own, nor where a ray hits one of them, half of the photosites of a row blink in one, or there is no
    /// pattern.
    #[test]
    fn a_frame_that_is_turned_is_told() {
        let pattern = |place: usize| 4.0 * normal(place, 0, 1);
        let noise = |place: usize, frame: u32| 6.0 * normal(place, frame, 2);
        let told = |count: u32, sample: &dyn Fn(usize, u32) -> f64| {
            survey(&mut frames(count, sample), Some(65_535.0), false).unwrap().sites[0].strangers.clone()
        };
        let turned = |place: usize, frame: u32| {
            pattern(if frame == 2 { SIDE * SIDE - 1 - place } else { place }) + noise(place, frame)
        };
        assert_eq!(told(16, &turned), [2]);
        assert_eq!(told(4, &turned), [2]);
        let columns = |place: usize, frame: u32| {
            let of_column = if place.is_multiple_of(4) { 10.0 * normal(place % SIDE, frame, 3) } else { 0.0 };
            pattern(place) + noise(place, frame) + of_column
        };
        let hit = |place: usize, frame: u32| {
            pattern(place) + noise(place, frame) + if [place, frame as usize] == [777, 3] { 60_000.0 } else { 0.0 }
        };
        let blinking = |place: usize, frame: u32| {
            let is_bright = place / SIDE == 5 && place.is_multiple_of(2) && frame != 1;
            pattern(place) + noise(place, frame) + if is_bright { 3000.0 } else { 0.0 }
        };
        let alike: [&dyn Fn(usize, u32) -> f64; 4] = [&columns, &hit, &blinking, &noise];
        for (which, sample) in alike.into_iter().enumerate() {
            assert_eq!(told(16, sample), [0_usize; 0], "{which}");
        }
    }

    /// Noise that is cut off beyond 2 standard deviations has an excess of −0.63, √(2.8/4096)·2·16/15 of which is one standard deviation; normal
    /// noise none.
    #[test]
    fn tails_that_are_cut_off_show() {
        for (limit, wanted) in [(2.0, -0.634), (20.0, -0.1)] {
            let noise = |place: usize, frame: u32| {
                let drawn = (0..20).map(|again| normal(place, frame, 10 + again));
                20.0 * drawn.into_iter().find(|drawn| drawn.abs() < limit).unwrap()
            };
            let survey = survey(&mut frames(16, noise), Some(65_535.0), false).unwrap();
            let [found, variance] = survey.sites[0].excess;
            assert!((found - wanted).abs() < 5.0 * variance.sqrt(), "{limit}: {found} {variance}");
            assert!((variance / (2.8 / 4096.0 * (32.0_f64 / 15.0).powi(2)) - 1.0).abs() < 1e-6);
        }
    }
}

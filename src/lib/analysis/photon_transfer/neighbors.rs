//! Whether photosites share temporal noise with their neighbors, as where a camera smooths samples.
//!
//! With a the departures of a row of a frame from the mean of all frames,
//!
//! d = ⟨a(x) a(x + 1)⟩ − ⟨a(x) a(x + 3)⟩
//!
//! is 0 on average, of noise of single photosites and of all that rows, columns or frames are off by as a whole, which is alike at both
//! distances; d/⟨a²⟩ is the correlation of neighbors beyond that. The same is done from row to row. One row of [`PERIOD`] is looked at.

use super::lanes::dot;

/// Rows of which the first is compared with itself, the second and the last.
const PERIOD: usize = 4;
/// How far apart photosites are that share no noise.
const FAR: usize = PERIOD - 1;

/// Sums over rows of frames.
#[derive(Debug, Default)]
pub struct NeighborSums {
    columns: usize,
    /// Departures of the first row of a period, frame after frame, and Σ a a′ with the second.
    held: Vec<f64>,
    near: Vec<f64>,
    /// Rows that were looked at, Σ d and Σ d², along rows and along columns.
    sums: [[f64; 3]; 2],
    /// Σ ⟨a²⟩.
    square: f64,
}

impl NeighborSums {
    /// Of rows of so many columns of so many frames.
    pub fn new(columns: usize, frames: usize) -> Self {
        Self { columns, held: vec![0.0; columns * frames], near: vec![0.0; frames], ..Self::default() }
    }

    /// Adds the departures of a row of a frame; frames of a row come before those of the next.
    #[inline(always)]
    pub fn add(&mut self, frame: usize, row: usize, departures: &[f64]) {
        let columns = self.columns;
        let held = &mut self.held[frame * columns..][..columns];
        let mean = |sum: f64, count: usize| sum / count as f64;
        match row % PERIOD {
            0 => {
                held.copy_from_slice(departures);
                self.square += mean(dot(held, held), columns);
                let near = mean(dot(&held[..columns - 1], &held[1..]), columns - 1);
                let far = mean(dot(&held[..columns - FAR], &held[FAR..]), columns - FAR);
                note(&mut self.sums[0], near - far);
            }
            1 => self.near[frame] = dot(held, departures),
            FAR => note(&mut self.sums[1], mean(self.near[frame] - dot(held, departures), columns)),
            _ => {}
        }
    }

    /// The correlation of neighbors in a row, and in a column, beyond that of photosites farther apart, each with what it scatters by, a
    /// variance, as rows do, or as noise of single photosites at least; `frames` is of how many the departures are of, all of which or all but
    /// one were added.
    pub fn finish(self, frames: usize) -> [[f64; 2]; 2] {
        /// Rows that tell by how much they scatter.
        const LEAST: f64 = 8.0;
        let added = self.near.len() as f64;
        let [looked_at, ..] = self.sums[0];
        let square = self.square / looked_at;
        self.sums.map(|[count, sum, squares]| {
            // Departures of all frames add up to 0.
            let free = count * (frames as f64 - 1.0) / added;
            if free < LEAST || square.is_nan() || square <= 0.0 {
                return [0.0, f64::INFINITY];
            }
            let mean = sum / count;
            let scatter = (squares / count - mean * mean).max(0.0) / (square * square);
            [mean / square, scatter.max(2.0 / self.columns as f64) / free]
        })
    }
}

/// Takes in a value, in count, sum and sum of squares.
#[inline(always)]
fn note(sums: &mut [f64; 3], value: f64) {
    sums[0] += 1.0;
    sums[1] += value;
    sums[2] += value * value;
}

#[cfg(test)]
mod tests {
    use super::super::strangers::tests::normal;
    use super::super::survey::survey;
    use crate::frame::{Geometry, to_sample};
    use crate::metadata::{FrameHeader, Metadata};
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;

    const SIDE: usize = 64;

    /// The correlations, and their standard deviations, of frames of such samples.
    fn found(count: u32, sample: impl Fn(usize, u32) -> f64) -> [[f64; 2]; 2] {
        let of = |frame: u32| {
            let geometry = Geometry::new(SIDE, SIDE, &["Y"]);
            let header = FrameHeader { name: "a".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
            let code = |place: usize| to_sample((2000.0 + sample(place, frame)).round());
            MemoryFrame::new(header, (0..SIDE * SIDE).map(code).collect())
        };
        let mut frames: Vec<MemoryFrame> = (0..count).map(of).collect();
        let survey = survey(&mut frames, Some(65_535.0), false).unwrap();
        survey.sites[0].neighbors.map(|[value, variance]| [value, variance.sqrt()])
    }

    /// Samples smoothed along rows by 1, 2, 1 have a correlation of 4/6 there; the standard deviation of what 1000 products of single
    /// photosites tell is about 4 %, of smoothed ones twice that at most. Noise of photosites alone has none, nor where rows, columns and frames have noise
    /// of their own and a pattern beneath.
    #[test]
    fn smoothing_is_told_from_noise_of_rows_and_columns() {
        let noise = |place: usize, frame: u32| 20.0 * normal(place, frame, 1);
        let lines = |place: usize, frame: u32| {
            let [x, y] = [place % SIDE, place / SIDE];
            let common = 8.0 * normal(y, frame, 2) + 4.0 * normal(x, frame, 3) + 30.0 * normal(0, frame, 4);
            noise(place, frame) + common + 10.0 * normal(place, 0, 5)
        };
        for count in [2, 4] {
            for found in [found(count, noise), found(count, lines)] {
                assert!(found.iter().all(|[value, deviation]| value.abs() < 5.0 * deviation), "{count}: {found:?}");
            }
            let smoothed = |place: usize, frame: u32| {
                let at = |by: usize| noise(place / SIDE * SIDE + (place + by) % SIDE, frame);
                (at(SIDE - 1) + 2.0 * at(0) + at(1)) / 4.0
            };
            let [[along, deviation], [across, other]] = found(count, smoothed);
            assert!((along - 2.0 / 3.0).abs() < 5.0 * deviation && deviation < 0.1, "{count}: {along} {deviation}");
            assert!(across.abs() < 5.0 * other, "{count}: {across} {other}");
        }
    }
}

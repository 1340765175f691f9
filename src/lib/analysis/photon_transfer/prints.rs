//! Which frames are copies of one another, by some of their rows: a frame of noise is like no other.

/// Rows of a frame that are looked at, about.
const ROWS: usize = 64;
/// So many samples that differ from frame to frame: chance makes no two frames alike then.
const ENOUGH: u64 = 24;

/// Frames whose numbers are made side by side.
const TOGETHER: usize = 4;

/// What tells a frame from all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Print(u64);

/// Prints of the frames of one condition, row by row.
#[derive(Debug)]
pub struct Prints {
    step: usize,
    /// The first sample of each frame, from which all others are counted: one number that is added to all makes no other frame.
    first: Vec<f32>,
    prints: Vec<u64>,
    /// Samples that differ from those of the first frame.
    apart: u64,
}

impl Prints {
    /// Of so many frames of so many rows.
    pub fn new(frames: usize, height: usize) -> Self {
        let step = (height / ROWS).max(1);
        Self { step, first: vec![0.0; frames], prints: vec![0xCBF2_9CE4_8422_2325; frames], apart: 0 }
    }

    /// Adds row `y`, which stands at such a place in the band of each frame.
    pub fn add(&mut self, y: usize, bands: &[Vec<f32>], place: std::ops::Range<usize>) {
        if !y.is_multiple_of(self.step) {
            return;
        }
        if y == 0 {
            self.first = bands.iter().map(|band| band[place.start]).collect();
        }
        let row = |frame: usize| &bands[frame][place.clone()];
        // Of several frames at once, as each number of one waits for that before it.
        for first in (0..bands.len()).step_by(TOGETHER) {
            let own = &mut self.prints[first..bands.len().min(first + TOGETHER)];
            let rows: [_; TOGETHER] = std::array::from_fn(|frame| {
                let frame = first + frame.min(own.len() - 1);
                (row(frame), self.first[frame])
            });
            let mut prints = [0; TOGETHER];
            prints[..own.len()].copy_from_slice(own);
            // Two samples at a time.
            for x in (0..place.len()).step_by(2) {
                for (print, (samples, first)) in prints.iter_mut().zip(rows) {
                    let bits = |sample: &f32| u64::from((sample - first + 0.0).to_bits());
                    let two = bits(&samples[x]) | samples.get(x + 1).map_or(0, bits) << 32;
                    *print = (*print ^ two).wrapping_mul(0x0000_0100_0000_01B3).rotate_left(5);
                }
            }
            own.copy_from_slice(&prints[..own.len()]);
        }
        for (frame, own) in self.first.iter().enumerate() {
            let is_apart = |(sample, other): (&f32, &f32)| sample - own != other - self.first[0];
            self.apart += row(frame).iter().zip(row(0)).map(|two| u64::from(is_apart(two))).sum::<u64>();
        }
    }

    /// One of each frame; none of frames whose noise tells them not apart.
    pub fn finish(self) -> Vec<Print> {
        if self.apart < ENOUGH { Vec::new() } else { self.prints.into_iter().map(Print).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of three frames the third is the first and 7 more; of frames that are alike but for few samples nothing is told.
    #[test]
    fn copies_have_the_prints_of_what_they_are_copies_of() {
        let noise = |seed: usize| -> Vec<f32> {
            (0..400).map(|place| ((place * 7919 + seed * place * 31) % 17) as f32).collect()
        };
        let prints_of = |frames: &[Vec<f32>]| {
            let mut prints = Prints::new(frames.len(), 20);
            (0..20).for_each(|y| prints.add(y, frames, y * 20..(y + 1) * 20));
            prints.finish()
        };
        let raised: Vec<f32> = noise(1).iter().map(|sample| sample + 7.0).collect();
        let found = prints_of(&[noise(1), noise(2), raised]);
        assert!(found[0] == found[2] && found[0] != found[1]);
        let mut other = noise(1);
        other[5..20].iter_mut().for_each(|sample| *sample += 1.0);
        assert_eq!(prints_of(&[noise(1), other]), []);
    }
}

//! Whether what comes off a frame can be dark frames of it, by the samples of both.
//!
//! A dark frame has no light, and the noise and the scale of the frame. So nowhere is its mean above that of the frame, nowhere does it
//! scatter more, and where its codes are multiples of some step, so are those of the frame. Means and scatters are those of stretches of
//! the even or the odd columns of a row, in one row pair of [`PAIRS`].

use crate::numerics::steps::Steps;

/// Samples of a stretch.
const STRETCH: usize = 64;
/// One pair of rows in so many is looked at.
const PAIRS: usize = 4;
/// A mean is above that of the frame by so many of its standard deviations at least, beside [`DRIFT`].
const DEVIATIONS: f64 = 6.0;
/// Dark signals that drift from frame to frame differ by less, in ADU and as a share.
pub const DRIFT: [f64; 2] = [1.0, 0.01];
/// Scatter of a stretch of the frame to that of the dark frame: of normal ones of one law it is lower in one of 10³ stretches.
const SCATTER: f64 = 0.6;
/// The least scatter of the darks that is compared, in ADU: that of less than a code hangs on where in a code they lie.
const LEAST_SCATTER: f64 = 1.1;
/// The share of a stretch of the frame at its largest value from which it is cut off there.
const CUT: usize = 8;

/// What was seen of a frame and of what came off it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Fitness {
    /// Stretches that were looked at.
    stretches: u64,
    /// Those whose mean is below that of what came off.
    below: u64,
    /// Those that could scatter less than what came off, and those that do.
    scattering: [u64; 2],
    steps: [Steps; 2],
    /// The least of the means of stretches as multiples of those of the darks; of darks above 0 alone.
    least_ratio: Option<f64>,
    /// The sum of the scatters of the darks.
    scatter: f64,
    /// The least of the means of stretches of the frame as multiples of what neighbors in them differ by.
    nearest: Option<f64>,
    /// The largest of the means of stretches of the frame, and of the darks.
    largest: [f64; 2],
    /// Whether some samples of the frame are no whole numbers.
    pub(super) is_fractional: bool,
}

/// Why what came off cannot well be dark frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Misfit {
    /// Of such a share of the frame the mean is below that of what came off.
    Below(f64),
    /// Its codes are multiples of a step, and those of the frame of another.
    Step([u64; 2]),
    /// Codes of the frame are multiples of a larger step, and nowhere below so many times those of what came off.
    Shifted([u64; 2]),
    /// In such a share of the frame it scatters more.
    Scatters(f64),
    /// It is shares of 1, and the frame is codes; the largest means of both.
    Shares([f64; 2]),
}

impl Fitness {
    /// Whether a row is looked at.
    pub(crate) fn looks_at(y: usize) -> bool {
        (y / 2).is_multiple_of(PAIRS)
    }

    /// Looks at a row of one plane of a frame and at what comes off it, `factor` times which are sums of codes; none where these are
    /// scaled, and their noise is not that of one frame or less.
    pub(in crate::stages) fn take(&mut self, frame: &[f32], darks: &[f64], factor: Option<f64>) {
        if let Some(factor) = factor {
            self.steps[0].take(frame.iter().map(|sample| f64::from(*sample)));
            self.steps[1].take(darks.iter().map(|dark| factor * dark));
        }
        for (frame, darks) in frame.chunks_exact(2 * STRETCH).zip(darks.chunks_exact(2 * STRETCH)) {
            for parity in 0..2 {
                let of_frame: [f64; STRETCH] = std::array::from_fn(|i| f64::from(frame[2 * i + parity]));
                let of_darks: [f64; STRETCH] = std::array::from_fn(|i| darks[2 * i + parity]);
                if of_frame.iter().chain(&of_darks).all(|sample| sample.is_finite()) {
                    self.compare(&of_frame, &of_darks, factor.is_some());
                }
            }
        }
    }

    fn compare(&mut self, frame: &[f64; STRETCH], darks: &[f64; STRETCH], has_noise_of_one: bool) {
        let n = STRETCH as f64;
        let mean = |samples: &[f64; STRETCH]| samples.iter().sum::<f64>() / n;
        // Differences of neighbors, which slopes of the light leave alone; of normal noise 1.13 standard deviations.
        let scatter =
            |samples: &[f64; STRETCH]| samples.windows(2).map(|two| (two[1] - two[0]).abs()).sum::<f64>() / (n - 1.0);
        let [a, b] = [frame, darks].map(mean);
        let [of_frame, of_darks] = [frame, darks].map(scatter);
        let margin = DEVIATIONS * of_frame.hypot(of_darks) / n.sqrt() + DRIFT[0].max(DRIFT[1] * b.abs());
        self.stretches += 1;
        let ratio = if b > 0.0 { a / b } else { 0.0 };
        self.least_ratio = Some(self.least_ratio.map_or(ratio, |least| least.min(ratio)));
        self.scatter += of_darks;
        self.largest = [self.largest[0].max(a), self.largest[1].max(b)];
        let above_zero = if a > 0.0 { a / of_frame } else { 0.0 };
        self.nearest = Some(self.nearest.map_or(above_zero, |nearest| nearest.min(above_zero)));
        self.is_fractional |= frame.iter().any(|sample| sample.fract() != 0.0);
        self.below += u64::from(b - a > margin);
        if !has_noise_of_one || of_darks < LEAST_SCATTER {
            return;
        }
        let is_less = of_frame < SCATTER * of_darks;
        if is_less {
            let largest = frame.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if frame.iter().filter(|sample| **sample == largest).count() >= CUT {
                return;
            }
        }
        self.scattering[0] += 1;
        self.scattering[1] += u64::from(is_less);
    }

    /// Whether means of the frame come as near zero as so many times what neighbors differ by; none where nothing was looked at.
    pub(in crate::stages) fn comes_near_zero(&self, times: f64) -> Option<bool> {
        self.nearest.map(|nearest| nearest <= times)
    }

    /// The step that all codes of the frame lie apart by, however few they are; 1 where some are no whole numbers.
    pub(super) fn step_of_frame(&self) -> f64 {
        self.steps[0].least()
    }

    /// Whether codes of the darks lie multiples of a power of two apart, however few they are.
    pub(super) fn are_darks_multiples_of(&self, scale: u64) -> bool {
        self.steps[1].are_multiples_of(scale)
    }

    /// Whether codes of the frame may be those of the darks times a step: then all of it is above its bias, so many times that of the darks.
    /// Averages of dark frames of its own scale have finer codes too, but scatter by some of its steps.
    fn is_shifted(&self, frame: u64, darks: u64) -> bool {
        /// Two bits, as those of 14 in 16.
        const LEAST: u64 = 4;
        /// Frames have all of their bias everywhere; black levels drift.
        const OF_STEP: f64 = 0.5;
        /// The least scatter of averages, in steps: rounding of codes leaves as much, in the noise of few frames or in their pattern.
        const OF_SCATTER: f64 = 0.25;
        let step = frame as f64 / darks as f64;
        frame >= LEAST * darks
            && self.least_ratio.is_some_and(|least| least >= OF_STEP * step)
            && self.scatter < OF_SCATTER * frame as f64 * self.stretches as f64
    }

    /// Whether the darks may be shares of 1 beside codes: they are no whole numbers, below 1, and scatter by less than averages of codes about so
    /// little do, while the frame is far above 1.
    fn are_shares(&self) -> bool {
        /// Means of 10⁴ codes scatter by as much.
        const SCATTER_OF_CODES: f64 = 0.01;
        /// Light of codes is brighter.
        const CODES: f64 = 16.0;
        let [of_frame, of_darks] = self.largest;
        let scatter = self.scatter / self.stretches.max(1) as f64;
        let is_small = of_darks > 0.0 && of_darks < 1.0 && scatter < SCATTER_OF_CODES;
        is_small && of_frame > CODES && self.steps[1].has_fractions()
    }

    /// Why what came off cannot well be dark frames of the frame; none where nothing speaks against it.
    pub fn misfit(&self) -> Option<Misfit> {
        /// Shares of a frame below which it is a spot.
        const SPOT: f64 = 0.01;
        const SPOTS: f64 = 0.05;
        /// Stretches that tell anything.
        const LEAST: u64 = 8;
        let share = |few: u64, all: u64| if all == 0 { 0.0 } else { few as f64 / all as f64 };
        let below = share(self.below, self.stretches);
        let scatters = share(self.scattering[1], self.scattering[0]);
        let [frame, darks] = self.steps.map(|steps| steps.step());
        // Coarse codes of bright light alone are those of cameras whose steps rise with level.
        let steps = frame.zip(darks);
        match steps.filter(|(frame, darks)| darks > frame || self.is_shifted(*frame, *darks)) {
            Some((frame, darks)) if darks > frame => Some(Misfit::Step([frame, darks])),
            Some((frame, darks)) => Some(Misfit::Shifted([frame, darks])),
            None if self.stretches >= LEAST && self.are_shares() => Some(Misfit::Shares(self.largest)),
            None if below >= SPOT && self.below >= LEAST => Some(Misfit::Below(below)),
            None if scatters >= SPOTS && self.scattering[1] >= LEAST => Some(Misfit::Scatters(scatters)),
            None => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Run, RunWords, Source};

    /// Normal numbers of a row of a frame.
    fn normals(frame: u32, row: i32) -> Vec<f64> {
        let mut words = RunWords::default();
        let of_run = |column: i32| {
            let run = Run { seed: 1, sensor_seed: 0, frame, place: [column, row], classes: [0; 2], length: 128 };
            let mut normals = [0.0; 128];
            run.make_temporal(&mut words);
            run.normals(&words, Source::Ron, &mut normals);
            normals
        };
        (0..16).map(|run| 128 * run).flat_map(of_run).map(f64::from).collect()
    }

    /// A frame of a level that rises along rows, and a dark frame of its camera, of bias 400 and a read noise of 3 ADU, times `scale`, of
    /// `gain` times the noise.
    fn seen(levels: [f64; 2], scale: f64, gain: f64) -> Fitness {
        let mut fitness = Fitness::default();
        for row in 0..16_i32 {
            let slope = (levels[1] - levels[0]) / 2048.0;
            let light = normals(0, row).into_iter().enumerate().map(|(x, z)| {
                let level = levels[0] + slope * x as f64;
                crate::frame::to_sample((400.0 + level + z * (9.0 + 0.3 * level).sqrt()).round())
            });
            let dark = normals(1, row).into_iter().map(|z| scale * (400.0 + 3.0 * gain * z).round());
            fitness.take(&light.collect::<Vec<_>>(), &dark.collect::<Vec<_>>(), Some(1.0));
        }
        fitness
    }

    #[test]
    fn dark_frames_of_a_camera_fit() {
        for levels in [[0.0, 0.0], [0.0, 50.0], [0.0, 9000.0], [500.0, 3000.0]] {
            assert_eq!(seen(levels, 1.0, 1.0).misfit(), None, "{levels:?}");
        }
    }

    /// A frame above its bias of 400 ADU is some 60 times what neighbors differ by above 0; its codes are whole.
    #[test]
    fn what_a_frame_has_above_zero_is_known() {
        let seen = seen([0.0, 3000.0], 4.0, 1.0);
        assert_eq!([30.0, 300.0].map(|times| seen.comes_near_zero(times)), [Some(false), Some(true)]);
        assert_eq!(Fitness::default().comes_near_zero(30.0), None);
        assert_eq!((seen.step_of_frame(), seen.is_fractional), (1.0, false));
        assert_eq!([2, 4, 8].map(|scale| seen.are_darks_multiples_of(scale)), [true, true, false]);
    }

    #[test]
    fn dark_frames_of_another_scale_are_told_by_the_step_of_their_codes() {
        assert_eq!(seen([500.0, 3000.0], 4.0, 1.0).misfit(), Some(Misfit::Step([1, 4])));
        let mut few = Steps::default();
        few.take([400.0, 404.0, 408.0].into_iter());
        assert_eq!(few.step(), None);
        few.take([464.0, 402.5].into_iter());
        assert_eq!(few.step(), None);
    }

    #[test]
    fn dark_frames_that_were_scaled_are_brighter_than_a_part_of_the_frame() {
        // 4.01 times codes are no whole numbers.
        let found = seen([0.0, 3000.0], 4.01, 1.0).misfit();
        assert!(matches!(found, Some(Misfit::Below(share)) if (0.3..0.5).contains(&share)), "{found:?}");
        assert_eq!(seen([1500.0, 3000.0], 4.01, 1.0).misfit(), None);
    }

    #[test]
    fn shares_of_one_beside_codes_are_told() {
        for (scale, is_told) in [(1.0 / 16_383.0, true), (1.0 / 65_535.0, true), (1.0 / 255.0, false), (1.0, false)] {
            let mut fitness = Fitness::default();
            for row in 0..16_i32 {
                let light = normals(0, row).into_iter().map(|z| crate::frame::to_sample((2000.0 + 30.0 * z).round()));
                let dark: Vec<f64> = normals(1, row).into_iter().map(|z| scale * (400.0 + 3.0 * z).round()).collect();
                fitness.take(&light.collect::<Vec<_>>(), &dark, Some(1.0));
            }
            assert_eq!(matches!(fitness.misfit(), Some(Misfit::Shares(_))), is_told, "{scale}");
        }
        // Codes of a camera of no black that are hardly ever 1.
        let mut fitness = Fitness::default();
        for row in 0..16_i32 {
            let dark: Vec<f64> = (0..2048).map(|x| f64::from(u8::from(x % 700 == row))).collect();
            fitness.take(&[2000.0; 2048], &dark, Some(1.0));
        }
        assert_eq!(fitness.misfit(), None);
    }

    #[test]
    fn dark_frames_of_another_gain_scatter_more_than_the_dim_part_of_a_frame() {
        let found = seen([0.0, 300.0], 1.0, 4.0).misfit();
        assert!(matches!(found, Some(Misfit::Scatters(share)) if (0.1..0.9).contains(&share)), "{found:?}");
    }

    /// A sky that is cut off at the white level, in all or in most of its samples, scatters by little there.
    #[test]
    fn saturated_parts_are_not_compared() {
        for above in [60.0, 300.0] {
            let mut fitness = Fitness::default();
            for row in 0..16_i32 {
                let light = normals(0, row).into_iter().map(|z| (16_383.0 + above + 60.0 * z).round().min(16_383.0));
                let dark: Vec<f64> = normals(1, row).into_iter().map(|z| (400.0 + 30.0 * z).round()).collect();
                fitness.take(&light.map(crate::frame::to_sample).collect::<Vec<_>>(), &dark, Some(1.0));
            }
            assert_eq!(fitness.misfit(), None, "{above}");
        }
    }
}

//! Whether exposures that are averaged are of one scene and one scale, by their samples.

use crate::numerics::cut_off::AtZero;
use crate::numerics::steps::Steps;

/// Means of exposures of one scene differ by fewer times, though lamps flicker and clouds pass.
const TIMES: f64 = 8.0;
/// Codes that are multiples of a step are brighter by half as many times at least, where the step is that of another scale.
const OF_STEP: f64 = 0.5;

/// What is seen of the samples of a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct FrameLevels {
    name: String,
    count: f64,
    sum: f64,
    squares: f64,
    steps: Steps,
    /// How many samples are 0, and 1; and below zero or no whole numbers.
    lowest: [f64; 2],
    no_codes: f64,
}

impl FrameLevels {
    /// Nothing yet, of the frame of this name.
    pub(super) fn of(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// Looks at more samples.
    pub(super) fn take(&mut self, samples: &[f32]) {
        for sample in samples.iter().map(|sample| f64::from(*sample)).filter(|sample| sample.is_finite()) {
            self.count += 1.0;
            self.sum += sample;
            self.squares += sample * sample;
            self.lowest[0] += f64::from(u8::from(sample == 0.0));
            self.lowest[1] += f64::from(u8::from(sample == 1.0));
            self.no_codes += f64::from(u8::from(sample < 0.0 || sample.fract() != 0.0));
        }
        if !self.steps.is_one() {
            self.steps.take(samples.iter().map(|sample| f64::from(*sample)));
        }
    }

    /// Its sum, and how many of its samples are the lowest codes; none of samples that are no codes as a converter gave them.
    pub(super) fn lowest_codes(&self) -> Option<(f64, AtZero)> {
        let [zeros, ones] = self.lowest;
        (self.no_codes == 0.0).then_some((self.sum, AtZero { count: self.count, zeros, ones }))
    }

    fn mean(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }

    /// The standard deviation of its samples, scene and noise.
    fn scatter(&self) -> f64 {
        (self.squares / self.count.max(1.0) - self.mean().powi(2)).max(0.0).sqrt()
    }

    /// A warning of a frame that cannot well be of the scene and the scale of the first.
    pub(super) fn doubt_beside(&self, first: &Self) -> Option<String> {
        self.other_step(first).or_else(|| self.other_level(first))
    }

    /// Codes of one of the two are multiples of a larger step, and it is brighter by as many times.
    fn other_step(&self, first: &Self) -> Option<String> {
        let [its, theirs] = [self.steps.step()?, first.steps.step()?];
        let ratio = self.mean() / first.mean();
        let wanted = its as f64 / theirs as f64;
        let is_brighter = if its > theirs { ratio >= OF_STEP * wanted } else { ratio <= wanted / OF_STEP };
        (its != theirs && ratio > 0.0 && is_brighter).then(|| {
            format!(
                "{}: its codes are multiples of {its}, those of {} of {theirs}, and one of the two is brighter by about as many times; their \
                 scales differ, as those of 12 bits and of 14 do",
                self.name, first.name
            )
        })
    }

    /// The mean of one of the two is many times that of the other, by more than the samples of this scatter.
    fn other_level(&self, first: &Self) -> Option<String> {
        let [dim, bright] = if self.mean().abs() < first.mean().abs() { [self, first] } else { [first, self] };
        let [low, high] = [dim.mean(), bright.mean()].map(f64::abs);
        (high > TIMES * low && high - low > dim.scatter()).then(|| {
            format!(
                "{}: its mean is {:.4}, but that of {} {:.4}; exposures of one scene on one scale are nearer; are some shares of 1, codes of \
                 another number of bits, or without light?",
                self.name,
                self.mean(),
                first.name,
                first.mean()
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Codes about a level, times a scale.
    fn levels(name: &str, level: f32, scale: f32) -> FrameLevels {
        let mut levels = FrameLevels::of(name);
        let samples: Vec<f32> = (0_u16..410).map(|i| scale * (level + f32::from(i * 37 % 41) - 20.0)).collect();
        levels.take(&samples);
        levels
    }

    #[test]
    fn gross_factors_are_told() {
        let first = levels("a", 500.0, 1.0);
        for (level, scale, wanted) in [
            (500.0, 4.0, "b: its codes are multiples of 4, those of a of 1"),
            (260.0, 4.0, "b: its codes are multiples of 4, those of a of 1"),
            (500.0, 1.0 / 16384.0, "b: its mean is 0.0305, but that of a 500"),
            (20.0, 1.0, "b: its mean is 2"),
            // Lamps that flicker, clouds, and codes of a camera of coarse ones that is as bright.
            (1500.0, 1.0, ""),
            (170.0, 1.0, ""),
            (125.0, 4.0, ""),
            (501.5, 0.9, ""),
        ] {
            let beside = levels("b", level, scale);
            let doubt = beside.doubt_beside(&first).unwrap_or_default();
            assert!(doubt.starts_with(wanted) && doubt.is_empty() == wanted.is_empty(), "{level} {scale}: {doubt}");
            assert_eq!(first.doubt_beside(&beside).is_some(), !wanted.is_empty(), "{level} {scale}");
        }
        // What is left of dark frames is about 0, whatever the factor between two means.
        assert_eq!(levels("b", 0.5, 1.0).doubt_beside(&levels("a", -6.0, 1.0)), None);
    }
}

//! What means of frames scatter by beyond the noise of their samples: a black level that moves, and light that flickers.
//!
//! Of L frames of a level, with m_k the mean of each, s² = Σ (m_k − m̄)²/(L − 1) expects
//!
//! v + τ² + φ² S²
//!
//! v what temporal noise makes the mean of a frame scatter by, τ² the variance of the black level, φ the relative scatter of the light,
//! S the mean above no light. τ² and φ² are those of least squares over all levels, of weights (L − 1)/(2 (v + τ² + φ² S²)²) worked
//! out at the estimate, neither below 0: iterated MINQUE, the same as restricted maximum likelihood of normal scatter \[Searle1992,
//! ch. 11]. Each is known as well as a variance of ν = (Σ c/V)²/Σ (c/V)²/(L − 1) values, c its factor in V, the sum of the three.
//!
//! The mean of a level is uncertain by (τ² + φ² S²)/L besides its noise. What levels scatter by among each other beyond that
//! follows from what they miss their lines by, [`among`].

use super::fit::variance_besides;
use super::level::Level;
use crate::numerics::quantiles::{of_normal, of_student};
use crate::numerics::significance;
use crate::text::in_digits;

/// A variance, and of how many values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// The variance.
    pub variance: f64,
    /// Degrees of freedom, 1 or more.
    pub freedom: f64,
}

impl Component {
    /// None at all.
    pub const NONE: Self = Self { variance: 0.0, freedom: f64::INFINITY };

    /// So many times as much.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self { variance: self.variance * factor, ..self }
    }

    /// The variance whose normal law reaches as far, at such confidence, as Student's of this one does.
    pub fn known(self, confidence: f64) -> f64 {
        self.variance * few(self.freedom, confidence)
    }

    /// Of all together \[Satterthwaite1946].
    pub fn sum(parts: &[Self]) -> Self {
        let variance: f64 = parts.iter().map(|part| part.variance).sum();
        let squares: f64 = parts.iter().map(|part| part.variance.powi(2) / part.freedom).sum();
        Self { variance, freedom: if squares > 0.0 { variance * variance / squares } else { f64::INFINITY } }
    }
}

/// How much larger the square of a quantile of Student's law is than that of the normal.
pub fn few(freedom: f64, confidence: f64) -> f64 {
    let p = f64::midpoint(1.0, confidence);
    if freedom.is_finite() { (of_student(p, freedom.max(1.0)) / of_normal(p)).powi(2) } else { 1.0 }
}

/// The variance that points scatter by besides their own, from what they miss their line by with so much `freedom` left, and of
/// how many values that is known; as [`variance_besides`] has it.
pub fn among(freedom: f64, misfit: impl Fn(f64) -> f64, largest: f64) -> Component {
    /// Of one value alone nothing would be known of it.
    const LEAST: f64 = 2.0;
    let variance = if freedom > 0.0 { variance_besides(freedom, misfit, largest) } else { 0.0 };
    Component { variance, freedom: freedom.max(LEAST) }
}

/// How the mean of darks drifts from one frame of a level to the next, alike at all levels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Drift {
    /// By so much at most, in samples; 0 where one of 500 cameras without any shows as much.
    pub most: f64,
    /// Whether it is far beyond chance.
    pub is_sure: bool,
}

/// What frames scatter by beyond the noise of their samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// That of the black level, in samples², from frame to frame.
    pub black: Component,
    /// That of the light, relative, from frame to frame.
    pub light: Component,
    /// How means of darks drift from frame to frame.
    pub drift: Drift,
    /// What is to be said of it, and whether it is a doubt.
    pub told: Vec<(String, bool)>,
}

/// What frames of a level scatter by: degrees of freedom, the variance of their means, what noise explains of it, and the signal.
#[derive(Debug, Clone, Copy)]
struct Means {
    freedom: f64,
    square: f64,
    noise: f64,
    signal: f64,
}

impl Means {
    fn of(level: &Level, black: f64) -> Option<Self> {
        let freedom = level.frames as f64 - 1.0;
        let noise = level.mean_variance * level.frames as f64;
        let means: Vec<f64> = (0..level.frames).map(|frame| level.frame_mean(frame)).collect();
        let mean = means.iter().sum::<f64>() / means.len() as f64;
        let square = means.iter().map(|own| (own - mean).powi(2)).sum::<f64>() / freedom;
        let signal = if level.condition.is_lit { (level.mean - black).max(0.0) } else { 0.0 };
        (freedom > 0.0 && noise > 0.0).then_some(Self { freedom, square, noise, signal })
    }

    /// How much each variance is of that of a mean.
    fn factors(&self) -> [f64; 2] {
        [1.0, self.signal * self.signal]
    }

    fn variance(&self, of: [f64; 2]) -> f64 {
        let [black, light] = self.factors();
        self.noise + black * of[0] + light * of[1]
    }
}

impl Scatter {
    /// Of all darks, and of flats below saturation.
    pub fn of(flats: &[&Level], darks: &[Level]) -> Self {
        let least = |levels: &mut dyn Iterator<Item = f64>| levels.fold(f64::INFINITY, f64::min);
        let of_darks = least(&mut darks.iter().map(|dark| dark.mean));
        let black = if of_darks.is_finite() { of_darks } else { 0.0 };
        let all = flats.iter().copied().chain(darks);
        let means: Vec<Means> = all.filter_map(|level| Means::of(level, black)).collect();
        let found = components(&means);
        let component = |which: usize| {
            let ratio = |level: &Means| level.factors()[which] / level.variance(found);
            let sum: f64 = means.iter().map(|level| level.freedom * ratio(level)).sum();
            let squares: f64 = means.iter().map(|level| level.freedom * ratio(level).powi(2)).sum();
            let freedom = if squares > 0.0 { (sum * sum / squares).max(1.0) } else { f64::INFINITY };
            Component { variance: found[which], freedom }
        };
        let [black, light] = [0, 1].map(component);
        let are_timed = darks.iter().all(|dark| dark.condition.exposure_s.is_some());
        Self { black, light, drift: drift(darks, found[0]), told: told(&means, found, are_timed) }
    }

    /// What the mean of a level is uncertain by from its black, a variance.
    pub fn of_black(&self, level: &Level) -> Component {
        self.black.times(1.0 / level.frames as f64)
    }

    /// What the light of a level is uncertain by, a relative variance.
    pub fn of_light(&self, level: &Level) -> Component {
        self.light.times(1.0 / level.frames as f64)
    }
}

/// How far means of darks drift from frame to frame, at most, where that is alike at all levels and beyond chance, of a black level that scatters
/// by such a variance.
///
/// Σ w (k − k̄)(m_k − m̄) / Σ w (k − k̄)²        over the frames k of all levels, w = 1/(v + τ²)
fn drift(darks: &[Level], black: f64) -> Drift {
    /// What is as sure is reckoned with, and what is told.
    const SURE: [f64; 2] = [0.999, 0.9999];
    /// No more than the upper end of such an interval.
    const HIGH: f64 = 0.975;
    let [mut products, mut squares, mut all, mut freedom] = [0.0, 0.0, 0.0, -1.0];
    for dark in darks {
        let count = dark.frames as f64;
        let weight = 1.0 / (dark.mean_variance * count + black).max(f64::MIN_POSITIVE);
        let means = || (0..dark.frames).map(|frame| dark.frame_mean(frame));
        let mean = means().sum::<f64>() / count;
        for (place, own) in means().enumerate() {
            let at = place as f64 - (count - 1.0) / 2.0;
            products += weight * at * (own - mean);
            squares += weight * at * at;
            all += weight * (own - mean).powi(2);
        }
        freedom += count - 1.0;
    }
    if freedom < 1.0 {
        return Drift::default();
    }
    let slope = products / squares;
    let scatter = ((all - slope * products).max(0.0) / freedom / squares).sqrt();
    let [is_any, is_sure] = SURE.map(|sure| slope.abs() > of_student(sure, freedom) * scatter);
    let most = slope.abs() + of_student(HIGH, freedom) * scatter;
    if is_any { Drift { most, is_sure } } else { Drift::default() }
}

/// τ² and φ².
fn components(means: &[Means]) -> [f64; 2] {
    let mut found = [0.0; 2];
    for _ in 0..200 {
        let (mut squares, mut products) = ([0.0; 3], [0.0; 2]);
        for level in means {
            let weight = level.freedom / level.variance(found).powi(2);
            let [black, light] = level.factors();
            for (sum, factor) in squares.iter_mut().zip([black * black, black * light, light * light]) {
                *sum += weight * factor;
            }
            for (sum, factor) in products.iter_mut().zip([black, light]) {
                *sum += weight * factor * (level.square - level.noise);
            }
        }
        let alone = [squares[0], squares[2]].map(|square| if square > 0.0 { 1.0 / square } else { 0.0 });
        let determinant = squares[0] * squares[2] - squares[1] * squares[1];
        let both = [
            (squares[2] * products[0] - squares[1] * products[1]) / determinant,
            (squares[0] * products[1] - squares[1] * products[0]) / determinant,
        ];
        let next = match both {
            [black, light] if determinant > 1e-12 * squares[0] * squares[2] && black >= 0.0 && light >= 0.0 => both,
            [black, _] if black < 0.0 => [0.0, (products[1] * alone[1]).max(0.0)],
            _ => [(products[0] * alone[0]).max(0.0), 0.0],
        };
        let is_done = found.iter().zip(next).all(|(old, new)| (old - new).abs() <= 1e-6 * new);
        found = next;
        if is_done {
            break;
        }
    }
    found
}

/// What is said of scatter that noise does not explain, of darks whose exposure times are known or not.
fn told(means: &[Means], [black, light]: [f64; 2], are_timed: bool) -> Vec<(String, bool)> {
    /// Light that scatters by so large a share is doubted.
    const MUCH: f64 = 1e-3;
    /// A black level that scatters by so much is.
    const MUCH_ADU: f64 = 0.1;
    /// Less likely is beyond chance.
    const LEVEL: f64 = 1e-6;
    let beyond = |is_lit: bool, of: [f64; 2]| {
        let own = means.iter().filter(|level| (level.signal > 0.0) == is_lit);
        let [freedom, sum, noise] = own.fold([0.0; 3], |[freedom, sum, noise], level| {
            let [own, explained] = [level.freedom, level.variance(of)];
            [freedom + own, sum + own * level.square / explained, noise + own * explained]
        });
        // Twice what noise explains is more than that may be off by.
        let is_beyond = sum > 2.0 * freedom && significance::of_chi_square(sum, freedom) < LEVEL;
        is_beyond.then(|| (noise / freedom).sqrt())
    };
    let of_black = beyond(false, [0.0; 2]).filter(|_| black > 0.0).map(|noise| {
        let text = format!(
            "means of darks scatter by {} ADU from frame to frame, of which noise explains {}: {}, which intervals of black level, dark \
             current and linearity take in",
            in_digits(black.sqrt().hypot(noise), 3),
            in_digits(noise, 3),
            if are_timed {
                "the black level moves"
            } else {
                "they are of several exposure times, which `exposure_s` of a list would tell apart, or the black level moves"
            }
        );
        (text, black.sqrt() >= MUCH_ADU)
    });
    let of_light = beyond(true, [black, 0.0]).filter(|_| light > 0.0).map(|_| {
        let text = format!(
            "light scatters by {:.2} % from frame to frame beyond noise, which intervals of responsivity, quantum efficiency and \
             linearity take in",
            light.sqrt() * 100.0
        );
        (text, light.sqrt() >= MUCH)
    });
    of_black.into_iter().chain(of_light).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two levels of darks and two of flats whose scatter is exactly that of τ² = 4 and φ = 0.01, and one of noise alone.
    #[test]
    fn black_and_light_are_told_apart() {
        let level = |signal: f64, freedom: f64, of: [f64; 2]| {
            let own = Means { freedom, square: 0.0, noise: 0.5, signal };
            Means { square: own.variance(of), ..own }
        };
        let truth = [4.0, 1e-4];
        let means = [(0.0, 1.0), (0.0, 3.0), (500.0, 1.0), (2000.0, 7.0)]
            .map(|(signal, freedom)| level(signal, freedom, truth));
        let found = components(&means);
        for (found, truth) in found.into_iter().zip(truth) {
            assert!((found / truth - 1.0).abs() < 1e-4, "{found} {truth}");
        }
        let quiet = [(0.0, 5.0), (800.0, 5.0)].map(|(signal, freedom)| level(signal, freedom, [0.0; 2]));
        assert_eq!(components(&quiet), [0.0; 2]);
        // A dark that scatters by less than noise leaves the light its own.
        let less = [Means { square: 0.1, ..quiet[0] }, level(1000.0, 9.0, [0.0, 1e-4])];
        let found = components(&less);
        assert!(found[0] == 0.0 && (found[1] / 1e-4 - 1.0).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn few_values_reach_as_far_as_students_law() {
        assert!((few(4.0, 0.95).sqrt() * 1.959_964 - 2.776_445).abs() < 1e-4);
        assert_eq!(few(f64::INFINITY, 0.95), 1.0);
        let sum = Component::sum(&[
            Component { variance: 3.0, freedom: 5.0 },
            Component::NONE,
            Component { variance: 1.0, freedom: 10.0 },
        ]);
        assert!((sum.variance - 4.0).abs() < 1e-12 && (sum.freedom - 16.0 / 1.9).abs() < 1e-12, "{sum:?}");
    }
}

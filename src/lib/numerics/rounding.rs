//! Moments of a normal variable that is rounded to whole numbers and clipped to a range.

use super::normal::{cumulative, density};
use nalgebra::Complex;

/// The codes that a number is rounded to: the nearest, ties away from zero, from the lowest to the highest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// The lowest code; −∞ where there is none.
    pub lowest: f64,
    /// The highest code; ∞ where there is none.
    pub highest: f64,
}

/// Standard deviations beyond which nothing counts: a normal variable is farther off in one of 10¹⁸ cases.
pub const REACH: f64 = 9.0;

/// The standard deviation in codes from which rounding adds a uniform error and nothing else: what else it does is below
/// e^(−2π²σ²), 4·10⁻¹⁴.
pub const SMOOTH: f64 = 1.25;

/// From this standard deviation on a sum over codes is its integral and six terms of Euler and Maclaurin; the next, about
/// 10⁻⁷/σ¹³, is below 10⁻¹².
const WIDE: f64 = 2.5;

/// The standard deviation in codes from which five terms of the series of moments will do.
const FEW_TERMS: f64 = 0.3;

/// What rounding adds to the mean of a normal variable that no end is near.
fn of_rounding(mean: f64, sigma: f64) -> f64 {
    if sigma >= SMOOTH {
        return 0.0;
    }
    let (sine, cosine) = (std::f64::consts::TAU * (mean - mean.round())).sin_cos();
    let q = (-2.0 * (std::f64::consts::PI * sigma).powi(2)).exp();
    // (−1)ᵐ sin(mt) and q^(m²), each from those before.
    let (mut before, mut alternating) = (0.0, -sine);
    let (mut damping, mut next) = (q, q * q * q);
    let (mut sum, mut m) = (0.0, 1.0);
    while damping > 1e-16 {
        sum += alternating * damping / m;
        (before, alternating) = (alternating, -2.0 * cosine * alternating - before);
        damping *= next;
        next *= q * q;
        m += 1.0;
    }
    sum / std::f64::consts::PI
}

/// What rounding adds to moments 1 to 4, about a whole number from which the mean is off by `x`, of a normal variable that no end is
/// near, beside those of a uniform error.
///
/// With G(t) = e^(ixt − σ²t²/2) sin(t/2)/(t/2), the characteristic function of the variable and a uniform error, that of its codes is
/// Σ G(t + 2πm) (Poisson's summation over whole numbers), and moments are its derivatives at 0. With r = 1/2πm and a = ix − 2πmσ²
/// that of m ≠ 0 is, from h¹ to h⁴,
///
/// (−1)ᵐ e^(2πimx − 2π²m²σ²) r [h − r h² + (r² − 1/24) h³ − (r³ − r/24) h⁴] [1 + a h + (a² − σ²) h²/2 + (a³ − 3aσ²) h³/6].
fn moments_of_rounding(x: f64, sigma: f64) -> [f64; 4] {
    let square = sigma * sigma;
    let turn = Complex::from_polar(1.0, std::f64::consts::TAU * (x - x.round()));
    let q = (-2.0 * std::f64::consts::PI * std::f64::consts::PI * square).exp();
    let mut found = [0.0; 4];
    let (mut damping, mut next) = (q, q * q * q);
    let (mut direction, mut m) = (-turn, 1.0);
    while damping > 1e-18 {
        let r = 1.0 / (std::f64::consts::TAU * m);
        let a = Complex::new(-square / r, x);
        let (e2, e3) = (0.5 * (a * a - square), a * (a * a - 3.0 * square) / 6.0);
        let s3 = r * r - 1.0 / 24.0;
        let terms = [Complex::from(1.0), a - r, e2 - a * r + s3, e3 - e2 * r + (a - r) * s3];
        // (−i)ʲ j!, and m and −m together.
        let scale = direction * (2.0 * damping * r);
        let factors = [-Complex::i(), Complex::from(-2.0), 6.0 * Complex::i(), Complex::from(24.0)];
        for ((found, term), factor) in found.iter_mut().zip(terms).zip(factors) {
            *found += (scale * term * factor).re;
        }
        damping *= next;
        next *= q * q;
        (direction, m) = (-direction * turn, m + 1.0);
    }
    found
}

/// Adds to moments the step of the powers from a code to the next, times the share that is beyond the edge between them.
fn add_step(moments: &mut [f64; 4], code: f64, share: f64) {
    let (below, above) = (powers(code), powers(code + 1.0));
    for (moment, (below, above)) in moments.iter_mut().zip(below.into_iter().zip(above)) {
        *moment += share * (above - below);
    }
}

/// Moments 1 to 4, about a whole number from which the mean is off by `x`, of a rounded normal variable that no end is near; of a standard
/// deviation of no less than [`FEW_TERMS`].
fn free_moments(x: f64, sigma: f64) -> [f64; 4] {
    let smooth = uniform(x, sigma);
    if sigma >= SMOOTH {
        return smooth;
    }
    let waves = moments_of_rounding(x, sigma);
    [0, 1, 2, 3].map(|j| smooth[j] + waves[j])
}

/// Moments 1 to 4 of a normal variable and a uniform error of one code.
fn uniform(x: f64, sigma: f64) -> [f64; 4] {
    about(x, sigma * sigma + 1.0 / 12.0, -1.0 / 120.0)
}

/// Powers 1 to 4.
fn powers(x: f64) -> [f64; 4] {
    let square = x * x;
    [x, square, square * x, square * square]
}

/// Moments 1 to 4 of a variable `offset` + noise of such `variance` and fourth cumulant, symmetric.
pub fn about(offset: f64, variance: f64, fourth: f64) -> [f64; 4] {
    let [x, square, cube, fourth_power] = powers(offset);
    [
        x,
        square + variance,
        cube + 3.0 * x * variance,
        fourth_power + 6.0 * square * variance + 3.0 * variance * variance + fourth,
    ]
}

impl Rounding {
    /// Moments 1 to 4 about `center`, a whole number, of a normal variable of this mean and standard deviation once it is
    /// rounded and clipped. Exact to about 10⁻¹² of the variable's own moments.
    ///
    /// # Examples
    ///
    /// ```
    /// use cyanometer::numerics::rounding::Rounding;
    ///
    /// let byte = Rounding { lowest: 0.0, highest: 255.0 };
    /// // Ties go away from zero.
    /// assert_eq!(byte.moments(12.5, 0.0, 12.0)[0], 1.0);
    /// // Sheppard: rounding adds 1/12 to the variance of what spreads over a few codes.
    /// let [mean, square, ..] = byte.moments(100.3, 2.0, 100.0);
    /// assert!((square - mean * mean - 4.0 - 1.0 / 12.0).abs() < 1e-12);
    /// ```
    pub fn moments(&self, mean: f64, sigma: f64, center: f64) -> [f64; 4] {
        if sigma <= 0.0 {
            return powers(self.code(mean) - center);
        }
        let reach = REACH * sigma;
        let is_free = mean - reach > self.lowest && mean + reach < self.highest;
        if is_free && sigma >= FEW_TERMS {
            return free_moments(mean - center, sigma);
        }
        if mean + reach < self.lowest - 0.5 || mean - reach > self.highest + 0.5 {
            return powers(self.code(mean) - center);
        }
        if sigma >= WIDE {
            return self.integral(mean, sigma, center);
        }
        if sigma >= FEW_TERMS && self.is_mostly_within(mean, reach) {
            self.less_beyond(mean, sigma, center)
        } else {
            self.sum(mean, sigma, center)
        }
    }

    /// What the ends take from these moments, of a variable that scatters over so many codes that rounding is a uniform error of it:
    /// the moments less those of codes without ends. Nothing where no end is within [`REACH`].
    pub fn taken_by_ends(&self, mean: f64, sigma: f64, center: f64) -> [f64; 4] {
        let reach = REACH * sigma;
        if mean - reach > self.lowest && mean + reach < self.highest {
            return [0.0; 4];
        }
        let (ended, endless) = (self.moments(mean, sigma, center), uniform(mean - center, sigma));
        [0, 1, 2, 3].map(|j| ended[j] - endless[j])
    }

    /// The first of [`Self::moments`], in less time.
    ///
    /// Far from the ends it is x + Σ (−1)ᵐ sin(2πm x) e^(−2π²m²σ²)/(πm), x the mean, which few terms of sum.
    pub fn mean(&self, mean: f64, sigma: f64, center: f64) -> f64 {
        let reach = REACH * sigma;
        let is_free = mean - reach > self.lowest && mean + reach < self.highest;
        if sigma <= 0.0 || mean + reach < self.lowest - 0.5 || mean - reach > self.highest + 0.5 {
            return self.code(mean) - center;
        }
        if is_free && sigma >= FEW_TERMS {
            return mean - center + of_rounding(mean, sigma);
        }
        if sigma >= WIDE {
            return self.mean_of_integral(mean, sigma, center);
        }
        if sigma >= FEW_TERMS && self.is_mostly_within(mean, reach) {
            let mut found = mean - center + of_rounding(mean, sigma);
            self.each_beyond(mean, sigma, |_, share| found += share);
            return found;
        }
        let base = self.code(mean);
        let mut found = base - center;
        let mut code = base;
        while code < self.highest && code + 0.5 < mean + reach {
            found += cumulative((mean - code - 0.5) / sigma);
            code += 1.0;
        }
        code = base - 1.0;
        while code >= self.lowest && code + 0.5 > mean - reach {
            found -= cumulative((code + 0.5 - mean) / sigma);
            code -= 1.0;
        }
        found
    }

    /// The code of a number.
    pub fn code(&self, number: f64) -> f64 {
        number.round().clamp(self.lowest, self.highest)
    }

    /// Whether more codes within reach of a mean lie between the ends than beyond them.
    fn is_mostly_within(&self, mean: f64, reach: f64) -> bool {
        self.highest.min(mean + reach) - self.lowest.max(mean - reach) > reach
    }

    /// Goes through the edges k + ½ beyond the ends: k, and what clipping adds to the share of what lies beyond the edge.
    fn each_beyond(&self, mean: f64, sigma: f64, mut of: impl FnMut(f64, f64)) {
        let reach = REACH * sigma;
        let mut code = self.highest;
        while code + 0.5 < mean + reach {
            of(code, -cumulative((mean - code - 0.5) / sigma));
            code += 1.0;
        }
        code = self.lowest - 1.0;
        while code + 0.5 > mean - reach {
            of(code, cumulative((code + 0.5 - mean) / sigma));
            code -= 1.0;
        }
    }

    /// The moments of codes without ends, less what lies beyond these: fewer terms than a sum over the codes between them.
    fn less_beyond(&self, mean: f64, sigma: f64, center: f64) -> [f64; 4] {
        let mut moments = free_moments(mean - center, sigma);
        self.each_beyond(mean, sigma, |code, share| add_step(&mut moments, code - center, share));
        moments
    }

    /// Σ over the edges k + ½ of codes, of the step of the power there and the probability to be beyond.
    fn sum(&self, mean: f64, sigma: f64, center: f64) -> [f64; 4] {
        let reach = REACH * sigma;
        let base = self.code(mean);
        let mut moments = powers(base - center);
        let mut add = |code: f64, share: f64| add_step(&mut moments, code - center, share);
        let mut code = base;
        while code < self.highest && code + 0.5 < mean + reach {
            add(code, cumulative((mean - code - 0.5) / sigma));
            code += 1.0;
        }
        code = base - 1.0;
        while code >= self.lowest && code + 0.5 > mean - reach {
            add(code, -cumulative((code + 0.5 - mean) / sigma));
            code -= 1.0;
        }
        moments
    }

    /// The same sum as an integral: with D(t) = (t + ½ − c)ʲ − (t − ½ − c)ʲ and T(t) the probability to exceed t,
    ///
    /// Σ D T over the midpoints of a..b = ∫ D T dt − [(DT)′]/24 + 7 [(DT)‴]/5760 − …
    fn integral(&self, mean: f64, sigma: f64, center: f64) -> [f64; 4] {
        let [low, high] = self.ends(mean, sigma);
        let [p0, p1, p2, p3, p4] = partial_between(&low, &high);
        let (x, s) = (mean - center, sigma);
        // The integral of D from the low end in powers of t − mean, and ∫ D dt: x, x², x³ + x/4, x⁴ + x²/2.
        let first = x * p0 + s * p1;
        let second = x * x * p0 + 2.0 * x * s * p1 + s * s * p2;
        let third = x.powi(3) * p0 + 3.0 * x * x * s * p1 + 3.0 * x * s * s * p2 + s.powi(3) * p3;
        let fourth = x.powi(4) * p0
            + 4.0 * x.powi(3) * s * p1
            + 6.0 * x * x * s * s * p2
            + 4.0 * x * s.powi(3) * p3
            + s.powi(4) * p4;
        let between = [first, second, third + 0.25 * first, fourth + 0.5 * second];
        let whole = |t: f64| {
            let [x, square, cube, fourth] = powers(t - center);
            [x, square, cube + 0.25 * x, fourth + 0.5 * square]
        };
        let [at_low, at_high] = [whole(low.at), whole(high.at)];
        let of_first = powers(low.at - center);
        let terms = terms(sigma);
        let [of_low, of_high] = [low, high].map(|end| {
            if end.is_far() {
                return far_correction(end.at - center).map(|of_all| of_all * end.above);
            }
            let derivatives = end.derivatives(sigma, terms);
            [0, 1, 2, 3].map(|j| correction(j, end.at - center, &derivatives, terms))
        });
        let moment = |j: usize| {
            let ends = at_high[j] * high.above + at_low[j] * low.below - at_low[j];
            of_first[j] + between[j] + ends + of_high[j] - of_low[j]
        };
        [0, 1, 2, 3].map(moment)
    }

    /// The first of these moments: ∫ T dt between the ends, and its terms there.
    fn mean_of_integral(&self, mean: f64, sigma: f64, center: f64) -> f64 {
        let ends = self.ends(mean, sigma);
        // ∫ T dt = (t − mean) T − σ φ.
        let terms = terms(sigma);
        let [low, high] = ends.map(|end| {
            let whole = (end.at - mean) * end.above - sigma * end.density;
            if end.is_far() {
                return whole;
            }
            let derivatives = end.derivatives(sigma, terms);
            let corrections =
                MIDPOINTS.iter().enumerate().take(terms).map(|(k, factor)| factor * derivatives[2 * k + 1]);
            whole + corrections.sum::<f64>()
        });
        ends[0].at - center + high - low
    }

    /// The lowest and the highest code within reach, as ends of a sum.
    fn ends(&self, mean: f64, sigma: f64) -> [End; 2] {
        let reach = REACH * sigma;
        let codes = [self.lowest.max((mean - reach).floor()), self.highest.min((mean + reach).ceil())];
        codes.map(|at| End::of(at, (at - mean) / sigma))
    }
}

/// An end of a sum, so many standard deviations from the mean.
#[derive(Debug, Clone, Copy)]
struct End {
    at: f64,
    z: f64,
    density: f64,
    /// Probabilities to be below and above.
    below: f64,
    above: f64,
}

impl End {
    fn of(at: f64, z: f64) -> Self {
        // The lesser of the two to full precision.
        let lesser = cumulative(-z.abs());
        let (below, above) = if z > 0.0 { (1.0 - lesser, lesser) } else { (lesser, 1.0 - lesser) };
        Self { at, z, density: density(z), below, above }
    }

    /// Whether it is so far off that nothing of the density is left there.
    fn is_far(&self) -> bool {
        self.z.abs() >= REACH
    }

    /// Derivatives of T by t, as many as such a number of corrections takes: −(−1)ⁿ⁻¹ Heₙ₋₁(z) φ(z)/σⁿ.
    fn derivatives(&self, sigma: f64, terms: usize) -> [f64; DERIVATIVES] {
        let mut t = [0.0; DERIVATIVES];
        t[0] = self.above;
        let (mut before, mut hermite) = (0.0, 1.0);
        let step = -1.0 / sigma;
        let mut scale = self.density * step;
        for (n, derivative) in t.iter_mut().enumerate().take(2 * terms).skip(1) {
            *derivative = scale * hermite;
            scale *= step;
            (before, hermite) = (hermite, self.z * hermite - (n - 1) as f64 * before);
        }
        t
    }
}

/// ∫ zⁿ φ(z) dz between two ends, n from 0 to 4.
pub fn partial_moments([low, high]: [f64; 2]) -> [f64; 5] {
    partial_between(&End::of(low, low), &End::of(high, high))
}

fn partial_between(low: &End, high: &End) -> [f64; 5] {
    let mass = if low.z > 0.0 { low.above - high.above } else { high.below - low.below };
    let of_end = |end: &End| {
        let [z, square, cube, _] = if end.z.is_finite() { powers(end.z) } else { [0.0; 4] };
        [1.0, z, square, cube].map(|power| power * end.density)
    };
    let [below, above] = [of_end(low), of_end(high)];
    let mut found = [mass, below[0] - above[0], 0.0, 0.0, 0.0];
    for n in 2..5 {
        found[n] = below[n - 1] - above[n - 1] + (n - 1) as f64 * found[n - 2];
    }
    found
}

/// Factors of the odd derivatives of D T, 1 to 11, in the formula of Euler and Maclaurin for midpoints:
/// −(1 − 2^(1−2k)) B₂ₖ/(2k)!, B₂ₖ Bernoulli's numbers.
const MIDPOINTS: [f64; 6] = [
    -1.0 / 24.0,
    7.0 / 5760.0,
    -31.0 / 967_680.0,
    127.0 / 154_828_800.0,
    -511.0 / 512.0 * 5.0 / 66.0 / 3_628_800.0,
    2047.0 / 2048.0 * 691.0 / 2730.0 / 479_001_600.0,
];

/// Derivatives of T that these take.
const DERIVATIVES: usize = 2 * MIDPOINTS.len();

/// How many of these count: the next is below 10⁻¹³ σʲ⁺¹ at any distance.
fn terms(sigma: f64) -> usize {
    const FROM: [(f64, usize); 4] = [(55.0, 2), (17.0, 3), (8.5, 4), (5.5, 5)];
    FROM.iter().find(|(from, _)| sigma >= *from).map_or(MIDPOINTS.len(), |(_, terms)| *terms)
}

/// The same at an end where T is 1 and its derivatives are nothing.
fn far_correction(x: f64) -> [f64; 4] {
    let [first, third, ..] = MIDPOINTS;
    [0.0, 2.0 * first, 6.0 * x * first, (12.0 * x * x + 1.0) * first + 24.0 * third]
}

/// Σ of the odd derivatives of D T at one end, `x` from the center, by those of T.
fn correction(j: usize, x: f64, t: &[f64; DERIVATIVES], terms: usize) -> f64 {
    // Derivatives 0 to 3 of D, a polynomial of degree j.
    let d = match j {
        0 => [1.0, 0.0, 0.0, 0.0],
        1 => [2.0 * x, 2.0, 0.0, 0.0],
        2 => [3.0 * x * x + 0.25, 6.0 * x, 6.0, 0.0],
        _ => [4.0 * x.powi(3) + x, 12.0 * x * x + 1.0, 24.0 * x, 24.0],
    };
    let product = |order: usize| -> f64 {
        let mut binomial = 1.0;
        let mut sum = 0.0;
        for (k, d) in d.iter().enumerate().take(order.min(j) + 1) {
            sum += binomial * d * t[order - k];
            binomial *= (order - k) as f64 / (k + 1) as f64;
        }
        sum
    };
    MIDPOINTS.iter().enumerate().take(terms).map(|(k, factor)| factor * product(2 * k + 1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probabilities of the codes one by one.
    fn reference(rounding: Rounding, mean: f64, sigma: f64, center: f64) -> [f64; 4] {
        let mut moments = [0.0; 4];
        let mut code = rounding.lowest;
        while code <= rounding.highest {
            let at = |edge: f64| (edge - mean) / sigma;
            let below = if code == rounding.lowest { f64::NEG_INFINITY } else { at(code - 0.5) };
            let above = if code == rounding.highest { f64::INFINITY } else { at(code + 0.5) };
            let p = partial_moments([below, above])[0];
            for (power, moment) in (1..).zip(&mut moments) {
                *moment += p * (code - center).powi(power);
            }
            code += 1.0;
        }
        moments
    }

    /// What the ends take is nothing far from them, and near them what is left of the moments of codes without ends.
    #[test]
    fn ends_take_what_codes_without_ends_have_more() {
        let [byte, endless] =
            [(0.0, 255.0), (f64::NEG_INFINITY, f64::INFINITY)].map(|(lowest, highest)| Rounding { lowest, highest });
        assert_eq!(byte.taken_by_ends(128.3, 12.0, 120.0), [0.0; 4]);
        for (mean, sigma) in [(3.2, 1.3), (-4.0, 2.0), (9.7, 6.0), (250.1, 3.1), (100.0, 40.0)] {
            let (taken, of_byte) = (byte.taken_by_ends(mean, sigma, 100.0), byte.moments(mean, sigma, 100.0));
            let without = endless.moments(mean, sigma, 100.0);
            for j in 0..4 {
                let all = of_byte[j].abs() + without[j].abs();
                assert!(
                    (taken[j] - (of_byte[j] - without[j])).abs() <= 1e-13 * all && taken[j] != 0.0,
                    "{mean} {sigma} {j}"
                );
            }
        }
    }

    /// Rails near and far, spreads of a hundredth of a code to three times the range.
    #[test]
    fn moments_are_those_of_the_codes() {
        let byte = Rounding { lowest: 0.0, highest: 255.0 };
        for sigma in [0.01, 0.1, 0.29, 0.31, 0.4, 0.9, 1.3, 2.4, 2.5, 2.6, 3.0, 4.0, 8.0, 20.0, 100.0, 800.0] {
            for mean in [-30.0, -0.5, 0.2, 3.5, 12.49, 100.0, 127.3, 250.6, 255.5, 259.0, 400.0] {
                let center = byte.code(mean);
                let (found, expected) = (byte.moments(mean, sigma, center), reference(byte, mean, sigma, center));
                assert!((byte.mean(mean, sigma, center) - expected[0]).abs() < 1e-10 * sigma.clamp(1.0, 256.0));
                for (j, power) in (0..4).zip(1..) {
                    let scale = sigma.clamp(1.0, 256.0).powi(power);
                    assert!(
                        (found[j] - expected[j]).abs() < 1e-10 * scale,
                        "{sigma} {mean} {j}: {} {}",
                        found[j],
                        expected[j]
                    );
                }
            }
        }
    }
}

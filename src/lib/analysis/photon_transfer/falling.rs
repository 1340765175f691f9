//! Whether bright photosites of a level have less temporal noise than others, as where those that are full are cut off.
//!
//! With q the sum of squares of what the L samples of a photosite depart from their mean ȳ by, blocks of a row tell the covariance of the two,
//!
//! T = Σ (q − ⟨q⟩)(ȳ − ⟨ȳ⟩)/(L − 1),  V = Σ (ȳ − ⟨ȳ⟩)²,
//!
//! means being those of a block, so that uneven light, rows and columns do not count. Of a line of light with σ² = K μ both what a photosite
//! scatters by, V_t = ν σ²/L of ν degrees of freedom, and how photosites differ, V − V_t, make T = K V: brighter ones have more. A response
//! y ∝ x^γ has (3 − 2/γ) V_t + (2 − 1/γ)(V − V_t) in place of V, which is above −2 V_t − V/2 for any γ above 0.4. What is cut off takes noise
//! from the brightest, and has T far below that where the variance as a whole does not show it.

/// Columns of a block.
const BLOCK: usize = 8;
/// Standard deviations that are beyond chance.
const BEYOND: f64 = 3.0;
/// What tones take off in proportion to V_t, and to V, at most.
const TONES: [f64; 2] = [2.0, 0.5];

/// How temporal noise goes with the mean among neighbors.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Falling {
    /// T.
    product: f64,
    /// What it scatters by, a variance.
    scatter: f64,
    /// V.
    spread: f64,
    /// ν.
    freedom: f64,
}

impl Falling {
    /// Of several grids together.
    pub fn of_all(grids: impl Iterator<Item = Self>) -> Self {
        grids.fold(Self::default(), |all, grid| Self {
            product: all.product + grid.product,
            scatter: all.scatter + grid.scatter,
            spread: all.spread + grid.spread,
            freedom: all.freedom + grid.freedom,
        })
    }

    /// Whether bright photosites have less noise beyond chance, by more than tones or rounding do, of a level of such a temporal variance in
    /// so many frames, of such a signal, where rounding may have the variance so much off.
    pub fn is_cut(&self, [variance, frames]: [f64; 2], signal: f64, hidden: f64) -> bool {
        let of_noise = self.freedom * variance / frames;
        let of_tones = variance / signal.max(f64::MIN_POSITIVE) * (TONES[0] * of_noise + TONES[1] * self.spread);
        // What rounding hides is a wave over the codes.
        let of_rounding = std::f64::consts::TAU * hidden * self.spread;
        self.product < -BEYOND * self.scatter.sqrt() && self.product < -of_tones - of_rounding
    }
}

/// Sums over blocks of rows.
#[derive(Debug, Default)]
pub struct FallingSums {
    /// Blocks, Σ T and Σ T² of them.
    products: [f64; 3],
    spread: f64,
    freedom: f64,
}

impl FallingSums {
    /// Adds the sums of squares of the photosites of a row, and their means.
    #[inline(always)]
    pub fn add(&mut self, squares: &[f64], means: &[f64]) {
        let (whole, rest) = squares.as_chunks::<BLOCK>();
        let (whole_means, rest_means) = means.as_chunks::<BLOCK>();
        let mut spread = [0.0; BLOCK];
        for (squares, means) in whole.iter().zip(whole_means) {
            let of_means = block_sum(*means) / BLOCK as f64;
            let mut products = [0.0; BLOCK];
            for lane in 0..BLOCK {
                let off = means[lane] - of_means;
                // What is off adds up to 0, so that the mean of the squares takes nothing off.
                products[lane] = squares[lane] * off;
                spread[lane] += off * off;
            }
            self.note(block_sum(products));
        }
        self.spread += block_sum(spread);
        self.freedom += whole.len() as f64 * (BLOCK as f64 - 1.0);
        if rest.len() > 1 {
            let of_means = rest_means.iter().sum::<f64>() / rest.len() as f64;
            self.note(rest.iter().zip(rest_means).map(|(square, mean)| square * (mean - of_means)).sum());
            self.spread += rest_means.iter().map(|mean| (mean - of_means) * (mean - of_means)).sum::<f64>();
            self.freedom += rest.len() as f64 - 1.0;
        }
    }

    /// Adds the product of a block.
    #[inline(always)]
    fn note(&mut self, product: f64) {
        self.products[0] += 1.0;
        self.products[1] += product;
        self.products[2] += product * product;
    }

    /// What they tell of so many frames, of which `times` as many squares are to be counted as were.
    pub fn finish(&self, frames: f64, times: f64) -> Falling {
        let [count, sum, squares] = self.products;
        let each = times / (frames - 1.0).max(1.0);
        let scatter = if count > 1.0 { (squares - sum * sum / count) * count / (count - 1.0) } else { f64::INFINITY };
        Falling {
            product: each * sum,
            scatter: each * each * scatter.max(0.0),
            spread: self.spread,
            freedom: self.freedom,
        }
    }
}

/// The sum of a block, by halves, which compilers make vectors of.
#[inline(always)]
fn block_sum([a, b, c, d, e, f, g, h]: [f64; BLOCK]) -> f64 {
    let [a, b, c, d] = [a + e, b + f, c + g, d + h];
    let [a, b] = [a + c, b + d];
    a + b
}

#[cfg(test)]
mod tests {
    use super::super::strangers::tests::normal;
    use super::super::survey::survey;
    use crate::frame::{Geometry, to_sample};
    use crate::metadata::{FrameHeader, Metadata};
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;

    const SIDE: usize = 96;

    /// Whether something is cut off in frames of such samples, of which `black` is no light; and T over its standard deviation.
    fn found(count: u32, black: f64, sample: impl Fn(usize, u32) -> f64) -> (bool, f64) {
        let of = |frame: u32| {
            let geometry = Geometry::new(SIDE, SIDE, &["Y"]);
            let header = FrameHeader { name: "a".into(), geometry, metadata: Metadata::new(QuantityKind::Adu) };
            MemoryFrame::new(header, (0..SIDE * SIDE).map(|place| to_sample(sample(place, frame).round())).collect())
        };
        let mut frames: Vec<MemoryFrame> = (0..count).map(of).collect();
        let site = survey(&mut frames, Some(65_535.0), false).unwrap().sites.remove(0);
        let falling = site.falling;
        let hidden = super::super::rounding::Hidden::behind(site.variance, site.variance_variance).variance;
        let is_cut = falling.is_cut([site.variance, f64::from(count)], site.mean - black, hidden);
        (is_cut, falling.product / falling.scatter.sqrt())
    }

    /// A charge of 10 000 whose photosites differ by 0.5 %, with its shot noise, of which what is above an end is cut off: beyond two standard
    /// deviations, which takes 4 % off the variance, that is told, of 2 frames and of 8, under light that falls off by a tenth over the frame too; beyond five
    /// it is not. Nor is a curve of tones, nor light that is uneven, nor codes so coarse that the variance is a wave over them.
    #[test]
    fn a_cut_is_told_from_tones_and_rounding() {
        let fall = |place: usize| 1.0 - 0.1 * ((place % SIDE) as f64 / SIDE as f64 - 0.5);
        let charge = |place: usize, frame: u32, mean: f64| {
            let rate = mean * (1.0 + 0.005 * normal(place, 0, 1));
            rate + rate.sqrt() * normal(place, frame, 2)
        };
        let spread = (10_000.0_f64 + 50.0 * 50.0).sqrt();
        for count in [2, 8] {
            for (deviations, wanted) in [(2.0, true), (5.0, false)] {
                let cut = |place: usize, frame: u32| charge(place, frame, 10_000.0).min(10_000.0 + deviations * spread);
                let (is_cut, z) = found(count, 0.0, cut);
                assert_eq!(is_cut, wanted, "{count}, {deviations}: {z}");
            }
            // The end is seen on the bright side alone.
            let (is_cut, z) =
                found(count, 0.0, |place, frame| charge(place, frame, 10_000.0 * fall(place)).min(10_500.0));
            assert!(is_cut, "{count}: {z}");
            let uneven = found(count, 0.0, |place, frame| charge(place, frame, 10_000.0 * fall(place)));
            let tones = found(count, 0.0, |place, frame| 60.0 * charge(place, frame, 10_000.0).powf(1.0 / 2.2));
            let coarse =
                found(count, 0.0, |place, frame| 200.3 + 0.5 * normal(place, frame, 2) + 0.05 * normal(place, 0, 1));
            for (which, (is_cut, z)) in [uneven, tones, coarse].into_iter().enumerate() {
                assert!(!is_cut, "{count}, {which}: {z}");
            }
        }
    }
}

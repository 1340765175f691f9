//! The law of a charge as few normal laws, where it is of many electrons, and what blurs it hides that these are counted.
//!
//! A charge of mean μ, variance V and cumulants κ is taken for the sum of two independent numbers: a normal one of variance V − W, and another
//! of variance W whose further cumulants are κ₃, κ₄ … Of that one Gauss's quadrature has m places. So the charge is m normal laws of one
//! standard deviation, whose first 2m − 1 moments are its own. W = (κ₃/s)^⅔ is as small as there is such a number: its skewness is s. Where W
//! is a third of what the charge scatters by, noise included, ten places leave 10⁻⁹ of it in what is cut off anywhere; where it is
//! half, five places leave 10⁻⁴.

use super::counts::Charge;
use super::memory::Memory;
use super::node::{Law, Node};
use super::photosite::Photosite;
use crate::metadata::PoissonKind;
use crate::numerics::gauss::{by_recurrence, hermite};
use crate::numerics::normal::NearlyNormal;
use crate::stages::noise::{NoiseModel, Tails};
use nalgebra::DMatrix;
use std::sync::LazyLock;

/// How exact normal laws stand for a charge.
struct Exactness {
    /// Places of each sum.
    places: usize,
    /// The skewness of what is summed over.
    skewness: f64,
    /// The largest share that it has of the variance, noise included.
    most: f64,
    /// What hides that electrons are counted, rms e⁻: e^(−2π²σ²) is left of it.
    hidden_e: f64,
}

const OF_ALL: Exactness = Exactness { places: MOST_PLACES, skewness: 0.17, most: 0.33, hidden_e: 1.0 };
const OF_FEW: Exactness = Exactness { places: 5, skewness: 0.37, most: 0.55, hidden_e: 0.6 };

const MOST_PLACES: usize = 10;

/// Moments, or cumulants, from order 0 on.
type Orders = [f64; 2 * MOST_PLACES + 1];

/// Few photosites of so many electrons are off by 10⁻⁴ of what they scatter by where they are counted to full well.
const MANY_IF_FEW_E: f64 = 300.0;

/// The largest non-uniformity of which next to none is cut off at zero.
const MOST_PATTERN: f64 = 0.105;

/// Normal laws of one standard deviation: their means and weights, those beyond the last of none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NormalLaws {
    std: f64,
    laws: [(f64, f64); MOST_PLACES],
}

impl NormalLaws {
    /// Each of them.
    pub fn nodes(self) -> impl Iterator<Item = Node> {
        let node = move |(mean, weight)| Node { mean, std: self.std, weight, floor: f64::NEG_INFINITY };
        self.laws.into_iter().filter(|(_, weight)| *weight > 0.0).map(node)
    }
}

impl Law {
    /// The normal laws; none where they would not be as exact as the sum over counts should be, or that is as short. `noise_e` is what
    /// blurs the charge before anything cuts it off, `added_e` what does before it is read.
    pub(super) fn as_normals(&self, noise_e: f64, added_e: f64) -> Option<NormalLaws> {
        thread_local! { static KNOWN: Memory<(Law, f64), Option<NormalLaws>> = const { Memory::new() }; }
        let wanted = if self.are_few { OF_FEW } else { OF_ALL };
        let both = [&self.light, &self.dark];
        // Where full well cuts off counts that nothing blurs, that they are counted moves a mean by 1/12 of the density there.
        let many = if self.are_few { MANY_IF_FEW_E } else { f64::INFINITY };
        let blur_e = if both.into_iter().all(|charge| charge.rate < many) { noise_e } else { added_e };
        if self.has_floors()
            || both.into_iter().any(|charge| charge.pattern > MOST_PATTERN)
            || both.into_iter().any(Charge::is_counted) && self.least_pattern_std().hypot(blur_e) < wanted.hidden_e
        {
            return None;
        }
        KNOWN.with(|known| known.recall((*self, noise_e), |(law, noise_e)| law.worked_out(*noise_e, &wanted)))
    }

    fn worked_out(&self, noise_e: f64, wanted: &Exactness) -> Option<NormalLaws> {
        // Of many electrons higher cumulants are next to none, and a law so skewed has them: less is asked then.
        const LESS: [f64; 3] = [1.0, 0.8, 0.6];
        let charge = self.cumulants();
        LESS.iter().find_map(|less| self.of_skewness(less * wanted.skewness, &charge, noise_e, wanted))
    }

    fn of_skewness(
        &self,
        skewness: f64,
        charge: &NearlyNormal,
        noise_e: f64,
        wanted: &Exactness,
    ) -> Option<NormalLaws> {
        let summed = (charge.third.abs() / skewness).powf(2.0 / 3.0);
        if summed <= 0.0 || summed > charge.variance || summed > wanted.most * (charge.variance + noise_e * noise_e) {
            return None;
        }
        let (scale, orders) = (summed.sqrt(), 2 * wanted.places);
        let mut cumulants = [0.0; 2 * MOST_PLACES + 1];
        for charge in [&self.light, &self.dark] {
            let of_one = charge.cumulants_to(orders, scale);
            cumulants.iter_mut().zip(of_one).for_each(|(sum, cumulant)| *sum += cumulant);
        }
        (cumulants[1], cumulants[2]) = (0.0, 1.0);
        let mut laws = [(0.0, 0.0); MOST_PLACES];
        let found = quadrature(&moments(&cumulants, orders), wanted.places)?;
        for (law, (place, weight)) in laws.iter_mut().zip(found) {
            *law = (charge.mean + scale * place, weight);
        }
        Some(NormalLaws { std: (charge.variance - summed).sqrt(), laws })
    }
}

impl Photosite {
    /// The same of few photosites where these are no more than such a share of a frame.
    pub(super) fn if_few(&self, share: f64) -> Self {
        /// Of these, normal laws are good to 10⁻⁴ of what they have.
        const FEW: f64 = 0.01;
        let are_few = share <= FEW;
        self.with_models(|model| NoiseModel { tails: Tails { are_few, ..model.tails }, ..model })
    }
}

impl Charge {
    /// Cumulants up to an order, of the charge in so many electrons, about its mean.
    ///
    /// At a sensitivity x its count of rate λ has the cumulants λ xʲ, of which a normal count has the first two.
    fn cumulants_to(&self, orders: usize, scale: f64) -> Orders {
        static NORMAL: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| hermite(MOST_PLACES + 1));
        let given = |z: f64| {
            let mut found = [0.0; 2 * MOST_PLACES + 1];
            found[1] = self.rate * self.pattern * z / scale;
            let by_count = (1.0 + self.pattern * z) / scale;
            let last = match self.shot {
                _ if self.shot_std() <= 0.0 => 1,
                Some(PoissonKind::Exact) => orders,
                _ => 2,
            };
            let mut power = by_count;
            for cumulant in &mut found[2..=last.max(1)] {
                power *= by_count;
                *cumulant = self.rate * power;
            }
            found
        };
        if self.pattern <= 0.0 {
            return given(0.0);
        }
        let mut sums = [0.0; 2 * MOST_PLACES + 1];
        for (z, weight) in NORMAL.iter() {
            let at = moments(&given(*z), orders);
            sums.iter_mut().zip(at).for_each(|(sum, moment)| *sum += weight * moment);
        }
        cumulants(&sums, orders)
    }
}

/// C(n, j).
const BINOMIALS: [[f64; 2 * MOST_PLACES]; 2 * MOST_PLACES] = {
    let mut rows = [[0.0; 2 * MOST_PLACES]; 2 * MOST_PLACES];
    let mut n = 0;
    while n < rows.len() {
        rows[n][0] = 1.0;
        let mut j = 1;
        while j <= n {
            rows[n][j] = rows[n - 1][j - 1] + rows[n - 1][j];
            j += 1;
        }
        n += 1;
    }
    rows
};

/// Moments about zero from cumulants: m_n = Σ C(n − 1, j − 1) κ_j m_(n − j).
fn moments(cumulants: &Orders, orders: usize) -> Orders {
    let mut found = [0.0; 2 * MOST_PLACES + 1];
    found[0] = 1.0;
    for n in 1..=orders {
        let of_order = BINOMIALS[n - 1].iter().zip(&cumulants[1..=n]).zip(found[..n].iter().rev());
        found[n] = of_order.map(|((binomial, cumulant), moment)| binomial * cumulant * moment).sum();
    }
    found
}

/// The other way round.
fn cumulants(moments: &Orders, orders: usize) -> Orders {
    let mut found = [0.0; 2 * MOST_PLACES + 1];
    for n in 1..=orders {
        let of_order = BINOMIALS[n - 1].iter().zip(&found[1..n]).zip(moments[1..n].iter().rev());
        let before: f64 = of_order.map(|((binomial, cumulant), moment)| binomial * cumulant * moment).sum();
        found[n] = moments[n] - before;
    }
    found
}

/// Gauss's quadrature from moments: of the Cholesky factor of their matrix the recurrence of orthogonal polynomials, of whose matrix places
/// are eigenvalues (Golub and Welsch 1969, doi:10.1090/S0025-5718-69-99647-1). None where no law has such moments.
fn quadrature(moments: &Orders, places: usize) -> Option<Vec<(f64, f64)>> {
    let factor = DMatrix::from_fn(places + 1, places + 1, |i, j| moments[i + j]).cholesky()?.unpack();
    let ratio = |i: usize| factor[(i + 1, i)] / factor[(i, i)];
    let mut recurrence = DMatrix::zeros(places, places);
    for i in 0..places {
        recurrence[(i, i)] = ratio(i) - if i > 0 { ratio(i - 1) } else { 0.0 };
        if i > 0 {
            let beside = factor[(i, i)] / factor[(i - 1, i - 1)];
            (recurrence[(i, i - 1)], recurrence[(i - 1, i)]) = (beside, beside);
        }
    }
    Some(by_recurrence(&recurrence))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::AdcRecord;
    use crate::propagation::reading::{Reading, codes_of};
    use crate::random::poisson::probability;

    fn law(light_e: f64, dark_e: f64, [prnu, dcnu]: [f64; 2], are_few: bool) -> Law {
        let charge = |rate: f64, pattern: f64| Charge { rate, shot: Some(PoissonKind::Exact), pattern };
        let [light, dark] = [charge(light_e, prnu), charge(dark_e, dcnu)];
        Law { light, dark, full_well_e: f64::INFINITY, read_noise_e: 1.0, trap_e: 0.0, are_few }
    }

    /// All pairs of counts, one by one.
    fn by_counts(law: &Law, reading: &Reading) -> [f64; 4] {
        let counts = |charge: &Charge| -> Vec<(f64, f64)> {
            let rate = charge.rate;
            let reach = 9.5 * rate.sqrt() + 30.0;
            let first = (rate - reach).max(0.0).floor();
            let all = std::iter::successors(Some(first), |count| Some(count + 1.0));
            let all = all.take_while(|count| *count < first + 2.0 * reach);
            all.map(|count| (count, probability(count, rate))).filter(|(_, chance)| *chance > 1e-18).collect()
        };
        let mut sum = [0.0; 4];
        let darks = counts(&law.dark);
        for (light, of_light) in counts(&law.light) {
            for (dark, of_dark) in &darks {
                let variance = (light * law.light.pattern).powi(2) + (dark * law.dark.pattern).powi(2);
                let at = reading.at(light + dark, variance);
                sum.iter_mut().zip(at).for_each(|(sum, moment)| *sum += of_light * of_dark * moment);
            }
        }
        sum
    }

    /// Codes that end anywhere in the law, as all pairs of counts tell: to 2·10⁻⁹ of what they scatter by, of few photosites to 2·10⁻⁴.
    #[test]
    fn normal_laws_are_read_as_the_counts_that_they_stand_for() {
        for (light_e, dark_e, patterns, are_few) in [
            (2000.0, 5.0, [0.006, 0.1], false),
            (4000.0, 300.0, [0.005, 0.01], false),
            (1000.0, 40.0, [0.0, 0.0], false),
            (40.0, 100.0, [0.01, 0.02], true),
            (500.0, 200.0, [0.005, 0.003], true),
            (100.0, 30_000.0, [0.006, 0.0], true),
        ] {
            let law = law(light_e, dark_e, patterns, are_few);
            let [mean, std] = [law.cumulants().mean, law.cumulants().variance.sqrt()];
            let laws = law.as_normals(1.0, 1.0).unwrap();
            assert!((laws.nodes().map(|node| node.weight).sum::<f64>() - 1.0).abs() < 1e-12);
            for deviations in [-4.0, -2.0, -0.7, 0.0, 0.3, 1.5, 4.0] {
                // The top code, 255, stands for so many electrons.
                let adc = AdcRecord::new(8, -0.25 * (mean + deviations * std) + 255.0, 0.25);
                let reading = law.of_codes(&adc, codes_of(&adc));
                let wanted = by_counts(&law, &reading);
                let mut found = [0.0; 4];
                for node in laws.nodes() {
                    let at = reading.at(node.mean, node.std * node.std);
                    found.iter_mut().zip(at).for_each(|(sum, moment)| *sum += node.weight * moment);
                }
                let allowed = if are_few { 2e-4 } else { 2e-9 };
                for (power, (found, wanted)) in (1..=2).zip(found.iter().zip(wanted)) {
                    let scale = (0.25 * std).powi(power);
                    assert!((found - wanted).abs() < allowed * scale, "{law:?} {deviations} {power}: {found} {wanted}");
                }
            }
        }
    }

    /// Of few electrons, of those that show one by one, and of patterns that zero cuts off there are none.
    #[test]
    fn where_counts_show_there_are_no_normal_laws() {
        for (light_e, dark_e, patterns, noise_e, are_few) in [
            (200.0, 5.0, [0.006, 0.1], 2.0, false),
            (20.0, 5.0, [0.006, 0.1], 2.0, true),
            (3000.0, 5.0, [0.0, 0.0], 0.9, false),
            (3000.0, 5.0, [0.0, 0.0], 0.5, true),
            (3000.0, 5.0, [0.2, 0.0], 2.0, false),
        ] {
            assert_eq!(
                law(light_e, dark_e, patterns, are_few).as_normals(noise_e, noise_e),
                None,
                "{light_e} {patterns:?} {noise_e}"
            );
        }
    }

    /// Full well cuts off counts before read noise hides them: light of 1250.52 e⁻ and a dark signal of 2 e⁻ of a tenth of non-uniformity, summed
    /// over both counts and the normal law of each elsewhere.
    #[test]
    fn counts_that_full_well_cuts_off_are_told_apart() {
        let law = law(1250.52, 2.0, [0.0, 0.1], false);
        let law = Law { full_well_e: 1226.0, read_noise_e: 1.6, ..law };
        let found = law.predict(&law.of_electrons()).moments;
        let of_charge = found.variance - 1.6 * 1.6;
        assert!((found.mean - 1_221.390_440_192_657).abs() < 1e-8, "{}", found.mean);
        assert!((of_charge - 136.068_113_569_868_7).abs() < 1e-6, "{of_charge}");
    }
}

//! How samples of photosites scatter that are read through several amplifiers.
//!
//! Group t has n_t photosites, of means μ_t and cumulants v_t, κ₃ and κ₄; n = Σ n_t, and d_t = μ_t − Σ n_t μ_t/n. The groups are
//! those of their places and not drawn, so that
//!
//! - Var x̄ = Σ n_t v_t/n²
//! - E s_ij = \[(1 − 1/n) δ_ij Σ n_t v_ti + Σ n_t d_ti d_tj\]/(n − 1)
//!
//! and the sample covariances scatter as those of independent samples do, by what noise makes of the distances of the groups, and by
//! the third cumulants, which go with these. What is drawn in two channels has nothing in common.

use crate::propagation::Prediction;
use crate::propagation::covariance::PAIRS;
use crate::propagation::sampling::Sampling;
use crate::propagation::taps::Group;
use nalgebra::Matrix3;

/// So many photosites whose three channels have such moments.
pub(super) type Part = (f64, [Prediction; 3]);

/// The parts of three planes.
pub(super) fn of_planes(groups: &[Group]) -> Vec<Part> {
    groups.iter().map(|group| (group.counts[0], group.sites)).collect()
}

/// The parts of a class, three channels alike.
pub(super) fn of_class(groups: &[Group], class: usize) -> Vec<Part> {
    groups.iter().map(|group| (group.counts[class], [group.sites[class]; 3])).filter(|part| part.0 > 0.0).collect()
}

/// The parts of a plane behind a filter array, three channels alike.
pub(super) fn of_plane(groups: &[Group]) -> Vec<Part> {
    (0..3).flat_map(|class| of_class(groups, class)).collect()
}

/// What is the same in each is that of a third cumulant where `[i, j, k]` are one channel.
fn is_one(channels: [usize; 3]) -> bool {
    channels[0] == channels[1] && channels[1] == channels[2]
}

/// The law of samples of three channels of such parts, drawn apart.
pub(super) fn sampling(parts: &[Part]) -> Sampling {
    let n: f64 = parts.iter().map(|(count, _)| count).sum();
    let free = (n - 1.0).max(f64::MIN_POSITIVE);
    let sum = |of: &dyn Fn(&[Prediction; 3], [f64; 3]) -> f64, mean: [f64; 3]| -> f64 {
        let of_part = |(count, sites): &Part| count * of(sites, [0, 1, 2].map(|i| sites[i].moments.mean - mean[i]));
        parts.iter().map(of_part).sum()
    };
    let mean = [0, 1, 2].map(|i| sum(&|sites, _| sites[i].moments.mean, [0.0; 3]) / n);
    let sum = |of: &dyn Fn(&[Prediction; 3], [f64; 3]) -> f64| sum(of, mean);
    let v = |i: usize| move |sites: &[Prediction; 3]| sites[i].moments.variance;
    let own = [0, 1, 2].map(|i| sum(&|sites, _| v(i)(sites)));
    // tr(P C_ik P C_lj), of channels that have nothing in common.
    let product = |[i, k]: [usize; 2], [l, j]: [usize; 2]| {
        if i != k || l != j {
            return 0.0;
        }
        (1.0 - 2.0 / n) * sum(&|sites, _| v(i)(sites) * v(l)(sites)) + own[i] * own[l] / (n * n)
    };
    let of_distances = |[i, j]: [usize; 2], [k, l]: [usize; 2]| {
        if i == j { sum(&|sites, d| v(i)(sites) * d[k] * d[l]) } else { 0.0 }
    };
    let skewed = |channels: [usize; 3], other: usize| {
        let third = |sites: &[Prediction; 3], d: [f64; 3]| sites[channels[0]].third * d[other];
        if is_one(channels) { (1.0 - 1.0 / n) * sum(&third) } else { 0.0 }
    };
    let spread = PAIRS.map(|[i, j]| {
        PAIRS.map(|[k, l]| {
            let normal = product([i, k], [l, j]) + product([i, l], [k, j]);
            let distances = of_distances([j, l], [i, k])
                + of_distances([j, k], [i, l])
                + of_distances([i, l], [j, k])
                + of_distances([i, k], [j, l]);
            let thirds = skewed([i, j, l], k) + skewed([i, j, k], l) + skewed([j, k, l], i) + skewed([i, k, l], j);
            let fourth = if i == j && is_one([j, k, l]) {
                sum(&|sites, _| sites[i].fourth()) * (1.0 - 1.0 / n).powi(2)
            } else {
                0.0
            };
            let found = normal + distances + thirds + fourth;
            (if [i, j] == [k, l] { found.max(0.0) } else { found }) / (free * free)
        })
    });
    let between = |i: usize, j: usize| sum(&|_, d| d[i] * d[j]);
    let third = |i: usize| {
        let of_noise = 8.0 * sum(&|sites, _| v(i)(sites).powi(3));
        (of_noise + 24.0 * sum(&|sites, d| (v(i)(sites) * d[i]).powi(2))) / free.powi(3)
    };
    Sampling {
        count: n,
        mean_covariance: Matrix3::from_diagonal(&own.map(|own| own / (n * n)).into()),
        covariance: Matrix3::from_fn(|i, j| {
            (between(i, j) + if i == j { own[i] * (1.0 - 1.0 / n) } else { 0.0 }) / free
        }),
        spread,
        variance_thirds: Some([0, 1, 2].map(third)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// By full matrices, of normal samples: s_ij = xᵢᵀPxⱼ/(n − 1). Sums of a hundred numbers of one size: relative 10⁻¹².
    #[test]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few photosites")]
    fn groups_agree_with_full_matrices() {
        let group = |count: f64, mean: [f64; 3], variance: [f64; 3]| {
            (count, [0, 1, 2].map(|k| Prediction::of_cumulants(mean[k], variance[k], 0.0, 0.0)))
        };
        let parts = [
            group(7.0, [100.0, 104.0, 90.0], [2.0, 3.0, 1.0]),
            group(5.0, [101.0, 102.0, 93.0], [1.5, 2.5, 4.0]),
            group(9.0, [99.0, 108.0, 91.0], [3.0, 1.0, 0.5]),
        ];
        let found = sampling(&parts);
        let sites: Vec<&[Prediction; 3]> = parts.iter().flat_map(|(n, sites)| vec![sites; *n as usize]).collect();
        let n = sites.len();
        let p = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
        let c = |i: usize, k: usize| {
            let variance = |a: usize| if i == k { sites[a].map(|site| site.moments.variance)[i] } else { 0.0 };
            DMatrix::from_diagonal(&DVector::from_fn(n, |a, _| variance(a)))
        };
        let d = |i: usize| &p * DVector::from_fn(n, |a, _| sites[a][i].moments.mean);
        let free = n as f64 - 1.0;
        let close = |found: f64, expected: f64| {
            assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{found} {expected}");
        };
        for (a, [i, j]) in PAIRS.into_iter().enumerate() {
            close(found.mean_covariance[(i, j)], c(i, j).sum() / (n * n) as f64);
            close(found.covariance[(i, j)], ((&p * c(i, j)).trace() + d(i).dot(&d(j))) / free);
            for (b, [k, l]) in PAIRS.into_iter().enumerate() {
                let normal = (&p * c(i, k) * &p * c(l, j)).trace() + (&p * c(i, l) * &p * c(k, j)).trace();
                let of = |x: usize, y: usize, z: usize, w: usize| d(x).dot(&(c(y, w) * d(z)));
                let distances = of(i, j, k, l) + of(i, j, l, k) + of(j, i, k, l) + of(j, i, l, k);
                close(found.spread[a][b], (normal + distances) / (free * free));
            }
        }
    }
}

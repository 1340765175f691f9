//! How sample means and covariances scatter of pixels that several amplifiers have a part in.
//!
//! Pixel a is m(a) + e(a), e(a) = Σ_s W_a(s) x_s the noise of its photosites, as in [`super::sampling`]; and d = Pm is how far the mean
//! of each lies from that of all. Then
//!
//! - E s_ij = \[tr(P C_ij) + d_i·d_j]/(n − 1)
//! - (n − 1)² cov(s_ij, s_kl) = tr(P C_ik P C_lj) + tr(P C_il P C_kj) + Σ_s \[κ₂ g_ij g_kl + κ₃ (Q_ij g_kl + g_ij Q_kl) + κ₄ Q_ij Q_kl]
//!
//! with Q_ij(s) = Σ_a W_i W_j − B_i B_j/n, B_i(s) = Σ_a W_i, and g_ij(s) = Σ_a d_i W_j + d_j W_i what the distances make of a photosite.
//! All but P are sums over pixels, or photosites, of what lies around them, so that one of each kind of place is gone through.

use super::covariance::PAIRS;
use super::place::add_products;
use super::sampling::Sampling;
use super::tapped::{Kind, TappedPixels};
use crate::stages::demosaic::stencil::REACH;
use nalgebra::{Matrix3, Vector3};

/// Sums over pixels and photosites.
struct Sums {
    /// Σ_a C(a, a), Σ_ab C(a, b), Σ_a d dᵀ, and Σ_a of what is beyond the weights.
    variance: Matrix3<f64>,
    total: Matrix3<f64>,
    between: Matrix3<f64>,
    beyond: Matrix3<f64>,
    /// Σ_ab C_ik C_jl + C_il C_jk, by pairs ij and kl.
    products: [[f64; 6]; 6],
    /// The same of row sums, in both orders.
    row_products: [[f64; 6]; 6],
    /// Σ_a q and Σ_a q², q = C d, by channel.
    distances: [[f64; 3]; 2],
    /// Σ_s κ₄ Q Q.
    fourths: [[f64; 6]; 6],
    /// Σ_s κ₂ g g + κ₃ (Q g + g Q).
    of_distances: [[f64; 6]; 6],
}

impl TappedPixels {
    /// How the sample means and covariances of the rectangle scatter; worked out once.
    pub fn sampling(&self) -> &Sampling {
        self.sampling.get_or_init(|| Sums::of(self).sampling(self.count()))
    }

    fn count(&self) -> f64 {
        self.array.axes.iter().map(|axis| axis.lines.len() as f64).product()
    }

    /// Pixels of the rectangle up to so far away from a place, and how far they are.
    fn near(&self, at: [usize; 2], far: isize) -> impl Iterator<Item = (&Kind, [isize; 2])> {
        let lines = |axis: usize| {
            let all = &self.array.axes[axis].lines;
            all.start.max(at[axis].saturating_add_signed(-far))..all.end.min(at[axis].saturating_add_signed(far + 1))
        };
        let (columns, rows) = (lines(0), lines(1));
        let lag = move |to: [usize; 2]| [0, 1].map(|axis| to[axis].cast_signed() - at[axis].cast_signed());
        rows.flat_map(move |y| columns.clone().map(move |x| [x, y])).map(move |to| (self.kind(to), lag(to)))
    }
}

impl Sums {
    fn of(pixels: &TappedPixels) -> Self {
        let [none, zero] = [[[0.0; 6]; 6], [[0.0; 6]; 6]];
        let mut sums = Self {
            variance: Matrix3::zeros(),
            total: Matrix3::zeros(),
            between: Matrix3::zeros(),
            beyond: Matrix3::zeros(),
            products: none,
            row_products: none,
            distances: [[0.0; 3]; 2],
            fourths: zero,
            of_distances: zero,
        };
        let reach = pixels.array.weights.reach();
        // Row sums reach twice as far as weights, and what is mirrored there once more.
        let far = 3 * reach.unsigned_abs();
        let places = |around: bool| {
            let [columns, rows] =
                pixels.array.axes.each_ref().map(|axis| {
                    if around { axis.examples_around(reach.unsigned_abs(), far) } else { axis.examples(far) }
                });
            let both = |(y, of_y): (usize, f64)| {
                let columns = columns.clone();
                columns.into_iter().map(move |(x, of_x)| ([x, y], of_x * of_y))
            };
            rows.into_iter().flat_map(both).collect::<Vec<_>>()
        };
        for (at, times) in places(false) {
            sums.add_pixel(pixels, at, times, 2 * reach);
        }
        let count = pixels.count();
        for (at, times) in places(true) {
            sums.add_site(pixels, at, times, count);
        }
        sums
    }

    /// So many pixels like that of a place.
    fn add_pixel(&mut self, pixels: &TappedPixels, at: [usize; 2], times: f64, far: isize) {
        let off = |kind: &Kind| Vector3::from([0, 1, 2].map(|i| kind.mean[i] - pixels.mean[i]));
        let pixel = pixels.kind(at);
        let (mut row_sum, mut moved) = (Matrix3::zeros(), Vector3::zeros());
        for (other, lag) in pixels.near(at, far) {
            let covariance = pixel.covariance_with(other, lag);
            row_sum += covariance;
            moved += covariance.diagonal().component_mul(&off(other));
            add_products(&mut self.products, &covariance, times);
        }
        self.variance += times * pixel.covariance_with(pixel, [0, 0]);
        self.total += times * row_sum;
        self.between += times * off(pixel) * off(pixel).transpose();
        self.beyond += times * pixel.beyond;
        add_products(&mut self.row_products, &row_sum, times);
        add_products(&mut self.row_products, &row_sum.transpose(), times);
        for i in 0..3 {
            self.distances[0][i] += times * moved[i];
            self.distances[1][i] += times * moved[i] * moved[i];
        }
    }

    /// So many photosites like that of a place, of a rectangle of so many pixels.
    fn add_site(&mut self, pixels: &TappedPixels, at: [usize; 2], times: f64, count: f64) {
        let (mut squares, mut sums, mut moved) = ([0.0; 6], [0.0; 3], [0.0; 6]);
        for (pixel, [x, y]) in pixels.near(at, REACH) {
            let w = pixel.weights([-x, -y]);
            if w == [0.0; 3] {
                continue;
            }
            let off = [0, 1, 2].map(|i| pixel.mean[i] - pixels.mean[i]);
            for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
                squares[pair] += w[i] * w[j];
                moved[pair] += off[i] * w[j] + off[j] * w[i];
            }
            sums.iter_mut().zip(w).for_each(|(sum, w)| *sum += w);
        }
        let site = pixels.array.site(at);
        let (second, third) = (site.moments.variance, site.third);
        let fourth = site.fourth_of_own(second);
        for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
            squares[pair] -= sums[i] * sums[j] / count;
        }
        for a in 0..PAIRS.len() {
            for b in 0..PAIRS.len() {
                self.fourths[a][b] += times * fourth * squares[a] * squares[b];
                let both = squares[a] * moved[b] + moved[a] * squares[b];
                self.of_distances[a][b] += times * (second * moved[a] * moved[b] + third * both);
            }
        }
    }

    fn sampling(&self, count: f64) -> Sampling {
        let free = (count - 1.0).max(f64::MIN_POSITIVE);
        let total = |i: usize, j: usize| self.total[(i, j)];
        let of_noise = |a: usize, b: usize| {
            let ([i, j], [k, l]) = (PAIRS[a], PAIRS[b]);
            // tr(PAPB) = tr AB − (1/n) 1ᵀ(AB + BA)1 + (1/n²) 1ᵀA1 1ᵀB1.
            let means = total(i, k) * total(l, j) + total(i, l) * total(k, j);
            let normal = self.products[a][b] - self.row_products[a][b] / count + means / (count * count);
            normal + self.fourths[a][b]
        };
        let spread = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let found = of_noise(a, b) + self.of_distances[a][b];
                (if a == b { found.max(0.0) } else { found }) / (free * free)
            })
        });
        let own = self.variance - self.total / count;
        // Of the noise as of χ² of its mean and variance, and 24 |PCd|² of the distances.
        let third = |i: usize| {
            let pair = PAIRS.iter().position(|pair| *pair == [i, i]).unwrap_or_default();
            let [sum, square] = self.distances.map(|of| of[i]);
            let of_own = if own[(i, i)] > 0.0 { 2.0 * of_noise(pair, pair).powi(2) / own[(i, i)] } else { 0.0 };
            (of_own + 24.0 * (square - sum * sum / count).max(0.0)) / free.powi(3)
        };
        Sampling {
            count,
            mean_covariance: self.total / (count * count),
            covariance: (own + self.between) / free + self.beyond / count,
            spread,
            variance_thirds: Some([0, 1, 2].map(third)),
        }
    }
}

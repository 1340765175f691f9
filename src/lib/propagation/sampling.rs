//! How far sample means and covariances of a region scatter about what is predicted.
//!
//! Pixels are weighted sums of photosites, o_i(a) = Σ_s W_i,a(s) x_s, so neighbors are correlated: C_ij(a, b) =
//! Σ_s W_i,a(s) W_j,b(s) σ_s². The sample mean of n pixels has the covariance Γ = (1/n²) Σ C(a, b). The sample covariance
//! s_ij (divisor n − 1) is a quadratic form in the photosites, with P the projection that takes off the mean:
//!
//! - E s_ij = tr(P C_ij)/(n − 1)
//! - cov(s_ij, s_kl) = \[tr(P C_ik P C_lj) + tr(P C_il P C_kj) + Σ_s κ₄(s) Q_ij(s) Q_kl(s)]/(n − 1)²
//!
//! where κ₄ is the fourth cumulant of a photosite and Q_ij(s) the diagonal of the form. Fixed patterns vary from site to
//! site as temporal noise does, so within one frame they count alike.
//!
//! Photosites that share rows and columns add covariances of pixels far apart (`line_sampling`).
//!
//! All these are sums over pixels of what lies around them. Once a region is wider than what its rim sees, they grow by
//! the same amount with every two columns, so large regions follow exactly from small ones.

use super::covariance::PAIRS;
use super::drift_sampling::DriftSums;
use super::line_sampling::{Local, Nonlocal};
use super::mixed_pixel::{Pixel, pixels_of};
use super::moments::Prediction;
use super::moments::{LineCovariance, SiteCovariance, common};
pub use super::place::Place;
use super::place::{add_products, steps};
use crate::numerics::normal::MeanVariance;
use crate::stages::demosaic::stencil::REACH;
use crate::stages::demosaic::weights::Weights;
use nalgebra::{Matrix3, SMatrix};

/// What sample means and covariances of a region are expected to be, and how they scatter.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    /// Pixels.
    pub count: f64,
    /// Γ, covariance of the sample means.
    pub mean_covariance: Matrix3<f64>,
    /// Expected sample covariance.
    pub covariance: Matrix3<f64>,
    /// Covariances of the sample covariances, rows and columns as [`PAIRS`].
    pub spread: [[f64; 6]; 6],
    /// Third cumulants of the sample variances but for those of photosites, where rows or columns share noise: the law is
    /// wider than χ² where they are few.
    pub variance_thirds: Option<[f64; 3]>,
}

impl Sampling {
    /// Of `count` pixels of three planes that are drawn apart.
    pub fn independent(classes: &[Prediction; 3], count: f64) -> Self {
        let variances = classes.map(|class| class.moments.variance);
        let mut spread = [[0.0; 6]; 6];
        for (index, [i, j]) in PAIRS.into_iter().enumerate() {
            spread[index][index] = if i == j {
                2.0 * variances[i].powi(2) / (count - 1.0) + classes[i].fourth_of_own(variances[i]) / count
            } else {
                variances[i] * variances[j] / (count - 1.0)
            };
        }
        let covariance = Matrix3::from_diagonal(&variances.into());
        Self { count, mean_covariance: covariance / count + common(classes), covariance, spread, variance_thirds: None }
    }

    /// Of a rectangle of demosaicked pixels with `weights` on photosites of such moments; where rows drift, the place has them on the sensor.
    pub fn of(weights: &Weights, sites: &[Prediction; 3], place: &Place) -> Self {
        let count = place.size[0] as f64 * place.size[1] as f64;
        let reach = weights.reach();
        let [columns, rows] = place.size.map(|extent| steps(extent, reach));
        let mut sums = Sums::zero();
        for &(width, width_share) in &columns {
            for &(height, height_share) in &rows {
                let small = Place {
                    frame: [place.frame[0] - place.size[0] + width, place.frame[1] - place.size[1] + height],
                    size: [width, height],
                    ..*place
                };
                sums.add(width_share * height_share, &Sums::of(weights, sites, &small, place.size));
            }
        }
        let covariance = SiteCovariance::of(sites);
        let mut shared =
            (!covariance.is_independent()).then(|| Nonlocal::of(weights, &covariance.without_drift(), place));
        if let (Some(shared), Some(drift)) = (&mut shared, DriftSums::of(weights, &covariance, place)) {
            sums.add_drift(&drift);
            drift.add_to(shared);
        }
        sums.sampling(count, shared.as_ref())
    }
}

impl Sampling {
    /// The law of the channels that `matrix` makes of these: s′_ij = Σ m_ia m_jb s_ab.
    #[must_use]
    pub fn through(&self, matrix: &Matrix3<f64>) -> Self {
        let m = |row: usize, column: usize| matrix[(row, column)];
        let of_pairs = SMatrix::<f64, 6, 6>::from_fn(|to, from| {
            let ([i, j], [a, b]) = (PAIRS[to], PAIRS[from]);
            if a == b { m(i, a) * m(j, a) } else { m(i, a) * m(j, b) + m(i, b) * m(j, a) }
        });
        let spread = of_pairs * SMatrix::<f64, 6, 6>::from_fn(|a, b| self.spread[a][b]) * of_pairs.transpose();
        let carried = |covariance: &Matrix3<f64>| matrix * covariance * matrix.transpose();
        Self {
            count: self.count,
            mean_covariance: carried(&self.mean_covariance),
            covariance: carried(&self.covariance),
            spread: [0, 1, 2, 3, 4, 5].map(|a| [0, 1, 2, 3, 4, 5].map(|b| spread[(a, b)])),
            variance_thirds: None,
        }
    }
}

/// The laws of a rectangle for photosites of any moments.
///
/// Covariances are linear in the variances of the three classes; their spread is a quadratic form in these, and linear in
/// the fourth cumulants. Nine laws make all others.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplingBasis {
    /// One class has variance 1, the others none.
    ones: [Sampling; 3],
    /// Two classes have variance 1, as in [`TWO`].
    twos: [Sampling; 3],
    /// One class has variance 1 and excess kurtosis 1.
    fourths: [Sampling; 3],
}

/// The pairs of two classes.
const TWO: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

impl SamplingBasis {
    /// Of a rectangle of demosaicked pixels with `weights`.
    pub fn of(weights: &Weights, place: &Place) -> Self {
        let law = |classes: &[usize], excess_kurtosis: f64| {
            let variance = |class| if classes.contains(&class) { 1.0 } else { 0.0 };
            let moments = |class| MeanVariance { mean: 0.0, variance: variance(class) };
            let sites = [0, 1, 2].map(|class| Prediction {
                moments: moments(class),
                third: 0.0,
                excess_kurtosis,
                sixth: 0.0,
                common: 0.0,
                lines: LineCovariance::default(),
            });
            Sampling::of(weights, &sites, place)
        };
        Self {
            ones: [0, 1, 2].map(|class| law(&[class], 0.0)),
            twos: TWO.map(|two| law(&two, 0.0)),
            fourths: [0, 1, 2].map(|class| law(&[class], 1.0)),
        }
    }

    /// The law for photosites of such moments.
    pub fn sampling(&self, sites: &[Prediction; 3]) -> Sampling {
        let v = sites.map(|site| site.moments.variance);
        let fourth = sites.map(|site| site.excess_kurtosis * site.moments.variance.powi(2));
        let sum = |of: fn(&Sampling) -> &Matrix3<f64>| -> Matrix3<f64> {
            (0..3).map(|class| v[class] * of(&self.ones[class])).sum()
        };
        let spread = |a: usize, b: usize| -> f64 {
            let one = |class: usize| self.ones[class].spread[a][b];
            let squares: f64 = (0..3)
                .map(|class| {
                    v[class] * v[class] * one(class) + fourth[class] * (self.fourths[class].spread[a][b] - one(class))
                })
                .sum();
            let products: f64 = TWO
                .iter()
                .zip(&self.twos)
                .map(|(&[i, j], two)| v[i] * v[j] * (two.spread[a][b] - one(i) - one(j)))
                .sum();
            squares + products
        };
        Sampling {
            count: self.ones[0].count,
            mean_covariance: sum(|law| &law.mean_covariance),
            covariance: sum(|law| &law.covariance),
            spread: [0, 1, 2, 3, 4, 5].map(|a| [0, 1, 2, 3, 4, 5].map(|b| spread(a, b))),
            variance_thirds: None,
        }
    }
}

/// Sums over the pixels of a rectangle, each of which is additive.
struct Sums {
    /// Σ_a C(a, a).
    variance: Matrix3<f64>,
    /// Σ_ab C(a, b).
    total: Matrix3<f64>,
    /// Σ_ab C_ik C_jl + C_il C_jk, by pairs ij and kl.
    products: [[f64; 6]; 6],
    /// The same of row sums R(a) = Σ_b C(a, b): ½ Σ_a over both orders.
    row_products: [[f64; 6]; 6],
    /// Σ_s κ₄ A_ij A_kl with A_ij(s) = Σ_a W_i W_j.
    fourth: [[f64; 6]; 6],
    /// Σ_s κ₄ (A_ij B_k B_l + B_i B_j A_kl) with B_i(s) = Σ_a W_i.
    fourth_mixed: [[f64; 6]; 6],
    /// Σ_s κ₄ B_i B_j B_k B_l.
    fourth_means: [[f64; 6]; 6],
    /// Σ_ab C², Σ_a C and Σ_ab C of what is each photosite's own, by channel.
    own: [[f64; 3]; 3],
}

impl Sums {
    fn zero() -> Self {
        let none = [[0.0; 6]; 6];
        Self {
            variance: Matrix3::zeros(),
            total: Matrix3::zeros(),
            products: none,
            row_products: none,
            fourth: none,
            fourth_mixed: none,
            fourth_means: none,
            own: [[0.0; 3]; 3],
        }
    }

    fn add(&mut self, share: f64, other: &Self) {
        for (mine, theirs) in self.own.iter_mut().flatten().zip(other.own.iter().flatten()) {
            *mine += share * theirs;
        }
        self.variance += share * other.variance;
        self.total += share * other.total;
        let tables = [
            (&mut self.products, &other.products),
            (&mut self.row_products, &other.row_products),
            (&mut self.fourth, &other.fourth),
            (&mut self.fourth_mixed, &other.fourth_mixed),
            (&mut self.fourth_means, &other.fourth_means),
        ];
        for (mine, theirs) in tables {
            for (mine, theirs) in mine.iter_mut().flatten().zip(theirs.iter().flatten()) {
                *mine += share * theirs;
            }
        }
    }

    fn add_drift(&mut self, drift: &DriftSums) {
        self.variance += drift.variance;
        let tables =
            [(&mut self.products, &drift.with_own.of_pairs), (&mut self.row_products, &drift.with_own.of_rows)];
        for (mine, theirs) in tables {
            mine.iter_mut().flatten().zip(theirs.iter().flatten()).for_each(|(mine, theirs)| *mine += theirs);
        }
    }

    /// Goes through all pairs of pixels within reach of each other, of a place that stands for one of a size. What they share by
    /// rows and columns counts as far as it meets what is their own.
    fn of(weights: &Weights, sites: &[Prediction; 3], place: &Place, size: [usize; 2]) -> Self {
        let [width, height] = place.size;
        let covariance = SiteCovariance::of(sites);
        let variances = covariance.own;
        // What rows share by a drift hangs on where they are: it has sums of its own.
        let local =
            (!covariance.is_independent()).then(|| Local::of(weights, &covariance.without_drift(), place, size));
        let fourths = [0, 1, 2].map(|k| sites[k].fourth_of_own(variances[k]));
        let pixels = pixels_of(weights, place);
        let mut sums = Self::zero();
        let mut of_pairs = [[0.0; 6]; 6];
        let far = 2 * weights.reach();
        let mut row_sums = vec![Matrix3::zeros(); pixels.len()];
        for (index, pixel) in pixels.iter().enumerate() {
            let [x, y] = [(index % width).cast_signed(), (index / width).cast_signed()];
            let here = [index % width, index / width];
            let shared = |there: [usize; 2]| local.as_ref().map(|local| local.covariance(here, there));
            let itself = pixel.covariance(pixel, [0, 0], variances);
            sums.variance += itself + shared(here).unwrap_or_default();
            row_sums[index] += itself;
            add_with(&mut sums.products, &itself, shared(here).as_ref());
            for (i, own) in sums.own.iter_mut().enumerate() {
                own[0] += itself[(i, i)].powi(2);
                own[1] += itself[(i, i)];
            }
            // Each pair of two pixels once: the other way round its covariance is the transpose, C(b, a) = C(a, b)ᵀ.
            for other_y in y..(y + far + 1).min(height.cast_signed()) {
                let first = if other_y == y { x + 1 } else { (x - far).max(0) };
                for other_x in first..(x + far + 1).min(width.cast_signed()) {
                    let other = (other_y * width.cast_signed() + other_x).cast_unsigned();
                    let covariance = pixel.covariance(&pixels[other], [other_x - x, other_y - y], variances);
                    row_sums[index] += covariance;
                    row_sums[other] += covariance.transpose();
                    let there = [other_x, other_y].map(isize::cast_unsigned);
                    add_with(&mut of_pairs, &covariance, shared(there).as_ref());
                    for (i, own) in sums.own.iter_mut().enumerate() {
                        own[0] += 2.0 * covariance[(i, i)].powi(2);
                    }
                }
            }
        }
        // The transpose of a covariance gives its table of products transposed.
        for (a, row) in sums.products.iter_mut().enumerate() {
            for (b, products) in row.iter_mut().enumerate() {
                *products += of_pairs[a][b] + of_pairs[b][a];
            }
        }
        for (index, r) in row_sums.iter().enumerate() {
            sums.total += r;
            let shared = local.as_ref().map(|local| local.row_sum([index % width, index / width]));
            // 1ᵀ(C_ik C_lj + C_lj C_ik)1 = Σ r_ki r_lj + r_jl r_ik, and the same with k and l exchanged.
            add_with(&mut sums.row_products, r, shared.as_ref());
            add_with(&mut sums.row_products, &r.transpose(), shared.map(|shared| shared.transpose()).as_ref());
        }
        for (i, own) in sums.own.iter_mut().enumerate() {
            own[2] += sums.total[(i, i)];
        }
        sums.add_fourths(&pixels, place, weights, fourths);
        sums
    }

    fn add_fourths(&mut self, pixels: &[Pixel], place: &Place, weights: &Weights, fourths: [f64; 3]) {
        let [width, height] = place.size;
        let margin = REACH.unsigned_abs();
        let stride = width + 2 * margin;
        let mut squares = vec![([0.0; 6], [0.0; 3]); stride * (height + 2 * margin)];
        for (index, pixel) in pixels.iter().enumerate() {
            for &([dx, dy], _, w) in &pixel.sites {
                let x = (index % width + margin).wrapping_add_signed(dx);
                let y = (index / width + margin).wrapping_add_signed(dy);
                let (square, mean) = &mut squares[y * stride + x];
                for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
                    square[pair] += w[i] * w[j];
                }
                for (mean, w) in mean.iter_mut().zip(w) {
                    *mean += w;
                }
            }
        }
        let [x0, y0] = [0, 1].map(|i| i64::from(place.origin[i]) + place.corner[i] as i64 - margin as i64);
        for (index, (square, mean)) in squares.iter().enumerate() {
            let class = weights.pattern().class(x0 + (index % stride) as i64, y0 + (index / stride) as i64);
            let fourth = fourths[class as usize];
            let means = PAIRS.map(|[i, j]| mean[i] * mean[j]);
            for a in 0..PAIRS.len() {
                for b in 0..PAIRS.len() {
                    self.fourth[a][b] += fourth * square[a] * square[b];
                    self.fourth_mixed[a][b] += fourth * (square[a] * means[b] + means[a] * square[b]);
                    self.fourth_means[a][b] += fourth * means[a] * means[b];
                }
            }
        }
    }

    fn sampling(&self, count: f64, shared: Option<&Nonlocal>) -> Sampling {
        let free = (count - 1.0).max(f64::MIN_POSITIVE);
        let sum = shared.map_or(self.total, |shared| self.total + shared.total);
        let total = |i: usize, j: usize| sum[(i, j)];
        let of_shared = |of: fn(&Nonlocal) -> &[[f64; 6]; 6], a: usize, b: usize| shared.map_or(0.0, |s| of(s)[a][b]);
        let mut spread = [[0.0; 6]; 6];
        let mut normals = [0.0; 6];
        for (a, [i, j]) in PAIRS.into_iter().enumerate() {
            for (b, [k, l]) in PAIRS.into_iter().enumerate() {
                // tr(PAPB) = tr AB − (1/n) 1ᵀ(AB + BA)1 + (1/n²) 1ᵀA1 1ᵀB1.
                let means = total(i, k) * total(l, j) + total(i, l) * total(k, j);
                let products = self.products[a][b] + of_shared(|shared| &shared.products, a, b);
                let row_products = self.row_products[a][b] + of_shared(|shared| &shared.row_products, a, b);
                let normal = products - row_products / count + means / (count * count);
                let fourth =
                    self.fourth[a][b] - self.fourth_mixed[a][b] / count + self.fourth_means[a][b] / (count * count);
                spread[a][b] = (normal + fourth) / (free * free);
                normals[a] = if a == b { normal } else { normals[a] };
            }
        }
        Sampling {
            count,
            mean_covariance: sum / (count * count),
            covariance: (self.variance - sum / count) / free,
            spread,
            variance_thirds: shared.map(|shared| {
                let third = |i: usize| {
                    let [square, one, total] = self.own[i];
                    let own = [one - total / count, square - (total / count).powi(2)];
                    let pair = PAIRS.iter().position(|pair| *pair == [i, i]).unwrap_or_default();
                    let whole = 0.5 * normals[pair];
                    let cross = 0.5 * (whole - own[1] - shared.square(i, pair, count));
                    shared.third(i, own, cross)
                };
                [0, 1, 2].map(|i| third(i) / free.powi(3))
            }),
        }
    }
}

/// Adds C_ik C_jl + C_il C_jk of a covariance and of what is shared besides, less that of the latter alone, for all pairs ij
/// (rows) and kl (columns).
fn add_with(table: &mut [[f64; 6]; 6], own: &Matrix3<f64>, shared: Option<&Matrix3<f64>>) {
    let Some(shared) = shared else { return add_products(table, own, 1.0) };
    add_products(table, &(own + shared), 1.0);
    add_products(table, shared, -1.0);
}

#[cfg(test)]
mod tests {
    use super::super::place::FAR;
    use super::*;
    use crate::cfa::CfaPattern;
    use crate::frame::mirror;
    use crate::propagation::gains;
    use crate::stages::demosaic::Method;
    use crate::stages::demosaic::stencil::phase;
    use crate::stages::demosaic::weights::WeightTable;
    use crate::stages::noise::knots;
    use nalgebra::DMatrix;

    fn sites(variances: [f64; 3], excess_kurtosis: f64) -> [Prediction; 3] {
        variances.map(|variance| Prediction {
            moments: MeanVariance { mean: 0.0, variance },
            third: 0.0,
            excess_kurtosis,
            sixth: 0.0,
            common: 0.0,
            lines: LineCovariance::default(),
        })
    }

    /// Sums of a dozen terms of one size in doubles: relative 10⁻¹².
    #[test]
    fn the_law_of_any_moments_follows_from_nine() {
        let sites = [(2.0, 0.3), (5.0, -0.2), (0.7, 1.1)].map(|(variance, excess_kurtosis)| Prediction {
            moments: MeanVariance { mean: 0.0, variance },
            third: 0.0,
            excess_kurtosis,
            sixth: 0.0,
            common: 0.0,
            lines: LineCovariance::default(),
        });
        let matrix = Matrix3::new(0.4, 0.3, 0.2, 0.1, 0.9, -0.1, 0.02, 0.1, 0.9);
        let place = Place { frame: [30, 20], origin: [1, 0], corner: [2, 5], size: [7, 5] };
        for method in [Method::Bilinear, Method::EffectiveColor] {
            let weights = WeightTable::of(method, CfaPattern::Grbg).about([1.0; 2]);
            let basis = SamplingBasis::of(&weights, &place);
            assert!(close(&basis.sampling(&sites), &Sampling::of(&weights, &sites, &place), 1e-12));
            let mixed = Sampling::of(&weights.through(&matrix), &sites, &place);
            assert!(close(&basis.sampling(&sites).through(&matrix), &mixed, 1e-12));
        }
    }

    fn close(a: &Sampling, b: &Sampling, tolerance: f64) -> bool {
        let spreads = a.spread.iter().flatten().zip(b.spread.iter().flatten());
        let scale = b.spread[0][0].abs().max(b.spread[5][5].abs());
        (a.mean_covariance - b.mean_covariance).abs().max() < tolerance * b.mean_covariance.max()
            && (a.covariance - b.covariance).abs().max() < tolerance * b.covariance.max()
            && spreads.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < tolerance * scale
    }

    /// Large regions follow from small ones: against going through all pairs, with edges near, far and at the rim.
    #[test]
    fn large_regions_follow_from_small_ones() {
        let sites = sites([1.0, 2.0, 3.0], 0.4);
        for method in Method::ALL {
            let weights = WeightTable::new(method, CfaPattern::Grbg).about([1.0, 0.8]);
            for (frame, corner, size) in
                [([27, 30], [0, 0], [27, 30]), ([60, 40], [3, 1], [25, 26]), ([32, 33], [5, 2], [27, 31])]
            {
                let place = Place { frame, origin: [1, -2], corner, size };
                let count = (size[0] * size[1]) as f64;
                let whole = Sums::of(&weights, &sites, &place, size).sampling(count, None);
                assert!(close(&Sampling::of(&weights, &sites, &place), &whole, 1e-11), "{method:?} {place:?}");
            }
        }
    }

    /// Photosites that share rows and columns, of any covariances.
    fn sharing(mut sites: [Prediction; 3]) -> [Prediction; 3] {
        let outer = |a: [f64; 3], b: [f64; 3], k: usize| [0, 1, 2].map(|l| a[k] * a[l] + b[k] * b[l]);
        for (k, site) in sites.iter_mut().enumerate() {
            let row = outer([0.3, 0.5, 0.2], [0.1, 0.2, -0.1], k);
            site.lines =
                LineCovariance { row, column: outer([0.2, 0.2, 0.2], [0.0, 0.3, 0.1], k), ..Default::default() };
            site.moments.variance += row[k] + site.lines.column[k];
        }
        sites
    }

    /// Of each class so much more of the drift of its row, with so many rows from knot to knot.
    fn drifting(mut sites: [Prediction; 3], rows_per_knot: f64) -> [Prediction; 3] {
        let (scales, others) = ([0.9, 0.7, 0.8], [-0.5, 0.3, 0.1]);
        for (k, site) in sites.iter_mut().enumerate() {
            let LineCovariance { row, drift, drift_rows, .. } = &mut site.lines;
            let shared = |l: usize| scales[k] * scales[l] + others[k] * others[l];
            (*drift, *drift_rows) = ([0, 1, 2].map(shared), rows_per_knot);
            row.iter_mut().zip(*drift).for_each(|(row, drift)| *row += drift);
            site.moments.variance += drift[k];
        }
        sites
    }

    /// The covariance of two rows by a drift of variance 1.
    fn of_rows([y, other]: [i64; 2], rows_per_knot: f64) -> f64 {
        let ((j, [a, b]), (k, [c, d])) = (knots(y, rows_per_knot), knots(other, rows_per_knot));
        match k - j {
            0 => a * c + b * d,
            1 => b * c,
            -1 => a * d,
            _ => 0.0,
        }
    }

    /// Everything from full matrices: W of all pixels and channels, Σ = W D Wᵀ, P, traces.
    #[test]
    #[allow(clippy::too_many_lines, reason = "one case after another, against one set of matrices")]
    fn small_regions_agree_with_full_matrices() {
        let cases = [
            ([9, 8], [0, 2], [7, 5]),
            ([9, 8], [0, 0], [9, 8]),
            ([26, 7], [1, 1], [25, 5]),
            ([6, 27], [1, 2], [4, 24]),
        ];
        for ((method, (frame, corner, size)), (is_shared, per_knot)) in
            Method::ALL.into_iter().flat_map(|method| cases.map(|case| (method, case))).flat_map(|case| {
                [(false, None), (true, None), (true, Some(2.0)), (false, Some(5.3)), (true, Some(70.0))]
                    .map(|shared| (case, shared))
            })
        {
            let weights = WeightTable::new(method, CfaPattern::Rggb).about([0.6, 1.8]);
            let plain = sites([1.5, 2.0, 0.7], 0.9);
            let sites = if is_shared { sharing(plain) } else { plain };
            let sites = per_knot.map_or(sites, |rows| drifting(sites, rows));
            let place = Place { frame, origin: [0, -6], corner, size };
            let found = Sampling::of(&weights, &sites, &place);
            let (n, all) = (size[0] * size[1], frame[0] * frame[1]);
            let at = |s: usize| [s % frame[0], s / frame[0]];
            let class = |s: usize| CfaPattern::Rggb.class(at(s)[0] as i64, at(s)[1] as i64) as usize;
            let rows = [0, 1, 2].map(|channel| {
                let mut w = DMatrix::<f64>::zeros(n, all);
                for a in 0..n {
                    let [x, y] = [a % size[0] + corner[0], a / size[0] + corner[1]];
                    for ([dx, dy], weight) in weights.stencil(phase(x as i64, y as i64), channel).sites() {
                        let line = mirror(y.cast_signed() + dy, frame[1]);
                        w[(a, line * frame[0] + mirror(x.cast_signed() + dx, frame[0]))] += weight;
                    }
                }
                w
            });
            let d = DMatrix::from_fn(all, all, |s, t| {
                let ([x, y], [other_x, other_y], site) = (at(s), at(t), &sites[class(s)]);
                let shared = |is_same: bool, line: [f64; 3]| if is_same { line[class(t)] } else { 0.0 };
                if s == t {
                    return site.moments.variance;
                }
                let drift = per_knot.map_or(0.0, |rows| of_rows([y, other_y].map(|y| y as i64 - 6), rows));
                shared(y == other_y, site.lines.row)
                    + shared(x == other_x, site.lines.column)
                    + shared(y != other_y, site.lines.drift) * drift
            });
            let p = DMatrix::identity(n, n) - DMatrix::from_element(n, n, 1.0 / n as f64);
            let c: Vec<DMatrix<f64>> = (0..9).map(|ij| &rows[ij / 3] * &d * rows[ij % 3].transpose()).collect();
            let pc: Vec<DMatrix<f64>> = c.iter().map(|c| &p * c).collect();
            let q: Vec<Vec<f64>> = (0..9)
                .map(|ij| {
                    let of_columns = &p * &rows[ij % 3];
                    (0..all).map(|s| rows[ij / 3].column(s).dot(&of_columns.column(s))).collect()
                })
                .collect();
            let trace = |a: usize, b: usize| pc[a].dot(&pc[b].transpose());
            let free = n as f64 - 1.0;
            let mut expected = found.clone();
            for (a, [i, j]) in PAIRS.into_iter().enumerate() {
                expected.mean_covariance[(i, j)] = c[3 * i + j].sum() / (n * n) as f64;
                expected.covariance[(i, j)] = pc[3 * i + j].trace() / free;
                expected.mean_covariance[(j, i)] = expected.mean_covariance[(i, j)];
                expected.covariance[(j, i)] = expected.covariance[(i, j)];
                for (b, [k, l]) in PAIRS.into_iter().enumerate() {
                    let normal = trace(3 * i + k, 3 * l + j) + trace(3 * i + l, 3 * k + j);
                    let fourth: f64 =
                        (0..all).map(|s| sites[class(s)].fourth() * q[3 * i + j][s] * q[3 * k + l][s]).sum();
                    expected.spread[a][b] = (normal + fourth) / (free * free);
                }
            }
            assert!(
                close(&found, &expected, 1e-11),
                "{method:?} {place:?} {is_shared} {per_knot:?}\n{found:?}\n{expected:?}"
            );
            // Third cumulants take what is shared and what is not apart, and the latter for χ².
            for (i, third) in found.variance_thirds.into_iter().flatten().enumerate() {
                let cube = &pc[4 * i] * &pc[4 * i];
                let exact = 8.0 * cube.dot(&pc[4 * i].transpose()) / free.powi(3);
                eprintln!("{method:?} {place:?} {i}: {:.3}", third / exact);
                assert!((third / exact).ln().abs() < 0.3, "{method:?} {place:?}: {third} {exact}");
            }
        }
    }

    /// Far from edges a pixel's expected sample covariance is that of all phases, and the mean's that of a patch.
    #[test]
    fn patches_in_the_interior_agree_with_their_gains() {
        let weights = WeightTable::new(Method::Malvar, CfaPattern::Bggr).about([1.0, 1.0]);
        let variances = [1.0, 2.0, 3.0];
        let place = Place { frame: [900, 800], origin: [0, 0], corner: [100, 101], size: [601, 502] };
        let found = Sampling::of(&weights, &sites(variances, 0.0), &place);
        let patch = gains::patch_mean(&weights, phase(100, 101), [601, 502]).covariance(variances);
        assert!((found.mean_covariance - patch).abs().max() < 1e-10 * patch.max());
        let pixel = gains::mean_pixel(&weights).covariance(variances);
        // An odd extent has one phase more often than the other, by 1/601; the mean takes off a few of 300,000 pixels.
        assert!((found.covariance - pixel).abs().max() < 2e-3 * pixel.max());
    }

    #[test]
    fn far_edges_do_not_matter() {
        let weights = WeightTable::new(Method::EffectiveColor, CfaPattern::Rggb).about([1.0, 1.0]);
        let sites = sites([1.0, 2.0, 3.0], 0.2);
        for corner in [[0, 0], [2, 3], [3, 4], [17, 40], [34, 51]] {
            let place = Place { frame: [41, 60], origin: [-3, 8], corner, size: [7, 9] };
            let canonical = place.canonical(false);
            assert!(canonical.frame[0] <= 7 + 2 * FAR && canonical.frame[1] <= 9 + 2 * FAR);
            assert!(close(&Sampling::of(&weights, &sites, &place), &Sampling::of(&weights, &sites, &canonical), 1e-13));
        }
    }

    #[test]
    fn planes_drawn_apart_have_their_textbook_errors() {
        let found = Sampling::independent(&sites([4.0, 9.0, 16.0], 0.5), 101.0);
        assert!((found.mean_covariance[(1, 1)] - 9.0 / 101.0).abs() < 1e-15);
        assert!((found.spread[0][0] - 16.0 * (0.02 + 0.5 / 101.0)).abs() < 1e-14);
        assert!((found.spread[1][1] - 0.36).abs() < 1e-14);
    }
}

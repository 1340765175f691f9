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

#[cfg(test)]
mod tests {
    use super::super::moments::Prediction;
    use super::super::sampling::Place;
    use super::super::spaces::{Channels, Curved};
    use super::super::taps::Group;
    use super::*;
    use crate::camera::sensor::tests::kaf5101ce;
    use crate::camera::taps::{TapLayout, Taps};
    use crate::cfa::CfaPattern;
    use crate::frame::Geometry;
    use crate::metadata::{DemosaicRecord, FrameHeader, Metadata};
    use crate::names::Named;
    use crate::stages::demosaic::Method;
    use crate::stages::demosaic::weights::WeightTable;
    use crate::units::QuantityKind;
    use nalgebra::{DMatrix, DVector};

    const PLANE: [i64; 4] = [3, 2, 33, 28];
    const PART: [usize; 4] = [4, 0, 27, 25];

    /// A part of a demosaicked plane of a sensor of 36×30 photosites.
    fn frame(method: Method, layout: TapLayout, count: usize) -> FrameHeader {
        let mut sensor = kaf5101ce();
        let readout = sensor.readout.as_mut().unwrap();
        (readout.width, readout.height) = (36, 30);
        readout.taps = Some(Taps { layout, gain: vec![1.0; count], offset_e: vec![], read_noise_e: vec![] });
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.sensor = Some(sensor);
        metadata.demosaic = Some(DemosaicRecord {
            method: method.name().into(),
            cfa: CfaPattern::Gbrg,
            black: 0.0.into(),
            black_deltas: false,
            plane: Some(PLANE),
        });
        let [x, y, width, height] = PART;
        let mut geometry = Geometry::new(width, height, &["R", "G", "B"]);
        geometry.origin = [3 + i32::try_from(x).unwrap(), 2 + i32::try_from(y).unwrap()];
        FrameHeader { name: "test".into(), geometry, metadata }
    }

    fn channels() -> Channels {
        let matrix = Matrix3::new(0.4, 0.3, 0.2, 0.2, 0.7, 0.1, 0.0, 0.1, 0.9);
        Channels { matrix, black: 2.0, space: None }
    }

    /// Groups of as many amplifiers, which differ by a share.
    fn groups(count: usize, by: f64) -> Vec<(usize, Group)> {
        let class = |k: usize, tap: usize| {
            let [k, more] = [k as f64, by * tap as f64];
            let variance = 4.0 + k + 1.5 * more;
            let fourth = (0.2 + 0.3 * k - 0.1 * more) * variance.powi(2);
            Prediction::of_cumulants(100.0 + 30.0 * k + 2.0 * more, variance, 2.0 + 3.0 * k + more, fourth)
        };
        (0..count).map(|tap| (tap, Group { counts: [1.0; 3], sites: [0, 1, 2].map(|k| class(k, tap)) })).collect()
    }

    /// Taps that are alike are one: sums in another order, relative 10⁻¹².
    #[test]
    fn taps_that_are_alike_are_one() {
        for (method, layout, count) in [
            (Method::Bilinear, TapLayout::Columns, 3),
            (Method::EffectiveColor, TapLayout::Quadrants, 4),
            (Method::Malvar, TapLayout::LeftRight, 2),
        ] {
            let groups = groups(count, 0.0);
            let pixels = TappedPixels::of(&frame(method, layout, count), &channels(), 10.0, &groups).unwrap();
            let [x, y, width, height] = PART;
            let place = Place { frame: [33, 28], origin: [3, 2], corner: [x, y], size: [width, height] };
            let weights = WeightTable::new(method, CfaPattern::Gbrg).about([1.0; 2]).through(&channels().matrix);
            let (found, one) = (pixels.sampling(), Sampling::of(&weights, &groups[0].1.sites, &place));
            let close =
                |found: f64, one: f64, scale: f64| assert!((found - one).abs() < 1e-12 * scale, "{found} {one}");
            for (a, [i, j]) in PAIRS.into_iter().enumerate() {
                let scale = |of: &Matrix3<f64>| (of[(i, i)] * of[(j, j)]).sqrt();
                close(found.covariance[(i, j)], one.covariance[(i, j)], scale(&one.covariance));
                close(found.mean_covariance[(i, j)], one.mean_covariance[(i, j)], scale(&one.mean_covariance));
                for b in 0..6 {
                    close(found.spread[a][b], one.spread[a][b], (one.spread[a][a] * one.spread[b][b]).sqrt());
                }
            }
            let mean = channels().matrix * Vector3::new(88.0, 118.0, 148.0);
            (0..3).for_each(|i| close(pixels.mean[i], mean[i], mean[i]));
        }
    }

    /// By full matrices over all pixels and photosites: sums of up to 10⁶ products, relative 10⁻¹¹.
    #[test]
    fn kinds_of_places_agree_with_full_matrices() {
        let white = [120.0, 130.0, 140.0];
        let lab = Channels { space: Some(Curved::Lab(white)), ..channels() };
        for (method, layout, count, channels) in [
            (Method::Bilinear, TapLayout::Columns, 3, channels()),
            (Method::EffectiveColor, TapLayout::Quadrants, 4, channels()),
            (Method::Bilinear, TapLayout::TopBottom, 2, lab),
        ] {
            let pixels = TappedPixels::of(&frame(method, layout, count), &channels, 10.0, &groups(count, 1.0)).unwrap();
            check_by_full_matrices(&pixels, &format!("{method:?} {layout:?}"));
        }
    }

    /// Weights of pixels on all photosites, and what the pixels have beyond these on average.
    fn weights_of(
        pixels: &TappedPixels,
        places: &[[usize; 2]],
        [columns, rows]: [usize; 2],
    ) -> ([DMatrix<f64>; 3], Matrix3<f64>) {
        let mut weights = [(); 3].map(|()| DMatrix::<f64>::zeros(places.len(), columns * rows));
        let mut beyond = Matrix3::<f64>::zeros();
        for (a, at) in places.iter().enumerate() {
            let kind = pixels.kind(*at);
            beyond += kind.beyond / places.len() as f64;
            for site in &kind.sites {
                let to = [0, 1].map(|axis| at[axis].checked_add_signed(site.offset[axis]).unwrap());
                (0..3).for_each(|i| weights[i][(a, to[1] * columns + to[0])] = site.weights[i]);
            }
        }
        (weights, beyond)
    }

    fn less_mean(matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let mean = matrix.row_mean();
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |a, s| matrix[(a, s)] - mean[s])
    }

    fn check_by_full_matrices(pixels: &TappedPixels, what: &str) {
        let [x0, y0, width, height] = PART;
        let [columns, rows] = [33_usize, 28];
        let places: Vec<[usize; 2]> = (y0..y0 + height).flat_map(|y| (x0..x0 + width).map(move |x| [x, y])).collect();
        let (n, sites) = (places.len(), columns * rows);
        let count = n as f64;
        let cumulant = |of: fn(&Prediction) -> f64| {
            DVector::from_fn(sites, |s, _| of(pixels.array.site([s % columns, s / columns])))
        };
        let (second, third, fourth) =
            (cumulant(|site| site.moments.variance), cumulant(|site| site.third), cumulant(Prediction::fourth));
        let (weights, beyond) = weights_of(pixels, &places, [columns, rows]);
        let projected = weights.each_ref().map(less_mean);
        let scaled = |matrix: &DMatrix<f64>| matrix * DMatrix::from_diagonal(&second);
        let means = [0, 1, 2].map(|i| DVector::from_fn(n, |a, _| pixels.kind(places[a]).mean[i]));
        let off = means.each_ref().map(|mean| mean.add_scalar(-mean.mean()));
        let sampling = pixels.sampling();
        let scaled = projected.each_ref().map(scaled);
        // P C_ik P.
        let c = |i: usize, k: usize| &scaled[i] * projected[k].transpose();
        let c: Vec<DMatrix<f64>> = (0..9).map(|index| c(index / 3, index % 3)).collect();
        let trace = |[i, k]: [usize; 2], [l, j]: [usize; 2]| c[3 * i + k].dot(&c[3 * l + j].transpose());
        let form =
            |i: usize, j: usize| DVector::from_fn(sites, |s, _| projected[i].column(s).dot(&projected[j].column(s)));
        let linear = |i: usize, j: usize| projected[j].transpose() * &off[i] + projected[i].transpose() * &off[j];
        let close = |found: f64, expected: f64, scale: f64| {
            assert!((found - expected).abs() < 1e-11 * scale, "{what}: {found} {expected}");
        };
        let free = count - 1.0;
        let sum = |of: &dyn Fn(usize) -> f64| (0..sites).map(of).sum::<f64>();
        let forms: Vec<_> = PAIRS.iter().map(|&[i, j]| (form(i, j), linear(i, j))).collect();
        for (a, [i, j]) in PAIRS.into_iter().enumerate() {
            let own = c[3 * i + j].trace();
            let expected = (own + off[i].dot(&off[j])) / free + beyond[(i, j)];
            close(
                sampling.covariance[(i, j)],
                expected,
                (sampling.covariance[(i, i)] * sampling.covariance[(j, j)]).sqrt(),
            );
            let of_means =
                sum(&|s| weights[i].column(s).sum() * second[s] * weights[j].column(s).sum()) / count.powi(2);
            close(sampling.mean_covariance[(i, j)], of_means, sampling.mean_covariance.diagonal().max());
            for (b, [k, l]) in PAIRS.into_iter().enumerate() {
                let ((q, g), (r, h)) = (&forms[a], &forms[b]);
                let more = sum(&|s| {
                    second[s] * g[s] * h[s] + third[s] * (q[s] * h[s] + g[s] * r[s]) + fourth[s] * q[s] * r[s]
                });
                let expected = (trace([i, k], [l, j]) + trace([i, l], [k, j]) + more) / (free * free);
                close(sampling.spread[a][b], expected, (sampling.spread[a][a] * sampling.spread[b][b]).sqrt());
            }
        }
        let over = |i: usize| means[i].mean();
        (0..3).for_each(|i| close(pixels.mean[i], over(i), over(i).abs()));
        let within = pixels.within(|tap, class| {
            let site = |s: &usize| {
                let at = [s % columns, s / columns];
                let [x, y] = [at[0] as i64 + PLANE[0], at[1] as i64 + PLANE[1]];
                pixels.array.tap(at) == tap && CfaPattern::Gbrg.class(x, y) as usize == class
            };
            (0..sites).find(site).map_or(0.0, |s| second[s])
        });
        for i in 0..3 {
            let all =
                (0..n).map(|a| (0..sites).map(|s| second[s] * weights[i][(a, s)].powi(2)).sum::<f64>()).sum::<f64>();
            close(within[(i, i)], all / count, within[(i, i)]);
            let whole = within[(i, i)] + off[i].norm_squared() / count + beyond[(i, i)];
            close(pixels.covariance[(i, i)], whole, whole);
        }
    }
}

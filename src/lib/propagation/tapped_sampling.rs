//! How sample means and covariances scatter of pixels that several amplifiers have a part in.
//!
//! Pixel a is m(a) + e(a), e(a) = Σ_s W_a(s) x_s the noise of its photosites, as in [`super::sampling`]; and d = Pm is how far the mean
//! of each lies from that of all. Then
//!
//! - E s_ij = \[tr(P C_ij) + d_i·d_j]/(n − 1)
//! - (n − 1)² cov(s_ij, s_kl) = tr(P C_ik P C_lj) + tr(P C_il P C_kj) + Σ_s \[κ₂ g_ij g_kl + κ₃ (Q_ij g_kl + g_ij Q_kl) + κ₄ Q_ij Q_kl]
//!
//! with Q_ij(s) = Σ_a W_i W_j − B_i B_j/n, B_i(s) = Σ_a W_i, and g_ij(s) = Σ_a d_i W_j + d_j W_i what the distances make of a photosite.
//! Where photosites share rows and columns C has a part that reaches farther, whose sums are those of [`super::tapped_shares`], and where they
//! follow these on a curve lines add what [`super::tapped_bent`] has.
//!
//! All but P are sums over pixels, or photosites, of what lies around them, so that one of each kind of place is gone through.

use super::bent_lines::BeyondNormal;
use super::covariance::PAIRS;
use super::line_sampling::Nonlocal;
use super::place::add_products;
use super::sampling::Sampling;
use super::tapped::{Kind, TappedPixels};
use super::tapped_drift::RowProducts;
use super::tapped_shares::Shares;
use nalgebra::{Matrix3, Vector3};

/// Sums over pixels and photosites.
struct Sums {
    /// Σ_a C(a, a), Σ_ab of what is each photosite's own, Σ_a d dᵀ, and Σ_a of what is beyond the weights.
    variance: Matrix3<f64>,
    total: Matrix3<f64>,
    between: Matrix3<f64>,
    beyond: Matrix3<f64>,
    /// Σ_ab C_ik C_jl + C_il C_jk, by pairs ij and kl, less that of what is shared.
    products: [[f64; 6]; 6],
    /// The same of row sums, in both orders.
    row_products: [[f64; 6]; 6],
    /// Σ_ab C², Σ_a C(a, a) and Σ_ab C of what is each photosite's own, by channel.
    own: [[f64; 3]; 3],
    /// What photosites share.
    shared: Option<Nonlocal>,
    /// Σ_a q and Σ_a q², q = C d, by channel.
    distances: [[f64; 3]; 2],
    /// Σ_s κ₄ Q Q.
    fourths: [[f64; 6]; 6],
    /// Σ_s κ₂ g g + κ₃ (Q g + g Q), and the first term of what is shared.
    of_distances: [[f64; 6]; 6],
}

impl TappedPixels {
    /// How the sample means and covariances of the rectangle scatter; worked out once.
    pub fn sampling(&self) -> &Sampling {
        self.sampling.get_or_init(|| {
            let found = Sums::of(self).sampling(self.count(), &self.beyond_normal());
            Sampling { mean_covariance: found.mean_covariance + self.level, ..found }
        })
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
            own: [[0.0; 3]; 3],
            shared: None,
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
                    if around { axis.kinds_around(reach.unsigned_abs(), far).2 } else { axis.examples(far) }
                });
            let both = |(y, of_y): (usize, f64)| {
                let columns = columns.clone();
                columns.into_iter().map(move |(x, of_x)| ([x, y], of_x * of_y))
            };
            rows.into_iter().flat_map(both).collect::<Vec<_>>()
        };
        let shares = Shares::of(pixels);
        let mut of_shared = RowProducts::default();
        for (at, times) in places(false) {
            sums.add_pixel(pixels, shares.as_ref(), at, times, &mut of_shared);
        }
        if let Some(shares) = &shares {
            sums.shared = Some(shares.sums(&of_shared));
            sums.distances[1].iter_mut().zip(shares.squares_of_drift()).for_each(|(sum, of)| *sum += of);
            let of_distances = shares.of_distances();
            sums.of_distances.iter_mut().flatten().zip(of_distances.iter().flatten()).for_each(|(sum, of)| *sum += of);
        }
        for (at, times) in places(true) {
            sums.add_site(pixels, at, times);
        }
        sums
    }

    /// So many pixels like that of a place; `of_shared` are the products of the row sums of what they share.
    fn add_pixel(
        &mut self,
        pixels: &TappedPixels,
        shares: Option<&Shares<'_>>,
        at: [usize; 2],
        times: f64,
        of_shared: &mut RowProducts,
    ) {
        let off = |kind: &Kind| Vector3::from(pixels.off(kind));
        let pixel = pixels.kind(at);
        let (mut row_sum, mut moved) = (Matrix3::zeros(), Vector3::zeros());
        for (other, lag) in pixels.near(at, 2 * pixels.array.weights.reach()) {
            let covariance = pixel.covariance_with(other, lag);
            row_sum += covariance;
            moved += covariance.diagonal().component_mul(&off(other));
            let shared = shares.map(|shares| shares.covariance(pixel, other, at[1], lag));
            add_with(&mut self.products, &covariance, shared.as_ref(), times);
            (0..3).for_each(|i| self.own[i][0] += times * covariance[(i, i)].powi(2));
        }
        let itself = pixel.covariance_with(pixel, [0, 0]);
        let shared = shares.map(|shares| shares.covariance(pixel, pixel, at[1], [0, 0])).unwrap_or_default();
        self.variance += times * (itself + shared);
        self.total += times * row_sum;
        self.between += times * off(pixel) * off(pixel).transpose();
        self.beyond += times * pixel.beyond;
        let further = shares.map(|shares| (shares.row_sum(pixel, at), shares.drift_sum(pixel, at[1])));
        let all = further.as_ref().map(|((lines, _), (drift, _))| lines + drift);
        add_with(&mut self.row_products, &row_sum, all.as_ref(), times);
        add_with(&mut self.row_products, &row_sum.transpose(), all.map(|all| all.transpose()).as_ref(), times);
        let mut by_drift = [0.0; 3];
        if let Some(((lines, of_lines), (drift, of_drift))) = further {
            moved += Vector3::from(of_lines);
            by_drift = of_drift;
            of_shared.add(&lines, &drift, times);
        }
        for i in 0..3 {
            self.own[i][1] += times * itself[(i, i)];
            self.own[i][2] += times * row_sum[(i, i)];
            self.distances[0][i] += times * (moved[i] + by_drift[i]);
            // Squares of what the drift makes of them are sums of their own.
            self.distances[1][i] += times * moved[i] * (moved[i] + 2.0 * by_drift[i]);
        }
    }

    /// So many photosites like that of a place.
    fn add_site(&mut self, pixels: &TappedPixels, at: [usize; 2], times: f64) {
        let (squares, moved) = pixels.squares_of_site(at);
        let (second, [third, fourth]) = (pixels.array.own(at), pixels.array.own_cumulants(at));
        for a in 0..PAIRS.len() {
            for b in 0..PAIRS.len() {
                self.fourths[a][b] += times * fourth * squares[a] * squares[b];
                let both = squares[a] * moved[b] + moved[a] * squares[b];
                self.of_distances[a][b] += times * (second * moved[a] * moved[b] + third * both);
            }
        }
    }

    fn sampling(&self, count: f64, beyond: &BeyondNormal) -> Sampling {
        let free = (count - 1.0).max(f64::MIN_POSITIVE);
        let all = self.shared.as_ref().map_or(self.total, |shared| self.total + shared.total);
        let total = |i: usize, j: usize| all[(i, j)];
        let with_shared = |own: f64, of: fn(&Nonlocal) -> &[[f64; 6]; 6], a: usize, b: usize| {
            own + self.shared.as_ref().map_or(0.0, |shared| of(shared)[a][b])
        };
        let of_normal = |a: usize, b: usize| {
            let ([i, j], [k, l]) = (PAIRS[a], PAIRS[b]);
            // tr(PAPB) = tr AB − (1/n) 1ᵀ(AB + BA)1 + (1/n²) 1ᵀA1 1ᵀB1.
            let means = total(i, k) * total(l, j) + total(i, l) * total(k, j);
            let products = with_shared(self.products[a][b], |shared| &shared.products, a, b);
            let row_products = with_shared(self.row_products[a][b], |shared| &shared.row_products, a, b);
            products - row_products / count + means / (count * count)
        };
        let spread = std::array::from_fn(|a| {
            std::array::from_fn(|b| {
                let found = of_normal(a, b) + self.fourths[a][b] + self.of_distances[a][b] + beyond.spread[a][b];
                (if a == b { found.max(0.0) } else { found }) / (free * free)
            })
        });
        let own = self.variance - all / count;
        // Of the noise as of χ² of its mean and variance, but for what is shared, and 24 |PCd|² of the distances.
        let third = |i: usize| {
            let pair = PAIRS.iter().position(|pair| *pair == [i, i]).unwrap_or_default();
            let [sum, square] = self.distances.map(|of| of[i]);
            let of_noise = match &self.shared {
                Some(shared) => {
                    let [square, one, total] = self.own[i];
                    let of_own = [one - total / count, square - (total / count).powi(2)];
                    let cross = 0.5 * (0.5 * of_normal(pair, pair) - of_own[1] - shared.square(i, pair, count));
                    shared.third(i, of_own, cross)
                }
                None if own[(i, i)] > 0.0 => {
                    2.0 * (of_normal(pair, pair) + self.fourths[pair][pair]).powi(2) / own[(i, i)]
                }
                None => 0.0,
            };
            (of_noise + 24.0 * (square - sum * sum / count).max(0.0) + beyond.thirds[i]) / free.powi(3)
        };
        Sampling {
            count,
            mean_covariance: all / (count * count),
            covariance: (own + self.between) / free + self.beyond / count,
            spread,
            variance_thirds: Some([0, 1, 2].map(third)),
        }
    }
}

/// Adds `times` C_ik C_jl + C_il C_jk of a covariance and of what is shared besides, less that of the latter alone, for all pairs ij
/// (rows) and kl (columns).
fn add_with(table: &mut [[f64; 6]; 6], own: &Matrix3<f64>, shared: Option<&Matrix3<f64>>, times: f64) {
    let Some(shared) = shared else { return add_products(table, own, times) };
    add_products(table, &(own + shared), times);
    add_products(table, shared, -times);
}

#[cfg(test)]
mod tests {
    use super::super::moments::{LineCovariance, Prediction};
    use super::super::sampling::Place;
    use super::super::spaces::{Channels, Curved};
    use super::super::tap_lines::{TapDrift, TapLines};
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
    use crate::stages::noise::knots;
    use crate::units::QuantityKind;
    use nalgebra::{DMatrix, DVector};

    const ROWS_PER_KNOT: f64 = 4.3;

    /// Covariance of two rows of a drift of variance 1, by the knot before each and the weights of it and the next.
    fn between([(j, [a, b]), (k, [c, d])]: [(i64, [f64; 2]); 2]) -> f64 {
        [(j, a), (j + 1, b)]
            .iter()
            .flat_map(|(m, x)| [(k, c), (k + 1, d)].map(|(n, y)| if *m == n { x * y } else { 0.0 }))
            .sum()
    }

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

    /// Groups of as many amplifiers, which differ by a share, and share such lines.
    fn groups(count: usize, by: f64, lines: Option<&TapLines>) -> Vec<(usize, Group)> {
        let class = |class: usize, tap: usize| {
            let [k, more] = [class as f64, by * tap as f64];
            let own = 4.0 + k + 1.5 * more;
            let place = 3 * tap + class;
            let shared = lines.map_or(0.0, |lines| lines.row[(place, place)] + lines.column[(place, place)]);
            let fourth = (0.2 + 0.3 * k - 0.1 * more) * own.powi(2);
            let (mean, third) = (100.0 + 30.0 * k + 2.0 * more, 2.0 + 3.0 * k + more);
            let mut found = Prediction::of_cumulants(mean, own + shared, third, fourth);
            if let Some(lines) = lines {
                let of_axis = |line: &DMatrix<f64>| [0, 1, 2].map(|l| line[(place, 3 * tap + l)]);
                let drift = [0, 1, 2].map(|l| lines.drift(place, 3 * tap + l));
                let (row, column) = (of_axis(&lines.row), of_axis(&lines.column));
                found.lines = LineCovariance { row, column, drift, drift_rows: ROWS_PER_KNOT, ..Default::default() };
            }
            found
        };
        (0..count).map(|tap| (tap, Group { counts: [1.0; 3], sites: [0, 1, 2].map(|k| class(k, tap)) })).collect()
    }

    /// What photosites of as many amplifiers share, which differ by a share in what they make of it: of ranks 2 and 3.
    fn lines(count: usize, by: f64, drifts: bool) -> TapLines {
        let scale = |place: usize| 1.0 + 0.3 * by * (place / 3) as f64;
        let load = |place: usize| [[0.9, 1.2, 0.6][place % 3], [-0.5, 0.3, 0.7][place % 3]].map(|k| k * scale(place));
        let drift = TapDrift { loads: (0..3 * count).map(load).collect(), rows_per_knot: ROWS_PER_KNOT };
        let of_drift = DMatrix::from_fn(3 * count, 3 * count, |a, b| if drifts { drift.between(a, b) } else { 0.0 });
        let drift = drifts.then_some(drift);
        let load = |axis: usize, place: usize| {
            let (more, k) = (by * (place / 3) as f64, place % 3);
            let gain = 1.0 + 0.3 * more;
            [[0.9, 0.4 * gain, 0.0], [0.5 * gain, 0.3 + 0.1 * more, 0.2 * more]][axis]
                .map(|load| load * [1.0, 1.4, 0.8][k])
        };
        let of = |axis: usize| {
            DMatrix::from_fn(3 * count, 3 * count, |a, b| {
                let (a, b) = (load(axis, a), load(axis, b));
                (0..3).map(|factor| a[factor] * b[factor]).sum()
            })
        };
        let together = vec![Matrix3::zeros(); count];
        TapLines { row: of(0) + of_drift, drift, column: of(1), together, bent: [None, None] }
    }

    /// Taps that are alike are one: sums in another order, relative 10⁻¹².
    #[test]
    fn taps_that_are_alike_are_one() {
        for ((method, layout, count), (is_shared, drifts)) in [
            (Method::Bilinear, TapLayout::Columns, 3),
            (Method::EffectiveColor, TapLayout::Quadrants, 4),
            (Method::Malvar, TapLayout::LeftRight, 2),
            (Method::SmoothHue, TapLayout::Columns, 2),
        ]
        .into_iter()
        .flat_map(|case| [(false, false), (true, false), (true, true)].map(|shared| (case, shared)))
        {
            let lines = is_shared.then(|| lines(count, 0.0, drifts));
            let groups = groups(count, 0.0, lines.as_ref());
            let frame = frame(method, layout, count);
            let pixels = TappedPixels::of(&frame, &channels(), 10.0, &groups, lines.as_ref()).unwrap();
            let [x, y, width, height] = PART;
            let place = Place { frame: [33, 28], origin: [3, 2], corner: [x, y], size: [width, height] };
            let weights = WeightTable::new(method, CfaPattern::Gbrg).about([0.75, 1.25]).through(&channels().matrix);
            let (found, one) = (pixels.sampling(), Sampling::of(&weights, &groups[0].1.sites, &place));
            let close =
                |found: f64, one: f64, scale: f64| assert!((found - one).abs() < 1e-12 * scale, "{found} {one}");
            for (a, [i, j]) in PAIRS.into_iter().enumerate() {
                let scale = |of: &Matrix3<f64>| (of[(i, i)] * of[(j, j)]).sqrt();
                // Beyond the first order, places at the edges are others.
                let of_hue = if method == Method::SmoothHue { 1e10 } else { 1.0 };
                close(found.covariance[(i, j)], one.covariance[(i, j)], of_hue * scale(&one.covariance));
                close(found.mean_covariance[(i, j)], one.mean_covariance[(i, j)], scale(&one.mean_covariance));
                for b in 0..6 {
                    let scale = (one.spread[a][a] * one.spread[b][b]).sqrt();
                    close(found.spread[a][b], one.spread[a][b], of_hue.min(1e7) * scale);
                }
            }
            if is_shared {
                let thirds = [found, &one].map(|law| law.variance_thirds.unwrap());
                // Places of whose growth large ones follow do not reach over three lines and their pixels.
                let of_hue = if method == Method::SmoothHue { 1e8 } else { 1e5 };
                (0..3).for_each(|i| close(thirds[0][i], thirds[1][i], of_hue * thirds[1][i]));
            }
            let mean = channels().matrix * Vector3::new(88.0, 118.0, 148.0);
            (0..3).for_each(|i| close(pixels.mean[i] - pixels.bias[i], mean[i], mean[i]));
        }
    }

    /// By full matrices over all pixels and photosites: sums of up to 10⁶ products, relative 10⁻¹¹.
    #[test]
    fn kinds_of_places_agree_with_full_matrices() {
        let white = [120.0, 130.0, 140.0];
        let lab = Channels { space: Some(Curved::Lab(white)), ..channels() };
        for (method, layout, count, channels) in [
            (Method::SmoothHue, TapLayout::Columns, 3, channels()),
            (Method::EffectiveColor, TapLayout::Quadrants, 4, channels()),
            (Method::Bilinear, TapLayout::TopBottom, 2, lab),
        ] {
            for lines in [None, Some(lines(count, 1.0, false)), Some(lines(count, 1.0, true))] {
                let frame = frame(method, layout, count);
                let groups = groups(count, 1.0, lines.as_ref());
                let pixels = TappedPixels::of(&frame, &channels, 10.0, &groups, lines.as_ref()).unwrap();
                check_by_full_matrices(&pixels, lines.as_ref(), &format!("{method:?} {layout:?} {}", lines.is_some()));
            }
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

    /// The covariance of all photosites of a plane.
    fn site_covariance(pixels: &TappedPixels, lines: Option<&TapLines>, [columns, rows]: [usize; 2]) -> DMatrix<f64> {
        let at = |s: usize| [s % columns, s / columns];
        let place = |s: usize| {
            let [x, y] = at(s);
            let class = CfaPattern::Gbrg.class(x as i64 + PLANE[0], y as i64 + PLANE[1]);
            3 * pixels.array.tap(at(s)) + class as usize
        };
        DMatrix::from_fn(columns * rows, columns * rows, |s, t| {
            let shared = |line: &DMatrix<f64>, axis: usize| {
                if at(s)[axis] == at(t)[axis] { line[(place(s), place(t))] } else { 0.0 }
            };
            let of_rows = [at(s)[1], at(t)[1]].map(|row| knots(PLANE[1] + row as i64, ROWS_PER_KNOT));
            let shared = lines.map_or(0.0, |lines| {
                let drift = lines.drift(place(s), place(t));
                let alone = if at(s)[1] == at(t)[1] { lines.row_alone(place(s), place(t)) } else { 0.0 };
                alone + drift * between(of_rows) + shared(&lines.column, 0)
            });
            shared + if s == t { pixels.array.own(at(s)) } else { 0.0 }
        })
    }

    #[allow(clippy::too_many_lines, reason = "one set of matrices for all sums")]
    fn check_by_full_matrices(pixels: &TappedPixels, lines: Option<&TapLines>, what: &str) {
        let [x0, y0, width, height] = PART;
        let [columns, rows] = [33_usize, 28];
        let places: Vec<[usize; 2]> = (y0..y0 + height).flat_map(|y| (x0..x0 + width).map(move |x| [x, y])).collect();
        let (n, sites) = (places.len(), columns * rows);
        let count = n as f64;
        let cumulant = |of: fn(&Prediction) -> f64| {
            DVector::from_fn(sites, |s, _| {
                let [tap, class] = pixels.array.of_site([s % columns, s / columns]);
                of(&pixels.array.moments.sites[tap][class])
            })
        };
        let second = site_covariance(pixels, lines, [columns, rows]);
        let own = second.diagonal();
        let (third, fourth) = (cumulant(|site| site.third), cumulant(Prediction::fourth));
        let (weights, beyond) = weights_of(pixels, &places, [columns, rows]);
        let projected = weights.each_ref().map(less_mean);
        let scaled = |matrix: &DMatrix<f64>| matrix * &second;
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
            let [one, other] = [i, j].map(|i| weights[i].row_sum().transpose());
            let of_means = one.dot(&(&second * &other)) / count.powi(2);
            close(sampling.mean_covariance[(i, j)], of_means, sampling.mean_covariance.diagonal().max());
            for (b, [k, l]) in PAIRS.into_iter().enumerate() {
                let ((q, g), (r, h)) = (&forms[a], &forms[b]);
                let more =
                    g.dot(&(&second * h)) + sum(&|s| third[s] * (q[s] * h[s] + g[s] * r[s]) + fourth[s] * q[s] * r[s]);
                let expected = (trace([i, k], [l, j]) + trace([i, l], [k, j]) + more) / (free * free);
                close(sampling.spread[a][b], expected, (sampling.spread[a][a] * sampling.spread[b][b]).sqrt());
            }
        }
        let over = |i: usize| means[i].mean();
        (0..3).for_each(|i| close(pixels.mean[i], over(i), over(i).abs()));
        for i in 0..3 {
            let all = (&weights[i] * &second).dot(&weights[i]);
            let first_order = pixels.first_order();
            // A drift counts there as over all places among the knots; here it has six of them.
            let over_places = if lines.is_some_and(|lines| lines.drift.is_some()) { 1e9 } else { 1.0 };
            close(first_order[(i, i)], all / count, over_places * first_order[(i, i)]);
            let whole = first_order[(i, i)] + off[i].norm_squared() / count + beyond[(i, i)];
            close(pixels.covariance[(i, i)], whole, whole);
            // Of what is shared third cumulants are told to about a quarter; of what is curved by the first order alone.
            let c = &c[4 * i];
            let exact = (8.0 * (c * c).dot(&c.transpose()) + 24.0 * (c * &off[i]).norm_squared()) / free.powi(3);
            let third = sampling.variance_thirds.unwrap()[i];
            assert!(lines.is_none() || (third / exact).ln().abs() < 0.25, "{what} {i}: {third} {exact}");
        }
        if lines.is_some() {
            return;
        }
        let within = pixels.within(None, false, |tap, class| {
            let site = |s: &usize| {
                let at = [s % columns, s / columns];
                let [x, y] = [at[0] as i64 + PLANE[0], at[1] as i64 + PLANE[1]];
                pixels.array.tap(at) == tap && CfaPattern::Gbrg.class(x, y) as usize == class
            };
            (0..sites).find(site).map_or(0.0, |s| own[s])
        });
        (0..3).for_each(|i| close(within[(i, i)], pixels.first_order()[(i, i)], within[(i, i)]));
    }
}

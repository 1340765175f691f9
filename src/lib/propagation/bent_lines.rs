//! How photosites of a line go together beyond their covariance, where they follow what they share on a curve.
//!
//! Given what its line has, a, a photosite of a place p, its class and amplifier, has the mean μ + m(a) and the variance o + v(a), m and v
//! of mean 0. Beside full well, or an end of the codes, whole lines scatter less than others, so that squares of their photosites go together.
//! A quadratic form Σ Q_st y_s y_t + Σ g_s y_s in the distances y of photosites from their means has, given a of one line, the mean
//!
//! F(a) = Σ_p U_p v_p(a) + Σ_pq V_pq m_p(a) m_q(a) + Σ_p w_p m_p(a)
//!
//! but for what does not hang on a, with U = Σ Q_ss and w = Σ g_s over the photosites of the line of each place, V = Σ Q_st over two of them.
//! Lines are drawn apart, and F are the parts of the form that hang on one of them alone \[Hoeffding1948]: their variances add up. As if v were
//! constant and m normal, of the covariance R, they have the covariance 2 tr V R V′ R + wᵀ R w′, which other sums count. What is counted
//! here is the rest; of parts that hang on two lines, or on a line and a photosite, nothing is, which are less by the number of photosites of a line.

use nalgebra::{DMatrix, DVector};

/// What photosites are expected to read, by place, where a line has one value of what it shares.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Given {
    /// How likely it is.
    pub weight: f64,
    /// Means.
    pub means: DVector<f64>,
    /// Variances.
    pub variances: DVector<f64>,
}

/// What photosites of a line have in common, by their places: class k of the group g stands at 3 g + k.
#[derive(Debug, Clone, PartialEq)]
pub struct BentLine {
    /// Means and variances less what they are on average.
    given: Vec<Given>,
    /// R.
    covariance: DMatrix<f64>,
}

/// A quadratic form in the photosites of a line: U, V and w.
#[derive(Debug, Clone, PartialEq)]
pub struct LineForm {
    squares: DVector<f64>,
    products: DMatrix<f64>,
    linear: DVector<f64>,
}

impl LineForm {
    /// Of so many places, of nothing.
    pub fn zero(places: usize) -> Self {
        let none = DVector::zeros(places);
        Self { squares: none.clone(), products: DMatrix::zeros(places, places), linear: none }
    }

    /// Adds so much of the squares of photosites.
    pub fn add_square(&mut self, place: usize, times: f64) {
        self.squares[place] += times;
    }

    /// Adds so much of the products of photosites of two places.
    pub fn add_product(&mut self, [one, other]: [usize; 2], times: f64) {
        self.products[(one, other)] += 0.5 * times;
        self.products[(other, one)] += 0.5 * times;
    }

    /// Adds so much of photosites themselves.
    pub fn add_linear(&mut self, place: usize, times: f64) {
        self.linear[place] += times;
    }
}

/// What lines add to the law of sample covariances, by pairs of channels: to their covariances, and to the third cumulants of variances.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BeyondNormal {
    /// Rows and columns as [`PAIRS`](super::covariance::PAIRS).
    pub spread: [[f64; 6]; 6],
    /// Of each channel.
    pub thirds: [f64; 3],
}

/// Where the variances of channels stand among the pairs.
const VARIANCES: [usize; 3] = [0, 3, 5];

impl BentLine {
    /// Of all values of what is shared; none of no value.
    pub(super) fn of(mut given: Vec<Given>) -> Option<Self> {
        let places = given.first()?.means.len();
        let all: f64 = given.iter().map(|given| given.weight).sum();
        let mean = |of: fn(&Given) -> &DVector<f64>| {
            given.iter().fold(DVector::zeros(places), |sum, given| sum + given.weight / all * of(given))
        };
        let (of_means, of_variances) = (mean(|given| &given.means), mean(|given| &given.variances));
        let mut covariance = DMatrix::zeros(places, places);
        for one in &mut given {
            one.weight /= all;
            one.means -= &of_means;
            one.variances -= &of_variances;
            covariance += one.weight * &one.means * one.means.transpose();
        }
        Some(Self { given, covariance })
    }

    /// How many places there are.
    pub fn places(&self) -> usize {
        self.covariance.nrows()
    }

    /// Third and fourth cumulants of a photosite of a place that are of its line: cov(m, h) and cov(h, h) − 2R², h = v + m².
    pub(super) fn cumulants(&self, place: usize) -> [f64; 2] {
        let shared = self.covariance[(place, place)];
        let (mut third, mut fourth) = (0.0, -2.0 * shared * shared);
        for Given { weight, means, variances } in &self.given {
            let off = variances[place] + means[place] * means[place] - shared;
            third += weight * means[place] * off;
            fourth += weight * off * off;
        }
        [third, fourth]
    }

    /// Adds what so many lines of such forms, by pairs of channels, have beyond normal variables.
    pub fn add(&self, forms: &[LineForm; 6], times: f64, to: &mut BeyondNormal) {
        let scaled = forms.each_ref().map(|form| &form.products * &self.covariance);
        let mean = scaled.each_ref().map(DMatrix::trace);
        let mut sums = BeyondNormal::default();
        for Given { weight, means, variances } in &self.given {
            let value = |pair: usize| {
                let LineForm { squares, products, linear } = &forms[pair];
                squares.dot(variances) + means.dot(&(products * means)) - mean[pair] + linear.dot(means)
            };
            let values: [f64; 6] = std::array::from_fn(value);
            for (row, a) in sums.spread.iter_mut().zip(values) {
                row.iter_mut().zip(values).for_each(|(sum, b)| *sum += weight * a * b);
            }
            sums.thirds.iter_mut().zip(VARIANCES).for_each(|(sum, pair)| *sum += weight * values[pair].powi(3));
        }
        let moved = forms.each_ref().map(|form| &self.covariance * &form.linear);
        for a in 0..6 {
            for b in 0..6 {
                let normal = 2.0 * scaled[a].dot(&scaled[b].transpose()) + forms[a].linear.dot(&moved[b]);
                to.spread[a][b] += times * (sums.spread[a][b] - normal);
            }
        }
        for (i, pair) in VARIANCES.into_iter().enumerate() {
            let cube = (&scaled[pair] * &scaled[pair]).dot(&scaled[pair].transpose());
            let normal = 8.0 * cube + 6.0 * moved[pair].dot(&(&forms[pair].products * &moved[pair]));
            to.thirds[i] += times * (sums.thirds[i] - normal);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::covariance::PAIRS;

    /// Lines of two places whose means are 2 z and −z + b (z² − 1), and whose variances rise by s z, or stay, z normal.
    fn line(bend: f64, of_variance: f64) -> BentLine {
        // The trapezoidal rule of a normal law in steps of 1/8 is exact to rounding.
        let given = (-96..=96).map(|step| {
            let z = 0.125 * f64::from(step);
            Given {
                weight: 0.125 * crate::numerics::normal::density(z),
                means: DVector::from_vec(vec![2.0 * z + 7.0, -z + bend * (z * z - 1.0)]),
                variances: DVector::from_vec(vec![4.0 + of_variance * z, 1.0]),
            }
        });
        BentLine::of(given.collect()).unwrap()
    }

    fn forms() -> [LineForm; 6] {
        assert_eq!(VARIANCES.map(|pair| PAIRS[pair]), [[0, 0], [1, 1], [2, 2]]);
        std::array::from_fn(|pair| {
            let mut form = LineForm::zero(2);
            form.add_square(0, 3.0 + pair as f64);
            form.add_product([0, 1], 0.5 - 0.2 * pair as f64);
            form.add_product([0, 0], 1.0);
            form.add_linear(0, 0.3 * pair as f64);
            form
        })
    }

    #[test]
    fn normal_lines_of_even_scatter_leave_nothing() {
        let mut found = BeyondNormal::default();
        line(0.0, 0.0).add(&forms(), 3.0, &mut found);
        // Of numbers of up to a thousand.
        assert!(found.spread.iter().flatten().chain(&found.thirds).all(|rest| rest.abs() < 1e-9), "{found:?}");
        assert!(line(0.0, 0.0).cumulants(0).iter().all(|rest| rest.abs() < 1e-11));
    }

    /// F = β z + λ (z² − 1), β = U s + 2 w and λ = 4 − 2 c: cov(F, F′) = β β′ + 2 λ λ′ and κ₃ = 8 λ³ + 6 λ β², of which β = 2 w is counted.
    #[test]
    fn variances_of_lines_go_with_their_means() {
        let s = 0.7;
        let mut found = BeyondNormal::default();
        line(0.0, s).add(&forms(), 1.0, &mut found);
        let of = |pair: usize| {
            let pair = pair as f64;
            [(3.0 + pair) * s + 0.6 * pair, 0.6 * pair, 4.0 - 2.0 * (0.5 - 0.2 * pair)]
        };
        for a in 0..6 {
            for b in 0..6 {
                let wanted = of(a)[0] * of(b)[0] - of(a)[1] * of(b)[1];
                assert!((found.spread[a][b] - wanted).abs() < 1e-9, "{a} {b}: {} {wanted}", found.spread[a][b]);
            }
        }
        for (third, [beta, counted, lambda]) in found.thirds.into_iter().zip(VARIANCES.map(of)) {
            let wanted = 6.0 * lambda * (beta * beta - counted * counted);
            assert!((third - wanted).abs() < 1e-8, "{third} {wanted}");
        }
        // cov(2z, s z + 4 (z² − 1)) = 2 s, and s² + 16 · 2 − 2 · 16.
        let [third, fourth] = line(0.0, s).cumulants(0);
        assert!((third - 2.0 * s).abs() < 1e-11 && (fourth - s * s).abs() < 1e-10, "{third} {fourth}");
    }

    /// −z + b (z² − 1) alone has the third cumulant 6 b + 8 b³ and the fourth 48 b² + 48 b⁴.
    #[test]
    fn curved_means_have_cumulants_of_their_own() {
        let b = 0.4;
        let [third, fourth] = line(b, 0.0).cumulants(1);
        assert!((third - (6.0 * b + 8.0 * b.powi(3))).abs() < 1e-10, "{third}");
        assert!((fourth - 48.0 * (b * b + b.powi(4))).abs() < 1e-9, "{fourth}");
    }
}

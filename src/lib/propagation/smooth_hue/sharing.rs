//! Smooth hue transition of photosites that share rows and columns: numerators and greens hang together.
//!
//! Each channel is a mean of products of factors 1 + z and 1/(1 + z), z relative noise of a site or of a sum of sites. The
//! expectation of a product is expanded to the fourth order by the joint cumulants of its variables; what is shared is normal and
//! adds to the second alone.

use crate::cfa::{CfaPattern, Class};
use crate::propagation::moments::Prediction;
use crate::propagation::moments::SiteCovariance;
use crate::stages::demosaic::stencil::{PHASES, REACH, Stencil};
use crate::stages::demosaic::weights::{greens_of_hue, sites_of_hue};
use nalgebra::{Matrix3, Vector3};

/// A factor of a product.
#[derive(Clone, Copy)]
enum Factor<'a> {
    /// 1 + z.
    Times(&'a Stencil),
    /// 1/(1 + z).
    Over(&'a Stencil),
}

impl<'a> Factor<'a> {
    fn form(self) -> &'a Stencil {
        match self {
            Self::Times(form) | Self::Over(form) => form,
        }
    }

    /// Derivative of such an order at z = 0.
    fn derivative(self, order: usize) -> f64 {
        match (self, order) {
            (_, 0) => 1.0,
            (Self::Times(_), 1) => 1.0,
            (Self::Times(_), _) => 0.0,
            (Self::Over(_), _) => (1..=order).map(|k| -(k as f64)).product(),
        }
    }
}

/// Cumulants of the relative noise of sites about a pixel.
struct Noise<'a, C> {
    class: &'a C,
    covariance: SiteCovariance,
    mean: [f64; 3],
    sites: &'a [Prediction; 3],
}

impl<C: Fn([isize; 2]) -> Class> Noise<'_, C> {
    fn relative(&self, k: usize, cumulant: f64, order: i32) -> f64 {
        cumulant / self.mean[k].powi(order)
    }

    /// What the sites of each line give to a form, by classes.
    fn lines(&self, form: &Stencil, axis: usize) -> [[f64; 3]; 2 * REACH.unsigned_abs() + 1] {
        let mut found = [[0.0; 3]; 2 * REACH.unsigned_abs() + 1];
        for (offset, weight) in form.sites() {
            let class = (self.class)(offset) as usize;
            found[(offset[1 - axis] + REACH).cast_unsigned()][class] += weight / self.mean[class];
        }
        found
    }

    fn pair(&self, a: &Stencil, b: &Stencil) -> f64 {
        let own = |(offset, weight): ([isize; 2], f64)| {
            let class = (self.class)(offset) as usize;
            weight * b.at(offset) * self.relative(class, self.covariance.own[class], 2)
        };
        let mut sum: f64 = a.sites().map(own).sum();
        for (axis, covariance) in self.covariance.lines().into_iter().enumerate() {
            for (mine, theirs) in self.lines(a, axis).iter().zip(self.lines(b, axis)) {
                for k in 0..3 {
                    for l in 0..3 {
                        sum += mine[k] * covariance[(k, l)] * theirs[l];
                    }
                }
            }
        }
        sum
    }

    /// Joint cumulant of three or four forms.
    fn higher(&self, forms: &[&Stencil]) -> f64 {
        let Some((first, rest)) = forms.split_first() else { return 0.0 };
        let of_site = |(offset, weight): ([isize; 2], f64)| {
            let class = (self.class)(offset) as usize;
            let product = rest.iter().fold(weight, |product, form| product * form.at(offset));
            let site = &self.sites[class];
            product
                * match forms.len() {
                    3 => self.relative(class, site.third, 3),
                    _ => self.relative(class, site.fourth(), 4),
                }
        };
        first.sites().map(of_site).sum()
    }

    /// The expectation of a product, less 1.
    fn product(&self, factors: &[Factor<'_>]) -> f64 {
        let count = factors.len();
        let pairs: Vec<f64> =
            (0..count * count).map(|ij| self.pair(factors[ij / count].form(), factors[ij % count].form())).collect();
        let pair = |i: usize, j: usize| pairs[i * count + j];
        let derivative = |indices: &[usize]| -> f64 {
            let order = |variable: usize| indices.iter().filter(|&&index| index == variable).count();
            (0..count).map(|variable| factors[variable].derivative(order(variable))).product()
        };
        let form = |i: usize| factors[i].form();
        let mut expected = 0.0;
        for i in 0..count {
            for j in 0..count {
                expected += derivative(&[i, j]) * pair(i, j) / 2.0;
                for k in 0..count {
                    let third = derivative(&[i, j, k]);
                    if third != 0.0 {
                        expected += third * self.higher(&[form(i), form(j), form(k)]) / 6.0;
                    }
                    for l in 0..count {
                        let fourth = derivative(&[i, j, k, l]);
                        if fourth != 0.0 {
                            let all = self.higher(&[form(i), form(j), form(k), form(l)]);
                            expected += fourth * (pair(i, j) * pair(k, l) / 8.0 + all / 24.0);
                        }
                    }
                }
            }
        }
        expected
    }
}

/// Mean and covariance of the pixels of one phase.
pub(super) fn of_phase(
    pattern: CfaPattern,
    phase: usize,
    mean: [f64; 3],
    sites: &[Prediction; 3],
) -> (Vector3<f64>, Matrix3<f64>) {
    let class = |offset: [isize; 2]| {
        let [x, y] = PHASES[phase];
        pattern.class((x + offset[0]) as i64, (y + offset[1]) as i64)
    };
    // What is not lit has no relative noise; next to nothing stands for it.
    let least = 1e-9 * mean[Class::Green as usize];
    let mean = mean.map(|mean| if mean.abs() < least { least } else { mean });
    let noise = Noise { class: &class, covariance: SiteCovariance::of(sites), mean, sites };
    // A channel is the mean of x_i g/g_i, or of x_i where it is measured, and of g.
    let parts = Class::ALL.map(|wanted| {
        let (here, around) = greens_of_hue(pattern, phase, if wanted == Class::Green { Class::Red } else { wanted });
        let own = sites_of_hue(pattern, phase, wanted).into_iter().map(Stencil::site).collect::<Vec<_>>();
        if wanted == Class::Green { (here, vec![], vec![]) } else { (here, own, around) }
    });
    let terms = parts.each_ref().map(|(here, own, around)| -> Vec<Vec<Factor<'_>>> {
        match (own.is_empty(), around.is_empty()) {
            (true, _) => vec![vec![Factor::Times(here)]],
            (false, true) => own.iter().map(|own| vec![Factor::Times(own)]).collect(),
            (false, false) => {
                let both = own.iter().zip(around);
                both.map(|(own, green)| vec![Factor::Times(own), Factor::Times(here), Factor::Over(green)]).collect()
            }
        }
    });
    let average = |products: &mut dyn Iterator<Item = Vec<Factor<'_>>>| {
        let (sum, count) =
            products.fold((0.0, 0.0), |(sum, count), product| (sum + noise.product(&product), count + 1.0));
        sum / count
    };
    let first = [0, 1, 2].map(|i| average(&mut terms[i].iter().cloned()));
    let covariance = Matrix3::from_fn(|i, j| {
        if i > j {
            return 0.0;
        }
        let pairs = terms[i].iter().flat_map(|a| terms[j].iter().map(move |b| [&a[..], &b[..]].concat()));
        let both = average(&mut pairs.into_iter());
        mean[i] * mean[j] * (both - first[i] - first[j] - first[i] * first[j])
    });
    let means = Vector3::from_fn(|i, _| mean[i] * (1.0 + first[i]));
    (means, covariance + covariance.transpose() - Matrix3::from_diagonal(&covariance.diagonal()))
}

//! What a pixel by smooth hue transition is made of, and its moments to the fourth order in noise over signal.
//!
//! Each channel is a mean of products of factors 1 + z and 1/(1 + z), times what they are without noise, z the relative noise of a photosite or
//! of a sum of some. The expectation of a product is expanded by the joint cumulants of its variables,
//!
//! ½ Σ fᵢⱼ κᵢⱼ + ⅙ Σ fᵢⱼₖ κᵢⱼₖ + Σ fᵢⱼₖₗ (κᵢⱼ κₖₗ/8 + κᵢⱼₖₗ/24)
//!
//! f its derivatives at the means. Photosites may hang together in the second cumulant, and each has others of its own.

use crate::cfa::{CfaPattern, Class};
use crate::stages::demosaic::stencil::Stencil;
use crate::stages::demosaic::weights::{greens_of_hue, sites_of_hue};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// A photosite about a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::propagation) struct HueSite {
    /// How far away, column and row.
    pub offset: [isize; 2],
    /// Its mean above black, and third and fourth cumulants.
    pub mean: f64,
    pub third: f64,
    pub fourth: f64,
}

/// A factor of a product, by the number of its sum.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Factor {
    /// 1 + z.
    Times(usize),
    /// 1/(1 + z).
    Over(usize),
}

impl Factor {
    fn form(self) -> usize {
        match self {
            Self::Times(form) | Self::Over(form) => form,
        }
    }

    /// Derivative of such an order at z = 0.
    fn derivative(self, order: usize) -> f64 {
        match (self, order) {
            (_, 0) | (Self::Times(_), 1) => 1.0,
            (Self::Times(_), _) => 0.0,
            (Self::Over(_), _) => (1..=order).map(|k| -(k as f64)).product(),
        }
    }
}

/// A product, and what it is without noise as a part of its channel.
struct Term {
    value: f64,
    factors: Vec<Factor>,
}

/// What the channels of a pixel are made of.
pub(in crate::propagation) struct HuePixel {
    sites: Vec<HueSite>,
    /// Relative noise of photosites and of sums of them: what each has of each photosite.
    forms: Vec<DVector<f64>>,
    channels: [Vec<Term>; 3],
}

/// Sums of photosites as they are taken up.
struct Forms<'a> {
    sites: Vec<HueSite>,
    of_offset: &'a dyn Fn([isize; 2]) -> HueSite,
    sums: Vec<Vec<(usize, f64)>>,
    /// Means below this are none, and next to nothing stands for them.
    least: f64,
}

impl Forms<'_> {
    fn site(&mut self, offset: [isize; 2]) -> usize {
        let site = (self.of_offset)(offset);
        let known = self.sites.iter().position(|other| other.offset == site.offset);
        known.unwrap_or_else(|| {
            self.sites.push(site);
            self.sites.len() - 1
        })
    }

    /// Its number, and its mean.
    fn add(&mut self, stencil: &Stencil) -> (usize, f64) {
        let parts: Vec<(usize, f64)> = stencil.sites().map(|(offset, weight)| (self.site(offset), weight)).collect();
        let mean: f64 = parts.iter().map(|(site, weight)| weight * self.sites[*site].mean).sum();
        // What is not lit has no relative noise.
        let mean = if mean.abs() < self.least { self.least } else { mean };
        self.sums.push(parts.into_iter().map(|(site, weight)| (site, weight / mean)).collect());
        (self.sums.len() - 1, mean)
    }
}

impl HuePixel {
    /// Of the pixel of a phase, whose photosites so far away are as told, those beyond an edge folded back; `green` is about what green is.
    pub fn of(pattern: CfaPattern, phase: usize, green: f64, site: impl Fn([isize; 2]) -> HueSite) -> Self {
        let mut forms = Forms { sites: Vec::new(), of_offset: &site, sums: Vec::new(), least: 1e-9 * green };
        // A channel is the mean of x_i g/g_i, or of x_i where it is measured, and of g.
        let channels = Class::ALL.map(|wanted| {
            let of = if wanted == Class::Green { Class::Red } else { wanted };
            let (here, around) = greens_of_hue(pattern, phase, of);
            if wanted == Class::Green {
                let (form, value) = forms.add(&here);
                return vec![Term { value, factors: vec![Factor::Times(form)] }];
            }
            let own = sites_of_hue(pattern, phase, wanted);
            let share = 1.0 / own.len() as f64;
            let mut terms = Vec::new();
            for (index, offset) in own.iter().enumerate() {
                let (form, mean) = forms.add(&Stencil::site(*offset));
                let mut term = Term { value: share * mean, factors: vec![Factor::Times(form)] };
                if let Some(green) = around.get(index) {
                    let [(here, of_here), (there, of_there)] = [&here, green].map(|stencil| forms.add(stencil));
                    term.value *= of_here / of_there;
                    term.factors.extend([Factor::Times(here), Factor::Over(there)]);
                }
                terms.push(term);
            }
            terms
        });
        let (sites, sums) = (forms.sites, forms.sums);
        let count = sites.len();
        let forms = sums.into_iter().map(|parts| {
            let mut form = DVector::zeros(count);
            parts.into_iter().for_each(|(site, part)| form[site] += part);
            form
        });
        Self { forms: forms.collect(), sites, channels }
    }

    /// The photosites, in the order of what [`Self::moments`] takes.
    pub fn sites(&self) -> &[HueSite] {
        &self.sites
    }

    /// The channels without noise.
    pub fn mean(&self) -> [f64; 3] {
        self.channels.each_ref().map(|terms| terms.iter().map(|term| term.value).sum())
    }

    /// Derivatives of the channels by each photosite.
    pub fn weights(&self) -> Vec<[f64; 3]> {
        let mut found = vec![[0.0; 3]; self.sites.len()];
        for (channel, terms) in self.channels.iter().enumerate() {
            for term in terms {
                for factor in &term.factors {
                    let times = term.value * factor.derivative(1);
                    let form = self.forms[factor.form()].iter();
                    found.iter_mut().zip(form).for_each(|(weights, part)| weights[channel] += times * part);
                }
            }
        }
        found
    }

    /// How far noise moves the means of the channels, and their covariance, of photosites of such a covariance.
    pub fn moments(&self, covariance: &DMatrix<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let cumulants = Cumulants::of(self, covariance);
        let alone = self
            .channels
            .each_ref()
            .map(|terms| terms.iter().map(|term| cumulants.product(&term.factors)).collect::<Vec<_>>());
        let shift =
            Vector3::from_fn(|i, _| self.channels[i].iter().zip(&alone[i]).map(|(term, e)| term.value * e).sum());
        let found = Matrix3::from_fn(|i, j| {
            if i > j {
                return 0.0;
            }
            let of_pair = |(one, a): (&Term, &f64)| {
                let with = |(other, b): (&Term, &f64)| {
                    let both = cumulants.product(&[&one.factors[..], &other.factors[..]].concat());
                    other.value * (both - a - b - a * b)
                };
                one.value * self.channels[j].iter().zip(&alone[j]).map(with).sum::<f64>()
            };
            self.channels[i].iter().zip(&alone[i]).map(of_pair).sum()
        });
        (shift, found + found.transpose() - Matrix3::from_diagonal(&found.diagonal()))
    }

    /// Their covariance to first order.
    pub fn first_order(&self, covariance: &DMatrix<f64>) -> Matrix3<f64> {
        let weights = self.weights();
        let w = DMatrix::from_fn(3, weights.len(), |i, s| weights[s][i]);
        let found = &w * covariance * w.transpose();
        Matrix3::from_fn(|i, j| found[(i, j)])
    }
}

/// Joint cumulants of the relative noise of sums of photosites.
struct Cumulants<'a> {
    pixel: &'a HuePixel,
    pairs: DMatrix<f64>,
}

impl<'a> Cumulants<'a> {
    fn of(pixel: &'a HuePixel, covariance: &DMatrix<f64>) -> Self {
        let scaled: Vec<DVector<f64>> = pixel.forms.iter().map(|form| covariance * form).collect();
        let pairs = DMatrix::from_fn(pixel.forms.len(), pixel.forms.len(), |a, b| pixel.forms[a].dot(&scaled[b]));
        Self { pixel, pairs }
    }

    /// Of three or four.
    fn higher(&self, forms: &[usize]) -> f64 {
        let of_site = |(index, site): (usize, &HueSite)| {
            let product: f64 = forms.iter().map(|form| self.pixel.forms[*form][index]).product();
            product * if forms.len() == 3 { site.third } else { site.fourth }
        };
        self.pixel.sites.iter().enumerate().map(of_site).sum()
    }

    /// The expectation of a product, less 1: each set of variables once, times how often it comes in another order.
    fn product(&self, factors: &[Factor]) -> f64 {
        let count = factors.len();
        let form = |i: usize| factors[i].form();
        let pair = |i: usize, j: usize| self.pairs[(form(i), form(j))];
        // The derivative over the product of the factorials of its orders, which is one over how often it comes.
        let derivative = |indices: &[usize]| -> f64 {
            let mut found = 1.0;
            let mut rest = indices;
            while let Some(first) = rest.first() {
                let order = rest.iter().take_while(|index| *index == first).count();
                found *= factors[*first].derivative(order) / (1..=order).map(|k| k as f64).product::<f64>();
                rest = &rest[order..];
            }
            found
        };
        let mut expected = 0.0;
        for i in 0..count {
            for j in i..count {
                let second = derivative(&[i, j]);
                if second == 0.0 {
                    continue;
                }
                expected += second * pair(i, j);
                for k in j..count {
                    let third = derivative(&[i, j, k]);
                    if third == 0.0 {
                        continue;
                    }
                    expected += third * self.higher(&[form(i), form(j), form(k)]);
                    for l in k..count {
                        let fourth = derivative(&[i, j, k, l]);
                        if fourth != 0.0 {
                            let pairs = pair(i, j) * pair(k, l) + pair(i, k) * pair(j, l) + pair(i, l) * pair(j, k);
                            expected += fourth * (pairs + self.higher(&[form(i), form(j), form(k), form(l)]));
                        }
                    }
                }
            }
        }
        expected
    }
}

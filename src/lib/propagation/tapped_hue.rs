//! A pixel by smooth hue transition that several amplifiers have a part in, where it lies.
//!
//! Behind amplifiers that differ photosites of one class have other means, so that what the pixel is without noise, its weights and what
//! is beyond these hang on which of them reads what ([`super::smooth_hue::expansion`]).

use super::drift;
use super::smooth_hue::expansion::{HuePixel, HueSite};
use super::tapped_factors::{Site, TapMoments};
use crate::cfa::CfaPattern;
use nalgebra::{DMatrix, Matrix3};

/// Moments of such a pixel.
pub(super) struct TappedHue {
    /// Mean of the channels without noise, and how far this moves it.
    pub mean: [f64; 3],
    pub bias: [f64; 3],
    /// Its photosites, with their weights to first order.
    pub sites: Vec<Site>,
    /// What the covariance has beyond the first order.
    pub beyond: Matrix3<f64>,
}

impl TappedHue {
    /// Of the pixel of a phase, of photosites of such moments less `black`, whose green is about so much; `place` tells where the photosite
    /// so far away is, folded back from beyond an edge, and its amplifier and class.
    pub fn of(
        pattern: CfaPattern,
        phase: usize,
        [black, green]: [f64; 2],
        moments: &TapMoments,
        place: impl Fn([isize; 2]) -> ([isize; 2], [usize; 2]),
    ) -> Self {
        let of_site = |offset: [isize; 2]| {
            let (offset, [tap, class]) = place(offset);
            let site = &moments.sites[tap][class];
            HueSite { offset, mean: site.moments.mean - black, third: site.third, fourth: site.fourth() }
        };
        let pixel = HuePixel::of(pattern, phase, green, of_site);
        let of_weights = |(site, weights): (&HueSite, [f64; 3])| {
            let (offset, [tap, class]) = place(site.offset);
            Site { offset, class, tap, variance: moments.own[tap][class], weights }
        };
        let sites: Vec<Site> = pixel.sites().iter().zip(pixel.weights()).map(of_weights).collect();
        let shared = moments.shared.as_ref();
        let covariance = |place: f64| {
            DMatrix::from_fn(sites.len(), sites.len(), |a, b| {
                let own = if a == b { sites[a].variance } else { 0.0 };
                own + shared.map_or(0.0, |shared| shared.between(&sites[a], &sites[b], place))
            })
        };
        let places: &[f64] = if moments.drifts() { &drift::PLACES } else { &[0.0] };
        let share = 1.0 / places.len() as f64;
        let (mut bias, mut beyond) = ([0.0; 3], Matrix3::zeros());
        for place in places {
            let covariance = covariance(*place);
            let (moved, found) = pixel.moments(&covariance);
            bias.iter_mut().zip(moved.iter()).for_each(|(bias, moved)| *bias += share * moved);
            beyond += share * (found - pixel.first_order(&covariance));
        }
        Self { mean: pixel.mean(), bias, sites, beyond }
    }
}

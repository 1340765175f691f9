//! Pixels of a rectangle as weighted sums of photosites.

use super::place::Place;
use crate::cfa::Class;
use crate::stages::demosaic::stencil::{REACH, Stencil, phase};
use crate::stages::demosaic::weights::Weights;
use nalgebra::Matrix3;

/// The pixels of a place, row by row.
pub(super) fn pixels_of(weights: &Weights, place: &Place) -> Vec<Pixel> {
    let [width, height] = place.size;
    let places = (0..height).flat_map(|row| (0..width).map(move |column| [column, row]));
    places
        .map(|offset| {
            let at = [0, 1].map(|axis| place.corner[axis] + offset[axis]);
            let [x, y] = [0, 1].map(|axis| i64::from(place.origin[axis]) + at[axis] as i64);
            let phase = phase(x, y);
            let stencils = [0, 1, 2].map(|channel| weights.stencil(phase, channel).folded(at, place.frame));
            Pixel::new(&stencils, |offset| weights.class(phase, offset))
        })
        .collect()
}

/// One pixel: the sites it is made of, with the weights of the three channels, and the same by offset.
pub(super) struct Pixel {
    pub sites: Vec<([isize; 2], Class, [f64; 3])>,
    stencils: [Stencil; 3],
}

impl Pixel {
    fn new(stencils: &[Stencil; 3], class: impl Fn([isize; 2]) -> Class) -> Self {
        let all = (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| [x, y]));
        let sites = all
            .map(|offset| (offset, class(offset), stencils.each_ref().map(|stencil| stencil.at(offset))))
            .filter(|(_, _, weights)| *weights != [0.0; 3])
            .collect();
        Self { sites, stencils: stencils.clone() }
    }

    /// The covariance of this pixel's channels (rows) with those of the pixel `lag` away.
    pub fn covariance(&self, other: &Self, lag: [isize; 2], variances: [f64; 3]) -> Matrix3<f64> {
        let mut covariance = Matrix3::zeros();
        for (offset, class, mine) in &self.sites {
            let there = [offset[0] - lag[0], offset[1] - lag[1]];
            if there[0].abs() > REACH || there[1].abs() > REACH {
                continue;
            }
            let theirs = other.stencils.each_ref().map(|stencil| stencil.at(there));
            let variance = variances[*class as usize];
            for j in 0..3 {
                for i in 0..3 {
                    covariance[(i, j)] += variance * mine[i] * theirs[j];
                }
            }
        }
        covariance
    }
}

//! Patches that lie far from what the others make of them: names that are exchanged, and patches that are not what they are taken for.
//!
//! No camera is a colorimeter: honest charts have residuals of some ΔE with long tails, of saturated colors above all. The bounds are those
//! that none of 52 measured cameras passes for the colors of a ColorChecker, in 16 lights from candles and LED to the blue sky, with
//! references that are exact or off by 1 rms in L\*, a\* and b\*; of colors drawn from 190 natural ones one chart in 500 with
//! such references has an outlier, a red that no matrix gets right, and none of 30 000 has names that look exchanged.

use super::fit::Patch;
use crate::color::{lab_about, lab_from_xyz};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// So many times the median is what is off by names that are exchanged, at least.
const EXCHANGED: f64 = 3.0;
/// And so many times smaller does exchanging them make it.
const MENDED: f64 = 2.5;
/// So many times the median, and so many times the largest of the others, is an outlier off, at least.
const OUTLYING: f64 = 12.0;
const BEYOND_OTHERS: f64 = 3.0;
/// One in so many patches is an outlier at most.
const PATCHES_PER_OUTLIER: usize = 8;
/// Patches of a chart of one's own are off by 1 rms in L\*, a\* and b\*: by more than so many ΔE is one of 24 in 10 000 such charts
/// (χ² of three degrees, 29.2).
const OWN_CHART: f64 = 5.4;
/// So many patches are met by any matrix; the others tell by how much a patch is off.
const MET: usize = 3;

/// What patches are off by.
#[derive(Debug, Clone, PartialEq)]
pub struct Outliers {
    /// ΔE\*ab of each patch by a matrix that some patches which are far off do not draw.
    pub delta_e: Vec<f64>,
    /// Their median, without those that any matrix meets.
    pub median: f64,
    /// Patches that fit the colors of each other, with what they would then be off by.
    pub exchanged: Vec<([usize; 2], [f64; 2])>,
    /// Other patches that lie far from the rest.
    pub far: Vec<usize>,
}

/// Looks for patches that are exchanged, or far off, about a white; none where there are too few patches, or no matrix is found.
pub fn outliers(patches: &[Patch], white: [f64; 3]) -> Option<Outliers> {
    let matrix = of_least_sum(patches, white)?;
    let lab = |xyz: Vector3<f64>| Vector3::from(lab_from_xyz(xyz.into(), white));
    let expected: Vec<Vector3<f64>> = patches.iter().map(|patch| lab(patch.reference)).collect();
    let found: Vec<Vector3<f64>> = patches.iter().map(|patch| lab(matrix * patch.signal)).collect();
    let off = |place: usize, read: usize| (expected[place] - found[read]).norm();
    let delta_e: Vec<f64> = (0..patches.len()).map(|patch| off(patch, patch)).collect();
    let mut sorted = delta_e.clone();
    sorted.sort_by(f64::total_cmp);
    let told = sorted.get(MET..).filter(|told| !told.is_empty())?;
    let median = told[told.len() / 2];
    let least: Vec<f64> = patches.iter().map(|patch| least_of_interest(patch, &matrix, white)).collect();
    let is_off = |patch: usize, bound: f64| delta_e[patch] > bound.max(least[patch]);

    let mut pairs = Vec::new();
    for one in 0..patches.len() {
        for other in one + 1..patches.len() {
            let gain = delta_e[one].hypot(delta_e[other]) / off(one, other).hypot(off(other, one));
            if is_off(one, EXCHANGED * median) && is_off(other, EXCHANGED * median) && gain > MENDED {
                pairs.push((gain, [one, other]));
            }
        }
    }
    pairs.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    let mut exchanged: Vec<([usize; 2], [f64; 2])> = Vec::new();
    for (_, [one, other]) in pairs {
        if !exchanged.iter().flat_map(|(pair, _)| pair).any(|patch| [one, other].contains(patch)) {
            exchanged.push(([one, other], [off(one, other), off(other, one)]));
        }
    }
    let mut rest: Vec<usize> =
        (0..patches.len()).filter(|patch| exchanged.iter().all(|(pair, _)| !pair.contains(patch))).collect();
    rest.sort_by(|one, other| delta_e[*other].total_cmp(&delta_e[*one]));
    let stands_apart = |count: &usize| {
        let of_others = rest.get(*count).map_or(f64::INFINITY, |patch| delta_e[*patch]);
        is_off(rest[count - 1], (OUTLYING * median).max(BEYOND_OTHERS * of_others))
    };
    let count = (1..=rest.len() / PATCHES_PER_OUTLIER).rev().find(stands_apart).unwrap_or(0);
    rest.truncate(count);
    Some(Outliers { delta_e, median, exchanged, far: rest })
}

/// The matrix of the least sum of ΔE, which few patches that are far off do not draw as they do that of the least sum of squares: by least
/// squares whose weights are one over what a patch was off by before. ΔE are straight about the references.
fn of_least_sum(patches: &[Patch], white: [f64; 3]) -> Option<Matrix3<f64>> {
    const STEPS: usize = 30;
    /// Of the mean, below which no weight grows: patches that are met.
    const LEAST: f64 = 1e-3;
    let metrics: Vec<Matrix3<f64>> = patches
        .iter()
        .map(|patch| lab_about(patch.reference.into(), white).jacobian)
        .map(|jacobian| jacobian.transpose() * jacobian)
        .collect();
    let mut weights = vec![1.0; patches.len()];
    let mut matrix = Matrix3::zeros();
    for _ in 0..STEPS {
        let mut information = SMatrix::<f64, 9, 9>::zeros();
        let mut right = SVector::<f64, 9>::zeros();
        for ((patch, metric), weight) in patches.iter().zip(&metrics).zip(&weights) {
            let metric = metric * *weight;
            information += metric.kronecker(&(patch.signal * patch.signal.transpose()));
            right += (metric * patch.reference).kronecker(&patch.signal);
        }
        let elements = information.lu().solve(&right)?;
        matrix = Matrix3::from_row_slice(elements.as_slice());
        let off = patches.iter().zip(&metrics).map(|(patch, metric)| {
            let residual = patch.residual(&matrix);
            residual.dot(&(metric * residual)).max(0.0).sqrt()
        });
        let off: Vec<f64> = off.collect();
        let least = LEAST * off.iter().sum::<f64>() / off.len() as f64;
        weights = off.into_iter().map(|off| off.max(least).max(f64::MIN_POSITIVE).recip()).collect();
    }
    matrix.iter().all(|element| element.is_finite()).then_some(matrix)
}

/// ΔE below which a patch is off by the differences of charts, and by its own noise.
fn least_of_interest(patch: &Patch, matrix: &Matrix3<f64>, white: [f64; 3]) -> f64 {
    let to_lab = lab_about(patch.reference.into(), white).jacobian * matrix;
    let noise = (to_lab * patch.covariance * to_lab.transpose()).trace().max(0.0);
    OWN_CHART * (1.0 + noise / 3.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::xyz_from_lab;
    use crate::formats::chart::load_reference;

    const WHITE: [f64; 3] = [0.9642, 1.0, 0.8249];
    const MATRIX: Matrix3<f64> = Matrix3::new(1.5, 0.25, 0.08, 0.58, 1.42, -0.33, 0.03, -0.25, 2.33);

    /// The patches of a ColorChecker as a camera reads them, off by some ΔE that alternate.
    fn chart(off: f64) -> Vec<Patch> {
        let reference = load_reference("colorchecker").unwrap();
        let colors = reference.colors_in(WHITE).unwrap();
        let inverse = MATRIX.try_inverse().unwrap();
        let patch = |(index, (name, xyz)): (usize, (String, [f64; 3]))| {
            let mut lab = lab_from_xyz(xyz, WHITE);
            lab[index % 3] += off * [1.0, -1.0, 0.6, -0.6, 1.3][index % 5];
            Patch {
                name,
                signal: inverse * Vector3::from(xyz_from_lab(lab, WHITE)),
                covariance: Matrix3::zeros(),
                reference: Vector3::from(xyz),
            }
        };
        reference.names.into_iter().zip(colors).enumerate().map(patch).collect()
    }

    fn exchange(patches: &mut [Patch], [one, other]: [usize; 2]) {
        let signal = patches[one].signal;
        patches[one].signal = patches[other].signal;
        patches[other].signal = signal;
    }

    /// Foliage and green, neutral 6.5 and 5, and both at once, as exact as can be, and off by 3 ΔE as real charts are.
    #[test]
    fn exchanged_names_are_found() {
        for off in [0.0, 3.0] {
            let none = outliers(&chart(off), WHITE).unwrap();
            assert!(none.exchanged.is_empty() && none.far.is_empty(), "{none:?}");
            for pairs in [vec![[3, 13]], vec![[20, 21]], vec![[3, 13], [20, 21]], vec![[18, 23]]] {
                let mut patches = chart(off);
                pairs.iter().for_each(|pair| exchange(&mut patches, *pair));
                let found = outliers(&patches, WHITE).unwrap();
                let mut names: Vec<[usize; 2]> = found.exchanged.iter().map(|(pair, _)| *pair).collect();
                names.sort_unstable();
                assert_eq!((names, found.far.len()), (pairs, 0), "{off}: {found:?}");
                assert!(found.exchanged.iter().all(|(_, then)| then.iter().all(|off| *off < 8.0)), "{found:?}");
            }
        }
    }

    /// A patch that reads a third of its light is far off; where its noise is as large as that, or others are off by as much, it is not.
    #[test]
    fn patches_far_from_the_others_are_found() {
        let mut patches = chart(0.5);
        patches[9].signal *= 0.3;
        let found = outliers(&patches, WHITE).unwrap();
        assert_eq!((&found.far[..], found.exchanged.len()), (&[9][..], 0), "{found:?}");
        assert!(found.delta_e[9] > 12.0 * found.median);
        let shaded = patches[9].signal * 1.5;
        patches[9].covariance = Matrix3::from_diagonal(&shaded.component_mul(&shaded));
        assert!(outliers(&patches, WHITE).unwrap().far.is_empty());
        let mut several = chart(0.5);
        several.iter_mut().step_by(3).for_each(|patch| patch.signal *= 0.3);
        assert!(outliers(&several, WHITE).unwrap().far.is_empty());
        assert!(outliers(&chart(0.5)[..MET], WHITE).is_none());
    }
}

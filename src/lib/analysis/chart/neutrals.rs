//! What no light reads, as the neutral patches of a chart have it: their signals are proportional to their luminance.

use super::fit::Patch;
use crate::color::lab_from_xyz;
use nalgebra::Vector3;

/// Patches of no more chroma, C\*ab, are neutral: those of charts have 3 at most.
const MOST_CHROMA: f64 = 5.0;
/// So many neutral patches at least tell a line and what they are off it.
const FEWEST: usize = 4;
/// And so many times is the brightest of them as bright as the darkest at least.
const LEAST_SPAN: f64 = 4.0;
/// By so much is L\* of a chart of one's own off its nominal value, rms.
const LIGHTNESS_OFF: f64 = 1.0;
/// So many standard errors tell an offset: of 2000 charts whose L\*, a\* and b\* are off by 1 rms, one has one in all classes.
const Z: f64 = 4.0;

/// What signals of R, G and B are above where no light would read, and its standard errors, as shares of white level less black level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offsets {
    /// What they are.
    pub offset: [f64; 3],
    /// How well that is known.
    pub error: [f64; 3],
}

impl Offsets {
    /// Whether no chance of a chart makes them: all of one sign, and all by `Z` standard errors.
    pub fn are_told(&self) -> bool {
        let z: [f64; 3] = std::array::from_fn(|class| self.offset[class] / self.error[class]);
        z.iter().all(|z| *z > Z) || z.iter().all(|z| *z < -Z)
    }
}

/// The color of the neutral patches of a chart, Y = 1: the mean of those that are neutral about a white, or, where these are too few or too
/// much alike, of those in proportion to the brightest patch; none where these are too.
pub fn neutral_white(colors: &[[f64; 3]], white: [f64; 3]) -> Option<[f64; 3]> {
    let about = |white: [f64; 3]| {
        let neutral: Vec<&[f64; 3]> = colors.iter().filter(|color| is_neutral(**color, white)).collect();
        let sum = neutral.iter().fold(Vector3::zeros(), |sum, color| sum + Vector3::from(**color));
        is_row(&neutral.iter().map(|color| color[1]).collect::<Vec<_>>()).then(|| (sum / sum.y).into())
    };
    let brightest = colors.iter().max_by(|one, other| one[1].total_cmp(&other[1]))?;
    about(white).or_else(|| about(brightest.map(|value| value / brightest[1])))
}

fn is_neutral(color: [f64; 3], white: [f64; 3]) -> bool {
    let [_, a, b] = lab_from_xyz(color, white);
    color[1] > 0.0 && a.hypot(b) <= MOST_CHROMA
}

/// Whether luminances are enough, and span enough, for a line through them.
fn is_row(luminances: &[f64]) -> bool {
    let [low, high] = luminances.iter().fold([f64::INFINITY, 0.0_f64], |[low, high], y| [low.min(*y), high.max(*y)]);
    luminances.len() >= FEWEST && (LEAST_SPAN..).contains(&(high / low))
}

/// The offsets of signals from lines through zero, by the neutral patches about a white; none where these are too few or too much alike.
///
/// s = b + a Y, weighed by 1/(s² + (a ∂Y/∂L\* ΔL\*)²)        s: noise of the mean
///
/// Errors of the references are even in L\*, so that the dark patches rule, and light that falls off along the
/// row moves b by less than it falls: by a fifth from end to end, b is 0.008 of white, three standard errors.
pub fn offsets(patches: &[Patch], white: [f64; 3]) -> Option<Offsets> {
    let neutral: Vec<&Patch> = patches.iter().filter(|patch| is_neutral(patch.reference.into(), white)).collect();
    let luminances: Vec<f64> = neutral.iter().map(|patch| patch.reference.y).collect();
    if !is_row(&luminances) {
        return None;
    }
    let lines = [0, 1, 2].map(|class| {
        let mut slope = neutral.iter().map(|patch| patch.signal[class]).sum::<f64>() / luminances.iter().sum::<f64>();
        let mut found = [f64::NAN; 2];
        // The weights hang on the slope, by little.
        for _ in 0..4 {
            let rows = neutral.iter().map(|patch| {
                let off = slope * luminance_off(patch.reference.y, white[1]);
                (patch.reference.y, patch.signal[class], (patch.covariance[(class, class)] + off * off).recip())
            });
            let [count, y, yy, s, sy] = rows.fold([0.0; 5], |[count, y, yy, s, sy], (at, signal, weight)| {
                let sums = [1.0, at, at * at, signal, at * signal];
                let terms = sums.map(|term| weight * term);
                [count + terms[0], y + terms[1], yy + terms[2], s + terms[3], sy + terms[4]]
            });
            let determinant = count * yy - y * y;
            slope = (count * sy - y * s) / determinant;
            found = [(yy * s - y * sy) / determinant, (yy / determinant).sqrt()];
        }
        found
    });
    let found = Offsets { offset: lines.map(|[offset, _]| offset), error: lines.map(|[_, error]| error) };
    lines.as_flattened().iter().all(|value| value.is_finite()).then_some(found)
}

/// What Y is off by where L\* is off by [`LIGHTNESS_OFF`].
fn luminance_off(y: f64, white: f64) -> f64 {
    let off = |lightness: f64| crate::color::xyz_from_lab([lightness, 0.0, 0.0], [white; 3])[1];
    let [lightness, ..] = lab_from_xyz([y; 3], [white; 3]);
    (off(lightness + LIGHTNESS_OFF) - off(lightness - LIGHTNESS_OFF)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{xyz_from_lab, xyz_of_chromaticity};
    use crate::random::{Run, RunWords, Source};
    use nalgebra::Matrix3;

    const NEUTRALS: [f64; 6] = [95.2, 81.3, 66.9, 50.8, 35.6, 20.6];

    fn white() -> [f64; 3] {
        xyz_of_chromaticity([0.3457, 0.3585], 1.0)
    }

    /// Neutral patches whose L* are off by so much, as a camera reads them above an offset.
    fn patches(off: [f64; 6], offset: f64) -> Vec<Patch> {
        let patch = |(lightness, off): (f64, f64)| {
            let of = |lightness: f64| Vector3::from(xyz_from_lab([lightness, 0.0, 0.0], white()));
            let y = of(lightness + off).y;
            Patch {
                name: String::new(),
                signal: Vector3::new(0.5 * y, y, 0.6 * y).add_scalar(offset),
                covariance: Matrix3::from_diagonal_element(1e-10),
                reference: of(lightness),
            }
        };
        NEUTRALS.into_iter().zip(off).map(patch).collect()
    }

    #[test]
    fn offsets_are_found_as_they_are() {
        for offset in [0.0, 0.02, -0.015] {
            let found = offsets(&patches([0.0; 6], offset), white()).unwrap();
            for class in 0..3 {
                assert!((found.offset[class] - offset).abs() < 1e-9, "{found:?}");
            }
            // 0.0026 of white in all, where L* is off by 1: green reads 1 of white, red half of it.
            assert!((found.error[1] - 0.0026).abs() < 2e-4 && (found.error[0] - 0.0013).abs() < 1e-4, "{found:?}");
            assert_eq!(found.are_told(), offset != 0.0);
        }
        let three: Vec<Patch> = patches([0.0; 6], 0.1).into_iter().take(3).collect();
        let bright: Vec<Patch> = patches([0.0; 6], 0.1).into_iter().take(4).collect();
        // Four of 95 to 51 are from 0.88 to 0.19 of white; three are too few.
        assert!(offsets(&three, white()).is_none() && offsets(&bright, white()).is_some());
        let colored: Vec<Patch> = patches([0.0; 6], 0.1)
            .into_iter()
            .map(|patch| Patch { reference: Vector3::new(1.2, 1.0, 0.5).component_mul(&patch.reference), ..patch })
            .collect();
        assert!(offsets(&colored, white()).is_none());
    }

    /// Charts of one's own have no offset: of 1000, whose L* are off by 1 rms, all classes alike, 4 standard errors of a normal number are
    /// passed by 0.06 of them; light that falls off by a fifth along the row is no offset either.
    #[test]
    fn charts_of_ones_own_are_not_doubted() {
        let mut words = RunWords::default();
        let mut told = 0;
        for frame in 0..1000 {
            let run = Run { seed: 1, sensor_seed: 0, frame, place: [0, 0], classes: [0; 2], length: 128 };
            let mut normals = [0.0; 128];
            run.make_temporal(&mut words);
            run.normals(&words, Source::Ron, &mut normals);
            let off = std::array::from_fn(|patch| f64::from(normals[patch]));
            told += usize::from(offsets(&patches(off, 0.0), white()).unwrap().are_told());
        }
        assert!(told <= 1, "{told}");
        for fall in [-0.2, 0.2] {
            let mut uneven = patches([0.0; 6], 0.0);
            for (place, patch) in uneven.iter_mut().enumerate() {
                patch.signal *= 1.0 + fall * (place as f64 / 5.0 - 0.5);
            }
            let found = offsets(&uneven, white()).unwrap();
            assert!(found.offset[1].abs() < 0.009 && !found.are_told(), "{found:?}");
        }
    }
}

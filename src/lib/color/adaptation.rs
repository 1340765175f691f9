//! Chromatic adaptation: XYZ that look under one white as others do under another.

use super::{BRADFORD, xyz_of_chromaticity};
use crate::names::{Named, serde_by_name};
use nalgebra::{Matrix3, Vector3};

/// The cone responses of CAT16 \[Li2017].
const CAT16: Matrix3<f64> = Matrix3::new(
    0.401_288, 0.650_173, -0.051_461, //
    -0.250_268, 1.204_414, 0.045_854, //
    -0.002_079, 0.048_952, 0.953_127,
);

/// Cone responses by Hunt, Pointer and Estevez, equal for D65 \[Fairchild2013].
const HUNT_POINTER_ESTEVEZ: Matrix3<f64> = Matrix3::new(
    0.400_24, 0.707_60, -0.080_81, //
    -0.226_30, 1.165_32, 0.045_70, //
    0.0, 0.0, 0.918_22,
);

/// A linear transform of complete adaptation: the responses of three kinds of cones are scaled, each by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Adaptation {
    /// That of Bradford, without its exponent in blue, as ICC profiles have it \[Lam1985].
    #[default]
    Bradford,
    /// CAT16, of complete adaptation \[Li2017].
    Cat16,
    /// Von Kries, on the cones of Hunt, Pointer and Estevez.
    VonKries,
}

impl Named for Adaptation {
    const ALL: &'static [Self] = &[Self::Bradford, Self::Cat16, Self::VonKries];

    fn name(self) -> &'static str {
        match self {
            Self::Bradford => "bradford",
            Self::Cat16 => "cat16",
            Self::VonKries => "von-kries",
        }
    }
}

serde_by_name!(Adaptation);

impl Adaptation {
    /// The matrix that takes XYZ under the white `from` to those under `to`, both chromaticities; what is white keeps its
    /// luminance.
    ///
    /// C⁻¹ diag(C w′ / C w) C        C: cone responses, w and w′: the whites of Y = 1
    ///
    /// # Errors
    ///
    /// In words, where a white gives a response that is not above 0.
    pub fn between(self, from: [f64; 2], to: [f64; 2]) -> Result<Matrix3<f64>, String> {
        let cones = match self {
            Self::Bradford => BRADFORD,
            Self::Cat16 => CAT16,
            Self::VonKries => HUNT_POINTER_ESTEVEZ,
        };
        let responses = [from, to].map(|xy| cones * Vector3::from(xyz_of_chromaticity(xy, 1.0)));
        let impossible = |v: &Vector3<f64>| !v.iter().all(|response| *response > 0.0 && response.is_finite());
        if let Some(which) = responses.iter().position(impossible) {
            let [x, y] = [from, to][which];
            return Err(format!("a white of x {x:.4}, y {y:.4} is beyond what {} adapts to", self.name()));
        }
        let gains = Matrix3::from_diagonal(&responses[1].component_div(&responses[0]));
        let back = cones.try_inverse().ok_or("the cone responses are singular")?;
        Ok(back * gains * cones)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{D50_XY, D65_XY};

    /// The whites go into each other, back again it is nothing, and no change of white changes no color.
    #[test]
    fn whites_become_whites() {
        for transform in Adaptation::ALL {
            for (from, to) in [(D65_XY, D50_XY), ([0.44757, 0.40745], D65_XY), ([0.27, 0.28], [1.0 / 3.0; 2])] {
                let there = transform.between(from, to).unwrap();
                let white = there * Vector3::from(xyz_of_chromaticity(from, 1.0));
                assert!((white - Vector3::from(xyz_of_chromaticity(to, 1.0))).amax() < 1e-14);
                let back = transform.between(to, from).unwrap();
                assert!((back * there - Matrix3::identity()).amax() < 1e-13);
                assert!((transform.between(from, from).unwrap() - Matrix3::identity()).amax() < 1e-14);
            }
        }
        assert!(Adaptation::Bradford.between(D65_XY, [0.7, 0.01]).is_err());
    }

    /// The Bradford matrix from D65 to D50 as B. Lindbloom publishes it (brucelindbloom.com, Chromatic Adaptation), to seven
    /// decimals, for whites of (0.95047, 1, 1.08883) and (0.96422, 1, 0.82521). Ours are those of chromaticities of four digits:
    /// half a digit of x or y is 1.5·10⁻⁴ of X and Z, and the gains go with them.
    #[test]
    fn bradford_is_as_published() {
        let published = Matrix3::new(
            1.047_811_2,
            0.022_886_6,
            -0.050_127_0, //
            0.029_542_4,
            0.990_484_4,
            -0.017_049_1, //
            -0.009_234_5,
            0.015_043_6,
            0.752_131_6,
        );
        let xy = |[x, y, z]: [f64; 3]| [x, y].map(|value| value / (x + y + z));
        let whites = [[0.950_47, 1.0, 1.088_83], [0.964_22, 1.0, 0.825_21]].map(xy);
        let made = Adaptation::Bradford.between(whites[0], whites[1]).unwrap();
        assert!((made - published).amax() < 1e-6, "{made}");
    }
}

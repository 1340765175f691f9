//! The white by which a camera saturates.

use nalgebra::{Matrix3, Vector3};

/// The luminance of a white at which a camera saturates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Saturation {
    /// Y; not above 0 where a class has no range left.
    pub luminance: f64,
    /// Whether it is that of the white itself; else equal signals stand in.
    pub is_of_white: bool,
}

impl Saturation {
    /// That of a `white` of Y = 1, of signals that reach to `range` above black, class by class.
    ///
    /// Yₙ = minₖ rₖ / sₖ,   s = M⁻¹ w        M: XYZ from signals, w: XYZ of the white, r: the range
    ///
    /// A matrix without an inverse, or by which the white has no signal in a class, tells no such luminance: there it is Y of
    /// all classes at the end of their range, (M r)ᵧ.
    pub fn of(xyz_from_signals: &Matrix3<f64>, range: [f64; 3], white: [f64; 3]) -> Self {
        let signals = xyz_from_signals.try_inverse().map(|inverse| inverse * Vector3::from(white));
        match signals.filter(|signals| signals.iter().all(|signal| *signal > 0.0 && signal.is_finite())) {
            Some(signals) => {
                let reached = [0, 1, 2].map(|class| range[class] / signals[class]);
                Self { luminance: reached.into_iter().fold(f64::INFINITY, f64::min), is_of_white: true }
            }
            None => Self { luminance: (xyz_from_signals * Vector3::from(range)).y, is_of_white: false },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{D65_XY, White};

    /// The white of that luminance brings one class to the end of its range, and none beyond.
    #[test]
    fn the_first_class_is_full_under_that_white() {
        let xyz_from_signals = Matrix3::new(0.87, 0.045, 0.044, 0.37, 0.31, -0.026, 0.1, -0.16, 0.53);
        for range in [[3000.0; 3], [3000.0, 2500.0, 900.0]] {
            let found = Saturation::of(&xyz_from_signals, range, White::D65.xyz(1.0));
            assert!(found.is_of_white);
            let white = crate::color::xyz_of_chromaticity(D65_XY, found.luminance);
            let signals = xyz_from_signals.lu().solve(&Vector3::from(white)).unwrap();
            let shares = [0, 1, 2].map(|class| signals[class] / range[class]);
            assert!((shares.into_iter().fold(0.0, f64::max) - 1.0).abs() < 1e-12, "{shares:?}");
            // Equal signals are no D65.
            assert!(found.luminance < 0.9 * (xyz_from_signals * Vector3::from(range)).y);
        }
        let dark = Saturation::of(&xyz_from_signals, [3000.0, -1.0, 3000.0], White::D65.xyz(1.0));
        assert!(dark.luminance <= 0.0);
    }

    #[test]
    fn equal_signals_stand_in_where_a_matrix_tells_no_white() {
        let white = White::EqualEnergy.xyz(1.0);
        let without_green = Matrix3::new(1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        for xyz_from_signals in [Matrix3::repeat(1.0), without_green] {
            let found = Saturation::of(&xyz_from_signals, [100.0; 3], white);
            assert_eq!(found, Saturation { luminance: 300.0, is_of_white: false });
        }
    }
}

//! CIE 1976 L*u*v*.

use super::{LAB_STRAIGHT_BELOW, Local};
use nalgebra::{Matrix3, RowVector3};

/// X + 15 Y + 3 Z, by which u′ and v′ are divided.
const DIVISOR: RowVector3<f64> = RowVector3::new(1.0, 15.0, 3.0);

/// L* and its first and second derivatives in Y, of white Y; the straight part goes on below zero, as in L*a*b*.
fn lightness(y: f64, white: f64) -> [f64; 3] {
    let t = y / white;
    if t > LAB_STRAIGHT_BELOW {
        let root = t.cbrt();
        [116.0 * root - 16.0, 116.0 / (3.0 * root * root * white), -232.0 / (9.0 * root.powi(5) * white * white)]
    } else {
        const SLOPE: f64 = 24_389.0 / 27.0;
        [SLOPE * t, SLOPE / white, 0.0]
    }
}

/// u′ and v′; none where the divisor is not above zero.
pub(super) fn uv_prime([x, y, z]: [f64; 3]) -> Option<[f64; 2]> {
    let divisor = x + 15.0 * y + 3.0 * z;
    (divisor > 0.0).then(|| [4.0 * x / divisor, 9.0 * y / divisor])
}

/// CIE 1976 L*u*v* of XYZ about a white [CIE 015, Eqs. 8.26–8.31]; where XYZ have no chromaticity, u* = v* = 0.
pub fn luv_from_xyz(xyz: [f64; 3], white: [f64; 3]) -> [f64; 3] {
    let [lightness, ..] = lightness(xyz[1], white[1]);
    match (uv_prime(xyz), uv_prime(white)) {
        (Some([u, v]), Some([u0, v0])) => [lightness, 13.0 * lightness * (u - u0), 13.0 * lightness * (v - v0)],
        _ => [lightness, 0.0, 0.0],
    }
}

/// L*u*v* about a color; none where it has no chromaticity.
pub fn luv_about(xyz: [f64; 3], white: [f64; 3]) -> Option<Local> {
    let [l, slope, bend] = lightness(xyz[1], white[1]);
    let (here, zero) = (uv_prime(xyz)?, uv_prime(white)?);
    let divisor = DIVISOR[0] * xyz[0] + DIVISOR[1] * xyz[1] + DIVISOR[2] * xyz[2];
    let gradient_l = RowVector3::new(0.0, slope, 0.0);
    let hessian_l = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.0, bend, 0.0));
    // q = N / D: ∇q = (∇N − q ∇D)/D, and ∂ᵢⱼ = −(∂ᵢq ∂ⱼD + ∂ⱼq ∂ᵢD)/D.
    let numerators = [RowVector3::new(4.0, 0.0, 0.0), RowVector3::new(0.0, 9.0, 0.0)];
    let chroma = |k: usize| {
        let first = (numerators[k] - DIVISOR * here[k]) / divisor;
        let second = -(first.transpose() * DIVISOR + DIVISOR.transpose() * first) / divisor;
        let offset = here[k] - zero[k];
        let gradient = (gradient_l * offset + first * l) * 13.0;
        let cross = gradient_l.transpose() * first;
        let hessian = (hessian_l * offset + cross + cross.transpose() + second * l) * 13.0;
        (gradient, hessian)
    };
    let ((gradient_u, hessian_u), (gradient_v, hessian_v)) = (chroma(0), chroma(1));
    Some(Local {
        value: luv_from_xyz(xyz, white),
        jacobian: Matrix3::from_rows(&[gradient_l, gradient_u, gradient_v]),
        hessian: [hessian_l, hessian_u, hessian_v],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: D65 (95.047, 100, 108.883) has u′ = 380.188 / 1921.696 = 0.197840, v′ = 900 / 1921.696 = 0.468336. XYZ
    /// (41.24, 21.26, 1.93), the red of sRGB: D = 365.93, u′ = 0.450797, v′ = 0.522887; L* = 116 · 0.2126^⅓ − 16 = 53.2329;
    /// u* = 13 L* · 0.252957 = 175.053, v* = 13 L* · 0.054551 = 37.751.
    #[test]
    fn the_red_of_srgb_is_where_it_is_by_hand() {
        let white = [95.047, 100.0, 108.883];
        let [l, u, v] = luv_from_xyz([41.24, 21.26, 1.93], white);
        assert!((l - 53.233).abs() < 1e-3 && (u - 175.053).abs() < 2e-3 && (v - 37.751).abs() < 2e-3, "{l} {u} {v}");
        assert!(luv_from_xyz(white, white)[1..].iter().all(|c| c.abs() < 1e-12));
        assert_eq!(luv_from_xyz([-1.0, 0.0, 0.0], white), [0.0; 3]);
    }

    /// Against quotients of differences, whose error is h² times a third derivative, and roundings of 10⁻¹⁶/h².
    #[test]
    fn derivatives_are_those_of_differences() {
        let white = [0.95, 1.0, 1.09];
        for xyz in [[0.4, 0.2, 0.02], [0.1, 0.2, 0.5], [0.003, 0.004, 0.004]] {
            let local = luv_about(xyz, white).unwrap();
            let h = 1e-4 * xyz[1];
            for k in 0..3 {
                let shifted = |by: f64| {
                    let mut xyz = xyz;
                    xyz[k] += by;
                    luv_about(xyz, white).unwrap()
                };
                let (low, high) = (shifted(-h), shifted(h));
                for i in 0..3 {
                    let slope = (high.value[i] - low.value[i]) / (2.0 * h);
                    assert!((slope - local.jacobian[(i, k)]).abs() < 1e-5 * local.jacobian.amax());
                    for j in 0..3 {
                        let bend = (high.jacobian[(i, j)] - low.jacobian[(i, j)]) / (2.0 * h);
                        assert!((bend - local.hessian[i][(j, k)]).abs() < 1e-5 * local.hessian[i].amax().max(1.0));
                    }
                }
            }
        }
    }
}

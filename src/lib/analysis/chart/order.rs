//! Whether the classes of a matrix are red, green and blue in this order.

use super::fit::ChartMatrix;
use crate::color::rows_of;
use crate::error::Result;
use crate::spectrum::{Observer, WavelengthGrid};
use nalgebra::{Matrix3, SVector, Vector3};

/// By so many standard errors are classes out of order at least.
const Z: f64 = 4.0;
/// And by so many nm: red of cameras that see far into the infrared lies up to 23 nm below green in candle light.
const LEAST_NM: f64 = 25.0;

/// The mean wavelengths of R, G and B, nm, where these are not in the order B, G, R beyond what noise and misfit make.
///
/// Response of class j: Σ (M⁻¹)ⱼₖ · x̄ₖ(λ), mean λⱼ = aⱼ·μ₁ / aⱼ·μ₀        a: rows of M⁻¹, μ₀ = Σ x̄(λ), μ₁ = Σ λ x̄(λ)
///
/// A matrix holds the responses as far as the observer's curves make them up, whose scale does not count. Of 52 measured
/// cameras in 16 lights, from 1800 K to 25 000 K, none is out of order for 24 colors.
///
/// # Errors
///
/// Those of [`WavelengthGrid::points`].
pub fn out_of_order(found: &ChartMatrix, observer: &Observer) -> Result<Option<[f64; 3]>> {
    let Some(inverse) = found.xyz_from_camera.try_inverse() else { return Ok(None) };
    let (wavelengths, _) = WavelengthGrid::default().points()?;
    let moment = |power: i32| -> Vector3<f64> {
        let sum = |k: usize| wavelengths.iter().map(|nm| nm.powi(power) * observer.matching[k].at(*nm)).sum();
        Vector3::from([0, 1, 2].map(sum))
    };
    let [zeroth, first] = [0, 1].map(moment);
    let row = |class: usize| inverse.row(class).transpose();
    let mean_nm = [0, 1, 2].map(|class| row(class).dot(&first) / row(class).dot(&zeroth));
    // dM⁻¹ = −M⁻¹ dM M⁻¹
    let gradient = |class: usize| -> SVector<f64, 9> {
        let along = inverse * (first - mean_nm[class] * zeroth) / -row(class).dot(&zeroth);
        let by_element: Matrix3<f64> = row(class) * along.transpose();
        SVector::from_row_slice(rows_of(&by_element).as_flattened())
    };
    let is_out = |[longer, shorter]: [usize; 2]| {
        let gradient = gradient(longer) - gradient(shorter);
        let error = (gradient.transpose() * found.covariance * gradient).trace().sqrt();
        mean_nm[shorter] - mean_nm[longer] > LEAST_NM.max(Z * error)
    };
    Ok([[0, 1], [1, 2], [0, 2]].into_iter().any(is_out).then_some(mean_nm))
}

#[cfg(test)]
mod tests {
    use super::super::fit::{Misfit, Patch, fit};
    use super::*;
    use crate::formats::data::load_observer;

    /// Patches of a camera with this matrix whose classes come in an order.
    fn found(order: [usize; 3], noise: f64) -> ChartMatrix {
        let matrix = Matrix3::new(0.9, 0.15, 0.05, 0.35, 0.85, -0.2, 0.02, -0.15, 1.4);
        let signals = [[0.1, 0.2, 0.3], [0.2, 0.1, 0.1], [0.4, 0.1, 0.0], [0.3, 0.3, 0.5], [0.1, 0.0, 0.2]];
        let patches = signals.map(|signal| Patch {
            name: String::new(),
            signal: Vector3::from(order.map(|class| signal[class])),
            covariance: Matrix3::from_diagonal_element(noise * noise),
            reference: matrix * Vector3::from(signal),
        });
        fit(&patches, Misfit::None).unwrap()
    }

    #[test]
    fn classes_that_are_exchanged_are_told() {
        let observer = load_observer().unwrap();
        let told = |order, noise| out_of_order(&found(order, noise), &observer).unwrap();
        assert_eq!(told([0, 1, 2], 1e-4), None);
        let [red, green, blue] = told([2, 1, 0], 1e-4).unwrap();
        assert!(red < green - 50.0 && green < blue - 30.0, "{red} {green} {blue}");
        for order in [[1, 0, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1]] {
            assert!(told(order, 1e-4).is_some(), "{order:?}");
        }
        // Of a matrix that is as uncertain as it is large nothing follows.
        let mut unsure = found([2, 1, 0], 1e-4);
        unsure.covariance *= 1e8;
        assert_eq!(out_of_order(&unsure, &observer).unwrap(), None);
    }

    /// What all elements are multiplied with, the scale of the signals, does not count.
    #[test]
    fn the_scale_of_signals_does_not_count() {
        let observer = load_observer().unwrap();
        let means = |scale: f64| {
            let mut found = found([2, 1, 0], 1e-4);
            found.xyz_from_camera *= scale;
            out_of_order(&found, &observer).unwrap().unwrap()
        };
        for (one, other) in means(1.0).into_iter().zip(means(3.0)) {
            assert!((one - other).abs() < 1e-9, "{one} {other}");
        }
    }
}

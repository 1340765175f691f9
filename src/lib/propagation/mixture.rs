//! The law of what is one of several laws.

use super::moments::Prediction;

/// Moments 2 to 6 about the mean from cumulants, the fifth taken as none.
fn central(prediction: &Prediction) -> [f64; 5] {
    let (k2, k3, k4) = (prediction.moments.variance, prediction.third, prediction.fourth());
    let sixth = prediction.sixth + 15.0 * k4 * k2 + 10.0 * k3 * k3 + 15.0 * k2.powi(3);
    [k2, k3, k4 + 3.0 * k2 * k2, 10.0 * k3 * k2, sixth]
}

/// The law of a variable that has each of these with its weight.
pub(super) fn mixture(parts: &[(f64, Prediction)]) -> Prediction {
    let mean: f64 = parts.iter().map(|(weight, part)| weight * part.moments.mean).sum();
    let mut sums = [0.0; 5];
    for (weight, part) in parts {
        let d = part.moments.mean - mean;
        let [m2, m3, m4, m5, m6] = central(part);
        let about = [
            m2 + d * d,
            m3 + 3.0 * d * m2 + d.powi(3),
            m4 + 4.0 * d * m3 + 6.0 * d * d * m2 + d.powi(4),
            m5 + 5.0 * d * m4 + 10.0 * d * d * m3 + 10.0 * d.powi(3) * m2 + d.powi(5),
            m6 + 6.0 * d * m5 + 15.0 * d * d * m4 + 20.0 * d.powi(3) * m3 + 15.0 * d.powi(4) * m2 + d.powi(6),
        ];
        sums.iter_mut().zip(about).for_each(|(sum, moment)| *sum += weight * moment);
    }
    let [m2, m3, m4, _, m6] = sums;
    let sixth = m6 - 15.0 * m4 * m2 - 10.0 * m3 * m3 + 30.0 * m2.powi(3);
    Prediction { sixth, ..Prediction::of_cumulants(mean, m2, m3, m4 - 3.0 * m2 * m2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two values of a coin, by hand: variance 1, fourth cumulant −2, sixth 16.
    #[test]
    fn mixtures_have_the_cumulants_of_their_law() {
        let at = |mean: f64| Prediction::of_cumulants(mean, 0.0, 0.0, 0.0);
        let coin = mixture(&[(0.5, at(3.0)), (0.5, at(5.0))]);
        assert_eq!((coin.moments.mean, coin.moments.variance, coin.third, coin.fourth()), (4.0, 1.0, 0.0, -2.0));
        assert!((coin.sixth - 16.0).abs() < 1e-12);
    }
}

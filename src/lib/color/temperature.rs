//! Correlated color temperature.

use super::locus::planckian;
use crate::spectrum::Observer;

/// Reciprocal temperatures that are searched, MK⁻¹: 10⁶ K to 1000 K.
const RECIPROCAL: [f64; 2] = [1.0, 1000.0];

/// A megakelvin in K.
const K_PER_MK: f64 = 1e6;

/// The distance from black bodies up to which a correlated color temperature has a meaning \[CIE 015].
pub const LARGEST_DISTANCE: f64 = 0.05;

/// The black body that is nearest to a color.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correlated {
    /// Its temperature, 1000 K to 10⁶ K.
    pub temperature_k: f64,
    /// How far the color is from it in u′ and ⅔ v′.
    pub distance: f64,
}

/// CIE 1960 u, v, which are u′ and ⅔ v′ of 1976.
fn uv([x, y]: [f64; 2]) -> [f64; 2] {
    [4.0 * x, 6.0 * y].map(|value| value / (12.0 * y - 2.0 * x + 3.0))
}

/// The correlated color temperature of a chromaticity: that of the black body nearest to it in u′, ⅔ v′ \[CIE 015].
///
/// Found by golden sections of the reciprocal temperature, to some 10⁻⁶ of it; the black bodies are those of [`planckian`], with
/// the constants of the SI of 2019, no table of isotherms. A table such as Robertson's is off by up to a few K.
/// Colors that are farther than [`LARGEST_DISTANCE`] have a nearest black body too, but none that says much.
pub fn correlated(observer: &Observer, xy: [f64; 2]) -> Correlated {
    let [u, v] = uv(xy);
    let distance = |reciprocal: f64| {
        let [u_body, v_body] = uv(planckian(observer, K_PER_MK / reciprocal));
        f64::hypot(u - u_body, v - v_body)
    };
    let share = (f64::sqrt(5.0) - 1.0) / 2.0;
    let [mut low, mut high] = RECIPROCAL;
    let inner = |low: f64, high: f64| [high - share * (high - low), low + share * (high - low)];
    let [mut a, mut b] = inner(low, high);
    let [mut at_a, mut at_b] = [distance(a), distance(b)];
    while high - low > 1e-6 * high {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = inner(low, high)[0];
            at_a = distance(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = inner(low, high)[1];
            at_b = distance(b);
        }
    }
    Correlated { temperature_k: K_PER_MK / a.midpoint(b), distance: at_a.min(at_b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::data::load_observer;

    /// [CIE 015, Table 11.1]: x, y to five digits and K to whole ones. Half a digit of x and y is 0.6 K at 6500 K, 0.8 K at
    /// 7500 K, and as much again are the digits of K.
    #[test]
    fn illuminants_have_the_published_temperatures() {
        let observer = load_observer().unwrap();
        for (xy, temperature_k) in [
            ([0.44758, 0.40745], 2856.0),
            ([0.34567, 0.35851], 5003.0),
            ([0.33243, 0.34744], 5503.0),
            ([0.31272, 0.32903], 6504.0),
            ([0.29903, 0.31488], 7504.0),
        ] {
            let found = correlated(&observer, xy);
            assert!((found.temperature_k - temperature_k).abs() < 1.5, "{found:?}, not {temperature_k}");
        }
        // Equal energy lies 0.0044 below 5455 K.
        let equal = correlated(&observer, [1.0 / 3.0; 2]);
        assert!((equal.temperature_k - 5455.0).abs() < 1.5 && (equal.distance - 0.0044).abs() < 5e-5, "{equal:?}");
    }

    /// To the width of the last section, 10⁻⁶ of the reciprocal; u and v change by at most 5·10⁻⁴ per MK⁻¹, so that the distance is
    /// below 5·10⁻⁷.
    #[test]
    fn black_bodies_have_their_own_temperature() {
        let observer = load_observer().unwrap();
        for temperature_k in [1200.0, 2000.0, 2856.0, 5000.0, 12_000.0, 40_000.0] {
            let found = correlated(&observer, planckian(&observer, temperature_k));
            assert!((found.temperature_k / temperature_k - 1.0).abs() < 1e-6, "{found:?}, not {temperature_k}");
            assert!(found.distance < 5e-7);
        }
    }
}

//! Correlated color temperature.

use super::locus::planckian;
use crate::spectrum::Observer;
use nalgebra::{Matrix2, Matrix2x3, Vector2};

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

/// The same, in K, with Duv: the distance, above zero where v is larger than the black body's \[Ohno2014].
pub fn temperature_and_duv(observer: &Observer, xy: [f64; 2]) -> [f64; 2] {
    let Correlated { temperature_k, distance } = correlated(observer, xy);
    let [body, own] = [planckian(observer, temperature_k), xy].map(|xy| uv(xy)[1]);
    [temperature_k, if own < body { -distance } else { distance }]
}

/// Reciprocal temperatures of the table, MK⁻¹: one apart, 10⁶ K to 1000 K.
const ENTRIES: usize = 1000;

/// Black bodies from 10⁶ K to 1000 K by their u and v of 1960: correlated color temperatures of many colors.
///
/// Between neighbors, 1 MK⁻¹ apart, the locus is taken for the parabola through three of them: temperatures differ from those
/// of [`correlated`] by less than 5·10⁻⁵ of them up to 25 000 K, by less than 10⁻⁵ up to 10 000 K, where the color is no farther
/// than [`LARGEST_DISTANCE`].
#[derive(Debug, Clone, PartialEq)]
pub struct Locus {
    uv: Vec<Vector2<f64>>,
}

/// A color beside the black bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BesideLocus {
    /// Correlated color temperature, K.
    pub temperature_k: f64,
    /// Duv: the distance from the black body in u and v, above zero where v is larger than the body's \[Ohno2014].
    pub duv: f64,
    /// Derivatives of both: rows temperature and Duv, columns X, Y, Z.
    pub jacobian: Matrix2x3<f64>,
}

impl Locus {
    /// That of an observer.
    pub fn new(observer: &Observer) -> Self {
        let body = |reciprocal: usize| Vector2::from(uv(planckian(observer, K_PER_MK / reciprocal as f64)));
        Self { uv: (1..=ENTRIES).map(body).collect() }
    }

    /// The nearest black body of XYZ; none of colors without a chromaticity, farther than [`LARGEST_DISTANCE`], or whose nearest
    /// is an end of the table.
    pub fn beside(&self, [x, y, z]: [f64; 3]) -> Option<BesideLocus> {
        let divisor = x + 15.0 * y + 3.0 * z;
        if !(divisor > 0.0 && divisor.is_finite()) {
            return None;
        }
        let color = Vector2::new(4.0 * x, 6.0 * y) / divisor;
        let squared = |place: usize| (color - self.uv[place]).norm_squared();
        let nearest = (1..ENTRIES - 1).min_by(|a, b| squared(*a).total_cmp(&squared(*b)))?;
        let [before, at, after] = [nearest - 1, nearest, nearest + 1].map(|place| self.uv[place]);
        let (half_first, half_second) = ((after - before) / 2.0, (after + before) / 2.0 - at);
        let body = |s: f64| at + half_first * s + half_second * (s * s);
        let tangent = |s: f64| half_first + half_second * (2.0 * s);
        let mut s = 0.0;
        for _ in 0..NEWTON_STEPS {
            let (offset, tangent) = (color - body(s), tangent(s));
            s += offset.dot(&tangent) / (tangent.norm_squared() - 2.0 * offset.dot(&half_second));
        }
        // At the ends of the table the nearest body lies beyond it.
        if !(-1.0..=1.0).contains(&s) {
            return None;
        }
        let (offset, tangent) = (color - body(s), tangent(s));
        // Across the locus, towards larger v.
        let along = if tangent.x > 0.0 { tangent } else { -tangent }.normalize();
        let across = Vector2::new(-along.y, along.x);
        let duv = offset.dot(&across);
        if !(-LARGEST_DISTANCE..=LARGEST_DISTANCE).contains(&duv) {
            return None;
        }
        let reciprocal = (nearest + 1) as f64 + s;
        let bend = tangent.norm_squared() - 2.0 * offset.dot(&half_second);
        let of_uv = Matrix2::from_rows(&[
            (tangent * (-K_PER_MK / (reciprocal * reciprocal) / bend)).transpose(),
            across.transpose(),
        ]);
        let of_xyz = Matrix2x3::new(
            4.0 - color.x,
            -15.0 * color.x,
            -3.0 * color.x, //
            -color.y,
            6.0 - 15.0 * color.y,
            -3.0 * color.y,
        ) / divisor;
        Some(BesideLocus { temperature_k: K_PER_MK / reciprocal, duv, jacobian: of_uv * of_xyz })
    }
}

/// Steps of Newton from the nearest entry, each of which squares an error that begins below ½.
const NEWTON_STEPS: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::xyz_of_chromaticity;
    use crate::formats::data::load_observer;

    /// u and v of 1960 as x and y.
    fn xy([u, v]: [f64; 2]) -> [f64; 2] {
        [3.0 * u, 2.0 * v].map(|value| value / (2.0 * u - 8.0 * v + 4.0))
    }

    /// The table against the search, on both sides of the locus; and the sign of Duv: D65 lies 0.0032 above, E 0.0044 below.
    #[test]
    fn the_table_finds_what_the_search_finds() {
        let observer = load_observer().unwrap();
        let locus = Locus::new(&observer);
        for temperature_k in [1100.0, 1503.2, 2000.0, 2856.0, 5003.0, 6504.0, 9999.0, 25_000.0] {
            let on = uv(planckian(&observer, temperature_k));
            let beside = uv(planckian(&observer, temperature_k * 1.001));
            let along = Vector2::from(on) - Vector2::from(beside);
            let across = Vector2::new(-along.y, along.x).normalize() * along.x.signum();
            for duv in [-0.045, -0.02, 0.0, 0.003, 0.02, 0.045] {
                let at = xy((Vector2::from(on) + across * duv).into());
                let found = locus.beside(xyz_of_chromaticity(at, 70.0)).unwrap();
                let searched = correlated(&observer, at);
                let share = found.temperature_k / searched.temperature_k - 1.0;
                let most = if temperature_k > 1e4 { 5e-5 } else { 1e-5 };
                assert!(share.abs() < most, "{temperature_k} K, {duv}: {found:?}, not {searched:?}");
                assert!((found.duv.abs() - searched.distance).abs() < 1e-7 && (found.duv - duv).abs() < 2e-5);
            }
        }
        let duv = |xy| locus.beside(xyz_of_chromaticity(xy, 1.0)).unwrap().duv;
        assert!((duv([0.31272, 0.32903]) - 0.0032).abs() < 5e-5 && (duv([1.0 / 3.0; 2]) + 0.0044).abs() < 5e-5);
        // Beyond the range, and where there is no chromaticity.
        let far = [[0.2, 0.7], [0.7, 0.29], [0.15, 0.06]].map(|xy| locus.beside(xyz_of_chromaticity(xy, 1.0)));
        assert_eq!((far, locus.beside([0.0; 3]), locus.beside([f64::NAN; 3])), ([None; 3], None, None));
    }

    /// Against quotients of differences.
    #[test]
    fn derivatives_are_those_of_differences() {
        let locus = Locus::new(&load_observer().unwrap());
        for xyz in [[95.0, 100.0, 108.0], [110.0, 100.0, 36.0], [0.9, 1.0, 1.6]] {
            let found = locus.beside(xyz).unwrap();
            for k in 0..3 {
                let h = 1e-5 * xyz[1];
                let shifted = |by: f64| {
                    let mut xyz = xyz;
                    xyz[k] += by;
                    locus.beside(xyz).unwrap()
                };
                let (low, high) = (shifted(-h), shifted(h));
                let slopes = [high.temperature_k - low.temperature_k, high.duv - low.duv].map(|d| d / (2.0 * h));
                for (row, slope) in slopes.into_iter().enumerate() {
                    let largest = found.jacobian.row(row).amax();
                    assert!((slope - found.jacobian[(row, k)]).abs() < 1e-3 * largest, "{xyz:?} {row} {k}");
                }
            }
        }
    }

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

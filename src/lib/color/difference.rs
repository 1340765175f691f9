//! Color differences in L*a*b*: ΔE*ab, just noticeable differences, ΔE94, ΔE2000; and how they are distributed.

use crate::numerics::distribution::{Distribution, Summary};
use serde::{Deserialize, Serialize};

/// ΔE*ab of a just noticeable difference [HP2005, Sec. 4.1].
pub const DELTA_E_PER_JND: f64 = 2.3;

/// The differences of two colors, by each formula.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// CIE 1976 ΔE*ab, the distance in L*a*b*.
    pub delta_e_76: f64,
    /// CIE 1994.
    pub delta_e_94: f64,
    /// CIEDE2000.
    pub delta_e_2000: f64,
}

impl Difference {
    /// The differences of a color from a reference, both L*a*b*; all NaN where one of them is not finite.
    pub fn between(reference: [f64; 3], color: [f64; 3]) -> Self {
        let [delta_e_76, delta_e_94, delta_e_2000] =
            [delta_e_76, delta_e_94, delta_e_2000].map(|by: fn([f64; 3], [f64; 3]) -> f64| by(reference, color));
        if [delta_e_76, delta_e_94, delta_e_2000].iter().all(|value| value.is_finite()) {
            Self { delta_e_76, delta_e_94, delta_e_2000 }
        } else {
            Self { delta_e_76: f64::NAN, delta_e_94: f64::NAN, delta_e_2000: f64::NAN }
        }
    }

    /// ΔE*ab in just noticeable differences.
    pub fn jnd(&self) -> f64 {
        self.delta_e_76 / DELTA_E_PER_JND
    }
}

/// CIE 1976 difference [CIE 015, Eq. 8.18]: the distance of two colors in L*a*b*.
pub fn delta_e_76(reference: [f64; 3], color: [f64; 3]) -> f64 {
    [0, 1, 2].map(|i| (color[i] - reference[i]).powi(2)).iter().sum::<f64>().sqrt()
}

/// CIE 1994 difference of a color from a reference under reference conditions, k_L = k_C = k_H = 1 \[CIE116].
///
/// √(ΔL² + (ΔC / (1 + 0.045 C₁))² + (ΔH / (1 + 0.015 C₁))²), C₁ the chroma of the reference: the formula is not
/// symmetric.
pub fn delta_e_94(reference: [f64; 3], color: [f64; 3]) -> f64 {
    let chroma = reference[1].hypot(reference[2]);
    let lightness = color[0] - reference[0];
    let in_chroma = color[1].hypot(color[2]) - chroma;
    let in_plane = (color[1] - reference[1]).powi(2) + (color[2] - reference[2]).powi(2);
    // Rounding may leave ΔH² a little below zero where hues agree.
    let hue_squared = (in_plane - in_chroma * in_chroma).max(0.0);
    let hue_weight = 1.0 + 0.015 * chroma;
    let weighted_chroma = in_chroma / (1.0 + 0.045 * chroma);
    (lightness * lightness + weighted_chroma * weighted_chroma + hue_squared / (hue_weight * hue_weight)).sqrt()
}

/// CIEDE2000 difference, k_L = k_C = k_H = 1, as \[Sharma2005, Eqs. 2–22] works it out.
///
/// # Examples
///
/// ```
/// use cyanometer::color::difference::delta_e_2000;
///
/// // The first of the pairs that Sharma, Wu and Dalal published.
/// let difference = delta_e_2000([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485]);
/// assert!((difference - 2.0425).abs() < 5e-5);
/// ```
pub fn delta_e_2000(reference: [f64; 3], color: [f64; 3]) -> f64 {
    const POW25_7: f64 = 6_103_515_625.0;
    let [l1, a1, b1] = reference;
    let [l2, a2, b2] = color;
    let saturating = |chroma: f64| (chroma.powi(7) / (chroma.powi(7) + POW25_7)).sqrt();
    let g = 0.5 * (1.0 - saturating(0.5 * (a1.hypot(b1) + a2.hypot(b2))));
    let primed = |a: f64, b: f64| {
        let a = (1.0 + g) * a;
        let hue = if a == 0.0 && b == 0.0 { 0.0 } else { b.atan2(a).to_degrees().rem_euclid(360.0) };
        (a.hypot(b), hue)
    };
    let ((c1, h1), (c2, h2)) = (primed(a1, b1), primed(a2, b2));
    let (sum, turn) = (h1 + h2, h2 - h1);
    let (hue_difference, mean_hue) = if c1 * c2 == 0.0 {
        (0.0, sum)
    } else if turn.abs() <= 180.0 {
        (turn, 0.5 * sum)
    } else {
        let shorter = if turn > 0.0 { turn - 360.0 } else { turn + 360.0 };
        (shorter, if sum < 360.0 { 0.5 * (sum + 360.0) } else { 0.5 * (sum - 360.0) })
    };
    let in_hue = 2.0 * (c1 * c2).sqrt() * (0.5 * hue_difference).to_radians().sin();
    let (lightness, chroma) = (0.5 * (l1 + l2), 0.5 * (c1 + c2));
    let cosine = |factor: f64, shift: f64| (factor * mean_hue + shift).to_radians().cos();
    let t =
        1.0 - 0.17 * cosine(1.0, -30.0) + 0.24 * cosine(2.0, 0.0) + 0.32 * cosine(3.0, 6.0) - 0.20 * cosine(4.0, -63.0);
    let from_middle = (lightness - 50.0).powi(2);
    let for_lightness = (l2 - l1) / (1.0 + 0.015 * from_middle / (20.0 + from_middle).sqrt());
    let for_chroma = (c2 - c1) / (1.0 + 0.045 * chroma);
    let for_hue = in_hue / (1.0 + 0.015 * chroma * t);
    let rotation_angle = 60.0 * (-((mean_hue - 275.0) / 25.0).powi(2)).exp();
    let rotation = -rotation_angle.to_radians().sin() * 2.0 * saturating(chroma);
    let squared = for_lightness.powi(2) + for_chroma.powi(2) + for_hue.powi(2) + rotation * for_chroma * for_hue;
    // Rounding may leave the square of no difference a little below zero; NaN stays.
    if squared < 0.0 { 0.0 } else { squared.sqrt() }
}

/// Differences of many pairs of colors.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Differences {
    by_formula: [Distribution; 3],
}

/// How differences by one formula are distributed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DifferenceSummary {
    /// Smallest, mean, median, 95th percentile, largest.
    #[serde(flatten)]
    pub summary: Summary,
    /// Share of the pairs whose difference is below 1/10.
    pub below_tenth: f64,
    /// Below 1/4.
    pub below_quarter: f64,
    /// Below 1/2.
    pub below_half: f64,
}

/// What is said of the differences of many pairs of colors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DifferenceReport {
    /// ΔE*ab.
    pub delta_e_76: DifferenceSummary,
    /// ΔE*ab in just noticeable differences.
    pub jnd: DifferenceSummary,
    /// ΔE94.
    pub delta_e_94: DifferenceSummary,
    /// ΔE2000.
    pub delta_e_2000: DifferenceSummary,
}

impl DifferenceReport {
    /// The four formulas, each with its name.
    pub fn formulas(&self) -> [(&'static str, DifferenceSummary); 4] {
        [
            ("delta_e_76", self.delta_e_76),
            ("jnd", self.jnd),
            ("delta_e_94", self.delta_e_94),
            ("delta_e_2000", self.delta_e_2000),
        ]
    }
}

impl Differences {
    /// The distribution of `differences`.
    pub fn of<'a>(differences: impl IntoIterator<Item = &'a Difference>) -> Self {
        let differences: Vec<Difference> = differences.into_iter().copied().collect();
        let mut made = Self::default();
        made.add(&differences);
        made
    }

    /// Takes in differences.
    pub fn add(&mut self, differences: &[Difference]) {
        let [first, second, third] = &mut self.by_formula;
        first.add(differences.iter().map(|difference| difference.delta_e_76));
        second.add(differences.iter().map(|difference| difference.delta_e_94));
        third.add(differences.iter().map(|difference| difference.delta_e_2000));
    }

    /// Pairs seen whose differences are finite.
    pub fn count(&self) -> u64 {
        self.by_formula[0].count()
    }

    /// Pairs left out because a color was NaN or infinite.
    pub fn not_finite(&self) -> u64 {
        self.by_formula[0].not_finite()
    }

    /// Statistics by each formula; none of no pairs.
    pub fn report(&self) -> Option<DifferenceReport> {
        let summary = |distribution: &Distribution, unit: f64| {
            let Summary { min, mean, median, p95, max } = distribution.summary()?;
            let summary =
                Summary { min: min / unit, mean: mean / unit, median: median / unit, p95: p95 / unit, max: max / unit };
            let below = |limit: f64| distribution.share_below(limit * unit);
            Some(DifferenceSummary {
                summary,
                below_tenth: below(0.1),
                below_quarter: below(0.25),
                below_half: below(0.5),
            })
        };
        let [first, second, third] = &self.by_formula;
        Some(DifferenceReport {
            delta_e_76: summary(first, 1.0)?,
            jnd: summary(first, DELTA_E_PER_JND)?,
            delta_e_94: summary(second, 1.0)?,
            delta_e_2000: summary(third, 1.0)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_pairs_have_their_ciede2000_difference_both_ways() {
        let table = include_str!("../../../tests/reference/ciede2000.csv");
        let rows: Vec<Vec<f64>> =
            table.lines().skip(2).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
        assert_eq!(rows.len(), 34);
        for row in rows {
            let (first, second) = ([row[0], row[1], row[2]], [row[3], row[4], row[5]]);
            // The table has four decimals.
            assert!((delta_e_2000(first, second) - row[6]).abs() <= 0.5e-4 + 1e-9, "{row:?}");
            // Hues that differ by 180° make the mean hue ambiguous by rounding; the tenth and fourteenth pairs do.
            assert!((delta_e_2000(first, second) - delta_e_2000(second, first)).abs() < 1e-9, "{row:?}");
        }
    }

    /// By hand: a reference of chroma 50 has S_C = 3.25 and S_H = 1.75. A change in lightness counts once, one in chroma
    /// 1/3.25, and one in hue alone (a turn from 3-4-5 to 4-3-5) 1/1.75 of its length √2 · 10.
    #[test]
    fn the_1994_difference_weighs_chroma_and_hue_by_the_reference() {
        let reference = [60.0, 30.0, 40.0];
        assert!((delta_e_94(reference, [57.5, 30.0, 40.0]) - 2.5).abs() < 1e-12);
        assert!((delta_e_94(reference, [60.0, 33.0, 44.0]) - 5.0 / 3.25).abs() < 1e-12);
        assert!((delta_e_94(reference, [60.0, 40.0, 30.0]) - 200f64.sqrt() / 1.75).abs() < 1e-12);
        // From gray all weights are one.
        assert!((delta_e_94([50.0, 0.0, 0.0], [50.0, 3.0, 4.0]) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn equal_colors_do_not_differ() {
        for color in [[0.0; 3], [50.0, 0.0, 0.0], [100.0, -128.0, 127.0], [-3.0, 1e-9, -1e-9]] {
            let none = Difference::between(color, color);
            assert_eq!((none.delta_e_76, none.delta_e_94, none.delta_e_2000), (0.0, 0.0, 0.0));
        }
    }

    #[test]
    fn what_is_not_finite_has_no_difference_by_any_formula() {
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
            for place in 0..3 {
                let mut color = [50.0, 10.0, 10.0];
                color[place] = wrong;
                for pair in [(color, [50.0, 0.0, 0.0]), ([50.0, 0.0, 0.0], color), (color, color)] {
                    let none = Difference::between(pair.0, pair.1);
                    let all = [none.delta_e_76, none.delta_e_94, none.delta_e_2000, none.jnd()];
                    let is_same = wrong.is_finite() && place == 0 && pair.0 == pair.1;
                    assert!(is_same || all.iter().all(|value| value.is_nan()), "{pair:?} {all:?}");
                }
            }
        }
    }

    #[test]
    fn jnd_are_shares_of_2_3() {
        let colors = [0.115, 0.46, 1.0, 2.3].map(|l| Difference::between([50.0, 0.0, 0.0], [50.0 + l, 0.0, 0.0]));
        let report = Differences::of(&colors).report().unwrap();
        assert!((report.jnd.summary.max - 1.0).abs() < 1e-9);
        assert_eq!([report.jnd.below_tenth, report.jnd.below_quarter, report.jnd.below_half], [0.25, 0.5, 0.75]);
        assert_eq!(report.delta_e_76.below_half, 0.5);
    }
}

//! Amplitudes of hot photosites and of jumps, exponential numbers: the places and weights that sums over them take.

use crate::numerics::gauss::{NODES, laguerre, panel};
use crate::numerics::rounding::SMOOTH;
use std::sync::LazyLock;

/// Excesses beyond which nothing counts, in units of their mean: e⁻⁴⁰ is 4·10⁻¹⁸.
pub(super) const REACH: f64 = 40.0;

/// Values of what photosites differ in that are gone through at most.
const MOST_NODES: usize = 6000;

/// Where what is read bends, over what width, and how many widths off nothing is left of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knee {
    pub at: f64,
    pub width: f64,
    pub reach: f64,
}

/// Rounding that shows: the distance from code to code, how far it does, and what blurs it: a standard deviation, and how its
/// square grows with the excess.
#[derive(Debug, Clone, Copy)]
pub(super) struct Codes {
    pub period: f64,
    pub until: f64,
    pub blur: f64,
    pub shot: f64,
}

impl Codes {
    /// The width of a panel at a place: half a code, or what blurs codes to no finer ripples than a rule follows. Of the ripple of m
    /// turns to a code e^(−2π²m²σ²) is left, σ in codes, and 12 nodes on a panel of w codes sum it to 10⁻⁹ while π m w < 8.
    fn panel(&self, place: f64) -> f64 {
        let blur = (self.blur * self.blur + self.shot * place).sqrt();
        (1.6 * blur).max(0.5 * self.period)
    }

    /// Both.
    pub fn finer(self, other: Self) -> Self {
        Self {
            period: self.period.min(other.period),
            until: self.until.max(other.until),
            blur: self.blur.min(other.blur),
            shot: self.shot.min(other.shot),
        }
    }

    /// The ends of its panels; none of too many.
    fn ends(&self) -> Option<Vec<f64>> {
        let mut ends = Vec::new();
        let mut end = 0.0;
        while end < self.until.min(REACH) {
            if ends.len() * NODES > MOST_NODES {
                return None;
            }
            ends.push(end);
            end += self.panel(end);
        }
        Some(ends)
    }
}

/// Excesses beyond which all together are less than 2·10⁻⁷ of the variance, where their square is `share` of that of the others: with
/// ∫ t² e^(−t) dt from r on = (r² + 2r + 2) e^(−r).
pub(super) fn telling(share: f64) -> f64 {
    const NEGLIGIBLE: f64 = 2e-7;
    let is_beyond = |r: f64| share * (r * r + 2.0 * r + 2.0) * (-r).exp() < NEGLIGIBLE * (1.0 + 2.0 * share);
    (0_u32..).map(f64::from).take_while(|r| *r < REACH).find(|r| is_beyond(*r)).unwrap_or(REACH)
}

/// The standard deviation of what blurs codes, in codes, from which such a share of the photosites shows nothing of how they are
/// rounded: of the ripple, e^(−2π²σ²), it leaves less than 10⁻¹⁰ of a code.
pub(super) fn smooth_for(share: f64) -> f64 {
    const LEFT: f64 = 1e-10;
    let two_pi_squares = 2.0 * std::f64::consts::PI * std::f64::consts::PI;
    ((share / LEFT).ln().max(0.0) / two_pi_squares).sqrt().min(SMOOTH)
}
/// Places and weights of an exponential number of mean 1 for a function that bends at `knees`; none of too many.
pub(super) fn nodes(knees: &[Knee], codes: Option<Codes>) -> Option<Vec<(f64, f64)>> {
    static SMOOTH_NODES: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| laguerre(10));
    // e^(−t) grows by the panel: on each of these 12 nodes sum it to 10⁻¹³ of the whole.
    const WIDEST: [f64; 5] = [0.0, 4.0, 10.0, 20.0, REACH];
    const NARROWEST: f64 = 1e-4;
    // Of a bend as wide as w means the twentieth derivative is below √19!/w²⁰, and ten nodes are off by (10!)²/20! times that: 2·10⁻¹¹.
    const SMOOTH_WIDTH: f64 = 5.0;
    let is_near =
        |knee: &&Knee| knee.width < SMOOTH_WIDTH && knee.at < REACH + 12.0 * knee.width && knee.at > -12.0 * knee.width;
    let near: Vec<&Knee> = knees.iter().filter(is_near).collect();
    if near.is_empty() && codes.is_none() {
        return Some(SMOOTH_NODES.clone());
    }
    let mut ends = WIDEST.to_vec();
    for knee in near {
        // A step has nodes of its own to either side; of a bend 12 nodes follow five widths to 10⁻¹⁰.
        ends.extend((knee.width < NARROWEST).then_some(knee.at));
        let width = knee.width.max(NARROWEST);
        let mut distance = 2.5 * width;
        while distance < REACH.min(knee.reach * width) {
            ends.extend([knee.at - distance, knee.at + distance]);
            distance *= 3.0;
        }
    }
    if let Some(codes) = codes {
        ends.extend(codes.ends()?);
    }
    ends.retain(|end| (0.0..=REACH).contains(end));
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|next, kept| *next - *kept < 1e-7);
    let of_panel =
        |pair: &[f64]| panel(pair[0], pair[1]).map(|(t, weight)| (t, weight * (-t).exp())).collect::<Vec<_>>();
    let mut found: Vec<(f64, f64)> = ends.windows(2).flat_map(of_panel).collect();
    found.retain(|(_, weight)| *weight > 1e-13);
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n! for moments; e^(−a t) for what is no polynomial, with knees and codes alike.
    #[test]
    fn nodes_integrate_exponential_numbers() {
        let knee = |at: f64, width: f64| Knee { at, width, reach: 9.0 };
        let cases = [
            (vec![], None),
            (vec![knee(0.7, 0.01), knee(-0.1, 0.2), knee(30.0, 2.0)], None),
            (vec![knee(2.0, 0.3)], Some(Codes { period: 0.3, until: 12.0, blur: 0.0, shot: 0.0 })),
        ];
        for (knees, codes) in cases {
            let found = nodes(&knees, codes).unwrap();
            let mean = |f: &dyn Fn(f64) -> f64| found.iter().map(|(t, weight)| weight * f(*t)).sum::<f64>();
            let mut factorial = 1.0;
            for power in 1..=8 {
                factorial *= f64::from(power);
                // Beyond 32, weights of 10⁻¹⁴, there is 32⁸ e⁻³² of 8!, 4·10⁻⁷ and less, and panels are good to as much.
                let allowed = if power < 3 { 1e-9 } else { 1e-4 };
                assert!((mean(&|t| t.powi(power)) / factorial - 1.0).abs() < allowed, "{power}");
            }
            assert!((mean(&|t| (-0.2 * t).exp()) - 1.0 / 1.2).abs() < 1e-9);
        }
        assert!(nodes(&[], Some(Codes { period: 1e-3, until: f64::INFINITY, blur: 0.0, shot: 0.0 })).is_none());
    }

    /// Ripples of m turns to a code, of which blur leaves e^(−2π²m²σ²): ∫ e^(−t) cos(ω t) dt = 1/(1 + ω²).
    #[test]
    fn panels_follow_the_ripples_that_blur_leaves() {
        for (blur, shot) in [(0.0, 0.0), (0.3, 0.0), (1.2, 0.0), (0.1, 1.0 / 6.0)] {
            let period = 0.5;
            let codes = Codes { period, until: REACH, blur: blur * period, shot: shot * period };
            let found = nodes(&[], Some(codes)).unwrap();
            for turns in [1.0, 2.0, 3.0] {
                let turn = std::f64::consts::TAU * turns / period;
                // Shot noise blurs by e^(−s t).
                let [still, by_place] = [codes.blur.powi(2), codes.shot].map(|square| 0.5 * turn * turn * square);
                let ripple = |t: f64| (-still - by_place * t).exp() * (turn * t).cos();
                let sum: f64 = found.iter().map(|(t, weight)| weight * ripple(*t)).sum();
                let rate = 1.0 + by_place;
                let expected = (-still).exp() * rate / (rate * rate + turn * turn);
                // The ripple of m turns of a mean is 1/(π m) of a code: it moves by less than 10⁻⁹ of one.
                assert!((sum - expected).abs() < 1e-9, "{blur} {shot} {turns}: {sum} {expected}");
            }
        }
    }
}

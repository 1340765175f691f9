//! Amplitudes of hot photosites and of jumps, exponential numbers: the places and weights that sums over them take.

use crate::metadata::AdcRecord;
use crate::numerics::gauss::{NODES, few, fewest, laguerre, panel};
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

/// The ripple of one number of turns to a code that rounding gives to the mean of photosites by their excess t, which moves the mean
/// over photosites by e^(left − decay t) times what counts.
#[derive(Debug, Clone, Copy)]
struct Ripple {
    left: f64,
    decay: f64,
    /// How fast it changes with the excess, at most.
    rate: f64,
}

/// Rounding that shows in what photosites differ in.
#[derive(Debug, Clone, Default)]
pub(super) struct Ripples {
    all: Vec<Ripple>,
    /// Half a code, the narrowest panel that is of use, in units of the mean excess; none where shot noise blurs the excess.
    narrowest: f64,
}

/// What rounding makes of photosites which differ by an exponential number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rounded {
    /// Their share, and the mean of what they differ in, e⁻.
    pub share: f64,
    pub mean_e: f64,
    /// Whether what they differ in has shot noise.
    pub is_counted: bool,
    pub adu_per_e: f64,
}

impl Ripples {
    /// Those that move the mean by more than 10⁻⁸ of a code: of m turns to a code, at the angle θ = 2π m K, e^(−D) is left by what
    /// blurs all photosites alike, `damping(θ)`, over π m; and of counts of mean h t what their characteristic function leaves,
    /// |e^(h t (e^(iθ) − 1))| = e^(−h t (1 − cos θ)). Ripples that turn but little within the mean excess are smooth as they are.
    pub fn add(&mut self, of: &Rounded, damping: impl Fn(f64) -> f64) {
        const COUNTS: f64 = 1e-8;
        const SMOOTH_RATE: f64 = 0.05;
        // Of counts the angles come again where a turn is an electron, of less weight each.
        let most_turns = (2.0 / of.adu_per_e).clamp(64.0, 4096.0);
        let mut turns = 1.0;
        while turns <= most_turns && of.share > std::f64::consts::PI * turns * COUNTS {
            let angle = std::f64::consts::TAU * of.adu_per_e * turns;
            let left = (of.share / (std::f64::consts::PI * turns * COUNTS)).ln() - damping(angle);
            let (rate, decay) = match of.is_counted {
                true => (2.0 * (0.5 * angle).sin().abs(), 1.0 - angle.cos()),
                false => (angle, 0.0),
            };
            let [rate, decay] = [rate, decay].map(|by_electron| by_electron * of.mean_e);
            if left > 0.0 && rate > SMOOTH_RATE {
                self.all.push(Ripple { left, decay, rate });
            }
            turns += 1.0;
        }
        if !of.is_counted {
            let half = 0.5 / (of.adu_per_e * of.mean_e);
            self.narrowest = if self.narrowest > 0.0 { self.narrowest.min(half) } else { half };
        }
    }

    /// Whether there are none.
    pub fn is_none(&self) -> bool {
        self.all.is_empty()
    }

    /// The ends of panels: 12 nodes sum a ripple that changes by a factor e^(16 i), forth or down, to 10⁻⁹; none of too many.
    fn ends(&self) -> Option<Vec<f64>> {
        const WIDTH: f64 = 16.0;
        // The fastest first; what has died away stays so.
        let mut left = self.all.clone();
        left.sort_by(|a, b| a.rate.total_cmp(&b.rate));
        let mut ends = Vec::new();
        let mut end = 0.0;
        while end < REACH {
            while left.pop_if(|fastest| fastest.left <= fastest.decay * end).is_some() {}
            let Some(Ripple { rate, .. }) = left.last() else { break };
            if ends.len() * NODES > MOST_NODES {
                return None;
            }
            ends.push(end);
            end += (WIDTH / rate).max(self.narrowest);
        }
        ends.push(end);
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

/// What a sum over amplitudes is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// Moments, as exact as can be, and what rounding makes of them.
    Moments,
    /// Variances, to some 10⁻⁶.
    Variances,
    /// Shares, however small, to some 10⁻⁶ of what photosites that differ have of them.
    Shares,
}

/// Whether the variance of what is read of a charge of such mean and variance, noise included, is about that: codes are fine, and no more
/// than few are cut off.
pub(super) fn is_read_as_charge(adc: Option<AdcRecord>, full_well_e: f64, [mean_e, variance]: [f64; 2]) -> bool {
    const WITHIN: f64 = 2.0;
    const FINE: f64 = 0.5;
    let std = variance.sqrt();
    let [low, high] = [mean_e - WITHIN * std, mean_e + WITHIN * std];
    let is_coded = |adc: AdcRecord| {
        let [lowest, highest] = [0.0, f64::from(adc.top_code())].map(|code| adc.electrons_at(code));
        adc.adu_per_e * std >= FINE && low > lowest && high < highest
    };
    high < full_well_e && adc.is_none_or(is_coded)
}

/// How much excesses between two make of a variance at most, where their square is `share` of that of the others: what all panels of a sum
/// are good to by themselves may be the less the less it is.
fn matters(share: f64, [low, high]: [f64; 2]) -> f64 {
    share * (1.0 + high * high) * (-low).exp() / (1.0 + 2.0 * share)
}

/// Places and weights of an exponential number of mean 1 for a function that bends at `knees`, and is rounded; none of too many. The square
/// of what photosites differ in is `share` of the variance of the others; ∞ where that is not known.
pub(super) fn nodes(knees: &[Knee], ripples: &Ripples, share: f64, wanted: Wanted) -> Option<Vec<(f64, f64)>> {
    // Of a variance, panels of 12 nodes are good to 10⁻¹⁰ of what they make of it, of 8 to 10⁻⁶, and of 5 to 10⁻⁴; the widest of 5 to
    // a hundredth: all together to 5·10⁻⁹ of the variance, or 10⁻⁶.
    const OF_FEW: f64 = 1e-4;
    const OF_FEWEST: f64 = 1e-6;
    const OF_FEWEST_IF_COARSE: f64 = 1e-2;
    static SMOOTH_NODES: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| laguerre(10));
    // e^(−t) grows by the panel: on each of these 12 nodes sum it to 10⁻¹³ of the whole.
    const WIDEST: [f64; 5] = [0.0, 4.0, 10.0, 20.0, REACH];
    const NARROWEST: f64 = 1e-4;
    // Of a bend as wide as w means the twentieth derivative is below √19!/w²⁰, and ten nodes are off by (10!)²/20! times that: 2·10⁻¹¹.
    const SMOOTH_WIDTH: f64 = 5.0;
    let is_near =
        |knee: &&Knee| knee.width < SMOOTH_WIDTH && knee.at < REACH + 12.0 * knee.width && knee.at > -12.0 * knee.width;
    let near: Vec<&Knee> = knees.iter().filter(is_near).collect();
    if near.is_empty() && ripples.is_none() {
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
    ends.extend(ripples.ends()?);
    ends.retain(|end| (0.0..=REACH).contains(end));
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|next, kept| *next - *kept < 1e-7);
    let of_panel = |pair: &[f64]| -> Vec<(f64, f64)> {
        let at = |(t, weight): (f64, f64)| (t, weight * (-t).exp());
        let [low, high] = [pair[0], pair[1]];
        // Ripples take as many wherever they are.
        let is_known = ripples.is_none() && share.is_finite();
        let of_all = if is_known { matters(share, [low, high]) } else { f64::INFINITY };
        match wanted {
            Wanted::Moments if of_all < OF_FEWEST => fewest(low, high).map(at).collect(),
            Wanted::Variances if of_all < OF_FEWEST_IF_COARSE => fewest(low, high).map(at).collect(),
            Wanted::Moments if of_all >= OF_FEW => panel(low, high).map(at).collect(),
            _ => few(low, high).map(at).collect(),
        }
    };
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
            (vec![], Ripples::default()),
            (vec![knee(0.7, 0.01), knee(-0.1, 0.2), knee(30.0, 2.0)], Ripples::default()),
            (
                vec![knee(2.0, 0.3)],
                ripples(&Rounded { share: 1.0, mean_e: 30.0, is_counted: true, adu_per_e: 0.1 }, 0.3),
            ),
        ];
        for (knees, codes) in cases {
            let found = nodes(&knees, &codes, f64::INFINITY, Wanted::Moments).unwrap();
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
        let sharp = Rounded { share: 1.0, mean_e: 1000.0, is_counted: false, adu_per_e: 1.0 };
        assert!(nodes(&[], &ripples(&sharp, 0.0), 1.0, Wanted::Moments).is_none());
    }

    /// What is cut off at a knee, e^(−a) beyond a, its mean and square; of so few, and of so little that each share counts by itself.
    #[test]
    fn few_excesses_take_few_nodes() {
        let a: f64 = 2.0;
        let expected = [1.0 + a, 2.0 + 2.0 * a + a * a].map(|rest| rest * (-a).exp());
        for share in [1e-7, 1e-5, 1e-3, 0.1, 10.0, 1e4] {
            let sums = |wanted: Wanted| {
                let knees = [Knee { at: a, width: 1e-5, reach: 9.0 }];
                let found = nodes(&knees, &Ripples::default(), share, wanted).unwrap();
                let beyond = found.iter().filter(|(t, _)| *t > a);
                let sums =
                    beyond.fold([0.0; 2], |[first, second], (t, weight)| [first + t * weight, second + t * t * weight]);
                (found.len(), [0, 1].map(|k| (sums[k] - expected[k]).abs()))
            };
            // Of the variance of all, 1 + 2 share, the squares of these are `share` times their sum.
            let of_all = share / (1.0 + 2.0 * share);
            let (fine, errors) = sums(Wanted::Moments);
            assert!(errors.iter().all(|error| of_all * error < 5e-9), "{share}: {errors:?}");
            let (coarse, errors) = sums(Wanted::Variances);
            assert!(errors.iter().all(|error| of_all * error < 1e-6), "{share}: {errors:?}");
            let (shares, errors) = sums(Wanted::Shares);
            assert!(errors.iter().all(|error| *error < 1e-6) && coarse <= shares && (fine < shares || share > 1e-5));
        }
    }

    fn ripples(of: &Rounded, read_noise_e: f64) -> Ripples {
        let mut found = Ripples::default();
        found.add(of, |angle| 0.5 * (angle * read_noise_e).powi(2));
        found
    }

    /// What ripples of m turns to a code leave of the mean, 1/(π m) of a code before anything blurs them: with e^(iφ t) of what is not
    /// counted and e^(h t (e^(iθ) − 1)) of counts, ∫ e^(−t) e^(z t) dt = 1/(1 − z).
    #[test]
    fn panels_follow_the_ripples_that_blur_leaves() {
        let cases = [
            (1.0, 4.0, false, 0.5, 0.0, 3),
            (1.0, 4.0, false, 0.5, 0.6, 40),
            (0.3, 40.0, true, 0.1, 0.0, 60),
            (1e-3, 2000.0, true, 0.02, 1.0, 200),
            (1.0, 300.0, true, 1.0, 0.2, 20),
            (0.02, 13.0, true, 1.0 / 51.3, 8.0, 60),
        ];
        for (share, mean_e, is_counted, adu_per_e, read_noise_e, most_turns) in cases {
            let of = Rounded { share, mean_e, is_counted, adu_per_e };
            let found = nodes(&[], &ripples(&of, read_noise_e), 1.0, Wanted::Moments).unwrap();
            for turns in 1..=most_turns {
                let angle = std::f64::consts::TAU * adu_per_e * f64::from(turns);
                let blurred = (-0.5 * (angle * read_noise_e).powi(2)).exp();
                let (down, turn) = match is_counted {
                    true => (mean_e * (1.0 - angle.cos()), mean_e * angle.sin()),
                    false => (0.0, mean_e * angle),
                };
                let ripple = |t: f64| (-down * t).exp() * (turn * t).cos();
                let sum: f64 = found.iter().map(|(t, weight)| weight * ripple(*t)).sum();
                let expected = (1.0 + down) / ((1.0 + down).powi(2) + turn * turn);
                let moved = share / (std::f64::consts::PI * f64::from(turns)) * blurred * (sum - expected).abs();
                assert!(moved < 1e-8, "{of:?} {turns}: {sum} {expected}");
            }
        }
    }
}

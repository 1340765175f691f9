//! Quantiles: what a confidence interval reaches to.

use statrs::function::beta::checked_beta_reg;
use statrs::function::erf::erf_inv;
use statrs::function::gamma::{checked_gamma_lr, ln_gamma};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::thread::LocalKey;

/// The standard normal deviate that a share `p` lies below, 0 < p < 1.
pub fn of_normal(p: f64) -> f64 {
    std::f64::consts::SQRT_2 * erf_inv(2.0 * p - 1.0)
}

/// Degrees of freedom from which on the approximation is good to 10⁻⁴ of the quantile for 0.001 < p < 0.999.
const MANY: f64 = 2000.0;

/// The sum of squares of `freedom` degrees of freedom, whole or not, that a share `p` lies below, 0 < p < 1: for few by
/// that of the incomplete gamma function, for many by the cube of a normal deviate \[WH1931].
pub fn of_chi_square(p: f64, freedom: f64) -> f64 {
    let ninth = 2.0 / (9.0 * freedom);
    let near = freedom * (1.0 - ninth + of_normal(p) * ninth.sqrt()).max(0.0).powi(3);
    if freedom >= MANY {
        return near;
    }
    remembered(&CHI_SQUARES, [p, freedom], || {
        let half = freedom / 2.0;
        let scale = half * std::f64::consts::LN_2 + ln_gamma(half);
        solved(near.max(f64::MIN_POSITIVE), |x| {
            let density = ((half - 1.0) * x.ln() - x / 2.0 - scale).exp();
            [checked_gamma_lr(half, x / 2.0).unwrap_or(1.0) - p, density]
        })
    })
}

/// The deviate of Student's law of `freedom` degrees of freedom, whole or not, that a share `p` lies below, ½ ≤ p < 1, by that of
/// the incomplete beta function \[AbramowitzStegun1964, Eq. 26.7.1].
pub fn of_student(p: f64, freedom: f64) -> f64 {
    /// From so many on it is the normal law to 10⁻⁶ of the quantile.
    const MANY: f64 = 1e7;
    if freedom >= MANY {
        return of_normal(p);
    }
    remembered(&DEVIATES, [p, freedom], || {
        let half = freedom / 2.0;
        let scale = ln_gamma(half + 0.5) - ln_gamma(half) - 0.5 * (freedom * std::f64::consts::PI).ln();
        solved(of_normal(p), |t| {
            let above = 0.5 * checked_beta_reg(half, 0.5, freedom / (freedom + t * t)).unwrap_or(0.0);
            [1.0 - p - above, (scale - (half + 0.5) * (t * t / freedom).ln_1p()).exp()]
        })
    })
}

/// The number ≥ 0 at which a law's share below is what is asked, from `near` on: `off` tells how much more it is at any, and the density
/// there. By Newton's steps, and by halves where these lead beyond what is known.
fn solved(near: f64, off: impl Fn(f64) -> [f64; 2]) -> f64 {
    /// Steps so small leave what doubles hold.
    const NONE: f64 = 1e-12;
    const MOST_STEPS: usize = 200;
    let (mut low, mut high, mut at) = (0.0, f64::INFINITY, near);
    for _ in 0..MOST_STEPS {
        let [over, density] = off(at);
        if over < 0.0 {
            low = at;
        } else {
            high = at;
        }
        let newton = at - over / density;
        let next = match newton > low && newton < high {
            true => newton,
            false if high.is_finite() => f64::midpoint(low, high),
            false => 2.0 * at + f64::MIN_POSITIVE,
        };
        if (next - at).abs() <= NONE * at {
            return next;
        }
        at = next;
    }
    at
}

/// What was asked last, with what came of it.
type Last = RefCell<VecDeque<([u64; 2], f64)>>;

thread_local! {
    static CHI_SQUARES: Last = const { RefCell::new(VecDeque::new()) };
    static DEVIATES: Last = const { RefCell::new(VecDeque::new()) };
}

/// What is asked, or was a short while ago: the levels of a measurement have few unlike degrees of freedom among them.
fn remembered(last: &'static LocalKey<Last>, asked: [f64; 2], find: impl FnOnce() -> f64) -> f64 {
    const MOST: usize = 8;
    let asked = asked.map(f64::to_bits);
    last.with_borrow_mut(|last| {
        if let Some((_, found)) = last.iter().find(|(of, _)| *of == asked) {
            return *found;
        }
        let found = find();
        last.truncate(MOST - 1);
        last.push_front((asked, found));
        found
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tabulated quantiles [AbramowitzStegun1964, Tables 26.1, 26.8 and 26.10].
    #[test]
    fn quantiles_are_the_tabulated() {
        assert!((of_normal(0.975) - 1.959_963_985).abs() < 1e-8);
        assert!((of_normal(0.5)).abs() < 1e-12);
        for (p, freedom, tabulated) in [
            (0.95, 1.0, 3.84146),
            (0.025, 10.0, 3.24697),
            (0.975, 10.0, 20.4831),
            (0.005, 100.0, 67.3276),
            (0.995, 100.0, 140.169),
        ] {
            let found = of_chi_square(p, freedom);
            assert!((found / tabulated - 1.0).abs() < 5e-6, "{p} {freedom}: {found}");
        }
        for (p, freedom, tabulated) in
            [(0.975, 1.0, 12.706), (0.975, 2.0, 4.303), (0.975, 10.0, 2.228), (0.995, 120.0, 2.617)]
        {
            let found = of_student(p, freedom);
            assert!((found - tabulated).abs() < 6e-4, "{p} {freedom}: {found}");
        }
        assert!((of_student(0.975, 1e6) - of_normal(0.975)).abs() < 1e-5);
        // The two ways meet.
        for p in [0.001, 0.025, 0.5, 0.975, 0.999] {
            let [few, many] = [MANY - 1e-9, MANY].map(|freedom| of_chi_square(p, freedom));
            assert!((few / many - 1.0).abs() < 1e-4, "{p}: {few} {many}");
        }
    }

    /// Among many that are asked in turn each is what it is when it is asked alone.
    #[test]
    fn what_was_asked_before_is_no_matter() {
        let asked: Vec<[f64; 2]> = (0..40).map(|at| [0.6 + 0.01 * f64::from(at % 5), f64::from(at % 11 + 1)]).collect();
        let both = |[p, freedom]: [f64; 2]| [of_chi_square(p, freedom), of_student(p, freedom)].map(f64::to_bits);
        let in_turn: Vec<_> = asked.iter().map(|asked| both(*asked)).collect();
        for (asked, found) in asked.into_iter().zip(in_turn) {
            let alone = std::thread::spawn(move || both(asked)).join().unwrap();
            assert_eq!(alone, found);
        }
    }
}

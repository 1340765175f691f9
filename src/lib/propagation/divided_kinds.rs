//! Photosites that are unlike most, of frames that were divided by a flat field.
//!
//! Given its excess t of dark current and its amplitude s of jumps, a photosite is one like those of a sensor without tails, in the
//! frame as in its flats and in what came off either; its quotient A/F has the moments that those have. Of all together moments are
//! those of the mixture. A flat field that keeps dark signal grows with t, so that A/F is a rational number in it, which panels sum.

use super::masters::{Dark, Drawn};
use super::photosite::Photosite;
use super::quotients::Quotients;
use super::tails::{FEW, State};
use crate::numerics::gauss::{laguerre, panel};
use crate::stages::noise::Tails;
use std::sync::LazyLock;

/// Why nothing is said where tails are cut off.
pub(super) const CUT_OFF: &str = "hot pixels or random telegraph signals, of the frame, of the flats that divided it or of what came off either, \
                                  fill up or go beyond the codes; take shorter exposures";

/// Photosites of one kind.
pub(super) struct Kind {
    pub share: f64,
    pub site: Photosite,
    /// Whether all that are as hot, or hotter, do not count.
    pub is_rare: bool,
}

/// The probability of all photosites beyond the last that counts, and what the cut takes of a variance.
const NEGLIGIBLE: [f64; 2] = [1e-9, 1e-7];

/// The excess, in units of the mean, beyond which it does not count that exponential numbers of such a share are cut off, the square of
/// whose mean is `squares` of the variance: with ∫ (t − r) e^(−t) dt = e^(−r) from r on, ∫ 2 t (t − r) e^(−t) dt = (2r + 4) e^(−r).
fn farthest(share: f64, squares: f64) -> f64 {
    let counts = |r: f64| {
        let beyond = share * (-r).exp();
        beyond > NEGLIGIBLE[0] || beyond * squares * (2.0 * r + 4.0) > NEGLIGIBLE[1]
    };
    (0_u32..50).map(f64::from).find(|r| !counts(*r)).unwrap_or(50.0)
}

/// Nodes of an exponential number for polynomials of degree 19.
static SMOOTH: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| laguerre(10));

/// The same for functions with a pole below zero, no nearer than 1/30: off by 10⁻⁹ of themselves.
static RATIONAL: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    const ENDS: [f64; 9] = [0.0, 0.1, 0.5, 2.0, 4.5, 8.0, 14.0, 24.0, 40.0];
    let of_panel =
        |ends: &[f64]| panel(ends[0], ends[1]).map(|(t, weight)| (t, weight * (-t).exp())).collect::<Vec<_>>();
    let found: Vec<(f64, f64)> = ENDS.windows(2).flat_map(of_panel).filter(|(_, weight)| *weight > 1e-15).collect();
    let sum: f64 = found.iter().map(|(_, weight)| weight).sum();
    found.into_iter().map(|(t, weight)| (t, weight / sum)).collect()
});

impl Photosite {
    /// The excess of hot photosites, and the amplitude of jumps, beyond which none counts of a class after division; in units of their
    /// means.
    fn last_that_count(&self, class: usize, expected_e: f64) -> [f64; 2] {
        let (Some(adc), Some(flat)) = (&self.adc, &self.flat) else { return [0.0; 2] };
        let cold = self.at(&State { hot: 0.0, trap: 0.0 });
        let variance = Drawn::codes(&cold.model, adc, expected_e, [1.0; 2]).variance / (adc.adu_per_e * adc.adu_per_e);
        let ratio = (expected_e / flat.expected_e[class]).max(1.0);
        let last = |share: fn(&Tails) -> f64, mean_e: fn(&Tails) -> f64| {
            farthest(self.most(share), (ratio * self.most(mean_e)).powi(2) / variance)
        };
        [
            if self.most(|tails| tails.hot_e) > 0.0 { last(|tails| tails.hot_share, |tails| tails.hot_e) } else { 0.0 },
            if self.most(|tails| tails.rts_e) > 0.0 { last(|tails| tails.rts_share, |tails| tails.rts_e) } else { 0.0 },
        ]
    }

    /// Whether no hot photosite that counts fills up, and no jump leaves the codes.
    pub(super) fn are_tails_open(&self, class: usize, expected_e: f64) -> bool {
        if !self.has_tails() {
            return true;
        }
        let [hot, trap] = self.last_that_count(class, expected_e);
        let ends = [State { hot, trap: 0.0 }, State { hot: 0.0, trap }];
        ends.iter().all(|state| self.at(state).is_all_open(class, expected_e))
    }

    /// All kinds of photosites of a class, and their shares.
    pub(super) fn kinds_divided(&self, class: usize, expected_e: f64) -> Vec<Kind> {
        if !self.has_tails() {
            return vec![Kind { share: 1.0, site: *self, is_rare: false }];
        }
        let [hot_share, trap_share] = [self.most(|tails| tails.hot_share), self.most(|tails| tails.rts_share)];
        let [last_hot, last_trap] = self.last_that_count(class, expected_e);
        let mut found = Vec::new();
        let mut add = |share: f64, [hot, trap]: [f64; 2]| {
            if share > 0.0 {
                let is_rare = hot > last_hot || trap > last_trap;
                found.push(Kind { share, site: self.at(&State { hot, trap }), is_rare });
            }
        };
        add((1.0 - hot_share) * (1.0 - trap_share), [0.0; 2]);
        for (trap, weight) in SMOOTH.iter() {
            add((1.0 - hot_share) * trap_share * weight, [0.0, *trap]);
        }
        let hot_places: &[(f64, f64)] = if hot_share > 0.0 { self.hot_places(class) } else { &[] };
        for (hot, of_hot) in hot_places {
            add(hot_share * of_hot * (1.0 - trap_share), [*hot, 0.0]);
            for (trap, weight) in FEW.iter() {
                add(hot_share * of_hot * trap_share * weight, [*hot, *trap]);
            }
        }
        found
    }

    /// Excesses of hot photosites and their weights.
    fn hot_places(&self, class: usize) -> &'static [(f64, f64)] {
        /// Nodes for polynomials are off by e^(−4√(10/g)) where the flat field grows by g of itself with each mean excess.
        const LITTLE: f64 = 0.1;
        let level = |hot: f64| {
            let site = self.at(&State { hot, trap: 0.0 });
            site.adc.zip(site.flat).map_or(1.0, |(adc, flat)| flat.drawn(&adc, flat.expected_e[class], [1.0; 2]).mean)
        };
        if (level(1.0) / level(0.0) - 1.0).abs() < LITTLE { &SMOOTH } else { &RATIONAL }
    }

    /// The power of what jumps of one amplitude a add to quotients A/F: c aᵖ of each frame, and of averages what they keep.
    fn of_jumps(&self, power: i32, found: &Quotients) -> f64 {
        let Some((adc, flat)) = self.adc.zip(self.flat) else { return 0.0 };
        let [ratio, level] = found.ratio_and_flat();
        let jump = |tails: &Tails| (adc.adu_per_e * tails.trap_e / level).powi(power);
        let of_average = |dark: &Dark| {
            dark.weight.powi(power) * jump(&dark.model.tails) / f64::from(dark.frames.max(1)).powi(power - 1)
        };
        let of_frame = jump(&self.model.tails) + self.darks.iter().flatten().map(of_average).sum::<f64>();
        let of_flat = of_average(&flat.frames) + flat.darks.iter().flatten().map(of_average).sum::<f64>();
        of_frame + ratio.powi(power) * of_flat
    }

    /// The fourth cumulant of jumps of one amplitude a in quotients, −a⁴/4 of each frame.
    pub(super) fn fourth_of_jumps(&self, found: &Quotients) -> f64 {
        -0.25 * self.of_jumps(4, found)
    }

    /// The sixth cumulant, a⁶/2 of each.
    pub(super) fn sixth_of_jumps(&self, found: &Quotients) -> f64 {
        0.5 * self.of_jumps(6, found)
    }
}

#[cfg(test)]
mod tests {
    use super::super::masters::Flat;
    use super::super::moments::{Equations, Prediction};
    use super::*;
    use crate::metadata::{AdcRecord, PoissonKind};
    use crate::stages::noise::{LineNoise, NoiseModel};

    /// A photosite over three flats; three dark frames came off it, and three of theirs off the flats.
    fn divided(tails: Tails) -> Photosite {
        let model = NoiseModel {
            dark_e: 20.0,
            dcnu: 0.1,
            prnu: 0.01,
            read_noise_e: 8.0,
            full_well_e: 60_000.0,
            dark_shot: true,
            signal_shot: true,
            poisson: PoissonKind::Exact,
            lines: LineNoise::default(),
            tails,
        };
        let site = Photosite::of_electrons(model, Equations::Exact)
            .digitized(AdcRecord::new(14, 600.0, 0.25))
            .less_dark_frames(3);
        let flat = Flat {
            expected_e: [9000.0; 3],
            photosites: [1e4; 3],
            counted_share: [1.0; 3],
            frames: Dark::mean_of(model, 3),
            levels: None,
            darks: [Some(Dark::mean_of(model, 3)), None, None],
            shares_masters: false,
            level_lines: None,
            ratios: [1.0; 3],
            levels_adu: [0.0; 2],
        };
        Photosite { flat: Some(flat), ..site }
    }

    const TAILS: Tails =
        Tails { hot_share: 0.03, hot_e: 90.0, rts_share: 0.1, rts_e: 15.0, trap_e: 0.0, are_few: false };

    /// Of next to none moments are those of photosites that are all alike: sensitivities are then summed by seven nodes, not fifty.
    #[test]
    fn next_to_no_tails_change_nothing() {
        let few = Tails { hot_share: 1e-13, rts_share: 1e-13, ..TAILS };
        for expected_e in [300.0, 9000.0, 20_000.0] {
            let [none, with] = [Tails::default(), few].map(|tails| divided(tails).divided(1, expected_e).unwrap());
            let values = |found: &Prediction| [found.moments.mean, found.moments.variance, found.third, found.common];
            for (a, b) in values(&none).into_iter().zip(values(&with)) {
                assert!((a / b - 1.0).abs() < 1e-9, "{expected_e}: {a} {b}");
            }
            assert_eq!((none.sixth, none.fourth()), (0.0, 0.0));
        }
    }

    /// To first order hot photosites add the shot noise of their excess to frame and darks, and jumps a²/2 of mean square 2 s²: with n = 3
    /// of each and x = E/F, K² [p h (1 + 1/3 + x² 2/3) + q s² (1 + 1/3 + x² 2/3)]; beyond it is a share ρ of 10⁻⁴ and that of (h/F)².
    #[test]
    fn tails_add_their_own_variance() {
        let variance = |tails: Tails| divided(tails).divided(0, 6000.0).unwrap().moments.variance;
        let plain = variance(Tails::default());
        let x: f64 = 6000.0 / 9000.0;
        let kept = 1.0 + 1.0 / 3.0 + x * x * 2.0 / 3.0;
        for (tails, added) in [
            (Tails { hot_share: 0.03, hot_e: 90.0, ..Tails::default() }, 0.03 * 90.0),
            (Tails { rts_share: 0.1, rts_e: 15.0, ..Tails::default() }, 0.1 * 225.0),
        ] {
            let found = (variance(tails) - plain) / (0.25 * 0.25);
            assert!((found / (added * kept) - 1.0).abs() < 2e-3, "{found} {}", added * kept);
        }
    }

    /// ∫ e^(−t)/(1 + g t) dt by 60 nodes on each of 80 panels.
    #[test]
    fn panels_sum_rational_numbers() {
        let cases = [
            (0.1, 0.915_633_339_397_881, &*SMOOTH),
            (1.0, 0.596_347_362_323_194, &*RATIONAL),
            (3.0, 0.385_602_012_136_694, &*RATIONAL),
            (30.0, 0.098_462_632_970_155, &*RATIONAL),
        ];
        for (g, expected, nodes) in cases {
            let sum: f64 = nodes.iter().map(|(t, weight)| weight / (1.0 + g * t)).sum();
            assert!((sum - expected).abs() < 1e-9, "{g}: {sum}");
        }
    }

    /// Where a hot photosite in 10⁹ fills up nothing is told.
    #[test]
    fn tails_that_are_cut_off_are_refused() {
        let told = |hot_e: f64| divided(Tails { hot_e, ..TAILS }).divided(0, 6000.0).is_some();
        // 18 mean excesses are one in 2·10⁹ of three hundredths, and their squares count to 23.
        assert!(told(1500.0) && !told(4000.0));
    }
}

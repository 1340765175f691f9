//! Predictions at the ends of what a photosite can hold and a converter tell apart: against sums over counts and codes that share
//! no code with the library's, against simulated frames of random cameras, and for what must hold of any.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Saturated, measure};
use cyanometer::frame::to_sample;
use cyanometer::metadata::{AdcRecord, PoissonKind, Scene};
use cyanometer::propagation::budget::Cause;
use cyanometer::propagation::{Equations, Photosite, Prediction};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::noise::{AddNoise, LineNoise, NoiseModel, NoiseSettings, Tails};
use cyanometer::stream::MemoryFrame;
use support::{expected, through};

/// A camera, and the light on a photosite.
#[derive(Debug, Clone, Copy)]
struct Case {
    model: NoiseModel,
    adc: AdcRecord,
    light_e: f64,
}

const QUIET: NoiseModel = NoiseModel {
    dark_e: 0.0,
    dcnu: 0.0,
    prnu: 0.0,
    read_noise_e: 0.0,
    full_well_e: 40_000.0,
    dark_shot: true,
    signal_shot: true,
    poisson: PoissonKind::Exact,
    lines: LineNoise {
        row_noise_e: 0.0,
        column_noise_e: 0.0,
        black_drift_e: 0.0,
        black_drift_rows: 0.0,
        dsnu_e: 0.0,
        dsnu_row_e: 0.0,
        dsnu_column_e: 0.0,
        prnu_row: 0.0,
        prnu_column: 0.0,
    },
    tails: Tails { hot_share: 0.0, hot_e: 0.0, rts_share: 0.0, rts_e: 0.0, trap_e: 0.0, are_few: false },
};

const PAPER: AdcRecord = AdcRecord::new(12, 1753.0, 0.058824);

impl Case {
    fn codes(&self) -> Prediction {
        Photosite::of_electrons(self.model, Equations::Exact).digitized(self.adc).moments(self.light_e)
    }

    fn electrons(&self) -> Prediction {
        Photosite::of_electrons(self.model, Equations::Exact).moments(self.light_e)
    }
}

fn normal_above(z: f64) -> f64 {
    0.5 * libm::erfc(z / std::f64::consts::SQRT_2)
}

/// Counts and their probabilities.
fn counts(rate: f64, is_shot: bool) -> Vec<(f64, f64)> {
    if !is_shot || rate <= 0.0 {
        return vec![(rate, 1.0)];
    }
    let most = (rate + 12.0 * rate.sqrt() + 60.0).ceil();
    let mut found = Vec::new();
    let mut count = 0.0;
    while count < most {
        let probability = (count * rate.ln() - rate - libm::lgamma(count + 1.0)).exp();
        if probability > 1e-18 {
            found.push((count, probability));
        }
        count += 1.0;
    }
    found
}

/// A normal law, cut off below: mean, standard deviation, lower end, weight.
type Piece = [f64; 4];

/// Everything about a case by sums: P(code > k) = Σ over counts of ∫ φ(r) P(charge > edge − r) dr, the integral over read noise by
/// Simpson's rule between the places where the charge's law breaks off.
struct Reference {
    atoms: Vec<(f64, f64)>,
    pieces: Vec<Piece>,
    case: Case,
}

impl Reference {
    fn new(case: Case) -> Self {
        let model = case.model;
        let (mut atoms, mut pieces) = (Vec::new(), Vec::new());
        for (light, p) in counts(case.light_e, model.signal_shot) {
            for (dark, q) in counts(model.dark_e, model.dark_shot) {
                let (of_light, of_dark) = (light * model.prnu, dark * model.dcnu);
                let (mean, std, weight) = (light + dark, of_light.hypot(of_dark), p * q);
                if weight < 1e-17 {
                    continue;
                }
                if std == 0.0 {
                    atoms.push((mean, weight));
                    continue;
                }
                // Sensitivities below zero are zero; where both patterns matter neither goes so low here.
                let lowest = match (of_light > 0.0, of_dark > 0.0) {
                    (true, true) => -1e9,
                    (true, false) => dark,
                    _ => light,
                };
                atoms.push((lowest, weight * normal_above((mean - lowest) / std)));
                pieces.push([mean, std, lowest, weight]);
            }
        }
        atoms.iter_mut().for_each(|atom| atom.0 = atom.0.min(model.full_well_e));
        Self { atoms, pieces, case }
    }

    /// P(charge > t) without what sits on one value, before full well.
    fn above(&self, t: f64) -> f64 {
        let of = |&[mean, std, lowest, weight]: &Piece| weight * normal_above((t.max(lowest) - mean) / std);
        self.pieces.iter().map(of).sum()
    }

    fn exceeds(&self, code: f64) -> f64 {
        let Case { model, adc, .. } = self.case;
        let edge = (code + 0.5 - adc.bias_adu) / adc.adu_per_e;
        let (full, sigma) = (model.full_well_e, model.read_noise_e);
        if sigma == 0.0 {
            // Ties go up.
            let is_above = |charge: f64| adc.bias_adu + adc.adu_per_e * charge >= code + 0.5;
            let atoms: f64 = self.atoms.iter().filter(|atom| is_above(atom.0)).map(|atom| atom.1).sum();
            return atoms + if is_above(full) { self.above(edge) } else { 0.0 };
        }
        let atoms: f64 = self.atoms.iter().map(|(charge, weight)| weight * normal_above((edge - charge) / sigma)).sum();
        let low = (edge - full).max(-9.5 * sigma);
        if low >= 9.5 * sigma {
            return atoms;
        }
        // The law breaks off at the lower end of the pieces: all have the same, or one each an electron apart.
        let intervals = 3000;
        let step = (9.5 * sigma - low) / f64::from(intervals);
        let value = |i: i32| {
            let r = low + step * f64::from(i);
            (-0.5 * (r / sigma).powi(2)).exp() * self.above(edge - r)
        };
        let weight = |i: i32| if i == 0 || i == intervals { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
        let sum: f64 = (0..=intervals).map(|i| weight(i) * value(i)).sum();
        atoms + sum * step / 3.0 / (sigma * std::f64::consts::TAU.sqrt())
    }

    /// Mean and variance of the codes.
    fn codes(&self) -> [f64; 2] {
        let Case { model, adc, .. } = self.case;
        let top = f64::from(adc.top_code());
        let level = |charge: f64| adc.bias_adu + adc.adu_per_e * charge;
        let low = level(-9.5 * model.read_noise_e).floor().clamp(0.0, top);
        let high = level(model.full_well_e + 9.5 * model.read_noise_e).ceil().clamp(0.0, top);
        let center = level((self.case.light_e + model.dark_e).min(model.full_well_e)).round().clamp(0.0, top);
        let (mut first, mut second) = (low - center, (low - center).powi(2));
        let mut code = low;
        while code < high {
            let share = self.exceeds(code);
            first += share;
            second += share * (2.0 * (code - center) + 1.0);
            code += 1.0;
        }
        [center + first, second - first * first]
    }

    fn check(&self, tolerance: f64) {
        let ([mean, variance], found) = (self.codes(), self.case.codes().moments);
        // What is left out of sums is 10⁻¹⁴ of a code.
        let scale = variance.max(1e-6);
        assert!(
            (found.mean - mean).abs() < tolerance * scale.sqrt().max(1e-3),
            "{:?}: {} {mean}",
            self.case,
            found.mean
        );
        assert!(
            (found.variance - variance).abs() < tolerance * scale,
            "{:?}: {} {variance}",
            self.case,
            found.variance
        );
    }
}

/// Numbers that look random.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn one_of<const N: usize>(&mut self, choices: [f64; N]) -> f64 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
        let index = (self.next() * N as f64) as usize;
        choices[index.min(N - 1)]
    }

    /// A small camera: wells of 100 to 260 e⁻, few bits, light up to beyond full well, patterns of which at most one is cut off
    /// at zero.
    fn case(&mut self) -> Case {
        let full_well_e = self.between(100.0, 260.0).round();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "3 to 7")]
        let bits = self.between(3.0, 8.0) as u32;
        let top = f64::from((1_u32 << bits) - 1);
        let [low, high, whole] = [self.between(0.0, 30.0), self.between(0.0, 1.3), self.between(0.8, 1.1)];
        let light_e = self.one_of([0.0, low, high * full_well_e, (whole * full_well_e).round()]);
        let dark_e = {
            let some = self.between(0.0, 25.0);
            self.one_of([0.0, 0.0, some])
        };
        let bias_adu = {
            let some = self.between(-2.0, 0.3 * top);
            self.one_of([0.0, some, (0.1 * top).round()])
        };
        let some_slope = self.between(0.3, 2.0) * top / full_well_e;
        let adu_per_e = self.one_of([some_slope, 0.5, 0.25, (top - bias_adu) / full_well_e]);
        let [tiny, some, of_code] =
            [self.between(0.05, 1.0), self.between(1.0, 12.0), self.between(0.2, 1.5) / adu_per_e];
        let read_noise_e = self.one_of([0.0, tiny, some, of_code]);
        let [weak, strong] = [self.between(0.0, 0.1), self.between(0.2, 1.2)];
        let (prnu, dcnu) = if self.next() < 0.5 {
            (self.one_of([0.0, 0.01, weak]), self.one_of([0.0, weak]))
        } else if dark_e == 0.0 {
            (strong.min(0.5), 0.0)
        } else {
            (0.0, strong)
        };
        let signal_shot = self.next() > 0.15;
        let light_e = f64::from(to_sample(light_e));
        let model = NoiseModel { dark_e, dcnu, prnu, read_noise_e, full_well_e, signal_shot, ..QUIET };
        Case { model, adc: AdcRecord::new(bits, bias_adu, adu_per_e), light_e }
    }
}

/// Simpson's rule, in steps of σ/150, is off by (h/σ)⁴/180 = 10⁻¹¹, and by h²/12 of the density where the law of
/// a charge begins between two steps.
#[test]
fn random_cameras_are_predicted_as_sums_over_counts_have_it() {
    let mut dice = Dice(7);
    for _ in 0..20 {
        Reference::new(dice.case()).check(1e-6);
    }
}

/// Dark current of 32 full wells leaves photosites dark that hold none of it, whatever the pattern of the little light: by a sum over
/// sensitivities. Shot noise is a hundredth of the ramp up to full well.
#[test]
fn photosites_without_dark_current_stay_dark_in_saturated_frames() {
    let model = NoiseModel { dark_e: 160_000.0, dcnu: 0.3, read_noise_e: 5.0, full_well_e: 5000.0, ..QUIET };
    let (mut mean, mut square) = (0.0, 0.0);
    for step in -80_000..80_000 {
        let z = f64::from(step) * 1e-4;
        let charge = (40.0 + model.dark_e * (1.0 + model.dcnu * z).max(0.0)).min(model.full_well_e);
        let weight = 1e-4 * (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
        mean += weight * charge;
        square += weight * charge * charge;
    }
    let std = (square - mean * mean + model.read_noise_e.powi(2)).sqrt();
    for prnu in [0.0, 0.25, 0.4, 0.6] {
        let case = Case { model: NoiseModel { prnu, ..model }, adc: PAPER, light_e: 40.0 };
        let found = case.electrons().moments;
        let off = [found.mean - mean, found.std() - std];
        assert!(off[0].abs() < 5e-3 && off[1].abs() < 2e-3 * std, "{prnu}: {off:?}");
    }
}

/// Where next to all codes are the top one, a fourth cumulant is what rounding left of it; no law has less than the skewness tells.
#[test]
fn no_law_has_less_kurtosis_than_its_skewness_tells() {
    for light_e in [5300.0, 3900.0, 2400.0] {
        let model =
            NoiseModel { dark_e: 80_000.0, dcnu: 0.3, prnu: 0.499, read_noise_e: 47.0, full_well_e: 5300.0, ..QUIET };
        let found = Case { model, adc: AdcRecord::new(10, 51.0, 70.0), light_e }.codes();
        let skewness = found.third / found.moments.variance.powf(1.5);
        assert!(skewness < -100.0 && found.excess_kurtosis >= skewness * skewness - 2.0, "{found:?}");
    }
}

/// A count on a lattice of codes, without read noise: ties go up; 20 e⁻ at half a code each give the mean 100 + 10 + ¼.
#[test]
fn lattices_and_ties_are_counted() {
    let case = |light_e, adu_per_e| Case { model: QUIET, adc: AdcRecord::new(12, 100.0, adu_per_e), light_e };
    assert!((case(20.0, 0.5).codes().moments.mean - 110.25).abs() < 1e-9);
    for (light_e, slope) in [(20.0, 0.5), (561.0, 0.0498), (300.0, 1.0), (250.0, 0.0499), (3.0, 0.3)] {
        Reference::new(case(light_e, slope)).check(1e-9);
    }
}

/// Few electrons beside the lower rail, and wells of an electron or two.
#[test]
fn small_wells_and_few_electrons_are_counted() {
    for full_well_e in [1.0, 2.0, 5.0, 300.0] {
        for light_e in [0.3, 1.0, 2.5, 6.0] {
            for read_noise_e in [0.0, 0.2, 0.9] {
                for bias_adu in [-3.0, 0.0, 0.4, 2.0] {
                    let model = NoiseModel { full_well_e, read_noise_e, ..QUIET };
                    Reference::new(Case { model, adc: AdcRecord::new(8, bias_adu, 1.7), light_e }).check(1e-8);
                }
            }
        }
    }
}

/// Sums over counts, light near full well behind the paper's converter: by hand, one normal law a count, cut at the top code.
#[test]
fn light_near_full_well_is_summed_over_counts() {
    for light_e in [39_000.0, 40_600.0, 41_000.0] {
        let model = NoiseModel { prnu: 0.008, read_noise_e: 15.7, ..QUIET };
        let found = Case { model, adc: PAPER, light_e }.codes().moments;
        let (mut first, mut second) = (0.0, 0.0);
        let (bias, slope) = (PAPER.bias_adu, PAPER.adu_per_e);
        let spread = light_e.sqrt();
        let mut total = 0.0;
        let mut light = (light_e - 8.0 * spread).floor();
        while light < light_e + 8.0 * spread {
            let p = (light * light_e.ln() - light_e - libm::lgamma(light + 1.0)).exp();
            total += p;
            // Full well, at code 4106, lies 11 codes of spread 0.92 above the top one and takes nothing.
            let sigma = slope * (light * model.prnu).hypot(model.read_noise_e);
            let mean = bias + slope * light;
            for below in 0..400 {
                let edge = 4094.5 - f64::from(below);
                let short = normal_above((mean - edge) / sigma);
                first -= p * short;
                second += p * short * (2.0 * f64::from(below) + 1.0);
            }
            light += 1.0;
        }
        // lgamma at 4·10⁵ is good to 10⁻¹⁰ of itself.
        let (first, second) = (first / total, second / total);
        assert!((found.mean - 4095.0 - first).abs() < 1e-6, "{light_e}: {} {first}", found.mean);
        assert!((found.variance / (second - first * first) - 1.0).abs() < 1e-6, "{light_e}: {}", found.variance);
    }
}

/// Dark current without shot noise whose sensitivities are cut off at zero, beside an end of the codes that charges below zero would
/// leave: one normal law a count of light, code by code. Read noise is next to none, and no edge is near a charge of many photosites.
#[test]
fn cut_patterns_are_summed_beside_the_ends_of_codes() {
    for (dark_e, dcnu, full_well_e, light_e, adc) in [
        (992_770.188, 0.224_751_8, 167_270.386_6, 1.254_384_8, AdcRecord::new(14, 7_528.034_668, 0.063_407_19)),
        (1_169.974_767, 1.202_842_7, 1_682.282_5, 0.025_280_03, AdcRecord::new(6, 53.928_498, 0.025_641_427)),
    ] {
        let dark_e = f64::from(to_sample(dark_e));
        let model = NoiseModel { dark_e, dcnu, full_well_e, dark_shot: false, ..QUIET };
        let found = Case { model, adc, light_e }.codes().moments;
        let top = f64::from(adc.top_code());
        let (mut first, mut second) = (0.0, 0.0);
        for (light, p) in counts(light_e, true) {
            let mut code = 0.0;
            while code < top {
                let edge = (code + 0.5 - adc.bias_adu) / adc.adu_per_e;
                let normal = 1.0 - normal_above((edge - light - dark_e) / (dcnu * dark_e));
                let below = if edge > full_well_e {
                    1.0
                } else if edge > light {
                    normal
                } else {
                    0.0
                };
                first -= p * below;
                second += p * below * (2.0 * (top - code) - 1.0);
                code += 1.0;
            }
        }
        let variance = second - first * first;
        assert!((found.mean - top - first).abs() < 1e-8 * variance.sqrt(), "{dark_e}: {} {first}", found.mean);
        assert!((found.variance / variance - 1.0).abs() < 1e-8, "{dark_e}: {} {variance}", found.variance);
    }
}

/// Overexposed darks hold full well and nothing more, at once and at any temperature.
#[test]
fn overexposed_darks_are_full() {
    for dark_e in [1e5, 4e5, 1e9, 1e14, 1e20] {
        let model = NoiseModel { dark_e, dcnu: 0.1, read_noise_e: 15.7, ..QUIET };
        let case = Case { model, adc: PAPER, light_e: 0.0 };
        let found = case.electrons().moments;
        assert!(found.mean <= 40_000.0 && found.mean > 39_999.0, "{dark_e}: {found:?}");
        assert!(found.std() < 20.0 && found.std() > 15.6, "{dark_e}: {found:?}");
        let left = Photosite::of_electrons(model, Equations::Exact).digitized(PAPER).less_dark_frames(4).moments(100.0);
        assert!(left.moments.mean.abs() < 1.0 && left.moments.variance >= 0.0, "{dark_e}: {left:?}");
    }
}

/// Causes add up, and no part is more than the whole, whatever clips or rounds.
#[test]
fn causes_add_up_at_the_ends() {
    let mut dice = Dice(3);
    let paper = NoiseModel { dark_e: 73.2, dcnu: 0.2, prnu: 0.008, read_noise_e: 15.7, ..QUIET };
    let near = [39_000.0, 40_600.0, 41_000.0, 46_000.0].map(|light_e| Case { model: paper, adc: PAPER, light_e });
    for case in (0..40).map(|_| dice.case()).chain(near) {
        let photosite = Photosite::of_electrons(case.model, Equations::Exact);
        for photosite in [photosite, photosite.digitized(case.adc), photosite.digitized(case.adc).less_dark_frames(3)] {
            let whole = photosite.moments(case.light_e).moments.variance;
            let budget = photosite.budget(case.light_e);
            let sum: f64 = budget.iter().sum();
            let scale = budget.iter().map(|part| part.abs()).sum::<f64>().max(1e-12);
            assert!((sum - whole).abs() < 1e-9 * scale, "{case:?}: {sum} {whole} {budget:?}");
            let fixed: f64 = Cause::ALL
                .into_iter()
                .filter(|cause| cause.is_fixed_pattern())
                .map(|cause| budget[cause as usize])
                .sum();
            assert!(fixed > -1e-6 * scale && fixed < whole + 1e-5 * scale, "{case:?}: {fixed} {whole} {budget:?}");
        }
    }
}

/// Simulated frames of random cameras, extreme ones among them: z of the means, and of the variances by the predicted kurtosis,
/// where that lets them be normal deviates.
#[test]
fn random_cameras_are_simulated_as_predicted() {
    let mut dice = Dice(11);
    let (mut means, mut variances) = (Vec::new(), Vec::new());
    for number in 0..80 {
        let case = dice.case();
        let mut scene = expected(200, 100, |_, _, _| to_sample(case.light_e));
        scene.header.metadata.scene = Some(Scene::uniform("test", [case.light_e; 3]));
        let mut sensor = scene.header.metadata.sensor.take().unwrap();
        let readout = sensor.readout.as_mut().unwrap();
        let exposure_s = scene.header.metadata.exposure.unwrap().exposure_s;
        readout.full_well_e = case.model.full_well_e;
        readout.dark_current_na_per_cm2 = None;
        readout.dark_current_e_per_s = Some(case.model.dark_e / exposure_s);
        (readout.dcnu, readout.prnu) = (case.model.dcnu, case.model.prnu);
        readout.read_noise_e = case.model.read_noise_e;
        scene.header.metadata.sensor = Some(sensor);
        let without = if case.model.signal_shot { vec![] } else { vec![cyanometer::random::Source::Ssn] };
        let settings = NoiseSettings { seed: number, sensor_seed: number, without, ..NoiseSettings::default() };
        let noisy = through(&scene, &AddNoise::new(&scene.header, &settings).unwrap());
        let AdcRecord { bits, bias_adu, adu_per_e, .. } = case.adc;
        let converter = AdcSettings { bits: Some(bits), bias_adu: Some(bias_adu), adu_per_e: Some(adu_per_e) };
        let codes = through(&noisy, &Digitize::new(&noisy.header, &converter).unwrap());
        for frame in [noisy, codes] {
            let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
            let report = measure(&mut source, &[], Saturated::Kept, Equations::Exact, Some(1e-6)).unwrap();
            assert!(report.check.unwrap().passed, "{case:?}: {:?}", report.regions[0].tests);
            for channel in &report.regions[0].channels {
                let n = channel.count as f64;
                let variance = channel.predicted_std.unwrap().powi(2);
                // There is no z where the law of a test is not known.
                if n * variance > 2000.0 {
                    means.extend(channel.z_mean.map(|z| (z, case)));
                    variances.extend(channel.z_std.map(|z| (z, case)));
                }
            }
        }
    }
    for (what, z) in [("mean", means), ("variance", variances)] {
        let n = z.len() as f64;
        assert!(n > 100.0, "{what}: {n}");
        // 2 n Φ(−5) < 3·10⁻⁴; heavy tails lift that of variances.
        let worst = z.iter().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).unwrap();
        assert!(worst.0.abs() < if what == "mean" { 5.0 } else { 6.0 }, "{what}: {worst:?}");
        let mean = z.iter().map(|(z, _)| z).sum::<f64>() / n;
        assert!(mean.abs() < 5.0 / n.sqrt(), "{what}: {mean}");
    }
}

//! Noise as it is drawn against noise as the formulas have it: means and standard deviations of whole frames, from the
//! dark to beyond saturation.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{ChannelReport, Saturated, measure};
use cyanometer::cfa::Class;
use cyanometer::metadata::{PoissonKind, Scene};
use cyanometer::propagation::Equations;
use cyanometer::random::Source;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use support::{expected, readout, through_blocks};

/// The frame of a uniform scene.
fn scene(width: usize, height: usize, electrons: [f64; 3]) -> MemoryFrame {
    #[expect(clippy::cast_possible_truncation, reason = "whole numbers, or nearly so")]
    let samples = electrons.map(|e| e as f32);
    let mut frame = expected(width, height, |_, _, class| samples[class as usize]);
    frame.header.metadata.scene = Some(Scene::uniform("test", samples.map(f64::from)));
    frame
}

fn noisy(scene: &MemoryFrame, settings: &NoiseSettings) -> MemoryFrame {
    let stage = AddNoise::new(&scene.header, settings).unwrap();
    through_blocks(scene, &stage, 1, 2).0
}

fn digitized(frame: &MemoryFrame) -> MemoryFrame {
    let stage = Digitize::new(&frame.header, &AdcSettings::default()).unwrap();
    through_blocks(frame, &stage, 1, 2).0
}

fn channels(frame: &MemoryFrame, equations: Equations) -> Vec<ChannelReport> {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    measure(&mut source, &[], Saturated::Kept, equations, None).unwrap().regions.remove(0).channels
}

/// Deviations in units of their sampling error, gathered to be judged together.
#[derive(Default)]
struct Deviations {
    z: Vec<(f64, String)>,
}

impl Deviations {
    /// |z| that one of `n` normal deviates exceeds with a chance of 10⁻⁴: from n·2Φ(−z) ≤ n·√(2/π) e^(−z²/2)/z.
    fn bound(&self) -> f64 {
        let n = self.z.len() as f64;
        let chance = |z: f64| n * (2.0 / std::f64::consts::PI).sqrt() * (-z * z / 2.0).exp() / z;
        (300..900).map(|i| f64::from(i) / 100.0).find(|&z| chance(z) < 1e-4).unwrap()
    }

    /// None is out of bounds; the spread is 1; the mean is 0.
    fn judge(mut self, what: &str) {
        let n = self.z.len() as f64;
        assert!(n >= 100.0, "{what}: only {n} deviations");
        let bound = self.bound();
        self.z.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let worst: Vec<String> = self.z.iter().take(12).map(|(z, case)| format!("{z:8.2}  {case}")).collect();
        let worst = worst.join("\n");
        assert!(self.z[0].0.abs() < bound, "{what}: {n} deviations, bound {bound}\n{worst}");
        // χ² has mean n and variance 2n; the mean of z has variance 1/n. Five standard deviations of each.
        let chi_square: f64 = self.z.iter().map(|(z, _)| z * z).sum();
        let mean = self.z.iter().map(|(z, _)| z).sum::<f64>() / n;
        let spread = chi_square / n;
        assert!((spread - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{what}: spread {spread}\n{worst}");
        assert!(mean.abs() < 5.0 / n.sqrt(), "{what}: mean {mean} of {n}\n{worst}");
    }
}

/// The four sets of deviations: what, of what.
#[derive(Default)]
struct Gathered {
    electrons_mean: Deviations,
    electrons_std: Deviations,
    adu_mean: Deviations,
    adu_std: Deviations,
    rare: u32,
}

impl Gathered {
    fn take(&mut self, frame: &MemoryFrame, is_adu: bool, case: &str) {
        for (channel, class) in channels(frame, Equations::Exact).iter().zip(Class::ALL) {
            let level = frame.header.metadata.scene.as_ref().unwrap().expected_electrons.unwrap();
            let unit = if is_adu { "ADU" } else { "e-" };
            let case = format!(
                "{} {unit}, {case}; mean {:?} predicted {:?}, std {:?} predicted {:?}",
                level[class as usize],
                channel.mean.unwrap(),
                channel.predicted_mean.unwrap(),
                channel.std.unwrap(),
                channel.predicted_std.unwrap(),
            );
            let n = channel.count as f64;
            let variance = channel.predicted_std.unwrap().powi(2);
            // Samples come in steps of about 1 e⁻, or of 1 ADU. Where the variance is far below that, nearly all sites
            // have one value and n·variance of them another: below 1000 of those, sums are Poisson counts rather than
            // normal deviates, and Bernstein's inequality bounds them (chance 2e^−25, steps up to 4).
            if n * variance < 1000.0 {
                let excess = n * (channel.mean.unwrap() - channel.predicted_mean.unwrap());
                let rounding = n * f64::from(f32::EPSILON) * channel.mean.unwrap().abs();
                let bound = (50.0 * n * variance).sqrt() + 4.0 * 25.0 * 2.0 / 3.0 + rounding;
                assert!(excess.abs() <= bound, "{excess} beyond {bound}: {case}");
                self.rare += 1;
                continue;
            }
            let (means, stds) = if is_adu {
                (&mut self.adu_mean, &mut self.adu_std)
            } else {
                (&mut self.electrons_mean, &mut self.electrons_std)
            };
            means.z.push((channel.z_mean.unwrap(), case.clone()));
            stds.z.push((channel.z_std.unwrap(), case));
        }
    }

    fn judge(self) {
        self.electrons_mean.judge("means of electrons");
        self.electrons_std.judge("standard deviations of electrons");
        self.adu_mean.judge("means of ADU");
        self.adu_std.judge("standard deviations of ADU");
    }
}

/// Photosites of a class in a frame: the sampling error of a standard deviation is 1/√(2n) = 0.4 %, a bias of a tenth of
/// which the 700 and more deviations of each set would show.
const SIZE: [usize; 2] = [200, 150];
const SEEDS: std::ops::Range<u64> = 0..10;

fn gather(levels: &[[f64; 3]], temperatures_k: &[f64], poisson: PoissonKind) -> Gathered {
    let mut gathered = Gathered::default();
    let mut frames = 0;
    for electrons in levels {
        let scene = scene(SIZE[0], SIZE[1], *electrons);
        for &temperature_k in temperatures_k {
            for without in [vec![], vec![Source::Ron]] {
                for seed in SEEDS {
                    // No draw is used twice, so that the deviations are independent.
                    frames += 1;
                    let settings = NoiseSettings {
                        seed: seed << 32 | frames,
                        sensor_seed: seed << 32 | frames,
                        frame: 0,
                        without: without.clone(),
                        temperature_k: Some(temperature_k),
                        poisson,
                        cte: None,
                        clean: false,
                    };
                    let case = format!("{temperature_k} K, without {without:?}, {seed}");
                    let electrons = noisy(&scene, &settings);
                    gathered.take(&electrons, false, &case);
                    gathered.take(&digitized(&electrons), true, &case);
                }
            }
        }
    }
    gathered
}

const TEMPERATURES_K: [f64; 5] = [200.0, 250.0, 300.0, 333.0, 350.0];

#[test]
fn dim_light_is_as_noisy_as_predicted() {
    let levels = [[0.0, 1.0, 3.0], [5.0, 8.5, 20.0], [50.0, 120.0, 190.0], [210.0, 400.0, 900.0]];
    let gathered = gather(&levels, &TEMPERATURES_K, PoissonKind::Exact);
    // At 0 to 3 e⁻ without read noise, where a code is 17 e⁻ wide, few photosites leave the lowest code.
    assert!(gathered.rare < 120, "{} sets of samples without spread", gathered.rare);
    gathered.judge();
}

#[test]
fn bright_light_is_as_noisy_as_predicted() {
    let levels = [[1500.0, 2500.0, 5000.0], [9000.0, 14_000.0, 20_000.0], [25_000.0, 30_000.0, 37_000.0]];
    gather(&levels, &TEMPERATURES_K, PoissonKind::Exact).judge();
}

/// The top code stands for 39,813 e⁻, full well is 40,000: both clip, the one what the other has left.
#[test]
fn light_near_saturation_is_as_noisy_as_predicted() {
    let levels = [[38_500.0, 39_000.0, 39_250.0], [39_500.0, 39_600.0, 39_750.0], [39_900.0, 40_000.0, 40_300.0]];
    gather(&levels, &TEMPERATURES_K, PoissonKind::Exact).judge();
}

/// Normal numbers in place of Poisson counts have moments of their own; below a few electrons they mean nothing.
#[test]
fn gaussian_counts_are_as_noisy_as_predicted() {
    let levels = [[20.0, 100.0, 190.0], [1000.0, 10_000.0, 30_000.0], [39_000.0, 39_500.0, 40_000.0]];
    gather(&levels, &[200.0, 333.0, 350.0], PoissonKind::Gaussian).judge();
}

/// Behind a color filter array, each class has its own moments, and the plane those of the mixture.
#[test]
fn classes_of_a_plane_are_as_noisy_as_predicted() {
    let mut means = Deviations::default();
    let mut stds = Deviations::default();
    let mut wholes: Vec<f64> = Vec::new();
    for seed in 0..40 {
        let scene = scene(128, 96, [300.0, 20_000.0, 5000.0]);
        let settings = NoiseSettings { seed, sensor_seed: seed, ..Default::default() };
        let mosaic = Mosaic::new(&scene.header, None).unwrap();
        let plane = digitized(&noisy(&through_blocks(&scene, &mosaic, 1, 2).0, &settings));
        let mut source = MemoryFrame::new(plane.header.clone(), plane.samples.clone());
        let report = measure(&mut source, &[], Saturated::Kept, Equations::Exact, None).unwrap().regions.remove(0);
        assert_eq!(report.classes.len(), 3);
        for class in &report.classes {
            means.z.push((class.z_mean.unwrap(), class.name.clone()));
            stds.z.push((class.z_std.unwrap(), class.name.clone()));
        }
        // The mixture is three levels of known shares: its mean is far surer than that of so many independent samples.
        let whole = &report.channels[0];
        assert!(whole.mean_error.unwrap() < 0.1 * whole.std.unwrap() / (128.0_f64 * 96.0).sqrt());
        wholes.extend([whole.z_mean.unwrap(), whole.z_std.unwrap()]);
    }
    // The mean square of n normal numbers scatters by √(2/n).
    let square = wholes.iter().map(|z| z * z).sum::<f64>() / wholes.len() as f64;
    assert!((square - 1.0).abs() < 5.0 * (2.0 / wholes.len() as f64).sqrt(), "{square} of {wholes:?}");
    means.judge("means of classes");
    stds.judge("standard deviations of classes");
}

/// The paper's Eq. 11 drops the cross term of dark-current shot noise and non-uniformity: 16.96 e⁻ where 17.05 are
/// drawn. With n = 2·10⁶ the sampling error of the standard deviation is 0.05 %, a tenth of that.
#[test]
fn the_papers_dark_floor_is_too_low_and_the_exact_one_is_not() {
    for seed in 0..3 {
        let scene = scene(1000, 700, [0.0; 3]);
        let settings = NoiseSettings { seed, sensor_seed: seed, without: vec![Source::Ron], ..Default::default() };
        let dark = noisy(&scene, &settings);
        // Three planes without light are one sample of the dark signal; deviations of their sum, in σ/√3.
        let together = |equations| {
            let z = channels(&dark, equations).iter().map(|c| c.z_std.unwrap()).sum::<f64>();
            z / 3.0_f64.sqrt()
        };
        let (exact, paper) = (together(Equations::Exact), together(Equations::Paper));
        // 17.05/16.96 − 1 = 0.53 % is 10.9 standard errors 1/√(2·2.1·10⁶): more than 6 with a chance of 1 − 10⁻⁶.
        assert!(exact.abs() < 5.0, "exact: {exact}");
        assert!(paper > 6.0, "paper: {paper}");
        for channel in channels(&dark, Equations::Exact) {
            assert!((channel.predicted_std.unwrap() - 17.05).abs() < 0.005, "{channel:?}");
        }
        for channel in channels(&dark, Equations::Paper) {
            assert!((channel.predicted_std.unwrap() - 16.96).abs() < 0.005, "{channel:?}");
        }
    }
}

/// The paper takes the converter's noise as nil; where the read noise is left out and light is dim, the codes are far
/// coarser than the noise, and at saturation it knows no clipping.
#[test]
fn the_papers_equations_fail_where_they_should() {
    let z = |electrons: f64, without: &[Source], equations| {
        let scene = scene(SIZE[0], SIZE[1], [electrons; 3]);
        let settings = NoiseSettings { seed: 5, without: without.to_vec(), ..Default::default() };
        channels(&digitized(&noisy(&scene, &settings)), equations)[1].z_std.unwrap().abs()
    };
    let cold = [Source::Ron, Source::Dcsn, Source::Dcnu];
    for (electrons, without) in [(20.0, cold.as_slice()), (39_500.0, &[]), (40_000.0, &[])] {
        let exact = z(electrons, without, Equations::Exact);
        let paper = z(electrons, without, Equations::Paper);
        assert!(exact < 5.0 && paper > 10.0, "{electrons}: exact {exact}, paper {paper}");
    }
    // Where the paper's equations hold they are as good: 10⁴ e⁻, whose cross term is 0.6 % of 10⁻².
    assert!(z(10_000.0, &[], Equations::Paper) < 5.0);
    assert!((readout().read_noise_e - 15.7).abs() < 1e-12);
}

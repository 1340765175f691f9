//! The sampler as `add-noise` uses it: the same bits on every path, counts that follow the scene, and the exact law.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

mod support;

use cyanometer::cfa::Class;
use cyanometer::metadata::{PoissonKind, Scene};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::random::Source;
use cyanometer::random::poisson::{quantile, tails};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use support::*;

/// Rates of every path: none, few, about the switch at 10, many, too many for single precision, and what is no rate.
fn all_rates(x: usize, y: usize, class: Class) -> f32 {
    match (x / 7 + 3 * y + class as usize) % 11 {
        0 => 0.0,
        1 => -3.0,
        2 => f32::NAN,
        3 => 1e-3 * (1 + x) as f32,
        4 => 9.5 + 0.01 * (x % 100) as f32,
        5 => 30.0 + x as f32,
        6 => 2e4 + y as f32,
        7 => 3e7 + x as f32,
        8 => f32::INFINITY,
        _ => 5.0 + 0.1 * y as f32,
    }
}

fn on(frame: &MemoryFrame, settings: &NoiseSettings, instructions: Instructions) -> MemoryFrame {
    frame.through(&AddNoise::new(&frame.header, settings).unwrap().on(instructions)).unwrap().0
}

fn only(source: Source, seed: u64) -> NoiseSettings {
    let without = Source::ALL.into_iter().filter(|other| *other != source).collect();
    // At 1 K there is no dark current.
    NoiseSettings { seed, without, temperature_k: Some(1.0), ..NoiseSettings::default() }
}

/// Widths that fill whole runs, and that do not.
#[test]
fn every_set_of_instructions_draws_the_same_noise() {
    for (width, height) in [(512, 12), (531, 9), (3, 5), (1, 1)] {
        let planes = expected(width, height, all_rates);
        let mosaic = planes.through(&Mosaic::new(&planes.header, None).unwrap()).unwrap().0;
        for frame in [planes, mosaic] {
            for (poisson, cte) in
                [(PoissonKind::Exact, None), (PoissonKind::Gaussian, None), (PoissonKind::Exact, Some(0.9999))]
            {
                let settings = NoiseSettings { seed: 5, sensor_seed: 6, poisson, cte, ..NoiseSettings::default() };
                let plain = on(&frame, &settings, Instructions::Baseline);
                for instructions in Instructions::ALL {
                    assert_same(&plain, &on(&frame, &settings, instructions), instructions.name());
                }
            }
        }
    }
}

/// Tables of counts are used where a frame is large and its scene known to be uniform; they change no bit.
#[test]
fn a_scene_known_to_be_uniform_draws_the_same_noise() {
    let levels = [7.5, 1234.5, 25_000.0];
    let frame = expected(531, 300, |_, _, class| cyanometer::frame::to_sample(levels[class as usize]));
    let mut known = frame.clone();
    known.header.metadata.scene = Some(Scene::uniform("uniform", levels));
    for frames in [
        [&frame, &known].map(Clone::clone),
        [&frame, &known].map(|f| f.through(&Mosaic::new(&f.header, None).unwrap()).unwrap().0),
    ] {
        for instructions in Instructions::ALL {
            let noisy = [&frames[0], &frames[1]].map(|frame| on(frame, &NoiseSettings::default(), instructions));
            assert_same(&noisy[0], &noisy[1], "a uniform scene");
        }
    }
    // What the metadata say of a scene is not believed where the samples say otherwise.
    known.samples[531] = 17.0;
    let mut plain = frame.clone();
    plain.samples[531] = 17.0;
    let noisy = [&plain, &known].map(|frame| on(frame, &NoiseSettings::default(), Instructions::widest()));
    assert_same(&noisy[0], &noisy[1], "a scene said to be uniform");
}

/// An inverse transform takes one word a draw: a brighter scene draws no smaller count anywhere, and a scene brighter by
/// δ, δ more on average, each difference being 0 or 1 but for one in δ²/2.
#[test]
fn near_equal_scenes_get_near_equal_noise() {
    let delta = 0.02;
    for rate in [0.5, 8.0, 9.99, 40.0, 1000.0, 20_000.0] {
        let scene = |rate: f32| expected(400, 250, move |_, _, _| rate);
        let settings = only(Source::Ssn, 3);
        let [dim, bright] = [rate, rate + delta].map(|rate| on(&scene(rate), &settings, Instructions::widest()));
        let delta = f64::from(rate + delta) - f64::from(rate);
        let (mut sum, mut square) = (0.0, 0.0);
        for (dim, bright) in dim.samples.iter().zip(&bright.samples) {
            let more = f64::from(bright - dim);
            assert!(more >= 0.0, "at {rate} a brighter scene drew {bright} after {dim}");
            sum += more;
            square += more * more;
        }
        let n = dim.samples.len() as f64;
        // Differences are Bernoulli numbers of mean δ, nearly.
        assert!((sum / n - delta).abs() < 5.0 * (delta / n).sqrt(), "at {rate}: {} for {delta}", sum / n);
        assert!(square / n < delta * (1.0 + 2.0 * delta) + 5.0 * (delta / n).sqrt());
    }
}

/// χ² of 3·10⁵ counts against the exact law at rates on both sides of every switch of method; each passes at 10⁻⁵.
#[test]
fn counts_follow_the_poisson_law() {
    for (seed, rate) in
        (1..).zip([0.05_f32, 1.0, 4.0, 9.9, 9.999_999, 10.0, 10.1, 73.21, 199.0, 201.0, 5000.0, 30_000.0])
    {
        let drawn = on(&expected(400, 250, |_, _, _| rate), &only(Source::Ssn, seed), Instructions::widest());
        let exact = f64::from(rate);
        let n = drawn.samples.len() as f64;
        // Cells of equal shares, as far as counts allow: their edges are quantiles of words evenly apart.
        let mut edges: Vec<f64> = (1..60_u64).map(|i| quantile(exact, i * (u64::MAX / 60))).collect();
        edges.dedup();
        let mut cells = vec![0.0; edges.len() + 1];
        for &count in &drawn.samples {
            cells[edges.partition_point(|edge| *edge < f64::from(count))] += 1.0;
        }
        let at_most = |index: usize| if index < edges.len() { tails(edges[index], exact).0 } else { 1.0 };
        let mut below = 0.0;
        let (mut chi_square, mut used) = (0.0, -1.0_f64);
        for (index, cell) in cells.iter().enumerate() {
            let expected = n * (at_most(index) - below);
            below = at_most(index);
            if expected > 5.0 {
                chi_square += (cell - expected).powi(2) / expected;
                used += 1.0;
            }
        }
        // Wilson and Hilferty: (χ²/ν)^⅓ is normal with mean 1 − 2/9ν and variance 2/9ν.
        if used > 0.0 {
            let share = 2.0 / (9.0 * used);
            let z = ((chi_square / used).cbrt() - (1.0 - share)) / share.sqrt();
            assert!(z < 4.3, "at {rate}: χ² = {chi_square} of {used} degrees, z = {z}");
        }
    }
}

/// The header of a crop names its place on the sensor; there the draws are the same wherever the run of photosites that
/// they are made in starts.
#[test]
fn draws_do_not_depend_on_where_a_run_starts() {
    let whole = expected(700, 4, |x, y, class| 20.0 + 100.0 * scatter(x, y, class as usize));
    let settings = NoiseSettings { seed: 1, sensor_seed: 2, ..NoiseSettings::default() };
    let noisy = on(&whole, &settings, Instructions::widest());
    for start in [1, 2, 15, 16, 255, 257, 401] {
        let part = crop(&whole, start, 1, 290, 3);
        assert_same(&crop(&noisy, start, 1, 290, 3), &on(&part, &settings, Instructions::widest()), "a crop");
    }
}

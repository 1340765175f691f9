//! The sampler as `add-noise` uses it: the same bits on every path, counts that follow the scene, and the exact law.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Saturated, measure};
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::{CfaPattern, Class};
use cyanometer::metadata::{FrameHeader, PoissonKind, Scene};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::propagation::{Equations, FramePrediction, of_frame};
use cyanometer::random::Source;
use cyanometer::random::poisson::{quantile, tails};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::{MemoryFrame, Stage};
use std::io::Write;
use std::process::Stdio;
use support::workshop::Workshop;
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

// --- columns of a CCD ------------------------------------------------------------------------------------------------

/// A small CCD of so many rows, as dark and quiet as it need be, changed as one likes.
fn ccd(frame: &mut MemoryFrame, change: impl Fn(&mut ReadOut)) {
    let height = u32::try_from(frame.header.geometry.height).unwrap();
    let readout = frame.header.metadata.sensor.as_mut().unwrap().readout.as_mut().unwrap();
    (readout.height, readout.full_well_e) = (height, 20_000.0);
    (readout.bits, readout.bias_adu, readout.adu_per_e) = (16, 900.0, 2.5);
    change(readout);
    readout.check().unwrap();
}

/// Dim light, and some photosites of brighter light, one at the end of its column.
fn streets(x: usize, y: usize, class: Class) -> f32 {
    let light = 900.0 * scatter(x, y, class as usize);
    if (x, y) == (3, 0) {
        return 80_000.0;
    }
    if scatter(x, 2 * y, 5) > 0.97 { 90_000.0 * scatter(y, x, 1) } else { light }
}

fn mosaicked(frame: &MemoryFrame) -> MemoryFrame {
    frame.through(&Mosaic::new(&frame.header, None).unwrap()).unwrap().0
}

fn noise_of(frame: &MemoryFrame, settings: &NoiseSettings) -> AddNoise {
    AddNoise::new(&frame.header, settings).unwrap()
}

fn seeded() -> NoiseSettings {
    NoiseSettings { seed: 3, sensor_seed: 4, ..NoiseSettings::default() }
}

/// Without any source, what is expected: E + (τ/t) Σ E, the sum that of the photosites behind the filter array, in planes and plane.
#[test]
fn smear_is_the_light_of_the_column() {
    let mut planes = expected(37, 30, streets);
    planes.header.geometry.origin = [5, 0];
    ccd(&mut planes, |readout| (readout.smear_line_s, readout.dark_current_na_per_cm2) = (4e-6, Some(0.0)));
    let share = 4e-6 / EXPOSURE.exposure_s;
    let quiet = NoiseSettings { without: Source::ALL.to_vec(), ..seeded() };
    let plane = mosaicked(&planes);
    for frame in [&planes, &plane] {
        let made = through(frame, &noise_of(frame, &quiet));
        for (x, channel) in (0..37).flat_map(|x| (0..frame.header.geometry.channels.len()).map(move |c| (x, c))) {
            let sum: f64 = (0..30).map(|y| f64::from(at(&plane, x, y, 0))).sum();
            for y in 0..30 {
                let wanted = (f64::from(at(frame, x, y, channel)) + share * sum).min(20_000.0);
                let found = f64::from(at(&made, x, y, channel));
                assert!(
                    (found - wanted).abs() <= 20_000.0 * 2.0 * f64::from(f32::EPSILON),
                    "{x} {y}: {found} {wanted}"
                );
            }
        }
    }
}

/// The same bytes whichever way rows come, on many threads, mosaicked first or last; and where the head of a uniform scene tells the
/// light, as where it is added up.
#[test]
fn smear_is_the_same_on_every_way() {
    let mut planes = expected(64, 53, streets);
    ccd(&mut planes, |readout| readout.smear_line_s = 6e-6);
    let whole = through(&planes, &noise_of(&planes, &seeded()));
    let plane = mosaicked(&planes);
    for (frame, wanted) in [(&planes, &whole), (&plane, &mosaicked(&whole))] {
        let stage = noise_of(frame, &seeded());
        assert_same(wanted, &through(frame, &stage), "mosaicked first");
        assert_same(wanted, &through_cuts(frame, &stage, &[1, 7, 30]).0, "in bands");
        assert_same(wanted, &through_blocks(frame, &stage, 4, 3).0, "on threads");
        let mut light = stage.light_wanted().unwrap();
        frame.samples.chunks_exact(frame.header.geometry.row_samples()).for_each(|row| light.add(row));
        let told = stage.with_light(&light);
        assert!(told.light_wanted().is_none() && told.reach() == 0);
        assert_same(wanted, &through_cuts(frame, &told, &[1, 7, 30]).0, "with its light");
    }
    let mut uniform = expected(20, 31, |_, _, class| [500.0, 700.0, 900.0][class as usize]);
    ccd(&mut uniform, |readout| readout.smear_line_s = 6e-6);
    let added = through(&uniform, &noise_of(&uniform, &seeded()));
    uniform.header.metadata.scene = Some(Scene::uniform("test", [500.0, 700.0, 900.0]));
    let stage = noise_of(&uniform, &seeded());
    assert!(stage.light_wanted().is_none());
    assert_same(&added, &through(&uniform, &stage), "by its head");
    let part = crop(&uniform, 3, 5, 11, 9);
    assert_same(&crop(&added, 3, 5, 11, 9), &through(&part, &noise_of(&part, &seeded())), "a crop of a uniform scene");
}

/// Charge by charge, from the uppermost photosite beyond full well on, half of what spills of each goes down into the nearest that
/// have room; then from the lowest on the other half goes up.
fn spilled(column: &[f64], full: f64, blooming: f64) -> (Vec<f64>, f64) {
    let mut wells: Vec<f64> = column.iter().map(|charge| charge.min(full)).collect();
    let mut lost = 0.0;
    let mut pour = |mut charge: f64, way: &mut dyn Iterator<Item = usize>| {
        for y in way {
            let taken = charge.min(full - wells[y]);
            wells[y] += taken;
            charge -= taken;
        }
        lost += charge;
    };
    let excess = |y: usize| blooming * (column[y] - full).max(0.0) / 2.0;
    (0..column.len()).for_each(|y| pour(excess(y), &mut (y + 1..column.len())));
    (0..column.len()).rev().for_each(|y| pour(excess(y), &mut (0..y).rev()));
    (wells, lost)
}

/// Where nothing else is drawn: each column as charge by charge, and no electron lost that did not leave or drain.
#[test]
fn charge_spills_until_it_finds_room_and_none_is_lost() {
    let mut planes = expected(23, 60, streets);
    ccd(&mut planes, |readout| (readout.blooming, readout.dark_current_na_per_cm2) = (0.7, Some(0.0)));
    let plane = mosaicked(&planes);
    let quiet = NoiseSettings { without: Source::ALL.to_vec(), ..seeded() };
    let stage = noise_of(&plane, &quiet);
    let made = through(&plane, &stage);
    let mut spill = stage.spill(23);
    let mut rows = through(&plane, &stage.collected()).samples;
    rows.chunks_exact_mut(23).for_each(|row| spill.down(row));
    spill.turn();
    rows.chunks_exact_mut(23).rev().for_each(|row| spill.up(row));
    let (mut lost, mut collected, mut drained) = (0.0, 0.0, 0.0);
    // A sum of 60 charges, each rounded twice.
    let rounding = 60.0 * 20_000.0 * f64::from(f32::EPSILON);
    for x in 0..23 {
        let column: Vec<f64> = (0..60).map(|y| f64::from(at(&plane, x, y, 0))).collect();
        let (wanted, of_column) = spilled(&column, 20_000.0, 0.7);
        lost += of_column;
        collected += column.iter().sum::<f64>();
        drained += column.iter().map(|charge| 0.3 * (charge - 20_000.0).max(0.0)).sum::<f64>();
        for (y, wanted) in wanted.into_iter().enumerate() {
            let found = f64::from(at(&made, x, y, 0));
            assert!((found - wanted).abs() < rounding, "{x} {y}: {found} {wanted}");
            assert!(found <= 20_000.0 && rows[y * 23 + x].abs() == at(&made, x, y, 0));
        }
    }
    assert!(spill.full() > 10 && spill.bloomed() > spill.full(), "{spill:?}");
    assert!((spill.lost_e() - lost).abs() < 23.0 * rounding && lost > 1e4, "{} {lost}", spill.lost_e());
    let kept: f64 = made.samples.iter().map(|charge| f64::from(*charge)).sum();
    let missing = collected - drained - spill.lost_e() - kept;
    assert!(missing.abs() < 23.0 * rounding, "{missing}");
}

/// The same bytes in bands and on threads, with transfer too; and where no photosite is beyond full well, those of a sensor that drains.
#[test]
fn spilling_is_the_same_on_every_way() {
    let mut planes = expected(64, 41, streets);
    ccd(&mut planes, |readout| readout.blooming = 0.5);
    for cte in [None, Some(0.999)] {
        let settings = NoiseSettings { cte, ..seeded() };
        let plane = mosaicked(&planes);
        let stage = noise_of(&plane, &settings);
        let (whole, counts) = through_cuts(&plane, &stage, &[]);
        let cut = through_cuts(&plane, &stage, &[1, 9, 30]);
        assert_same(&whole, &cut.0, "in bands");
        assert_eq!(counts, cut.1);
        assert!(counts.full_well > 0);
        assert_same(&whole, &through_blocks(&plane, &stage, 4, 3).0, "on threads");
        let dim = |blooming: f64| {
            let mut dim = mosaicked(&expected(64, 41, |x, y, class| 5000.0 * scatter(x, y, class as usize)));
            ccd(&mut dim, |readout| readout.blooming = blooming);
            through(&dim, &noise_of(&dim, &settings))
        };
        assert_same(&dim(0.0), &dim(0.5), "of dim light");
    }
    assert!(noise_of(&planes, &seeded()).check_columns().unwrap_err().to_string().contains("run `mosaic` first"));
    let refused = |frame: &MemoryFrame, settings: &NoiseSettings| {
        let checked = AddNoise::new(&frame.header, settings).and_then(|stage| stage.check_columns());
        checked.unwrap_err().to_string()
    };
    let part = crop(&mosaicked(&planes), 0, 1, 64, 40);
    assert!(refused(&part, &seeded()).contains("it has 40 of the 41 rows of its sensor, from row 1 on"));
    let normal = NoiseSettings { poisson: PoissonKind::Gaussian, ..seeded() };
    assert!(refused(&mosaicked(&planes), &normal).contains("the sensor blooms"));
    let mut smeared = planes.clone();
    ccd(&mut smeared, |readout| (readout.smear_line_s, readout.blooming) = (1e-6, 0.0));
    assert!(refused(&crop(&smeared, 0, 0, 64, 20), &seeded()).contains("smear comes from whole columns"));
    let other = smeared.through(&Mosaic::new(&smeared.header, Some(CfaPattern::Bggr)).unwrap()).unwrap().0;
    assert!(refused(&other, &seeded()).contains("behind a filter array bggr, and its sensor has rggb"));
    let noisy = noise_of(&smeared, &seeded());
    assert!(Mosaic::new(noisy.header(), Some(CfaPattern::Bggr)).unwrap_err().to_string().contains("not bggr"));
}

/// Simulated frames with smear beside what is predicted, electrons, codes and demosaicked: in 12 frames of each no p-value of
/// some hundred is below 10⁻⁶, nor is half of them below a quarter.
#[test]
fn predictions_know_smear() {
    for electrons in [[1000.0_f32, 4000.0, 1000.0], [1500.0, 3000.0, 1501.0]] {
        let mut light = expected(120, 80, |_, _, class| electrons[class as usize]);
        light.header.metadata.scene = Some(Scene::uniform("test", electrons.map(f64::from)));
        ccd(&mut light, |readout| readout.smear_line_s = 8e-5);
        let mut ps = Vec::new();
        for seed in 0..12 {
            let settings = NoiseSettings { seed, sensor_seed: seed, ..NoiseSettings::default() };
            let charge = through(&light, &noise_of(&light, &settings));
            let codes = through(&charge, &Digitize::new(&charge.header, &AdcSettings::default()).unwrap());
            let plane = mosaicked(&codes);
            let rgb =
                through(&plane, &Demosaic::new(&plane.header, Method::EffectiveColor, Black::Auto, None).unwrap());
            for mut frame in [charge, codes, plane, rgb] {
                let report = measure(&mut frame, &[], Saturated::Kept, Equations::Exact, Some(0.5)).unwrap();
                assert!(!report.regions[0].tests.is_empty());
                ps.extend(report.regions[0].tests.iter().map(|test| test.p));
            }
        }
        let below = |level: f64| ps.iter().filter(|p| **p < level).count() as f64 / ps.len() as f64;
        assert!(below(1e-6) == 0.0 && below(0.25) < 0.5, "{} {} {}", ps.len(), below(1e-6), below(0.25));
        let mut other = light.clone();
        ccd(&mut other, |readout| readout.smear_line_s = 0.0);
        let mean = |frame: &MemoryFrame| match of_frame(noise_of(frame, &seeded()).header(), Equations::Exact).unwrap()
        {
            FramePrediction::Planes(planes) => planes[0].moments.mean,
            FramePrediction::Groups(_) | FramePrediction::Pixels(_) | FramePrediction::Tapped(_) => f64::NAN,
        };
        let columns = 20.0 * f64::from(electrons[0] + 2.0 * electrons[1] + electrons[2]);
        let wanted = 8e-5 / EXPOSURE.exposure_s * columns;
        assert!((mean(&light) - mean(&other) - wanted).abs() < 1e-6 * wanted, "{}", mean(&light) - mean(&other));
    }
}

/// What is refused, and why.
#[test]
fn what_columns_have_is_told_where_nothing_is_predicted() {
    let of = |electrons: [f32; 3], change: &dyn Fn(&mut ReadOut)| {
        let mut light = mosaicked(&expected(12, 80, |_, _, class| electrons[class as usize]));
        light.header.metadata.scene = Some(Scene::uniform("test", electrons.map(f64::from)));
        ccd(&mut light, change);
        noise_of(&light, &seeded()).header().clone()
    };
    let why = |head: &FrameHeader| of_frame(head, Equations::Exact).map(drop).map_err(|why| why.to_string());
    let blooms = |readout: &mut ReadOut| readout.blooming = 0.3;
    assert_eq!(why(&of([9000.0, 15_000.0, 12_000.0], &blooms)), Ok(()));
    assert!(why(&of([9000.0, 19_600.0, 12_000.0], &blooms)).unwrap_err().contains("spills over along columns"));
    assert_eq!(why(&of([9000.0, 19_600.0, 12_000.0], &|_| ())), Ok(()));
    // One hot pixel in 10⁴ of 3000 e⁻ more is beyond full well in one of 10⁸.
    let hot = |readout: &mut ReadOut| {
        blooms(readout);
        (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (1e-4, 6e4);
    };
    assert!(why(&of([1000.0, 1000.0, 1000.0], &hot)).unwrap_err().contains("spills over"));
    let mut bloomed = of([9000.0, 15_000.0, 12_000.0], &blooms);
    bloomed.metadata.bloomed_photosites = Some(0);
    assert_eq!(why(&bloomed), Ok(()));
    bloomed.metadata.bloomed_photosites = Some(2);
    assert!(why(&bloomed).unwrap_err().contains("saturated by neighbors"));
    let sigma = |head: &FrameHeader| {
        let codes = Digitize::new(head, &AdcSettings::default()).unwrap();
        let rgb = Demosaic::new(codes.header(), Method::Bilinear, Black::Auto, None).unwrap();
        PixelNoise::of(rgb.header()).map(drop).map_err(|why| why.to_string())
    };
    assert!(sigma(&bloomed).unwrap_err().contains("spilled over into 2 of its photosites"));
    bloomed.metadata.bloomed_photosites = Some(0);
    assert_eq!(sigma(&bloomed), Ok(()));
    // Columns with red and with blue differ by 8·10⁻⁵/0.033 · 80 · 3000/2 = 291 e⁻.
    let smear = |readout: &mut ReadOut| readout.smear_line_s = 8e-5;
    assert!(why(&of([1000.0, 4000.0, 4000.0], &smear)).unwrap_err().contains("smear of columns with red"));
    assert_eq!(why(&of([4000.0, 1000.0, 4000.0], &smear)), Ok(()));
}

/// The programs, which keep what waits in temporary files: the bytes that the library makes in one piece, at any number of threads, of
/// files and of pipes, and no file is left.
#[test]
fn programs_let_columns_wait() {
    let shop = Workshop::new();
    let mut planes = expected(70, 41, streets);
    ccd(&mut planes, |readout| (readout.smear_line_s, readout.blooming) = (6e-6, 0.5));
    let plane = mosaicked(&planes);
    let wanted = through(&plane, &noise_of(&plane, &seeded()));
    shop.write("plane.exr", &plane.header, &plane.samples);
    shop.write("planes.exr", &planes.header, &planes.samples);
    std::fs::create_dir(shop.path("waiting")).unwrap();
    let run = |line: &str, input: &[u8]| {
        let mut command = shop.command(line);
        command.env("TMPDIR", shop.path("waiting"));
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stdin.take().unwrap().write_all(input));
        let done = child.wait_with_output().unwrap();
        (done.status.success(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    for (threads, input, bytes) in
        [(1, "plane.exr", vec![]), (3, "plane.exr", vec![]), (2, "-", shop.bytes("plane.exr"))]
    {
        let (is_done, said) =
            run(&format!("add-noise {input} --seed 3 --sensor-seed 4 --threads {threads} -o made.exr"), &bytes);
        assert!(is_done && said.contains("photosites took up charge that spilled over"), "{said}");
        let (samples, metadata) = shop.read("made.exr");
        assert_same(&wanted, &MemoryFrame::new(wanted.header.clone(), samples), input);
        let bloomed = metadata.bloomed_photosites.unwrap();
        assert!(bloomed > 50 && bloomed < 70 * 41, "{bloomed}");
        assert!(std::fs::read_dir(shop.path("waiting")).unwrap().next().is_none());
    }
    let (is_done, said) = run("add-noise planes.exr -o none.exr", &[]);
    assert!(!is_done && said.contains("three planes do not have; run `mosaic` first"), "{said}");
    let (is_done, said) = run("add-noise plane.exr --crop 0,0,70,20 -o none.exr", &[]);
    assert!(!is_done && said.contains("it has 20 of the 41 rows of its sensor"), "{said}");
    let (is_done, said) = run("digitize made.exr -o codes.exr", &[]);
    assert!(is_done, "{said}");
    let (is_done, said) = run("demosaic codes.exr --sigma -o rgb.exr", &[]);
    assert!(!is_done && said.contains("charge has spilled over into"), "{said}");
    assert!(!shop.path("none.exr").exists());
}

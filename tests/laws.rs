//! Laws of the chain, to the bit unless a tolerance is said and derived.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::optics::Vignetting;
use cyanometer::cfa::{CfaPattern, Class};
use cyanometer::color::{Space, White};
use cyanometer::formats::yaml::{parse_metadata, write_metadata};
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::{FrameHeader, PoissonKind};
use cyanometer::random::Source;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::{DarkFrames, DarkStack, LessDarks};
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::import::Import;
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings, rectified_mean, rectified_mean_square};
use cyanometer::stages::render::Rendering;
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{MemoryFrame, RowSource, Stage};
use cyanometer::units::QuantityKind;
use proptest::prelude::*;
use support::*;

const SPACES: [Space; 4] = [Space::Xyz, Space::Xyy, Space::Lab, Space::Srgb];

fn pattern() -> impl Strategy<Value = CfaPattern> {
    prop::sample::select(CfaPattern::ALL.to_vec())
}

fn method() -> impl Strategy<Value = Method> {
    prop::sample::select(Method::ALL.to_vec())
}

/// Electrons as scenes have them, and as they do not: dark, dim, bright, beyond full well, negative, NaN.
fn any_light(x: usize, y: usize, class: Class) -> f32 {
    match (x * 5 + y * 3 + class as usize) % 17 {
        0 => 0.0,
        1 => -3.5,
        2 => 45_000.0,
        3 if x.is_multiple_of(97) => f32::NAN,
        4..9 => 20.0 * scatter(x, y, class as usize),
        _ => 39_000.0 * scatter(x, y, class as usize),
    }
}

fn noise(header: &FrameHeader, seed: u64) -> AddNoise {
    AddNoise::new(header, &NoiseSettings { seed, sensor_seed: seed + 1, ..Default::default() }).unwrap()
}

fn noisy(frame: &MemoryFrame, settings: &NoiseSettings) -> MemoryFrame {
    through(frame, &AddNoise::new(&frame.header, settings).unwrap())
}

fn digitizer(header: &FrameHeader) -> Digitize {
    Digitize::new(header, &AdcSettings::default()).unwrap()
}

fn correction(header: &FrameHeader, black: Black, cte: Option<f64>) -> CorrectFrame {
    CorrectFrame::new(header, &CorrectionSettings { black, cte }, None).unwrap()
}

fn color_settings(space: Space) -> ColorSettings {
    ColorSettings {
        is_relative: false,
        xyz_from_camera: [[0.9, 0.4, 0.3], [0.3, 0.9, 0.1], [0.05, -0.1, 1.4]],
        method: None,
        residual: None,
        space,
        white: White::D65,
        white_luminance: None,
    }
}

/// A CFA plane of ADU from a function of column, row and class.
fn plane(
    [width, height]: [usize; 2],
    origin: [i32; 2],
    cfa: CfaPattern,
    f: impl Fn(usize, usize, Class) -> f32,
) -> MemoryFrame {
    let mut header = header(QuantityKind::Adu, Geometry::new(width, height, &["Y"]));
    header.geometry.origin = origin;
    header.metadata.cfa = Some(cfa.into());
    frame(header, |x, y, _| f(x, y, cfa.row_classes(origin, y)[x % 2]))
}

fn demosaicked(plane: &MemoryFrame, method: Method) -> MemoryFrame {
    through(plane, &Demosaic::new(&plane.header, method, Black::None, None).unwrap())
}

// --- bands and threads ---------------------------------------------------------------------------------------------

/// Whatever rows a stage is asked for, with no more of its input in sight than it says it needs, it makes the same
/// samples and counts the same.
fn any_cut_gives_the_same<S: Stage>(input: &MemoryFrame, stage: &S, what: &str) {
    let height = input.header.geometry.height;
    let (whole, counts) = through_cuts(input, stage, &[]);
    let every: Vec<usize> = (1..height).collect();
    let (apart, counts_apart) = through_cuts(input, stage, &every);
    assert_same(&whole, &apart, what);
    assert_eq!(counts, counts_apart, "{what}");
    for_all(12, prop::collection::btree_set(1..height, 0..6), |cuts| {
        let cuts: Vec<usize> = cuts.into_iter().collect();
        let (cut, counts_cut) = through_cuts(input, stage, &cuts);
        prop_assert_eq!(first_difference(&whole, &cut), None, "{} cut at {:?}", what, cuts);
        prop_assert_eq!(counts, counts_cut);
        Ok(())
    });
}

/// Every stage of the chain with an input for it, of `width` × `height` photosites.
fn for_every_stage(width: usize, height: usize, check: &mut dyn FnMut(&MemoryFrame, AnyStage)) {
    let three = expected(width, height, any_light);
    let add = noise(&three.header, 5);
    check(&three, AnyStage::Noise(add.clone()));
    let electrons = through(&three, &add);
    let mosaic = Mosaic::new(&electrons.header, None).unwrap();
    check(&electrons, AnyStage::Mosaic(mosaic));
    let digitize = digitizer(&electrons.header);
    check(&electrons, AnyStage::Digitize(digitize.clone()));
    let codes = through(&electrons, &digitize);
    let cfa = through(&codes, &Mosaic::new(&codes.header, Some(CfaPattern::Gbrg)).unwrap());
    check(&cfa, AnyStage::Import(Import::new(&cfa.header).unwrap()));
    for method in Method::ALL {
        let stage = Demosaic::new(&cfa.header, method, Black::Auto, None).unwrap();
        check(&cfa, AnyStage::Demosaic(stage));
    }
    let bilinear = Demosaic::new(&cfa.header, Method::Bilinear, Black::Auto, None).unwrap();
    let rgb = through(&cfa, &bilinear);
    for space in SPACES {
        check(&rgb, AnyStage::ToXyz(ToXyz::new(&rgb.header, &color_settings(space)).unwrap()));
    }
    let light = through(&three, &Mosaic::new(&three.header, None).unwrap());
    check(&light, AnyStage::Noise(noise(&light.header, 5)));
    // Charge that misses some moves on its way, of which a row sees several above it.
    let cte = Some(1.0 - 0.4 / width as f64);
    for light in [&three, &light] {
        let settings = NoiseSettings { seed: 5, cte, ..Default::default() };
        check(light, AnyStage::Noise(AddNoise::new(&light.header, &settings).unwrap()));
    }
    for (frame, black, cte) in [(&codes, Black::None, cte), (&cfa, Black::Auto, cte), (&cfa, Black::Auto, None)] {
        check(frame, AnyStage::Correct(correction(&frame.header, black, cte)));
    }
}

/// A stage of any kind.
#[allow(clippy::large_enum_variant, reason = "there is one at a time")]
enum AnyStage {
    Noise(AddNoise),
    Import(Import),
    Mosaic(Mosaic),
    Digitize(Digitize),
    Correct(CorrectFrame),
    Demosaic(Demosaic),
    ToXyz(ToXyz),
}

impl AnyStage {
    fn name(&self) -> String {
        let made = &self.header().metadata;
        match self {
            Self::Noise(_) if made.noise.as_ref().unwrap().cte.is_some() => "add-noise --cte".into(),
            Self::Noise(_) => "add-noise".into(),
            Self::Correct(_) => "correct-frame".into(),
            Self::Import(_) => "import-raw".into(),
            Self::Mosaic(_) => "mosaic".into(),
            Self::Digitize(_) => "digitize".into(),
            Self::Demosaic(_) => format!("demosaic {}", made.demosaic.as_ref().unwrap().method),
            Self::ToXyz(_) => format!("to-xyz {}", made.quantity),
        }
    }

    fn header(&self) -> &FrameHeader {
        match self {
            Self::Noise(stage) => stage.header(),
            Self::Import(stage) => stage.header(),
            Self::Mosaic(stage) => stage.header(),
            Self::Digitize(stage) => stage.header(),
            Self::Correct(stage) => stage.header(),
            Self::Demosaic(stage) => stage.header(),
            Self::ToXyz(stage) => stage.header(),
        }
    }
}

/// Calls a generic function with the stage inside an [`AnyStage`].
macro_rules! with_stage {
    ($any:expr, $stage:ident => $body:expr) => {
        match $any {
            AnyStage::Noise($stage) => $body,
            AnyStage::Import($stage) => $body,
            AnyStage::Mosaic($stage) => $body,
            AnyStage::Digitize($stage) => $body,
            AnyStage::Correct($stage) => $body,
            AnyStage::Demosaic($stage) => $body,
            AnyStage::ToXyz($stage) => $body,
        }
    };
}

#[test]
fn a_row_does_not_depend_on_the_band_that_it_is_in() {
    for_every_stage(41, 23, &mut |input, any| {
        let name = any.name();
        with_stage!(&any, stage => any_cut_gives_the_same(input, stage, &name));
    });
}

/// Frames so wide that a band is a single row or a few, blocks that make it others, one thread and more than there are
/// processors.
#[test]
fn neither_blocks_nor_threads_change_a_sample() {
    // 4 MiB hold one row of three planes of the first width, three of the second, and five of the third, of which bands
    // take four.
    let mut heights_seen = std::collections::BTreeSet::new();
    for (width, height) in [(180_000, 5), (90_000, 7), (60_000, 9)] {
        for_every_stage(width, height, &mut |input, any| {
            // The other spaces differ in a formula at the end only.
            let is_slow = matches!(&any, AnyStage::ToXyz(_));
            if is_slow && any.header().metadata.quantity != QuantityKind::Xyz {
                return;
            }
            let name = any.name();
            let (whole, counts) = with_stage!(&any, stage => through_cuts(input, stage, &[]));
            for (natural, threads) in [(1, 1), (2, 5), (height, 2)] {
                let what = format!("{name}, blocks of {natural} rows, {threads} threads");
                let (made, counts_made, bands) =
                    with_stage!(&any, stage => through_blocks(input, stage, natural, threads));
                assert_same(&whole, &made, &what);
                assert_eq!(counts, counts_made, "{what}");
                heights_seen.extend(bands);
            }
        });
    }
    // Single rows, whole frames, and several heights between.
    let expected_ends = heights_seen.contains(&1) && heights_seen.contains(&5);
    assert!(expected_ends && heights_seen.len() > 4, "bands were too much alike: {heights_seen:?}");
}

// --- crops ---------------------------------------------------------------------------------------------------------

fn crop_commutes<S: Stage>(
    whole: &MemoryFrame,
    stage: impl Fn(&FrameHeader) -> S,
    [x, y, width, height]: [usize; 4],
) -> Result<(), TestCaseError> {
    let of_whole = crop(&through(whole, &stage(&whole.header)), x, y, width, height);
    let part = crop(whole, x, y, width, height);
    let of_crop = through(&part, &stage(&part.header));
    prop_assert_eq!(first_difference(&of_whole, &of_crop), None);
    prop_assert_eq!(of_whole.header, of_crop.header);
    Ok(())
}

/// The noise of a crop is the crop of the noise, and so are its mosaic and its codes, wherever on the sensor the frame
/// lies.
#[test]
fn what_happens_to_a_crop_is_the_crop_of_what_happens() {
    let far = prop_oneof![-9..9, Just(i32::MIN), Just(i32::MAX - 4), Just(2653)];
    let origins = (far.clone(), far);
    let crops = (0_usize..8, 0_usize..7, 1_usize..9, 1_usize..8);
    for_all(96, (origins, crops, pattern()), |((x0, y0), (x, y, width, height), cfa)| {
        let part = [x, y, width, height];
        let mut three = expected(17, 15, any_light);
        three.header.geometry.origin = [x0, y0];
        crop_commutes(&three, |header| noise(header, 3), part)?;
        crop_commutes(&three, |header| Mosaic::new(header, Some(cfa)).unwrap(), part)?;
        let light = through(&three, &Mosaic::new(&three.header, Some(cfa)).unwrap());
        crop_commutes(&light, |header| noise(header, 3), part)?;
        let electrons = through(&light, &noise(&light.header, 3));
        crop_commutes(&electrons, digitizer, part)
    });
}

/// Away from the edges, where mirrored samples stand in for those that the crop has lost.
#[test]
fn the_demosaicked_crop_is_the_crop_of_the_demosaicked() {
    let crops = (0_usize..5, 0_usize..5, 8_usize..12, 8_usize..12);
    for_all(96, (method(), pattern(), -3..3, -3..3, crops), |(method, cfa, x0, y0, crops)| {
        let (x, y, width, height) = crops;
        let whole = plane([17, 16], [x0, y0], cfa, |x, y, _| 900.0 * scatter(x, y, 0) + 1.0);
        let of_whole = demosaicked(&whole, method);
        let of_crop = demosaicked(&crop(&whole, x, y, width, height), method);
        let reach = method.reach();
        let inner = |frame: &MemoryFrame, x: usize, y: usize| {
            crop(frame, x + reach, y + reach, width - 2 * reach, height - 2 * reach)
        };
        let difference = first_difference(&inner(&of_whole, x, y), &inner(&of_crop, 0, 0));
        prop_assert_eq!(difference, None);
        Ok(())
    });
}

// --- the color filter array ---------------------------------------------------------------------------------------

#[test]
fn the_mosaic_commutes_with_noise_and_with_the_converter() {
    for_all(64, (pattern(), -3..3, -3..3, any::<u64>()), |(cfa, x0, y0, seed)| {
        let seed = seed >> 1;
        let mut three = expected(21, 18, any_light);
        three.header.geometry.origin = [x0, y0];
        let mosaic = |frame: &MemoryFrame| through(frame, &Mosaic::new(&frame.header, Some(cfa)).unwrap());
        let noise = |frame: &MemoryFrame| through(frame, &noise(&frame.header, seed));
        let digitize = |frame: &MemoryFrame| through(frame, &digitizer(&frame.header));
        let same = |a: MemoryFrame, b: MemoryFrame| {
            prop_assert_eq!(first_difference(&a, &b), None);
            prop_assert_eq!(a.header, b.header);
            Ok(())
        };
        let electrons = noise(&three);
        let last = mosaic(&digitize(&electrons));
        same(mosaic(&electrons), noise(&mosaic(&three)))?;
        same(last.clone(), digitize(&mosaic(&electrons)))?;
        same(last, digitize(&noise(&mosaic(&three))))
    });
}

#[test]
fn a_plane_rendered_behind_a_pattern_is_the_mosaic_of_three() {
    let cases = (pattern(), -3..3, -3..3, 1_usize..6, 1_usize..6, any::<bool>(), 1_usize..5);
    for_all(64, cases, |(cfa, x0, y0, patch_x, patch_y, vignetted, together)| {
        let size: [usize; 2] = [19, 14];
        let pixels = [size[0].div_ceil(patch_x), size[1].div_ceil(patch_y)];
        let vignetting = vignetted.then(|| Vignetting::new(size[0], size[1], 900.0, 30.0));
        let render = |cfa: Option<CfaPattern>, together: usize| {
            let channels: &[&str] = if cfa.is_some() { &["Y"] } else { &["R", "G", "B"] };
            let mut header = header(QuantityKind::ExpectedElectrons, Geometry::new(size[0], size[1], channels));
            header.geometry.origin = [x0, y0];
            header.metadata.cfa = cfa.map(Into::into);
            let rendering =
                Rendering { header: header.clone(), patch: [patch_x, patch_y], vignetting: vignetting.clone(), cfa };
            let mut sink = MemoryFrame::new(header, Vec::new());
            let pixel = |x, row| [0, 1, 2].map(|class| 3e4 * f64::from(scatter(x, row, class)));
            let row = |row| (0..pixels[0]).map(|x| pixel(x, row)).collect();
            let rows: Vec<Vec<[f64; 3]>> = (0..rendering.source_rows()).map(row).collect();
            assert_eq!(rows.len(), pixels[1]);
            // However the source's rows come.
            for (index, rows) in rows.chunks(together).enumerate() {
                rendering.draw(index * together, rows, &mut sink, &mut |_| ()).unwrap();
            }
            sink
        };
        let three = render(None, 14);
        let mosaicked = through(&three, &Mosaic::new(&three.header, Some(cfa)).unwrap());
        prop_assert_eq!(first_difference(&mosaicked, &render(Some(cfa), together)), None);
        Ok(())
    });
}

// --- seeds, frames, sources ----------------------------------------------------------------------------------------

const FIXED: [Source; 2] = [Source::Dcnu, Source::Prnu];
const TEMPORAL: [Source; 3] = [Source::Dcsn, Source::Ssn, Source::Ron];

fn all_but(kept: &[Source]) -> Vec<Source> {
    Source::ALL.into_iter().filter(|source| !kept.contains(source)).collect()
}

#[test]
fn frames_change_temporal_noise_and_sensors_change_patterns() {
    let mut light = expected(33, 20, |x, y, class| 9000.0 * scatter(x, y, class as usize) + 20.0);
    let readout = light.header.metadata.sensor.as_mut().unwrap().readout.as_mut().unwrap();
    (readout.row_noise_e, readout.column_noise_e, readout.dsnu_e) = (3.0, 2.0, 4.0);
    (readout.dsnu_row_e, readout.dsnu_column_e) = (1.0, 5.0);
    (readout.prnu_row, readout.prnu_column) = (0.01, 0.02);
    (readout.black_drift_e, readout.black_drift_rows) = (3.0, 6.5);
    // Every photosite is hot, and has a trap, the amplitude of which stays with the sensor.
    (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (1.0, 500.0);
    (readout.rts_share, readout.rts_amplitude_e) = (1.0, 8.0);
    let take = |kept: &[Source], seed, sensor_seed, frame| {
        let without = all_but(kept);
        noisy(&light, &NoiseSettings { seed, sensor_seed, frame, without, ..Default::default() })
    };
    for source in Source::ALL {
        let base = take(&[source], 1, 2, 3);
        assert_same(&base, &take(&[source], 1, 2, 3), "the same again");
        let share_changed = |other: &MemoryFrame| {
            let changed = bits(&base).iter().zip(bits(other)).filter(|(a, b)| **a != *b).count();
            changed as f64 / base.samples.len() as f64
        };
        let jumps = source == Source::Rts;
        let (temporal, fixed) = (!source.is_fixed_pattern(), source.is_fixed_pattern() || jumps);
        // Of jumps to three levels, the middle one in half of the frames, three in eight are to the same.
        let least = if jumps { 0.4 } else { 0.9 };
        for (other, changes) in [
            (take(&[source], 9, 2, 3), temporal),
            (take(&[source], 1, 2, 4), temporal),
            (take(&[source], 1, 9, 3), fixed),
        ] {
            let share = share_changed(&other);
            // Where noise is drawn anew, Poisson counts of the least light, 20 e⁻, agree by chance in 1/(2 √(π·20)) =
            // 6 % of photosites; so do dark counts of 73 e⁻ in 3 %.
            assert!(if changes { share > least } else { share == 0.0 }, "{source:?}: {share}");
        }
    }
    assert_same(&take(&FIXED, 1, 2, 3), &take(&FIXED, 8, 2, 7), "fixed patterns of one sensor");
    assert_same(&take(&TEMPORAL, 1, 2, 3), &take(&TEMPORAL, 1, 5, 3), "temporal noise of one frame");
}

/// M = DCSN ∘ DCNU + SSN ∘ PRNU + RON: what the five sources give one by one makes up what they give together, so each
/// draw is the same whatever else is drawn.
#[test]
fn a_source_left_out_leaves_the_other_draws_alone() {
    let lit = expected(40, 31, |x, y, class| 100.0 + 20_000.0 * scatter(x, y, class as usize));
    let dark = expected(40, 31, |_, _, _| 0.0);
    for poisson in [PoissonKind::Exact, PoissonKind::Gaussian] {
        // At 1 K there is no dark current.
        let take = |scene: &MemoryFrame, kept: &[Source], temperature_k| {
            let without = all_but(kept);
            noisy(
                scene,
                &NoiseSettings {
                    seed: 11,
                    sensor_seed: 12,
                    frame: 13,
                    without,
                    temperature_k: Some(temperature_k),
                    poisson,
                    cte: None,
                    clean: false,
                },
            )
        };
        let shot = take(&lit, &[Source::Ssn], 1.0);
        let response = take(&lit, &[Source::Prnu], 1.0);
        let dark_shot = take(&dark, &[Source::Dcsn], 333.0);
        let dark_response = take(&dark, &[Source::Dcnu], 333.0);
        let read = take(&dark, &[Source::Ron], 1.0);
        let dark_e = take(&dark, &[], 333.0).samples[0];
        for left_out in [None, Some(Source::Ron), Some(Source::Prnu), Some(Source::Dcsn)] {
            let kept: Vec<Source> = Source::ALL.into_iter().filter(|source| Some(*source) != left_out).collect();
            let together = take(&lit, &kept, 333.0);
            for (i, &sample) in together.samples.iter().enumerate() {
                let part = |frame: &MemoryFrame| f64::from(frame.samples[i]);
                let or = |source, value: f64, otherwise| {
                    if left_out == Some(source) { otherwise } else { value }
                };
                let (expected, dark_e) = (part(&lit), f64::from(dark_e));
                let light = part(&shot) * or(Source::Prnu, part(&response) / expected, 1.0);
                let dark = or(Source::Dcsn, part(&dark_shot), dark_e) * part(&dark_response) / dark_e;
                let sum = light + dark + or(Source::Ron, part(&read), 0.0);
                // Samples are rounded to half of 2⁻²³ of themselves, and so is each step of the sum: of the light two
                // factors, their product and the quotient that stands for one of them, as much of the dark, and
                // the two sums.
                let bound = 6.0 * 0.5 * f64::from(f32::EPSILON) * (light + dark + 60.0);
                assert!((f64::from(sample) - sum).abs() <= bound, "{left_out:?}, sample {i}: {sample} {sum}");
            }
        }
    }
}

/// The average of many frames is the fixed pattern, with what is left of the temporal noise: (λX² + QY² + R²)/N in the
/// photosite with sensitivities X and Y.
#[test]
fn averaged_frames_converge_to_the_fixed_pattern() {
    const FRAMES: u32 = 64;
    let level = 2000.0;
    let light = expected(30, 24, |_, _, _| level);
    let model = &readout();
    for sensor_seed in [0, 77] {
        let settings = NoiseSettings { seed: 4, sensor_seed, ..Default::default() };
        let pattern = noisy(&light, &NoiseSettings { without: TEMPORAL.into(), ..settings.clone() });
        let response = noisy(
            &light,
            &NoiseSettings { without: all_but(&[Source::Prnu]), temperature_k: Some(1.0), ..settings.clone() },
        );
        let dark_e = model.dark_current_e_per_s(333.0) * EXPOSURE.exposure_s;
        let mut sums = vec![0.0; light.samples.len()];
        for frame in 0..FRAMES {
            let noisy = noisy(&light, &NoiseSettings { frame, ..settings.clone() });
            for (sum, sample) in sums.iter_mut().zip(&noisy.samples) {
                *sum += f64::from(*sample);
            }
        }
        let frames = f64::from(FRAMES);
        let mut chi_square = 0.0;
        for ((sum, pattern), response) in sums.iter().zip(&pattern.samples).zip(&response.samples) {
            let x = f64::from(*response) / f64::from(level);
            let y = f64::from(pattern - response) / dark_e;
            let variance = f64::from(level) * x * x + dark_e * y * y + model.read_noise_e.powi(2);
            let z = (sum / frames - f64::from(*pattern)) / (variance / frames).sqrt();
            // 4320 photosites in all: |z| > 6 has a chance of 10⁻⁵.
            assert!(z.abs() < 6.0, "{z}");
            chi_square += z * z;
        }
        // Σz² has mean n and variance 2n: five of its standard deviations.
        let n = sums.len() as f64;
        assert!((chi_square - n).abs() < 5.0 * (2.0 * n).sqrt(), "{chi_square} {n}");
    }
}

/// A map of sensitivities has the mean and the spread that its description says: 1 and σ, for the rectified normal its
/// own.
#[test]
fn maps_of_sensitivity_have_mean_one_and_the_stated_rms() {
    let n = 200.0 * 150.0 * 3.0;
    for sensor_seed in 0..4 {
        for (source, sigma) in
            [(Source::Prnu, 0.008), (Source::Prnu, 0.05), (Source::Dcnu, 0.2), (Source::Dcnu, 0.5), (Source::Dcnu, 1.5)]
        {
            let (level, temperature_k) = if source == Source::Prnu { (10_000.0, 1.0) } else { (0.0, 333.0) };
            let mut scene = expected(200, 150, |_, _, _| level);
            let readout = scene.header.metadata.sensor.as_mut().and_then(|sensor| sensor.readout.as_mut()).unwrap();
            (readout.prnu, readout.dcnu) = (sigma, sigma);
            let dark_e = readout.dark_current_e_per_s(temperature_k) * EXPOSURE.exposure_s;
            let unit = if source == Source::Prnu { f64::from(level) } else { dark_e };
            let without = all_but(&[source]);
            let settings =
                NoiseSettings { sensor_seed, without, temperature_k: Some(temperature_k), ..Default::default() };
            let stage = AddNoise::new(&scene.header, &settings).unwrap();
            if source == Source::Dcnu {
                let noted = stage.header().metadata.dark_signal_e.unwrap();
                assert!((noted / (dark_e * rectified_mean(sigma)) - 1.0).abs() < 1e-12);
            }
            let map = through(&scene, &stage);
            let power = |k: i32| map.samples.iter().map(|&s| (f64::from(s) / unit).powi(k)).sum::<f64>() / n;
            let (mean, square, fourth) = (power(1), power(2), power(4));
            let (true_mean, true_square) = (rectified_mean(sigma), rectified_mean_square(sigma));
            let true_variance = true_square - true_mean * true_mean;
            // Five standard errors, of the mean by the true variance and of the mean square by the map's own fourth
            // moment; samples are rounded to 6·10⁻⁸.
            let bound = 5.0 * (true_variance / n).sqrt() + 6e-8;
            assert!((mean - true_mean).abs() < bound, "{source:?} {sigma}: {mean} {true_mean}");
            let bound = 5.0 * ((fourth - square * square) / n).sqrt() + 1.2e-7;
            assert!((square - true_square).abs() < bound, "{source:?} {sigma}: {square} {true_square}");
            // The spread itself: 5 √((2 + κ)/4n), κ of the rectified normal below 1 here.
            let (std, true_std) = ((square - mean * mean).sqrt(), true_variance.sqrt());
            assert!((std / true_std - 1.0).abs() < 5.0 * (3.0 / (4.0 * n)).sqrt(), "{std} {true_std}");
            assert!(map.samples.iter().all(|&s| s >= 0.0), "a sensitivity is negative");
        }
    }
}

// --- demosaicking --------------------------------------------------------------------------------------------------

/// Whole numbers below 2¹¹: with weights of thirty-seconds at most, sums have few enough bits to be exact in 32-bit
/// floats.
fn whole_numbers(seed: usize) -> impl Fn(usize, usize, Class) -> f32 {
    move |x, y, _| (2047.0 * scatter(x + seed % 50, y + seed / 50, seed)).round()
}

fn sizes() -> impl Strategy<Value = [usize; 2]> {
    prop::array::uniform2(2_usize..14)
}

#[test]
fn measured_samples_are_kept() {
    let cases = (method(), pattern(), sizes(), -2..2, -2..2, -99.0..99.0_f64);
    for_all(256, cases, |(method, cfa, size, x0, y0, black)| {
        let plane = plane(size, [x0, y0], cfa, |x, y, _| 1e3 * scatter(x, y, 1) - 300.0);
        let stage = Demosaic::new(&plane.header, method, Black::Level(black.into()), None).unwrap();
        let made = through(&plane, &stage);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let class = cfa.row_classes([x0, y0], y)[x % 2];
                let measured = to_sample(f64::from(at(&plane, x, y, 0)) - black);
                prop_assert_eq!(at(&made, x, y, class as usize), measured);
            }
        }
        Ok(())
    });
}

/// Planes that are linear in position come back, away from the mirrored edges: to the bit by BI, ECI and MHC,
/// whose weights are whole fractions of 32, and by SHTI where planes share their hue, here ½ and 1½ of green: such quotients
/// are exact.
#[test]
fn linear_ramps_are_restored() {
    let slopes = prop::array::uniform3((1_i32..60, -9_i32..9, -9_i32..9));
    for_all(128, (method(), pattern(), slopes, -2..2, -2..2), |(method, cfa, slopes, x0, y0)| {
        let value = |x: usize, y: usize, class: Class| {
            let shared = method == Method::SmoothHue;
            let (level, by_x, by_y) = slopes[if shared { 0 } else { class as usize }];
            let ramp = f64::from(300 + level) + f64::from(by_x) * x as f64 + f64::from(by_y) * y as f64;
            if shared { (1.0 + f64::from(class as u8)) * ramp } else { ramp }
        };
        let size = [15, 13];
        let made = demosaicked(&plane(size, [x0, y0], cfa, |x, y, class| to_sample(value(x, y, class))), method);
        let reach = method.reach();
        for y in reach..size[1] - reach {
            for x in reach..size[0] - reach {
                for class in Class::ALL {
                    let (found, true_value) = (at(&made, x, y, class as usize), value(x, y, class));
                    prop_assert!(
                        f64::from(found) == true_value,
                        "{:?} {} {:?} at {},{}: {} {}",
                        method,
                        cfa,
                        class,
                        x,
                        y,
                        found,
                        true_value
                    );
                }
            }
        }
        Ok(())
    });
}

#[test]
fn the_linear_methods_are_linear() {
    let linear = prop::sample::select(vec![Method::Bilinear, Method::EffectiveColor, Method::Malvar]);
    for_all(128, (linear, pattern(), sizes(), -3_i8..4), |(method, cfa, size, factor)| {
        let (a, b) = (whole_numbers(1), whole_numbers(2));
        let factor = f32::from(factor);
        let sum = |x, y, class| a(x, y, class) + factor * b(x, y, class);
        let make = |f: &dyn Fn(usize, usize, Class) -> f32| demosaicked(&plane(size, [0, 0], cfa, f), method);
        let (of_a, of_b, of_sum) = (make(&a), make(&b), make(&sum));
        for ((a, b), sum) in of_a.samples.iter().zip(&of_b.samples).zip(&of_sum.samples) {
            prop_assert_eq!(*sum, a + factor * b);
        }
        Ok(())
    });
}

/// Smooth hue transition is not linear, but what doubles the light doubles the result; and a gain of one class is that
/// class's gain in the result with the methods that do not
/// take one class from another, green excepted, by which smooth hue transition divides.
#[test]
fn every_method_scales_with_the_light() {
    for_all(96, (method(), pattern(), sizes(), -6..7), |(method, cfa, size, exponent)| {
        let light = |x, y, _| 1.0 + 3000.0 * scatter(x, y, 5);
        let gain = 2.0_f32.powi(exponent);
        let made = demosaicked(&plane(size, [0, 0], cfa, light), method);
        let brighter = demosaicked(&plane(size, [0, 0], cfa, |x, y, class| gain * light(x, y, class)), method);
        for (a, b) in made.samples.iter().zip(&brighter.samples) {
            prop_assert_eq!(gain * a, *b);
        }
        let redder = |x, y, class| if class == Class::Red { gain } else { 1.0 } * light(x, y, class);
        let redder = demosaicked(&plane(size, [0, 0], cfa, redder), method);
        if matches!(method, Method::Bilinear | Method::SmoothHue) {
            let geometry = &made.header.geometry;
            for y in 0..geometry.height {
                for x in 0..geometry.width {
                    prop_assert_eq!(gain * at(&made, x, y, 0), at(&redder, x, y, 0));
                    prop_assert_eq!(at(&made, x, y, 1), at(&redder, x, y, 1));
                    prop_assert_eq!(at(&made, x, y, 2), at(&redder, x, y, 2));
                }
            }
        }
        Ok(())
    });
}

/// A frame seen in a mirror gives the mirrored result: edges are mirrored about their sample, which keeps the phase of
/// the pattern. Odd sizes keep their pattern, even ones change it.
#[test]
fn reflected_frames_give_reflected_results() {
    for_all(192, (method(), pattern(), sizes(), 0_usize..3), |(method, cfa, size, how)| {
        let [width, height] = size;
        let reflect = |x: usize, y: usize| match how {
            0 => (width - 1 - x, y),
            1 => (x, height - 1 - y),
            _ => (y, x),
        };
        // SHTI divides, so its sums are not exact; a transposition swaps their order: on each side two roundings of the
        // sum of four positive hues, one of the product, each of relative error 2⁻²⁴, half of EPSILON.
        let is_exact = method != Method::SmoothHue || how < 2;
        let mirrored_size = if how == 2 { [height, width] } else { size };
        let class_at = |x: i64, y: i64| match how {
            0 => cfa.class(width as i64 - 1 - x, y),
            1 => cfa.class(x, height as i64 - 1 - y),
            _ => cfa.class(y, x),
        };
        let mirrored_cfa = CfaPattern::ALL
            .into_iter()
            .find(|other| (0..4).all(|i| other.class(i % 2, i / 2) == class_at(i % 2, i / 2)))
            .unwrap();
        if how < 2 && size[how] % 2 == 1 {
            prop_assert_eq!(mirrored_cfa, cfa);
        }
        let values = whole_numbers(3);
        let value = |x, y, class| values(x, y, class) + 1.0;
        let made = demosaicked(&plane(size, [0, 0], cfa, value), method);
        let mirrored = plane(mirrored_size, [0, 0], mirrored_cfa, |x, y, class| {
            let (x, y) = reflect(x, y);
            value(x, y, class)
        });
        let mirrored = demosaicked(&mirrored, method);
        for y in 0..mirrored_size[1] {
            for x in 0..mirrored_size[0] {
                for channel in 0..3 {
                    let (from_x, from_y) = reflect(x, y);
                    let a = at(&made, from_x, from_y, channel);
                    let b = at(&mirrored, x, y, channel);
                    let bound = if is_exact { 0.0 } else { 3.01 * f32::EPSILON * a.abs() };
                    prop_assert!((a - b).abs() <= bound, "{:?} {} {}: {} {}", method, cfa, how, a, b);
                }
            }
        }
        Ok(())
    });
}

/// Moved by whole periods of the pattern, a scene gives the same result, moved, away from the edges.
#[test]
fn moved_frames_give_moved_results() {
    for_all(64, (method(), pattern(), 0_usize..3, 0_usize..3), |(method, cfa, by_x, by_y)| {
        let (by_x, by_y, size) = (2 * by_x, 2 * by_y, 14);
        let value = |x: usize, y: usize| 1.0 + 500.0 * scatter(x, y, 9);
        let still = demosaicked(&plane([size, size], [0, 0], cfa, |x, y, _| value(x, y)), method);
        let moved = plane([size, size], [0, 0], cfa, |x, y, _| value(x + by_x, y + by_y));
        let moved = demosaicked(&moved, method);
        let reach = method.reach();
        let inner = |frame: &MemoryFrame, x: usize, y: usize| {
            crop(frame, x + reach, y + reach, size - by_x - 2 * reach, size - by_y - 2 * reach)
        };
        prop_assert_eq!(first_difference(&inner(&still, by_x, by_y), &inner(&moved, 0, 0)), None);
        Ok(())
    });
}

/// Where the mean of a few finite samples is finite, so is whatever is made of them: zeros, negative numbers and the
/// ends of the range of floats.
#[test]
fn finite_samples_stay_finite() {
    let sample = prop_oneof![
        3 => Just(0.0_f32),
        1 => Just(-0.0_f32),
        3 => -50.0..50.0_f32,
        1 => prop::sample::select(vec![1e-45_f32, -1e-45, 1e-38, 1e-20, -1e20]),
        1 => prop::sample::select(vec![f32::MAX, f32::MIN, 3e38]),
    ];
    let samples = prop::collection::vec(sample, 7 * 6);
    for_all(600, (method(), pattern(), samples), |(method, cfa, samples)| {
        let plane = plane([7, 6], [0, 0], cfa, |x, y, _| samples[y * 7 + x]);
        let made = demosaicked(&plane, method);
        let broken = made.samples.iter().position(|sample| !sample.is_finite());
        prop_assert_eq!(broken, None, "{:?}", method);
        Ok(())
    });
}

// --- the converter -------------------------------------------------------------------------------------------------

#[test]
fn codes_rise_with_charge_and_tell_it_to_half_a_code() {
    let charges = prop::collection::vec(-3e4..9e4_f32, 2..40);
    let settings = (1_u32..=16, -50.0..3000.0_f64, 0.001..3.0_f64);
    for_all(256, (charges, settings), |(mut charges, (bits, bias_adu, adu_per_e))| {
        charges.sort_by(f32::total_cmp);
        let geometry = Geometry::new(charges.len(), 1, &["Y"]);
        let header = header(QuantityKind::Electrons, geometry);
        let settings = AdcSettings { bits: Some(bits), bias_adu: Some(bias_adu), adu_per_e: Some(adu_per_e) };
        let stage = Digitize::new(&header, &settings).unwrap();
        let electrons = frame(header.clone(), |x, _, _| charges[x]);
        let (codes, counts) = through_cuts(&electrons, &stage, &[]);
        let top = f64::from((1_u32 << bits) - 1);
        let level = |charge: f32| bias_adu + adu_per_e * f64::from(charge);
        prop_assert!(codes.samples.is_sorted(), "{:?}", codes.samples);
        for (&charge, &code) in charges.iter().zip(&codes.samples) {
            let code = f64::from(code);
            prop_assert!(code.fract() == 0.0 && (0.0..=top).contains(&code));
            if (0.0..=top).contains(&level(charge)) {
                // Half a code, and the rounding of the products: 2⁻⁵² of levels below 3·10⁵.
                prop_assert!((code - level(charge)).abs() <= 0.5 + 1e-9, "{} {}", code, charge);
            }
        }
        let below = charges.iter().filter(|&&charge| level(charge).round() < 0.0).count() as u64;
        let above = charges.iter().filter(|&&charge| level(charge).round() > top).count() as u64;
        prop_assert_eq!((counts.clipped_low, counts.clipped_high), (below, above));
        // What a code stands for becomes that code again.
        let back = frame(header, |x, _, _| to_sample((f64::from(codes.samples[x]) - bias_adu) / adu_per_e));
        let (again, counts) = through_cuts(&back, &stage, &[]);
        prop_assert_eq!(first_difference(&codes, &again), None);
        prop_assert_eq!((counts.clipped_low, counts.clipped_high), (0, 0));
        Ok(())
    });
}

#[test]
fn what_is_no_number_is_counted_and_not_made_a_code() {
    let header = header(QuantityKind::Electrons, Geometry::new(3, 1, &["Y"]));
    let strange = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let (codes, counts) = through_cuts(&frame(header.clone(), |x, _, _| strange[x]), &digitizer(&header), &[]);
    assert!(codes.samples[0].is_nan());
    assert_eq!(codes.samples[1..], [4095.0, 0.0]);
    assert_eq!((counts.not_finite, counts.clipped_high, counts.clipped_low), (1, 1, 1));
}

// --- charge transfer -----------------------------------------------------------------------------------------------

/// The factor by which undoing transfer may magnify errors: (1 + ε)^i / (1 − ε)^(i + 1) of the last row and column.
fn gain(cte: f64, [width, height]: [usize; 2]) -> f64 {
    let along = |length: usize| (2.0 - cte).powf(length as f64 - 1.0) / cte.powf(length as f64);
    along(width) * along(height)
}

/// What four sums (two of transfer, two of its undoing) leave out of samples up to 1.
const LEFT_OUT: f64 = 4e-10;

/// Charge of one exposure without read noise, which joins it after transfer.
fn charge(light: &MemoryFrame, cte: Option<f64>) -> MemoryFrame {
    noisy(light, &NoiseSettings { seed: 8, without: vec![Source::Ron], cte, ..Default::default() })
}

#[test]
fn transfer_is_undone_to_the_rounding_of_samples() {
    for (cte, size, cfa) in
        [(0.999995, [530, 401], None), (0.999, [150, 190], Some(CfaPattern::Gbrg)), (0.9, [9, 8], None)]
    {
        let [width, height] = size;
        let mut light = expected(width, height, |x, y, class| 39_000.0 * scatter(x, y, class as usize));
        if cfa.is_some() {
            light = through(&light, &Mosaic::new(&light.header, cfa).unwrap());
        }
        let (still, mut moved) = (charge(&light, None), charge(&light, Some(cte)));
        // The charge as a converter of one code per electron would give it that neither rounds nor clips.
        moved.header.metadata.quantity = QuantityKind::Adu;
        let restored = through(&moved, &correction(&moved.header, Black::Level(0.0.into()), Some(cte)));
        let brightest = f64::from(still.samples.iter().copied().fold(0.0, f32::max));
        // 2⁻²⁴ is half an ulp: of what is undone, of the result, and of what it is compared with.
        let gain = gain(cte, size);
        let bound = brightest * (2.0_f64.powi(-24) * (gain + 2.0) + LEFT_OUT * gain);
        assert!(bound < 0.05 || cte < 0.95, "{bound}");
        for (a, b) in still.samples.iter().zip(&restored.samples) {
            assert!(f64::from((a - b).abs()) <= bound, "{cte}: {a} {b}, {bound}");
        }
        // Otherwise there was nothing to undo.
        let lost = still.samples.iter().zip(&moved.samples).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(f64::from(lost) > 2.0 * bound, "{cte}: {lost} {bound}");
    }
}

#[test]
fn transfer_is_undone_to_the_rounding_of_the_converter() {
    for (cte, black) in [(0.999995, Black::None), (0.9999, Black::None), (0.9999, Black::Auto), (0.998, Black::Auto)] {
        let size = [180, 140];
        let light = expected(size[0], size[1], |x, y, class| 20_000.0 * scatter(x, y, class as usize));
        let (still, moved) = (charge(&light, None), charge(&light, Some(cte)));
        let codes = through(&moved, &digitizer(&moved.header));
        let restored = through(&codes, &correction(&codes.header, black, Some(cte)));
        let record = codes.header.metadata.adc.unwrap();
        // Half a code, magnified; the rest is far below it.
        let bound = 0.5 * gain(cte, size) + 0.01;
        // The dark signal of the untransferred frame is what the metadata now call black, or what was subtracted.
        let dark_adu = record.adu_per_e * still.header.metadata.dark_signal_e.unwrap();
        let (offset, level) = match black {
            Black::None => (record.bias_adu, record.bias_adu + dark_adu),
            _ => (-dark_adu, 0.0),
        };
        let found = restored.header.uniform_black_adu().unwrap();
        assert!((found - level).abs() < 1e-9, "{cte}: black {found}, not {level}");
        for (charge, code) in still.samples.iter().zip(&restored.samples) {
            let wanted = offset + record.adu_per_e * f64::from(*charge);
            assert!((wanted - f64::from(*code)).abs() <= bound, "{cte} {black:?}: {wanted} {code}, {bound}");
        }
    }
}

/// Each direction keeps the share 1 − ε of uniform charge, from the first photosite on.
#[test]
fn uniform_charge_stays_uniform() {
    for (cte, level) in [(1.0, 900.0), (0.999995, 30_000.0), (0.9999, 100.0), (0.99, 25_000.0)] {
        let light = expected(210, 160, |_, _, _| level);
        // At 1 K there is no dark current.
        let settings = NoiseSettings {
            without: Source::ALL.to_vec(),
            temperature_k: Some(1.0),
            cte: Some(cte),
            ..Default::default()
        };
        let moved = noisy(&light, &settings);
        let wanted = f64::from(level) * cte.powi(2);
        for &sample in &moved.samples {
            // Half an ulp of a sample, and what two sums leave out.
            let bound = f64::from(level) * (2.0_f64.powi(-24) + 2e-10);
            assert!((f64::from(sample) - wanted).abs() <= bound, "{cte}: {sample}, not {wanted}");
        }
        let dark = |cte| {
            let settings = NoiseSettings { cte, ..Default::default() };
            noisy(&light, &settings).header.metadata.dark_signal_e.unwrap()
        };
        assert!((dark(Some(cte)) / dark(None) - cte * cte).abs() < 1e-14, "{cte}");
    }
}

/// Where every packet moves as a whole, transfer changes no sample.
#[test]
fn perfect_transfer_is_none() {
    let light = expected(40, 30, any_light);
    let settings = |cte| NoiseSettings { seed: 2, cte, ..Default::default() };
    let plain = noisy(&light, &settings(None));
    assert_same(&plain, &noisy(&light, &settings(Some(1.0))), "cte 1");
}

/// The mean of dark frames comes off sample by sample, however the rows are asked for.
#[test]
fn darks_are_subtracted_in_step() {
    let codes =
        |seed: usize| plane([31, 17], [0, 0], CfaPattern::Rggb, |x, y, _| (4095.0 * scatter(x, y, seed)).round());
    let (frame, darks) = (codes(0), [1, 2, 3].map(codes));
    let stack = DarkStack::of(darks.iter().map(|dark| &dark.header)).unwrap();
    let settings = CorrectionSettings { black: Black::None, cte: None };
    let stage = CorrectFrame::new(&frame.header, &settings, stack.as_ref()).unwrap();
    // Neither they nor the frame say which sensor took them: no doubt of the darks.
    assert!(stage.warnings().is_empty(), "{:?}", stage.warnings());
    for step in [1, 2, 5, 17] {
        let (mut source, mut stack) = (frame.clone(), DarkFrames::of(darks.to_vec()).unwrap().unwrap());
        let mut less = LessDarks::new(&mut source, &mut stack);
        let mut samples = Vec::new();
        for first in (0..17).step_by(step) {
            less.read(step.min(17 - first), &mut samples).unwrap();
        }
        let made = through(&MemoryFrame::new(frame.header.clone(), samples), &stage);
        for (index, sample) in made.samples.iter().enumerate() {
            let sum: f64 = darks.iter().map(|dark| f64::from(dark.samples[index])).sum();
            assert_eq!(*sample, to_sample(f64::from(frame.samples[index]) - sum / 3.0));
        }
    }
}

// --- metadata ------------------------------------------------------------------------------------------------------

/// Keys that this version does not know, the sensor and the exposure pass every stage, and every stage's record comes
/// back from YAML as it went.
#[test]
fn metadata_pass_every_stage_and_yaml() {
    let mut first = expected(8, 6, |_, _, _| 500.0);
    let text = write_metadata(&first.header.metadata).unwrap()
        + "observatory: {name: Pic du Midi, height_m: 2877}\nremarks: [clear, 'no: clouds']\n";
    let metadata = parse_metadata("test", &text).unwrap();
    let unknown = metadata.unknown.clone();
    assert_eq!(unknown.len(), 2);
    first.header.metadata = metadata;
    let known_sensor = first.header.metadata.sensor.clone();
    assert!(known_sensor.is_some());
    let mut seen = Vec::new();
    let mut check = |header: &FrameHeader| {
        let metadata = &header.metadata;
        assert_eq!(metadata.unknown, unknown, "{}", metadata.quantity);
        assert_eq!(metadata.sensor, known_sensor, "{}", metadata.quantity);
        assert_eq!(metadata.exposure, Some(EXPOSURE), "{}", metadata.quantity);
        assert_eq!(metadata.unit, metadata.quantity.unit());
        assert_eq!(header.name, "test");
        let text = write_metadata(metadata).unwrap();
        assert_eq!(parse_metadata("test", &text).unwrap(), *metadata, "{text}");
        assert_eq!(write_metadata(&parse_metadata("test", &text).unwrap()).unwrap(), text);
        seen.push(metadata.quantity);
    };
    check(&first.header);
    let settings = NoiseSettings { seed: u64::MAX, sensor_seed: 3, frame: 9, ..Default::default() };
    let electrons = noisy(&first, &settings);
    check(&electrons.header);
    let codes = through(&electrons, &digitizer(&electrons.header));
    check(&codes.header);
    let cfa = through(&codes, &Mosaic::new(&codes.header, None).unwrap());
    check(&cfa.header);
    check(correction(&cfa.header, Black::Auto, Some(0.999)).header());
    check(Import::new(&cfa.header).unwrap().header());
    let settings = NoiseSettings { cte: Some(0.99), ..settings };
    check(AddNoise::new(&first.header, &settings).unwrap().header());
    for method in Method::ALL {
        let rgb = through(&cfa, &Demosaic::new(&cfa.header, method, Black::Auto, None).unwrap());
        check(&rgb.header);
        for space in SPACES {
            let stage = ToXyz::new(&rgb.header, &color_settings(space)).unwrap();
            check(&through(&rgb, &stage).header);
        }
    }
    assert_eq!(seen.len(), 7 + Method::ALL.len() * 5);
}

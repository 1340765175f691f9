//! Exposures of one scene: what scatters from frame to frame and what is the same in all, beside what is predicted of both.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{
    OverFrames, OverFramesSettings, RepeatedChannel, RepeatedRegion, RepeatedReport, Saturated, measure,
};
use cyanometer::camera::levels::BlackLevel;
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::CfaPattern;
use cyanometer::color::{Space, White};
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::masking::Corrections;
use cyanometer::metadata::{FrameHeader, LeftOut, Metadata, Scene};
use cyanometer::numerics::averages::Combine;
use cyanometer::numerics::significance::of_smallest;
use cyanometer::propagation::Equations;
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::random::philox::philox4x32_10;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::{DarkFrames, DarkSettings};
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::flats::FlatFrames;
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{MemoryFrame, Stage};
use cyanometer::units::QuantityKind;
use rayon::prelude::*;
use support::alarms::judge;
use support::chain::averaged;
use support::misses;
use support::{sensor, through};

/// Even numbers.
struct Random(u32, u32);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.1 += 1;
        let [word, ..] = philox4x32_10([self.1, 0, 0, 0], [self.0, 78]);
        low + (high - low) * f64::from(word) * 2f64.powi(-32)
    }

    fn log(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    fn one_in(&mut self, many: f64) -> bool {
        self.within(0.0, many) < 1.0
    }
}

/// A camera and a scene.
struct Camera {
    readout: ReadOut,
    electrons: [f64; 3],
    size: [usize; 2],
    seed: u64,
}

impl Camera {
    /// Cameras of any kind: patterns from none to many times the noise; rows and columns; codes coarse and fine; levels at full
    /// well and below code 0.
    fn random(seed: u64, size: [usize; 2]) -> Self {
        let mut random = Random(u32::try_from(seed).unwrap(), 0);
        let mut readout = support::readout();
        readout.dark_current_na_per_cm2 = None;
        readout.dark_current_e_per_s = Some(random.log(10.0, 10_000.0));
        readout.dcnu = random.log(0.01, 0.3);
        readout.prnu = random.log(0.001, 0.05);
        readout.read_noise_e = random.log(1.0, 20.0);
        readout.full_well_e = 15_000.0;
        (readout.bits, readout.bias_adu) = (14, 600.0);
        readout.adu_per_e = random.log(0.2, 1.0);
        let level = random.log(30.0, 9000.0);
        let electrons = [1.0, random.within(0.5, 1.2), random.within(0.5, 1.2)].map(|share| level * share);
        if random.one_in(3.0) {
            let share = readout.read_noise_e.max(2.0);
            (readout.row_noise_e, readout.column_noise_e) = (random.within(0.0, share), random.within(0.0, share));
            (readout.dsnu_row_e, readout.dsnu_column_e) = (random.within(0.0, 3.0), random.within(0.0, 3.0));
            (readout.prnu_row, readout.prnu_column) = (random.within(0.0, 0.003), random.within(0.0, 0.003));
            readout.dsnu_e = random.within(0.0, 5.0);
            readout.read_noise_e = readout.read_noise_e.max(1.0 / readout.adu_per_e);
        }
        readout.check().unwrap();
        Self { readout, electrons, size, seed }
    }

    fn scene(&self, electrons: [f64; 3]) -> MemoryFrame {
        let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
        let mut camera = sensor();
        camera.readout = Some(self.readout.clone());
        metadata.sensor = Some(camera);
        metadata.exposure = support::expected(2, 2, |_, _, _| 0.0).header.metadata.exposure;
        metadata.scene = Some(Scene::uniform("test", electrons));
        let geometry = Geometry::new(self.size[0], self.size[1], &["R", "G", "B"]);
        let header = FrameHeader { name: "test".into(), geometry, metadata };
        support::frame(header, |_, _, channel| to_sample(electrons[channel]))
    }

    fn electrons(&self, electrons: [f64; 3], frame: u32) -> MemoryFrame {
        let scene = self.scene(electrons);
        let settings = NoiseSettings { seed: self.seed, sensor_seed: self.seed, frame, ..Default::default() };
        through(&scene, &AddNoise::new(&scene.header, &settings).unwrap())
    }

    fn codes(&self, electrons: [f64; 3], frame: u32) -> MemoryFrame {
        let noisy = self.electrons(electrons, frame);
        through(&noisy, &Digitize::new(&noisy.header, &AdcSettings::default()).unwrap())
    }

    fn plane(&self, electrons: [f64; 3], frame: u32) -> MemoryFrame {
        let codes = self.codes(electrons, frame);
        through(&codes, &Mosaic::new(&codes.header, Some(CfaPattern::Grbg)).unwrap())
    }
}

/// A plane less darks and, where there are any, over flats.
fn corrected(plane: &MemoryFrame, darks: &[MemoryFrame], [flats, flat_darks]: [&[MemoryFrame]; 2]) -> MemoryFrame {
    let dark_frames = DarkFrames::of(darks.to_vec()).unwrap();
    let settings = CorrectionSettings { black: Black::None, cte: None };
    let mut stage =
        CorrectFrame::of(&plane.header, &settings, dark_frames.as_ref().map(DarkFrames::stack), false).unwrap();
    let flat_frames = || {
        let settings = DarkSettings::default();
        FlatFrames::of(&plane.header, flats.to_vec(), [flat_darks.to_vec(), Vec::new()], None, settings, None).unwrap()
    };
    let flats = flat_frames().map(|surveyed| (flat_frames().unwrap(), surveyed.survey(None, None, None).unwrap()));
    stage.note_further(flats.as_ref().map(|(flats, means)| flats.record(means)), None);
    let mut corrections = Corrections { darks: dark_frames, dark_limits: None, flats, map: None, found: [0; 3] };
    let mut source = MemoryFrame::new(plane.header.clone(), plane.samples.clone());
    let mut made = MemoryFrame::new(stage.header().clone(), Vec::new());
    corrections.run(&stage, &mut source, [false, false], &mut made, &mut |_| ()).unwrap();
    made
}

fn demosaicked(plane: &MemoryFrame, method: Method) -> MemoryFrame {
    through(plane, &Demosaic::new(&plane.header, method, Black::Auto, None).unwrap())
}

fn colored(camera: &MemoryFrame) -> MemoryFrame {
    let settings = ColorSettings {
        is_relative: false,
        xyz_from_camera: sensor().xyz_from_camera.unwrap(),
        method: None,
        residual: None,
        space: Space::Xyz,
        white: White::D65,
        white_luminance: None,
    };
    through(camera, &ToXyz::new(&camera.header, &settings).unwrap())
}

fn over_frames(frames: &[MemoryFrame], level: Option<f64>) -> cyanometer::error::Result<(RepeatedReport, MemoryFrame)> {
    let settings =
        OverFramesSettings { regions: Vec::new(), saturated: Saturated::Kept, equations: Equations::Exact, level };
    let mut statistics = OverFrames::new(settings);
    for frame in frames {
        statistics.add(&mut MemoryFrame::new(frame.header.clone(), frame.samples.clone()))?;
    }
    statistics.finish()
}

const STAGES: [&str; 8] = ["electrons", "ADU", "CFA plane", "less 3 darks", "over 5 flats", "BI", "ECI", "XYZ"];

/// Frames of every stage.
fn chain(camera: &Camera, frames: u32) -> Vec<Vec<MemoryFrame>> {
    let darks: Vec<MemoryFrame> = (1000..1003).map(|frame| camera.plane([0.0; 3], frame)).collect();
    let flat_darks: Vec<MemoryFrame> = (3000..3003).map(|frame| camera.plane([0.0; 3], frame)).collect();
    let flats: Vec<MemoryFrame> = (2000..2005).map(|frame| camera.plane([6000.0; 3], frame)).collect();
    let planes: Vec<MemoryFrame> = (0..frames).map(|frame| camera.plane(camera.electrons, frame)).collect();
    let electrons = (0..frames).map(|frame| camera.electrons(camera.electrons, frame)).collect();
    let codes = (0..frames).map(|frame| camera.codes(camera.electrons, frame)).collect();
    let less: Vec<MemoryFrame> = planes.iter().map(|plane| corrected(plane, &darks, [&[], &[]])).collect();
    let flattened = planes.iter().map(|plane| corrected(plane, &darks, [&flats, &flat_darks])).collect();
    let of = |method| planes.iter().map(|plane| demosaicked(plane, method)).collect();
    let eci: Vec<MemoryFrame> = less.iter().map(|plane| demosaicked(plane, Method::EffectiveColor)).collect();
    let xyz = eci.iter().map(colored).collect();
    vec![electrons, codes, planes.clone(), less, flattened, of(Method::Bilinear), eci, xyz]
}

fn corrected_p(region: &RepeatedRegion) -> f64 {
    let smallest = region.tests.iter().map(|test| test.p).fold(1.0, f64::min);
    of_smallest(smallest, region.tests.len())
}

/// Subjects and deviates of the tests of a stage; none where nothing is predicted.
type Deviates = Vec<(String, f64)>;

/// Random cameras, 2 to 24 frames of every stage: deviates have rms 1 within 4 standard errors, and none is above 5.
/// CYANOMETER_CAMERAS sets how many.
#[test]
fn statistics_over_frames_are_as_predicted() {
    let cameras: u64 = std::env::var("CYANOMETER_CAMERAS").map_or(24, |count| count.parse().unwrap());
    let trials: Vec<(u64, Vec<Deviates>)> = (0..cameras)
        .into_par_iter()
        .map(|seed| {
            let camera = Camera::random(seed, [120, 100]);
            let frames = [2, 3, 5, 9, 24][usize::try_from(seed % 5).unwrap()];
            let of = |frames: &Vec<MemoryFrame>| {
                let Ok((report, _)) = over_frames(frames, Some(1e-9)) else { return Vec::new() };
                let tests = report.regions[0].tests.iter();
                tests.filter_map(|test| test.deviate().map(|z| (format!("{:?}", test.subject), z))).collect()
            };
            (seed, chain(&camera, frames).iter().map(of).collect())
        })
        .collect();
    let mut failures = Vec::new();
    for (stage, name) in STAGES.iter().enumerate() {
        for subject in [
            "Mean",
            "VarianceOfMeans",
            "TemporalVariance",
            "VarianceOfFrameMeans",
            "CorrelationOfMeans",
            "TemporalCorrelation",
        ] {
            let mut deviates: Vec<(u64, f64)> = Vec::new();
            for (seed, stages) in &trials {
                let of_stage = stages[stage].iter().filter(|(of, _)| *of == subject);
                deviates.extend(of_stage.map(|(_, z)| (*seed, *z)));
            }
            let n = deviates.len() as f64;
            if subject.contains("Correlation") && (2..5).contains(&stage) {
                assert!(deviates.is_empty(), "{name}: a plane has one channel");
                continue;
            }
            assert!(n >= cameras as f64, "{name}, {subject}: {n} of {cameras}");
            let rms = (deviates.iter().map(|(_, z)| z * z).sum::<f64>() / n).sqrt();
            let (worst, most) =
                deviates.iter().fold((0, 0.0_f64), |at, (seed, z)| if z.abs() > at.1.abs() { (*seed, *z) } else { at });
            // Channels that are made of the same photosites, or share rows, are as good as one; of few frames the variance of
            // their means has the tails of χ² with one degree of freedom, whose fourth cumulant makes 6 of 0.5.
            let apart = if stage < 5 { n } else { n / 3.0 };
            let error = (if subject == "VarianceOfFrameMeans" { 2.5 } else { 0.5 } / apart).sqrt();
            eprintln!("{name}, {subject}: rms {rms:.3} of {n}, ±{error:.3}; largest {most:.2} of camera {worst}");
            let farthest = if subject == "VarianceOfFrameMeans" { 12.0 } else { 5.0 };
            if (rms - 1.0).abs() > 4.0 * error || most.abs() > farthest {
                failures.push(format!("{name}, {subject}: rms {rms}, largest {most} of camera {worst}"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Checks raise false alarms no more often than the level.
#[test]
fn false_alarms_are_no_more_than_the_level() {
    for (what, size, frames) in [("small", [16, 12], 3), ("many", [24, 20], 30), ("two", [70, 60], 2)] {
        let seeds = misses::trials(120);
        let trials: Vec<Vec<Option<f64>>> = (0..seeds)
            .into_par_iter()
            .map(|seed| {
                let camera = Camera::random(10_000 + seed, size);
                let of = |frames: &Vec<MemoryFrame>| {
                    over_frames(frames, Some(0.05)).ok().map(|(report, _)| corrected_p(&report.regions[0]))
                };
                chain(&camera, frames).iter().map(of).collect()
            })
            .collect();
        for (stage, name) in STAGES.iter().enumerate() {
            let told: Vec<f64> = trials.iter().filter_map(|trial| trial[stage]).collect();
            judge(&format!("{what}, {name}"), &told, 0.0);
        }
    }
}

/// Two numbers of each pixel by hand, in two frames of two pixels.
#[test]
fn the_analysis_of_variance_is_that_of_two_ways() {
    let mut metadata = Metadata::new(QuantityKind::Adu);
    metadata.exposure = None;
    let header = FrameHeader { name: "test".into(), geometry: Geometry::new(2, 1, &["Y"]), metadata };
    let frames = [[1.0, 7.0], [5.0, 9.0], [3.0, 5.0]].map(|samples| MemoryFrame::new(header.clone(), samples.to_vec()));
    let (report, pixels) = over_frames(&frames, None).unwrap();
    let channel = &report.regions[0].channels[0];
    // Means of pixels 3 and 7, of frames 4, 7 and 4; residuals about 5 + (m − 5) + (f − 5): −1, 1; 0, 0; 1, −1; and 4/2 of them.
    assert_eq!((report.frames, channel.count, channel.mean), (3, 2, Some(5.0)));
    let near =
        |value: Option<f64>, expected: f64| assert!((value.unwrap() - expected).abs() < 1e-12, "{value:?} {expected}");
    near(channel.temporal_std, 2_f64.sqrt());
    near(channel.std_of_means, 8_f64.sqrt());
    near(channel.fixed_std, (8.0_f64 - 2.0 / 3.0).sqrt());
    near(channel.std_of_frame_means, 3_f64.sqrt());
    assert_eq!(pixels.header.geometry.channels, ["Y", "variance.Y"]);
    assert_eq!(pixels.samples, [3.0, 7.0, 4.0, 4.0]);
}

/// Frames of other sizes, exposures, cameras and scenes are refused, and so is an exposure that comes twice.
#[test]
fn frames_of_other_scenes_are_refused() {
    let camera = Camera::random(3, [12, 10]);
    let other =
        Camera { readout: ReadOut { read_noise_e: 9.0, ..camera.readout.clone() }, ..Camera::random(3, [12, 10]) };
    let first = camera.plane(camera.electrons, 0);
    let next = camera.plane(camera.electrons, 1);
    let complaint = |second: &MemoryFrame| over_frames(&[first.clone(), second.clone()], None).unwrap_err().to_string();
    assert!(complaint(&first).contains("exposure 0 of seed 3 comes twice"));
    assert!(complaint(&camera.plane([9.0; 3], 1)).contains("scene"));
    assert!(complaint(&Camera::random(3, [12, 8]).plane(camera.electrons, 1)).contains("12x8"));
    assert!(complaint(&camera.codes(camera.electrons, 1)).contains("layout"));
    assert!(
        complaint(&Camera { seed: 4, ..Camera::random(3, [12, 10]) }.plane(camera.electrons, 1)).contains("sensor")
    );
    let mut longer = next.clone();
    longer.header.metadata.exposure.as_mut().unwrap().exposure_s *= 1.5;
    assert!(complaint(&longer).contains("exposure"));
    assert!(over_frames(std::slice::from_ref(&first), None).unwrap_err().to_string().contains("two exposures"));
    // Whatever the camera was set to in another way, and whatever else of the same sensor is another.
    let said = complaint(&other.plane(camera.electrons, 1));
    let theirs = camera.readout.read_noise_e;
    assert!(
        said.contains(&format!("its `sensor.readout.read_noise_e` is 9.0, but that of test is {theirs}")),
        "{said}"
    );
    type Change = fn(&mut Metadata);
    let changes: [(&str, Change); 6] = [
        ("`adc.adu_per_e`", |metadata| metadata.adc.as_mut().unwrap().adu_per_e *= 2.0),
        ("`adc.bias_adu`", |metadata| metadata.adc.as_mut().unwrap().bias_adu += 1.0),
        ("`sensor.readout.temperature_k`", |metadata| {
            metadata.sensor.as_mut().unwrap().readout.as_mut().unwrap().temperature_k -= 20.0;
        }),
        ("`noise.dark_e`", |metadata| metadata.noise.as_mut().unwrap().dark_e += 3.0),
        ("`black_level_adu`", |metadata| metadata.black_level_adu = Some(BlackLevel::Uniform(3.0))),
        ("`white_level_adu`", |metadata| metadata.white_level_adu = None),
    ];
    for (key, change) in changes {
        let mut second = next.clone();
        change(&mut second.header.metadata);
        let said = complaint(&second);
        assert!(said.contains(key) && said.contains("only exposures of one scene by one camera"), "{key}: {said}");
    }
    // Of what was done to them in other ways nothing is predicted, and the reason is told.
    let mut second = next.clone();
    second.header.name = "second".into();
    second.header.metadata.left_out.push(LeftOut { program: "x".into(), what: "y".into(), why: "z".into() });
    let (report, _) = over_frames(&[first.clone(), second], None).unwrap();
    assert!(report.unpredicted.as_ref().unwrap().contains("`left_out` of second"), "{:?}", report.unpredicted);
    assert_eq!(report.unlike, report.unpredicted);
    // Seeds, numbers and files tell exposures apart; what this version does not know is nothing.
    let mut second = next;
    second.header.metadata.noise.as_mut().unwrap().seed += 1;
    second.header.metadata.file = Some("b.exr".into());
    second.header.metadata.unknown.insert("lens".into(), "wide".into());
    let (report, _) = over_frames(&[first, second], None).unwrap();
    assert!(report.unpredicted.is_none() && report.regions[0].classes[0].predicted_fixed_std.is_some());
}

/// Errors of what is not predicted are those of as many independent samples: about what they are where it is.
#[test]
fn errors_are_told_without_a_prediction_too() {
    let camera = Camera::random(3, [60, 50]);
    let mut planes: Vec<MemoryFrame> = (0..8).map(|frame| camera.plane(camera.electrons, frame)).collect();
    let (known, _) = over_frames(&planes, None).unwrap();
    planes.iter_mut().for_each(|plane| plane.header.metadata.scene = None);
    let (unknown, _) = over_frames(&planes, None).unwrap();
    assert!(unknown.unpredicted.is_some());
    let channels = |report: &RepeatedReport| {
        let region = report.regions[0].clone();
        region.channels.into_iter().chain(region.classes).collect::<Vec<_>>()
    };
    for (known, unknown) in channels(&known).iter().zip(&channels(&unknown)) {
        let of = |channel: &RepeatedChannel| channel.temporal_std_error.unwrap();
        assert!((of(unknown) / of(known) - 1.0).abs() < 0.1, "{}: {} {}", known.name, of(unknown), of(known));
    }
}

/// What is known of the frame of means is what is known of the means: `measure` of the one tests what that of all does.
#[test]
fn the_frame_of_means_is_predicted_too() {
    for seed in 0..6 {
        let camera = Camera::random(seed, [60, 50]);
        let planes: Vec<MemoryFrame> = (0..8).map(|frame| camera.plane(camera.electrons, frame)).collect();
        let (report, pixels) = over_frames(&planes, None).unwrap();
        let mut mean = MemoryFrame::new(pixels.header.clone(), Vec::new());
        mean.header.geometry.channels.truncate(1);
        mean.samples = pixels.samples.chunks_exact(120).flat_map(|row| row[..60].to_vec()).collect();
        let alone = measure(&mut mean, &[], Saturated::Kept, Equations::Exact, None).unwrap();
        for (class, of_all) in alone.regions[0].classes.iter().zip(&report.regions[0].classes) {
            assert_eq!(class.predicted_mean, of_all.predicted_mean);
            // Of many frames it is what is expected of this region, in which rows differ less than over a large frame.
            let share = of_all.predicted_std_of_means.unwrap() / class.predicted_std.unwrap();
            let shares_rows = camera.readout.prnu_row > 0.0;
            assert!(if shares_rows { (0.9..1.0).contains(&share) } else { share == 1.0 }, "{seed}: {share}");
            assert!((class.std.unwrap() / of_all.std_of_means.unwrap() - 1.0).abs() < 1e-6);
        }
    }
}

/// A camera of 12 bits whose numbers are those of a case.
fn coarse(set: impl Fn(&mut ReadOut), electrons: [f64; 3], size: [usize; 2], seed: u64) -> Camera {
    let mut readout = support::readout();
    (readout.full_well_e, readout.bits, readout.bias_adu) = (12_000.0, 12, 128.0);
    (readout.dark_current_na_per_cm2, readout.temperature_k) = (None, 298.0);
    set(&mut readout);
    readout.check().unwrap();
    Camera { readout, electrons, size, seed }
}

/// Dark current in e⁻/s, DCNU, PRNU, read noise and gain.
fn plain(readout: &mut ReadOut, [dark, dcnu, prnu, read_noise_e, adu_per_e]: [f64; 5]) {
    readout.dark_current_e_per_s = Some(dark);
    (readout.dcnu, readout.prnu, readout.read_noise_e, readout.adu_per_e) = (dcnu, prnu, read_noise_e, adu_per_e);
}

fn with_rows(readout: &mut ReadOut) {
    plain(readout, [50.0, 0.0, 0.02, 0.5, 0.3]);
    (readout.row_noise_e, readout.column_noise_e, readout.dsnu_e) = (5.0, 1.0, 8.0);
    (readout.dsnu_row_e, readout.prnu_row) = (1.0, 0.002);
}

/// Cameras whose samples are far from normal: few electrons in coarse codes, full well, few rows that share noise.
struct Honest {
    name: &'static str,
    set: fn(&mut ReadOut),
    electrons: [f64; 3],
    size: [usize; 2],
    frames: u32,
    stage: &'static str,
}

const HONEST: [Honest; 8] = [
    Honest {
        name: "few electrons",
        set: |readout| plain(readout, [1.0, 0.1, 0.005, 0.5, 0.3]),
        electrons: [3.0, 2.0, 1.0],
        size: [32, 24],
        frames: 3,
        stage: "ADU",
    },
    Honest {
        name: "low light",
        set: |readout| plain(readout, [0.5, 0.2, 0.005, 0.5, 0.3]),
        electrons: [2.9, 7.0, 2.36],
        size: [40, 16],
        frames: 3,
        stage: "ADU",
    },
    Honest {
        name: "full well in electrons",
        set: |readout| plain(readout, [5000.0, 0.2, 0.0, 15.0, 0.02]),
        electrons: [11_504.0, 10_418.0, 12_301.0],
        size: [32, 24],
        frames: 30,
        stage: "electrons",
    },
    Honest {
        name: "full well in codes",
        set: |readout| plain(readout, [50.0, 0.0, 0.0, 15.0, 0.1]),
        electrons: [9400.0, 9200.0, 11_711.0],
        size: [8, 6],
        frames: 30,
        stage: "ADU",
    },
    Honest {
        name: "coarse codes with rows",
        set: |readout| {
            plain(readout, [50.0, 0.1, 0.005, 15.0, 0.02]);
            (readout.row_noise_e, readout.column_noise_e, readout.dsnu_row_e) = (15.0, 5.0, 5.0);
        },
        electrons: [400.0, 900.0, 60.0],
        size: [16, 12],
        frames: 5,
        stage: "CFA plane",
    },
    Honest { name: "few rows", set: with_rows, electrons: [27.5, 11.28, 20.0], size: [8, 6], frames: 3, stage: "MHC" },
    Honest {
        name: "few rows of one frame",
        set: with_rows,
        electrons: [27.5, 11.28, 20.0],
        size: [8, 6],
        frames: 1,
        stage: "MHC",
    },
    Honest {
        name: "few rows before demosaicking",
        set: with_rows,
        electrons: [27.5, 11.28, 20.0],
        size: [12, 10],
        frames: 4,
        stage: "CFA plane",
    },
];

impl Honest {
    fn frame(&self, camera: &Camera, frame: u32) -> MemoryFrame {
        match self.stage {
            "electrons" => camera.electrons(camera.electrons, frame),
            "ADU" => camera.codes(camera.electrons, frame),
            "CFA plane" => camera.plane(camera.electrons, frame),
            _ => demosaicked(&camera.plane(camera.electrons, frame), Method::Malvar),
        }
    }

    /// Subjects, deviates and probabilities, and by how much temporal variances differ from what is predicted.
    fn tests(&self, seed: u64) -> (Vec<(String, f64, f64)>, Vec<f64>) {
        let camera = coarse(self.set, self.electrons, self.size, seed);
        let mut frames: Vec<MemoryFrame> = (0..self.frames).map(|frame| self.frame(&camera, frame)).collect();
        let of = |test: &cyanometer::analysis::statistics::check::Test| {
            (format!("{:?}", test.subject), test.deviate().unwrap_or(0.0), test.p)
        };
        if let [one] = &mut frames[..] {
            let report = measure(one, &[], Saturated::Kept, Equations::Exact, Some(0.05)).unwrap();
            return (report.regions[0].tests.iter().map(of).collect(), Vec::new());
        }
        let (report, _) = over_frames(&frames, Some(0.05)).unwrap();
        let region = &report.regions[0];
        let channels = if region.classes.is_empty() { &region.channels } else { &region.classes };
        let off = |channel: &RepeatedChannel| {
            channel.temporal_std.unwrap().powi(2) - channel.predicted_temporal_std.unwrap().powi(2)
        };
        (region.tests.iter().map(of).collect(), channels.iter().map(off).collect())
    }
}

/// Samples that are far from normal raise no more alarms than the level, each test has a law that is known, its deviates have rms 1,
/// and T is on average what stands beside it.
#[test]
fn honest_frames_far_from_normal_pass() {
    let seeds = misses::trials(100);
    let mut failures = Vec::new();
    for case in &HONEST {
        let trials: Vec<_> = (0..seeds).into_par_iter().map(|seed| case.tests(20_000 + seed)).collect();
        let name = case.name;
        let n = trials.len() as f64;
        let smallest =
            trials.iter().map(|(tests, _)| (tests.iter().map(|(_, _, p)| *p).fold(1.0, f64::min), tests.len()));
        judge(name, &smallest.map(|(p, tests)| of_smallest(p, tests)).collect::<Vec<f64>>(), 0.0);
        for subject in ["Mean", "Variance", "VarianceOfMeans", "TemporalVariance"] {
            let of_subject = trials.iter().flat_map(|(tests, _)| tests).filter(|(of, _, _)| of == subject);
            let deviates: Vec<f64> = of_subject.map(|(_, z, _)| *z).collect();
            let rms = (deviates.iter().map(|z| z * z).sum::<f64>() / deviates.len() as f64).sqrt();
            eprintln!("{name}, {subject}: rms {rms:.3} of {}", deviates.len());
            // Channels that share rows are as good as one, and squares of skewed deviates scatter by 2.5.
            let error = (2.5 / 4.0 / n).sqrt();
            if !deviates.is_empty() && (!rms.is_finite() || (rms - 1.0).abs() > 4.0 * error) {
                failures.push(format!("{name}, {subject}: rms {rms}"));
            }
        }
        assert!(trials.iter().all(|(tests, _)| tests.len() > 3), "{name}: nothing is tested");
        for channel in 0..trials[0].1.len() {
            let off: Vec<f64> = trials.iter().map(|(_, off)| off[channel]).collect();
            let mean = off.iter().sum::<f64>() / n;
            let error = (off.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
            eprintln!("{name}, T of {channel}: {mean:.4} ± {error:.4}");
            if mean.abs() > 4.5 * error {
                failures.push(format!("{name}: T of {channel} is {mean} ± {error} from what is predicted"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Frames nearly all of whose samples are the top code, few of them far below: whether a class has such a sample in any frame is chance, and no
/// variance of few tells otherwise. Beside tests by bounds no deviate is shown, which would be taken for one of a normal law.
#[test]
fn frames_that_are_nearly_full_pass() {
    let set = |readout: &mut ReadOut| {
        plain(readout, [5.0, 0.1, 0.005, 2.0, 4.0]);
        (readout.full_well_e, readout.bias_adu) = (5000.0, 120.0);
    };
    let seeds = misses::trials(12);
    let mut ends = [0; 2];
    for level in [900.0, 1080.0, 1100.0, 1115.0, 1130.0, 1145.0] {
        let smallest = (0..seeds).into_par_iter().map(|seed| {
            let camera = coarse(set, [level; 3], [32, 24], 40_000 + seed);
            let mut frames: Vec<MemoryFrame> = (0..12).map(|frame| camera.plane(camera.electrons, frame)).collect();
            let (report, _) = over_frames(&frames, Some(1e-4)).unwrap();
            let region = &report.regions[0];
            let of = |name: &str, subject: &str| {
                let mut own = region.tests.iter().filter(|test| test.channels == [name]);
                own.any(|test| format!("{:?}", test.subject) == subject && test.z.is_some())
            };
            for class in &region.classes {
                assert_eq!(class.z_mean.is_some(), of(&class.name, "Mean"), "{class:?}");
                assert_eq!(class.z_temporal_std.is_some(), of(&class.name, "TemporalVariance"), "{class:?}");
            }
            let one = measure(&mut frames[0], &[], Saturated::Kept, Equations::Exact, Some(1e-4)).unwrap();
            let one = &one.regions[0];
            let is_known = |name: &str| one.tests.iter().any(|test| test.channels == [name] && test.z.is_some());
            let shown: Vec<bool> = one.classes.iter().map(|class| class.z_mean.is_some()).collect();
            let known: Vec<bool> = one.classes.iter().map(|class| is_known(&class.name)).collect();
            assert_eq!(shown, known);
            (region.tests.iter().map(|test| test.p).fold(1.0, f64::min), region.tests.len(), known[0])
        });
        let smallest: Vec<(f64, usize, bool)> = smallest.collect();
        for (p, tests, known) in smallest {
            assert!(of_smallest(p, tests) > 1e-4, "{level}: {p} of {tests}");
            ends[usize::from(known)] += 1;
        }
    }
    assert!(ends.iter().all(|count| *count > 0), "{ends:?}: one of both is not seen");
}

/// Frames whose means are all the same were not drawn one by one; of two frames of few electrons they may be.
#[test]
fn frames_of_one_mean_are_noticed() {
    let camera = Camera::random(1, [40, 30]);
    let mut frames: Vec<MemoryFrame> = (0..20).map(|frame| camera.electrons(camera.electrons, frame)).collect();
    assert!(over_frames(&frames, Some(1e-4)).unwrap().0.check.unwrap().passed);
    let mean = |frame: &MemoryFrame, channel: usize| {
        let of_channel = frame.samples.chunks_exact(40).skip(channel).step_by(3).flatten();
        of_channel.map(|sample| f64::from(*sample)).sum::<f64>() / 1200.0
    };
    let level = [0, 1, 2].map(|channel| mean(&frames[0], channel));
    for frame in &mut frames {
        let off = [0, 1, 2].map(|channel| level[channel] - mean(frame, channel));
        for (index, row) in frame.samples.chunks_exact_mut(40).enumerate() {
            row.iter_mut().for_each(|sample| *sample += to_sample(off[index % 3]));
        }
    }
    let (report, _) = over_frames(&frames, Some(1e-4)).unwrap();
    assert!(!report.check.unwrap().passed);
    let tests = report.regions[0].tests.iter();
    let of_frames: Vec<f64> =
        tests.filter(|test| format!("{:?}", test.subject) == "VarianceOfFrameMeans").map(|test| test.p).collect();
    assert!(of_frames.len() == 3 && of_frames.iter().all(|p| *p < 1e-9), "{of_frames:?}");
}

/// Medians of codes that scatter over less than one: mean and standard deviation by NumPy, each of 400,000 photosites of its own, and
/// the standard errors of both, of which 5 are allowed; and medians that are drawn here pass.
#[test]
fn medians_of_few_codes_are_predicted() {
    type Case = ([f64; 3], u32, fn(&mut ReadOut), Vec<[f64; 4]>);
    let cases: [Case; 4] = [
        (
            [15.262, 11.477, 36.838],
            8,
            |readout| plain(readout, [0.5, 0.1, 0.02, 3.0, 0.1]),
            vec![
                [129.527_56, 0.426_317, 6.7e-4, 2.1e-4],
                [129.044_11, 0.169_561, 2.7e-4, 5.7e-4],
                [131.712_39, 0.396_789, 6.3e-4, 3.6e-4],
            ],
        ),
        (
            [15.0, 30.0, 60.0],
            3,
            |readout| plain(readout, [0.5, 0.1, 0.01, 3.0, 0.1]),
            vec![[129.492_26, 0.505_173, 8.0e-4, 1.6e-4], [130.997_7, 0.483_531, 7.6e-4, 7.0e-4]],
        ),
        (
            [221.77, 221.77, 221.77],
            3,
            |readout| {
                plain(readout, [50.0, 0.1, 0.005, 3.0, 0.02]);
                readout.dsnu_e = 8.0;
            },
            vec![[132.447_22, 0.497_489, 7.9e-4, 0.9e-4]],
        ),
        (
            [40.0, 40.0, 40.0],
            5,
            |readout| {
                plain(readout, [50.0, 0.1, 0.02, 0.5, 0.1]);
                readout.dsnu_e = 3.0;
            },
            vec![[132.149_26, 0.539_639, 8.5e-4, 6.6e-4]],
        ),
    ];
    for (index, (electrons, frames, set, known)) in (0..).zip(cases) {
        let camera = coarse(set, electrons, [160, 120], index);
        let planes: Vec<MemoryFrame> = (0..frames).map(|frame| camera.plane(electrons, frame)).collect();
        let mut median = averaged(&planes, Combine::Median);
        let report = measure(&mut median, &[], Saturated::Kept, Equations::Exact, Some(1e-4)).unwrap();
        for (class, [mean, std, mean_error, std_error]) in report.regions[0].classes.iter().zip(known) {
            let found = [class.predicted_mean.unwrap(), class.predicted_std.unwrap()];
            assert!((found[0] - mean).abs() < 5.0 * mean_error, "{index} {}: {found:?} {mean}", class.name);
            assert!((found[1] - std).abs() < 5.0 * std_error, "{index} {}: {found:?} {std}", class.name);
        }
        assert!(report.check.unwrap().passed, "{index}: {:?}", report.check);
    }
}

/// Where in a code the average of a photosite lies is not told by a pixel: its standard deviation is void where that matters. Of
/// clipped means nothing is predicted there.
#[test]
fn averages_of_few_codes_are_void_where_they_are_not_known() {
    let camera = coarse(|readout| plain(readout, [0.5, 0.1, 0.02, 3.0, 0.1]), [15.0, 11.5, 37.0], [24, 20], 1);
    let planes: Vec<MemoryFrame> = (0..12).map(|frame| camera.plane(camera.electrons, frame)).collect();
    for combine in [Combine::Mean, Combine::Median, Combine::Clipped] {
        let camera = demosaicked(&averaged(&planes, combine), Method::Bilinear);
        let noise = PixelNoise::of(&camera.header).unwrap();
        let holds = |level: f64| noise.covariance([10, 10], [level; 3]).1;
        assert_eq!([holds(2.0), holds(900.0)], [combine == Combine::Mean, true], "{combine:?}");
    }
    let measured = |frame: &mut MemoryFrame| measure(frame, &[], Saturated::Kept, Equations::Exact, Some(1e-4));
    let refused = measured(&mut averaged(&planes, Combine::Clipped)).unwrap_err().to_string();
    assert!(refused.contains("clipped mean leaves out"), "{refused}");
}

/// At an end of the codes what is drawn anew hangs on the offset of a column, which all its photosites have: the scatter of variances is
/// not that of photosites apart, and nothing is judged by it. Offsets of photosites are, and those of columns where nothing ends.
#[test]
fn what_differs_from_line_to_line_is_not_judged() {
    let with = |bias_adu: f64, set: fn(&mut ReadOut)| {
        let mut camera = Camera::random(5, [60, 50]);
        let readout = &mut camera.readout;
        plain(readout, [10.0, 0.1, 0.005, 10.0, 0.25]);
        (readout.row_noise_e, readout.column_noise_e) = (0.0, 0.0);
        (readout.dsnu_e, readout.dsnu_row_e, readout.dsnu_column_e) = (0.0, 0.0, 0.0);
        (readout.prnu_row, readout.prnu_column, readout.bias_adu) = (0.0, 0.0, bias_adu);
        set(readout);
        let frames: Vec<MemoryFrame> = (0..5).map(|frame| camera.plane([0.0; 3], frame)).collect();
        over_frames(&frames, Some(1e-4)).map(|(report, _)| report.regions[0].tests.len())
    };
    let of_columns = |readout: &mut ReadOut| readout.dsnu_column_e = 9.0;
    let of_photosites = |readout: &mut ReadOut| readout.dsnu_e = 9.0;
    assert!(with(600.0, of_columns).unwrap() > 0 && with(0.0, of_photosites).unwrap() > 0);
    let refused = with(0.0, of_columns).unwrap_err().to_string();
    assert!(refused.contains("rows or columns have fixed offsets or gains"), "{refused}");
}

/// What cannot be checked is told by its reason.
#[test]
fn what_cannot_be_checked_is_told() {
    let camera = Camera::random(5, [24, 20]);
    let mut frames: Vec<MemoryFrame> = (0..3).map(|frame| camera.plane(camera.electrons, frame)).collect();
    let (_, mut pixels) = over_frames(&frames, Some(1e-4)).unwrap();
    let refused = measure(&mut pixels, &[], Saturated::Kept, Equations::Exact, Some(1e-4)).unwrap_err().to_string();
    assert!(refused.contains("their variances (variance.Y)"), "{refused}");
    frames[1].samples[7] = f32::NAN;
    let refused = over_frames(&frames, Some(1e-4)).unwrap_err().to_string();
    assert!(refused.contains("1 pixels are saturated, otherwise marked or not finite"), "{refused}");
}

//! Throughput of the stages in samples per second, on a frame of 1332×1000 in memory, and the time of a prediction.
//!
//! `cargo bench` prints medians; compare figures of one run only.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use cyanometer::analysis::characterization::evaluation::{EvaluationSettings, Filling, SampleExposure, evaluate};
use cyanometer::analysis::characterization::signals;
use cyanometer::analysis::statistics::{Saturated, measure};
use cyanometer::camera::optics::Exposure;
use cyanometer::chain::{CameraSetup, Predictor, PredictorSettings, uniform_frame};
use cyanometer::color::{Space, White};
use cyanometer::error::Result;
use cyanometer::formats::{data, spectral};
use cyanometer::metadata::Scene;
use cyanometer::propagation::Equations;
use cyanometer::spectrum::WavelengthGrid;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{MemoryFrame, Stage};

/// 33 ms at f/8.
const EXPOSURE: Exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };

/// A clear sky at three quarters of full well.
const SKY: [f64; 3] = [4448.0, 16_599.0, 30_000.0];

fn expected() -> Result<MemoryFrame> {
    let setup = CameraSetup::new(data::load_sensor(data::DEFAULT_SENSOR)?.sensor, EXPOSURE);
    uniform_frame(setup.planes([1332, 1000], Scene::uniform("bench", SKY)), SKY)
}

fn time<S: Stage>(criterion: &mut Criterion, name: &str, frame: &MemoryFrame, stage: Result<S>) -> MemoryFrame {
    let Ok(stage) = stage else { panic!("{name}: the stage refuses the frame") };
    let mut group = criterion.benchmark_group("stages");
    group.throughput(Throughput::Elements(frame.samples.len() as u64)).sample_size(10);
    group.bench_function(name, |bencher| bencher.iter(|| frame.through(&stage)));
    group.finish();
    match frame.through(&stage) {
        Ok((made, _)) => made,
        Err(error) => panic!("{name}: {error}"),
    }
}

fn stages(criterion: &mut Criterion) {
    let Ok(expected) = expected() else { panic!("the default sensor is built in") };
    let noise = |frame: &MemoryFrame| AddNoise::new(&frame.header, &NoiseSettings::default());
    let electrons = time(criterion, "add-noise, three planes", &expected, noise(&expected));
    let plane = time(criterion, "mosaic", &expected, Mosaic::new(&expected.header, None));
    time(criterion, "add-noise, CFA plane", &plane, noise(&plane));
    let adc = AdcSettings::default();
    let codes = time(criterion, "digitize", &electrons, Digitize::new(&electrons.header, &adc));
    let cfa = time(criterion, "mosaic, codes", &codes, Mosaic::new(&codes.header, None));
    let mut rgb = None;
    for method in Method::ALL {
        let name = format!("demosaic, {}", method.names()[0]);
        rgb = Some(time(criterion, &name, &cfa, Demosaic::new(&cfa.header, method, Black::Auto, None)));
    }
    let Some(rgb) = rgb else { return };
    for (name, space) in [("to-xyz", Space::Xyz), ("to-xyz, lab", Space::Lab), ("to-xyz, srgb", Space::Srgb)] {
        let settings = ColorSettings {
            is_relative: false,
            xyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]],
            method: None,
            residual: None,
            space,
            white: White::D65,
            white_luminance: None,
        };
        time(criterion, name, &rgb, ToXyz::new(&rgb.header, &settings));
    }
    let mut group = criterion.benchmark_group("stages");
    group.throughput(Throughput::Elements(rgb.samples.len() as u64)).sample_size(10);
    group.bench_function("measure", |bencher| {
        bencher.iter(|| {
            let mut source = MemoryFrame::new(rgb.header.clone(), rgb.samples.clone());
            measure(&mut source, &[], Saturated::Kept, Equations::Exact, None)
        });
    });
    group.finish();
}

/// One scene through the whole chain by formula: electrons, ADU, demosaicked, and by the exact moments alone.
fn predictions(criterion: &mut Criterion) {
    let Ok(loaded) = data::load_sensor(data::DEFAULT_SENSOR) else { return };
    let mut group = criterion.benchmark_group("predictions");
    for method in Method::ALL {
        let camera = CameraSetup { method, ..CameraSetup::new(loaded.sensor.clone(), EXPOSURE) };
        let settings = PredictorSettings::of(camera);
        let Ok(mut predictor) = Predictor::new(settings) else { return };
        group.bench_function(method.names()[0], |bencher| {
            bencher.iter(|| predictor.predict([8000.0, 12_000.0, 20_000.0]))
        });
    }
    group.finish();
}

/// The 912 skies through the noisy camera, 20×16 pixels each, with all differences and predictions.
fn evaluations(criterion: &mut Criterion) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data/skies/sky912.exr");
    let (Ok(loaded), Ok(observer), Ok((library, _))) =
        (data::load_sensor(data::DEFAULT_SENSOR), data::load_observer(), spectral::read_library(&path, None))
    else {
        return;
    };
    let grid = WavelengthGrid::default();
    let Ok(response) = loaded.response() else { return };
    let Ok(signals) = signals(&library, &loaded.sensor, response, &observer, &grid) else { return };
    let mut group = criterion.benchmark_group("evaluations");
    group.throughput(Throughput::Elements(signals.camera.nrows() as u64)).sample_size(10);
    for method in Method::ALL {
        let base = EXPOSURE;
        let settings = EvaluationSettings {
            exposure: SampleExposure::Filled { base, fraction: 0.75, by: Filling::Time },
            noise: NoiseSettings::default(),
            method,
            pattern: None,
            color: ColorSettings {
                is_relative: false,
                xyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]],
                method: None,
                residual: None,
                space: Space::Lab,
                white: White::D65,
                white_luminance: None,
            },
            patch: Some([20, 16]),
            columns: library.columns,
            dark_frames: 0,
        };
        group.bench_function(method.names()[0], |bencher| {
            bencher.iter(|| evaluate(&loaded.sensor, &signals, &settings))
        });
    }
    group.finish();
}

criterion_group!(benches, stages, predictions, evaluations);
criterion_main!(benches);

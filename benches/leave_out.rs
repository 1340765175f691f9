//! What leaving out saves: each piece of work with and without what a scene does not need; their ratio is the saving.

use criterion::{Criterion, criterion_group, criterion_main};
use cyanometer::camera::levels::BlackLevel;
use cyanometer::camera::optics::{Exposure, Vignetting};
use cyanometer::cfa::CfaPattern;
use cyanometer::error::Result;
use cyanometer::formats::data;
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::numerics::planes::{WeightedPlane, weighted_sums};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::render::Rendering;
use cyanometer::stream::{MemoryFrame, RowSink};
use cyanometer::units::QuantityKind;
use std::hint::black_box;

const SIZE: [usize; 2] = [1332, 400];
const SIGNAL: [f64; 3] = [4448.0, 16_599.0, 30_000.0];

fn header(quantity: QuantityKind, channels: &[&str]) -> FrameHeader {
    let mut metadata = Metadata::new(quantity);
    metadata.sensor = data::load_sensor(data::DEFAULT_SENSOR).ok().map(|loaded| loaded.sensor);
    metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
    metadata.cfa = (channels.len() == 1).then_some(CfaPattern::Rggb.into());
    FrameHeader { name: "bench".into(), geometry: Geometry::new(SIZE[0], SIZE[1], channels), metadata }
}

/// Takes rows and forgets them.
struct Nowhere;

impl RowSink for Nowhere {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        black_box(samples);
        Ok(())
    }
}

fn pair(criterion: &mut Criterion, name: &str, mut with: impl FnMut(), mut without: impl FnMut()) {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10);
    group.bench_function("with", |bencher| bencher.iter(&mut with));
    group.bench_function("left out", |bencher| bencher.iter(&mut without));
    group.finish();
}

fn rendering(criterion: &mut Criterion) {
    let render = |patch: [usize; 2], vignetting: Option<Vignetting>, cfa: Option<CfaPattern>| {
        let channels: &[&str] = if cfa.is_some() { &["Y"] } else { &["R", "G", "B"] };
        let header = header(QuantityKind::ExpectedElectrons, channels);
        let row = vec![SIGNAL; SIZE[0].div_ceil(patch[0])];
        let rendering = Rendering { header, patch, vignetting, cfa };
        move || {
            let made = rendering.draw(0, &vec![&row; rendering.source_rows()], &mut Nowhere, &mut |_| ());
            assert!(made.is_ok());
        }
    };
    pair(criterion, "photosites of a uniform scene", render([1, 1], None, None), render(SIZE, None, None));
    let narrow = Vignetting::new(SIZE[0], SIZE[1], 6.8, 1e6);
    pair(criterion, "vignetting of no field", render(SIZE, Some(narrow), None), render(SIZE, None, None));
    let wide = Vignetting::new(SIZE[0], SIZE[1], 6.8, 8.0);
    pair(
        criterion,
        "planes that the mosaic drops",
        render(SIZE, Some(wide.clone()), None),
        render(SIZE, Some(wide), Some(CfaPattern::Rggb)),
    );
}

/// 300 to 1100 nm in steps of 1 nm, of which a sensor sees a half.
fn wavelengths(criterion: &mut Criterion) {
    let (width, planes, seen) = (1024, 801, 330..730);
    let samples: Vec<f32> = (0..width * planes).map(|i| (i % 1013) as f32).collect();
    let weights = |plane| if seen.contains(&plane) { [1.0, 2.0, 3.0] } else { [0.0; 3] };
    let all: Vec<WeightedPlane> = (0..planes).map(|plane| WeightedPlane { plane, weights: weights(plane) }).collect();
    let kept: Vec<WeightedPlane> = all.iter().copied().filter(|plane| plane.weights != [0.0; 3]).collect();
    let sum = |planes: &[WeightedPlane]| weighted_sums(&samples, width, planes, |sums| _ = black_box(sums));
    pair(criterion, "wavelengths without a response", || sum(&all), || sum(&kept));
}

fn stages(criterion: &mut Criterion) {
    let three = header(QuantityKind::ExpectedElectrons, &["R", "G", "B"]);
    let row: Vec<f32> =
        SIGNAL.iter().flat_map(|e| std::iter::repeat_n(cyanometer::frame::to_sample(*e), SIZE[0])).collect();
    let light = MemoryFrame::new(three, row.repeat(SIZE[1]));
    let noise = |frame: &MemoryFrame, temperature_k: Option<f64>| {
        let settings = NoiseSettings { temperature_k, ..NoiseSettings::default() };
        let Ok(stage) = AddNoise::new(&frame.header, &settings) else { panic!("noise fits") };
        let Ok((noisy, _)) = frame.through(&stage) else { panic!("memory does not fail") };
        noisy
    };
    let mosaic = |frame: &MemoryFrame| {
        let Ok(stage) = Mosaic::new(&frame.header, None) else { panic!("three planes make a mosaic") };
        let Ok((plane, _)) = frame.through(&stage) else { panic!("memory does not fail") };
        plane
    };
    pair(
        criterion,
        "noise of what the mosaic drops",
        || _ = black_box(mosaic(&noise(&light, None))),
        || _ = black_box(noise(&mosaic(&light), None)),
    );
    let plane = mosaic(&light);
    // At 200 K the dark signal is above the bound, at 150 K below it.
    pair(
        criterion,
        "dark signal below the read noise",
        || _ = black_box(noise(&plane, Some(200.0))),
        || _ = black_box(noise(&plane, Some(150.0))),
    );
    let codes = MemoryFrame::new(header(QuantityKind::Adu, &["Y"]), plane.samples);
    let correct = |black| {
        let settings = CorrectionSettings { black: Black::Level(BlackLevel::Uniform(black)), cte: None };
        let Ok(stage) = CorrectFrame::new(&codes.header, &settings, None) else { panic!("codes can be corrected") };
        black_box(codes.through(&stage)).is_ok()
    };
    pair(criterion, "black level of zero", || _ = correct(f64::MIN_POSITIVE), || _ = correct(0.0));
}

criterion_group!(benches, rendering, wavelengths, stages);
criterion_main!(benches);

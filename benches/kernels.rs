//! Throughput of the kernels in pixels per second on one thread, on a frame of 2654×1996, for every set of vector
//! instructions that the processor has, beside a copy of as many bytes.
//!
//! Each stage is driven over bands as `stage::run` cuts them for a thread, into one buffer; the copy takes the same
//! bands. `cargo bench --bench kernels -- bi` runs the cases whose name holds "bi"; compare figures of one run only.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use cyanometer::camera::optics::Exposure;
use cyanometer::cfa::CfaPattern;
use cyanometer::color::{Space, White};
use cyanometer::error::Result;
use cyanometer::frame::{Geometry, Rows, Window};
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::numerics::vectors::Instructions;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{Counts, RowSink, RowSource, Stage, run};
use cyanometer::units::QuantityKind;
use std::hint::black_box;
use std::time::Duration;

const WIDTH: usize = 2654;
const HEIGHT: usize = 1996;

fn header(quantity: QuantityKind, channels: &[&str], cfa: Option<CfaPattern>) -> FrameHeader {
    let mut metadata = Metadata::new(quantity);
    metadata.cfa = cfa.map(Into::into);
    metadata.black_level_adu = Some(102.3.into());
    metadata.white_level_adu = Some(4095.0.into());
    metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
    FrameHeader { name: "bench".into(), geometry: Geometry::new(WIDTH, HEIGHT, channels), metadata }
}

/// Whole numbers from `least` on, scattered over 4000.
fn samples(header: &FrameHeader, least: f32) -> Vec<f32> {
    let count = header.geometry.row_samples() * HEIGHT;
    (0..count).map(|i| least + (i.wrapping_mul(2_654_435_769) >> 7 & 0xfff) as f32).collect()
}

/// Rows of a frame in memory, over and over.
struct Source<'a> {
    header: &'a FrameHeader,
    samples: &'a [f32],
}

impl RowSource for Source<'_> {
    fn header(&self) -> &FrameHeader {
        self.header
    }

    fn natural_rows(&self) -> usize {
        1
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let (taken, rest) = self.samples.split_at(rows * self.header.geometry.row_samples());
        samples.extend_from_slice(taken);
        self.samples = rest;
        Ok(())
    }
}

/// Forgets what it is given.
struct Sink;

impl RowSink for Sink {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        black_box(samples);
        Ok(())
    }
}

/// Rows in a band of a frame from `input` to `output` channels.
fn band_rows(input: &FrameHeader, output: &FrameHeader) -> usize {
    input.geometry.cached_rows().min(output.geometry.cached_rows())
}

type Apply<'a, S> = &'a dyn Fn(Instructions, Window<'_, <S as Stage>::Input>, Rows<'_, <S as Stage>::Output>) -> Counts;

fn time<S: Stage>(criterion: &mut Criterion, name: &str, input: &FrameHeader, stage: &S, apply: Apply<'_, S>) {
    let samples = samples(input, if input.metadata.quantity == QuantityKind::Electrons { -20.0 } else { 100.0 });
    let (into, from) = (stage.header().geometry.row_samples(), input.geometry.row_samples());
    let rows = band_rows(input, stage.header());
    let mut made = vec![0.0_f32; rows * into];
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements((WIDTH * HEIGHT) as u64)).sample_size(10);
    group.warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_millis(400));
    // As many bytes read and written as the stage reads and writes.
    let half = (into + from) / 2;
    let mut copied = vec![0.0_f32; rows * half];
    let original = vec![1.0_f32; HEIGHT * half];
    group.bench_function("copy", |bencher| {
        bencher.iter(|| {
            for band in original.chunks(rows * half) {
                copied[..band.len()].copy_from_slice(band);
                black_box(&mut copied);
            }
        });
    });
    for set in Instructions::ALL.into_iter().filter(|set| set.are_available()) {
        group.bench_function(set.name(), |bencher| {
            bencher.iter(|| {
                for first in (0..HEIGHT).step_by(rows) {
                    let made = &mut made[..rows.min(HEIGHT - first) * into];
                    let window = Window::new(HEIGHT, 0, WIDTH, input.geometry.channels.len(), &samples);
                    let rows = Rows::new(first, WIDTH, stage.header().geometry.channels.len(), made);
                    black_box(apply(set, window, rows));
                }
            });
        });
    }
    let Ok(thread) = rayon::ThreadPoolBuilder::new().num_threads(1).build() else { panic!("no thread") };
    group.bench_function("stage::run, one thread", |bencher| {
        bencher.iter(|| {
            thread.install(|| run(stage, &mut Source { header: input, samples: &samples }, &mut Sink, &mut |_| ()))
        });
    });
    group.finish();
}

fn kernels(criterion: &mut Criterion) -> Result<()> {
    let plane = header(QuantityKind::Adu, &["Y"], Some(CfaPattern::Rggb));
    for method in Method::ALL {
        let stage = Demosaic::new(&plane, method, Black::Auto, None)?;
        time(criterion, method.names()[0], &plane, &stage, &|set, input, output| stage.apply_on(set, input, output));
    }
    let rgb = header(QuantityKind::Adu, &["R", "G", "B"], None);
    for (name, space) in [
        ("to-xyz", Space::Xyz),
        ("to-xyz, xyy", Space::Xyy),
        ("to-xyz, lab", Space::Lab),
        ("to-xyz, srgb", Space::Srgb),
    ] {
        let settings = ColorSettings {
            is_relative: false,
            xyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]],
            method: None,
            residual: None,
            space,
            white: White::D65,
            white_luminance: None,
        };
        let stage = ToXyz::new(&rgb, &settings)?;
        time(criterion, name, &rgb, &stage, &|set, input, output| stage.apply_on(set, input, output));
    }
    let stage = Mosaic::new(&rgb, Some(CfaPattern::Grbg))?;
    time(criterion, "mosaic", &rgb, &stage, &|set, input, output| stage.apply_on(set, input, output));
    let electrons = header(QuantityKind::Electrons, &["Y"], Some(CfaPattern::Rggb));
    let settings = AdcSettings { bits: Some(12), bias_adu: Some(2.3), adu_per_e: Some(1.01) };
    let stage = Digitize::new(&electrons, &settings)?;
    time(criterion, "digitize", &electrons, &stage, &|set, input, output| stage.apply_on(set, input, output));
    Ok(())
}

fn all(criterion: &mut Criterion) {
    if let Err(error) = kernels(criterion) {
        panic!("{error}");
    }
}

criterion_group!(benches, all);
criterion_main!(benches);

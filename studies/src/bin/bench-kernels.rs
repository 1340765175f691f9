//! Times one kernel in memory on one thread, for `scripts/bench`.
//!
//!     bench-kernels KERNEL WIDTHxHEIGHT REPEATS [--step]
//!     bench-kernels --instructions
//!
//! After a run that is not counted it prints `ready`, then a line for each repeat: CPU seconds of the process, and clock
//! seconds. With `--step` each repeat waits for a line on standard input, so that several programs can take turns.
//! `--instructions` prints the sets of vector instructions that can be chosen here.
//!
//! A stage goes over a frame in bands, as programs do, from one buffer to another that are made once. The light is a ramp
//! from 10 to 30 000 e⁻ over the whole frame, so that no two photosites that are neighbors expect the same.

use cpu_time::ProcessTime;
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::{CfaPattern, Class};
use cyanometer::color::Space;
use cyanometer::error::{Error, Result};
use cyanometer::frame::{Rows, Window, to_sample};
use cyanometer::numerics::moments::Moments;
use cyanometer::numerics::planes::weighted_sums;
use cyanometer::numerics::vectors::{self, Instructions};
use cyanometer::random::Source;
use cyanometer::random::philox::philox4x32_10;
use cyanometer::spectrum::{Along, Between, WavelengthGrid};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::ToXyz;
use cyanometer::stream::{MemoryFrame, Stage};
use cyanometer_studies::camera::{EXPOSURE, color_settings, sensor};
use cyanometer_studies::frames;
use rand_core::TryRng;
use rand_distr::{Distribution, Poisson, StandardNormal};
use std::convert::Infallible;
use std::hint::black_box;
use std::io::{BufRead, Write};
use std::process::ExitCode;
use std::time::Instant;

/// Light at the first and the last photosite, e⁻.
const RAMP_E: [f64; 2] = [10.0, 30_000.0];

/// One run over the whole frame.
type Workload = Box<dyn FnMut()>;

/// Makes a kernel for a frame of some width and height.
type Maker = fn(usize, usize) -> Result<Workload>;

/// Names of the kernels, and what makes them.
const KERNELS: [(&str, Maker); 15] = [
    ("noise-plane", |width, height| noise(cfa_plane(width, height)?)),
    ("noise-three", |width, height| noise(expected(width, height)?)),
    ("noise-rand-distr", noise_by_rand_distr),
    ("copy", |width, height| Ok(copy(cfa_plane(width, height)?.samples))),
    ("copy-three", |width, height| Ok(copy(expected(width, height)?.samples))),
    ("adc", |width, height| {
        let plane = cfa_plane(width, height)?;
        Ok(over(Digitize::new(&plane.header, &AdcSettings::default())?, plane))
    }),
    ("bilinear", |width, height| interpolation(Method::Bilinear, width, height)),
    ("shti", |width, height| interpolation(Method::SmoothHue, width, height)),
    ("eci", |width, height| interpolation(Method::EffectiveColor, width, height)),
    ("mhc", |width, height| interpolation(Method::Malvar, width, height)),
    ("matrix", matrix),
    ("moments", moments),
    ("moments-plane", |width, height| Ok(moments_of(cfa_plane(width, height)?))),
    ("spectral", spectral),
    ("spectral-read", spectral_read),
];

/// Three planes of the ramp.
fn expected(width: usize, height: usize) -> Result<MemoryFrame> {
    let step = (RAMP_E[1] - RAMP_E[0]) / ((width * height).max(2) - 1) as f64;
    let mut samples = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for _ in 0..3 {
            samples.extend((0..width).map(|x| to_sample(RAMP_E[0] + step * (y * width + x) as f64)));
        }
    }
    Ok(MemoryFrame::new(frames::head(&sensor()?.sensor, [width, height], None), samples))
}

fn cfa_plane(width: usize, height: usize) -> Result<MemoryFrame> {
    frames::mosaicked(&expected(width, height)?)
}

fn codes(width: usize, height: usize) -> Result<MemoryFrame> {
    frames::codes(&cfa_plane(width, height)?)
}

fn demosaicked(width: usize, height: usize) -> Result<MemoryFrame> {
    frames::demosaicked(&codes(width, height)?, Method::Bilinear)
}

/// A stage on a frame, band by band, into a buffer that the next band uses again, as programs do.
fn over<S: Stage + 'static>(stage: S, input: MemoryFrame) -> Workload {
    let from = input.header.geometry.clone();
    let to = stage.header().geometry.clone();
    let rows = from.cached_rows().min(to.cached_rows());
    let mut output = vec![0.0; rows * to.row_samples()];
    Box::new(move || {
        for first in (0..to.height).step_by(rows) {
            let samples = &mut output[..rows.min(to.height - first) * to.row_samples()];
            let window = Window::new(from.height, 0, from.width, from.channels.len(), &input.samples);
            stage.apply(window, Rows::new(first, to.width, to.channels.len(), samples));
            black_box(&output);
        }
    })
}

fn noise(frame: MemoryFrame) -> Result<Workload> {
    Ok(over(AddNoise::new(&frame.header, &NoiseSettings::default())?, frame))
}

fn copy(samples: Vec<f32>) -> Workload {
    let mut output = vec![0.0; samples.len()];
    Box::new(move || {
        output.copy_from_slice(black_box(&samples));
        black_box(&output);
    })
}

fn interpolation(method: Method, width: usize, height: usize) -> Result<Workload> {
    let plane = codes(width, height)?;
    Ok(over(Demosaic::new(&plane.header, method, Black::Auto, None)?, plane))
}

fn matrix(width: usize, height: usize) -> Result<Workload> {
    let rgb = demosaicked(width, height)?;
    let xyz_from_camera = [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]];
    let settings = color_settings(xyz_from_camera, Space::Xyz);
    Ok(over(ToXyz::new(&rgb.header, &settings)?, rgb))
}

/// Mean, extremes and covariance of three planes.
fn moments(width: usize, height: usize) -> Result<Workload> {
    Ok(moments_of(demosaicked(width, height)?))
}

fn moments_of(frame: MemoryFrame) -> Workload {
    let geometry = frame.header.geometry.clone();
    Box::new(move || {
        let mut moments = Moments::new(geometry.channels.len());
        for row in frame.samples.chunks_exact(geometry.row_samples()) {
            let planes: Vec<&[f32]> = row.chunks_exact(geometry.width).collect();
            moments.add(&planes);
        }
        black_box(&moments);
    })
}

/// Spectral radiances at 471 wavelengths to the electrons of three classes, from rows as an EXR holds them.
fn spectral(width: usize, height: usize) -> Result<Workload> {
    let loaded = sensor()?;
    let (wavelengths_nm, _) = WavelengthGrid::default().points()?;
    let weights = loaded.response()?.weights_on(&loaded.sensor, &EXPOSURE, &WavelengthGrid::default())?;
    let (camera, _) = weights.camera(&wavelengths_nm);
    let bands = wavelengths_nm.len();
    let samples = spectral_samples(width, height, bands);
    let between = Between::new(&wavelengths_nm, Along::Wavelength, false);
    let planes = camera.planes(&(0..bands).collect::<Vec<usize>>(), &between, &vec![1.0; bands]);
    let mut output = Vec::with_capacity(width * height);
    Ok(Box::new(move || {
        output.clear();
        for row in samples.chunks_exact(width * bands) {
            weighted_sums(row, width, &planes, |electrons| output.push(electrons));
        }
        black_box(&output);
    }))
}

fn spectral_samples(width: usize, height: usize, bands: usize) -> Vec<f32> {
    (0..width * height * bands).map(|i| to_sample(1e-6 * (1.0 + (i % 97) as f64))).collect()
}

/// Reading the samples of such an image, and nothing more than adding them up: what memory allows.
fn spectral_read(width: usize, height: usize) -> Result<Workload> {
    let samples = spectral_samples(width, height, WavelengthGrid::default().points()?.0.len());
    Ok(Box::new(move || {
        black_box(vectors::run(Reading(&samples)));
    }))
}

struct Reading<'a>(&'a [f32]);

impl vectors::Kernel for Reading<'_> {
    type Output = [f32; 128];

    #[inline(always)]
    fn run(self) -> [f32; 128] {
        let mut sums = [0.0; 128];
        for samples in self.0.as_chunks().0 {
            for (sum, sample) in sums.iter_mut().zip::<&[f32; 128]>(samples) {
                *sum += sample;
            }
        }
        sums
    }
}

/// The noise of a CFA plane as one writes it down with rand_distr, on the same generator with the same keys.
fn noise_by_rand_distr(width: usize, height: usize) -> Result<Workload> {
    let plane = cfa_plane(width, height)?;
    let readout = sensor()?.sensor.readout()?.clone();
    let dark_e = readout.dark_current_e_per_s(readout.temperature_k) * EXPOSURE.exposure_s;
    let refused = |_| Error::Data("rand_distr refuses a rate".into());
    let dark_shot = Poisson::new(dark_e).map_err(refused)?;
    let mut output = vec![0.0; plane.samples.len()];
    Ok(Box::new(move || {
        for (y, (rates, noisy)) in plane.samples.chunks(width).zip(output.chunks_mut(width)).enumerate() {
            let classes = CfaPattern::Rggb.row_classes([0, 0], y);
            for (x, (&rate, noisy)) in rates.iter().zip(noisy).enumerate() {
                *noisy = photosite(f64::from(rate), classes[x % 2], [x, y], &dark_shot, &readout);
            }
        }
        black_box(&output);
    }))
}

#[expect(clippy::cast_possible_truncation, reason = "frames are narrower than 2³²")]
fn photosite(rate: f64, class: Class, [x, y]: [usize; 2], dark_shot: &Poisson<f64>, readout: &ReadOut) -> f32 {
    let draws = |source| Draws::new(source, class, x as u32, y as u32);
    let normal = |source| -> f64 { StandardNormal.sample(&mut draws(source)) };
    let light = Poisson::new(rate).map_or(rate, |shot| shot.sample(&mut draws(Source::Ssn)));
    let light = light * (1.0 + readout.prnu * normal(Source::Prnu)).max(0.0);
    let dark = dark_shot.sample(&mut draws(Source::Dcsn)) * (1.0 + readout.dcnu * normal(Source::Dcnu)).max(0.0);
    to_sample((light + dark).min(readout.full_well_e) + readout.read_noise_e * normal(Source::Ron))
}

/// Words of one photosite and source for `rand_distr`, which takes as many as it needs: a stream of Philox blocks.
struct Draws {
    counter: [u32; 4],
    block: [u32; 4],
    used: usize,
}

impl Draws {
    fn new(source: Source, class: Class, x: u32, y: u32) -> Self {
        let counter = [x, y, 0, u32::from(source as u8) << 24 | u32::from(class as u8) << 16];
        Self { counter, block: [0; 4], used: 4 }
    }
}

impl TryRng for Draws {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> std::result::Result<u32, Infallible> {
        if self.used == self.block.len() {
            self.block = philox4x32_10(self.counter, [0, 0]);
            self.counter[3] = self.counter[3].wrapping_add(1);
            self.used = 0;
        }
        self.used += 1;
        Ok(self.block[self.used - 1])
    }

    fn try_next_u64(&mut self) -> std::result::Result<u64, Infallible> {
        let low = u64::from(self.try_next_u32()?);
        Ok(u64::from(self.try_next_u32()?) << 32 | low)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> std::result::Result<(), Infallible> {
        for chunk in bytes.chunks_mut(4) {
            chunk.copy_from_slice(&self.try_next_u32()?.to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

fn repeat(mut kernel: Workload, repeats: usize, step: bool) -> std::io::Result<()> {
    let mut output = std::io::stdout().lock();
    let mut turns = std::io::stdin().lock().lines();
    kernel();
    writeln!(output, "ready")?;
    output.flush()?;
    for _ in 0..repeats {
        if step && turns.next().transpose()?.is_none() {
            break;
        }
        let (cpu, clock) = (ProcessTime::now(), Instant::now());
        kernel();
        writeln!(output, "{:.6} {:.6}", cpu.elapsed().as_secs_f64(), clock.elapsed().as_secs_f64())?;
        output.flush()?;
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (words, step) = match &words[..] {
        ["--instructions"] => {
            let names: Vec<&str> =
                Instructions::ALL.into_iter().filter(|set| set.are_available()).map(Instructions::name).collect();
            let told = writeln!(std::io::stdout(), "{}", names.join(" "));
            return if told.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
        }
        [words @ .., "--step"] => (words, true),
        words => (words, false),
    };
    let parsed = match words {
        [name, size, repeats] => {
            let kernel = KERNELS.iter().find(|(known, _)| known == name);
            let size = size.split_once('x').and_then(|(w, h)| w.parse().ok().zip(h.parse().ok()));
            kernel.zip(size).zip(repeats.parse().ok())
        }
        _ => None,
    };
    let Some((((_, make), (width, height)), repeats)) = parsed else {
        let names: Vec<&str> = KERNELS.iter().map(|(name, _)| *name).collect();
        eprintln!("usage: bench-kernels KERNEL WIDTHxHEIGHT REPEATS [--step]; kernels: {}", names.join(", "));
        return ExitCode::from(2);
    };
    let done = make(width, height).map(|kernel| repeat(kernel, repeats, step));
    match done {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            eprintln!("bench-kernels: {error}");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("bench-kernels: {error}");
            ExitCode::FAILURE
        }
    }
}

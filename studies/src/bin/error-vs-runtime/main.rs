//! Error against run time, for every choice that a user can make: points, Pareto fronts, and advice.
//!
//! Writes a page and plots into the directory that is named: `scripts/error-vs-runtime`. All numbers but the times are the
//! same at every run; with `--quick` frames are small and times rough, to see that all works. `--scene FILE` adds a picture
//! of three planes to what demosaicking is judged by.

mod averaging;
mod bench;
mod demosaicking;
mod equations;
mod page;
mod pareto;
mod precision;
mod sample_size;
mod shot_noise;
mod storage;
mod training;
mod wavelength;

use bench::Bench;
use cyanometer::analysis::characterization::regression::Weights;
use cyanometer::chain::{CameraSetup, Predictor, PredictorSettings};
use cyanometer::color::Space;
use cyanometer::error::{Error, Result};
use cyanometer::formats::output::write_text;
use cyanometer::frame::to_sample;
use cyanometer::metadata::FrameHeader;
use cyanometer::numerics::vectors::Instructions;
use cyanometer::propagation::Equations;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::to_xyz::ColorSettings;
use cyanometer::stream::MemoryFrame;
use cyanometer_studies::camera::{Camera, color_settings};
use cyanometer_studies::{frames, pages};
use page::Section;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

/// What all studies share.
pub struct Study {
    camera: Camera,
    /// XYZ by SkyRadLS on all 912 skies, errors relative to luminance.
    color: ColorSettings,
    bench: Bench,
    quick: bool,
    /// A picture to demosaic.
    scene: Option<PathBuf>,
}

impl Study {
    /// The first seed of a study; no two studies use the same.
    fn seed(&self, study: u64) -> u64 {
        1_000_000 * study
    }

    /// The head of a frame of expected electrons; `uniform` are those of a uniform scene.
    fn head(&self, size: [usize; 2], uniform: Option<[f64; 3]>) -> FrameHeader {
        frames::head(&self.camera.sensor, size, uniform)
    }

    /// A uniform scene behind the filter array.
    fn plane(&self, size: [usize; 2], electrons: [f64; 3]) -> Result<MemoryFrame> {
        frames::mosaicked(&frames::uniform(&self.camera.sensor, size, electrons)?)
    }

    /// A sky that becomes brighter and whiter downward, three planes of expected electrons.
    fn sky_with_gradient(&self, [width, height]: [usize; 2]) -> MemoryFrame {
        let mut samples = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            let down = y as f64 / height as f64;
            for (low, high) in [(3000.0, 20_000.0), (9000.0, 25_000.0), (16_000.0, 28_000.0)] {
                samples.extend(std::iter::repeat_n(to_sample(low + down * (high - low)), width));
            }
        }
        MemoryFrame::new(self.head([width, height], None), samples)
    }

    /// The noise budget by formula, ready to predict.
    fn predictor(&self, method: Method, equations: Equations, with_color: bool) -> Result<Predictor> {
        let camera = CameraSetup { method, ..frames::setup(&self.camera.sensor) };
        let color = with_color.then(|| self.color.clone());
        Predictor::new(PredictorSettings { color, equations, ..PredictorSettings::of(camera) })
    }
}

type Part = fn(&Study) -> Result<Section>;

const PARTS: [(&str, Part); 9] = [
    ("wavelength", wavelength::study),
    ("shot-noise", shot_noise::study),
    ("sample-size", sample_size::study),
    ("equations", equations::study),
    ("demosaicking", demosaicking::study),
    ("precision", precision::study),
    ("storage", storage::study),
    ("training", training::study),
    ("averaging", averaging::study),
];

const USAGE: &str = "error-vs-runtime DIRECTORY [--quick] [--only PART] [--scene FILE]";

fn main() -> ExitCode {
    let mut directory = None;
    let (mut quick, mut only, mut scene) = (false, None, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--quick" => quick = true,
            "--only" => only = arguments.next(),
            "--scene" => scene = arguments.next().map(PathBuf::from),
            _ if directory.is_none() && !argument.starts_with('-') => directory = Some(argument),
            _ => {
                eprintln!("usage: {USAGE}");
                return ExitCode::from(2);
            }
        }
    }
    let Some(directory) = directory else {
        eprintln!("error-vs-runtime: name the directory to write to; usage: {USAGE}");
        return ExitCode::from(2);
    };
    pages::finish("error-vs-runtime", run(Path::new(&directory), quick, only.as_deref(), scene))
}

fn run(directory: &Path, quick: bool, only: Option<&str>, scene: Option<PathBuf>) -> Result<()> {
    // All work is done by this thread, so that its CPU time is that of the work.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
    one.map_err(|error| Error::Data(format!("threads cannot be set: {error}")))?;
    let plots = directory.join("error-vs-runtime");
    pages::make_directory(&plots)?;
    let camera = Camera::new()?;
    let color = color_settings(camera.fit_to_skies(Weights::Relative)?, Space::Xyz);
    let study = Study { camera, color, bench: Bench::new(quick), quick, scene };
    let mut sections = Vec::new();
    for (name, part) in PARTS.into_iter().filter(|(name, _)| only.is_none_or(|only| only == *name)) {
        let start = Instant::now();
        sections.push(part(&study)?);
        eprintln!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
    let mut text = head(&study);
    for (index, section) in sections.iter().enumerate() {
        text.push_str(&section.write(index + 1, &plots)?);
    }
    write_text(Some(&directory.join("error-vs-runtime.md")), &format!("{}\n", text.trim_end()))
}

fn head(study: &Study) -> String {
    let mut text = String::from("# Error against run time\n\n");
    let _ = writeln!(
        text,
        "Made by `scripts/error-vs-runtime`{} on {}, {}. All errors come from fixed seeds and are the same at every run; \
         times are not.\n",
        if study.quick { " `--quick`: small frames, rough times," } else { "" },
        machine(),
        date(),
    );
    let _ = writeln!(
        text,
        "Each point is a setting that a user can choose: its error against a reference that is better by orders of magnitude (where it is not, the section says so), and \
         its time. Times are CPU time of one thread (the programs use all cores where that helps), the median of {} runs where nothing else is \
         said; the alternatives of a study run by turns, so that \
         whatever else the machine does hits all alike. The gray staircase, where there is one, is the Pareto front: the least error that is reached \
         within a time; names have the color of their points, and are black where points of several share one. Signals are those of the KAF-5101CE, 33 ms at f/8.\n",
        study.bench.rounds()
    );
    text
}

/// The processor and the vector instructions in use.
fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")?.split(':').nth(1));
    let model = model.map_or_else(|| std::env::consts::ARCH.to_owned(), |name| name.trim().to_owned());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {} vectors, {}", Instructions::widest().name(), std::env::consts::OS)
}

/// Today, as `date` says.
fn date() -> String {
    let output = Command::new("date").args(["-u", "+%Y-%m-%d"]).output().ok();
    output.and_then(|output| String::from_utf8(output.stdout).ok()).map_or("–".into(), |text| text.trim().to_owned())
}

//! Demosaicking methods: what they do to structure, to noise, and in how much time.

use crate::Study;
use crate::bench::Work;
use crate::page::{Section, digits, percent, time};
use crate::pareto::{self, Choice, Group};
use cyanometer::cfa::CfaPattern;
use cyanometer::error::Result;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::frame::to_sample;
use cyanometer::plot::{Arrangement, Axis, Color, Marks, Panel, Plot};
use cyanometer::propagation::{Equations, gains};
use cyanometer::random::philox::philox4x32_10;
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::Demosaic;
use cyanometer::stages::demosaic::weights::WeightTable;
use cyanometer::stream::{MemoryFrame, RowSource};
use cyanometer_studies::camera::{METHODS, SKY};
use cyanometer_studies::frames::{demosaicked, mosaicked};
use cyanometer_studies::pages::{Table, number};
use std::hint::black_box;
use std::path::Path;

/// Pixels about the edge that are not judged: farther than any method reaches.
const RIM: usize = 4;

/// A scene whose three classes are known at every photosite.
struct Scene {
    name: String,
    truth: MemoryFrame,
}

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let size = if study.quick { [192, 128] } else { [768, 512] };
    let mut scenes = vec![
        scene(study, size, "ramp", |x, y| {
            let up = 0.2 + 0.6 * (x + 0.5 * y);
            [0.5 * up, 0.7 * up, up]
        }),
        scene(study, size, "stripes, 12 pixels", |x, y| stripes(x * size[0] as f64, y * size[0] as f64, 12.0)),
        scene(study, size, "stripes, 3 pixels", |x, y| stripes(x * size[0] as f64, y * size[0] as f64, 3.0)),
    ];
    let texture = Texture::new(study.seed(5), size[0]);
    scenes.push(scene(study, size, "1/f texture", |x, y| texture.at(x, y)));
    if let Some(path) = &study.scene {
        scenes.push(picture(study, path)?);
    }

    let mut errors = vec![Vec::new(); METHODS.len()];
    for scene in &scenes {
        let plane = mosaicked(&scene.truth)?;
        for (index, (_, method)) in METHODS.into_iter().enumerate() {
            errors[index].push(deviation(&scene.truth, &demosaicked(&plane, method)?));
        }
    }
    let mut gains = Vec::new();
    let mut noise = Vec::new();
    for (_, method) in METHODS {
        let weights = WeightTable::new(method, CfaPattern::Rggb).about([1.0; 2]);
        let covariance = gains::mean_pixel(&weights).covariance([1.0; 3]);
        gains.push([0, 1, 2].map(|i| covariance[(i, i)].sqrt()));
        let prediction = study.predictor(method, Equations::Exact, true)?.predict(SKY)?;
        noise.push(prediction.noise_delta_e.map_or(f64::NAN, |delta| delta.mean));
    }
    let timed_frame = mosaicked(&scenes[3].truth)?;
    let pixels = timed_frame.samples.len() as f64;
    let stages = METHODS.map(|(_, method)| Demosaic::new(&timed_frame.header, method, Black::Auto, None));
    let mut works: Vec<Work<'_>> = Vec::new();
    for stage in stages {
        let (stage, frame) = (stage?, &timed_frame);
        works.push(Box::new(move || {
            black_box(frame.through(&stage)?);
            Ok(())
        }));
    }
    let times: Vec<f64> = study.bench.medians(&mut works)?.into_iter().map(|time| time / pixels).collect();

    let judged = scenes.len() - 1;
    let points = |of: &dyn Fn(usize) -> f64| {
        let point = |index: usize| Choice::new(METHODS[index].0, times[index] * 1e9, of(index));
        [Group::new("", (0..METHODS.len()).map(point).collect())]
    };
    let x = "CPU time per pixel, ns";
    let structure = pareto::panel(
        &format!("bias: {}", scenes[judged].name),
        [x, "rms error / rms signal"],
        &points(&|i| errors[i][judged]),
        1e-9,
    );
    let color = pareto::panel("color noise: clear sky", [x, "expected ΔE*ab of noise"], &points(&|i| noise[i]), 1e-9);
    let mut plot = Plot::new("Demosaicking methods", structure);
    plot.panels.push(color);
    plot.panels.push(trade(&errors, judged, &noise));
    plot.arrangement = Arrangement::Pairs;

    let mut heads = vec!["method".to_owned()];
    heads.extend(scenes.iter().map(|scene| format!("bias: {}", scene.name)));
    heads.extend(["noise gain R, G, B (gray)".into(), "ΔE\\*ab of noise, clear sky".into(), "time per pixel".into()]);
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    for (index, (name, _)) in METHODS.into_iter().enumerate() {
        let mut cells = vec![name.to_owned()];
        cells.extend(errors[index].iter().map(|&error| percent(error)));
        cells.push(gains[index].map(|gain| number(gain, 3)).join(", "));
        cells.extend([digits(noise[index], 3), time(times[index])]);
        table.row(&cells);
    }
    let least =
        |of: &dyn Fn(usize) -> f64| (0..METHODS.len()).min_by(|&a, &b| of(a).total_cmp(&of(b))).unwrap_or_default();
    let (sharp, quiet, fast) = (least(&|i| errors[i][judged]), least(&|i| noise[i]), least(&|i| times[i]));
    Ok(Section {
        title: "Demosaicking method".into(),
        method: format!(
            "Expected electrons without noise, mosaicked and demosaicked (`demosaic --method bi|shti|eci|mhc`), against the scene \
             itself, all pixels but {RIM} at the rim: root of the mean square of the errors of the three classes over that of the \
             signal. The ramp is straight with constant hues; stripes are gray sines at 27° to the rows; the texture is noise \
             whose amplitude falls as 1/f down to periods of about 4 pixels, a tenth as strong in hue as in light, from a fixed seed. Noise gain is σ of a \
             pixel over that of a photosite where all classes are alike; the color noise is the expected ΔE\\*ab of a pixel of a \
             clear sky (`predict-noise`, exact). Time on a frame of {}×{} in memory.",
            size[0], size[1]
        ),
        figures: vec![("demosaicking".into(), "Bias and color noise against time, by method".into(), plot)],
        tables: vec![(String::new(), table)],
        advice: format!(
            "For scenes with structure take {} (bias {} of {}, {} by BI); for uniform skies {}, whose color noise is lowest \
             (ΔE {}, {} by {}); {} is the fastest ({} per pixel, {} by {}).",
            METHODS[sharp].0,
            percent(errors[sharp][judged]),
            scenes[judged].name,
            percent(errors[0][judged]),
            METHODS[quiet].0,
            digits(noise[quiet], 3),
            digits(noise[sharp], 3),
            METHODS[sharp].0,
            METHODS[fast].0,
            time(times[fast]),
            time(times[sharp]),
            METHODS[sharp].0,
        ),
    })
}

/// Bias against color noise, the front of those that no other beats in both.
fn trade(errors: &[Vec<f64>], judged: usize, noise: &[f64]) -> Panel {
    let points: Vec<Choice> =
        (0..METHODS.len()).map(|i| Choice::new(METHODS[i].0, noise[i], errors[i][judged])).collect();
    let mut panel = Panel::new(Axis::linear("expected ΔE*ab of noise"), Axis::linear("rms error / rms signal"));
    panel.title = "bias against color noise".into();
    let place = |choice: &Choice| [choice.time, choice.error];
    let front: Vec<[f64; 2]> = pareto::front(points.iter()).into_iter().map(place).collect();
    panel.add("beaten by none in both", Color::Gray, Marks::Line(front));
    panel.add("", Color::Blue, Marks::Points(points.iter().map(place).collect()));
    for choice in &points {
        panel.name(place(choice), &choice.label, Color::Blue);
    }
    panel
}

/// A scene from a function of the place, whose first coordinate runs from 0 to 1.
fn scene(study: &Study, [width, height]: [usize; 2], name: &str, at: impl Fn(f64, f64) -> [f64; 3]) -> Scene {
    const FULL_E: f64 = 20_000.0;
    let mut samples = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        let row: Vec<[f64; 3]> = (0..width).map(|x| at(x as f64 / width as f64, y as f64 / width as f64)).collect();
        (0..3).for_each(|class| samples.extend(row.iter().map(|pixel| to_sample(FULL_E * pixel[class]))));
    }
    Scene { name: name.into(), truth: MemoryFrame::new(study.head([width, height], None), samples) }
}

fn stripes(x: f64, y: f64, period: f64) -> [f64; 3] {
    let along = (x * 27_f64.to_radians().cos() + y * 27_f64.to_radians().sin()) * std::f64::consts::TAU / period;
    [0.5 + 0.3 * along.sin(); 3]
}

/// A picture of three planes, its brightest sample at 0.9 of full well.
fn picture(study: &Study, path: &Path) -> Result<Scene> {
    let mut reader = FrameReader::open(&InputOptions { path: Some(path.to_owned()), ..InputOptions::default() })?;
    let geometry = reader.header().geometry.clone();
    let mut samples = Vec::new();
    reader.read(geometry.height, &mut samples)?;
    let largest = samples.iter().fold(0.0, |a: f32, b| a.max(*b));
    samples.iter_mut().for_each(|sample| *sample *= 36_000.0 / largest);
    let truth = MemoryFrame::new(study.head([geometry.width, geometry.height], None), samples);
    let name = path.file_stem().map_or("picture".into(), |name| name.to_string_lossy().into_owned());
    Ok(Scene { name, truth })
}

/// Octaves of smooth noise, all of the same strength, down to nodes two pixels apart: amplitudes fall as 1/f, as those of
/// natural scenes do, until a lens takes what is finer.
struct Texture {
    seed: u64,
    octaves: u32,
}

impl Texture {
    fn new(seed: u64, width: usize) -> Self {
        Self { seed, octaves: (width / 6).ilog2() + 1 }
    }

    /// A number from −1 to 1 that belongs to a node of a lattice.
    fn node(&self, layer: u32, octave: u32, x: u32, y: u32) -> f64 {
        #[expect(clippy::cast_possible_truncation, reason = "the two halves of the seed")]
        let key = [self.seed as u32, (self.seed >> 32) as u32];
        f64::from(philox4x32_10([x, y, octave, layer], key)[0]) / f64::from(u32::MAX) * 2.0 - 1.0
    }

    fn layer(&self, layer: u32, x: f64, y: f64) -> f64 {
        let octave = |octave: u32| {
            let frequency = 3.0 * 2_f64.powi(octave.cast_signed());
            let (u, v) = (x * frequency, y * frequency);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand nodes")]
            let (i, j) = (u.floor() as u32, v.floor() as u32);
            let ease = |t: f64| t * t * (3.0 - 2.0 * t);
            let (s, t) = (ease(u.fract()), ease(v.fract()));
            let node = |di: u32, dj: u32| self.node(layer, octave, i + di, j + dj);
            let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
            mix(mix(node(0, 0), node(1, 0), s), mix(node(0, 1), node(1, 1), s), t)
        };
        (0..self.octaves).map(octave).sum()
    }

    fn at(&self, x: f64, y: f64) -> [f64; 3] {
        let light = 0.3 * (0.35 * self.layer(0, x, y)).exp();
        let hue = |layer: u32| (0.035 * self.layer(layer, x, y)).exp();
        [0.7 * light * hue(1), light, 1.3 * light * hue(2)]
    }
}

/// Root of the mean square of the errors over that of the signal, without the rim.
fn deviation(truth: &MemoryFrame, found: &MemoryFrame) -> f64 {
    let geometry = &truth.header.geometry;
    let (mut error, mut signal) = (0.0, 0.0);
    let lines = truth.samples.chunks_exact(geometry.width).zip(found.samples.chunks_exact(geometry.width));
    for (index, (truth, found)) in lines.enumerate() {
        let y = index / 3;
        if y < RIM || y + RIM >= geometry.height {
            continue;
        }
        for (&truth, &found) in truth.iter().zip(found).skip(RIM).take(geometry.width - 2 * RIM) {
            error += (f64::from(found) - f64::from(truth)).powi(2);
            signal += f64::from(truth).powi(2);
        }
    }
    (error / signal).sqrt()
}

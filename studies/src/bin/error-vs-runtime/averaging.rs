//! Averaging frames, and averaging pixels.

use crate::Study;
use crate::bench::timed;
use crate::page::{Section, digits, time};
use crate::pareto::{self, Choice, Group};
use cyanometer::chain::{ChainStage, StagePrediction};
use cyanometer::error::{Error, Result};
use cyanometer::frame::to_sample;
use cyanometer::numerics::moments::Moments;
use cyanometer::plot::{Axis, Color, Marks, Panel, Plot};
use cyanometer::propagation::{Equations, FramePrediction, of_frame};
use cyanometer::stages::demosaic::Method;
use cyanometer::stream::MemoryFrame;
use cyanometer_studies::camera::SKY;
use cyanometer_studies::frames::{codes, demosaicked, exposed, std};
use cyanometer_studies::pages::{Table, number};

/// The channel that is judged, red: a quarter of the photosites measure it.
const CHANNEL: usize = 0;
const METHOD: Method = Method::Bilinear;
/// Sides of the patches.
const SIDES: [usize; 6] = [1, 2, 4, 8, 16, 32];

/// A number of values averaged.
struct Mean {
    count: usize,
    simulated: f64,
    predicted: f64,
    /// What independent values would give.
    independent: f64,
    /// Time for each mean.
    time: f64,
}

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let (size, frames) = if study.quick { ([96, 64], 8_usize) } else { ([384, 256], 64) };
    let pixels = size[0] * size[1];
    let mut chain = study.predictor(METHOD, Equations::Exact, false)?;
    let prediction = chain.predict(SKY)?;
    let missing = || Error::Data("the chain has no such stage".into());
    let stage = prediction.stages.iter().find(|stage| stage.stage == ChainStage::Demosaicked).ok_or_else(missing)?;
    let expected = study.plane(size, SKY)?;
    let shot = |seed: u64, sensor: u64| demosaicked(&codes(&exposed(&expected, seed, sensor)?)?, METHOD);

    // Frames of one sensor: the same patterns, new temporal noise.
    let mut sum = vec![0.0_f64; pixels];
    let mut by_frames = Vec::new();
    let mut spent = 0.0;
    for frame in 1..=frames {
        let (rgb, taken) = timed(|| {
            let rgb = shot(study.seed(9) + frame as u64, study.seed(9))?;
            add(&mut sum, &rgb);
            Ok(rgb)
        })?;
        spent += taken;
        drop(rgb);
        if frame.is_power_of_two() {
            let mean: Vec<f32> = sum.iter().map(|sum| to_sample(sum / frame as f64)).collect();
            let mut moments = Moments::new(1);
            moments.add(&[&mean]);
            by_frames.push(Mean {
                count: frame,
                simulated: std(&moments, 0),
                predicted: of_frames(stage, frame),
                independent: stage.std[CHANNEL] / (frame as f64).sqrt(),
                time: spent / pixels as f64,
            });
        }
    }

    // Pixels of one frame each of many sensors.
    let repeats = if study.quick { 4 } else { 24 };
    let mut found: Vec<Moments> = SIDES.iter().map(|_| Moments::new(1)).collect();
    let mut spent = vec![0.0; SIDES.len()];
    let mut mixture = None;
    for repeat in 0..repeats {
        let seed = study.seed(9) + 1000 + repeat;
        let (rgb, taken) = timed(|| shot(seed, seed))?;
        if mixture.is_none()
            && let Ok(FramePrediction::Pixels(mixed)) = of_frame(&rgb.header, Equations::Exact)
        {
            mixture = Some(mixed);
        }
        for ((side, moments), spent) in SIDES.iter().zip(&mut found).zip(&mut spent) {
            let ((), averaging) = timed(|| {
                patches(&rgb, *side, moments);
                Ok(())
            })?;
            *spent += taken + averaging;
        }
    }
    let mixture = mixture.ok_or_else(missing)?;
    let mut by_pixels = Vec::new();
    for ((side, moments), spent) in SIDES.iter().zip(&found).zip(spent) {
        let predicted = mixture.patch_mean_covariance(None, [*side, *side])[(CHANNEL, CHANNEL)].sqrt();
        by_pixels.push(Mean {
            count: side * side,
            simulated: std(moments, 0),
            predicted,
            independent: stage.std[CHANNEL] / *side as f64,
            time: spent * (side * side) as f64 / (repeats as f64 * pixels as f64),
        });
    }

    let choices = |means: &[Mean]| -> Vec<Choice> {
        means.iter().map(|m| Choice::new(format!("n = {}", m.count), m.time * 1e6, m.simulated)).collect()
    };
    let groups = [Group::new("n frames", choices(&by_frames)), Group::new("n pixels", choices(&by_pixels))];
    let top = pareto::panel("", ["CPU time per mean, µs", "σ of the mean of red, ADU"], &groups, 1e-9);
    let mut bottom = Panel::new(Axis::log10("values averaged, n"), Axis::log10("σ of the mean of red, ADU"));
    let series = |means: &[Mean], of: &dyn Fn(&Mean) -> f64| means.iter().map(|m| [m.count as f64, of(m)]).collect();
    bottom.add("n frames: simulated", Color::Blue, Marks::Points(series(&by_frames, &|m| m.simulated)));
    bottom.add("n frames: predicted", Color::Blue, Marks::Line(series(&by_frames, &|m| m.predicted)));
    bottom.add("n pixels: simulated", Color::Vermillion, Marks::Points(series(&by_pixels, &|m| m.simulated)));
    bottom.add("n pixels: predicted", Color::Vermillion, Marks::Line(series(&by_pixels, &|m| m.predicted)));
    let independent = |means: &[Mean]| -> Vec<[f64; 2]> { series(means, &|m| m.independent) };
    bottom.add("σ/√n, independent pixels", Color::Gray, Marks::Dashed(independent(&by_pixels)));
    // 4σ²/n of the photosites of red, of which there are n/4.
    let site = mixture.sites[CHANNEL].moments.std();
    let quarter = by_pixels.iter().map(|m| [m.count as f64, 2.0 * site / (m.count as f64).sqrt()]).collect();
    bottom.add("2σ/√n, σ of a photosite", Color::Green, Marks::Dashed(quarter));
    let mut plot = Plot::new("Averaging frames and pixels: red of a clear sky, BI", top);
    plot.panels.push(bottom);

    let mut table = Table::new(&["averaged", "n", "σ simulated, ADU", "σ predicted", "σ/√n", "time per mean"]);
    for (name, means) in [("frames", &by_frames), ("pixels", &by_pixels)] {
        for mean in means {
            table.row(&[
                name.into(),
                mean.count.to_string(),
                number(mean.simulated, 4),
                number(mean.predicted, 4),
                number(mean.independent, 4),
                time(mean.time),
            ]);
        }
    }
    let last = |means: &[Mean]| means.last().map_or((0, f64::NAN), |m| (m.count, m.simulated / m.independent));
    let ((frames, above_frames), (most, above_pixels)) = (last(&by_frames), last(&by_pixels));
    let floor = stage.fixed_pattern_std.map_or(f64::NAN, |std| std[CHANNEL]);
    let half = stage.temporal_std.map_or(f64::NAN, |std| (std[CHANNEL] / floor).powi(2));
    Ok(Section {
        title: "Averaging frames, averaging pixels".into(),
        method: format!(
            "Red of a clear sky ({} e⁻) after BI, {}×{} pixels: the mean of n frames of one sensor at each pixel (its σ is over the \
             pixels, patterns included), and the mean of patches of n pixels of one frame, {repeats} sensors. Frames share their \
             fixed patterns: σ² = σ_fixed² + σ_temporal²/n. Demosaicked pixels share photosites: the mean of n pixels has nearly \
             the variance of the mean of the n/4 red photosites, 4σ²/n. The time is that of all pixels that one mean is made \
             of, noise to demosaicking.",
            SKY[CHANNEL], size[0], size[1]
        ),
        figures: vec![("averaging".into(), "σ of a mean against time and number".into(), plot)],
        tables: vec![(String::new(), table)],
        advice: format!(
            "Average pixels rather than frames: the patterns leave {} ADU however many frames there are, half of the variance at \
             {} frames ({frames} frames: {} times σ/√n). Take the σ of a patch from `predict-noise --patch`, never σ/√n: for \
             {most} pixels it is {} times too small.",
            digits(floor, 3),
            digits(half, 2),
            number(above_frames, 1),
            number(above_pixels, 2),
        ),
    })
}

/// Predicted σ of the mean of n frames.
fn of_frames(stage: &StagePrediction, frames: usize) -> f64 {
    let part = |std: Option<[f64; 3]>| std.map_or(f64::NAN, |std| std[CHANNEL].powi(2));
    (part(stage.fixed_pattern_std) + part(stage.temporal_std) / frames as f64).sqrt()
}

/// The rows of the channel that is judged.
fn rows(frame: &MemoryFrame) -> impl Iterator<Item = &[f32]> {
    let width = frame.header.geometry.width;
    frame.samples.chunks_exact(3 * width).map(move |row| &row[CHANNEL * width..(CHANNEL + 1) * width])
}

fn add(sum: &mut [f64], frame: &MemoryFrame) {
    for (sum, &sample) in sum.iter_mut().zip(rows(frame).flatten()) {
        *sum += f64::from(sample);
    }
}

/// Takes in the means of the patches that a frame can be cut into.
fn patches(frame: &MemoryFrame, side: usize, moments: &mut Moments) {
    let width = frame.header.geometry.width;
    let lines: Vec<&[f32]> = rows(frame).collect();
    for band in lines.chunks_exact(side) {
        let mut sums = vec![0.0; width / side];
        for line in band {
            for (sum, patch) in sums.iter_mut().zip(line.chunks_exact(side)) {
                *sum += patch.iter().map(|&sample| f64::from(sample)).sum::<f64>();
            }
        }
        let means: Vec<f32> = sums.iter().map(|sum| to_sample(sum / (side * side) as f64)).collect();
        moments.add(&[&means]);
    }
}

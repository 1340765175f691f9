//! Simulated standard deviations as the number of photosites grows, beside the formula.

use crate::Study;
use crate::bench::{Work, timed};
use crate::page::{Section, count, digits, percent, time};
use crate::pareto::{self, Choice, Group};
use cyanometer::error::{Error, Result};
use cyanometer::frame::to_sample;
use cyanometer::numerics::moments::Moments;
use cyanometer::plot::{Axis, Color, Marks, Panel, Plot, power_of_ten};
use cyanometer::propagation::{Equations, Photosite};
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseModel;
use cyanometer::stream::MemoryFrame;
use cyanometer_studies::camera::SKY;
use cyanometer_studies::frames::{codes, exposed, median};
use cyanometer_studies::pages::{Table, number};
use std::hint::black_box;

/// Signal electrons; those of green of the clear sky.
const LEVEL_E: f64 = SKY[1];

/// A number of photosites.
struct Size {
    photosites: usize,
    frames: usize,
    /// Root of the mean square of the relative deviations of σ, in ADU.
    error: f64,
    /// What theory expects, kurtosis included.
    expected: f64,
    time: f64,
}

/// A power of ten as such, any other number as it is.
fn power(value: usize) -> String {
    let magnitude = value.max(1).ilog10();
    if value == 10_usize.pow(magnitude) { power_of_ten(magnitude.cast_signed()) } else { value.to_string() }
}

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let sizes: &[(usize, usize)] = if study.quick {
        &[(100, 20), (1000, 20), (10_000, 10), (100_000, 3)]
    } else {
        &[(100, 400), (1000, 400), (10_000, 200), (100_000, 60), (1_000_000, 12), (10_000_000, 3)]
    };
    let head = study.plane([2, 2], [LEVEL_E; 3])?.header;
    let noisy = exposed(&MemoryFrame::new(head, vec![to_sample(LEVEL_E); 4]), 0, 0)?;
    let adc = codes(&noisy)?.header.metadata.adc;
    let (record, adc) =
        noisy.header.metadata.noise.as_ref().zip(adc).ok_or_else(|| Error::Data("the stages left no record".into()))?;
    let model = NoiseModel::of(&noisy.header, record)?;
    let predicted = Photosite::of_electrons(model, Equations::Exact).digitized(adc).moments(LEVEL_E);
    let sigma = predicted.moments.std();
    let mut chain = study.predictor(Method::Bilinear, Equations::Exact, true)?;
    let mut works: Vec<Work<'_>> = vec![
        Box::new(|| {
            black_box(Photosite::of_electrons(model, Equations::Exact).digitized(adc).moments(black_box(LEVEL_E)));
            Ok(())
        }),
        Box::new(|| {
            black_box(chain.predict(black_box(SKY))?);
            Ok(())
        }),
    ];
    let formula = study.bench.medians(&mut works)?;
    drop(works);

    let mut seed = study.seed(3);
    let mut found = Vec::new();
    for &(photosites, frames) in sizes {
        let width = photosites.min(1000);
        // Rows at once, so that ten million photosites need no more memory than a million.
        let height = (photosites / width).min(1000);
        let pieces = photosites / (width * height);
        let expected = study.plane([width, height], [LEVEL_E; 3])?;
        let (mut squares, mut times) = (0.0, Vec::new());
        for _ in 0..frames {
            let (moments, taken) = timed(|| {
                let mut moments = Moments::new(1);
                for _ in 0..pieces {
                    seed += 1;
                    let codes = codes(&exposed(&expected, seed, seed)?)?;
                    for row in codes.samples.chunks_exact(width) {
                        moments.add(&[row]);
                    }
                }
                Ok(moments)
            })?;
            squares += (moments.std(0).unwrap_or(f64::NAN) / sigma - 1.0).powi(2);
            times.push(taken);
        }
        let n = photosites as f64;
        found.push(Size {
            photosites,
            frames,
            error: (squares / frames as f64).sqrt(),
            expected: ((2.0 + predicted.excess_kurtosis) / (4.0 * n)).sqrt(),
            time: median(times),
        });
    }

    let simulated =
        found.iter().map(|s| Choice::new(format!("{} photosites", power(s.photosites)), s.time * 1e3, s.error));
    let simulated: Vec<Choice> = simulated.collect();
    let foot = found.last().map_or(1e-4, |size| 0.3 * size.expected);
    let formulas = vec![
        Choice::new("formula of the codes", formula[0] * 1e3, 0.0),
        Choice::new("whole chain by formula", formula[1] * 1e3, 0.0),
    ];
    let groups = [Group::new("simulated", simulated), Group::new("by formula (no sampling error)", formulas)];
    let left = pareto::panel("", ["CPU time, ms", "relative error of σ (rms over frames)"], &groups, foot);
    let mut right = Panel::new(Axis::log10("photosites"), Axis::log10("relative error of σ (rms over frames)"));
    let line = |x: f64| [x, (2.0 * x).sqrt().recip()];
    right.add("1/√(2n)", Color::Gray, Marks::Line(found.iter().map(|size| line(size.photosites as f64)).collect()));
    let points: Vec<[f64; 2]> = found.iter().map(|size| [size.photosites as f64, size.error]).collect();
    let bars = found.iter().map(|size| {
        let scatter = 1.0 / (2.0 * size.frames as f64).sqrt();
        [size.photosites as f64, size.expected * (1.0 - scatter), size.expected * (1.0 + scatter)]
    });
    right.add("expected, ± one standard error", Color::SkyBlue, Marks::ErrorBars(bars.collect()));
    right.add("simulated", Color::Blue, Marks::Points(points));
    let mut plot = Plot::new(&format!("σ of codes at {LEVEL_E} e⁻: simulated against predicted"), left);
    plot.panels.push(right);

    let mut table =
        Table::new(&["photosites", "frames", "error of σ, rms", "expected", "1/√(2n)", "time of one frame"]);
    for size in &found {
        let n = size.photosites as f64;
        table.row(&[
            count(size.photosites),
            size.frames.to_string(),
            percent(size.error),
            percent(size.expected),
            percent((2.0 * n).sqrt().recip()),
            time(size.time),
        ]);
    }
    table.row(&["formula, σ of the codes".into(), "–".into(), "0".into(), "0".into(), "–".into(), time(formula[0])]);
    table.row(&["formula, all stages".into(), "–".into(), "0".into(), "0".into(), "–".into(), time(formula[1])]);
    let largest = found.last().ok_or_else(|| Error::Data("no sizes".into()))?;
    let z = largest.error / largest.expected;
    // Time grows with n, the error falls as its root.
    let tenth_percent = largest.photosites as f64 * (largest.expected / 1e-3).powi(2);
    let tenth_time = largest.time * tenth_percent / largest.photosites as f64;
    Ok(Section {
        title: "Simulating σ, and predicting it".into(),
        method: format!(
            "Codes of a uniform scene of {LEVEL_E} e⁻ (`add-noise | digitize | measure`), every frame with patterns and noise of \
             its own; the reference is the exact prediction (`predict-noise`), σ = {} ADU. The error is the root of the mean \
             square over the frames; expected is √((2 + excess kurtosis)/4n). Times of frames up to 1000 photosites are mostly \
             the cost of setting the stages up.",
            number(sigma, 4)
        ),
        figures: vec![("sample-size".into(), "Error of σ against time and photosites".into(), plot)],
        tables: vec![(String::new(), table)],
        advice: format!(
            "Use the formula wherever it applies: {} for all stages, without sampling error; a simulation needs {} photosites and \
             {} to know one σ to 0.1 % (one standard error). Simulate to check the formula: {} photosites leave {} and deviate \
             from it by {} of that.",
            time(formula[1]),
            digits(tenth_percent, 2),
            time(tenth_time),
            count(largest.photosites),
            percent(largest.expected),
            number(z, 1),
        ),
    })
}

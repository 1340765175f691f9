//! The paper's equations, exact ones, and simulations.

use crate::Study;
use crate::bench::{Work, timed};
use crate::page::{Section, percent, time};
use crate::pareto::{self, Choice, Group};
use cyanometer::chain::{ChainPrediction, ChainStage, Predictor};
use cyanometer::error::Result;
use cyanometer::plot::Plot;
use cyanometer::propagation::Equations;
use cyanometer::stages::demosaic::Method;
use cyanometer_studies::camera::{METHODS, SKY};
use cyanometer_studies::frames::{codes, demosaicked, exposed, median, moments, stds};
use cyanometer_studies::pages::Table;
use std::hint::black_box;

/// Scenes: names, and e⁻ of R, G and B.
const LEVELS: [(&str, [f64; 3]); 3] =
    [("dark room, 20 e⁻", [20.0; 3]), ("gray, 10 000 e⁻", [10_000.0; 3]), ("clear sky", SKY)];
/// Photosites of the simulation that a user may run instead.
const SMALL: [usize; 2] = [100, 100];

/// One way to know σ.
struct Way {
    method: usize,
    name: &'static str,
    /// Largest relative error over the channels, of each level.
    errors: [f64; 3],
    time: f64,
}

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let size = if study.quick { [400, 300] } else { [2400, 1600] };
    // The huge simulation: one exposure of each level, through every method.
    let mut reference = [[[0.0; 3]; 3]; METHODS.len()];
    let mut small_sigma: [[Vec<[f64; 3]>; 3]; METHODS.len()] = Default::default();
    let mut small_times = vec![Vec::new(); METHODS.len()];
    for (level, (_, electrons)) in LEVELS.into_iter().enumerate() {
        let seed = study.seed(4) + 10 * level as u64;
        let plane = codes(&exposed(&study.plane(size, electrons)?, seed, seed)?)?;
        let scene = study.plane(SMALL, electrons)?;
        for (index, (_, method)) in METHODS.into_iter().enumerate() {
            reference[index][level] = stds(&moments(&demosaicked(&plane, method)?));
            for repeat in 0..study.bench.rounds() as u64 {
                let seed = seed + 1000 * (repeat + 1);
                let (found, taken) =
                    timed(|| Ok(moments(&demosaicked(&codes(&exposed(&scene, seed, seed)?)?, method)?)))?;
                small_times[index].push(taken);
                small_sigma[index][level].push(stds(&found));
            }
        }
    }

    let mut chains: Vec<(usize, &'static str, Predictor)> = Vec::new();
    for (index, (_, method)) in METHODS.into_iter().enumerate() {
        if method != Method::Malvar {
            chains.push((index, "paper", study.predictor(method, Equations::Paper, false)?));
        }
        chains.push((index, "exact", study.predictor(method, Equations::Exact, false)?));
    }
    let mut predictions = Vec::new();
    for (index, name, chain) in &mut chains {
        let mut of_level = Vec::new();
        for (_, electrons) in LEVELS {
            of_level.push(sigma(&chain.predict(electrons)?));
        }
        predictions.push((*index, *name, of_level));
    }
    let mut works: Vec<Work<'_>> = Vec::new();
    for (_, _, chain) in &mut chains {
        works.push(Box::new(move || {
            black_box(chain.predict(black_box(LEVELS[2].1))?);
            Ok(())
        }));
    }
    let times = study.bench.medians(&mut works)?;
    drop(works);

    let exact_of = |method: usize, level: usize| {
        let found = predictions.iter().find(|(index, name, _)| *index == method && *name == "exact");
        found.map_or([f64::NAN; 3], |(_, _, levels)| levels[level])
    };
    let worst =
        |found: [f64; 3], truth: [f64; 3]| (0..3).map(|i| (found[i] / truth[i] - 1.0).abs()).fold(0.0, f64::max);
    let mut ways = Vec::new();
    for ((method, name, levels), time) in predictions.iter().zip(times) {
        // Exact equations are judged by the simulation, which the others are too coarse to tell from them.
        let against = |level: usize| {
            if *name == "exact" { reference[*method][level] } else { exact_of(*method, level) }
        };
        ways.push(Way { method: *method, name, errors: [0, 1, 2].map(|l| worst(levels[l], against(l))), time });
    }
    for (method, times) in small_times.into_iter().enumerate() {
        let errors = [0, 1, 2].map(|level| scatter(&small_sigma[method][level], exact_of(method, level)));
        ways.push(Way { method, name: "simulation 100×100", errors, time: median(times) });
    }

    for way in ways.iter_mut().filter(|way| METHODS[way.method].1 == Method::SmoothHue) {
        way.errors[0] = f64::NAN;
    }
    ways.sort_by_key(|way| way.method);
    let groups: Vec<Group> = ["exact", "paper", "simulation 100×100"]
        .into_iter()
        .map(|name| {
            let of_name = ways.iter().filter(|way| way.name == name);
            let point = |way: &Way| {
                let error = way.errors.into_iter().filter(|e| e.is_finite()).fold(0.0, f64::max);
                Choice::new(METHODS[way.method].0, way.time * 1e6, error)
            };
            Group::new(name, of_name.map(point).collect())
        })
        .collect();
    let panel = pareto::panel("", ["CPU time, µs", "largest relative error of σ"], &groups, 1e-5);
    let plot = Plot::new("σ of demosaicked channels: paper, exact, simulated", panel);
    let mut heads = vec!["method", "way"];
    let level_heads: Vec<String> = LEVELS.iter().map(|(name, _)| format!("{name}: error")).collect();
    heads.extend(level_heads.iter().map(String::as_str));
    heads.push("time");
    let mut table = Table::new(&heads);
    for way in &ways {
        let mut cells = vec![METHODS[way.method].0.to_owned(), way.name.to_owned()];
        cells.extend(way.errors.map(|error| if error.is_finite() { percent(error) } else { "void".into() }));
        cells.push(time(way.time));
        table.row(&cells);
    }
    let of = |name: &str, combine: &dyn Fn(f64, f64) -> f64, start: f64, of_way: &dyn Fn(&Way) -> f64| {
        ways.iter().filter(|way| way.name == name).map(of_way).fold(start, combine)
    };
    let lit = |way: &Way| way.errors[1].max(way.errors[2]);
    let exact_error = of("exact", &f64::max, 0.0, &lit);
    let paper: Vec<String> = ways
        .iter()
        .filter(|way| way.name == "paper")
        .map(|way| format!("{} ({})", percent(lit(way)), METHODS[way.method].0))
        .collect();
    let longest = |name| of(name, &f64::max, 0.0, &|way: &Way| way.time);
    let not_hue = |way: &&Way| way.name == "exact" && METHODS[way.method].1 != Method::SmoothHue;
    let linear = ways.iter().filter(not_hue).map(|way| way.time).fold(0.0, f64::max);
    let pixels = (size[0] * size[1]) as f64;
    Ok(Section {
        title: "The paper's equations and exact ones".into(),
        method: format!(
            "σ of demosaicked R, G and B of uniform scenes, the worst channel (`predict-noise --equations paper|exact`). The \
             paper's equations and a simulation of 100×100 pixels are judged by the exact ones; the exact ones by a simulation \
             of {}×{} pixels, whose own standard error is {} for independent pixels and up to twice that for correlated \
             ones. MHC is younger than the paper. Of SHTI the exact equations are to first order in the ratios; in the dark room \
             green is not clear of its noise, the ratios have no moments and no equation holds.",
            size[0],
            size[1],
            percent((2.0 * pixels).sqrt().recip()),
        ),
        figures: vec![("equations".into(), "Error of σ against time, by equations".into(), plot)],
        tables: vec![(String::new(), table)],
        advice: format!(
            "Take the exact equations, the default: in the lit scenes they are within {} of the simulation, whose own standard error \
             is {} and more; the paper's are off by {} there. The paper's take at most {}, the exact ones {}, and {} for SHTI, \
             which also goes to second order. A simulation of 100×100 pixels takes {} and scatters by {}.",
            percent(exact_error),
            percent((2.0 * pixels).sqrt().recip()),
            paper.join(", "),
            time(longest("paper")),
            time(linear),
            time(longest("exact")),
            time(longest("simulation 100×100")),
            percent(of("simulation 100×100", &f64::max, 0.0, &lit)),
        ),
    })
}

/// Relative deviation of simulated σ from the truth, root of the mean square, of the worst channel.
fn scatter(found: &[[f64; 3]], truth: [f64; 3]) -> f64 {
    let of_channel = |i: usize| {
        let squares: f64 = found.iter().map(|sigma| (sigma[i] / truth[i] - 1.0).powi(2)).sum();
        (squares / found.len() as f64).sqrt()
    };
    (0..3).map(of_channel).fold(0.0, f64::max)
}

/// σ of the demosaicked channels.
fn sigma(prediction: &ChainPrediction) -> [f64; 3] {
    prediction
        .stages
        .iter()
        .find(|stage| stage.stage == ChainStage::Demosaicked)
        .map_or([f64::NAN; 3], |stage| stage.std)
}

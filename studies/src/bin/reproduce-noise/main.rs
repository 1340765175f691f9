//! Reproduces the noise figures and tables of \[HP2005]: Figs. 4 to 7, Tables 7 and 8.
//!
//! Writes Markdown and figures into the directory that is named, always the same to the byte: `scripts/reproduce noise`.

mod agreement;
mod camera;
mod correlation;
mod figures;
mod limits;
mod prediction;
mod report;
mod sweep;

use agreement::{Row, SkyRow};
use camera::{Camera, SMALL};
use correlation::Covariances;
use cyanometer::error::Result;
use cyanometer::formats::output::write_text;
use cyanometer::plot::Plot;
use cyanometer::propagation::Equations;
use cyanometer::propagation::paper::Coefficients;
use cyanometer::stages::demosaic::Method;
use cyanometer_studies::frames;
use cyanometer_studies::pages::{write_figure, write_into_directory};
use figures::HueLevel;
use limits::{Edge, Limit};
use prediction::{Equation, Sites};
use std::path::Path;
use std::process::ExitCode;
use sweep::Level;

/// Columns and rows of the larger frames of each sky.
const SKY: [usize; 2] = [240, 160];

/// Coefficients of Table 8 and readings of r′₂ from every side.
struct Correlations {
    /// By the weights as a simulation measures them, and as the equations need them: equal signals.
    equal: [[f64; 11]; 2],
    /// Measured in small and large frames, equal signals.
    equal_measured: [[f64; 11]; 2],
    /// The standard deviation of a coefficient from one small frame to the next.
    spread: [f64; 11],
    /// Means over the skies.
    skies: [[f64; 11]; 2],
    /// Means over the skies, measured.
    skies_measured: [[f64; 11]; 2],
    /// Readings of r′₂: equal signals, skies; red and blue.
    readings: Vec<[[f64; 2]; 2]>,
}

/// All that is reported.
struct Results {
    camera: Camera,
    levels: Vec<Level>,
    /// Table 7 with even steps.
    rows: Vec<Row>,
    /// The same with even factors.
    factor_rows: Vec<Row>,
    sky_rows: Vec<SkyRow>,
    hues: Vec<HueLevel>,
    correlations: Correlations,
    limits: Vec<Limit>,
    edges: Vec<Edge>,
}

fn main() -> ExitCode {
    write_into_directory("reproduce-noise", run)
}

fn run(directory: &Path) -> Result<()> {
    let camera = Camera::new()?;
    // Seeds of each part start at a round number; no draw is used twice.
    let levels = sweep::sweep(&camera, &sweep::even_levels(), 1000)?;
    let plotted = sweep::sweep(&camera, &sweep::even_factors(), 2000)?;
    let hues = figures::hue_levels(&camera, 3000)?;
    let limits = limits::limits(&camera, 4000)?;
    let edges = limits::edges(&camera, 5000)?;
    let (sky_rows, correlations) = skies(&camera, &levels, 10_000)?;
    let rows = agreement::rows(&camera, &levels);
    let factor_rows = agreement::rows(&camera, &plotted);

    let figure = |name: &str, plot: &Plot| write_figure(directory, name, plot);
    let xyz = |title: &str, equation, gray| figures::xyz(&camera, &plotted, title, equation, gray);
    figure("fig4", &xyz("Fig. 4: noise of XYZ after BI", Equation::Bi14, None))?;
    figure("fig5", &xyz("Fig. 5: noise of XYZ after SHTI", Equation::Shti15, Some((Equation::Shti48, "Eq. 48"))))?;
    figure("fig6", &figures::hue(&camera, &hues))?;
    figure("fig7", &xyz("Fig. 7: noise of XYZ after ECI", Equation::EciEqual, None))?;
    let results = Results { camera, levels, rows, factor_rows, sky_rows, hues, correlations, limits, edges };
    write_text(Some(&directory.join("noise.md")), &report::markdown(&results)?)
}

/// Simulates the 912 skies after ECI: the last rows of Table 7, and Table 8.
fn skies(camera: &Camera, levels: &[Level], first_seed: u64) -> Result<(Vec<SkyRow>, Correlations)> {
    let mut observed = Vec::new();
    let mut measured = [Vec::new(), Vec::new()];
    for (index, &sky) in camera.skies.iter().enumerate() {
        let mut std = [[0.0; 3]; 2];
        for (which, size) in [SMALL, SKY].into_iter().enumerate() {
            let seed = first_seed + 2 * index as u64 + which as u64;
            let rgb = frames::demosaicked(&camera.plane(size, sky, seed)?, Method::EffectiveColor)?;
            std[which] = frames::stds(&frames::moments(&camera.xyz(&rgb)?));
            measured[which].push(Covariances::of(&camera::class_moments(&rgb)).table());
        }
        observed.push(std);
    }
    let below: Vec<&Level> = levels.iter().filter(|level| level.electrons <= agreement::UNCLIPPED_E).collect();
    let equal = |large: bool| -> Vec<[f64; 11]> {
        below.iter().map(|l| Covariances::of(if large { &l.large.classes } else { &l.small.classes }).table()).collect()
    };
    let small = equal(false);
    let mean = correlation::mean(small.iter().copied());
    let squares =
        correlation::mean(small.iter().map(|r| std::array::from_fn::<f64, 11, _>(|i| (r[i] - mean[i]).powi(2))));
    let variances: Vec<[f64; 3]> =
        camera.skies.iter().map(|&sky| Sites::of(camera, sky, Equations::Exact).variance).collect();
    let over_skies = |of: fn([f64; 3]) -> [f64; 11]| correlation::mean(variances.iter().map(|&v| of(v)));
    let simulated = |v| correlation::list(&Coefficients::simulated(v));
    let effective = |v| correlation::list(&Coefficients::effective(v));
    let readings_of = |index: usize, v: [f64; 3]| Covariances::by_weights(v).readings()[index];
    let readings = (0..correlation::READINGS.len()).map(|index| {
        [readings_of(index, [1.0; 3]), correlation::mean(variances.iter().map(|&v| readings_of(index, v)))]
    });
    let correlations = Correlations {
        equal: [simulated([1.0; 3]), effective([1.0; 3])],
        equal_measured: [mean, correlation::mean(equal(true).into_iter())],
        spread: squares.map(f64::sqrt),
        skies: [over_skies(simulated), over_skies(effective)],
        skies_measured: measured.map(|measured| correlation::mean(measured.into_iter())),
        readings: readings.collect(),
    };
    let own = correlation::unlist(correlations.skies[1]);
    let sky_rows = agreement::sky_rows(camera, &observed, [SMALL, SKY], &own);
    Ok((sky_rows, correlations))
}

//! Reproduces the color figures and tables of \[HP2005]: Figs. 3 and 8, Tables 3 to 6; and goes on to skies that were not
//! trained on.
//!
//! Writes Markdown and figures into the directory that is named, always the same to the byte: `scripts/reproduce color`.

mod chromaticity;
mod report;
mod studio;

use chromaticity::{SkyColor, chromaticity};
use cyanometer::analysis::characterization::evaluation::SampleEvaluation;
use cyanometer::analysis::characterization::noise_aware::TradeOff;
use cyanometer::analysis::characterization::regression::{Regression, Weights};
use cyanometer::color::difference::DifferenceReport;
use cyanometer::error::Result;
use cyanometer::formats::output::write_text;
use cyanometer::plot::{Arrangement, Axis, Color, Marks, Panel, Plot};
use cyanometer::report::trade_off;
use cyanometer::stages::demosaic::Method;
use cyanometer_studies::camera::METHODS;
use cyanometer_studies::pages::{write_figure, write_into_directory};
use std::path::Path;
use std::process::ExitCode;
use studio::Studio;

/// The regressions in the order of Tables 3 and 4, and one more.
const REGRESSIONS: [(&str, Regression); 4] = [
    ("MaxIgnSPPLS", Regression::MaxIgnSppls),
    ("SkyRadLS", Regression::SkyRadLs),
    ("SkyRadSPPLS", Regression::SkyRadSppls),
    ("MaxIgnSPPLS, positive", Regression::MaxIgnPositiveSppls),
];

/// A named evaluation of all skies.
struct Case {
    name: &'static str,
    skies: Vec<SampleEvaluation>,
}

/// A fit on other samples or with other weights, without noise.
struct Choice {
    training: String,
    weights: &'static str,
    /// SkyRadLS and SkyRadSPPLS.
    reports: [DifferenceReport; 2],
}

/// An aerosol, trained on and not.
struct HeldOut {
    aerosol: String,
    count: usize,
    /// SkyRadLS and SkyRadSPPLS: with the aerosol among the candidates, and without.
    with: [DifferenceReport; 2],
    without: [DifferenceReport; 2],
}

/// All that is reported.
struct Results {
    studio: Studio,
    regressions: Vec<Case>,
    methods: Vec<Case>,
    choices: Vec<Choice>,
    held_out: Vec<HeldOut>,
    /// The measured skies by matrices fitted to the computed ones.
    measured: Vec<(&'static str, DifferenceReport)>,
    /// The measured skies by SkyRadLS fitted to all of themselves.
    measured_own: DifferenceReport,
    trade_off: Vec<TradeOff>,
}

fn main() -> ExitCode {
    write_into_directory("reproduce-color", run)
}

fn run(directory: &Path) -> Result<()> {
    let studio = Studio::new()?;
    let case = |name, regression, method| -> Result<Case> {
        let matrix = studio.fit(regression, &studio.training, &Weights::Relative)?;
        Ok(Case { name, skies: studio.evaluate(&studio.camera.skies, &matrix, method, true)? })
    };
    let regressions: Vec<Case> =
        REGRESSIONS.into_iter().map(|(name, r)| case(name, r, Method::EffectiveColor)).collect::<Result<_>>()?;
    let methods: Vec<Case> =
        METHODS.into_iter().map(|(name, method)| case(name, Regression::SkyRadSppls, method)).collect::<Result<_>>()?;
    let (measured, measured_own) = studio.measured_skies()?;

    let figure = |name: &str, plot: &Plot| write_figure(directory, name, plot);
    let preserved = &regressions[2];
    figure("fig3", &colors(&studio, preserved))?;
    figure("fig8", &noise(preserved))?;
    let trade = studio.trade_off()?;
    figure("trade-off", &trade_off(&trade))?;
    let results = Results {
        choices: studio.choices()?,
        held_out: studio.held_out()?,
        measured,
        measured_own,
        trade_off: trade,
        regressions,
        methods,
        studio,
    };
    write_text(Some(&directory.join("color.md")), &report::markdown(&results)?)
}

/// Fig. 3.
fn colors(studio: &Studio, case: &Case) -> Plot {
    let xy = |[x, y, z]: [f64; 3]| [x / (x + y + z), y / (x + y + z)];
    let skies: Vec<SkyColor> = case
        .skies
        .iter()
        .map(|sky| SkyColor { xy: xy(sky.xyz), fitted_xy: xy(sky.camera_xyz), delta_e_94: sky.noise_free.delta_e_94 })
        .collect();
    chromaticity(&skies, Some(studio.kept), &studio.camera.observer, "Fig. 3: 912 skies and the errors of SkyRadSPPLS")
}

/// Fig. 8: observed against predicted noise of X, Y, Z, each by itself: together they would hide each other.
fn noise(case: &Case) -> Plot {
    let panel = |(index, (name, color)): (usize, (&str, Color))| {
        let x = Axis::log10(&format!("predicted σ of {name}, cd m⁻²"));
        let mut panel = Panel::new(x, Axis::log10(&format!("observed σ of {name}, cd m⁻²")));
        let point = |sky: &SampleEvaluation| {
            let noise = sky.noise?;
            Some([noise.predicted?.xyz_std[index], noise.xyz_std[index]])
        };
        let points: Vec<[f64; 2]> = case.skies.iter().filter_map(point).collect();
        let end = |pick: fn(f64, f64) -> f64| points.iter().map(|[predicted, _]| *predicted).reduce(pick);
        let ends = end(f64::min).into_iter().chain(end(f64::max));
        let equal = Marks::Line(ends.map(|end| [end, end]).collect());
        panel.add(&format!("{name} of a sky"), color, Marks::Points(points));
        panel.add("observed = predicted", Color::Black, equal);
        panel
    };
    let channels = [("X", Color::Vermillion), ("Y", Color::Green), ("Z", Color::Blue)];
    Plot {
        title: "Fig. 8: noise of XYZ of 912 skies, ECI, SkyRadSPPLS".into(),
        panels: channels.into_iter().enumerate().map(panel).collect(),
        arrangement: Arrangement::Stacked,
    }
}

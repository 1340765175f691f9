//! Figs. 4 to 7.

use crate::agreement::index_of;
use crate::camera::{self, Camera, LARGE, SMALL};
use crate::prediction::{Equation, Sites, effective_share, of_frame, roots, weights};
use crate::sweep::Level;
use cyanometer::error::Result;
use cyanometer::plot::{Axis, Color, Marks, Panel, Plot, ReferenceLine, Region};
use cyanometer::propagation::smooth_hue::{FirstOrder, VOID_BELOW};
use cyanometer::propagation::{Equations, gains};
use cyanometer::stages::demosaic::Method;
use cyanometer::stream::MemoryFrame;
use cyanometer_studies::frames::{self, median, std};

/// What X, Y and Z are drawn in.
const COLORS: [Color; 3] = [Color::Vermillion, Color::Green, Color::Blue];
const NAMES: [&str; 3] = ["X", "Y", "Z"];

/// The frame that lines are drawn for: so large that edges do not count.
const ENDLESS: [usize; 2] = [1 << 16; 2];

/// Standard deviations of X, Y and Z by exact moments, of a large frame.
pub fn exact_xyz(camera: &Camera, method: Method, electrons: [f64; 3]) -> [f64; 3] {
    let sites = Sites::of(camera, electrons, Equations::Exact);
    let weights = weights(method, &sites).through(&camera.xyz_from_adu);
    roots(&gains::mean_pixel(&weights).covariance(sites.variance))
}

/// Signal over noise of X, Y and Z in dB by exact moments, of a large frame.
pub fn exact_snr_db(camera: &Camera, method: Method, electrons: f64) -> [f64; 3] {
    let mean = mean_xyz(camera, electrons, Equations::Exact);
    let std = exact_xyz(camera, method, [electrons; 3]);
    [0, 1, 2].map(|i| 20.0 * (mean[i] / std[i]).log10())
}

fn mean_xyz(camera: &Camera, electrons: f64, equations: Equations) -> [f64; 3] {
    let mean = Sites::of(camera, [electrons; 3], equations).mean;
    (camera.xyz_from_adu * nalgebra::Vector3::from(mean)).into()
}

fn paper_xyz(camera: &Camera, equation: Equation, electrons: f64) -> [f64; 3] {
    roots(&equation.xyz(camera, &Sites::of(camera, [electrons; 3], Equations::Paper), ENDLESS))
}

/// Places for lines.
fn places() -> Vec<f64> {
    let even = (0..120).map(|step| 20.0 * 2000.0_f64.powf(f64::from(step) / 120.0)).filter(|&e| e < 37_000.0);
    // Toward full well the converter clips, and lines bend.
    even.chain((0..=30).map(|step| 37_000.0 + 100.0 * f64::from(step))).collect()
}

/// The panels of Figs. 4, 5 and 7: standard deviations, signal over noise, and standard deviations over the exact ones.
struct Panels {
    noise: Panel,
    snr: Panel,
    ratio: Panel,
}

/// Noise and signal-to-noise ratio of X, Y and Z after a method, simulated, by the paper and exact. `gray` is drawn in
/// gray.
pub fn xyz(camera: &Camera, levels: &[Level], title: &str, equation: Equation, gray: Option<(Equation, &str)>) -> Plot {
    let method = equation.method();
    // Green well above its noise, or there is no first order.
    let holds = |e: &f64| {
        let sites = Sites::of(camera, [*e; 3], Equations::Exact);
        method != Method::SmoothHue || FirstOrder::of(sites.mean, sites.variance).holds
    };
    let places: Vec<f64> = places().into_iter().filter(holds).collect();
    let levels: Vec<&Level> = levels.iter().filter(|level| holds(&level.electrons)).collect();
    let lowest = places.first().map_or(20.0, |e| 0.9 * e);
    let panel = |y| Panel::new(Axis::log10("signal in each class, e⁻").range(lowest, 50_000.0), y);
    let mut panels = Panels {
        noise: panel(Axis::log10("standard deviation, cd m⁻²")),
        snr: panel(Axis::linear("SNR, dB")),
        ratio: panel(Axis::linear("std over exact")),
    };
    panels.add_simulated(camera, &levels, method);
    panels.add_exact(camera, &places, method);
    panels.add_paper(camera, &places, equation, ("paper", &COLORS));
    if let Some((gray, name)) = gray {
        panels.add_paper(camera, &places, gray, (name, &[Color::Gray; 3]));
    }
    let Panels { noise, snr, mut ratio } = panels;
    ratio.horizontal_lines.push(ReferenceLine { at: 1.0, label: String::new() });
    let mut plot = Plot::new(title, noise);
    plot.panels.extend([snr, ratio]);
    plot
}

fn db(mean: f64, std: f64) -> f64 {
    20.0 * (mean / std).log10()
}

/// Above this the converter clips and no equation of the paper holds.
fn is_unclipped(electrons: f64) -> bool {
    electrons <= crate::agreement::UNCLIPPED_E
}

impl Panels {
    /// Points, and error bars of the ratio.
    fn add_simulated(&mut self, camera: &Camera, levels: &[&Level], method: Method) {
        let index = index_of(method);
        let matrix = &camera.xyz_from_adu;
        for (channel, (name, color)) in NAMES.into_iter().zip(COLORS).enumerate() {
            let points = |of: &dyn Fn(&Level) -> f64| {
                Marks::Points(levels.iter().map(|level| [level.electrons, of(level)]).collect())
            };
            self.noise.add(
                &format!("{name}, simulated 40×30"),
                color,
                points(&|level| level.small.xyz[index][channel]),
            );
            self.snr.add(&format!("{name}, simulated"), color, points(&|level| level.small.snr_db[index][channel]));
            // The three stand beside each other, that none hides another.
            let aside = 1.02_f64.powf(channel as f64 - 1.0);
            let (mut points, mut bars) = (Vec::new(), Vec::new());
            for level in levels.iter().filter(|level| is_unclipped(level.electrons)) {
                let sites = Sites::of(camera, [level.electrons; 3], Equations::Exact);
                let predicted = roots(&(matrix * of_frame(method, &sites, LARGE) * matrix.transpose()))[channel];
                let share = effective_share(&weights(method, &sites).through(matrix), sites.variance)[channel];
                let error = 1.0 / (2.0 * share * (LARGE[0] * LARGE[1]) as f64).sqrt();
                let at = level.large.xyz[index][channel] / predicted;
                points.push([aside * level.electrons, at]);
                bars.push([aside * level.electrons, at - error, at + error]);
            }
            self.ratio.add(&format!("{name}, simulated 600×400"), color, Marks::Points(points));
            self.ratio.add("", color, Marks::ErrorBars(bars));
        }
    }

    fn add_exact(&mut self, camera: &Camera, places: &[f64], method: Method) {
        for (channel, color) in COLORS.into_iter().enumerate() {
            let exact = |e: f64| exact_xyz(camera, method, [e; 3])[channel];
            let mean = |e: f64| mean_xyz(camera, e, Equations::Exact)[channel];
            self.noise.add("", color, Marks::Line(places.iter().map(|&e| [e, exact(e)]).collect()));
            self.snr.add("", color, Marks::Line(places.iter().map(|&e| [e, db(mean(e), exact(e))]).collect()));
        }
        for panel in [&mut self.noise, &mut self.snr] {
            panel.add("exact", Color::Black, Marks::Line(Vec::new()));
        }
    }

    /// Dashed lines of an equation, with the names of channels at their ends.
    fn add_paper(&mut self, camera: &Camera, places: &[f64], equation: Equation, look: (&str, &[Color; 3])) {
        let (name, colors) = look;
        let mut ends: Vec<[f64; 2]> = Vec::new();
        for (channel, &color) in colors.iter().enumerate() {
            let mean = |e: f64| mean_xyz(camera, e, Equations::Paper)[channel];
            let value = |e: f64| paper_xyz(camera, equation, e)[channel];
            let ratio = |e: f64| value(e) / exact_xyz(camera, equation.method(), [e; 3])[channel];
            let below = || places.iter().filter(|&&e| is_unclipped(e));
            let quotient: Vec<[f64; 2]> = below().map(|&e| [e, ratio(e)]).collect();
            self.noise.add("", color, Marks::Dashed(below().map(|&e| [e, value(e)]).collect()));
            self.snr.add("", color, Marks::Dashed(below().map(|&e| [e, db(mean(e), value(e))]).collect()));
            ends.extend(quotient.last());
            self.ratio.add("", color, Marks::Dashed(quotient));
        }
        // Lines that all but lie over each other share a name.
        let apart = ends.iter().map(|[_, y]| (y - ends[0][1]).abs()).fold(0.0, f64::max);
        if apart < 1e-3 && !ends.is_empty() {
            self.ratio.name(ends[0], "X, Y, Z", Color::Black);
        } else {
            let named = ends.iter().zip(NAMES).zip(colors);
            named.for_each(|((end, name), color)| self.ratio.name(*end, name, *color));
        }
        let color = if colors[0] == colors[1] { colors[0] } else { Color::Black };
        for panel in [&mut self.noise, &mut self.snr, &mut self.ratio] {
            panel.add(name, color, Marks::Dashed(Vec::new()));
        }
    }
}

/// One level of Fig. 6.
pub struct HueLevel {
    /// Signal electrons of blue; green and red have a twentieth.
    pub blue: f64,
    /// Standard deviation of measured blue, e⁻.
    pub before: f64,
    /// After SHTI in one frame of the paper's size, e⁻; black is bias and dark signal.
    pub small: f64,
    /// The same, median of many frames.
    pub median: f64,
    /// The same where only the bias is taken off and the dark signal stays.
    pub biased: f64,
    /// By Eq. 15, e⁻.
    pub paper: f64,
    /// By Eq. 15 with the dark signal left in.
    pub paper_biased: f64,
    /// Exact to first order, e⁻.
    pub exact: f64,
    /// The same with the dark signal left in.
    pub exact_biased: f64,
    /// Green over its noise.
    pub green_over_noise: f64,
}

/// B over G in Fig. 6.
const HUE: f64 = 20.0;

/// Frames whose median is taken.
pub const HUE_FRAMES: u64 = 25;

/// Simulates Fig. 6.
pub fn hue_levels(camera: &Camera, first_seed: u64) -> Result<Vec<HueLevel>> {
    let mut levels: Vec<f64> = (0..25).map(|step| (100.0 * 370.0_f64.powf(f64::from(step) / 24.0)).round()).collect();
    levels.extend([1000.0, 10_000.0]);
    levels.sort_by(f64::total_cmp);
    let blue = 2;
    let slope = camera.adc.adu_per_e;
    let mut found = Vec::new();
    for (index, &level) in levels.iter().enumerate() {
        let electrons = [level / HUE, level / HUE, level];
        let (mut before, mut dark_free, mut biased) = (0.0, Vec::new(), Vec::new());
        for frame in 0..HUE_FRAMES {
            let plane = camera.plane(SMALL, electrons, first_seed + HUE_FRAMES * index as u64 + frame)?;
            before += std(&camera::class_moments(&plane)[blue], 0).powi(2) / HUE_FRAMES as f64;
            let after = |rgb: MemoryFrame| std(&frames::moments(&rgb), blue) / slope;
            dark_free.push(after(frames::demosaicked(&plane, Method::SmoothHue)?));
            biased.push(after(camera::demosaicked_above(camera.adc.bias_adu, &plane, Method::SmoothHue)?));
        }
        let sites = Sites::of(camera, electrons, Equations::Exact);
        let mut with_dark = sites;
        with_dark.mean = sites.mean.map(|mean| mean + slope * camera.model.dark_e);
        let exact = |sites: &Sites| {
            let weights = weights(Method::SmoothHue, sites);
            roots(&gains::mean_pixel(&weights).covariance(sites.variance))[blue] / slope
        };
        let by_paper = |sites: &Sites| roots(&Equation::Shti15.covariance(sites, ENDLESS))[blue] / slope;
        found.push(HueLevel {
            blue: level,
            before: before.sqrt() / slope,
            small: dark_free[0],
            median: median(dark_free),
            biased: median(biased),
            paper: by_paper(&sites),
            paper_biased: by_paper(&with_dark),
            exact: exact(&sites),
            exact_biased: exact(&with_dark),
            green_over_noise: FirstOrder::of(sites.mean, sites.variance).green_over_noise,
        });
    }
    Ok(found)
}

/// The level whose measured noise is `std` e⁻, by exact moments.
pub fn level_with_noise(camera: &Camera, std: f64) -> f64 {
    let noise = |e: f64| (Sites::of(camera, [e; 3], Equations::Exact).variance[2]).sqrt() / camera.adc.adu_per_e;
    let (mut low, mut high) = (0.0, 38_000.0);
    if std >= noise(high) {
        return f64::INFINITY;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if noise(middle) < std { low = middle } else { high = middle }
    }
    low
}

/// Fig. 6.
pub fn hue(camera: &Camera, levels: &[HueLevel]) -> Plot {
    let mut panel = Panel::new(
        Axis::log10("signal in B, e⁻ (R and G have a twentieth)").range(90.0, 42_000.0),
        Axis::log10("standard deviation of B, e⁻").range(15.0, 5000.0),
    );
    let points = |value: &dyn Fn(&HueLevel) -> f64| levels.iter().map(|level| [level.blue, value(level)]).collect();
    let lines = |value: &dyn Fn(&HueLevel) -> f64, only: &dyn Fn(&HueLevel) -> bool| -> Vec<[f64; 2]> {
        levels.iter().filter(|level| only(level)).map(|level| [level.blue, value(level)]).collect()
    };
    let holds = |level: &HueLevel| level.green_over_noise >= VOID_BELOW;
    let measured = |e: f64| Sites::of(camera, [e; 3], Equations::Exact).variance[2].sqrt() / camera.adc.adu_per_e;
    panel.add("before: exact", Color::Blue, Marks::Line(lines(&|level| measured(level.blue), &|_| true)));
    panel.add("before: simulated", Color::Blue, Marks::Points(points(&|level| level.before)));
    panel.add("after SHTI: exact to first order", Color::Vermillion, Marks::Line(lines(&|level| level.exact, &holds)));
    panel.add("after SHTI: paper, Eq. 15", Color::Vermillion, Marks::Dashed(lines(&|level| level.paper, &|_| true)));
    panel.add("after SHTI: one frame of 40×30", Color::Black, Marks::Points(points(&|level| level.small)));
    panel.add("after SHTI: median of 25 such frames", Color::Vermillion, Marks::Points(points(&|level| level.median)));
    panel.add(
        "dark signal left in: exact to first order",
        Color::Green,
        Marks::Line(lines(&|level| level.exact_biased, &|_| true)),
    );
    panel.add("dark signal left in: median of 25", Color::Green, Marks::Points(points(&|level| level.biased)));
    let void = levels.iter().find(|level| holds(level)).map_or(f64::INFINITY, |level| level.blue);
    panel.regions.push(Region {
        from: 0.0,
        to: void,
        label: "first order void: green within 10 σ of zero".into(),
        color: Color::Yellow,
    });
    panel
        .horizontal_lines
        .push(ReferenceLine { at: measured(10_000.0), label: "noise of 10 000 e⁻ as measured".into() });
    Plot::new("Fig. 6: noise of B before and after SHTI at B = 20 G", panel)
}

//! Step and rule of the sum over wavelengths, for spectra of different smoothness.

use crate::Study;
use crate::bench::{Work, quantile};
use crate::page::{Section, digits, percent, time};
use crate::pareto::{self, Choice, Group};
use cyanometer::error::Result;
use cyanometer::formats::spectral;
use cyanometer::numerics::quadrature::Rule;
use cyanometer::plot::Plot;
use cyanometer::spectrum::WavelengthGrid;
use cyanometer_studies::camera::{Camera, EXPOSURE, sample_data};
use cyanometer_studies::pages::Table;
use std::hint::black_box;

/// Steps in nm. All divide the range an even number of times, as Simpson's rule needs.
const STEPS_NM: [f64; 6] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
const RULES: [(&str, Rule); 3] =
    [("rectangle", Rule::Rectangle), ("trapezoid", Rule::Trapezoid), ("Simpson", Rule::Simpson)];
/// Half of the closest spacing of the data: every interval of two steps lies between neighboring samples, where the integrand
/// is a polynomial of fourth degree.
const REFERENCE_STEP_NM: f64 = 0.025;
/// The spacing of the lamp's samples.
const LAMP_STEP_NM: f64 = 0.05;
/// The charge of the brightest class that errors in electrons refer to.
const BRIGHT_E: f64 = 30_000.0;

fn grid(step_nm: f64, quadrature: Rule) -> WavelengthGrid {
    WavelengthGrid { start_nm: 360.0, end_nm: 800.0, step_nm, quadrature }
}

/// Spectra of one kind.
struct Scene {
    name: &'static str,
    wavelength_nm: Vec<f64>,
    spectra: Vec<Vec<f64>>,
}

impl Scene {
    fn library(name: &'static str, file: &str, every: usize) -> Result<Self> {
        let (library, _) = spectral::read_library(&sample_data(file), None)?;
        let spectra = library.radiance.rows().into_iter().step_by(every).map(|row| row.to_vec()).collect();
        Ok(Self { name, wavelength_nm: library.wavelength_nm, spectra })
    }

    /// Lines of mercury and europium, as of a fluorescent lamp, 1 nm wide, above a faint continuum: forty lamps whose lines
    /// lie 0.05 nm further each, for at coarse steps it is luck where a line falls.
    fn lamps() -> Self {
        const LINES: [[f64; 2]; 8] = [
            [404.66, 0.4],
            [435.83, 1.0],
            [487.7, 0.3],
            [546.07, 1.3],
            [576.96, 0.25],
            [579.07, 0.25],
            [611.6, 1.2],
            [631.1, 0.3],
        ];
        let wavelength_nm: Vec<f64> = (0..=9400).map(|i| 360.0 + LAMP_STEP_NM * f64::from(i)).collect();
        let spectrum = |shift: f64| -> Vec<f64> {
            let sigma = 1.0 / (8.0 * std::f64::consts::LN_2).sqrt();
            let line =
                |nm: f64, [center, power]: [f64; 2]| power * (-0.5 * ((nm - center - shift) / sigma).powi(2)).exp();
            let value = |&nm: &f64| 1e-6 * (0.02 + LINES.iter().map(|&l| line(nm, l)).sum::<f64>());
            wavelength_nm.iter().map(value).collect()
        };
        let spectra = (0..40).map(|i| spectrum(0.05 * f64::from(i))).collect();
        Self { name: "lamp with lines 1 nm wide", wavelength_nm, spectra }
    }
}

/// A setting, judged.
struct Setting {
    rule: usize,
    step_nm: f64,
    /// Error of the worst class relative to that class: of 95 % of the spectra.
    error: f64,
    /// The same in e⁻, the brightest class at [`BRIGHT_E`].
    error_e: f64,
    time: f64,
}

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let camera = &study.camera;
    let every = if study.quick { 40 } else { 1 };
    let scenes = [
        Scene::library("computed skies (smooth)", "skies/sky912.exr", every)?,
        Scene::library("measured skies (structured)", "skies/kider2014.exr", every)?,
        Scene::lamps(),
    ];
    let mut panels = Vec::new();
    let mut table = Table::new(&[
        "rule",
        "step, nm",
        &format!("{}: error", scenes[0].name),
        &format!("{}: error", scenes[1].name),
        &format!("{}: error", scenes[2].name),
        "the same in e⁻ of 30 000",
        "time per spectrum",
        "lamp",
    ]);
    let mut all = Vec::new();
    for scene in &scenes {
        let settings = judge(study, scene)?;
        let groups: Vec<Group> = RULES
            .iter()
            .enumerate()
            .map(|(rule, (name, _))| {
                let of_rule = settings.iter().filter(|setting| setting.rule == rule);
                Group::new(
                    *name,
                    of_rule.map(|s| Choice::new(format!("{} nm", s.step_nm), s.time * 1e6, s.error)).collect(),
                )
            })
            .collect();
        panels.push(pareto::panel(
            scene.name,
            ["CPU time per spectrum, µs", "relative error of electrons"],
            &groups,
            1e-12,
        ));
        all.push(settings);
    }
    for (index, first) in all[0].iter().enumerate() {
        let each =
            |of: &dyn Fn(&Setting) -> String| all.iter().map(|settings| of(&settings[index])).collect::<Vec<_>>();
        let mut cells = vec![RULES[first.rule].0.to_owned(), first.step_nm.to_string()];
        cells.extend(each(&|setting| percent(setting.error)));
        cells.push(each(&|setting| digits(setting.error_e, 2)).join(" / "));
        cells.extend([time(first.time), time(all[2][index].time)]);
        table.row(&cells);
    }
    let mut plot = Plot::new("Wavelength step and rule", panels.remove(0));
    plot.panels.extend(panels);

    // What a further spectrum costs once the weights are there.
    let weights = camera.response.weights_on(&camera.sensor, &EXPOSURE, &grid(1.0, Rule::Trapezoid))?;
    let (ready, _) = weights.camera(&scenes[0].wavelength_nm);
    let sky = &scenes[0].spectra[0];
    let further = study.bench.medians(&mut [Box::new(|| {
        black_box(ready.electrons(black_box(sky)));
        Ok(())
    })])?;
    let pairs = all.iter().flat_map(|settings| settings.iter().zip(&settings[STEPS_NM.len()..]).take(STEPS_NM.len()));
    let apart = pairs.map(|(a, b)| (a.error - b.error).abs()).fold(0.0, f64::max);
    let points = scenes.iter().map(|scene| scene.wavelength_nm.len().to_string()).collect::<Vec<_>>();
    Ok(Section {
        title: "Wavelength step and rule of summation".into(),
        method: format!(
            "Expected electrons of R, G and B from 360 to 800 nm (`render-radiance --wavelengths 360:800:STEP --quadrature \
             RULE`), against Simpson's rule at {REFERENCE_STEP_NM} nm, which is exact for data that are linear between their \
             samples, as all programs take them: its two-step intervals lie between neighboring samples. {} computed and {} \
             measured skies and {} lamps with {}, {} and {} samples. The error is that of the worst class of each spectrum, \
             relative to that class; 95 % of the spectra have less. The time is that of one spectrum by itself: weights, \
             folding, sum. Once the weights are folded onto the samples of a library, each further spectrum takes {}, whatever \
             step and rule. Rectangles and trapezoids differ by at most {} of the signal, for \
             hardly anything responds at either end. Ending at 800 nm instead of 830 nm costs {}.",
            scenes[0].spectra.len(),
            scenes[1].spectra.len(),
            scenes[2].spectra.len(),
            points[0],
            points[1],
            points[2],
            time(further[0]),
            percent(apart),
            percent(cut(camera, &scenes[0])?),
        ),
        figures: vec![("wavelength".into(), "Error of electrons against time, by step and rule".into(), plot)],
        tables: vec![(String::new(), table)],
        advice: advice(&all),
    })
}

/// All settings for one kind of spectra.
fn judge(study: &Study, scene: &Scene) -> Result<Vec<Setting>> {
    let camera = &study.camera;
    let ready = |step_nm: f64, rule: Rule| -> Result<_> {
        let weights = camera.response.weights_on(&camera.sensor, &EXPOSURE, &grid(step_nm, rule))?;
        Ok(weights.camera(&scene.wavelength_nm).0)
    };
    let reference = ready(REFERENCE_STEP_NM, Rule::Simpson)?;
    let truth: Vec<[f64; 3]> = scene.spectra.iter().map(|spectrum| reference.electrons(spectrum)).collect();
    let mut settings = Vec::new();
    for (rule, (_, kind)) in RULES.iter().enumerate() {
        for step_nm in STEPS_NM {
            let with = ready(step_nm, *kind)?;
            let (mut errors, mut errors_e) = (Vec::new(), Vec::new());
            for (spectrum, truth) in scene.spectra.iter().zip(&truth) {
                let found = with.electrons(spectrum);
                let brightest = truth.iter().fold(0.0, |a: f64, b| a.max(*b));
                errors.push((0..3).map(|i| (found[i] / truth[i] - 1.0).abs()).fold(0.0, f64::max));
                errors_e.push((0..3).map(|i| (found[i] - truth[i]).abs()).fold(0.0, f64::max) * BRIGHT_E / brightest);
            }
            let (error, error_e) = (quantile(errors, 0.95), quantile(errors_e, 0.95));
            settings.push(Setting { rule, step_nm, error, error_e, time: 0.0 });
        }
    }
    let spectrum = &scene.spectra[0];
    let mut works: Vec<Work<'_>> = Vec::new();
    for setting in &settings {
        let (step_nm, rule) = (setting.step_nm, RULES[setting.rule].1);
        works.push(Box::new(move || {
            black_box(ready(step_nm, rule)?.electrons(black_box(spectrum)));
            Ok(())
        }));
    }
    let times = study.bench.medians(&mut works)?;
    for (setting, time) in settings.iter_mut().zip(times) {
        setting.time = time;
    }
    Ok(settings)
}

/// What ending the range at 800 nm leaves out of the worst class of the worst spectrum.
fn cut(camera: &Camera, scene: &Scene) -> Result<f64> {
    let to = |end_nm: f64| -> Result<_> {
        let grid = WavelengthGrid { start_nm: 360.0, end_nm, step_nm: 0.25, quadrature: Rule::Trapezoid };
        Ok(camera.response.weights_on(&camera.sensor, &EXPOSURE, &grid)?.camera(&scene.wavelength_nm).0)
    };
    let (short, long) = (to(800.0)?, to(830.0)?);
    let of_spectrum = |spectrum: &Vec<f64>| {
        let (short, long) = (short.electrons(spectrum), long.electrons(spectrum));
        (0..3).map(|i| (short[i] / long[i] - 1.0).abs()).fold(0.0, f64::max)
    };
    Ok(scene.spectra.iter().map(of_spectrum).fold(0.0, f64::max))
}

/// The widest step of a rule whose error is below a limit at it and at all finer ones.
fn widest(settings: &[Setting], rule: usize, limit: f64) -> Option<&Setting> {
    settings.iter().filter(|setting| setting.rule == rule).take_while(|setting| setting.error <= limit).last()
}

fn advice(all: &[Vec<Setting>]) -> String {
    let widths = |limit: f64| {
        let of_scene = |settings: &Vec<Setting>| {
            let best = (0..RULES.len())
                .filter_map(|rule| widest(settings, rule, limit))
                .max_by(|a, b| a.step_nm.total_cmp(&b.step_nm).then(b.error.total_cmp(&a.error)));
            best.map_or("no setting here".to_owned(), |s| {
                format!(
                    "{} nm with the {} rule ({})",
                    s.step_nm,
                    RULES[s.rule].0.to_lowercase().replace("simpson", "Simpson"),
                    percent(s.error)
                )
            })
        };
        all.iter().map(of_scene).collect::<Vec<_>>()
    };
    let (tenth, hundredth) = (widths(1e-3), widths(1e-4));
    format!(
        "For 0.1 % take {} for computed skies, {} for measured ones, and {} for lamps with lines; for 0.01 % {}, {}, and {}. \
         The default, 1 nm and rectangles, leaves {} of a computed sky.",
        tenth[0],
        tenth[1],
        tenth[2],
        hundredth[0],
        hundredth[1],
        hundredth[2],
        percent(all[0].iter().find(|s| s.rule == 0 && s.step_nm == 1.0).map_or(f64::NAN, |s| s.error)),
    )
}

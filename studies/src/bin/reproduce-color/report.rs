//! The page: docs/reproduction/color.md.

use crate::studio::{FILLING, PATCH, TRAINING};
use crate::{Case, Results};
use cyanometer::analysis::characterization::evaluation::{SampleEvaluation, noise_free, noisy};
use cyanometer::color::difference::{Difference, DifferenceReport, DifferenceSummary};
use cyanometer::error::{Error, Result};
use cyanometer::numerics::distribution::Distribution;
use cyanometer_studies::camera::EXPOSURE;
use cyanometer_studies::pages::{Table, number};
use std::fmt::Write;

/// A row of parts (a) of Tables 3 to 6: shares below 1/10, 1/4, 1/2 in percent, minimum, maximum, mean, median.
type Performance = [f64; 7];
/// A row of parts (b): minimum, maximum, mean, median.
type Spread = [f64; 4];

/// Tables 3 (JND) and 4 (ΔE94) of the paper, rows MaxIgnSPPLS, SkyRadLS, SkyRadSPPLS.
const PAPER_REGRESSIONS: [[(Performance, Spread); 3]; 2] = [
    [
        ([26.0, 57.8, 100.0, 0.008, 0.45, 0.200, 0.219], [0.13, 0.22, 0.17, 0.18]),
        ([81.5, 100.0, 100.0, 0.004, 0.24, 0.067, 0.063], [0.14, 0.23, 0.18, 0.18]),
        ([90.57, 99.34, 100.0, 0.003, 0.34, 0.057, 0.050], [0.13, 0.22, 0.17, 0.17]),
    ],
    [
        ([22.0, 45.3, 97.7, 0.006, 0.844, 0.268, 0.298], [0.18, 0.42, 0.26, 0.26]),
        ([65.2, 98.2, 100.0, 0.006, 0.36, 0.090, 0.080], [0.17, 0.39, 0.27, 0.28]),
        ([73.46, 99.01, 100.0, 0.003, 0.49, 0.079, 0.069], [0.15, 0.38, 0.26, 0.27]),
    ],
];

/// Tables 5 (JND) and 6 (ΔE94) of the paper, rows BI, SHTI, ECI.
const PAPER_METHODS: [[(Performance, Spread); 3]; 2] = [
    [
        ([90.67, 99.45, 100.0, 0.006, 0.33, 0.058, 0.051], [0.16, 0.25, 0.20, 0.20]),
        ([91.23, 99.45, 100.0, 0.004, 0.30, 0.058, 0.053], [0.12, 0.20, 0.15, 0.15]),
        ([90.57, 99.34, 100.0, 0.003, 0.34, 0.057, 0.050], [0.13, 0.22, 0.17, 0.17]),
    ],
    [
        ([75.90, 98.90, 100.0, 0.004, 0.48, 0.078, 0.068], [0.18, 0.55, 0.29, 0.28]),
        ([75.48, 99.01, 100.0, 0.006, 0.45, 0.079, 0.071], [0.16, 0.36, 0.22, 0.22]),
        ([73.46, 99.01, 100.0, 0.003, 0.49, 0.079, 0.069], [0.15, 0.38, 0.26, 0.27]),
    ],
];

/// What a case amounts to by one formula.
struct Found {
    /// Of the patch's mean color, as the paper's part (a).
    patch: DifferenceSummary,
    /// Without any noise.
    noise_free: DifferenceSummary,
    /// Standard deviation over the pixels, as the paper's part (b).
    spread: DifferenceSummary,
}

#[derive(Clone, Copy, PartialEq)]
enum Formula {
    Jnd,
    DeltaE94,
}

impl Formula {
    fn of(self, report: &DifferenceReport) -> DifferenceSummary {
        match self {
            Self::Jnd => report.jnd,
            Self::DeltaE94 => report.delta_e_94,
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Jnd => "JND",
            Self::DeltaE94 => "ΔE94",
        }
    }
}

fn missing() -> Error {
    Error::Data("an evaluation has no noise".into())
}

fn found(case: &Case, formula: Formula) -> Result<Found> {
    let with = |of: fn(&cyanometer::analysis::characterization::evaluation::SampleNoise) -> Difference| {
        noisy(&case.skies, of).map(|report| formula.of(&report)).ok_or_else(missing)
    };
    Ok(Found {
        patch: with(|noise| noise.patch_mean)?,
        noise_free: noise_free(&case.skies).map(|report| formula.of(&report)).ok_or_else(missing)?,
        spread: with(|noise| noise.pixel_std)?,
    })
}

fn performance(found: &DifferenceSummary) -> Performance {
    let summary = found.summary;
    [
        100.0 * found.below_tenth,
        100.0 * found.below_quarter,
        100.0 * found.below_half,
        summary.min,
        summary.max,
        summary.mean,
        summary.median,
    ]
}

fn spread(found: &DifferenceSummary) -> Spread {
    [found.summary.min, found.summary.max, found.summary.mean, found.summary.median]
}

fn cells(numbers: &[f64], decimals: impl Fn(usize) -> usize) -> Vec<String> {
    numbers.iter().enumerate().map(|(index, value)| number(*value, decimals(index))).collect()
}

/// The mean distance of pixels from the color without noise: simulated and predicted, JND, over the skies.
fn noise_of(case: &Case) -> Result<[Distribution; 2]> {
    let all: Vec<[f64; 2]> = case
        .skies
        .iter()
        .map(|sky| {
            let noise = sky.noise?;
            Some([noise.noise_delta_e, noise.predicted?.delta_e].map(|delta_e| delta_e / 2.3))
        })
        .collect::<Option<_>>()
        .ok_or_else(missing)?;
    Ok([0, 1].map(|which| Distribution::of(all.iter().map(|pair| pair[which]))))
}

fn mean(distribution: &Distribution) -> Result<f64> {
    distribution.summary().map(|summary| summary.mean).ok_or_else(missing)
}

/// A table of the paper beside ours, both parts.
fn tables(
    out: &mut String,
    numbers: [usize; 2],
    formula: Formula,
    cases: &[Case],
    paper: &[(Performance, Spread)],
) -> Result<()> {
    let unit = formula.unit();
    let _ = writeln!(out, "### Table {} ({unit})\n", numbers[usize::from(formula == Formula::DeltaE94)]);
    let _ =
        writeln!(out, "(a) Difference between the mean color of {}×{} pixels and the true one.\n", PATCH[0], PATCH[1]);
    let mut part_a = Table::new(&["", "", "<1/10, %", "<1/4, %", "<1/2, %", "min", "max", "mean", "median"]);
    let mut part_b = Table::new(&["", "", "min", "max", "mean", "median"]);
    for (index, case) in cases.iter().enumerate() {
        let ours = found(case, formula)?;
        let a = |of: &DifferenceSummary| cells(&performance(of), |column| if column < 3 { 1 } else { 3 });
        let row = |name: &str, who: &str, cells: Vec<String>| [vec![name.to_owned(), who.to_owned()], cells].concat();
        if let Some((performance, spread)) = paper.get(index) {
            part_a.row(&row(case.name, "paper", cells(performance, |column| if column < 3 { 1 } else { 3 })));
            part_b.row(&row(case.name, "paper", cells(spread, |_| 2)));
        }
        let name = if index < paper.len() { "" } else { case.name };
        part_a.row(&row(name, "ours", a(&ours.patch)));
        part_a.row(&row("", "ours, no noise", a(&ours.noise_free)));
        part_b.row(&row(name, "ours", cells(&spread(&ours.spread), |_| 2)));
    }
    out.push_str(&part_a.text);
    out.push_str("\n(b) Standard deviation of the difference over the pixels.\n\n");
    out.push_str(&part_b.text);
    out.push('\n');
    Ok(())
}

fn verdict(holds: bool) -> String {
    (if holds { "**holds**" } else { "**does not hold here**" }).into()
}

/// Luminance over that of the white, over the skies.
fn lightness(skies: &[SampleEvaluation]) -> Distribution {
    Distribution::of(skies.iter().map(|sky| sky.xyz[1] / sky.white[1]))
}

#[allow(clippy::too_many_lines, reason = "a page, written from top to bottom")]
pub fn markdown(results: &Results) -> Result<String> {
    let mut out = String::new();
    let studio = &results.studio;
    let light = lightness(&results.regressions[2].skies).summary().ok_or_else(missing)?;
    let _ = writeln!(
        out,
        "# The color figures and tables of the paper, beside ours\n\n\
         Made by `scripts/reproduce color`; every number of ours is computed there, from fixed seeds. “The paper” is\n\
         [HP2005](../references.md), Sec. 4.1.\n\n\
         Set-up, as the paper has it: each sky exposed so that its brightest class is at {FILLING} of full well, 33 ms ({} s; the\n\
         aperture is chosen), {}×{} pixels (columns × rows), no vignetting, one dark frame subtracted, ECI for the regressions,\n\
         SkyRadSPPLS for the demosaicking methods; {TRAINING} training skies.\n",
        EXPOSURE.exposure_s, PATCH[0], PATCH[1]
    );
    out.push_str("## What can agree and what cannot\n\n");
    let _ = writeln!(
        out,
        "- **The skies** are not the paper's: LOWTRAN7 instead of MODTRAN, the same atmosphere, aerosols and number. The\n  \
         **quantum efficiency** is an estimate. So errors of the matrices, which come from the fine differences of curves, can\n  \
         agree in kind and in order, not in digits.\n\
         - **Training skies.** The paper does not say which {TRAINING}. Ours are chosen by k-medoids (BUILD) on spectra of unit\n  \
         length: numbers {}. Errors count relative to the luminance of\n  \
         each sky, for the paper's signals are all at {FILLING} of full well. How much this matters is shown below.\n\
         - **The sky kept exact** is “average” in the paper. Ours is number {} ({}), whose chromaticity is nearest to the mean of\n  \
         all.\n\
         - **The white.** L\\*a\\*b\\* needs one, and the paper names none. Ours has the chromaticity of D65, for that is the white of\n  \
         displays and of daylight, and the luminance at which the camera saturates at the exposure of each sky, for that is what\n  \
         a picture of it would show as white (by one matrix, that of the sensor's file, for all). Skies then have Y/Yₙ from {} to {}, mean {}. Away from black, L\\*a\\*b\\* differences go\n  \
         with Yₙ to the power −1/3, exactly: a white 8 times as bright halves every JND below.",
        studio.training.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        studio.kept,
        studio.aerosol(studio.kept),
        number(light.min, 2),
        number(light.max, 2),
        number(light.mean, 2),
    );
    let jnd: Vec<Found> = results.regressions.iter().map(|case| found(case, Formula::Jnd)).collect::<Result<_>>()?;
    let by_method: Vec<Found> = results.methods.iter().map(|case| found(case, Formula::Jnd)).collect::<Result<_>>()?;
    let ratio = |ours: &Found, paper: &(Performance, Spread)| ours.spread.summary.mean / paper.1[2];
    let ratios: Vec<f64> = by_method.iter().zip(&PAPER_METHODS[0]).map(|(ours, paper)| ratio(ours, paper)).collect();
    let factor = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let _ = writeln!(
        out,
        "- **Noise** in JND depends on that white, and on where the blue of the sky puts the other two classes. Ours is {} (BI), {}\n  \
         (SHTI), {} (ECI) times the paper's. One white {} times as bright as ours would bring all three within {} % of the paper,\n  \
         and the mean error without noise of SkyRadLS from {} to {} JND (paper: 0.067). It may be the paper's.\n",
        number(ratios[0], 2),
        number(ratios[1], 2),
        number(ratios[2], 2),
        number(factor.powi(3), 1),
        number(100.0 * ratios.iter().map(|r| (r / factor - 1.0).abs()).fold(0.0, f64::max), 0),
        number(jnd[1].noise_free.summary.mean, 3),
        number(jnd[1].noise_free.summary.mean / factor, 3),
    );

    out.push_str("## Which conclusions hold\n\n");
    let mut table = Table::new(&["the paper says", "we find", "verdict"]);
    let m = |found: &Found| found.patch.summary.mean;
    let clean = |found: &Found| found.noise_free.summary.mean;
    table.row(&[
        "SkyRadLS and SkyRadSPPLS are significantly better than MaxIgnSPPLS (means 0.067, 0.057 and 0.200 JND)".into(),
        format!("means {}, {} and {} JND", number(m(&jnd[1]), 3), number(m(&jnd[2]), 3), number(m(&jnd[0]), 3)),
        verdict(m(&jnd[1]) < 0.5 * m(&jnd[0]) && m(&jnd[2]) < 0.5 * m(&jnd[0])),
    ]);
    table.row(&[
        "SkyRadSPPLS is the better of the two, on average".into(),
        format!(
            "without noise {} against {} JND: what a constraint keeps exact, the other skies pay for; on the measured skies \
             {} against {}",
            number(clean(&jnd[2]), 3),
            number(clean(&jnd[1]), 3),
            number(results.measured[2].1.jnd.summary.mean, 3),
            number(results.measured[1].1.jnd.summary.mean, 3),
        ),
        verdict(clean(&jnd[2]) < clean(&jnd[1])),
    ]);
    table.row(&[
        "for both, mean and median are below 0.1 JND".into(),
        format!(
            "mean {} and {}, median {} and {} (without noise {}, {}, {}, {})",
            number(m(&jnd[1]), 3),
            number(m(&jnd[2]), 3),
            number(jnd[1].patch.summary.median, 3),
            number(jnd[2].patch.summary.median, 3),
            number(clean(&jnd[1]), 3),
            number(clean(&jnd[2]), 3),
            number(jnd[1].noise_free.summary.median, 3),
            number(jnd[2].noise_free.summary.median, 3),
        ),
        match (
            [&jnd[1], &jnd[2]].map(|f| m(f).max(f.patch.summary.median) < 0.1),
            [&jnd[1], &jnd[2]].map(|f| clean(f) < 0.1),
        ) {
            ([true, true], _) => verdict(true),
            ([true, false], [true, true]) => {
                "**holds** for SkyRadLS; for SkyRadSPPLS only without noise, which the paper's numbers include".into()
            }
            _ => verdict(false),
        },
    ]);
    let largest = [1, 2, 0].map(|case: usize| jnd[case].patch.summary.max);
    table.row(&[
        "all skies are below 0.5 JND".into(),
        format!(
            "up to {} (SkyRadLS), {} (SkyRadSPPLS), {} (MaxIgnSPPLS) JND",
            number(largest[0], 2),
            number(largest[1], 2),
            number(largest[2], 2)
        ),
        match largest.map(|max| max < 0.5) {
            [true, true, true] => verdict(true),
            [true, ..] => "**holds** for SkyRadLS alone".into(),
            _ => verdict(false),
        },
    ]);
    let means: Vec<f64> = by_method.iter().map(m).collect();
    let apart = means[..3].iter().copied().fold(0.0, f64::max) - means[..3].iter().copied().fold(1.0, f64::min);
    table.row(&[
        "the demosaicking methods are equally good in color (0.057 to 0.058 JND)".into(),
        format!("{} (BI), {} (SHTI), {} (ECI) JND", number(means[0], 3), number(means[1], 3), number(means[2], 3)),
        verdict(apart < 0.01),
    ]);
    let noise: Vec<f64> = by_method.iter().map(|found| found.spread.summary.mean).collect();
    let distances: Vec<f64> = results.methods.iter().map(|case| mean(&noise_of(case)?[0])).collect::<Result<_>>()?;
    table.row(&[
        "SHTI has the least noise, then ECI, then BI (0.15, 0.17, 0.20 JND)".into(),
        format!(
            "{} (SHTI), {} (ECI), {} (BI) JND; the mean distance from the color without noise, rather than the spread of the \
             distance: {}, {}, {}",
            number(noise[1], 3),
            number(noise[2], 3),
            number(noise[0], 3),
            number(distances[1], 3),
            number(distances[2], 3),
            number(distances[0], 3),
        ),
        if noise[1] < noise[2] && distances[1] < distances[2] && (noise[2] / noise[0] - 1.0).abs() < 0.02 {
            "SHTI first: **holds**; ECI and BI are a **tie** in spread, ECI before BI in distance".into()
        } else {
            verdict(noise[1] < noise[2] && noise[2] < noise[0])
        },
    ]);
    let ninety_four =
        |index: usize| -> Result<f64> { Ok(found(&results.methods[index], Formula::DeltaE94)?.spread.summary.mean) };
    let (bi, shti, eci) = (ninety_four(0)?, ninety_four(1)?, ninety_four(2)?);
    let increase = |of: f64| number(100.0 * (of / shti - 1.0), 0);
    table.row(&[
        "ECI and BI add 13 and 26 % to SHTI's noise in ΔE94 (its Table 6 has 18 and 32 %)".into(),
        format!("{} and {} %", increase(eci), increase(bi)),
        if shti < eci && eci < bi {
            verdict(true)
        } else {
            "SHTI is the quietest; **ECI before BI does not hold here** in ΔE94".into()
        },
    ]);
    let single = noisy(&results.regressions[2].skies, |noise| noise.pixel_max).ok_or_else(missing)?;
    table.row(&[
        "a single pixel is off by up to 1.8 JND".into(),
        format!("up to {} JND, by another white", number(single.jnd.summary.max, 2)),
        "**alike**".into(),
    ]);
    out.push_str(&table.text);

    out.push_str("\n## Tables 3 and 4: the regressions\n\n");
    tables(&mut out, [3, 4], Formula::Jnd, &results.regressions, &PAPER_REGRESSIONS[0])?;
    tables(&mut out, [3, 4], Formula::DeltaE94, &results.regressions, &PAPER_REGRESSIONS[1])?;
    let _ = writeln!(
        out,
        "Part (a) of the paper holds noise: the mean of {} pixels is itself uncertain, so no sky comes out at 0 although one is\n\
         kept exact. The rows “no noise” show the matrix alone.\n",
        PATCH[0] * PATCH[1]
    );
    out.push_str("## Tables 5 and 6: the demosaicking methods\n\n");
    tables(&mut out, [5, 6], Formula::Jnd, &results.methods, &PAPER_METHODS[0])?;
    tables(&mut out, [5, 6], Formula::DeltaE94, &results.methods, &PAPER_METHODS[1])?;

    out.push_str(
        "## Fig. 3\n\n![Fig. 3](fig3.svg)\n\nLeft: the 912 skies, with the errors of SkyRadSPPLS five times as long as they are, and the sky \
         that is kept exact. Right: circles whose diameters go with ΔE94. The paper's locus of Granada skies could not be had as \
         an equation; drawn instead are the CIE daylight locus and a fit to the measured skies of \
         [Kider2014](../references.md) (y = −4.9088 x² + 3.8004 x − 0.3836, rms 0.0033).\n\n",
    );
    noise_section(results, &mut out)?;
    choices_section(results, &mut out);
    skies_section(results, &mut out);
    trade_off_section(results, &mut out);
    Ok(out)
}

fn noise_section(results: &Results, out: &mut String) -> Result<()> {
    out.push_str(
        "## Fig. 8, and the noise of every sky predicted\n\n![Fig. 8](fig8.svg)\n\nObserved is the spread of one patch, X, Y and Z each by itself; \
         predicted are the exact moments, not the paper's mean coefficients. The scatter about the line is the sampling error of \
         so few pixels. In L\\*a\\*b\\*, the mean distance of pixels from the color without noise, JND, over the 912 skies:\n\n",
    );
    let mut table = Table::new(&["", "simulated, mean", "predicted, mean", "ratio", "its standard error", "z"]);
    for case in results.methods.iter().chain(&results.regressions[..2]) {
        let [simulated, predicted] = noise_of(case)?;
        let ratios: Vec<f64> = case
            .skies
            .iter()
            .filter_map(|sky| sky.noise.and_then(|noise| Some(noise.noise_delta_e / noise.predicted?.delta_e)))
            .collect();
        let count = ratios.len() as f64;
        let ratio = ratios.iter().sum::<f64>() / count;
        let variance = ratios.iter().map(|r| (r - ratio).powi(2)).sum::<f64>() / (count - 1.0);
        let error = (variance / count).sqrt();
        table.row(&[
            case.name.to_owned(),
            number(mean(&simulated)?, 4),
            number(mean(&predicted)?, 4),
            number(ratio, 4),
            number(error, 4),
            number((ratio - 1.0) / error, 1),
        ]);
    }
    out.push_str(&table.text);
    out.push('\n');
    Ok(())
}

fn choices_section(results: &Results, out: &mut String) {
    out.push_str(
        "## How many training skies, and how they count\n\nThe verdicts above depend on this choice: with equal weights and 20 skies or more SkyRadSPPLS is above 0.1 JND on average. Chosen by k-medoids (BUILD); errors in cd m⁻² (equal) or relative to \
         luminance; without noise, JND over all 912 skies. The paper found 20 to be enough, and more to be of little use.\n\n",
    );
    let mut table = Table::new(&["skies", "weights", "SkyRadLS mean", "p95", "max", "SkyRadSPPLS mean", "p95", "max"]);
    for choice in &results.choices {
        let of = |report: &DifferenceReport| {
            let summary = report.jnd.summary;
            cells(&[summary.mean, summary.p95, summary.max], |_| 3)
        };
        let [plain, kept] = &choice.reports;
        table.row(&[vec![choice.training.clone(), choice.weights.into()], of(plain), of(kept)].concat());
    }
    out.push_str(&table.text);
    out.push('\n');
}

fn skies_section(results: &Results, out: &mut String) {
    out.push_str(
        "## Skies never trained on\n\nEach aerosol in turn is left out of the candidates for the 20 training skies; without noise, \
         JND over the skies of that aerosol. (With SkyRadSPPLS the sky kept exact stays, whatever its aerosol.)\n\n",
    );
    let mut table = Table::new(&[
        "aerosol",
        "skies",
        "SkyRadLS, among the candidates: mean",
        "max",
        "left out: mean",
        "max",
        "SkyRadSPPLS, among the candidates: mean",
        "max",
        "left out: mean",
        "max",
    ]);
    for held in &results.held_out {
        let of = |report: &DifferenceReport| cells(&[report.jnd.summary.mean, report.jnd.summary.max], |_| 3);
        let [with, without] = [&held.with, &held.without];
        let numbers = [of(&with[0]), of(&without[0]), of(&with[1]), of(&without[1])].concat();
        table.row(&[vec![held.aerosol.clone(), held.count.to_string()], numbers].concat());
    }
    out.push_str(&table.text);
    out.push_str(
        "\nThe 1600 measured skies of [Kider2014](../references.md), by matrices fitted to computed skies alone, and by one fitted \
         to themselves; without noise, JND:\n\n",
    );
    let mut table = Table::new(&["matrix", "mean", "median", "p95", "max", "<1/10, %", "<1/2, %"]);
    let own = [("SkyRadLS on all the measured skies", results.measured_own)];
    for (name, report) in results.measured.iter().chain(&own) {
        let jnd = report.jnd;
        let summary = jnd.summary;
        let numbers = cells(&[summary.mean, summary.median, summary.p95, summary.max], |_| 3);
        let shares = cells(&[100.0 * jnd.below_tenth, 100.0 * jnd.below_half], |_| 1);
        table.row(&[vec![(*name).to_owned()], numbers, shares].concat());
    }
    out.push_str(&table.text);
    out.push('\n');
}

fn trade_off_section(results: &Results, out: &mut String) {
    out.push_str(
        "## Errors of color against noise\n\n![trade-off](trade-off.svg)\n\nBeyond the paper: the matrix that makes the expected \
         square of ΔE\\*ab least, error of the matrix and noise of a pixel together, for the noise weight 1; for the mean of n \
         independent pixels the weight is 1/n (`fit-matrix --noise-weight`). SkyRadLS on the training skies, ECI, rms ΔE\\*ab to \
         first order:\n\n",
    );
    let mut table = Table::new(&["noise weight", "error of the matrix", "noise of a pixel", "together, single pixels"]);
    // Weight 0, then every power of ten.
    for point in results.trade_off.iter().take(1).chain(results.trade_off.iter().skip(1).step_by(4)) {
        let together = point.model_delta_e.hypot(point.noise_delta_e);
        let weight = format!("{}", point.noise_weight);
        table.row(&[vec![weight], cells(&[point.model_delta_e, point.noise_delta_e, together], |_| 3)].concat());
    }
    out.push_str(&table.text);
}

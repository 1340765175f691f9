//! The page: docs/reproduction/noise.md.

use crate::agreement::{Agreement, Row, UNCLIPPED_E};
use crate::camera::{LARGE, METHODS, SMALL};
use crate::correlation::{NAMES, READINGS, list};
use crate::figures::{HUE_FRAMES, HueLevel, exact_snr_db, level_with_noise};
use crate::limits::{EDGE_FRAMES, FRAMES, LEVELS, Limit, SIZE};
use crate::prediction::{Sites, effective_share, weights};
use crate::sweep::TOP_E;
use crate::{Results, SKY};
use cyanometer::error::{Error, Result};
use cyanometer::propagation::Equations;
use cyanometer::propagation::paper::Coefficients;
use cyanometer::propagation::smooth_hue::FirstOrder;
use cyanometer::stages::demosaic::Method;
use cyanometer_studies::camera::EXPOSURE;
use cyanometer_studies::pages::{Table, number};
use std::fmt::Write;

/// The maximum signal-to-noise ratios of the paper's X, Y, Z with BI, SHTI, ECI, in dB [HP2005, Secs. 4.2.1–4.2.3].
const PAPER_SNR_DB: [[f64; 3]; 3] = [[44.2, 43.3, 40.5], [42.0, 43.4, 39.5], [41.7, 42.2, 40.6]];

/// A whole number in groups of three.
fn grouped(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) && digits.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// Two digits and a power of ten for what is large.
fn count(value: f64) -> String {
    if value < 1e5 {
        return grouped(if value < 100.0 { value } else { (value / 10.0).round() * 10.0 });
    }
    let power = value.log10().floor();
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised: String =
        format!("{power:.0}").chars().filter_map(|c| c.to_digit(10)).map(|d| RAISED[d as usize]).collect();
    format!("{:.1}·10{raised}", value / 10.0_f64.powf(power))
}

fn percent(value: f64) -> String {
    let decimals = match value.abs() * 100.0 {
        large if large >= 1.0 => 1,
        small if small >= 0.01 => 2,
        _ => 3,
    };
    if value.abs() < 5e-6 { "0".into() } else { format!("{} %", number(100.0 * value, decimals)) }
}

/// The three statistics; the residual as predicted minus observed.
fn agreement(a: Agreement) -> String {
    format!("{} · {} · {}", number(-a.residual, 3), number(a.slope, 2), number(a.correlation, 3))
}

fn printed(numbers: Option<[f64; 3]>) -> String {
    numbers.map_or("–".into(), |[residual, slope, correlation]| {
        format!("{} · {} · {}", number(residual, 3), number(slope, 2), number(correlation, 2))
    })
}

fn size([width, height]: [usize; 2]) -> String {
    format!("{width}×{height}")
}

fn find<'a>(results: &'a Results, what: &str, channel: &str) -> Result<&'a Row> {
    let found = results.rows.iter().find(|row| row.what.starts_with(what) && row.channel == channel);
    found.ok_or_else(|| Error::Data(format!("Table 7 has no row {what} {channel}")))
}

fn limit<'a>(results: &'a Results, name: &str, channel: &str) -> Result<&'a Limit> {
    let found = results.limits.iter().find(|limit| limit.name.starts_with(name) && limit.channel == channel);
    found.ok_or_else(|| Error::Data(format!("there is no approximation {name} {channel}")))
}

/// The relative error of an approximation at the level of this number.
fn error(limit: &Limit, level: usize) -> f64 {
    limit.errors[level].map_or(f64::NAN, |(error, _)| error)
}

fn at_blue(results: &Results, blue: f64) -> Result<&HueLevel> {
    let found = results.hues.iter().find(|level| level.blue == blue);
    found.ok_or_else(|| Error::Data(format!("Fig. 6 has no level {blue}")))
}

/// How the paper's claim fares.
fn verdict(is_so: bool, yes: &'static str, no: &'static str) -> String {
    format!("**{}**", if is_so { yes } else { no })
}

/// The sampling error of a standard deviation of red after ECI in one small frame, relative.
fn sampling_error(results: &Results) -> f64 {
    let sites = Sites::of(&results.camera, [10_000.0; 3], Equations::Exact);
    let share = effective_share(&weights(Method::EffectiveColor, &sites), sites.variance)[0];
    1.0 / (2.0 * share * (SMALL[0] * SMALL[1]) as f64).sqrt()
}

/// The charge above which a sample is left at the top code, e⁻.
fn highest_charge(results: &Results) -> f64 {
    let adc = &results.camera.adc;
    (f64::from(adc.top_code()) + 0.5 - adc.bias_adu) / adc.adu_per_e
}

/// The lowest level, e⁻ in each class, at which ratios have a first order.
fn lowest_for_ratios(results: &Results) -> f64 {
    let holds = |e: f64| {
        let sites = Sites::of(&results.camera, [e; 3], Equations::Exact);
        FirstOrder::of(sites.mean, sites.variance).holds
    };
    (1..1000).map(f64::from).find(|&e| holds(e)).unwrap_or(f64::NAN)
}

/// The whole page.
pub fn markdown(results: &Results) -> Result<String> {
    let mut page = String::new();
    // Writing to a string does not fail.
    let mut say = |text: String| {
        page.push_str(&text);
        page.push('\n');
    };
    say(head());
    say(verdicts(results)?);
    say(figures(results)?);
    say(table_7(results)?);
    say(table_8(results));
    say(limits(results)?);
    Ok(format!("{}\n", page.trim_end()))
}

fn head() -> String {
    format!(
        "# The noise figures and tables of the paper, beside ours

Made by `scripts/reproduce noise`; every number of ours is computed there, from fixed seeds. “The paper” is
[HP2005](../references.md); its equations are used with their misprints mended ([corrections](../corrections.md)) except
where “as printed” is said. *Exact* are the moments that follow from the definitions ([model](../model.md)).

Set-up, as in Sec. 4.2: the same signal in the three classes, raised to full well; noise, converter, Bayer array,
demosaicking, black level (bias and mean dark signal) removed, XYZ. Frames are {small} (columns × rows; the paper's 30 × 40) and {large}.
XYZ are absolute, in cd m⁻², at {exposure} ms and f/{stop}. What cannot be the paper's: its quantum efficiencies are not public (ours are
estimates), and its matrix, SkyRadSPPLS, is not printed. Ours is SkyRadLS fitted to the 912 skies of the library. This
moves the levels of XYZ noise and the SNR of X, Y and Z; it moves no result before XYZ.
",
        small = size(SMALL),
        large = size(LARGE),
        exposure = number(1e3 * EXPOSURE.exposure_s, 0),
        stop = number(EXPOSURE.f_number, 0),
    )
}

fn verdicts(results: &Results) -> Result<String> {
    let mut table = Table::new(&["the paper says", "we find", "verdict"]);
    let mut row = |says: &str, find: String, verdict: String| table.row(&[says.into(), find, verdict]);
    let slope = |what: &str, channel: &str| find(results, what, channel).map(|row| row.paper_below[1].slope);
    let cross = limit(results, "Eq. 11", "electrons")?;
    let nil = limit(results, "the converter", "ADU")?;
    row(
        "Eq. 11 and a converter without noise describe the photon transfer curve",
        format!(
            "standard deviation off by {} in the dark and {} at 1000 e⁻, nearly all of it the converter's; and the noise \
             collapses near full well, where the converter clips above {} e⁻ of charge and Eq. 11 does not know it",
            percent((1.0 + error(cross, 0)) * (1.0 + error(nil, 0)) - 1.0),
            percent((1.0 + error(cross, 1)) * (1.0 + error(nil, 1)) - 1.0),
            grouped(highest_charge(results)),
        ),
        verdict(error(nil, 1).abs() < 0.01, "holds below clipping", "fails"),
    );
    let printed = limit(results, "BI: 0.53", "R, B")?;
    row(
        "Eqs. 14 and 39 describe BI",
        format!(
            "green exactly; red and blue exactly with 9/16 (mean of 1/m), {} with the printed 0.53",
            percent(error(printed, 2))
        ),
        verdict(find(results, "BI, (11) and (14)", "R-B")?.exact[1].correlation > 0.99, "holds, mended", "fails"),
    );
    let eq15 = limit(results, "SHTI: all", "R, B")?;
    let eq48 = limit(results, "SHTI: green", "R, B")?;
    row(
        "Eqs. 15 and 48 give slopes of 1.15 and 0.78 for SHTI",
        format!(
            "slopes of {} and {}; the equations are off by {} and {}",
            number(slope("SHTI, (11) and (15)", "R-B")?, 2),
            number(slope("SHTI, (11) and (48)", "R-B")?, 2),
            percent(error(eq15, 2)),
            percent(error(eq48, 2)),
        ),
        verdict(
            (slope("SHTI, (11) and (15)", "R-B")? - 1.15).abs() < 0.02
                && (slope("SHTI, (11) and (48)", "R-B")? - 0.78).abs() < 0.02,
            "reproduced",
            "not reproduced",
        ),
    );
    let eci = limit(results, "ECI: Eq. 17", "R, B")?;
    row(
        "Eqs. 16, 17 with Table 8 give slopes of 0.98 (R, B) and 1.03 (G) for ECI",
        format!(
            "slopes of {} and {}; the equations are off by {} and {}",
            number(slope("ECI,", "R-B")?, 2),
            number(slope("ECI,", "G")?, 2),
            percent(error(eci, 2)),
            percent(error(limit(results, "ECI: Eq. 16", "G")?, 2)),
        ),
        verdict((slope("ECI,", "R-B")? - 0.98).abs() < 0.01, "reproduced", "not reproduced"),
    );
    let table8 = list(&Coefficients::EQUAL_SIGNAL);
    let other = (0..11).filter(|index| !matches!(index, 3 | 6));
    let largest = other.map(|i| (results.correlations.equal_measured[0][i] - table8[i]).abs()).fold(0.0, f64::max);
    row(
        "Table 8, equal signals",
        format!(
            "in frames of its size all within {} except r′₂: {} where the paper has {}",
            number(largest, 2),
            number(results.correlations.equal_measured[0][3], 2),
            number(table8[3], 2)
        ),
        verdict(largest < 0.05, "reproduced but for r′₂", "not reproduced"),
    );
    let one = at_blue(results, 1000.0)?;
    let (kept, removed) =
        (level_with_noise(&results.camera, one.biased), level_with_noise(&results.camera, one.median));
    row(
        "with B = 20 G, SHTI turns the noise of 1000 e⁻ into that of 10 000 e⁻ (Fig. 6)",
        format!(
            "that of {} e⁻ if only the bias is taken off before the ratios, as the paper seems to have done; that of {} e⁻ if \
             the dark signal is taken off too",
            grouped((kept / 100.0).round() * 100.0),
            grouped((removed / 1000.0).round() * 1000.0),
        ),
        verdict((kept / 10_000.0 - 1.0).abs() < 0.1, "reproduced, and worse than said", "not reproduced"),
    );
    let differences: Vec<f64> = (0..3)
        .flat_map(|method| {
            let ours = exact_snr_db(&results.camera, METHODS[method], UNCLIPPED_E);
            (0..3).map(move |i| ours[i] - PAPER_SNR_DB[method][i])
        })
        .collect();
    let (least, most) =
        (differences.iter().copied().fold(f64::MAX, f64::min), differences.iter().copied().fold(f64::MIN, f64::max));
    row(
        "maximum SNR of X, Y, Z: 39.5 to 44.2 dB",
        format!(
            "{} to {} dB from the paper's, another matrix; far higher where clipped, which is no signal",
            number(least, 1),
            number(most, 1)
        ),
        verdict(least.abs().max(most.abs()) < 2.5, "alike", "different"),
    );
    let patches = [("BI", "R, B"), ("ECI", "R, B"), ("ECI", "G")].map(|(method, channel)| {
        let name = format!("error bar of the mean of 30×40 as σ/√n, {method}");
        limit(results, &name, channel).map(|limit| 1.0 / (1.0 + error(limit, 2)))
    });
    let [bi, eci, green] = patches;
    row(
        "the mean of a patch suppresses noise (no law given; σ/√n is what one would write)",
        format!(
            "demosaicked neighbors are correlated: the mean of 1200 pixels is {} times less sure for red and blue after \
             BI, {} after ECI, {} for green after ECI",
            number(bi?, 1),
            number(eci?, 1),
            number(green?, 1)
        ),
        verdict(true, "σ/√n fails", ""),
    );
    Ok(format!("## In one table\n\n{}", table.text))
}

fn figures(results: &Results) -> Result<String> {
    let mut text = String::new();
    let mut figure = |number: u32, says: String| {
        let _ = writeln!(text, "## Fig. {number}\n\n![Fig. {number}](fig{number}.svg)\n\n{says}\n");
    };
    figure(
        4,
        format!(
            "Lines are exact, dashes Eqs. 11, 14 (mended) and 19, points simulated. They agree within the sampling error of the \
             {} frames; in the lowest panel, against large frames, the paper's curve falls short \
             at low signals by the rounding that it takes as nil. At 40 000 e⁻ most samples stand at the top code: the \
             noise is cut off, not gone.",
            size(SMALL)
        ),
    );
    let eq15 = limit(results, "SHTI: all", "R, B")?;
    figure(
        5,
        format!(
            "Dashes are Eqs. 11, 15, 19; gray ones Eq. 48 for Eq. 15. Eq. 15 takes values as independent that share the \
             same green: its red and blue are {} too noisy. X, Y and Z come out on either side of the simulation because \
             Eq. 19 leaves out the covariances that SHTI makes, which the matrix weighs with either sign. Below {void} e⁻ \
             green is within 10 σ of zero, and ratios have no first order.",
            percent(error(eq15, 2)),
            void = number(lowest_for_ratios(results), 0),
        ),
    );
    let (one, ten) = (at_blue(results, 1000.0)?, at_blue(results, 10_000.0)?);
    let normal = |std: f64| grouped((level_with_noise(&results.camera, std) / 100.0).round() * 100.0);
    figure(
        6,
        format!(
            "B = 20 G. At 1000 e⁻ the noise of B is {before} e⁻ as measured. After SHTI it is {biased} e⁻ (exact to first \
             order: {exact_biased}, Eq. 15: {paper_biased}) if the {dark} e⁻ of dark signal stay in the samples whose ratios \
             are taken: what is normal at {level} e⁻, and the paper says 10 000. So its simulation seems to have taken the \
             bias off and left the dark signal in. Taken off too, green is only {z} standard \
             deviations above zero at 1000 e⁻, the first order is void, and the noise is {median} e⁻ (median of {frames} \
             frames; single frames scatter, for the variance of a ratio of such values does not exist). At 10 000 e⁻ it is \
             {median10} e⁻; exact to first order {exact10}, Eq. 15 {paper10}.",
            before = number(one.before, 0),
            biased = number(one.biased, 0),
            exact_biased = number(one.exact_biased, 0),
            paper_biased = number(one.paper_biased, 0),
            dark = number(results.camera.model.dark_e, 0),
            level = normal(one.biased),
            z = number(one.green_over_noise, 1),
            median = number(one.median, 0),
            frames = HUE_FRAMES,
            median10 = number(ten.median, 0),
            exact10 = number(ten.exact, 0),
            paper10 = number(ten.paper, 0),
        ),
    );
    figure(
        7,
        format!(
            "Dashes are Eqs. 11, 16, 17 and 20 with Table 8 for equal signals: {} low in red and blue, beside the rounding's {} in \
             the dark, because the coefficients that the equations need are not the correlations that they are named after \
             (Table 8, last column). One frame of the paper's size, with a sampling error of {}, cannot show it.",
            percent(error(limit(results, "ECI: Eq. 17", "R, B")?, 2).abs()),
            percent(error(limit(results, "the converter", "ADU")?, 0).abs()),
            percent(sampling_error(results)),
        ),
    );
    let mut table = Table::new(&[
        "method",
        "",
        "paper, maximum",
        &format!("exact at {} e⁻, unclipped", grouped(UNCLIPPED_E)),
        "simulated there",
        &format!("simulated at {} e⁻, clipped", grouped(TOP_E)),
        "exact at 40 000 e⁻, clipped",
    ]);
    let nearest = |electrons: f64| {
        let far = |level: &&crate::sweep::Level| (level.electrons - electrons).abs();
        results.levels.iter().min_by(|a, b| far(a).total_cmp(&far(b)))
    };
    for (index, method) in METHODS.into_iter().enumerate() {
        let (unclipped, full) =
            (exact_snr_db(&results.camera, method, UNCLIPPED_E), exact_snr_db(&results.camera, method, 40_000.0));
        for (channel, name) in ["X", "Y", "Z"].into_iter().enumerate() {
            let simulated = |e: f64| nearest(e).map_or(f64::NAN, |level| level.large.snr_db[index][channel]);
            table.row(&[
                if channel == 0 { method.names()[0].to_uppercase() } else { String::new() },
                name.into(),
                number(PAPER_SNR_DB[index][channel], 1),
                number(unclipped[channel], 1),
                number(simulated(UNCLIPPED_E), 1),
                number(simulated(TOP_E), 1),
                number(full[channel], 1),
            ]);
        }
    }
    let site = {
        let sites = Sites::of(&results.camera, [UNCLIPPED_E; 3], Equations::Exact);
        20.0 * (sites.mean[0] / sites.variance[0].sqrt()).log10()
    };
    let _ = writeln!(
        text,
        "## Maximum SNR, dB\n\n{}\nThe paper's 46 dB of the sensor are shot noise alone, 20 log₁₀ √40 000 = {} dB; with PRNU a \
         photosite has {} dB at {} e⁻. Demosaicking and the matrix average and weigh: what comes out of X, Y and Z hangs on \
         the matrix's columns, hence the differences. Where the converter clips, SNR rises without limit and says nothing: \
         the top {} e⁻ of charge are lost, and at 40 000 e⁻ most samples are one code.",
        table.text,
        number(20.0 * 40_000.0_f64.sqrt().log10(), 1),
        number(site, 1),
        grouped(UNCLIPPED_E),
        number(40_000.0 - highest_charge(results), 0),
    );
    Ok(text)
}

fn table_7(results: &Results) -> Result<String> {
    let mut table = Table::new(&[
        "stage and equations",
        "",
        "paper",
        &format!("to {} e⁻, {}", grouped(TOP_E), size(SMALL)),
        &format!("to {} e⁻, {}", grouped(TOP_E), size(LARGE)),
        &format!("unclipped, {}", size(SMALL)),
        &format!("unclipped, {}", size(LARGE)),
        &format!("exact, to {} e⁻, {}", grouped(TOP_E), size(LARGE)),
    ]);
    for row in &results.rows {
        table.row(&[
            row.what.into(),
            row.channel.into(),
            printed(row.printed),
            agreement(row.paper[0]),
            agreement(row.paper[1]),
            agreement(row.paper_below[0]),
            agreement(row.paper_below[1]),
            agreement(row.exact[1]),
        ]);
    }
    let mut skies = Table::new(&[
        "912 skies, ECI, (11), (16), (17), (20)",
        "paper",
        &format!("equations, {}", size(SMALL)),
        &format!("equations, {}", size(SKY)),
        &format!("with our coefficients, {}", size(SKY)),
        &format!("exact, {}", size(SMALL)),
        &format!("exact, {}", size(SKY)),
    ]);
    for row in &results.sky_rows {
        skies.row(&[
            row.channel.into(),
            printed(Some(row.printed)),
            agreement(row.paper[0]),
            agreement(row.paper[1]),
            agreement(row.own[1]),
            agreement(row.exact[0]),
            agreement(row.exact[1]),
        ]);
    }
    let residual = |rows: &[Row], what: &str, unclipped: bool| {
        let row = rows.iter().find(|row| row.what == what && row.channel == "R-B");
        let row = row.ok_or_else(|| Error::Data(format!("Table 7 has no row {what}")))?;
        Ok(number(-if unclipped { row.paper_below[1] } else { row.paper[1] }.residual, 3))
    };
    let ptc = find(results, "PTC", "R-G-B")?;
    let exact_small = results.rows.iter().map(|row| (row.exact[0].slope - 1.0).abs()).fold(0.0, f64::max);
    Ok(format!(
        "## Table 7\n\n\
         Mean residual (predicted − observed, over the range) · slope of predicted on observed · correlation. The head of the \
         paper's table has observed − predicted, but its numbers have the other sign: slopes below 1 go with negative \
         residuals.\n\n{}\n\
         - The levels are not in the paper. Its 0.98 with slopes above 1 cannot be sampling error: {} frames without clipping \
         give {} in the first row. It is what a partly clipped top level does. Ours are 40 even steps up to {} e⁻; the top was \
         chosen so that the first row agrees, and is the only number that was.\n\
         - The slopes of SHTI and ECI agree with the paper's: what its equations leave out is reproduced. The residuals of SHTI \
         do not: {} and {} for Eqs. 15 and 48 in red and blue where the paper has 0.012 and −0.045. Residuals are relative to \
         the range and depend on how levels are spaced: 25 even factors from 20 e⁻, unclipped, give {} and {}.\n\
         - BI: σ by the printed 0.53 is {} off, so its slopes should lie below those of the first row; the paper's lie above or \
         beside them. Mended, ours are those of the first row within the scatter of {} frames.\n\
         - Eq. 48 for Z: the paper's residual of 0.039 is that of Eq. 15 for Z and contradicts its slope of 0.87; ours is {}.\n\
         - By exact moments all slopes are 1 within {} in {} frames, clipped levels included.\n\n\
         The skies are exposed to three quarters of full well in the brightest class, at the same exposure for all. The paper's \
         caption has MaxIgnSPPLS, its Fig. 8 SkyRadSPPLS; ours is SkyRadLS. One set of coefficients for all skies is an \
         approximation, and the paper's set is that of its own sensor; with the means of what the equations need for \
         ours, the residuals of X and Z fall and the slopes stay away from 1, for each sky has its own. Exact moments need no coefficients.\n\n{}",
        table.text,
        size(SMALL),
        agreement(ptc.paper_below[0]),
        grouped(TOP_E),
        residual(&results.rows, "SHTI, (11) and (15)", false)?,
        residual(&results.rows, "SHTI, (11) and (48)", false)?,
        residual(&results.factor_rows, "SHTI, (11) and (15)", true)?,
        residual(&results.factor_rows, "SHTI, (11) and (48)", true)?,
        percent(error(limit(results, "BI: 0.53", "R, B")?, 2)),
        size(SMALL),
        number(-find(results, "XYZ, (11), (48)", "Z")?.paper[1].residual, 3),
        number(exact_small, 2),
        size(SMALL),
        skies.text,
    ))
}

fn table_8(results: &Results) -> String {
    let c = &results.correlations;
    let mut equal = Table::new(&[
        "equal signals",
        "paper",
        "by the weights",
        &format!("measured, {} (± one frame)", size(SMALL)),
        &format!("measured, {}", size(LARGE)),
        "what the equations need",
    ]);
    let mut skies = Table::new(&[
        "mean of 912 skies",
        "paper",
        "by the weights",
        &format!("measured, {}", size(SMALL)),
        &format!("measured, {}", size(SKY)),
        "what the equations need",
    ]);
    let (paper, paper_skies) = (list(&Coefficients::EQUAL_SIGNAL), list(&Coefficients::SKIES));
    let three = |value: f64| number(value, 3);
    for (i, name) in NAMES.into_iter().enumerate() {
        equal.row(&[
            name.into(),
            number(paper[i], 2),
            three(c.equal[0][i]),
            format!("{} ± {}", three(c.equal_measured[0][i]), number(c.spread[i], 2)),
            three(c.equal_measured[1][i]),
            three(c.equal[1][i]),
        ]);
        skies.row(&[
            name.into(),
            number(paper_skies[i], 2),
            three(c.skies[0][i]),
            three(c.skies_measured[0][i]),
            three(c.skies_measured[1][i]),
            three(c.skies[1][i]),
        ]);
    }
    let mut readings = Table::new(&["what r′₂ may be", "equal signals", "skies, R", "skies, B"]);
    readings.row(&["the paper's r′₂".into(), "0.41".into(), "0.45".into(), "0.32".into()]);
    for (reading, [equal, skies]) in READINGS.into_iter().zip(&c.readings) {
        readings.row(&[reading.into(), number(equal[0], 2), number(skies[0], 2), number(skies[1], 2)]);
    }
    format!(
        "## Table 8\n\n\
         By the weights: correlations as Eq. 50 defines them, exact for large frames. What the equations need: the coefficients \
         that make Eqs. 16 and 17 exact, which also have to make up for the K of one mean being correlated with each other \
         (each takes part in the same measured value), where the paper takes them as not (above Eq. 53).\n\n{}\n\
         The paper's r₃, r_rg, r_rb and r_gb are those of frames of its size: edges, where neighbors count twice, lower them.\n\n\
         The means over the skies depend on the sensor's colors, which are estimates; {} of 11 lie within 0.05 of the \
         paper's.\n\n{}\n\
         ### r′₂\n\n\
         Eq. 57 takes it as the correlation of the green interpolated at blue with the mean of the four K_R about it. That is \
         {}; single {} frames scatter by ± {} about it, and the paper averaged several. It has 0.41, the value of r′₁.\n\n{}\n\
         Only r′₁ itself gives 0.41 for equal signals, and it does not fit the skies, where the paper's two differ (0.57 and \
         0.45 for red). The reading of Eq. 57 is nearest there for red. So the 0.41 may be a copy of r′₁; nothing that we \
         tried gives it otherwise.\n",
        equal.text,
        (0..11).filter(|&i| (c.skies_measured[0][i] - paper_skies[i]).abs() < 0.05).count(),
        skies.text,
        number(c.equal[0][3], 3),
        size(SMALL),
        number(c.spread[3], 2),
        readings.text,
    )
}

fn limits(results: &Results) -> Result<String> {
    let mut heads = vec!["approximation".to_owned(), String::new()];
    heads.extend(LEVELS.map(|level| format!("{} e⁻", grouped(level))));
    heads.extend(["checked at", "z from exact", "z from approximation"].map(str::to_owned));
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    for limit in &results.limits {
        let mut cells = vec![limit.name.to_owned(), limit.channel.to_owned()];
        cells.extend(limit.errors.map(|error| match error {
            Some((error, pixels)) => format!("{} / {}", percent(error), count(pixels)),
            None => "void".into(),
        }));
        let check = &limit.check;
        cells.push(format!("{} e⁻", grouped(check.level)));
        cells.extend([check.z_exact, check.z_approximate].map(|z| number(z, 1)));
        table.row(&cells);
    }
    let mut edges = Table::new(&[
        &format!("{}, 10 000 e⁻", size(SMALL)),
        "edges add to σ",
        "in standard errors of one frame",
        &format!("z with edges, {EDGE_FRAMES} frames"),
        "z without",
    ]);
    for edge in &results.edges {
        edges.row(&[
            edge.what.clone(),
            percent(edge.error),
            number(edge.deviations, 2),
            number(edge.z[0], 1),
            number(edge.z[1], 1),
        ]);
    }
    let nil = limit(results, "the converter", "ADU")?.errors[0].map_or(f64::NAN, |(_, pixels)| pixels);
    Ok(format!(
        "## At which sample size each approximation shows\n\n\
         Relative error of the standard deviation, and the number of pixels (of patches, in the last rows) at which it is three \
         standard errors: n = (3/error)²/2 for independent pixels, more by what correlated ones are worth less. The check \
         simulates {frames} frames of {large} where the error is largest; z is the deviation in standard errors. The paper's \
         frames have 1200 pixels, enough for Eqs. 15 and 48 and for missing covariances in Y; the rounding of codes takes {nil} \
         pixels of darkness.\n\n{table}\n\
         Edges are another matter. Eq. 14 has no edges; mirroring at them, as we do, counts some neighbors twice. That touches \
         a share of pixels that falls as one over the side of the frame, as the sampling error does: it shows at no size of a \
         single frame, and in the mean over many.\n\n{edges}",
        frames = FRAMES,
        large = size(SIZE),
        nil = count(nil),
        table = table.text,
        edges = edges.text,
    ))
}

//! What the figures show, and the maximum signal-to-noise ratios.

use super::shown::{
    PAPER_SNR_DB, at_blue, error, grouped, highest_charge, limit, lowest_for_ratios, percent, sampling_error, size,
};
use crate::Results;
use crate::agreement::UNCLIPPED_E;
use crate::camera::{METHODS, SMALL};
use crate::figures::{HUE_FRAMES, exact_snr_db, level_with_noise};
use crate::prediction::Sites;
use crate::sweep::TOP_E;
use cyanometer::error::Result;
use cyanometer::propagation::Equations;
use cyanometer_studies::pages::{Table, number};
use std::fmt::Write;

#[allow(clippy::too_many_lines, reason = "a page, written from top to bottom")]
pub(super) fn figures(results: &Results) -> Result<String> {
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

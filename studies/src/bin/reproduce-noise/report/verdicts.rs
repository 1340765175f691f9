//! What the paper says, what we find, and how the two fare.

use super::shown::{PAPER_SNR_DB, at_blue, error, find, grouped, highest_charge, limit, percent, verdict};
use crate::Results;
use crate::agreement::UNCLIPPED_E;
use crate::camera::METHODS;
use crate::correlation::list;
use crate::figures::{exact_snr_db, level_with_noise};
use cyanometer::error::Result;
use cyanometer::propagation::paper::Coefficients;
use cyanometer_studies::pages::{Table, number};

#[allow(clippy::too_many_lines, reason = "a page, written from top to bottom")]
pub(super) fn verdicts(results: &Results) -> Result<String> {
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

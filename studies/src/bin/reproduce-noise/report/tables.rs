//! Tables 7 and 8.

use super::shown::{agreement, error, find, grouped, limit, percent, printed, size};
use crate::agreement::Row;
use crate::camera::{LARGE, SMALL};
use crate::correlation::{NAMES, READINGS, list};
use crate::sweep::TOP_E;
use crate::{Results, SKY};
use cyanometer::error::{Error, Result};
use cyanometer::propagation::paper::Coefficients;
use cyanometer_studies::pages::{Table, number};

#[allow(clippy::too_many_lines, reason = "a page, written from top to bottom")]
pub(super) fn table_7(results: &Results) -> Result<String> {
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

#[allow(clippy::too_many_lines, reason = "a page, written from top to bottom")]
pub(super) fn table_8(results: &Results) -> String {
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

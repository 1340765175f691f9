//! The page: docs/reproduction/noise.md.

mod figures;
mod limits;
mod shown;
mod tables;
mod verdicts;

use self::figures::figures;
use self::limits::limits;
use self::shown::size;
use self::tables::{table_7, table_8};
use self::verdicts::verdicts;
use crate::Results;
use crate::camera::{LARGE, SMALL};
use cyanometer::error::Result;
use cyanometer_studies::camera::EXPOSURE;
use cyanometer_studies::pages::number;

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

//! At which sample size each approximation shows.

use super::shown::{count, grouped, limit, percent, size};
use crate::Results;
use crate::camera::SMALL;
use crate::limits::{EDGE_FRAMES, FRAMES, LEVELS, SIZE};
use cyanometer::error::Result;
use cyanometer_studies::pages::{Table, number};

pub(super) fn limits(results: &Results) -> Result<String> {
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

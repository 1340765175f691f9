//! Which sources are drawn, and by which numbers.

use super::model::{NoiseSettings, rectified_mean};
use crate::camera::readout::ReadOut;
use crate::error::{Error, Result};
use crate::metadata::{FrameHeader, Metadata, NoiseRecord};
use crate::random::Source;
use crate::text::in_digits;

/// The dark signal is left out where its variance is below this share of that of the read noise: the total standard
/// deviation changes by less than half of it.
const NEGLIGIBLE_DARK: f64 = 1e-9;

/// The sources that are drawn of a frame, and the numbers that they follow; what is left out is noted in `metadata`.
///
/// # Errors
///
/// [`Error::MissingKey`] without sensor or exposure; [`Error::Usage`] for an impossible temperature.
pub(super) fn of(input: &FrameHeader, settings: &NoiseSettings, metadata: &mut Metadata) -> Result<NoiseRecord> {
    let readout = input.readout()?;
    let temperature_k = settings.temperature_k.unwrap_or(readout.temperature_k);
    if !(1.0..=1000.0).contains(&temperature_k) {
        return Err(Error::Usage(format!(
            "a temperature of {temperature_k} K is impossible for a sensor; give 1 to 1000"
        )));
    }
    // Eq. 7: Q_DC = I_DC Δt.
    let exposure_s = input.exposure()?.exposure_s;
    let mut dark_e = readout.dark_current_e_per_s(temperature_k) * exposure_s;
    let mut hot_pixel_e = readout.hot_pixel_e_per_s(temperature_k) * exposure_s;
    let hot_share = readout.hot_pixel_share;
    let is_kept = |source: &Source| !settings.without.contains(source);
    let mut sources: Vec<Source> = Source::ALL.into_iter().filter(is_kept).collect();
    // What the noisy frames leave out, the clean one does.
    let least_read_noise_e = readout.read_noises_e().fold(f64::INFINITY, f64::min);
    let read_variance = if sources.contains(&Source::Ron) { least_read_noise_e.powi(2) } else { 0.0 };
    let of_hot = hot_share * hot_pixel_e * (1.0 + 2.0 * hot_pixel_e);
    let dark_variance = dark_e * (1.0 + readout.dcnu.powi(2)) + of_hot;
    if dark_variance > 0.0 && dark_variance < NEGLIGIBLE_DARK * read_variance {
        metadata.leave_out(
            "add-noise",
            format!("dark signal of {} e-", in_digits(dark_e + hot_share * hot_pixel_e, 2)),
            format!("its variance is below {NEGLIGIBLE_DARK:e} of that of the read noise"),
        );
        (dark_e, hot_pixel_e) = (0.0, 0.0);
    }
    if !sources.contains(&Source::HotPixels) {
        dark_e += hot_share * hot_pixel_e;
        hot_pixel_e = 0.0;
    }
    if hot_pixel_e == 0.0 {
        sources.retain(|source| *source != Source::HotPixels);
    }
    if dark_e == 0.0 {
        sources.retain(|source| *source != Source::Dcnu && (*source != Source::Dcsn || hot_pixel_e > 0.0));
    }
    sources.retain(|source| has_noise(readout, *source));
    if settings.clean {
        // No source is drawn that would lift the mean where it is cut at zero.
        dark_e = dark_e * rectified_mean(readout.dcnu) + hot_share * hot_pixel_e;
        hot_pixel_e = 0.0;
        sources.clear();
    }
    Ok(NoiseRecord {
        sources,
        seed: settings.seed,
        sensor_seed: settings.sensor_seed,
        frame: settings.frame,
        temperature_k,
        dark_e,
        hot_pixel_e,
        poisson: settings.poisson,
        cte: settings.cte,
        smear_per_row: if exposure_s > 0.0 { readout.smear_line_s / exposure_s } else { 0.0 },
    })
}

/// Whether a sensor has a source of noise at all.
fn has_noise(readout: &ReadOut, source: Source) -> bool {
    match source {
        Source::Dcnu => readout.dcnu > 0.0,
        Source::Prnu => readout.prnu > 0.0,
        Source::Ron => readout.read_noises_e().any(|noise| noise > 0.0),
        Source::RowNoise => readout.row_noise_e > 0.0,
        Source::ColumnNoise => readout.column_noise_e > 0.0,
        Source::Dsnu => readout.dsnu_e > 0.0,
        Source::DsnuRow => readout.dsnu_row_e > 0.0,
        Source::DsnuColumn => readout.dsnu_column_e > 0.0,
        Source::PrnuRow => readout.prnu_row > 0.0,
        Source::PrnuColumn => readout.prnu_column > 0.0,
        Source::HotPixels => readout.hot_pixel_share > 0.0,
        Source::Rts => readout.rts_share > 0.0,
        Source::BlackDrift => readout.black_drift_e > 0.0,
        Source::Dcsn | Source::Ssn => true,
    }
}

//! Which noise is drawn.

use crate::metadata::PoissonKind;
use crate::names::Named;
use crate::random::Source;
use crate::requests::values;
use crate::stages::noise::NoiseSettings;
use crate::units::kelvin;
use clap::Args;
use std::ops::Range;

/// Which noise, at which temperature.
#[derive(Debug, Clone, Default, PartialEq, Args)]
pub struct NoiseChoice {
    /// Sources to leave out, between commas; their means stay: dcsn, dcnu, ssn, prnu, ron; row_noise,
    /// column_noise, dsnu, dsnu_row, dsnu_column, prnu_row, prnu_column, black_drift; hot_pixels, rts
    #[arg(long, value_delimiter = ',', value_name = "SOURCES", value_parser = values::choice::<Source>())]
    pub without: Vec<Source>,
    /// Temperature of the sensor in K; by default the sensor's own
    #[arg(id = "temperature", long, value_name = "K", value_parser = sensor_temperature)]
    pub temperature_k: Option<f64>,
}

/// Reads the temperature of a sensor in K, which sensor files have from 70 K on; next to none, which leaves out the dark signal, is meant.
fn sensor_temperature(text: &str) -> Result<f64, String> {
    /// Temperatures, in K, that no silicon works at.
    const COLD_K: Range<f64> = 2.0..70.0;
    let found = values::kelvin(text)?;
    if COLD_K.contains(&found) {
        let meant = kelvin(found);
        return Err(format!(
            "give a temperature in K, above 0; {found} looks like degrees Celsius, which is {meant} K"
        ));
    }
    Ok(found)
}

impl NoiseChoice {
    /// The noise of the seeds 0.
    pub fn settings(&self) -> NoiseSettings {
        NoiseSettings { without: self.without.clone(), temperature_k: self.temperature_k, ..NoiseSettings::default() }
    }
}

/// Which noise of which exposure, or none.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct DrawnNoise {
    /// Seed of the temporal noise
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u64>, conflicts_with = "clean")]
    pub seed: u64,
    /// Seed of the fixed patterns: another number, another sensor
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u64>, conflicts_with = "clean")]
    pub sensor_seed: u64,
    /// Number of the exposure: another number, other temporal noise
    #[arg(long, default_value_t = 0, value_parser = values::whole::<u32>, conflicts_with = "clean")]
    pub frame: u32,
    /// Exposures to draw of each scene, from A to the one before B: one frame after another, each as --frame draws it
    #[arg(long, value_name = "A..B", value_parser = values::exposures, conflicts_with_all = ["clean", "frame"])]
    pub frames: Option<Range<u32>>,
    /// Which.
    #[command(flatten)]
    pub choice: NoiseChoice,
    /// Leave all sources out: the clean partner of noisy exposures, their mean, dark signal included
    #[arg(long, conflicts_with = "without")]
    pub clean: bool,
    /// How Poisson numbers are drawn: exact, or gaussian to see what that approximation costs
    #[arg(long, default_value = PoissonKind::default().name(), value_parser = values::choice::<PoissonKind>(), conflicts_with = "clean")]
    pub poisson: PoissonKind,
    /// Charge transfer efficiency: the share of a packet that each move to the output takes along, above 0 and at most 1;
    /// by default transfer is left out
    #[arg(long, value_name = "X", value_parser = values::fraction)]
    pub cte: Option<f64>,
}

impl DrawnNoise {
    /// The noise of one of the exposures, where there are several.
    pub fn settings(&self, exposure: Option<u32>) -> NoiseSettings {
        let Self { seed, sensor_seed, frame, clean, poisson, cte, .. } = *self;
        let frame = exposure.unwrap_or(frame);
        NoiseSettings { seed, sensor_seed, frame, clean, poisson, cte, ..self.choice.settings() }
    }
}

//! The sensor that a scene falls on.

use super::notes::Note;
use super::values;
use crate::camera::sensor::Counts;
use crate::error::Result;
use crate::formats::data::{self, LoadedSensor, SensorChanges};
use clap::Args;

/// A sensor, and what is said of it in place of what its file says.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct SensorRequest {
    /// Sensor: a known name, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = data::DEFAULT_SENSOR)]
    pub sensor: String,
    /// List the sensors that are known by name, with what each has and lacks; words behind it pick those of which they are told
    #[arg(id = "list_sensors", long = "list")]
    pub list: bool,
    /// Sensor whose read-out counts in place of the sensor's own
    #[arg(long, value_name = "NAME|FILE")]
    pub readout: Option<String>,
    /// Setting of the read-out, of gain, ISO or conversion gain: one of those that the sensor file has
    #[arg(long, value_name = "NAME")]
    pub setting: Option<String>,
    /// What a relative response counts: energy, signal per watt, or quanta, signal per photon; by default what the sensor
    /// file says, or energy
    #[arg(long, value_parser = values::choice::<Counts>())]
    pub counts: Option<Counts>,
    /// Largest quantum efficiency of the sensor, the scale of a relative response, 0 to 1
    #[arg(long, value_name = "FRACTION", value_parser = values::fraction)]
    pub peak_quantum_efficiency: Option<f64>,
}

impl Default for SensorRequest {
    /// The default sensor as its file has it.
    fn default() -> Self {
        Self {
            sensor: data::DEFAULT_SENSOR.into(),
            list: false,
            readout: None,
            setting: None,
            counts: None,
            peak_quantum_efficiency: None,
        }
    }
}

impl SensorRequest {
    /// Loads the sensor, with what came up.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_changed_sensor`].
    pub fn load(&self) -> Result<(LoadedSensor, Vec<Note>)> {
        let Self { sensor, readout, setting, counts, peak_quantum_efficiency, .. } = self.clone();
        let changes = SensorChanges { readout, setting, counts, peak_quantum_efficiency };
        let loaded = data::load_changed_sensor(&sensor, &changes)?;
        let remarks = loaded.remarks().iter().cloned().map(Note::Remark);
        let notes = loaded.doubts().into_iter().map(Note::Warning).chain(remarks).collect();
        Ok((loaded, notes))
    }
}

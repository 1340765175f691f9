//! A sensor in place of the one that a frame names.

use crate::camera::levels::WhiteLevel;
use crate::camera::sensor::Sensor;
use crate::error::{Error, Result};
use crate::formats::data::{self, SensorChanges};
use crate::formats::input::FrameReader;
use crate::metadata::{CorrectionRecord, FrameHeader};
use crate::requests::notes::Note;
use crate::units::QuantityKind;
use clap::Args;

/// A sensor that counts instead of the one in the frame's metadata.
#[derive(Debug, Clone, Default, Args)]
pub struct SensorChoice {
    /// Sensor, for a frame whose metadata names none, or another than it names
    #[arg(long, value_name = "NAME|FILE")]
    pub sensor: Option<String>,
    /// List the sensors that are known by name, with what each has and lacks; words behind it pick those of which they are told
    #[arg(id = "list_sensors", long = "list")]
    pub list: bool,
    /// Sensor whose read-out counts in place of that of the frame's sensor, or of --sensor
    #[arg(long, value_name = "NAME|FILE")]
    pub readout: Option<String>,
    /// Setting of the read-out of --readout, or of --sensor: one of those that its file has
    #[arg(long, value_name = "NAME")]
    pub setting: Option<String>,
}

impl SensorChoice {
    /// Puts the sensor, if one was chosen, or its read-out into the metadata of a frame; gives what in its description may not
    /// be meant.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_sensor`].
    pub fn apply(&self, reader: &mut FrameReader) -> Result<Vec<Note>> {
        let own = reader.header_mut().metadata.sensor.clone();
        let setting = self.setting.as_deref();
        let (loaded, doubts, remarks) = match (&self.sensor, &self.readout, own) {
            (None, None, _) if setting.is_some() => {
                let problem = "a frame has the numbers of one setting, and files of sensors those of others";
                return Err(Error::Usage(problem.into()).give(&["sensor", "readout"]));
            }
            (None, None, _) => return Ok(Vec::new()),
            (Some(sensor), readout, _) => {
                let (readout, setting) = (readout.clone(), self.setting.clone());
                let changes = SensorChanges { readout, setting, ..SensorChanges::default() };
                let loaded = data::load_changed_sensor(sensor, &changes)?;
                (loaded.sensor.clone(), loaded.doubts(), loaded.remarks().to_vec())
            }
            (None, Some(readout), Some(mut own)) => {
                let (other, remarks) = data::load_description(readout, setting)?;
                let lost = own.replace_readout(&other)?;
                let doubts = lost.into_iter().chain(own.doubts()).collect();
                (own, doubts, remarks)
            }
            (None, Some(readout), None) => {
                let (other, remarks) = data::load_description(readout, setting)?;
                other.readout()?;
                let doubts = other.doubts();
                (other, doubts, remarks)
            }
        };
        let doubts = doubts.into_iter().chain(contradictions(reader.header_mut(), &loaded));
        let notes = doubts.map(Note::Warning).chain(remarks.into_iter().map(Note::Remark)).collect();
        reader.header_mut().metadata.sensor = Some(loaded);
        Ok(notes)
    }
}

/// What a frame says of itself that the read-out of a sensor does not.
fn contradictions(frame: &FrameHeader, sensor: &Sensor) -> Vec<String> {
    let Some(readout) = &sensor.readout else { return Vec::new() };
    let FrameHeader { name, metadata, .. } = frame;
    let is_codes = metadata.quantity == QuantityKind::Adu;
    let last_code = f64::from((1_u32 << readout.bits) - 1);
    let mut found = Vec::new();
    if let Some(cfa) = metadata.cfa.filter(|cfa| *cfa != readout.cfa) {
        found.push(format!("it has {}, and sensor {} has {}", cfa.in_words(), sensor.name, readout.cfa.in_words()));
    }
    if let Some(white) =
        metadata.white_level_adu.map(WhiteLevel::largest).filter(|white| is_codes && *white > last_code)
    {
        found.push(format!(
            "its white level, {white} ADU, is beyond the last code of sensor {}, {last_code}",
            sensor.name
        ));
    }
    let lost_black = metadata.correction.as_ref().is_some_and(CorrectionRecord::took_frames);
    if is_codes && lost_black && metadata.white_level_adu.is_none() && metadata.sensor.is_none() {
        found.push(format!(
            "the full well of sensor {} comes too late to mark saturated samples: dark frames came off them; give --sensor to \
             `correct-frame`",
            sensor.name
        ));
    }
    found.into_iter().map(|what| format!("{name}: {what}")).collect()
}

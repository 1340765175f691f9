//! A level of no light beside the bias of the sensor that is named.

use crate::camera::levels::{BlackLevel, levels_of_bias};
use crate::metadata::FrameHeader;
use crate::units::QuantityKind;

/// A warning of a level to subtract from codes of a camera that is far from the bias of the sensor which is named; what it counts of dark
/// signal is a small share of the range. `said` is what the level is called.
pub(super) fn of_another_sensor(frame: &FrameHeader, black: BlackLevel, said: &str) -> Option<String> {
    let metadata = &frame.metadata;
    let are_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
    if !are_codes || metadata.adc.is_some() || metadata.correction.is_some() {
        return None;
    }
    let sensor = metadata.sensor.as_ref()?;
    let readout = sensor.readout.as_ref()?;
    let (level, bias) = (black.mean(), readout.bias_adu);
    let [least, most] = levels_of_bias(bias, f64::from((1_u32 << readout.bits) - 1));
    (level < least || level > most)
        .then(|| format!("{}: {said} is far from the bias of {}, {bias} ADU", frame.name, sensor.name))
}

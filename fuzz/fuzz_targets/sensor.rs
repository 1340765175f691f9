//! Sensor files: any text.
#![no_main]

use cyanometer::formats::yaml::parse_sensor;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(sensor) = parse_sensor("in", bytes) {
        drop(sensor.check());
    }
});

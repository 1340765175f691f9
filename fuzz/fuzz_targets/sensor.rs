//! Sensor files: any text.
#![no_main]

use cyanometer::formats::yaml::parse_sensor;
use cyanometer_fuzz::mutation;
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

fuzz_target!(|bytes: &[u8]| {
    if let Ok(sensor) = parse_sensor("in", bytes) {
        drop(sensor.check());
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutation::of_text(data, size, max_size, seed)
});

//! Matrix files: any text.
#![no_main]

use cyanometer::analysis::characterization::CameraMatrix;
use cyanometer::formats::yaml::parse_strict;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(matrix) = parse_strict::<CameraMatrix>("in", bytes) {
        drop(matrix.check());
    }
});

//! Matrix files: any text.
#![no_main]

use cyanometer::analysis::characterization::CameraMatrix;
use cyanometer::formats::yaml::parse_strict;
use cyanometer_fuzz::mutation;
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

fuzz_target!(|bytes: &[u8]| {
    if let Ok(matrix) = parse_strict::<CameraMatrix>("in", bytes) {
        drop(matrix.check());
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutation::of_text(data, size, max_size, seed)
});

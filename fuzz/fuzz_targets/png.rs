//! PNG: any bytes.
#![no_main]

use cyanometer::formats::png::PngReader;
use cyanometer_fuzz::{file, read, settle};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    settle();
    drop(PngReader::open(file(bytes), "in", 0).and_then(read));
});

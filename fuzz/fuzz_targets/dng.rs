//! DNG, all that is stored of the raw image: any bytes.
#![no_main]

use cyanometer::formats::dng::{DngReader, RawArea};
use cyanometer_fuzz::{file, read, settle};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    settle();
    drop(DngReader::open(file(bytes), "in", RawArea::Full).and_then(read));
});

//! TIFF, and raws that begin as one: any bytes.
#![no_main]

use cyanometer::formats::table::by_tags;
use cyanometer::formats::tiff::{TiffReader, begins_so};
use cyanometer_fuzz::{file, read, settle};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    settle();
    if begins_so(bytes) {
        drop(by_tags(&file(bytes), "in"));
        drop(TiffReader::open(file(bytes), "in", 0).and_then(read));
    }
});

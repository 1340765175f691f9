//! TIFF, and raws that begin as one: any bytes.
#![no_main]

use cyanometer_fuzz::{read_file, settle};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    settle();
    if cyanometer::formats::tiff::begins_so(bytes) {
        drop(read_file(bytes));
    }
});

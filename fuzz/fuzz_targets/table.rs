//! Tables of spectra and of labels, plain and gzipped: any bytes.
#![no_main]

use cyanometer::formats::csv::{SpectralTable, text_column};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    drop(text_column("in", bytes, "a"));
    let Ok(table) = SpectralTable::parse("in", bytes) else { return };
    for index in 0..table.columns.len() {
        drop(table.radiance_unit(index, None));
        drop(table.negative(index));
    }
    if let Ok(curve) = table.curve(None) {
        assert!(curve.at(550.0).is_finite());
    }
});

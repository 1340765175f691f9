//! Libraries of spectra, images or tables: any bytes.
#![no_main]

use cyanometer::formats::spectral::read_library;
use cyanometer_fuzz::settle;
use libfuzzer_sys::fuzz_target;
use std::io::Write;

fuzz_target!(|bytes: &[u8]| {
    settle();
    let mut file = tempfile::NamedTempFile::new().expect("there is room for a file");
    file.write_all(bytes).expect("a small file can be written");
    if let Ok((library, _)) = read_library(file.path(), None) {
        assert!(library.radiance.iter().all(|value| value.is_finite()));
        assert_eq!(library.radiance.ncols(), library.wavelength_nm.len());
    }
});

//! Metadata: any text; what is read is written so that it is read again, and then says the same.
#![no_main]

use cyanometer::formats::yaml::{parse_metadata, write_metadata};
use cyanometer_fuzz::mutation;
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(metadata) = parse_metadata("in", text) else { return };
    let Ok(written) = write_metadata(&metadata) else { return };
    let again = parse_metadata("written", &written).expect("what is written is read");
    let twice = write_metadata(&again).expect("what was written is written again");
    assert_eq!(written, twice);
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutation::of_text(data, size, max_size, seed)
});

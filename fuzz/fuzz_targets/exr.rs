//! OpenEXR: any bytes, as a file and, where it is one that needs no seek, down a pipe; both say the same.
#![no_main]

use cyanometer_fuzz::{read_file, read_pipe, settle};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    settle();
    // A file is known by its first bytes; the flags of one that is tiled, deep or of several parts lie in its sixth.
    if bytes.len() < 8 || bytes[..4] != [0x76, 0x2F, 0x31, 0x01] {
        return;
    }
    let by_file = read_file(bytes);
    if bytes[5] & (0x02 | 0x08 | 0x10) != 0 {
        return;
    }
    let by_pipe = read_pipe(bytes);
    match (by_file, by_pipe) {
        (Ok(file), Ok(pipe)) => {
            let bits = |samples: &[f32]| samples.iter().map(|sample| sample.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&file), bits(&pipe));
        }
        (Err(_), Err(_)) => {}
        // Metadata are looked at by the reader of frames only; what lies between blocks is passed over in a file.
        (Err(error), Ok(_)) => assert!(is_of_metadata(&error.to_string()), "refused as a file alone: {error}"),
        (Ok(_), Err(error)) => assert!(lies_elsewhere(&error.to_string()), "refused in a pipe alone: {error}"),
    }
});

fn is_of_metadata(error: &str) -> bool {
    ["schema", "not as expected", "not a list", "not a finite", "in `", "nest", "brackets", "longer than 1 MiB", "UTF-8", "UTF-16", "anchors", "exposure", "f-number", "transmittance"]
        .iter()
        .any(|word| error.contains(word))
}

fn lies_elsewhere(error: &str) -> bool {
    ["points elsewhere", "from bottom to top"].iter().any(|word| error.contains(word))
}

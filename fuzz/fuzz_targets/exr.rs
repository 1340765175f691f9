//! OpenEXR: any bytes, as a file and, where it is one that needs no seek, down a pipe; both say the same.
#![no_main]

use cyanometer::formats::exr::ExrReader;
use cyanometer::formats::read_ahead::Pipe;
use cyanometer_fuzz::{file, read, settle};
use libfuzzer_sys::fuzz_target;
use std::io::Cursor;

fuzz_target!(|bytes: &[u8]| {
    settle();
    // A file is known by its first bytes; the flags of one that is tiled, deep or of several parts lie in its sixth.
    if bytes.len() < 8 || bytes[..4] != [0x76, 0x2F, 0x31, 0x01] {
        return;
    }
    let by_file = ExrReader::open(file(bytes), "in", 0).and_then(read);
    if bytes[5] & (0x02 | 0x08 | 0x10) != 0 {
        return;
    }
    let by_pipe = ExrReader::stream(Pipe::of(Cursor::new(bytes.to_vec())), "in").and_then(read);
    match (by_file, by_pipe) {
        (Ok(file), Ok(pipe)) => {
            let bits = |samples: &[f32]| samples.iter().map(|sample| sample.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&file), bits(&pipe));
        }
        (Err(_), Err(_)) => {}
        (Err(error), Ok(_)) => panic!("refused as a file alone: {error}"),
        // What needs a seek: rows from bottom to top, blocks with gaps between them.
        (Ok(_), Err(error)) => {
            let error = error.to_string();
            let needs_seek = ["points elsewhere", "from bottom to top"].iter().any(|word| error.contains(word));
            assert!(needs_seek, "refused in a pipe alone: {error}");
        }
    }
});

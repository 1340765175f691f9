//! FITS: any bytes, as a file and down a pipe, which agree on the first part; and any part of a file.
#![no_main]

use cyanometer::formats::fits::FitsReader;
use cyanometer::formats::read_ahead::Pipe;
use cyanometer_fuzz::{file, read, settle};
use libfuzzer_sys::fuzz_target;
use std::io::Cursor;

fuzz_target!(|bytes: &[u8]| {
    settle();
    let placed = FitsReader::open(file(bytes), "in", 0).and_then(read);
    let streamed = FitsReader::stream(Pipe::of(Cursor::new(bytes.to_vec())), "in").and_then(read);
    // A file is known to be cut short before its first row is read; a stream of very many samples is not read to its end.
    assert!(placed.is_err() || streamed.is_ok(), "{:?}", streamed.err());
    drop(FitsReader::open(file(bytes), "in", 1).and_then(read));
});

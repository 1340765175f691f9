//! What the targets share: bytes as files, and frames read to their end.

use cyanometer::error::Result;
use cyanometer::formats::exr::ExrReader;
use cyanometer::formats::format::SampleReader;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::stream::RowSource;
use std::fs::File;
use std::io::{Cursor, Seek, Write};
use std::sync::Once;

/// Samples of a frame that are read at most: one that holds what it says may be large, and another run's time is better
/// spent.
const MOST_SAMPLES: usize = 1 << 20;

/// Has all work done on the thread that asks for it.
pub fn settle() {
    static SETTLED: Once = Once::new();
    SETTLED.call_once(|| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        pool.build_global().expect("no pool stands yet");
    });
}

/// A file of these bytes, at its start.
pub fn file(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().expect("there is room for a file");
    file.write_all(bytes).and_then(|()| file.rewind()).expect("a small file can be written");
    file
}

/// Reads a frame of a file to its end.
pub fn read_file(bytes: &[u8]) -> Result<Vec<f32>> {
    let options = InputOptions { all_channels: true, ..InputOptions::default() };
    let mut reader = FrameReader::open_file(file(bytes), "in", None, &options)?;
    let (height, row) = (reader.header().geometry.height, reader.header().geometry.row_samples());
    let natural = reader.natural_rows();
    rows(height, row, natural, |rows, samples| reader.read(rows, samples))
}

/// Reads a frame that comes down a pipe to its end.
pub fn read_pipe(bytes: &[u8]) -> Result<Vec<f32>> {
    let mut reader = ExrReader::stream(Box::new(Cursor::new(bytes.to_vec())), "in")?;
    let (height, row) = (reader.geometry().height, reader.geometry().row_samples());
    let natural = reader.natural_rows();
    rows(height, row, natural, |rows, samples| reader.read(rows, samples))
}

fn rows(
    height: usize,
    row: usize,
    natural: usize,
    mut read: impl FnMut(usize, &mut Vec<f32>) -> Result<()>,
) -> Result<Vec<f32>> {
    let mut samples = Vec::new();
    let mut done = 0;
    while done < height && samples.len() < MOST_SAMPLES {
        let count = natural.min((MOST_SAMPLES / row.max(1)).max(1)).min(height - done);
        read(count, &mut samples)?;
        done += count;
    }
    assert!(samples.len() == done * row, "{done} rows of {row} samples came as {}", samples.len());
    Ok(samples)
}

//! What the targets share: bytes as files, and frames read to their end.

pub mod mutation;

use cyanometer::error::Result;
use cyanometer::formats::format::SampleReader;
use std::fs::File;
use std::io::{Seek, Write};
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

/// Reads all rows; of a frame of very many samples the first.
///
/// # Errors
///
/// Those of the reader.
pub fn read(mut reader: impl SampleReader) -> Result<Vec<f32>> {
    let (height, row) = (reader.geometry().height, reader.geometry().row_samples());
    let natural = reader.natural_rows();
    let mut samples = Vec::new();
    let mut done = 0;
    while done < height && samples.len() < MOST_SAMPLES {
        let count = natural.min((MOST_SAMPLES / row.max(1)).max(1)).min(height - done);
        reader.read(count, &mut samples)?;
        done += count;
    }
    assert!(samples.len() == done * row, "{done} rows of {row} samples came as {}", samples.len());
    Ok(samples)
}

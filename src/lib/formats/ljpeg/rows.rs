//! Rows of samples from their differences.

use super::entropy::{Bits, unstuff};
use super::header::Header;
use super::{SHORT, damaged};

/// A stream that gives its samples row by row; those of several components take turns.
#[derive(Debug)]
pub(in crate::formats) struct LjpegRows {
    header: Header,
    /// The stream; the part that is being read is without stuffing.
    bytes: Vec<u8>,
    /// That part.
    begin: usize,
    end: usize,
    /// The marker behind it.
    marker: usize,
    bits: Bits,
    /// Parts that are behind us, modulo 8.
    restarts: u8,
    row: usize,
    /// The row above, without the point transform.
    above: Vec<u16>,
    current: Vec<u16>,
}

impl LjpegRows {
    /// Opens a stream; `largest_has_bits` where it may be of a program that put 16 bits behind the size 16 too.
    ///
    /// # Errors
    ///
    /// What is wrong, in words that follow the name of its strip or tile.
    pub fn open(bytes: Vec<u8>, largest_has_bits: bool) -> Result<Self, String> {
        let header = Header::read(&bytes, largest_has_bits)?;
        // Each sample has a bit at least.
        let samples = header.width as u64 * header.height as u64 * header.table_of.len() as u64;
        if samples > bytes.len() as u64 * 8 {
            return Err(format!("holds fewer bytes than its {samples} samples need; it was cut short or damaged"));
        }
        let begin = header.begin;
        let mut opened = Self {
            header,
            bytes,
            begin,
            end: begin,
            marker: begin,
            bits: Bits::default(),
            restarts: 0,
            row: 0,
            above: Vec::new(),
            current: Vec::new(),
        };
        opened.begin_part(begin);
        Ok(opened)
    }

    /// Samples in all.
    pub fn samples(&self) -> u64 {
        self.row_samples() as u64 * self.header.height as u64
    }

    /// Samples of a row, those of all components.
    fn row_samples(&self) -> usize {
        self.header.width * self.header.table_of.len()
    }

    /// Makes ready the part that begins at `begin`.
    fn begin_part(&mut self, begin: usize) {
        let (length, marker) = unstuff(&mut self.bytes[begin..]);
        self.begin = begin;
        self.end = begin + length;
        self.marker = begin + marker;
        self.bits = Bits::default();
    }

    /// Passes the marker between two parts.
    fn restart(&mut self) -> Result<(), String> {
        match self.bytes.get(self.marker..self.marker + 2) {
            Some([_, marker]) if *marker == 0xD0 + self.restarts => {}
            Some([_, 0xD0..=0xD7]) => return Err(damaged("has its parts out of order")),
            _ => return Err(SHORT.into()),
        }
        self.restarts = (self.restarts + 1) % 8;
        self.begin_part(self.marker + 2);
        Ok(())
    }

    /// Decodes the next row.
    ///
    /// # Errors
    ///
    /// What is wrong, in words; behind the last row, that it ends.
    pub fn next(&mut self) -> Result<&[u16], String> {
        if self.row == self.header.height {
            return Err(SHORT.into());
        }
        let restart_rows = self.header.restart_rows;
        let is_restart = restart_rows > 0 && self.row > 0 && self.row.is_multiple_of(restart_rows);
        if is_restart {
            self.restart()?;
        }
        let row_samples = self.row_samples();
        std::mem::swap(&mut self.above, &mut self.current);
        self.current.resize(row_samples, 0);
        let header = &self.header;
        let tables: Vec<_> = match header.tables.as_slice() {
            [one] => vec![one],
            tables => header.table_of.iter().map(|place| &tables[*place]).collect(),
        };
        let part = &self.bytes[self.begin..self.end];
        self.bits.differences(part, &tables, &mut self.current)?;
        if self.bits.is_beyond(part) {
            return Err(SHORT.into());
        }
        let components = header.table_of.len();
        let kept_bits = header.precision - header.point_transform;
        if self.row == 0 || is_restart {
            let middle = 1 << (kept_bits - 1);
            first_row(&mut self.current, components, middle);
        } else {
            next_row(&mut self.current, &self.above, components, header.predictor);
        }
        let all = self.current.iter().fold(0, |all, sample| all | sample);
        if u32::from(all) >> kept_bits != 0 {
            return Err(damaged(format!("has samples of more than its {} bits", header.precision)));
        }
        self.row += 1;
        if header.point_transform == 0 {
            return Ok(&self.current);
        }
        // What is given out is of no use for prediction: it takes the place of the row above, which has served.
        let shift = header.point_transform;
        self.above.clear();
        self.above.extend(self.current.iter().map(|sample| sample << shift));
        Ok(&self.above)
    }
}

/// Adds up the differences of a row that has none above it: each from the sample before it, the first from the middle of
/// the range \[T81, H.1.2.1].
fn first_row(row: &mut [u16], components: usize, middle: u16) {
    row[..components].iter_mut().for_each(|sample| *sample = sample.wrapping_add(middle));
    add_up(row, components);
}

/// Adds to each sample the one of its component before it.
fn add_up(row: &mut [u16], components: usize) {
    match components {
        1 => {
            let mut left = 0u16;
            for sample in row {
                left = left.wrapping_add(*sample);
                *sample = left;
            }
        }
        2 => {
            let mut left = [0u16; 2];
            for pair in row.as_chunks_mut::<2>().0 {
                left = [left[0].wrapping_add(pair[0]), left[1].wrapping_add(pair[1])];
                *pair = left;
            }
        }
        _ => {
            for index in components..row.len() {
                row[index] = row[index].wrapping_add(row[index - components]);
            }
        }
    }
}

/// Adds up the differences of a row from what is predicted by the neighbors: a to the left, b above, c above a; the first
/// from the one above \[T81, Table H.1].
fn next_row(row: &mut [u16], above: &[u16], components: usize, predictor: u8) {
    for (sample, above) in row[..components].iter_mut().zip(above) {
        *sample = sample.wrapping_add(*above);
    }
    match predictor {
        1 => add_up(row, components),
        2 => row.iter_mut().zip(above).skip(components).for_each(|(sample, b)| *sample = sample.wrapping_add(*b)),
        3 => row[components..].iter_mut().zip(above).for_each(|(sample, c)| *sample = sample.wrapping_add(*c)),
        4 => predict(row, above, components, |a, b, c| a + b - c),
        5 => predict(row, above, components, |a, b, c| a + ((b - c) >> 1)),
        6 => predict(row, above, components, |a, b, c| b + ((a - c) >> 1)),
        _ => predict(row, above, components, |a, b, _| (a + b) >> 1),
    }
}

fn predict(row: &mut [u16], above: &[u16], components: usize, by: impl Fn(i32, i32, i32) -> i32) {
    for index in components..row.len() {
        let (left, upper) = (row[index - components], [above[index], above[index - components]]);
        let [b, c] = upper.map(i32::from);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "arithmetic modulo 2^16")]
        let predicted = by(left.into(), b, c) as u16;
        row[index] = row[index].wrapping_add(predicted);
    }
}

//! Tables of spectra as CSV, plain or gzipped.
//!
//! Lines that start with `#` are comments. Two layouts are read: a column of wavelengths in nm and one column per curve,
//! or one row per spectrum under a header of wavelengths.

use super::foreign::csv_complaint;
use crate::error::{Error, Result};
use crate::spectrum::{Curve, check_wavelengths};
use crate::units::RadianceUnit;
use csv::StringRecord;
use flate2::read::GzDecoder;
use ndarray::Array2;
use std::borrow::Cow;
use std::io::Read;

/// A table may unpack to this much.
const MAX_BYTES: u64 = 256 << 20;
/// A table may have this many numbers: 256 MiB of them.
const MAX_CELLS: usize = 1 << 25;

/// Reads one column of a table of any kind as text; `name` is the file in messages.
///
/// # Errors
///
/// [`Error::Format`] for what is no CSV table, or has no such column, naming those that there are.
pub fn text_column(name: &str, bytes: &[u8], column: &str) -> Result<Vec<String>> {
    let not_csv = |error: csv::Error| csv_complaint(name, &error);
    let mut reader = reader(bytes, true);
    let headers = reader.headers().map_err(not_csv)?;
    let place = headers.iter().position(|header| header == column).ok_or_else(|| {
        let known: Vec<&str> = headers.iter().collect();
        Error::format(name, format!("it has no column `{column}`; it has {}", known.join(", ")))
    })?;
    reader.records().map(|record| record.map(|row| row[place].to_owned()).map_err(not_csv)).collect()
}

/// Curves over common wavelengths.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralTable {
    name: String,
    /// Wavelengths in nm, ascending.
    pub wavelength_nm: Vec<f64>,
    /// Names of the curves.
    pub columns: Vec<String>,
    /// Values, shape curves × wavelengths.
    pub values: Array2<f64>,
}

impl SpectralTable {
    /// Reads a table; `name` is the file in messages.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] naming line and column of what is no number, or what the table lacks.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self> {
        let refuse = |problem: &str| Err(Error::format(name, problem));
        let bytes = unpacked(name, bytes)?;
        if bytes.contains(&0) {
            return refuse("it is not a CSV table but a binary file");
        }
        let mut reader = reader(&bytes, false);
        let mut first = StringRecord::new();
        if !reader.read_record(&mut first).map_err(|e| csv_complaint(name, &e))? {
            return refuse("it holds no rows");
        }
        let has_header = number(&first[0]).is_none();
        let by_rows = has_header && first.len() > 2 && first.iter().skip(1).all(|cell| number(cell).is_some());
        let Cells { numbers, labels } = Cells::read(name, &mut reader, (!has_header).then_some(&first), by_rows)?;
        let (rows, width) = numbers.dim();
        if width < 2 || rows == 0 {
            return refuse("it needs a column of wavelengths in nm and at least one of values");
        }
        let values = numbers.slice(ndarray::s![.., 1..]);
        let (wavelength_nm, columns, values) = if by_rows {
            (first.iter().skip(1).filter_map(number).collect(), labels, values.to_owned())
        } else {
            let columns = match has_header {
                true => first.iter().skip(1).map(ToOwned::to_owned).collect(),
                false => (1..width).map(|column| format!("column{column}")).collect(),
            };
            (numbers.column(0).to_vec(), columns, values.t().to_owned())
        };
        check_wavelengths(&wavelength_nm).map_err(|problem| Error::format(name, problem))?;
        Ok(Self { name: name.into(), wavelength_nm, columns, values })
    }

    /// The file as messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The place of a column; the first, where none is named.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] naming the columns that there are.
    pub fn column_index(&self, column: Option<&str>) -> Result<usize> {
        let Some(column) = column else { return Ok(0) };
        self.columns.iter().position(|name| name == column).ok_or_else(|| {
            let some: Vec<&str> = self.columns.iter().take(8).map(String::as_str).collect();
            Error::Usage(format!("{}: there is no column `{column}`; it has {}", self.name, some.join(", ")))
        })
    }

    /// A column as a curve.
    ///
    /// # Errors
    ///
    /// As [`Self::column_index`], and [`Error::Format`] for values that make no curve.
    pub fn curve(&self, column: Option<&str>) -> Result<Curve> {
        let index = self.column_index(column)?;
        Curve::new(self.wavelength_nm.clone(), self.values.row(index).to_vec())
            .map_err(|problem| Error::format(&self.name, problem))
    }

    /// The unit of radiance that a column's name ends with, such as `radiance_w_per_m2_sr_nm`.
    pub fn unit_of(&self, index: usize) -> Option<RadianceUnit> {
        let lower = self.columns.get(index)?.to_ascii_lowercase();
        [
            ("_mw_per_m2_sr_nm", RadianceUnit::MwPerM2SrNm),
            ("_uw_per_cm2_sr_nm", RadianceUnit::UwPerCm2SrNm),
            ("w_per_cm2_sr_nm", RadianceUnit::WPerCm2SrNm),
            ("w_per_m2_sr_nm", RadianceUnit::WPerM2SrNm),
            ("w_per_m2_sr_um", RadianceUnit::WPerM2SrUm),
        ]
        .into_iter()
        .find_map(|(suffix, unit)| lower.ends_with(suffix).then_some(unit))
    }
}

/// A table's rows below its header.
struct Cells {
    /// Shape rows × columns; 0 where a row's label is no number.
    numbers: Array2<f64>,
    /// What the rows begin with, where they have labels.
    labels: Vec<String>,
}

impl Cells {
    /// Reads the rows, after `first` where that is one; each begins with a label where the table goes `by_rows`.
    fn read(name: &str, reader: &mut csv::Reader<&[u8]>, first: Option<&StringRecord>, by_rows: bool) -> Result<Self> {
        let refuse = |problem: String| Error::format(name, problem);
        let (mut numbers, mut labels, mut rows, mut width) = (Vec::new(), Vec::new(), 0, 0);
        let mut record = first.cloned().unwrap_or_default();
        let mut at_hand = first.is_some();
        // One row at a time: as text a table takes many times the memory of its numbers.
        while std::mem::take(&mut at_hand) || reader.read_record(&mut record).map_err(|e| csv_complaint(name, &e))? {
            let line = record.position().map_or(0, csv::Position::line);
            (rows, width) = (rows + 1, record.len());
            if numbers.len() + width > MAX_CELLS {
                return Err(refuse(format!("it has more than {MAX_CELLS} numbers; no table has")));
            }
            if by_rows {
                labels.push(record[0].to_owned());
            }
            for (column, text) in record.iter().enumerate() {
                numbers.push(match number(text) {
                    Some(value) => value,
                    // The label of a row need not be a number.
                    None if by_rows && column == 0 => 0.0,
                    None => {
                        let shown: String = text.chars().take(20).collect();
                        return Err(refuse(format!("line {line}, column {}: `{shown}` is no number", column + 1)));
                    }
                });
            }
        }
        let numbers =
            Array2::from_shape_vec((rows, width), numbers).map_err(|_| refuse("its rows differ in length".into()))?;
        Ok(Self { numbers, labels })
    }
}

/// A reader of CSV that knows our comments; a byte order mark is passed over.
fn reader(bytes: &[u8], has_headers: bool) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .has_headers(has_headers)
        .trim(csv::Trim::All)
        .from_reader(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes))
}

/// A finite number, if it is one.
fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// The bytes of a table that may be gzipped.
fn unpacked<'a>(name: &str, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>> {
    if !bytes.starts_with(&[0x1F, 0x8B]) {
        return Ok(bytes.into());
    }
    let mut unpacked = Vec::new();
    let unpack = GzDecoder::new(bytes).take(MAX_BYTES + 1).read_to_end(&mut unpacked);
    unpack.map_err(|error| Error::format(name, format!("it is gzipped, but damaged: {error}")))?;
    if unpacked.len() as u64 > MAX_BYTES {
        return Err(Error::format(name, "it unpacks to more than 256 MiB; no table does"));
    }
    Ok(unpacked.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    #[test]
    fn both_layouts_give_the_same_curves() {
        let by_columns = SpectralTable::parse("a", b"# sky\nwavelength_nm,a,b\n400,1,2\n410,3,4\n").unwrap();
        let by_rows = SpectralTable::parse("b", b"id,400,410\nx,1,3\ny,2,4\n").unwrap();
        assert_eq!(by_columns.values, by_rows.values);
        assert_eq!(by_columns.wavelength_nm, by_rows.wavelength_nm);
        assert_eq!(by_rows.columns, ["x", "y"]);
        assert_eq!(by_columns.curve(Some("b")).unwrap().at(405.0), 3.0);
    }

    #[test]
    fn complaints_name_the_place() {
        let complaint = |text: &str| SpectralTable::parse("t.csv", text.as_bytes()).unwrap_err().to_string();
        assert_eq!(complaint("nm,L\n400,1\n410,x\n"), "t.csv: line 3, column 2: `x` is no number");
        assert!(complaint("nm,L\n410,1\n400,2\n").contains("must ascend"));
        assert!(complaint("nm,L\n400,nan\n").contains("`nan` is no number"));
        assert!(complaint("").contains("no rows"));
        assert!(complaint("nm,L\n400,1\n410\n").contains("not a CSV table"));
    }

    #[test]
    fn tables_that_blow_up_are_refused() {
        let row = format!("500{}\n", ",1".repeat(1 << 20));
        let complaint = |text: &[u8]| SpectralTable::parse("t", text).unwrap_err().to_string();
        assert!(complaint(row.repeat(33).as_bytes()).contains("more than 33554432 numbers"));
        let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
        for _ in 0..257 {
            packed.write_all(&[b'#'; 1 << 20]).unwrap();
        }
        assert!(complaint(&packed.finish().unwrap()).contains("more than 256 MiB"));
    }

    #[test]
    fn a_column_may_name_its_unit() {
        let table = SpectralTable::parse("a", b"nm,radiance_W_per_m2_sr_nm\n400,1\n").unwrap();
        assert_eq!(table.unit_of(0), Some(RadianceUnit::WPerM2SrNm));
    }
}

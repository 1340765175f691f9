//! The cells of a table: from bytes to text, and from text to numbers.

use super::delimited::{self, Separator, decimal, number};
use super::foreign::{csv_complaint, line_of};
use super::keys;
use super::large::Large;
use super::thousands::{Points, Thousands};
use crate::error::{Error, Result};
use crate::units::WavelengthUnit;
use csv::StringRecord;
use flate2::read::GzDecoder;
use ndarray::Array2;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;

/// A table may unpack to this much.
const MAX_BYTES: u64 = 256 << 20;
/// It may unpack to so many times its size, or to so much however small it is.
const MAX_EXPANSION: u64 = 64;
const SMALL_BYTES: u64 = 16 << 20;
/// A table may have this many numbers: 256 MiB of them.
pub(super) const MAX_CELLS: usize = 1 << 25;
/// A table may have this many columns: as text they take many times the memory of their numbers.
pub(super) const MAX_COLUMNS: usize = 1 << 20;
/// So many curves of a table may hold what is no number.
const MAX_SPOILED: usize = 1 << 12;
/// A table may have this many empty lines, each of which is gone through several times.
const MAX_EMPTY: usize = 1 << 20;

/// A finite number with a decimal point or a decimal comma, if it is one.
pub(super) fn numeric(cell: &str) -> Option<f64> {
    number(cell).or_else(|| decimal(cell))
}

/// A table's rows below its header.
pub(super) struct Cells {
    /// Shape rows × columns; 0 where a row's label is no number, NaN where another cell is none.
    pub(super) numbers: Array2<f64>,
    /// What the rows begin with, where they have labels.
    pub(super) labels: Vec<String>,
    /// The curves, from 0, that have a cell that is no number, and the complaint of the first of these.
    pub(super) spoiled: BTreeMap<usize, String>,
    /// The curves whose points may be marks of thousands.
    pub(super) points: Points,
}

impl Cells {
    /// Reads the rows of `text`, after `first` where that is one; each begins with a label where the table goes `by_rows`. What is no
    /// number spoils its curve alone, where the table has others.
    pub(super) fn read(
        name: &str,
        text: &str,
        reader: &mut csv::Reader<&[u8]>,
        first: Option<&StringRecord>,
        (by_rows, separator): (bool, char),
    ) -> Result<Self> {
        let refuse = |problem: String| Error::format(name, problem);
        let (mut numbers, mut labels, mut rows, mut width) = (Vec::new(), Vec::new(), 0, 0);
        let mut record = first.cloned().unwrap_or_default();
        let mut at_hand = first.is_some();
        let mut spoiled = BTreeMap::new();
        let [mut has_points, mut has_commas] = [false; 2];
        let mut thousands = Thousands::default();
        let mut large = Large::of(by_rows);
        // One row at a time: as text a table takes many times the memory of its numbers.
        while std::mem::take(&mut at_hand)
            || reader.read_record(&mut record).map_err(|e| csv_complaint(name, text, &e))?
        {
            let line = || line_of(text, record.position());
            (rows, width) = (rows + 1, record.len());
            if numbers.len() + width > MAX_CELLS {
                return Err(refuse(format!("it has more than {MAX_CELLS} numbers; no table has")));
            }
            if by_rows {
                labels.push(record[0].to_owned());
            }
            for (column, cell) in record.iter().enumerate() {
                has_points |= cell.contains('.') && number(cell).is_some();
                has_commas |= decimal(cell).is_some();
                let value = numeric(cell);
                if !(by_rows && column == 0) {
                    thousands.take(if by_rows { 1 } else { column }, cell, line);
                }
                let mark = || format!("line {}, column {}{}", line(), column + 1, fills(cell));
                let mut is_value = |value: f64| !is_fill(value) || large.take(value, [rows - 1, column], mark);
                numbers.push(match value.filter(|value| by_rows && column == 0 || is_value(*value)) {
                    Some(value) => value,
                    // The label of a row need not be a number.
                    None if by_rows && column == 0 => 0.0,
                    None => {
                        let what = match (value, column) {
                            (Some(_), _) => fills(cell),
                            (None, 0) => footer(cell).unwrap_or_else(|| not_a_number(cell)),
                            (None, _) => not_a_number(cell),
                        };
                        let problem = format!("line {}, column {}{what}", line(), column + 1);
                        let curve = if by_rows { Some(rows - 1) } else { column.checked_sub(1) };
                        let Some(curve) = curve.filter(|_| spoiled.len() < MAX_SPOILED) else {
                            return Err(refuse(problem));
                        };
                        spoiled.entry(curve).or_insert(problem);
                        f64::NAN
                    }
                });
            }
        }
        if has_points && has_commas {
            return Err(refuse("its numbers have decimal points and decimal commas; write all with a point".into()));
        }
        thousands.check(name, separator)?;
        let mut numbers =
            Array2::from_shape_vec((rows, width), numbers).map_err(|_| refuse("its rows differ in length".into()))?;
        large.judge(&mut numbers, &mut spoiled).map_err(refuse)?;
        let curves = if by_rows { rows } else { width.saturating_sub(1) };
        match spoiled.first_key_value() {
            Some((_, problem)) if spoiled.len() == curves => Err(refuse(problem.clone())),
            _ => Ok(Self { numbers, labels, spoiled, points: thousands.points(separator, by_rows) }),
        }
    }
}

impl Cells {
    /// The same without the first column, where what follows it are wavelengths.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for a wavelength that is no number.
    pub(super) fn without_first(self, name: &str) -> Result<Self> {
        if let Some(problem) = self.spoiled.get(&0) {
            return Err(Error::format(name, problem.clone()));
        }
        let numbers = self.numbers.slice(ndarray::s![.., 1..]).to_owned();
        let spoiled = self.spoiled.into_iter().map(|(curve, problem)| (curve - 1, problem)).collect();
        Ok(Self { numbers, labels: self.labels, spoiled, points: self.points.without_first() })
    }
}

/// What to do about a number with marks of thousands, `1.234,5`, `1,234.5` or `1'234`; nothing of another cell.
pub(super) fn thousands(cell: &str) -> Option<String> {
    let unsigned = cell.strip_prefix(['+', '-']).unwrap_or(cell);
    let mark = unsigned.chars().find(|c| !c.is_ascii_digit()).filter(|c| ",.'’ \u{a0}\u{2009}\u{202f}".contains(*c))?;
    let groups: Vec<&str> = unsigned.split(mark).collect();
    let (last, decimals) = match groups.last()?.split_once([',', '.']) {
        Some((last, decimals)) => (last, Some(decimals)),
        None => (*groups.last()?, None),
    };
    let are_digits = |text: &str, lengths: std::ops::RangeInclusive<usize>| {
        lengths.contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit())
    };
    let between = &groups[1..groups.len() - 1];
    let is_so = are_digits(groups[0], 1..=3)
        && between.iter().chain([&last]).all(|group| are_digits(group, 3..=3))
        && decimals.is_none_or(|decimals| are_digits(decimals, 0..=40))
        // One point or comma alone is that of decimals.
        && (groups.len() > 2 || decimals.is_some() || !",.".contains(mark));
    let plain: String =
        cell.chars().take_while(|c| "+-".contains(*c)).chain(groups[..groups.len() - 1].concat().chars()).collect();
    let decimals =
        decimals.filter(|decimals| !decimals.is_empty()).map_or(String::new(), |decimals| format!(".{decimals}"));
    is_so.then(|| format!("`{cell}` has marks of thousands; write it as {plain}{last}{decimals}, and so all numbers"))
}

/// Whether a number is one that other programs put where they have no value: as people choose it, and as NetCDF fills what is not written.
fn is_fill(value: f64) -> bool {
    /// Of NetCDF's floats people write as few digits as three.
    const NETCDF: f64 = 9.969_209_968_386_869e36;
    const ROUNDED: f64 = 2e-3;
    const CHOSEN: [f64; 16] = [
        -99.0,
        -999.0,
        -9999.0,
        -99_999.0,
        -999_999.0,
        -99.9,
        -999.9,
        -9999.9,
        -999.99,
        // Above and below what an instrument detects, in files of ICARTT.
        -7777.0,
        -77_777.0,
        -8888.0,
        -88_888.0,
        -32_767.0,
        -32_768.0,
        -2_147_483_647.0,
    ];
    /// Too large for any light, above zero or below.
    const LARGE: [f64; 7] = [1e15, 1e20, 1e30, 1e31, 1e34, 1e35, 1e36];
    let is_chosen = CHOSEN.contains(&value) || LARGE.contains(&-value) || LARGE.contains(&value) && value != 1e34;
    let is_near = |large: f64| (value.abs() / large - 1.0).abs() < ROUNDED;
    is_chosen || value == -1.23e34 || is_near(NETCDF) || is_near(f64::from(f32::MAX))
}

/// What is said of a cell with such a number.
fn fills(cell: &str) -> String {
    format!(": `{cell}` marks a value that is missing; leave out its row, or fill it in")
}

/// What is said of the first cell of a row that is none of the table but a sum or a mean of it, or a note below it.
fn footer(text: &str) -> Option<String> {
    /// What people and spreadsheets call rows that are made of all others.
    const TOTALS: [&str; 26] = [
        "sum",
        "total",
        "subtotal",
        "mean",
        "average",
        "avg",
        "median",
        "min",
        "minimum",
        "max",
        "maximum",
        "std",
        "stdev",
        "stddev",
        "sd",
        "count",
        "integral",
        "summe",
        "gesamt",
        "mittelwert",
        "mittel",
        "somme",
        "moyenne",
        "suma",
        "media",
        "ergebnis",
    ];
    let words: Vec<&str> = text.split_whitespace().collect();
    let shown: String = text.chars().take(20).collect();
    let first = words.first()?.trim_end_matches([':', '.', '=']).to_lowercase();
    if TOTALS.contains(&first.as_str()) {
        return Some(format!(": `{shown}` is no number but a sum or a mean of other rows; leave out its row"));
    }
    // `400 nm` is a number with a mistake.
    let is_note = words.len() > 1 && text.starts_with(char::is_alphabetic) || words.len() == 1 && text.ends_with(':');
    is_note.then(|| format!(": `{shown}` is no number; put a # before its line if it is a note"))
}

/// What is wrong with a cell, and what to do where it stands for a value that is missing.
pub(super) fn not_a_number(text: &str) -> String {
    const MISSING: [&str; 10] = ["nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "inf", "-inf"];
    let shown: String = text.chars().take(20).collect();
    if let Some(said) = thousands(text) {
        return format!(": {said}");
    }
    // `#DIV/0!`, `#WERT!`: errors of a spreadsheet.
    let is_error = text.starts_with('#') && text.len() > 2;
    match is_error || MISSING.contains(&text.to_lowercase().as_str()) {
        true => format!(": `{shown}` is no number; leave out the row of a missing value, or fill it in"),
        false if text.split('|').filter(|part| numeric(part.trim()).is_some()).count() > 1 => {
            format!(": `{shown}` is no number; commas, semicolons, tabs or blanks part cells, no `|`")
        }
        false if text.is_empty() => " is empty; leave out the row of a missing value, or fill it in".into(),
        false => {
            format!(": `{shown}` is no number{}", as_meant(text).map_or(String::new(), |said| format!("; {said}")))
        }
    }
}

/// What to write instead of a number as people print it; nothing where that is not plain.
fn as_meant(text: &str) -> Option<String> {
    /// What no number that people write is longer than.
    const LONGEST: usize = 40;
    if text.len() > LONGEST || !text.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    // Two cells that nothing parts are no number.
    if text.split_whitespace().filter(|part| numeric(part).is_some()).count() > 1 {
        return None;
    }
    // A minus or a power of ten as it is typeset.
    let plain = text.replace(['−', '–'], "-").replace(char::is_whitespace, "");
    let plain = ["x10^", "×10^", "*10^", "·10^"].into_iter().fold(plain, |text, power| text.replacen(power, "e", 1));
    if numeric(&plain).is_some() {
        return Some(format!("write {plain}"));
    }
    let is_number = |part: &str| numeric(part.trim()).is_some();
    if text
        .split_once('±')
        .or_else(|| text.split_once("+-"))
        .or_else(|| text.split_once("+/-"))
        .is_some_and(|(a, _)| is_number(a))
    {
        return Some("write the number alone, and how sure it is in a column of its own".into());
    }
    if text.split_once(['-', '–']).is_some_and(|(from, to)| is_number(from) && is_number(to)) {
        return Some("write the middle of an interval".into());
    }
    let unit = text.trim_start_matches(|c: char| c.is_ascii_digit() || ".,+-".contains(c));
    let is_unit = matches!(WavelengthUnit::of_heading(unit.trim()), Ok(Some(_)));
    let number = &text[..text.len() - unit.len()];
    (is_unit && is_number(number)).then(|| format!("write {number}, and the unit in the heading"))
}

/// A table as text.
pub(super) struct Text<'a> {
    pub(super) decoded: Cow<'a, str>,
    /// Its rows in the form that readers take, where they are in another.
    plain: Option<String>,
    separator: Separator,
}

impl<'a> Text<'a> {
    /// The text of a table; `is_of_numbers` where separators behind the last cell of a row mean nothing.
    pub(super) fn of(name: &str, bytes: &'a [u8], is_of_numbers: bool) -> Result<Self> {
        let decoded = delimited::decoded(name, bytes)?;
        // Before any line is looked at closely, and any cell told apart: each row is held as a whole.
        check_size(name, &decoded)?;
        if let Some(what) = what_else(&decoded) {
            return Err(Error::format(name, format!("it is {what}")));
        }
        if decoded.contains('\0') {
            return Err(Error::format(name, "it is not a CSV table but a binary file"));
        }
        if let Some(kind) = keys::kind_of(&decoded) {
            return Err(Error::format(name, format!("it is {kind}; a table is wanted here, as CSV")));
        }
        let separator = Separator::of(&decoded, is_of_numbers);
        let plain = delimited::plain(name, &decoded, separator, is_of_numbers)?;
        Ok(Self { decoded, plain, separator })
    }

    pub(super) fn rows(&self) -> &str {
        self.plain.as_deref().unwrap_or(&self.decoded)
    }

    /// The character that parts the cells of its rows.
    pub(super) fn separator(&self) -> char {
        self.separator.byte().into()
    }

    /// A reader of its rows.
    pub(super) fn reader(&self, has_headers: bool) -> csv::Reader<&[u8]> {
        csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .delimiter(self.separator.byte())
            .has_headers(has_headers)
            .trim(csv::Trim::All)
            .from_reader(self.rows().as_bytes())
    }

    /// Whether commas may be those of decimals as well as part columns: without a header, and with no other mark of decimals.
    pub(super) fn is_ambiguous(&self, first: &StringRecord) -> bool {
        self.separator == Separator::Byte(b',')
            && first.len() > 2
            && first.iter().all(|cell| !cell.is_empty() && cell.bytes().all(|byte| byte.is_ascii_digit()))
            && !self.rows().lines().any(|line| !line.starts_with('#') && line.contains('.'))
    }
}

/// What a text is, by how it begins, that is no table.
fn what_else(text: &str) -> Option<&'static str> {
    const BEGINNINGS: [(&str, &str); 4] = [
        ("PK\u{3}\u{4}", "a spreadsheet or another archive (ZIP); a table is wanted here: save its sheet as CSV"),
        ("%PDF-", "a PDF; a table is wanted here, as CSV"),
        ("<", "a page of HTML or XML; a table is wanted here, as CSV"),
        ("{", "JSON; a table is wanted here, as CSV"),
    ];
    let text = text.trim_start();
    BEGINNINGS.iter().find(|(begin, _)| text.starts_with(begin)).map(|(_, what)| *what)
}

/// Refuses a text of more cells, of more in a line, or of more lines that say nothing, than any table has, whatever parts them.
///
/// # Errors
///
/// [`Error::Format`].
pub(super) fn check_size(name: &str, text: &str) -> Result<()> {
    let (mut all, mut widest, mut empty) = (0, 0, 0);
    for line in text.as_bytes().split(|byte| *byte == b'\n') {
        if line.trim_ascii().is_empty() {
            empty += 1;
            continue;
        }
        let parted_by = |mark: u8| line.iter().filter(|byte| **byte == mark).count();
        let blanks = line.windows(2).filter(|pair| pair[0] == b' ' && pair[1] != b' ').count();
        let cells = b",;\t".map(parted_by).into_iter().fold(blanks, usize::max);
        all += cells + 1;
        widest = widest.max(cells);
        if all >= MAX_CELLS {
            break;
        }
    }
    let refuse =
        |most: usize, what: &str| Err(Error::format(name, format!("it has more than {most} {what}; no table has")));
    match () {
        () if all >= MAX_CELLS => refuse(MAX_CELLS, "numbers"),
        () if widest >= MAX_COLUMNS => refuse(MAX_COLUMNS, "columns"),
        () if empty > MAX_EMPTY => refuse(MAX_EMPTY, "empty lines"),
        () => Ok(()),
    }
}

/// The bytes of a table that may be gzipped.
pub(super) fn unpacked<'a>(name: &str, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>> {
    if !bytes.starts_with(&[0x1F, 0x8B]) {
        return Ok(bytes.into());
    }
    // What many times the file comes of is no table: of numbers a few times as much.
    let most = (bytes.len() as u64 * MAX_EXPANSION).clamp(SMALL_BYTES, MAX_BYTES);
    let mut unpacked = Vec::new();
    let unpack = GzDecoder::new(bytes).take(most + 1).read_to_end(&mut unpacked);
    unpack.map_err(|error| Error::format(name, format!("it is gzipped, but damaged: {error}")))?;
    if unpacked.len() as u64 > most {
        return Err(Error::format(
            name,
            format!("it unpacks to more than {} MiB; no table of its size does", most >> 20),
        ));
    }
    Ok(unpacked.into())
}

#[cfg(test)]
mod tests {
    use crate::formats::csv::SpectralTable;

    fn complaint(text: &str) -> String {
        SpectralTable::parse("t", text.as_bytes()).map_or_else(|error| error.to_string(), |_| "read".into())
    }

    #[test]
    fn numbers_for_what_is_missing_are_told() {
        for fill in
            ["-7777", "-8888", "-8888.0", "-88888", "-1.23E34", "-1.23e+34", "-1e31", "-3.4028235e38", "3.40282e38"]
        {
            let wanted = format!(
                "t: line 3, column 2: `{fill}` marks a value that is missing; leave out its row, or fill it in"
            );
            assert_eq!(complaint(&format!("nm,L\n400,0.5\n410,{fill}\n")), wanted);
        }
        for value in ["-777", "-888", "7777", "8888", "1.23e34", "1e34", "-7777.5"] {
            assert_eq!(complaint(&format!("nm,L\n400,0.5\n410,{value}\n")), "read", "{value}");
        }
    }

    #[test]
    fn numbers_as_they_are_printed_are_told() {
        for (cell, wanted) in [
            ("−0.5", "; write -0.5"),
            ("1.0 E-01", "; write 1.0E-01"),
            ("1.0x10^-1", "; write 1.0e-1"),
            ("1.2 × 10^-3", "; write 1.2e-3"),
            ("0.5nm", "; write 0.5, and the unit in the heading"),
            ("0.5±0.1", "; write the number alone, and how sure it is in a column of its own"),
            ("0.4-0.6", "; write the middle of an interval"),
            ("O.5", ""),
            ("<0.5", ""),
            ("0.5x", ""),
            ("5OO", ""),
            ("0.5 0.6", ""),
        ] {
            let wanted = format!("t: line 3, column 2: `{cell}` is no number{wanted}");
            assert_eq!(complaint(&format!("nm,L\n400,0.5\n410,{cell}\n420,1\n")), wanted);
        }
    }

    #[test]
    fn what_stands_below_a_table_is_told() {
        let total = "is no number but a sum or a mean of other rows; leave out its row";
        let note = "is no number; put a # before its line if it is a note";
        for (row, wanted) in [
            ("Sum,0.5", format!("`Sum` {total}")),
            ("Mean:,0.5", format!("`Mean:` {total}")),
            ("Average of all,0.5", format!("`Average of all` {total}")),
            ("Mittelwert,0.5", format!("`Mittelwert` {total}")),
            ("Notes: by me,at noon", format!("`Notes: by me` {note}")),
            ("Remark:,clear", format!("`Remark:` {note}")),
            ("41O,0.5", "`41O` is no number".into()),
            ("410 nm,0.5", "`410 nm` is no number; write 410, and the unit in the heading".into()),
            ("#DIV/0!,0.5", "read".into()),
        ] {
            let found = complaint(&format!("nm,L\n400,0.5\n405,0.5\n{row}\n"));
            let place = if wanted == "read" { String::new() } else { "t: line 4, column 1: ".into() };
            assert_eq!(found, format!("{place}{wanted}"));
        }
        for error in ["#DIV/0!", "#WERT!", "#N/A"] {
            let wanted = format!(
                "t: line 3, column 2: `{error}` is no number; leave out the row of a missing value, or fill it in"
            );
            assert_eq!(complaint(&format!("nm,L\n400,0.5\n405,{error}\n")), wanted);
        }
        assert!(
            complaint("nm|L\n400|0.5\n405|0.5\n").ends_with("commas, semicolons, tabs or blanks part cells, no `|`")
        );
        // A spectrum of a library may be called so.
        assert_eq!(complaint("name,400,410\na,1,2\nMean,1,2\n"), "read");
    }
}

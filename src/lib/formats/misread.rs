//! What a text is that is read as no table of spectra, or as another than was meant: a slip of the pen in its first row, lines above
//! its heading, another program's form.

use super::cells::{check_size, not_a_number, numeric, thousands};
use super::delimited::{self, Separator, number};
use super::foreign::line_of;
use super::keys;
use super::spectral_heading::{holds_wavelengths, is_of_wavelengths, names_wavelengths};
use crate::error::{Error, Result};
use crate::spectrum::SHORTEST_NM;
use crate::units::{WavelengthUnit, unit_of_heading};
use csv::StringRecord;
use ndarray::Array2;

/// Columns that uvspec writes by default behind that of wavelengths: irradiances and mean intensities, direct, down and up.
pub(super) const UVSPEC: [&str; 6] = ["edir", "edn", "eup", "uavgdir", "uavgdn", "uavgup"];
/// What is said of a table that has as many.
pub(super) const LIKE_UVSPEC: &str = "its seven columns without a heading look like what libRadtran's uvspec writes by default, \
                                      irradiances and mean intensities (edir, edn, eup, uavgdir, uavgdn, uavgup); have it write radiances, by \
                                      `output_user lambda uu`";

/// Above this all wavelengths look like angstroms or wavenumbers, in nm: no silicon responds.
pub(super) const LONGEST_NM: f64 = 2000.0;

/// Refuses a first row that is no heading but one of numbers with a mistake: as a heading it would be lost without a word.
///
/// # Errors
///
/// [`Error::Format`] naming line and column.
pub(super) fn check_heading(name: &str, text: &str, first: &StringRecord, comments: &[&str]) -> Result<()> {
    let line = || line_of(text, first.position());
    let refuse = |column: usize| {
        let line = line();
        let wrong = not_a_number(&first[column]);
        let hint = "its line looks like one of numbers (a heading begins with a word such as `wavelength_nm`)";
        Err(Error::format(name, format!("line {line}, column {}{wrong}; {hint}", column + 1)))
    };
    let others: Vec<(usize, &str)> = first.iter().enumerate().skip(1).filter(|(_, cell)| !cell.is_empty()).collect();
    let numbers: Vec<f64> = others.iter().filter_map(|(_, cell)| numeric(cell)).collect();
    let corner = &first[0];
    if numbers.is_empty() || 2 * numbers.len() < others.len() {
        return Ok(());
    }
    let goes_one_way = numbers.is_sorted() || numbers.iter().rev().is_sorted();
    let are_wavelengths = numbers.len() > 1 && goes_one_way && numbers.iter().all(|number| *number >= SHORTEST_NM);
    // A heading behind a `#` is a comment, and the row below it none.
    let is_headed = comments.iter().any(|comment| {
        let cells: Vec<&str> = comment.split([',', ';', '\t']).map(str::trim).collect();
        cells.len() == first.len() && names_wavelengths(cells[0])
    });
    let strange = others.iter().find(|(_, cell)| numeric(cell).is_none());
    match strange {
        Some((column, cell)) if are_wavelengths && !names_wavelengths(corner) && !is_mistyped_number(cell) => {
            let problem = format!(
                "line {}, column {}: `{cell}` is no wavelength, as the others are; leave the column out: one name stands before the \
                 values of each row",
                line(),
                column + 1
            );
            Err(Error::format(name, problem))
        }
        // One of the wavelengths of a heading.
        Some((column, _)) if are_wavelengths && !names_wavelengths(corner) => refuse(*column),
        _ if are_wavelengths => Ok(()),
        _ if is_mistyped_number(corner) => refuse(0),
        _ if is_headed => refuse(0),
        _ if names_wavelengths(corner) => Ok(()),
        // `x,0.52`: no column is called so, as one may be called by an angle.
        None if numbers.len() == 1 && others[0].1.contains(['.', ',', 'e', 'E']) => refuse(0),
        _ => Ok(()),
    }
}

/// Whether a cell that is no number looks as if it should be one: it begins as one, most of it are digits, or a wavelength stands in
/// it.
fn is_mistyped_number(cell: &str) -> bool {
    let runs = cell.split(|c: char| !c.is_ascii_digit());
    let holds_wavelength = runs.filter_map(numeric).any(|number| (SHORTEST_NM..LONGEST_NM).contains(&number));
    let unsigned = cell.trim_start_matches(['+', '-', '−', '.']);
    let digits = cell.chars().filter(char::is_ascii_digit).count();
    unsigned.starts_with(|c: char| c.is_ascii_digit()) || 2 * digits > cell.chars().count() || holds_wavelength
}

/// Whether a record below the header holds units: that of wavelengths, and, below what is no heading of wavelengths, nothing but
/// units behind it, so that a title is told from a heading.
pub(super) fn is_units(header: &StringRecord, record: &StringRecord) -> bool {
    let is_unit = |cell: &str| {
        ["", "-", "--", "–", "none"].contains(&cell)
            || unit_of_heading(cell).is_some()
            || unit_of_heading(&format!("({cell})")).is_some()
    };
    // Behind a column that counts rows.
    let is_second = header.len() > 2 && !names_wavelengths(&header[0]) && header.get(1).is_some_and(is_of_wavelengths);
    let place = usize::from(is_second);
    // `340 nm` is a wavelength.
    let is_value = |cell: &str| cell.starts_with(|c: char| c.is_ascii_digit());
    record.iter().all(|cell| numeric(cell).is_none())
        && !record.get(place).is_some_and(is_value)
        && !matches!(WavelengthUnit::of_heading(record.get(place).unwrap_or_default()), Ok(None))
        && (header.get(place).is_some_and(names_wavelengths) || record.iter().skip(1).all(is_unit))
}

/// Refuses numbers that are too few for a table, or rows of spectra without a heading that says so.
///
/// # Errors
///
/// [`Error::Format`].
pub(super) fn check_shape(name: &str, numbers: &Array2<f64>, has_header: bool) -> Result<()> {
    let refuse = |problem: &str| Err(Error::format(name, problem));
    if numbers.ncols() < 2 || numbers.nrows() == 0 {
        return refuse("it needs a column of wavelengths in nm and at least one of values");
    }
    if !has_header && holds_rows_without_names(numbers) {
        return refuse(
            "its first row holds wavelengths, and its rows are spectra without names; begin each with a name, and the first \
             with a word, as in `name,400,410`",
        );
    }
    Ok(())
}

/// Whether numbers without a heading are a row of wavelengths above spectra: the first goes one way and is that of wavelengths, the
/// first of all others are not.
fn holds_rows_without_names(numbers: &Array2<f64>) -> bool {
    /// So many values of a wavelength are no wavelengths themselves that go evenly, or are those of two wavelengths alone.
    const MANY: usize = 8;
    /// Of a step, what whole nanometers, or tenths, are rounded by.
    const ROUNDING: f64 = 1e-6;
    let (first, below) = (numbers.row(0), numbers.slice(ndarray::s![1.., 0]));
    let ordered = |is_so: fn(&f64, &f64) -> bool| first.iter().zip(first.iter().skip(1)).all(|(a, b)| is_so(a, b));
    let is_light = first.iter().all(|nm| (SHORTEST_NM..=MOST_NM).contains(nm));
    let is_even = || {
        let step = first[1] - first[0];
        first.iter().zip(first.iter().skip(1)).all(|(a, b)| ((b - a) / step - 1.0).abs() < ROUNDING)
    };
    let are_unlike = || below.iter().all(|value| *value < SHORTEST_NM);
    first.len() > 2
        && !below.is_empty()
        && (ordered(|a, b| a < b) || ordered(|a, b| a > b))
        && first.iter().all(|nm| *nm >= SHORTEST_NM)
        && (are_unlike() || is_light && first.len() >= MANY && (is_even() || below.len() == 1))
}

/// What a camera sees ends far below.
const MOST_NM: f64 = 5000.0;

/// Whether curves go with each other as those of uvspec do: the direct irradiance is 4π times the cosine of the sun's angle times the direct
/// mean intensity, the same at all wavelengths, or both are 0.
pub(super) fn holds_direct_light(values: &Array2<f64>) -> bool {
    /// uvspec prints seven digits.
    const ROUNDING: f64 = 1e-4;
    if values.nrows() != UVSPEC.len() || values.ncols() < 2 {
        return false;
    }
    let (edir, uavgdir) = (values.row(0), values.row(3));
    let mut ratios = edir.iter().zip(uavgdir).filter(|(a, b)| **a != 0.0 || **b != 0.0).map(|(a, b)| a / b);
    let most = 4.0 * std::f64::consts::PI * (1.0 + ROUNDING);
    ratios
        .next()
        .is_none_or(|first| (0.0..=most).contains(&first) && ratios.all(|ratio| (ratio / first - 1.0).abs() < ROUNDING))
}

/// What a text is that was read as no table, where that can be told.
pub(super) fn explained(name: &str, bytes: &[u8]) -> Option<Error> {
    let decoded = delimited::decoded(name, bytes).ok()?;
    // What is longer than any table is not gone through again.
    check_size(name, &decoded).ok()?;
    if decoded.contains('\0') || keys::kind_of(&decoded).is_some() {
        return None;
    }
    uvspec(name, &decoded)
        .or_else(|| tape7(name, &decoded))
        .or_else(|| marks_of_thousands(name, &decoded))
        .or_else(|| above_named_columns(name, &decoded))
        .or_else(|| preamble(name, &decoded))
}

/// A complaint of the first row of numbers of which one has marks of thousands, whatever parts them.
fn marks_of_thousands(name: &str, text: &str) -> Option<Error> {
    let of_row = |line: &str| -> Option<String> {
        [&['\t'][..], &[';'], &[' ', '\t']].into_iter().find_map(|separators| {
            let cells: Vec<&str> = line.split(separators).map(str::trim).filter(|cell| !cell.is_empty()).collect();
            let marked = cells.iter().find_map(|cell| thousands(cell));
            let are_numbers = cells.iter().all(|cell| numeric(cell).is_some() || thousands(cell).is_some());
            marked.filter(|_| cells.len() > 1 && are_numbers)
        })
    };
    let (index, said) = text.lines().enumerate().find_map(|(index, line)| Some((index, of_row(line)?)))?;
    Some(Error::format(name, format!("line {}: {said}", index + 1)))
}

/// A complaint of what uvspec writes by default where it is asked for radiances: below each row of irradiances a line of azimuths and
/// a line for each direction.
fn uvspec(name: &str, text: &str) -> Option<Error> {
    /// So many rows are looked at.
    const LOOKED_AT: usize = 16;
    let widths: Vec<Option<usize>> = delimited::rows(text)
        .take(LOOKED_AT)
        .map(|line| line.split_whitespace().map(|cell| number(cell).map(drop)).collect::<Option<Vec<()>>>())
        .map(|cells| cells.map(|cells| cells.len()))
        .collect();
    let usual = Some(UVSPEC.len() + 1);
    let is_so = widths.first() == Some(&usual)
        && widths.iter().all(Option::is_some)
        && widths.iter().any(|width| *width != usual);
    let problem = "it looks like what libRadtran's uvspec writes by default, with lines of directions below each wavelength; have it \
                   write a table of radiances, by `output_user lambda uu` in its input file";
    is_so.then(|| Error::format(name, problem))
}

/// A complaint of a file of MODTRAN as it stands, whose cards and columns of other quantities are none of a table of radiances.
fn tape7(name: &str, text: &str) -> Option<Error> {
    /// So many lines are looked at.
    const LOOKED_AT: usize = 64;
    let is_heading = |line: &str| {
        let upper = line.to_ascii_uppercase();
        let has = |word: &str| upper.contains(word);
        (has("FREQ") || has("WAVLEN")) && (has("TOTAL_RAD") || has("TOTAL RAD") || has("TOT_TRANS") || has("TOT TRANS"))
    };
    let line = text.lines().take(LOOKED_AT).position(is_heading).filter(|line| *line > 0)? + 1;
    let problem = format!(
        "it looks like a tape7 of MODTRAN, with cards above its heading, line {line}; keep the columns FREQ and TOTAL_RAD as a table, \
         headed as `freq (cm-1),radiance (W cm-2 sr-1 / cm-1)`"
    );
    Some(Error::format(name, problem))
}

/// The words of a complaint that begins with the first and the last of some lines, from 1.
fn lines_stand([first, last]: [usize; 2]) -> String {
    if first == last { format!("line {first} stands") } else { format!("lines {first} to {last} stand") }
}

/// What is said of the lines from the first to the last above a heading, all from 1.
fn above_heading([first, last, heading]: [usize; 3]) -> String {
    let lines = lines_stand([first, last]);
    format!("{lines} above the heading of its columns, line {heading}; put a # before what is no table")
}

/// A complaint of lines above a heading whose first column is that of wavelengths, where numbers follow that.
fn above_named_columns(name: &str, text: &str) -> Option<Error> {
    /// So many lines are looked at, where none is longer than people read.
    const LOOKED_AT: usize = 200;
    const LONGEST: usize = 1 << 16;
    const MARKS: [char; 3] = [',', ';', '\t'];
    let mut lines = text.lines().enumerate().take(LOOKED_AT).filter(|(_, line)| {
        let line = line.trim_start();
        !line.is_empty() && !line.starts_with(['#', '%', '!'])
    });
    let (first, _) = lines.clone().next()?;
    let begin = |line: &str| line.split(MARKS).next().unwrap_or_default().trim_matches(['"', ' ']).to_owned();
    let is_heading = |(_, line): &(usize, &str)| line.contains(MARKS) && is_of_wavelengths(&begin(line));
    let (heading, columns) = lines.by_ref().take_while(|(_, line)| line.len() < LONGEST).find(is_heading)?;
    let (_, row) = lines.next()?;
    let are_alike = columns.split(MARKS).count() == row.split(MARKS).count() && numeric(&begin(row)).is_some();
    let last = text.lines().take(heading).enumerate().filter(|(_, line)| !line.trim().is_empty()).last()?.0;
    let problem = || above_heading([first, last, heading].map(|index| index + 1));
    (heading > first && are_alike).then(|| Error::format(name, problem()))
}

/// A complaint of lines that stand above the heading of a table, where there are any but one of units; or of one above numbers that is
/// no heading of theirs.
fn preamble(name: &str, text: &str) -> Option<Error> {
    let is_of_columns = |line: usize| {
        let first = text.lines().nth(line - 1).and_then(|line| line.split([',', ';', '\t', ' ']).next());
        first.is_some_and(is_of_wavelengths)
    };
    let title = delimited::title(text).filter(|([line, ..], _)| !is_of_columns(*line));
    if let Some(([title, cells, columns], separator)) = title {
        // Of words between blanks more is said already.
        if separator == Separator::Blanks {
            return None;
        }
        let cells = if cells == 1 { "1 cell".into() } else { format!("{cells} cells") };
        let problem = format!(
            "line {title} has {cells} above {columns} columns: put a # before it if it is a title, or name each column in it"
        );
        return Some(Error::format(name, problem));
    }
    let [first, last, heading] = delimited::above_heading(text)?;
    let cells = |line: usize| -> Option<StringRecord> {
        Some(text.lines().nth(line - 1)?.split([',', ';', '\t']).map(str::trim).collect())
    };
    if first == last && is_units(&cells(first)?, &cells(heading)?) {
        return None;
    }
    // Where what seems to be the heading stands below one of wavelengths, it is a row with a mistake, which is told by its place.
    let is_heading = |line: usize| {
        let first = |line: &str| {
            line.split([',', ';', '\t', ' ']).map(str::trim).find(|cell| !cell.is_empty()).map(str::to_owned)
        };
        let line = text.lines().nth(line - 1).unwrap_or_default();
        let parts = || line.split([',', ';', '\t']);
        // Values may be taken for wavelengths, but for their order.
        let goes_one_way = || {
            let numbers: Vec<f64> = parts().filter_map(|cell| numeric(cell.trim())).collect();
            numbers.is_sorted() || numbers.iter().rev().is_sorted()
        };
        first(line).is_some_and(|cell| names_wavelengths(&cell))
            || holds_wavelengths(parts()) && goes_one_way()
            || parts().count() > 1 && parts().any(|cell| is_of_wavelengths(cell.trim_matches(['"', ' '])))
    };
    if (first..=last).any(is_heading) && !is_heading(heading) {
        return None;
    }
    // `>>>>>Begin Spectral Data<<<<<` is no heading.
    let problem = match delimited::is_heading(text, heading) {
        true => above_heading([first, last, heading]),
        false => {
            let lines = lines_stand([first, heading]);
            format!("{lines} above its numbers; put a # before what is no table, and behind them too")
        }
    };
    Some(Error::format(name, problem))
}

#[cfg(test)]
mod tests {
    use crate::formats::csv::SpectralTable;

    fn complaint(text: &str) -> String {
        SpectralTable::parse("t", text.as_bytes()).map_or_else(|error| error.to_string(), |_| "read".into())
    }

    #[test]
    fn a_mistake_in_the_first_row_makes_no_heading_of_it() {
        for (text, place) in [
            ("40O,0.5\n410,1\n420,2\n", "line 1, column 1: `40O` is no number"),
            ("# sky\n\n4OO 0.5\n410 1\n", "line 3, column 1: `4OO` is no number"),
            ("O400;0,5\n410;1\n", "line 1, column 1: `O400` is no number"),
            ("400nm,1\n410,2\n", "line 1, column 1: `400nm` is no number"),
            ("400 nm,1\n410,2\n", "line 1, column 1: `400 nm` is no number"),
            ("4.0.0\t1\n410\t2\n", "line 1, column 1: `4.0.0` is no number"),
            (",0.5\n410,1\n", "line 1, column 1 is empty"),
            ("nan,0.5\n410,1\n", "line 1, column 1: `nan` is no number"),
            ("x,5e-6\n410,6e-6\n", "line 1, column 1: `x` is no number"),
            ("40O,0.1,0.2\n410,0.2,0.3\n", "line 1, column 1: `40O` is no number"),
            ("40O,0.1,x\n410,0.2,0.3\n", "line 1, column 1: `40O` is no number"),
            ("400,O.5\n410,1\n", "line 1, column 2: `O.5` is no number"),
            ("id,400,41O,420\n1,1,2,3\n", "line 1, column 3: `41O` is no number"),
            ("# wavelength,radiance\nlambda400,0.1\n410,0.2\n", "line 2, column 1: `lambda400` is no number"),
            ("wl=400nm;0,1\n410;0,2\n", "line 1, column 1: `wl=400nm` is no number"),
            ("# wavelength,radiance\nlambda,30\n410,40\n", "line 2, column 1: `lambda` is no number"),
        ] {
            let found = complaint(text);
            assert!(found.starts_with(&format!("t: {place}")), "{text}: {found}");
        }
        // Names that are numbers, and headings of wavelengths, are none.
        for text in [
            "wavelength,0.5\n400,1\n410,2\n",
            "nm,30\n400,1\n410,2\n",
            "x,30\n400,1\n410,2\n",
            "sza,400,410\n30,1,2\n",
            ",400,410\na,1,2\n",
            "2024-05-01,400,410\na,1,2\n",
            "lambda,a,30\n400,1,2\n410,1,2\n",
        ] {
            assert_eq!(complaint(text), "read", "{text}");
        }
    }

    #[test]
    fn a_mistake_below_a_heading_is_told_by_its_place() {
        for (text, place) in [
            ("wavelength (nm),radiance (W m-2 sr-1 nm-1)\n400,O.1\n500,0.1\n", "line 2, column 2: `O.1` is no number"),
            ("wavelength (nm),L\n4O0,0.1\n500,0.1\n600,0.1\n", "line 2, column 1: `4O0` is no number"),
            ("nm;L\n400;n/a\n500;0,1\n", "line 2, column 2: `n/a` is no number"),
            ("lambda uu\n400 x\n500 0.1\n", "line 2, column 2: `x` is no number"),
            ("wavelength,L\nnm,W/(m2 sr nm)\n400,O.1\n500,0.1\n", "line 3, column 2: `O.1` is no number"),
        ] {
            assert!(complaint(text).starts_with(&format!("t: {place}")), "{text}: {}", complaint(text));
        }
    }

    /// Which mark is that of decimals is plain where both stand, and yet no reader of ours guesses.
    #[test]
    fn marks_of_thousands_are_told() {
        for (text, place) in [
            ("400  1.234,5\n410  2.345,6\n", "line 1: `1.234,5` has marks of thousands; write it as 1234.5"),
            ("400 1,234.5\n410 2,345.6\n", "line 1: `1,234.5` has marks of thousands; write it as 1234.5"),
            (
                "nm;L\n400;999,5\n410;12.345.678,25\n",
                "line 3: `12.345.678,25` has marks of thousands; write it as 12345678.25",
            ),
            ("nm L\n400 0.5\n410 1'234.5\n", "line 3: `1'234.5` has marks of thousands; write it as 1234.5"),
            ("nm;L\n400;1 234,5\n410;2 345,6\n", "line 2: `1 234,5` has marks of thousands; write it as 1234.5"),
            (
                "nm;L (W m-2 sr-1 nm-1)\n400;999,5\n410;12 345\n",
                "line 3: `12 345` has marks of thousands; write it as 12345",
            ),
            ("nm,L\n400,\"1,234.5\"\n", "line 2, column 2: `1,234.5` has marks of thousands; write it as 1234.5"),
        ] {
            assert_eq!(complaint(text), format!("t: {place}, and so all numbers"), "{text}");
        }
        // One mark alone is that of decimals.
        assert_eq!(complaint("400;1.234\n410;2.345\n"), "read");
    }

    #[test]
    fn files_of_instruments_and_models_are_told() {
        for (text, wanted) in [
            (
                "Data from SKY.txt Node\n\nUser: lab\n>>>>>Begin Spectral Data<<<<<\n400.1\t1.2\n401.1\t1.3\n402.1\t1.4\n",
                "t: lines 1 to 4 stand above its numbers; put a # before what is no table, and behind them too",
            ),
            (
                "TF 4    2    2\n  1 2 0 3\n   FREQ   TOT_TRANS  TOTAL_RAD\n 12000.0 0.8 1e-7\n 12010.0 0.8 1e-7\n -9999.\n",
                "t: it looks like a tape7 of MODTRAN, with cards above its heading, line 3; keep the columns FREQ and TOTAL_RAD",
            ),
            (
                "Sky radiance zenith\nwavelength (nm),radiance (W m-2 sr-1 nm-1)\n350,.05\n850,.002\n",
                "t: line 1 stands above the heading of its columns, line 2; put a # before what is no table",
            ),
            (
                "Site,Athens,,\nDate,2024-03-01,,\nwavelength,a,b,c\n350,1,2,3\n850,1,2,3\n",
                "t: lines 1 to 2 stand above the heading of its columns, line 3; put a # before what is no table",
            ),
            ("Sky at noon\n400,1\n410,2\n", "t: line 1 has 1 cell above 2 columns: put a # before it if it is a title"),
            (
                "Sky at noon\n400 1\n410 2\n",
                "t: line 1: 3 words stand above 2 columns that are parted by blanks; put a # before it",
            ),
            ("Sky\n\n400;1,5\n410;2,5\n", "t: line 1 has 1 cell above 2 columns: put a # before it if it is a title"),
            (
                "400,1\n410,2\nmeasured at noon\n",
                "t: line 3 has 1 cell, the rows above it have 2; put a # before it if it is no row",
            ),
        ] {
            assert!(complaint(text).starts_with(wanted), "{text}: {}", complaint(text));
        }
    }

    #[test]
    fn a_title_is_no_heading() {
        for text in [
            "A title, with commas\nnm,L\n400,1\n410,2\n",
            "A title\nnm,L\n400,1\n410,2\n",
            "Sky; noon\nnm;L\n400;1\n410;2\n",
        ] {
            assert_eq!(
                complaint(text),
                "t: line 1 stands above the heading of its columns, line 2; put a # before what is no table",
                "{text}"
            );
        }
        for text in
            ["x,sky\nnm,W/(m2 sr nm)\n400,1\n", "wavelength,sky\nnm,counts\n400,1\n", "x,R,G\nnm,-,counts\n400,1,2\n"]
        {
            let table = SpectralTable::parse("t", text.as_bytes()).unwrap();
            assert!(["sky", "R"].contains(&table.columns[0].as_str()), "{table:?}");
        }
    }

    /// libRadtran's manual: each wavelength has its line of irradiances, one of azimuths, and one for each direction, its cosine and
    /// the radiance averaged over azimuths before the others.
    #[test]
    fn directions_between_rows_are_told() {
        let block = |nm: f64| {
            format!(
                " {nm:.3}  1.0e+01  2.0e+01 3.0e+00 1.0e+00 2.0e+00 3.0e-01\n              0.000  90.000\n -1.0000 1.0e+00 9.0e-01 8.0e-01\n"
            )
        };
        let text: String = [400.0, 410.0, 420.0].map(block).concat();
        for text in [text.clone(), block(400.0), format!("# sky\n{text}")] {
            let found = complaint(&text);
            assert!(found.contains("libRadtran's uvspec") && found.contains("`output_user lambda uu`"), "{found}");
        }
    }

    #[test]
    fn rows_of_wavelengths_without_names_are_told() {
        let nameless = "its first row holds wavelengths, and its rows are spectra without names";
        let wavelengths: String = (0..20).map(|place| format!("{},", 340 + place)).collect();
        let spectrum: String = (0..20).map(|place| format!("{}.5,", 237 - 3 * place)).collect();
        let [wavelengths, spectrum] = [&wavelengths, &spectrum].map(|row| row.trim_end_matches(',').to_owned());
        for text in [format!("{wavelengths}\n{spectrum}\n"), format!("{wavelengths}\n{spectrum}\n{spectrum}\n")] {
            assert!(complaint(&text).contains(nameless), "{text}: {}", complaint(&text));
        }
        let uneven = "400,401,403,410,420,435,470,500,560\n237.5,234,231,228,225,222,219,216,213\n";
        assert!(complaint(uneven).contains(nameless), "{}", complaint(uneven));
        let down = "400 101 102 103 104 105 106 108 109\n410 103 104 105 106 107 108 109 110\n420 1 1 1 1 1 1 1 1\n";
        assert_eq!(complaint(down), "read");
        // Dates, and values that may be taken for wavelengths, below a heading of these.
        let dated = format!("date,lat,lon,{wavelengths}\n2024-05-01,45.1,7.2,{spectrum}\n");
        let wanted = "t: line 1, column 2: `lat` is no wavelength, as the others are; leave the column out";
        assert!(complaint(&dated).starts_with(wanted), "{}", complaint(&dated));
    }

    #[test]
    fn a_row_of_values_with_their_units_is_no_row_of_units() {
        let wanted = "t: line 2, column 1: `340.0 nm` is no number; write 340.0, and the unit in the heading";
        assert_eq!(complaint("wavelength,radiance\n340.0 nm,237.8 mW/m2/sr/nm\n341.0 nm,234.6 mW/m2/sr/nm\n"), wanted);
    }

    #[test]
    fn commas_beside_tabs_part_cells() {
        let text = "wavelength (nm), radiance (mW/m2/sr/nm)\n340.0,\t2.3e2\n341.0,\t2.4e2\n";
        let table = SpectralTable::parse("t", text.as_bytes()).unwrap();
        assert_eq!((table.columns.len(), table.values[(0, 1)]), (1, 240.0));
    }
}

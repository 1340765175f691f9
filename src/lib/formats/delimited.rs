//! Tables as text: encodings, comments, and what parts the cells, brought to one form.
//!
//! Cells are parted by commas, semicolons, tabs or blanks; what parts them is what makes numbers of the cells of the first rows.
//! Lines that begin with `#`, `;`, `%`, `!` or `//` are comments.

use crate::error::{Error, Result};
use std::borrow::Cow;

/// So many comments are searched for what they say.
pub(super) const MAX_COMMENTS: usize = 1000;
/// So many rows are looked at for what parts their cells.
const ROWS_LOOKED_AT: usize = 16;
/// What may part cells, the likeliest first: a comma may be that of decimals, a blank that of words.
const SEPARATORS: [Separator; 4] =
    [Separator::Byte(b'\t'), Separator::Byte(b';'), Separator::Byte(b','), Separator::Blanks];

/// What parts the cells of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// One character.
    Byte(u8),
    /// Blanks, any number of them.
    Blanks,
}

impl Separator {
    /// What parts the cells of `text`: what makes two or more cells of the last of its first rows, all but the first of them
    /// numbers, or, in a table `of_numbers`, of the last that has no mistake, or at least begins with a number and has another; where
    /// nothing does, the first of comma, semicolon and tab that the first row has. In a table of words a comma is none where the first
    /// row has another of these, and as many cells by it as the last.
    pub fn of(text: &str, of_numbers: bool) -> Self {
        let rows: Vec<&str> = rows(text).take(ROWS_LOOKED_AT).collect();
        let first = rows.first().unwrap_or(&"").as_bytes();
        let in_first = || b",;\t".iter().find(|separator| first.contains(separator));
        // Words before a last number with a decimal comma: `a.tiff;flat;0,02` is not the word `a.tiff;flat;0` and the number 02.
        let as_wide = |separator: &u8| {
            let cells = |row: &&str| Self::Byte(*separator).cells(row).len();
            rows.first().map(cells) == rows.last().map(cells)
        };
        let is_of_decimals = !of_numbers && !first.contains(&b',') && in_first().is_some_and(as_wide);
        let may_part = |separator: &&Self| !(is_of_decimals && **separator == Self::Byte(b','));
        let looked_at = if of_numbers { rows.len() } else { 1 };
        let last = || rows.iter().rev().take(looked_at);
        let parts = |row: &str| SEPARATORS.iter().filter(may_part).find(|separator| separator.makes_numbers(row));
        let found = last().find_map(|row| parts(row));
        // A column of words, or one with gaps.
        let of_some = || {
            let mut last = last().filter(|_| of_numbers);
            last.find_map(|row| SEPARATORS.iter().find(|separator| separator.makes_some(row)))
        };
        found.or_else(of_some).copied().unwrap_or_else(|| Self::Byte(*in_first().unwrap_or(&b',')))
    }

    /// Whether a cell between such separators is a number: no comma is one of decimals where it parts cells.
    fn is_number(self, cell: &str) -> bool {
        number(cell).is_some() || self != Self::Byte(b',') && decimal(cell).is_some()
    }

    /// Whether a row has two cells or more, all but the first of them numbers. A comma that parts no number from them may be one of
    /// decimals: `360 0,05`, `360;good;0,05`.
    fn makes_numbers(self, row: &str) -> bool {
        let cells: Vec<&str> = self.cells(row);
        let filled = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
        // `380;1 234,5` are no two cells between blanks, nor `380,<tab>1` between tabs.
        let is_parted = |cell: &&str| cell.ends_with([',', ';']) && self.is_number(cell.trim_end_matches([',', ';']));
        if self == Self::Blanks && cells[0].contains([';', '\t'])
            || self == Self::Byte(b'\t') && cells.iter().any(is_parted)
        {
            return false;
        }
        let is_of_decimals = || {
            let blanks = Self::Blanks.cells(row);
            let fits = |cell: &&str| !cell.contains(',') || decimal(cell).is_some();
            number(cells[0]).is_none()
                && (cells[0].contains([';', '\t']) || Self::Blanks.makes_some(row) && blanks.iter().all(fits))
        };
        filled > 1
            && cells[1..filled].iter().all(|cell| self.is_number(cell))
            && !(self == Self::Byte(b',') && is_of_decimals())
    }

    /// Whether a row begins with a number and has another.
    fn makes_some(self, row: &str) -> bool {
        let cells: Vec<&str> = self.cells(row);
        cells.first().is_some_and(|cell| self.is_number(cell)) && cells[1..].iter().any(|cell| self.is_number(cell))
    }

    fn cells(self, row: &str) -> Vec<&str> {
        match self {
            Self::Byte(separator) => row.split(char::from(separator)).map(str::trim).collect(),
            Self::Blanks => row.split_whitespace().collect(),
        }
    }

    /// The character that parts the cells of [`plain`] text.
    pub fn byte(self) -> u8 {
        match self {
            Self::Byte(separator) => separator,
            Self::Blanks => b'\t',
        }
    }
}

/// A finite number with a decimal point, if it is one; its exponent may be written with a `D`, as Fortran does.
pub fn number(cell: &str) -> Option<f64> {
    let is_finite = |value: &f64| value.is_finite();
    cell.parse().ok().filter(is_finite).or_else(|| {
        let is_fortran =
            cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) && cell.contains(['D', 'd']);
        is_fortran.then(|| cell.replacen(['D', 'd'], "e", 1).parse().ok().filter(is_finite)).flatten()
    })
}

/// A finite number with a decimal comma, if it is one.
pub fn decimal(cell: &str) -> Option<f64> {
    let has_one = cell.bytes().filter(|byte| *byte == b',').count() == 1 && !cell.contains('.');
    has_one.then(|| number(&cell.replacen(',', ".", 1))).flatten()
}

/// The text of a file, without its byte order mark and the mark of DOS that ends it: UTF-8, UTF-16, or else Latin-1, of which numbers and
/// most units are the same.
///
/// # Errors
///
/// [`Error::Format`] for UTF-16 that is damaged.
pub fn decoded<'a>(name: &str, bytes: &'a [u8]) -> Result<Cow<'a, str>> {
    const END_OF_DOS: u8 = 0x1A;
    let utf16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        of_utf16(bytes, unit).ok_or_else(|| Error::format(name, "it is UTF-16 text, but damaged; save it as UTF-8"))
    };
    // Two characters of ASCII, without a mark.
    let unmarked = match bytes {
        [0, 1..=0x7F, 0, 1..=0x7F, ..] => of_utf16(bytes, u16::from_be_bytes),
        [1..=0x7F, 0, 1..=0x7F, 0, ..] => of_utf16(bytes, u16::from_le_bytes),
        _ => None,
    };
    let text: Cow<'a, str> = match (bytes, unmarked) {
        ([0xFF, 0xFE, text @ ..], _) => utf16(text, u16::from_le_bytes)?.into(),
        ([0xFE, 0xFF, text @ ..], _) => utf16(text, u16::from_be_bytes)?.into(),
        (_, Some(text)) => text.into(),
        (_, None) => {
            let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
            let bytes = bytes.strip_suffix(&[END_OF_DOS]).unwrap_or(bytes);
            match std::str::from_utf8(bytes) {
                Ok(text) => text.into(),
                Err(_) => bytes.iter().copied().map(char::from).collect::<String>().into(),
            }
        }
    };
    let has_old_ends = text.contains('\r') && !text.contains('\n');
    Ok(if has_old_ends { text.replace('\r', "\n").into() } else { text })
}

/// The text of units of UTF-16, if they are that throughout.
fn of_utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Option<String> {
    let (pairs, odd) = bytes.as_chunks();
    let text = char::decode_utf16(pairs.iter().map(|pair| unit(*pair))).collect::<std::result::Result<String, _>>();
    text.ok().filter(|_| odd.is_empty())
}

/// The lines that stand above the heading of a table, the first and the last, and that of the heading, from 1: the last line before
/// the first of numbers, or that of wavelengths, is the heading.
pub fn above_heading(text: &str) -> Option<[usize; 3]> {
    /// So many lines are looked at, where none is longer than people read.
    const LOOKED_AT: usize = 200;
    const LONGEST: usize = 1 << 16;
    let mut last: Vec<&str> = text.lines().rev().take(ROWS_LOOKED_AT).collect();
    last.reverse();
    if last.iter().copied().chain(text.lines().take(LOOKED_AT)).any(|line| line.len() > LONGEST) {
        return None;
    }
    let separator = Separator::of(&last.join("\n"), false);
    let said = |(_, line): &(usize, &str)| !line.trim().is_empty() && comment(line, None).is_none();
    let lines = || text.lines().enumerate().take(LOOKED_AT).filter(said);
    let is_number = |cell: &&str| number(cell).is_some() || decimal(cell).is_some();
    let has_numbers = |line: &str| {
        let cells = separator.cells(line);
        // A word before one number may be a line of a preamble: `Serial, 4711`.
        let least = if cells.first().is_some_and(is_number) { 2 } else { 3 };
        cells.len() >= least && cells[1..].iter().all(&is_number)
    };
    let begins_so = |line: &str| separator.cells(line).first().is_some_and(is_number);
    let place = lines().position(|(_, line)| has_numbers(line))?;
    let of_numbers = lines().nth(place)?;
    let heading = if begins_so(of_numbers.1) { place.checked_sub(1)? } else { place };
    let last = lines().nth(heading.checked_sub(1)?)?.0;
    Some([lines().next()?.0, last, lines().nth(heading)?.0].map(|index| index + 1))
}

/// Whether a line, from 1, has as many cells as the next that says anything.
pub fn is_heading(text: &str, line: usize) -> bool {
    let said = |line: &&str| !line.trim().is_empty() && comment(line, None).is_none();
    let mut lines = text.lines().skip(line.saturating_sub(1)).filter(said);
    let (Some(heading), Some(row)) = (lines.next(), lines.next()) else { return false };
    let separator = Separator::of(row, true);
    let columns = separator.cells(row).len();
    separator.cells(heading).len() == columns || separator == Separator::Blanks && bracketed(heading).len() == columns
}

/// The first line, from 1, where it stands above rows of numbers and has another number of cells than they: with that number, theirs, and
/// what parts these.
pub fn title(text: &str) -> Option<([usize; 3], Separator)> {
    const LONGEST: usize = 1 << 16;
    let said = |(_, line): &(usize, &str)| !line.trim().is_empty() && comment(line, None).is_none();
    let mut lines = text.lines().enumerate().filter(said).take(ROWS_LOOKED_AT);
    let (index, first) = lines.next()?;
    let rows: Vec<&str> = lines.map(|(_, line)| line).collect();
    if rows.is_empty() || first.len() > LONGEST || rows.iter().any(|line| line.len() > LONGEST) {
        return None;
    }
    let separator = Separator::of(&rows.join("\n"), true);
    let columns = separator.cells(rows[0]).len();
    let are_numbers = |row: &&str| {
        let cells = separator.cells(row);
        cells.len() == columns && cells.iter().all(|cell| separator.is_number(cell))
    };
    let cells = separator.cells(first);
    let is_one = columns > 1
        && cells.len() != columns
        && rows.iter().all(are_numbers)
        && !separator.is_number(cells.first()?)
        // A heading with units in brackets is parted otherwise.
        && !(separator == Separator::Blanks && bracketed(first).len() == columns);
    is_one.then_some(([index + 1, cells.len(), columns], separator))
}

/// What stands in a comment, if a line is one. Numbers behind semicolons are a row without a label where `row`, the first
/// that is none, has as many.
fn comment<'a>(line: &'a str, row: Option<&str>) -> Option<&'a str> {
    let line = line.trim_start();
    let semicolons = |text: &str| text.bytes().filter(|byte| *byte == b';').count();
    let is_row = || {
        let are_numbers =
            line.split(';').skip(1).all(|cell| number(cell.trim()).or_else(|| decimal(cell.trim())).is_some());
        semicolons(line) > 1 && row.is_some_and(|row| semicolons(row) == semicolons(line)) && are_numbers
    };
    let marked = line.strip_prefix("//").or_else(|| line.strip_prefix(['#', '%', '!']));
    marked.or_else(|| line.strip_prefix(';').filter(|_| !is_row()))
}

/// Lines that are neither empty nor marked as comments.
pub(super) fn rows(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.trim().is_empty() && comment(line, None).is_none())
}

/// The comments of a text, without their marks.
pub fn comments(text: &str) -> impl Iterator<Item = &str> {
    let row = rows(text).next();
    text.lines().filter_map(move |line| comment(line, row))
}

/// The rows of a text, each in its line, as a reader of CSV takes them: comments emptied, cells parted by blanks now parted by
/// tabs, and, where it `trims`, without the separators that end rows behind the last column in which any row has something; none where
/// it is so already.
///
/// # Errors
///
/// [`Error::Format`] for a line of words over columns that are parted by blanks where it is not clear which is whose.
pub fn plain(name: &str, text: &str, separator: Separator, trims: bool) -> Result<Option<String>> {
    let row = rows(text).next();
    let widest = match separator {
        Separator::Byte(byte) if trims => {
            rows(text).map(|line| Extent::of(line, byte).filled).max().unwrap_or(usize::MAX)
        }
        _ => usize::MAX,
    };
    let is_plain = |line: &str| {
        line.starts_with('#')
            || comment(line, row).is_none() && Extent::of(line, separator.byte()).surplus(widest).is_none()
    };
    if matches!(separator, Separator::Byte(_)) && text.lines().all(is_plain) {
        return Ok(None);
    }
    let width = usual_width(text, separator);
    let mut plain = String::with_capacity(text.len());
    for (index, line) in text.lines().enumerate() {
        if comment(line, row).is_none() {
            match separator {
                Separator::Byte(byte) => plain.push_str(without_surplus(line, byte, widest)),
                Separator::Blanks => push_cells(&mut plain, line, width).map_err(|words| {
                    let stand = if words == 1 { "word stands" } else { "words stand" };
                    let problem = format!(
                        "line {}: {words} {stand} above {width} columns that are parted by blanks; put a # before it if it is a \
                         title, or part all cells by tabs, commas or semicolons",
                        index + 1
                    );
                    Error::format(name, problem)
                })?,
            }
        }
        plain.push('\n');
    }
    Ok(Some(plain))
}

/// How many cells a row has, and up to which of them there is something.
#[derive(Clone, Copy)]
struct Extent {
    cells: usize,
    filled: usize,
}

impl Extent {
    /// Of cells between separators, of which those in quotes part nothing.
    fn of(line: &str, separator: u8) -> Self {
        let (mut cells, mut filled, mut is_quoted, mut before) = (1, 0, false, 0);
        for byte in line.bytes() {
            match byte {
                _ if byte == separator && !is_quoted => cells += 1,
                b' ' | b'\r' | b'\t' => {}
                _ => {
                    // A quote begins a cell, ends it, or, twice, stands in it.
                    is_quoted ^= byte == b'"' && (is_quoted || filled < cells || before == b'"');
                    filled = cells;
                }
            }
            before = byte;
        }
        Self { cells, filled }
    }

    /// The empty cells at the end of a row that is wider than `widest`; all those of a row that has no others. None where there are none.
    fn surplus(self, widest: usize) -> Option<usize> {
        let kept = if self.filled == 0 { 0 } else { widest };
        (widest < usize::MAX && self.cells > kept.max(1)).then(|| self.cells - kept.max(1))
    }
}

/// A row without the separators of its surplus cells.
fn without_surplus(line: &str, separator: u8, widest: usize) -> &str {
    let mut kept = line;
    for _ in 0..Extent::of(line, separator).surplus(widest).unwrap_or(0) {
        let end = kept.trim_end_matches(|c: char| c.is_ascii_whitespace() && c != char::from(separator));
        kept = end.strip_suffix(char::from(separator)).unwrap_or(end);
    }
    kept
}

/// How many cells most of the first rows have that begin with a number, or the last of the first where none does; of two numbers of
/// cells that are as frequent the larger.
fn usual_width(text: &str, separator: Separator) -> usize {
    let mut widths: Vec<(usize, usize)> = Vec::new();
    let mut last = 0;
    for row in rows(text).take(ROWS_LOOKED_AT) {
        let cells = separator.cells(row);
        last = cells.len();
        if cells.first().is_some_and(|cell| separator.is_number(cell)) {
            match widths.iter_mut().find(|(width, _)| *width == last) {
                Some((_, count)) => *count += 1,
                None => widths.push((last, 1)),
            }
        }
    }
    widths.into_iter().max_by_key(|(width, count)| (*count, *width)).map_or(last, |(width, _)| width)
}

/// Adds the cells of a line that are parted by blanks, tabs between them. Words are parted so that there are `width` of them:
/// by two blanks or more, by tabs, each with what stands in brackets behind it, or several with such brackets; a row that begins with a number stays as it is where neither
/// makes so many. Otherwise it gives how many there are.
fn push_cells(plain: &mut String, line: &str, width: usize) -> std::result::Result<(), usize> {
    let cells: Vec<&str> = line.split_whitespace().collect();
    let are_numbers = cells.iter().skip(1).all(|cell| number(cell).or_else(|| decimal(cell)).is_some());
    if cells.is_empty() || are_numbers && cells.len() > 1 {
        plain.push_str(&cells.join("\t"));
        return Ok(());
    }
    let filled = |parts: &mut dyn Iterator<Item = &'_ str>| -> Vec<String> {
        parts.map(|part| part.trim().to_owned()).filter(|cell| !cell.is_empty()).collect()
    };
    let apart = filled(&mut line.split("  "));
    let by_tabs = filled(&mut line.split('\t'));
    // `wavelength (nm) spectral radiance (W m-2 sr-1 nm-1)`
    let behind_brackets = filled(&mut behind_brackets(line).into_iter());
    let named = filled(&mut bracketed(line).into_iter());
    let count = cells.len();
    // No heading begins with a number.
    let of_row = Some(filled(&mut cells.into_iter())).filter(|cells| Separator::Blanks.is_number(&cells[0]));
    let cells = [apart, by_tabs, named, behind_brackets]
        .into_iter()
        .find(|cells| cells.len() == width)
        .or(of_row)
        .ok_or(count)?;
    plain.push_str(&cells.join("\t"));
    Ok(())
}

/// The parts of a line of which each ends with brackets, where all do.
fn behind_brackets(line: &str) -> Vec<&str> {
    let (mut cells, mut begin, mut depth) = (Vec::new(), 0, 0_usize);
    for (place, character) in line.char_indices() {
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => {
                depth = depth.saturating_sub(1);
                let end = place + 1;
                if depth == 0 && line[end..].chars().next().is_none_or(char::is_whitespace) {
                    cells.push(&line[begin..end]);
                    begin = end;
                }
            }
            _ => {}
        }
    }
    if line[begin..].trim().is_empty() { cells } else { Vec::new() }
}

/// The words of a line, each with what stands in brackets behind it.
pub(super) fn bracketed(line: &str) -> Vec<&str> {
    let (mut cells, mut begin, mut depth, mut before) = (Vec::new(), 0, 0_usize, ' ');
    for (place, character) in line.char_indices() {
        let starts = before.is_whitespace() && !character.is_whitespace() && !"([".contains(character);
        if depth == 0 && starts {
            cells.push(line[begin..place].trim());
            begin = place;
        }
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        before = character;
    }
    cells.push(line[begin..].trim());
    cells.retain(|cell| !cell.is_empty());
    cells
}

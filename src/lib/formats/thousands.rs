//! Marks of thousands where they look like those of decimals: `51,309`, `1.000`.

use super::delimited::{decimal, number};
use crate::error::{Error, Result};

/// What the numbers of one column of a table look like.
#[derive(Debug, Clone, Default)]
struct Column {
    /// A number with one mark and three digits behind it, as marks of thousands stand, and its line.
    marked: Option<(String, u64)>,
    /// A whole number of three digits without a mark.
    plain: Option<String>,
    /// Whether any number is of another kind: with other digits behind its mark, below one, larger without one.
    has_other: bool,
}

/// The numbers of all columns of a table.
#[derive(Debug, Default)]
pub(super) struct Thousands {
    columns: Vec<Column>,
    /// Whether some comma can be that of decimals alone, so that all are.
    has_decimal_commas: bool,
}

impl Thousands {
    /// Looks at a cell of a column that stands in such a line.
    pub(super) fn take(&mut self, column: usize, cell: &str, line: impl FnOnce() -> u64) {
        if self.columns.len() <= column {
            self.columns.resize(column + 1, Column::default());
        }
        let known = &mut self.columns[column];
        if known.has_other && (self.has_decimal_commas || !cell.contains(',')) {
            return;
        }
        let unsigned = cell.strip_prefix(['+', '-']).unwrap_or(cell);
        let are_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        match unsigned.split_once(['.', ',']) {
            Some((before, behind)) if are_digits(before) && are_digits(behind) => {
                if behind.len() == 3 && before.len() <= 3 && !before.starts_with('0') {
                    known.marked.get_or_insert_with(|| (cell.to_owned(), line()));
                } else {
                    known.has_other = true;
                    self.has_decimal_commas |= cell.contains(',');
                }
            }
            None if are_digits(unsigned) && unsigned.len() == 3 => {
                known.plain.get_or_insert_with(|| cell.to_owned());
            }
            None if are_digits(unsigned) && unsigned.len() < 3 => {}
            _ => known.has_other |= number(cell).or_else(|| decimal(cell)).is_some(),
        }
    }

    /// Refuses a column whose marks can be those of thousands: all of its numbers have three digits behind theirs, and those without one
    /// have three, as 999 before 1,000; or the marks are commas, none of the table can be that of decimals alone, and cells are not parted by
    /// semicolons, which people put where commas are those of decimals.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] naming a number of such a column.
    pub(super) fn check(&self, name: &str, separator: char) -> Result<()> {
        for (index, column) in self.columns.iter().enumerate().filter(|(_, column)| !column.has_other) {
            let Some((cell, line)) = &column.marked else { continue };
            let place = format!("line {line}, column {}", index + 1);
            let whole = cell.replace(['.', ','], "");
            if let Some(plain) = &column.plain {
                let problem = format!(
                    "{place}: `{cell}` beside numbers such as `{plain}` has a mark of thousands; write it as {whole}, and so all numbers, or with \
                     decimals of another number of digits, {}0",
                    cell.replace(',', ".")
                );
                return Err(Error::format(name, problem));
            }
            if cell.contains(',') && separator != ';' && !self.has_decimal_commas {
                let problem = format!(
                    "{place}: nobody can tell whether the comma of `{cell}` is that of thousands or of decimals; write {whole} or {}, and so \
                     all numbers",
                    cell.replace(',', ".")
                );
                return Err(Error::format(name, problem));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::formats::csv::SpectralTable;

    fn complaint(text: &str) -> String {
        SpectralTable::parse("t", text.as_bytes()).map_or_else(|error| error.to_string(), |_| "read".into())
    }

    #[test]
    fn marks_that_may_be_of_thousands_are_told() {
        for (text, wanted) in [
            (
                "nm,L\n350,\"51,309\"\n600,\"12,345\"\n",
                "t: line 2, column 2: nobody can tell whether the comma of `51,309`",
            ),
            ("nm\tL\n350\t51,309\n600\t12,345\n", "t: line 2, column 2: nobody can tell whether the comma of `51,309`"),
            ("nm;L\n995;1\n1.000;2\n1.005;3\n", "t: line 3, column 1: `1.000` beside numbers such as `995` has a mark"),
            ("nm;L\n400;999\n500;1.002\n", "t: line 3, column 2: `1.002` beside numbers such as `999` has a mark"),
        ] {
            assert!(complaint(text).starts_with(wanted), "{text}: {}", complaint(text));
        }
        for text in [
            "nm,L\n350,\"51,309\"\n600,\"12,3\"\n",
            "nm\tL\n350\t51,309\n600\t0,345\n",
            "400,000 0,5\n410,000 1,25\n",
            "nm;L\n350;51,309\n600;12,345\n",
            "nm,L\n350,51.309\n600,12.345\n",
            "nm,L\n400,1.125\n500,2\n",
            "nm,L\n400.125,1\n400.25,2\n401,3\n",
        ] {
            assert_eq!(complaint(text), "read", "{text}");
        }
    }
}

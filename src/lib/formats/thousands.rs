//! Marks of thousands where they look like those of decimals: `51,309`, `1.000`, `51.309`.

use super::delimited::{decimal, number};
use crate::error::{Error, Result};
use std::collections::BTreeMap;

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
    /// The same of points.
    has_decimal_points: bool,
}

/// Numbers whose points, or commas, may be marks of thousands, one of each curve.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) enum Points {
    /// None.
    #[default]
    Plain,
    /// In columns, by the place of the curve.
    Columns(BTreeMap<usize, (String, u64)>),
    /// In rows, each a curve.
    Rows((String, u64)),
}

impl Points {
    /// That of a curve.
    fn of(&self, curve: usize) -> Option<&(String, u64)> {
        match self {
            Self::Plain => None,
            Self::Columns(columns) => columns.get(&curve),
            Self::Rows(number) => Some(number),
        }
    }

    /// The same without the first curve.
    pub(super) fn without_first(self) -> Self {
        match self {
            Self::Columns(columns) => {
                let others = columns.into_iter().filter_map(|(curve, number)| Some((curve.checked_sub(1)?, number)));
                Self::Columns(others.collect())
            }
            other => other,
        }
    }

    /// The same of the curves that are kept.
    pub(super) fn kept(self, kept: &[usize]) -> Self {
        match self {
            Self::Columns(columns) => {
                let place = |curve: usize| kept.iter().position(|kept| *kept == curve);
                let kept = columns.into_iter().filter_map(|(curve, number)| Some((place(curve)?, number)));
                Self::Columns(kept.collect())
            }
            other => other,
        }
    }

    /// Refuses a curve of such numbers, `times_white` as bright as a white cloud in the sun at its brightest: a thousand times as bright
    /// it may still be light of the sky. Commas, which beside semicolons are those of decimals as a rule, are warned of.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] naming a number.
    pub(super) fn check(&self, name: &str, curve: usize, times_white: f64) -> Result<Option<String>> {
        /// No sky is so many times as bright but near the sun.
        const MOST: f64 = 10.0;
        let Some((cell, line)) = self.of(curve).filter(|_| 1000.0 * times_white <= MOST) else { return Ok(None) };
        if cell.contains(',') {
            return Ok(Some(format!(
                "{name}: line {line}: the comma of `{cell}` counts as that of decimals, {}; where it is that of thousands, write {}, and \
                 so all numbers",
                cell.replace(',', "."),
                cell.replace(',', "")
            )));
        }
        let problem = format!(
            "line {line}: nobody can tell whether the point of `{cell}` is that of thousands or of decimals, beside semicolons and with \
             three digits behind every point; write {} or {cell}0, and so all numbers",
            cell.replace('.', "")
        );
        Err(Error::format(name, problem))
    }
}

impl Thousands {
    /// Looks at a cell of a column that stands in such a line.
    pub(super) fn take(&mut self, column: usize, cell: &str, line: impl FnOnce() -> u64) {
        if self.columns.len() <= column {
            self.columns.resize(column + 1, Column::default());
        }
        let known = &mut self.columns[column];
        let is_settled = match cell.contains(',') {
            true => self.has_decimal_commas,
            false => self.has_decimal_points || !cell.contains('.'),
        };
        if known.has_other && is_settled {
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
                    self.has_decimal_points |= cell.contains('.');
                }
            }
            None if are_digits(unsigned) && unsigned.len() == 3 => {
                known.plain.get_or_insert_with(|| cell.to_owned());
            }
            None if are_digits(unsigned) && unsigned.len() < 3 => {}
            _ => {
                let is_number = number(cell).or_else(|| decimal(cell)).is_some();
                known.has_other |= is_number;
                // `5.1e-3`
                self.has_decimal_points |= is_number && cell.contains('.');
            }
        }
    }

    /// The curves of a table whose points, or commas, may be marks of thousands: between semicolons, which people put where commas are
    /// those of decimals and points those of thousands, where no number of the table has a mark that can be that of decimals alone, as
    /// that of a wavelength is.
    pub(super) fn points(self, separator: char, by_rows: bool) -> Points {
        let has_commas = |column: &Column| column.marked.as_ref().is_some_and(|(cell, _)| cell.contains(','));
        let is_of_wavelengths = !by_rows && self.columns.first().is_some_and(has_commas);
        let [points, commas] = [self.has_decimal_points, self.has_decimal_commas || is_of_wavelengths];
        if separator != ';' || points && commas {
            return Points::Plain;
        }
        let may_be = |cell: &str| cell.contains('.') && !points || cell.contains(',') && !commas;
        let marked = |column: Column| column.marked.filter(|(cell, _)| may_be(cell) && !column.has_other);
        let columns = self.columns.into_iter().enumerate().skip(1);
        let mut found = columns.filter_map(|(place, column)| Some((place - 1, marked(column)?)));
        match by_rows {
            true => found.next().map_or(Points::Plain, |(_, number)| Points::Rows(number)),
            false => Some(found.collect::<BTreeMap<_, _>>())
                .filter(|columns| !columns.is_empty())
                .map_or(Points::Plain, Points::Columns),
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

    /// In one unit a sky may be a thousand times as bright, in another nothing is.
    #[test]
    fn points_between_semicolons_are_told_where_both_may_be() {
        let unit = |text: &str, unit: &str| {
            let table = SpectralTable::parse("t", text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"));
            let last = table.columns.len() - 1;
            table
                .radiance_unit(last, crate::units::RadianceUnit::parse(unit))
                .map(|(_, warned)| warned.filter(|warned| warned.contains("the comma of")))
                .map_err(|error| error.to_string())
        };
        let dim = "nW cm-2 sr-1 nm-1";
        for text in [
            "nm;L\n350;51.309\n600;12.345\n",
            "nm;M;L\n350;1;51.309\n600;2;12.345\n",
            "No.;nm;L\n1;350;51.309\n2;600;12.345\n3;700;7\n",
            "id;350;600\na;51.309;12.345\n",
            "nm;std;L\n350;1;51.309\n600;2;12.345\n",
        ] {
            let refused = unit(text, dim).unwrap_err();
            let wanted = "nobody can tell whether the point of `51.309` is that of thousands or of decimals";
            assert!(refused.starts_with("t: line 2: ") && refused.contains(wanted), "{text}: {refused}");
            // 51 W m-2 sr-1 nm-1 are 760 times a white cloud.
            assert_eq!(unit(text, "mW m-2 sr-1 nm-1"), Ok(None), "{text}");
        }
        for text in [
            "nm;L\n350;51.309\n600;0.345\n",
            "nm;L\n350;51.309\n600;12.34\n",
            "nm;L\n350.5;51.309\n600.5;12.345\n",
            "nm;L\n350.0;51.309\n600.0;12.345\n",
            "nm;L\n350;51.309\n600;1.2e1\n",
            "nm;L\n350;51,309\n600;0,345\n",
            "nm;L\n350;51,309\n600;12,34\n",
            "nm;L\n350,5;51,309\n600,5;12,345\n",
            "nm;L\n350,000;51,309\n600,000;12,345\n",
            "nm,L\n350,51.309\n600,12.345\n",
            "nm L\n350 51.309\n600 12.345\n",
        ] {
            assert_eq!(unit(text, dim), Ok(None), "{text}");
        }
        // Commas of decimals are usual there.
        for text in ["nm;L\n350;51,309\n600;12,345\n", "id;350;600\na;51,309;12,345\n"] {
            let warned = unit(text, dim).unwrap_or_else(|error| panic!("{text}: {error}"));
            let wanted = "t: line 2: the comma of `51,309` counts as that of decimals, 51.309; where it is that of thousands, write 51309";
            assert!(warned.as_ref().is_some_and(|warned| warned.starts_with(wanted)), "{text}: {warned:?}");
            assert_eq!(unit(text, "mW m-2 sr-1 nm-1"), Ok(None), "{text}");
        }
    }
}

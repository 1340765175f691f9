//! What comments say of the columns of a table: one a line, `Column 2: radiance (W m-2 sr-1 nm-1)`, or all in one, `lambda edir uu`.

use super::delimited::{self, MAX_COMMENTS};
use super::spectral_heading::{check_first_column, in_comment, names_wavelengths, without_first};
use crate::error::Result;
use crate::units::{Stated, unit_of_heading};
use csv::StringRecord;

/// The number of the column that a comment describes, and what it says of it.
pub(super) fn column(comment: &str) -> Option<(usize, &str)> {
    let text = comment.trim_start();
    let is_one = |word: &&str| text.get(..word.len()).is_some_and(|begin| begin.eq_ignore_ascii_case(word));
    let word = ["column", "col.", "col"].into_iter().find(is_one)?;
    counted(&text[word.len()..])
}

/// The number that a text begins with, and what stands behind it.
fn counted(text: &str) -> Option<(usize, &str)> {
    let text = text.trim_start().trim_start_matches(['#', '[', '(']);
    let (number, behind) = text.split_at(text.find(|c: char| !c.is_ascii_digit())?);
    let said = behind.trim_matches(|c: char| c.is_whitespace() || ":=-–)].".contains(c) && !is_bracket(c, behind));
    let is_parted = behind.starts_with(|c: char| c.is_whitespace() || ":=-–)].".contains(c));
    Some((number.parse().ok()?, said)).filter(|_| is_parted && !said.is_empty())
}

/// Whether a closing bracket belongs to an opening one of a text.
fn is_bracket(c: char, text: &str) -> bool {
    c == ')' && text.contains('(') || c == ']' && text.contains('[')
}

/// What is said of the columns of a table.
pub(super) struct Columns<'a> {
    /// The names of those behind the first, where a heading or comments have them.
    names: Option<StringRecord>,
    /// What comments say of each, one a line.
    described: Option<Vec<&'a str>>,
    /// Whether the first is called wavelengths.
    is_first_named: bool,
}

impl<'a> Columns<'a> {
    /// Of a table of so many columns, under `heading` and perhaps units.
    ///
    /// # Errors
    ///
    /// Where comments say that wavelengths stand in another column than the first.
    pub(super) fn of(
        name: &str,
        text: &'a str,
        width: usize,
        heading: Option<&StringRecord>,
        units: Option<&StringRecord>,
    ) -> Result<Self> {
        let described = described(text, width);
        let of_comments = || {
            let said = described.as_ref().map(|said| said.iter().collect::<StringRecord>());
            in_comment(text, width).or_else(|| said.as_ref().map(without_first))
        };
        if let Some(said) = described.as_ref().filter(|said| heading.is_none() && !said[0].is_empty()) {
            check_first_column(name, &said.iter().collect())?;
        }
        let of_first = [heading, units].into_iter().flatten().filter_map(|cells| cells.get(0));
        let is_first_named = of_first.chain(described.as_ref().map(|said| said[0])).any(names_wavelengths)
            || heading.is_none() && in_comment(text, width).is_some();
        let names = heading.map(without_first).or_else(of_comments);
        Ok(Self { names, described, is_first_named })
    }

    /// Whether nobody says what they are.
    pub(super) fn are_bare(&self) -> bool {
        self.names.is_none()
    }

    /// Whether the first is called wavelengths.
    pub(super) fn is_first_named(&self) -> bool {
        self.is_first_named
    }

    /// Whether comments describe each.
    pub(super) fn are_described(&self) -> bool {
        self.described.is_some()
    }

    /// What a comment says of the first.
    pub(super) fn first(&self) -> Option<&'a str> {
        self.described.as_ref().map(|said| said[0])
    }

    /// What a comment says about the unit of the curve at a place.
    pub(super) fn unit_of(&self, curve: usize) -> Option<Stated> {
        self.described.as_ref().and_then(|said| said.get(curve + 1)).and_then(|said| unit_of_heading(said))
    }

    /// The names of the curves of a table of so many columns: as they are said, or numbers from 1.
    pub(super) fn names(&self, width: usize) -> Vec<String> {
        match &self.names {
            Some(said) => said.iter().map(ToOwned::to_owned).collect(),
            None => (1..width).map(|column| format!("column{column}")).collect(),
        }
    }
}

/// What comments say of each of so many columns, one a line, the first perhaps but for nothing; none where they leave out another, or
/// describe one twice. Numbers without the word count where the first is that of wavelengths.
fn described(text: &str, width: usize) -> Option<Vec<&str>> {
    let comments = || delimited::comments(text).take(MAX_COMMENTS);
    let by_word = all(comments().filter_map(column), width);
    by_word.or_else(|| all(comments().filter_map(counted), width).filter(|said| names_wavelengths(said[0])))
}

/// What is said of each column from 1 on, once of each, of the first perhaps nothing.
fn all<'a>(found: impl Iterator<Item = (usize, &'a str)>, width: usize) -> Option<Vec<&'a str>> {
    let mut said = vec![""; width];
    for (number, text) in found {
        let place = said.get_mut(number.checked_sub(1)?).filter(|said| said.is_empty())?;
        *place = text;
    }
    (width > 1 && said[1..].iter().all(|said| !said.is_empty())).then_some(said)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::csv::SpectralTable;

    fn table(text: &str) -> SpectralTable {
        SpectralTable::parse("t", text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn comments_that_describe_a_column_are_told_from_others() {
        for (comment, wanted) in [
            (" Column 2: radiance (mW m-2 sr-1 nm-1)", Some((2, "radiance (mW m-2 sr-1 nm-1)"))),
            ("col. 3 - L", Some((3, "L"))),
            ("col 3 = L [W]", Some((3, "L [W]"))),
            ("COLUMN1: wavelength", Some((1, "wavelength"))),
            ("Column (2) L", Some((2, "L"))),
            ("Column 2", None),
            ("columns 2 and 3: L", None),
            ("color 2: red", None),
        ] {
            assert_eq!(column(comment), wanted, "{comment}");
        }
    }

    #[test]
    fn columns_that_comments_describe_are_called_so() {
        const ROWS: &str = "400 1 2\n410 1 2\n";
        for comments in [
            "# Column 1: wavelength (nm)\n# Column 2: radiance (mW m-2 sr-1 nm-1)\n# Column 3: irradiance (mW m-2 nm-1)\n",
            "# 3 spectra\n# Column 2: radiance (mW m-2 sr-1 nm-1)\n# Column 3: irradiance (mW m-2 nm-1)\n",
            "# 1 wavelength nm\n# 2 radiance (mW m-2 sr-1 nm-1)\n# 3 irradiance (mW m-2 nm-1)\n",
        ] {
            let table = table(&format!("{comments}{ROWS}"));
            assert_eq!(table.columns, ["radiance (mW m-2 sr-1 nm-1)", "irradiance (mW m-2 nm-1)"], "{comments}");
            // By the numbers of the file itself.
            assert_eq!(table.column_index(Some("column2")).unwrap(), 0);
            assert_eq!(table.column_index(Some("column3")).unwrap(), 1);
            assert!(table.column_index(Some("column1")).is_err() && table.column_index(Some("column4")).is_err());
            assert_eq!(table.column_index(Some("radiance")).unwrap(), 0);
            assert_eq!(table.radiance_unit(0, None).unwrap().0.to_string(), "mW m-2 sr-1 nm-1");
            assert!(table.radiance_unit(1, None).unwrap_err().to_string().contains("an irradiance"));
        }
        // Of columns with a heading they tell the units.
        let headed = table(
            "# Column 1: wavelength (nm)\n# Column 2: radiance\n# Column 3: irradiance\nx,L,E\n400,1,1\n410,1,1\n",
        );
        assert_eq!(headed.columns, ["L", "E"]);
        assert!(headed.radiance_unit(1, None).unwrap_err().to_string().contains("an irradiance"));
        // One left out, one described twice.
        for comments in
            ["# Column 2: E\n", "# Column 2: E\n# Column 2: L\n# Column 3: M\n", "# 1 site\n# 2 suns\n# 3 spectra\n"]
        {
            assert_eq!(table(&format!("{comments}{ROWS}")).columns, ["column1", "column2"], "{comments}");
        }
        let kept = table(&format!("# Column 2: error\n# Column 3: L\n{ROWS}"));
        assert_eq!((kept.columns.as_slice(), kept.column_index(Some("column3")).unwrap()), (&["L".to_owned()][..], 0));
        let swapped = SpectralTable::parse("t", b"# Column 1: L\n# Column 2: wavelength (nm)\n1 400\n2 410\n");
        assert!(swapped.unwrap_err().to_string().contains("stand in column 2"));
    }
}

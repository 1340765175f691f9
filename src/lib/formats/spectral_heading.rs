//! Headings of tables that are wavelengths, with or without words about them: `400`, `400nm`, `lambda_400`, `L_400`; and first columns
//! that count rows.

use super::cells::numeric;
use super::delimited;
use crate::error::{Error, Result};
use crate::spectrum::SHORTEST_NM;
use crate::units::{Stated, WavelengthUnit, unit_of_heading};
use csv::StringRecord;
use ndarray::{Array2, ArrayView1};

/// Whether a cell is the heading of a column of wavelengths, or of what people give instead.
pub(super) fn names_wavelengths(cell: &str) -> bool {
    let lower = cell.to_lowercase();
    ["wavelength", "lambda", "λ", "wave", "wl", "nm"].iter().any(|begin| lower.starts_with(begin))
        || !matches!(WavelengthUnit::of_heading(cell), Ok(None))
}

/// Whether cells have two wavelengths, with words about them or without.
pub(super) fn holds_wavelengths<'a>(cells: impl Iterator<Item = &'a str>) -> bool {
    let cells: Vec<&str> = cells.map(str::trim).collect();
    let known = cells.iter().filter_map(|cell| Label::of(cell).or_else(|| Label::bare(cell)));
    let behind: Vec<Label> = cells.iter().filter_map(|cell| Label::behind(cell)).collect();
    known.count() > 1 || behind.windows(2).any(|pair| pair[0].is_alike(&pair[1]))
}

/// The wavelengths of a heading behind its first cell.
#[derive(Debug, PartialEq)]
pub(super) struct Wavelengths {
    pub(super) values: Vec<f64>,
    /// Their unit, where each has it.
    pub(super) unit: Option<WavelengthUnit>,
    /// The quantity that the word before them names, where that is no radiance: `reflectance_400nm`.
    pub(super) quantity: Option<Stated>,
}

/// The wavelengths of a heading above rows of spectra, of which `below` is the first cell of the first; none of another heading.
///
/// # Errors
///
/// [`Error::Format`] naming a cell that is none where most others are, or a heading without a name before them.
pub(super) fn wavelengths(name: &str, line: u64, heading: &StringRecord, below: &str) -> Result<Option<Wavelengths>> {
    let numbers: Option<Vec<f64>> = heading.iter().skip(1).map(numeric).collect();
    if let Some(values) = numbers.filter(|values| values.len() > 1 && !are_names(&heading[0], values, below)) {
        return Ok(Some(Wavelengths { values, unit: None, quantity: None }));
    }
    // Under a heading of wavelengths these stand below it.
    if names_wavelengths(&heading[0]) && numeric(below).is_some() {
        return Ok(None);
    }
    let labels: Vec<Option<Label>> = heading.iter().map(|cell| Label::of(cell).or_else(|| Label::bare(cell))).collect();
    match among(name, line, heading, &labels)? {
        Some((found, _)) => Ok(Some(found)),
        None => behind_words(name, line, heading, below),
    }
}

/// The wavelengths behind the symbol or name of a radiance, `L_400`, `Rad400`, above rows that begin with a name, or with a number that is no
/// wavelength.
///
/// # Errors
///
/// As [`wavelengths`], and of what stands behind another word.
fn behind_words(name: &str, line: u64, heading: &StringRecord, below: &str) -> Result<Option<Wavelengths>> {
    /// What silicon sees.
    const SEEN_NM: std::ops::RangeInclusive<f64> = 350.0..=1100.0;
    /// What people call the column of names.
    const NAMES: [&str; 10] = ["id", "name", "no", "nr", "sample", "site", "station", "spectrum", "point", "date"];
    let corner = heading[0].trim_end_matches('.').to_lowercase();
    // `1` may count rows; `0.4`, and what is light, may be a wavelength.
    let begins_with_name = numeric(below).is_none_or(|value| value < 100.0 && value.fract() == 0.0);
    if !begins_with_name && !NAMES.contains(&corner.as_str()) {
        return Ok(None);
    }
    let labels: Vec<Option<Label>> = heading.iter().map(Label::behind).collect();
    let Some((found, label)) = among(name, line, heading, &labels)? else { return Ok(None) };
    if !found.values.iter().any(|nm| SEEN_NM.contains(nm)) {
        return Ok(None);
    }
    if label.is_of_radiance() || found.quantity.is_some() {
        return Ok(Some(found));
    }
    let nm = |place: usize| found.values.get(place).map_or_else(String::new, |nm| format!(",{nm}nm"));
    let problem = format!(
        "line {line}: its heading seems to hold wavelengths behind `{}`, which is no known name of a radiance; where the rows are spectra \
         of radiance, write it as `name{}{},...`",
        label.before,
        nm(0),
        nm(1)
    );
    Err(Error::format(name, problem))
}

/// The wavelengths of a heading of which most cells behind the first are such labels, and the first of these.
///
/// # Errors
///
/// [`Error::Format`] naming a cell that is none, or a heading without a name before them.
fn among<'a>(
    name: &str,
    line: u64,
    heading: &StringRecord,
    labels: &'a [Option<Label>],
) -> Result<Option<(Wavelengths, &'a Label)>> {
    let known = labels.iter().skip(1).flatten();
    let Some(usual) = known.clone().next() else { return Ok(None) };
    let is_alike = |label: &Option<Label>| label.as_ref().is_some_and(|label| label.is_alike(usual));
    let like: Vec<f64> = known.filter(|label| label.is_alike(usual)).map(|label| label.value).collect();
    if like.len() < 2 || !goes_one_way(&like) || 3 * like.len() < 2 * (heading.len() - 1) {
        return Ok(None);
    }
    let refuse = |problem: String| Err(Error::format(name, problem));
    if let Some(column) = (1..heading.len()).find(|column| !is_alike(&labels[*column])) {
        let shown = &heading[column];
        let others = heading.iter().zip(labels).skip(1).find(|(_, label)| is_alike(label)).map_or("", |(cell, _)| cell);
        return refuse(format!(
            "line {line}, column {}: `{shown}` is no wavelength as the others are, such as `{others}`; mend it, or leave the column out: \
             one name stands before the values of each row",
            column + 1
        ));
    }
    if is_alike(&labels[0]) {
        return refuse(
            "its first row holds wavelengths, and its rows are spectra without names; begin each with a name, and the first with a \
             word, as in `name,400nm,410nm`"
                .into(),
        );
    }
    let is_other = |stated: &Stated| matches!(stated, Stated::Other { kind, .. } if kind.conversion().is_some());
    let quantity = unit_of_heading(&usual.before).filter(is_other);
    Ok(Some((Wavelengths { values: like, unit: usual.unit, quantity }, usual)))
}

/// Whether numbers rise throughout, or fall.
fn goes_one_way(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[0] < pair[1]) || values.windows(2).all(|pair| pair[0] > pair[1])
}

/// Whether numbers behind a heading of wavelengths are names of columns, such as angles: these wavelengths stand below it, and they are not
/// many that go one way through the light.
fn are_names(corner: &str, values: &[f64], below: &str) -> bool {
    /// Nobody names so many columns by wavelengths.
    const MANY: usize = 8;
    /// Of no light that a camera sees.
    const LEAST_NM: f64 = 100.0;
    const MOST_NM: f64 = 5000.0;
    if !names_wavelengths(corner) {
        return false;
    }
    let unit = WavelengthUnit::of_heading(corner).ok().flatten().unwrap_or(WavelengthUnit::Nanometer);
    let is_light = |value: f64| (LEAST_NM..=MOST_NM).contains(&unit.nm(value));
    let are_wavelengths = values.len() >= MANY && goes_one_way(values) && values.iter().all(|value| is_light(*value));
    numeric(below).is_some_and(is_light) && !are_wavelengths
}

/// A wavelength with words about it.
#[derive(Debug)]
struct Label {
    /// What stands before it, without marks.
    before: String,
    value: f64,
    unit: Option<WavelengthUnit>,
}

impl Label {
    /// What a cell such as `400nm`, `lambda_400`, `L(400 nm)` holds: behind it a unit, or before it a word for wavelengths.
    fn of(cell: &str) -> Option<Self> {
        /// What people call wavelengths, and what R puts before a number that is to be a name.
        const WORDS: [&str; 8] = ["wavelength", "wave", "lambda", "λ", "wl", "wvl", "nm", "x"];
        /// Beyond this no radiance is measured by wavelength.
        const LONGEST_NM: f64 = 1e5;
        let [before, number, behind] = Self::parts(cell)?;
        let before = before.to_lowercase();
        let value = numeric(number)?;
        let unit = if behind.is_empty() { None } else { Some(WavelengthUnit::of_heading(behind).ok()??) };
        let nm = unit.unwrap_or(WavelengthUnit::Nanometer).nm(value);
        let is_named = unit.is_some() || WORDS.contains(&before.as_str());
        (is_named && (SHORTEST_NM..=LONGEST_NM).contains(&nm)).then_some(Self { before, value, unit })
    }

    /// What stands before the first number of a cell, without marks, the number, and what stands behind it.
    fn parts(cell: &str) -> Option<[&str; 3]> {
        let begin = cell.find(|c: char| c.is_ascii_digit())?;
        let is_mark = |c: char| c.is_whitespace() || "_-.:=([".contains(c);
        let length = cell[begin..].find(|c: char| !(c.is_ascii_digit() || ".,".contains(c)));
        let (number, behind) = cell[begin..].split_at(length.unwrap_or(cell.len() - begin));
        let behind = behind.trim_start_matches('_').trim_end_matches([')', ']']).trim();
        Some([cell[..begin].trim_matches(is_mark), number, behind])
    }

    /// That of a cell which ends with a number behind some word, as in `L_400`.
    fn behind(cell: &str) -> Option<Self> {
        let [before, number, behind] = Self::parts(cell)?;
        let value = numeric(number).filter(|nm| Self::SEEN_NM.contains(nm))?;
        (behind.is_empty() && before.starts_with(char::is_alphabetic)).then(|| Self {
            before: before.to_lowercase(),
            value,
            unit: None,
        })
    }

    /// Whether the last word before the number is that of a radiance.
    fn is_of_radiance(&self) -> bool {
        /// Names, and symbols of oceanographers: total, sky, upwelling, water-leaving.
        const RADIANCES: [&str; 11] = ["l", "rad", "radiance", "radiances", "le", "lt", "li", "ls", "lsky", "lu", "lw"];
        let last = self.before.rsplit(|c: char| !c.is_alphanumeric()).next();
        last.is_some_and(|word| RADIANCES.contains(&word))
    }

    /// Beyond these no radiance is measured by wavelength where no unit says so.
    const SEEN_NM: std::ops::RangeInclusive<f64> = 200.0..=5000.0;

    /// That of a cell which holds a wavelength and nothing else, beside others that do.
    fn bare(cell: &str) -> Option<Self> {
        let value = numeric(cell).filter(|nm| Self::SEEN_NM.contains(nm))?;
        Some(Self { before: String::new(), value, unit: None })
    }

    /// Whether another is written in the same way.
    fn is_alike(&self, other: &Self) -> bool {
        self.before == other.before && self.unit == other.unit
    }
}

/// Whether a heading names wavelengths, and no radiance per nm.
pub(super) fn is_of_wavelengths(cell: &str) -> bool {
    let word = cell.trim().to_lowercase();
    ["wl", "nm", "wave", "λ"].contains(&word.as_str())
        || ["wavelength", "lambda", "wl_", "wl ", "wl(", "wl["].iter().any(|begin| word.starts_with(begin))
}

/// Whether wavelengths stand in the second column, behind one that counts the rows.
pub(super) fn is_behind_index(heading: &StringRecord, numbers: &Array2<f64>) -> bool {
    numbers.ncols() > 2
        && heading.len() > 2
        && !names_wavelengths(&heading[0])
        && is_of_wavelengths(&heading[1])
        && counts_rows(numbers.column(0))
}

/// Refuses a header that names wavelengths in another column than the first, or in two.
pub(super) fn check_first_column(name: &str, header: &StringRecord) -> Result<()> {
    let mut places = (0..header.len()).filter(|place| is_of_wavelengths(&header[*place]));
    let refuse = |problem: String| Err(Error::format(name, problem));
    match (places.next(), places.next()) {
        (None | Some(0), None) => Ok(()),
        (Some(0), Some(second)) => refuse(format!(
            "its columns 1 and {} both name wavelengths, `{}`; leave out the second, or part it into two tables where they differ",
            second + 1,
            header[second].trim()
        )),
        (Some(place), _) => refuse(format!(
            "its wavelengths, `{}`, stand in column {}; they must be the first column",
            header[place].trim(),
            place + 1
        )),
        (None, Some(_)) => Ok(()),
    }
}

/// Whether a first column counts the rows, from 0 or 1 on.
fn counts_rows(first: ArrayView1<f64>) -> bool {
    /// Fewer may be anything.
    const LEAST: usize = 3;
    first.len() >= LEAST
        && matches!(first.first(), Some(0.0 | 1.0))
        && first.windows(2).into_iter().all(|pair| pair[1] == pair[0] + 1.0)
}

/// A complaint of a table whose first column counts its rows.
pub(super) fn refuse_index(name: &str, numbers: &Array2<f64>) -> Result<()> {
    if !counts_rows(numbers.column(0)) {
        return Ok(());
    }
    let second: Vec<f64> = numbers.columns().into_iter().nth(1).map(|column| column.to_vec()).unwrap_or_default();
    let advice = match goes_one_way(&second) && numbers.ncols() > 2 && second.iter().all(|nm| *nm >= SHORTEST_NM) {
        true => {
            "its wavelengths seem to stand in the second: leave out the first, or head both, as in `No.,wavelength_nm` \
                 (a line behind a # is a comment)"
        }
        false => "wavelengths are wanted there",
    };
    Err(Error::format(
        name,
        format!(
            "its first column counts its rows, {} to {}; {advice}",
            numbers[(0, 0)],
            numbers[(numbers.nrows() - 1, 0)]
        ),
    ))
}

/// What is said of numbers whose first column holds no wavelengths of light and of which another does; nothing of others.
pub(super) fn are_swapped(numbers: &Array2<f64>) -> Option<String> {
    /// What a camera sees, with room.
    const SEEN_NM: std::ops::RangeInclusive<f64> = 200.0..=5000.0;
    let is_light = |column: ArrayView1<f64>| {
        let values = column.to_vec();
        values.len() > 1 && goes_one_way(&values) && values.iter().all(|nm| SEEN_NM.contains(nm))
    };
    let is_dark = numbers.column(0).iter().all(|nm| *nm < SHORTEST_NM);
    let place = (1..numbers.ncols()).find(|place| is_light(numbers.column(*place))).filter(|_| is_dark)?;
    Some(format!("its wavelengths seem to stand in column {}; they must be the first column", place + 1))
}

/// The names behind that of the wavelengths in the comment next above the rows of a table without a heading, where it has one for each of
/// its `width` columns, as libRadtran and Python's `savetxt` write headings.
pub(super) fn in_comment(text: &str, width: usize) -> Option<StringRecord> {
    let row = delimited::rows(text).next()?;
    let above: Vec<&str> = text.lines().take_while(|line| !std::ptr::eq(*line, row)).collect();
    let above = above.join("\n");
    let comment = delimited::comments(&above).filter(|comment| !comment.trim().is_empty()).last()?;
    let by_mark = |mark: char| comment.split(mark).map(str::trim).collect::<Vec<_>>();
    let parted = [
        by_mark('\t'),
        by_mark(';'),
        by_mark(','),
        delimited::bracketed(comment),
        comment.split_whitespace().filter(|_| !is_sentence(comment)).collect(),
    ];
    let are_names =
        |cells: &Vec<&str>| cells.len() == width && cells.first().is_some_and(|cell| is_of_wavelengths(cell));
    let cells = parted.into_iter().find(are_names)?;
    Some(cells.into_iter().skip(1).collect())
}

/// Whether the words of a comment tell something: `wavelength unit: nm`, `wavelength in nm`.
fn is_sentence(comment: &str) -> bool {
    const VERBS: [&str; 12] = ["in", "is", "are", "unit", "units", "of", "from", "to", "by", "for", "with", "and"];
    let is_told = |word: &str| word.ends_with([':', '=', '.']) || VERBS.contains(&word.to_lowercase().as_str());
    comment.split_whitespace().any(is_told)
}

/// A record without its first cell.
pub(super) fn without_first(record: &StringRecord) -> StringRecord {
    record.iter().skip(1).collect()
}

#[cfg(test)]
mod tests {
    use crate::formats::csv::SpectralTable;

    const UNIT: &str = "# radiance in W m-2 sr-1 nm-1";

    fn complaint(text: &str) -> String {
        SpectralTable::parse("t", text.as_bytes()).map_or_else(|error| error.to_string(), |_| "read".into())
    }

    #[test]
    fn rows_are_spectra_under_wavelengths_as_people_write_them() {
        for text in [
            "name,400nm,500nm,600nm\na,1,2,3\nb,4,5,6\n",
            "name,400 nm,500 nm,600 nm\na,1,2,3\nb,4,5,6\n",
            "id;lambda_400;lambda_500;lambda_600\n1;1,0;2,0;3,0\n2;4,0;5,0;6,0\n",
            "site\twl400.0\twl500.0\twl600.0\na\t1\t2\t3\nb\t4\t5\t6\n",
            "name,X400,X500,X600\na,1,2,3\nb,4,5,6\n",
            "name,0.4um,0.5um,0.6um\na,1,2,3\nb,4,5,6\n",
            "name,L(400 nm),L(500 nm),L(600 nm)\na,1,2,3\nb,4,5,6\n",
            "wavelength,400nm,500nm,600nm\na,1,2,3\nb,4,5,6\n",
            "name;400,0nm;500,0nm;600,0nm\na;1;2;3\nb;4;5;6\n",
            "name,600nm,500nm,400nm\na,3,2,1\nb,6,5,4\n",
            "name 400nm 500nm 600nm\na 1 2 3\nb 4 5 6\n",
            "name,L_400,L_500,L_600\na,1,2,3\nb,4,5,6\n",
            "name;L400;L500;L600\na;1,0;2,0;3,0\nb;4,0;5,0;6,0\n",
            "name L400 L500 L600\na 1 2 3\nb 4 5 6\n",
            ",Rad_400,Rad_500,Rad_600\na,1,2,3\nb,4,5,6\n",
            "name,Rad_400nm,Rad_500nm,Rad_600nm\na,1,2,3\nb,4,5,6\n",
            "id,sky_L_400,sky_L_500,sky_L_600\n1,1,2,3\n2,4,5,6\n",
            "site,radiance(600),radiance(500),radiance(400)\n412,3,2,1\n413,6,5,4\n",
            "wavelength,L400,L500,L600\na,1,2,3\nb,4,5,6\n",
        ] {
            let table = SpectralTable::parse("t", format!("{UNIT}\n{text}").as_bytes())
                .unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(table.wavelength_nm, [400.0, 500.0, 600.0], "{text}");
            assert_eq!(table.values.iter().copied().collect::<Vec<_>>(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "{text}");
        }
        // Angles and times above columns.
        for heading in ["0,30,60", "10,20,30", "401,402,403", "2019,2020,2021"] {
            let text = format!("wavelength (nm),{heading}\n350,1,2,3\n600,4,5,6\n850,7,8,9\n");
            let table = SpectralTable::parse("t", text.as_bytes()).unwrap();
            assert_eq!((table.columns.join(",").as_str(), table.wavelength_nm.len()), (heading, 3));
        }
        // Columns named by a wavelength of something else, beside one of wavelengths.
        let excited = SpectralTable::parse("t", b"wavelength_nm,ex350nm,ex360nm\n400,1,2\n500,3,4\n").unwrap();
        assert_eq!((excited.columns[0].as_str(), excited.wavelength_nm.len()), ("ex350nm", 2));
    }

    /// Where wavelengths stand in the first column, `L400` is the name of a curve.
    #[test]
    fn numbers_behind_words_are_wavelengths_where_nothing_else_is() {
        for (text, columns) in [
            ("wavelength,L400,L500\n400,1,2\n500,3,4\n", "L400 L500"),
            ("x,L_400,L_500,L_600\n400,1,2,3\n500,3,4,5\n", "L_400 L_500 L_600"),
            (",sky401,sky402\n400,1,2\n500,3,4\n", "sky401 sky402"),
            ("name,L1,L2,L3\n400,1,2,3\n500,3,4,5\n", "L1 L2 L3"),
        ] {
            let table = SpectralTable::parse("t", text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!((table.columns.join(" ").as_str(), table.wavelength_nm), (columns, vec![400.0, 500.0]));
        }
        let wanted = "t: line 1: its heading seems to hold wavelengths behind `ch`, which is no known name of a radiance; where the rows are \
                      spectra of radiance, write it as `name,400nm,500nm,...`";
        assert_eq!(complaint("time,ch400,ch500\n12:00,1,2\n13:00,1,2\n"), wanted);
        // Years and places are told as what they were.
        assert!(!complaint("name,sky2019,sky2020\na,1,2\nb,1,2\n").contains("wavelengths behind"));
        for heading in ["name,reflectance_400,reflectance_500", "name,Reflectance 400nm,Reflectance 500nm"] {
            let table = SpectralTable::parse("t", format!("{UNIT}\n{heading}\na,1,2\n").as_bytes()).unwrap();
            let refused = table.radiance_unit(0, None).unwrap_err().to_string();
            assert!(refused.contains("a ratio, not the radiance itself"), "{heading}: {refused}");
        }
    }

    #[test]
    fn headings_that_are_wavelengths_but_for_some_are_told() {
        for (text, wanted) in [
            (
                "name,sza,L400,L500,L600,L700\nz,50.7,1,2,3,4\n",
                "line 1, column 2: `sza` is no wavelength as the others are, such as `L400`",
            ),
            (
                "name,400nm,5O0nm,600nm,700nm\na,1,2,3,4\n",
                "line 1, column 3: `5O0nm` is no wavelength as the others are, such as `400nm`",
            ),
            (
                "# x\nid,site,400nm,500nm,600nm\n1,a,1,2,3\n",
                "line 2, column 2: `site` is no wavelength as the others are, such as `400nm`",
            ),
            (
                "name,sza,400,500,600,700\nz,50.7,1,2,3,4\ny,40,1,2,3,4\n",
                "line 1, column 2: `sza` is no wavelength, as the others are; leave the column out",
            ),
            ("400nm,500nm,600nm\n1,2,3\n4,5,6\n", "its rows are spectra without names"),
            ("id,site,400,500,600\n1,a,1,2,3\n", "line 1, column 2: `site` is no wavelength, as the others are"),
        ] {
            assert!(complaint(text).contains(wanted), "{text}: {}", complaint(text));
        }
    }

    #[test]
    fn a_comment_above_numbers_names_their_columns() {
        for (text, names) in [
            ("# lambda edir uu\n400 1 2\n410 1 2\n", "edir uu"),
            ("# made by x\n# wavelength (nm), L [W m-2 sr-1 nm-1], M\n\n400,1.5,2\n410,1,2\n", "L [W m-2 sr-1 nm-1] M"),
            ("% lambda (nm)  L (W m-2 sr-1 nm-1)\n400 1\n410 2\n", "L (W m-2 sr-1 nm-1)"),
            ("# wavelength, radiance\n400 1 2\n410 1 2\n", "column1 column2"),
            ("# lambda a b\n# 3 spectra measured\n400 1 2\n410 1 2\n", "column1 column2"),
            ("400 1 2\n410 1 2\n# lambda a b\n", "column1 column2"),
        ] {
            let table = SpectralTable::parse("t", text.as_bytes()).unwrap();
            assert_eq!(table.columns.join(" "), names, "{text}");
            assert_eq!(table.column_index(Some("column1")).unwrap(), 0);
        }
        let table = SpectralTable::parse("t", b"# lambda edir uu\n400 1 2\n410 1 2\n").unwrap();
        assert!(table.radiance_unit(0, None).unwrap_err().to_string().contains("`edir`, an irradiance"));
    }

    #[test]
    fn columns_that_count_rows_are_no_wavelengths() {
        for text in [
            "No.,wavelength,L\n1,400,1\n2,500,2\n3,600,3\n",
            "index;wl;L\n0;400;1\n1;500;2\n2;600;3\n",
            ",wavelength_nm,L\n0,400,1\n1,500,2\n2,600,3\n",
            "id,wave,L\n1,400,1\n2,500,2\n3,600,3\n",
            "pixel,lambda,L\n,nm,W m-2 sr-1 nm-1\n1,400,1\n2,500,2\n3,600,3\n",
            "n lambda_um L\n1 0.4 1\n2 0.5 2\n3 0.6 3\n",
        ] {
            let table = SpectralTable::parse("t", text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(table.wavelength_nm, [400.0, 500.0, 600.0], "{text}");
            assert_eq!(
                (table.columns, table.values.into_raw_vec_and_offset().0),
                (vec!["L".to_owned()], vec![1.0, 2.0, 3.0])
            );
        }
        for (text, wanted) in [
            (
                "#,wavelength,L\n1,400,0.1\n2,500,0.2\n3,600,0.3\n",
                "t: its first column counts its rows, 1 to 3; its wavelengths seem",
            ),
            ("0 400 1\n1 500 2\n2 600 3\n", "t: its first column counts its rows, 0 to 2; its wavelengths seem"),
            ("a,b\n1,0.4\n2,0.5\n3,0.6\n", "t: its first column counts its rows, 1 to 3; wavelengths are wanted there"),
            ("id,wavelength,L\n7,400,1\n3,500,2\n9,600,3\n", "t: its wavelengths, `wavelength`, stand in column 2"),
            ("time,wavelength,L\n12:00,400,1\n12:00,500,2\n", "t: its wavelengths, `wavelength`, stand in column 2"),
            ("wavelength,a,wavelength,b\n400,1,400,2\n500,2,500,3\n", "t: its columns 1 and 3 both name wavelengths"),
            (
                "0.1,400\n0.12,500\n0.1,700\n",
                "t: its wavelengths seem to stand in column 2; they must be the first column",
            ),
            ("L,x\n0.1,700\n0.12,500\n", "t: its wavelengths seem to stand in column 2; they must be the first column"),
            ("um,L\n0.4,400\n0.4,500\n", "t: the wavelength 400 nm stands there twice"),
            ("No.,wavelength,L\n1,4O0,1\n2,500,2\n3,600,3\n", "t: line 2, column 2: `4O0` is no number"),
        ] {
            assert!(complaint(text).starts_with(wanted), "{text}: {}", complaint(text));
        }
    }
}

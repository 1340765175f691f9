//! Relative responses of R, G and B as tables have them, and what in them may mislead.

use super::csv::SpectralTable;
use super::response_import::{self, Samples};
use super::wavelengths::check_nm;
use crate::cfa::Class;
use crate::error::{Error, Result};
use crate::spectrum::{Curve, not_in_order, rounded_to_zero};
use crate::units::{OtherUnit, Stated};

/// Fewer wavelengths follow no filter of a camera.
const LEAST_SAMPLES: usize = 10;
/// Share of a class's largest response that a table may end at: beyond, it cuts through the class.
const MOST_AT_AN_END: f64 = 0.25;
/// The share from which it is told.
pub(super) const TOLD_AT_AN_END: f64 = 0.01;
/// Largest responses of the classes that are this close to each other look as if each were set to the same.
const ALIKE: f64 = 1e-3;

/// Relative responses of R, G and B on common wavelengths, whose ratios are those of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseTable {
    /// Maker and model, where the file names them.
    pub about: Option<String>,
    /// The curves of R, G and B.
    pub classes: [Curve; 3],
    /// What may mislead, each a warning.
    pub doubts: Vec<String>,
    /// The heading that says that it counts energy: `R (A/W)`.
    pub of_energy: Option<String>,
}

impl ResponseTable {
    /// Reads a file of rawtoaces or dcamprof, or a CSV table; `name` is the file in messages. Columns of tables are R, G and
    /// B, or red, green and blue, in any case, or, where `of` is named, `OF R` and so on; three without names are taken to be
    /// R, G and B if their wavelengths are in that order.
    ///
    /// # Errors
    ///
    /// Those of [`SpectralTable::parse`]; [`Error::Format`] for what has not one column for each class, and for values that
    /// make no response.
    pub fn parse(name: &str, bytes: &[u8], of: Option<&str>) -> Result<Self> {
        if let (None, Some(samples)) = (of, response_import::samples(name, bytes)?) {
            let Samples { about, wavelength_nm, values, doubts } = samples;
            let (wavelength_nm, values) = in_order(name, wavelength_nm, values)?;
            let table = Self::checked(name, wavelength_nm, values)?;
            let about = Some(about).filter(|about| !about.is_empty());
            return Ok(Self { about, doubts: [doubts, table.doubts].concat(), ..table });
        }
        let table = SpectralTable::parse(name, bytes)?;
        let (places, told) = places(&table, of).map_err(|problem| Error::format(name, problem))?;
        places.iter().try_for_each(|place| table.check(*place))?;
        let values = places.map(|place| table.values.row(place).to_vec());
        let nameless = told.is_some() && !has_names(&table);
        if let Some(problem) = exchanged(&table.wavelength_nm, &values).filter(|_| nameless) {
            let problem = format!("its columns have no names, and {problem}; name them R, G and B");
            return Err(Error::format(name, problem));
        }
        let mut checked = Self::checked(name, table.wavelength_nm.clone(), values)?;
        for (class, place) in checked.classes.iter_mut().zip(places) {
            *class = table.curve_at(place)?.without_rounding();
        }
        checked.doubts.extend(told);
        let is_per_watt =
            |place: &usize| matches!(table.stated(*place), Some(Stated::Other { kind: OtherUnit::Responsivity, .. }));
        checked.of_energy = places.iter().find(|place| is_per_watt(place)).map(|place| table.columns[*place].clone());
        Ok(checked)
    }

    /// Checks values of R, G and B at ascending wavelengths in nm, and looks for what may mislead.
    fn checked(name: &str, wavelength_nm: Vec<f64>, values: [Vec<f64>; 3]) -> Result<Self> {
        let refuse = |problem: String| Err(Error::format(name, problem));
        if wavelength_nm.len() < LEAST_SAMPLES {
            return refuse(format!(
                "it has {} wavelengths; a response needs at least {LEAST_SAMPLES}",
                wavelength_nm.len()
            ));
        }
        let values = values.map(rounded_to_zero);
        let ends = [wavelength_nm[0], wavelength_nm[wavelength_nm.len() - 1]];
        let mut cut = Vec::new();
        for (class, values) in Class::ALL.into_iter().zip(&values) {
            let letter = class.letter();
            if let Some(at) = values.iter().position(|value| !(0.0..f64::INFINITY).contains(value)) {
                return refuse(format!(
                    "its {letter} is {} at {} nm; a response is not negative: what is noise about none is 0",
                    values[at], wavelength_nm[at]
                ));
            }
            let largest = largest(values);
            if largest == 0.0 {
                return refuse(format!("its {letter} is 0 everywhere"));
            }
            for (nm, value) in ends.into_iter().zip([values[0], values[values.len() - 1]]) {
                let share = value / largest;
                if share > MOST_AT_AN_END {
                    return refuse(format!(
                        "it ends at {nm} nm, where {letter} has {:.0} % of its largest response; it cuts through the class: \
                         give a table that goes on",
                        100.0 * share
                    ));
                }
                if share > TOLD_AT_AN_END {
                    cut.push(format!("{letter} has {:.1} % at {nm} nm", 100.0 * share));
                }
            }
        }
        let mut doubts = Vec::new();
        if !cut.is_empty() {
            let cut = cut.join(", ");
            doubts.push(ends_early("response", &cut));
        }
        doubts.extend(normalized(&values));
        doubts.extend(exchanged(&wavelength_nm, &values));
        let curve = |values| Curve::new(wavelength_nm.clone(), values).map_err(|problem| Error::format(name, problem));
        let [red, green, blue] = values;
        Ok(Self { about: None, classes: [curve(red)?, curve(green)?, curve(blue)?], doubts, of_energy: None })
    }
}

/// A warning of a table that ends too early, with what is left there.
pub(super) fn ends_early(what: &str, cut: &str) -> String {
    format!("its {what} ends before it has faded, and is 0 beyond: of its largest, {cut}")
}

/// Whether the columns of a table have names.
fn has_names(table: &SpectralTable) -> bool {
    table.columns.iter().enumerate().any(|(place, name)| *name != format!("column{}", place + 1))
}

/// The columns of R, G and B, and a warning of how they were found or of what is left.
///
/// # Errors
///
/// What is missing, in words.
fn places(table: &SpectralTable, of: Option<&str>) -> std::result::Result<([usize; 3], Option<String>), String> {
    let columns = &table.columns;
    if of.is_none() && columns.len() == 3 && !has_names(table) {
        return Ok(([0, 1, 2], Some("its columns have no names; they are taken as R, G and B".into())));
    }
    let bare = |column: &str| column.split(['(', '[']).next().unwrap_or_default().trim().to_lowercase();
    let one = |class: Class, word: &str| {
        let letter = class.letter();
        let wanted = of.map_or_else(|| letter.to_string(), |of| format!("{of} {letter}"));
        let is_it = |place: &usize| {
            let bare = bare(&columns[*place]);
            bare == wanted.to_lowercase() || of.is_none() && bare == word
        };
        let mut found = (0..columns.len()).filter(is_it);
        found.next().filter(|_| found.next().is_none()).ok_or_else(|| {
            let some: Vec<&str> = columns.iter().take(8).map(String::as_str).collect();
            format!("it needs one column `{wanted}`; it has {}", some.join(", "))
        })
    };
    let places = [one(Class::Red, "red")?, one(Class::Green, "green")?, one(Class::Blue, "blue")?];
    let left: Vec<&str> =
        (0..columns.len()).filter(|place| !places.contains(place)).map(|place| columns[place].as_str()).collect();
    let told = (of.is_none() && !left.is_empty()).then(|| format!("its columns {} do not count", left.join(", ")));
    Ok((places, told))
}

/// Samples in the order of their wavelengths, which must be unlike, and look like nm.
fn in_order(name: &str, wavelength_nm: Vec<f64>, values: [Vec<f64>; 3]) -> Result<(Vec<f64>, [Vec<f64>; 3])> {
    let mut order: Vec<usize> = (0..wavelength_nm.len()).collect();
    order.sort_by(|a, b| wavelength_nm[*a].total_cmp(&wavelength_nm[*b]));
    let sorted = |unsorted: &Vec<f64>| -> Vec<f64> { order.iter().map(|place| unsorted[*place]).collect() };
    let (wavelength_nm, values) = (sorted(&wavelength_nm), values.each_ref().map(sorted));
    check_nm(&wavelength_nm).map_err(|problem| Error::format(name, problem))?;
    Ok((wavelength_nm, values))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// A warning of classes that are each scaled to the same largest response.
fn normalized(values: &[Vec<f64>; 3]) -> Option<String> {
    let largest = values.each_ref().map(|values| largest(values));
    let are_alike = largest.iter().all(|one| (one / largest[0] - 1.0).abs() < ALIKE);
    are_alike.then(|| {
        "its classes have the same largest response, as if each were normalized by itself: how R, G and B stand to each other \
         is then not known, and a matrix is off by a factor for each class"
            .to_owned()
    })
}

/// A warning of classes whose mean wavelengths are not in the order B, G, R.
fn exchanged(wavelength_nm: &[f64], values: &[Vec<f64>; 3]) -> Option<String> {
    let mean = |values: &Vec<f64>| -> f64 {
        let moment: f64 = values.iter().zip(wavelength_nm).map(|(value, nm)| value * nm).sum();
        moment / values.iter().sum::<f64>()
    };
    let [red, green, blue] = values.each_ref().map(mean);
    (!(blue < green && green < red)).then(|| not_in_order([red, green, blue]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of bells at these wavelengths with these heights.
    fn table(names: &str, bells: [(f64, f64); 3], [start, end]: [i32; 2]) -> String {
        let rows = (start..=end).step_by(10).map(|nm| {
            let values = bells.map(|(peak, height)| height * (-((f64::from(nm) - peak) / 35.0).powi(2)).exp());
            format!("{nm},{:.6},{:.6},{:.6}\n", values[0], values[1], values[2])
        });
        format!("nm,{names}\n{}", rows.collect::<String>())
    }

    const BELLS: [(f64, f64); 3] = [(600.0, 0.5), (540.0, 1.0), (460.0, 0.8)];

    fn parse(text: &str, of: Option<&str>) -> std::result::Result<ResponseTable, String> {
        ResponseTable::parse("r.csv", text.as_bytes(), of).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_taken_by_name() {
        let read = parse(&table("R,G,B", BELLS, [380, 780]), None).unwrap();
        assert!(read.doubts.is_empty(), "{:?}", read.doubts);
        assert_eq!([600.0, 540.0, 460.0].map(|nm| read.classes[1].at(nm)), [0.052931, 1.0, 0.005383]);
        let bgr = table("B,g,R", [BELLS[2], BELLS[1], BELLS[0]], [380, 780]);
        assert_eq!(parse(&bgr, None).unwrap(), read);
        let of_two = table("a R,a G,a B", BELLS, [380, 780]);
        assert_eq!(parse(&of_two, Some("a")).unwrap(), read);
        assert!(parse(&of_two, Some("b")).unwrap_err().contains("it needs one column `b R`; it has a R, a G, a B"));
        assert!(parse(&of_two, None).unwrap_err().contains("it needs one column `R`"));
        assert!(parse(&table("R,G,G2", BELLS, [380, 780]), None).unwrap_err().contains("it needs one column `B`"));
    }

    #[test]
    fn tables_of_other_forms_are_the_same_response() {
        let text = table("R,G,B", BELLS, [380, 780]);
        let wanted = parse(&text, None).unwrap();
        for other in [
            text.replace("nm,R,G,B", "wavelength (nm);Red;Green (relative);BLUE").replace(',', ";"),
            text.replace(',', "\t"),
            // Commas in decimals.
            text.replace(',', ";").replace('.', ","),
            {
                let mut lines: Vec<&str> = text.lines().collect();
                lines[1..].reverse();
                lines.join("\n")
            },
        ] {
            assert_eq!(parse(&other, None).unwrap(), wanted, "{other}");
        }
        let nameless = parse(text.split_once('\n').unwrap().1, None).unwrap();
        assert_eq!(
            (nameless.classes, &nameless.doubts[..]),
            (wanted.classes.clone(), &["its columns have no names; they are taken as R, G and B".to_owned()][..])
        );
        let bgr = table("B,G,R", [BELLS[2], BELLS[1], BELLS[0]], [380, 780]);
        let refused = parse(bgr.split_once('\n').unwrap().1, None).unwrap_err();
        assert!(
            refused.contains("have no names, and the mean wavelengths of R, G and B are 460, 540 and 600 nm"),
            "{refused}"
        );
        let more =
            parse(&text.replace("nm,R,G,B", "nm,R,G,B,IR").replace("\n", ",0\n").replacen("IR,0", "IR", 1), None)
                .unwrap();
        assert_eq!((more.classes, &more.doubts[..]), (wanted.classes, &["its columns IR do not count".to_owned()][..]));
    }

    /// Files of other programs come to the same checks as tables.
    #[test]
    fn files_of_other_programs_are_checked_as_tables_are() {
        let rows: Vec<String> = table("R,G,B", BELLS, [380, 780])
            .lines()
            .skip(1)
            .map(|line| {
                let (nm, values) = line.split_once(',').unwrap();
                format!("\"{nm}\": [{values}]")
            })
            .collect();
        let of_rows = |rows: &[String]| {
            let data = rows.join(", ");
            let head = r#""header": {"manufacturer": "Maker", "model": "M 1"}"#;
            format!(
                r#"{{{head}, "spectral_data": {{"units": "relative", "index": {{"main": ["R", "G", "B"]}}, "data": {{"main": {{{data}}}}}}}}}"#
            )
        };
        let wanted = parse(&table("R,G,B", BELLS, [380, 780]), None).unwrap();
        let descending: Vec<String> = rows.iter().rev().cloned().collect();
        for rows in [&rows, &descending] {
            let read = parse(&of_rows(rows), None).unwrap();
            assert_eq!((read.about.as_deref(), &read.classes), (Some("Maker M 1"), &wanted.classes));
        }
        let complaint = |rows: Vec<String>| parse(&of_rows(&rows), None).unwrap_err();
        assert!(complaint([rows.clone(), vec![rows[3].clone()]].concat()).contains("410 nm stands there twice"));
        assert!(complaint(rows[..5].to_vec()).contains("it has 5 wavelengths"));
        let negative = rows.iter().map(|row| row.replace("[0", "[-0")).collect();
        assert!(complaint(negative).contains("a response is not negative"));
        let micrometers = rows.iter().map(|row| row.replacen('"', "\"0.", 1)).collect();
        assert!(complaint(micrometers).contains("looks like micrometers"));
    }

    /// Sums of what is zero leave less than the rounding of the rest.
    #[test]
    fn what_rounding_leaves_below_zero_is_zero() {
        let rows =
            |least: &str| table("R,G,B", BELLS, [400, 700]).replacen("\n400,", &format!("\n399,{least},0,0\n400,"), 1);
        assert_eq!(parse(&rows("-1.6e-22"), None).unwrap().classes[0].extremes().0, 0.0);
        assert!(parse(&rows("-1.6e-12"), None).unwrap_err().contains("a response is not negative"));
    }

    #[test]
    fn what_makes_no_response_is_refused() {
        let complaint = |bells, range| parse(&table("R,G,B", bells, range), None).unwrap_err();
        assert!(complaint([(600.0, 0.0), BELLS[1], BELLS[2]], [380, 780]).contains("its R is 0 everywhere"));
        let negative = complaint([BELLS[0], (540.0, -1.0), BELLS[2]], [400, 700]);
        assert!(
            negative.contains("its G is -0.000") && negative.contains("; a response is not negative"),
            "{negative}"
        );
        let cut = complaint(BELLS, [380, 600]);
        assert!(cut.contains("it ends at 600 nm, where R has 100 % of its largest response"), "{cut}");
        assert!(complaint(BELLS, [500, 580]).contains("it has 9 wavelengths; a response needs at least 10"));
    }

    #[test]
    fn what_may_mislead_is_told() {
        let doubt = |bells, range| -> String {
            let doubts = parse(&table("R,G,B", bells, range), None).unwrap().doubts;
            assert_eq!(doubts.len(), 1, "{doubts:?}");
            doubts[0].clone()
        };
        let cut = doubt(BELLS, [400, 670]);
        // exp(−(60/35)²) = 5.29 % of B at 400 nm, exp(−2²) = 1.83 % of R at 670.
        assert!(cut.ends_with("of its largest, R has 1.8 % at 670 nm, B has 5.3 % at 400 nm"), "{cut}");
        let alike = doubt(BELLS.map(|(peak, _)| (peak, 1.0)), [380, 780]);
        assert!(alike.contains("as if each were normalized by itself"), "{alike}");
        let exchanged = doubt([BELLS[2], BELLS[1], BELLS[0]], [380, 780]);
        assert!(exchanged.contains("are 460, 540 and 600 nm"), "{exchanged}");
    }
}

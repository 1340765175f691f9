//! Columns of tables of spectra that are no spectra but how sure others are, or marks of their quality.

/// What such columns are called, alone or with what they are of.
const WORDS: [&str; 25] = [
    "uncertainty",
    "uncertainties",
    "uncert",
    "unc",
    "std",
    "stdev",
    "stddev",
    "stderr",
    "sd",
    "sem",
    "sigma",
    "σ",
    "error",
    "errors",
    "err",
    "deviation",
    "rmse",
    "variance",
    "ci95",
    "u95",
    "±",
    "unsicherheit",
    "messunsicherheit",
    "standardabweichung",
    "incertitude",
];

/// What columns of marks are called.
const FLAGS: [&str; 6] = ["flag", "flags", "qa", "qc", "quality", "qualityflag"];

/// The places of the curves that are none; nothing where all are spectra, or none is.
pub(super) fn others(columns: &[String]) -> Option<Vec<usize>> {
    let kept: Vec<usize> = (0..columns.len()).filter(|index| !is_one(&columns[*index])).collect();
    (!kept.is_empty() && kept.len() < columns.len()).then_some(kept)
}

/// What is said of the others.
pub(super) fn told(name: &str, columns: &[String], kept: &[usize]) -> String {
    const SHOWN: usize = 4;
    let left: Vec<&str> =
        (0..columns.len()).filter(|index| !kept.contains(index)).map(|index| columns[index].as_str()).collect();
    let shown: Vec<String> = left.iter().take(SHOWN).map(|column| format!("`{column}`")).collect();
    let more = if left.len() > SHOWN { ", …" } else { "" };
    let flags = left.iter().filter(|column| has_one(column, &FLAGS)).count();
    let are = match (left.len(), flags) {
        (1, 0) => "is an uncertainty, no spectrum, and does",
        (1, _) => "is a flag, no spectrum, and does",
        (_, 0) => "are uncertainties, no spectra, and do",
        (all, flags) if flags == all => "are flags, no spectra, and do",
        _ => "are uncertainties and flags, no spectra, and do",
    };
    format!("{name}: by its name {}{more} {are} not count; under another name it would be a spectrum", shown.join(", "))
}

/// Whether a heading, without its unit, has such a word.
fn is_one(heading: &str) -> bool {
    // As the Guide to the expression of uncertainty in measurement writes it.
    let is_function = heading.trim_start().starts_with("u(");
    is_function || has_one(heading, &WORDS) || has_one(heading, &FLAGS)
}

/// Whether a heading, without its unit, has one of some words.
fn has_one(heading: &str, words: &[&str]) -> bool {
    let bare = heading.split(['(', '[']).next().unwrap_or_default().to_lowercase();
    bare.split(|letter: char| !(letter.is_alphanumeric() || letter == '±')).any(|word| words.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::csv::SpectralTable;

    #[test]
    fn uncertainties_are_no_spectra() {
        for heading in [
            "u(L) [%]",
            "zenith ±",
            "Unsicherheit",
            "uncertainty (%)",
            "std",
            "L_std",
            "Sigma [W m-2 sr-1 nm-1]",
            "σ",
            "radiance error",
            "u unc.",
            "quality flag",
            "QA",
            "qc_flag",
        ] {
            assert!(is_one(heading), "{heading}");
        }
        for heading in ["radiance (W m-2 sr-1 nm-1)", "standard white", "sky", "sdss", "x (std)", "30"] {
            assert!(!is_one(heading), "{heading}");
        }
        let text = "nm,L,std,M,uncertainty (%)\n400,1,x,2,5\n500,3,0.1,4,5\n";
        let table = SpectralTable::parse("t", text.as_bytes()).unwrap();
        assert_eq!((table.columns.join(" "), table.curve(Some("M")).unwrap().at(450.0)), ("L M".into(), 3.0));
        // Where nothing else is there they are what is wanted.
        assert_eq!(SpectralTable::parse("t", b"nm,sigma\n400,1\n500,2\n").unwrap().columns, ["sigma"]);
        let columns = ["L", "std"].map(str::to_owned);
        assert_eq!(
            told("t", &columns, &[0]),
            "t: by its name `std` is an uncertainty, no spectrum, and does not count; under another name it would be a spectrum"
        );
        for (columns, said) in [
            (["L", "qa"].as_slice(), "`qa` is a flag, no spectrum, and does"),
            (&["L", "flag", "QC"], "`flag`, `QC` are flags, no spectra, and do"),
            (&["L", "std", "flag"], "`std`, `flag` are uncertainties and flags, no spectra, and do"),
        ] {
            let columns: Vec<String> = columns.iter().map(|name| (*name).to_owned()).collect();
            assert!(told("t", &columns, &[0]).contains(said));
        }
    }
}

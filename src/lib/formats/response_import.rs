//! Responses of cameras as other programs keep them: rawtoaces in three layouts, dcamprof.

use crate::error::{Error, Result};
use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer, MapAccess, Visitor};
use std::collections::BTreeMap;
use std::fmt;

/// A file of one camera's response has a few kilobytes; this is none.
const MAX_BYTES: usize = 16 << 20;
/// So many wavelengths no such file has.
const MAX_SAMPLES: usize = 100_000;
/// Where the plain layout of rawtoaces begins, which does not say so: its files end in `_380_780_5`.
const PLAIN_NM: [f64; 2] = [380.0, 780.0];

/// Samples of R, G and B, with what is told of the camera.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Samples {
    /// Maker and model.
    pub(super) about: String,
    /// Wavelengths in nm, in the order of the file.
    pub(super) wavelength_nm: Vec<f64>,
    /// Values of R, G and B at them.
    pub(super) values: [Vec<f64>; 3],
    /// What may mislead.
    pub(super) doubts: Vec<String>,
}

/// The samples of a file of another program; none where it is none of these, and may be a table.
///
/// # Errors
///
/// [`Error::Format`] for JSON of another kind, and for what such a file lacks.
pub(super) fn samples(name: &str, bytes: &[u8]) -> Result<Option<Samples>> {
    let refuse = |problem: String| Error::format(name, problem);
    let is_json = bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{');
    if bytes.len() > MAX_BYTES && is_json {
        return Err(refuse(format!("it has {} MiB; no response does", bytes.len() >> 20)));
    }
    if !is_json {
        return plain(bytes).transpose().map_err(refuse);
    }
    let keys: BTreeMap<String, serde::de::IgnoredAny> = json(bytes).map_err(refuse)?;
    let found = if keys.contains_key("spectral_data") {
        json::<Rawtoaces>(bytes).and_then(Rawtoaces::samples)
    } else if keys.contains_key("ssf_bands") {
        json::<Dcamprof>(bytes).and_then(Dcamprof::samples)
    } else if keys.contains_key("sensitivity") {
        json::<Early>(bytes).and_then(Early::samples)
    } else {
        Err("it is JSON, but no response of rawtoaces (`spectral_data`, or `sensitivity`) or dcamprof (`ssf_bands`)"
            .into())
    };
    found.map(Some).map_err(refuse)
}

type Found<T> = std::result::Result<T, String>;

fn json<T: DeserializeOwned>(bytes: &[u8]) -> Found<T> {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    serde_json::from_slice(text).map_err(|error| format!("as JSON: {error}"))
}

/// Maker and model in one line.
fn about(words: [&str; 2]) -> String {
    words.map(str::trim).join(" ").trim().to_owned()
}

/// Wavelengths from start to end by step, of which there must be `count`.
fn range([start, end, step]: [f64; 3], count: usize) -> Found<Vec<f64>> {
    let steps = (end - start) / step;
    let wrong =
        || format!("its wavelengths, {start} to {end} nm by {step} nm, are not {count}, as many as its samples");
    if !(step > 0.0 && steps >= 0.0 && count <= MAX_SAMPLES) || (steps - (count as f64 - 1.0)).abs() > 1e-6 {
        return Err(wrong());
    }
    Ok((0..count).map(|place| start + step * place as f64).collect())
}

/// Rows of R, G and B as a list for each.
fn by_class(rows: impl IntoIterator<Item = Vec<f64>>, order: [usize; 3]) -> Found<[Vec<f64>; 3]> {
    let mut classes = [const { Vec::new() }; 3];
    for row in rows {
        let [a, b, c] = row[..] else { return Err(format!("it has {} channels; R, G and B are wanted", row.len())) };
        let row = [a, b, c];
        classes.iter_mut().zip(order).for_each(|(class, place)| class.push(row[place]));
    }
    Ok(classes)
}

/// What rawtoaces-data have, schemas 0.1.0 and 1.0.0.
#[derive(Deserialize)]
struct Rawtoaces {
    header: Header,
    spectral_data: SpectralData,
}

#[derive(Deserialize)]
struct Header {
    manufacturer: Option<String>,
    model: Option<String>,
}

#[derive(Deserialize)]
struct SpectralData {
    units: String,
    index: BTreeMap<String, Vec<String>>,
    data: BTreeMap<String, Pairs>,
}

/// An object in its own order, keys that stand twice and all.
struct Pairs(Vec<(String, Vec<f64>)>);

impl<'de> Deserialize<'de> for Pairs {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Ask;
        impl<'de> Visitor<'de> for Ask {
            type Value = Pairs;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("wavelengths with a list of numbers each")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Pairs, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(Pairs(pairs))
            }
        }
        from.deserialize_map(Ask)
    }
}

impl Rawtoaces {
    fn samples(self) -> Found<Samples> {
        /// The one set of samples that rawtoaces reads.
        const MAIN: &str = "main";
        let Self { header, spectral_data: SpectralData { units, index, mut data } } = self;
        if units != "relative" {
            return Err(format!("its `units` are `{units}`; a response has `relative`"));
        }
        let channels = index.get(MAIN).ok_or("its `index` has no `main`")?;
        let place = |letter: &str| channels.iter().position(|channel| channel.eq_ignore_ascii_case(letter));
        let (3, Some(red), Some(green), Some(blue)) = (channels.len(), place("R"), place("G"), place("B")) else {
            return Err(format!("its channels are {}; R, G and B are wanted", channels.join(", ")));
        };
        let Pairs(pairs) = data.remove(MAIN).ok_or("its `data` has no `main`")?;
        let nm = |(nm, _): &(String, Vec<f64>)| {
            nm.trim().parse::<f64>().map_err(|_| format!("`{nm}` is no wavelength in nm"))
        };
        let wavelength_nm = pairs.iter().map(nm).collect::<Found<_>>()?;
        let values = by_class(pairs.into_iter().map(|(_, row)| row), [red, green, blue])?;
        let others = data.into_keys().collect::<Vec<_>>().join(", ");
        let doubts = (!others.is_empty()).then(|| format!("of its sets of samples `main` is read, {others} not"));
        let words = [header.manufacturer.unwrap_or_default(), header.model.unwrap_or_default()];
        let about = about([&words[0], &words[1]]);
        Ok(Samples { about, wavelength_nm, values, doubts: doubts.into_iter().collect() })
    }
}

/// What dcamprof reads as `--ssf`: bands are a list, or start, end and step.
#[derive(Deserialize)]
struct Dcamprof {
    #[serde(default)]
    camera_name: String,
    ssf_bands: Vec<f64>,
    red_ssf: Vec<f64>,
    green_ssf: Vec<f64>,
    blue_ssf: Vec<f64>,
}

impl Dcamprof {
    fn samples(self) -> Found<Samples> {
        let Self { camera_name, ssf_bands, red_ssf, green_ssf, blue_ssf } = self;
        let counts = [red_ssf.len(), green_ssf.len(), blue_ssf.len()];
        let wavelength_nm = match ssf_bands[..] {
            [start, end, step] if step <= end => range([start, end, step], counts[0])?,
            _ => ssf_bands,
        };
        if counts.iter().any(|count| *count != wavelength_nm.len()) {
            let [red, green, blue] = counts;
            let bands = wavelength_nm.len();
            return Err(format!("it has {bands} bands, but {red}, {green} and {blue} samples of R, G and B"));
        }
        let values = [red_ssf, green_ssf, blue_ssf];
        Ok(Samples { about: about([&camera_name, ""]), wavelength_nm, values, doubts: Vec::new() })
    }
}

/// What rawtoaces had before it named a schema.
#[derive(Deserialize)]
struct Early {
    #[serde(default)]
    maker: String,
    #[serde(default)]
    model: String,
    range: [f64; 3],
    sensitivity: Vec<Vec<f64>>,
}

impl Early {
    fn samples(self) -> Found<Samples> {
        let wavelength_nm = range(self.range, self.sensitivity.len())?;
        let values = by_class(self.sensitivity, [0, 1, 2])?;
        Ok(Samples { about: about([&self.maker, &self.model]), wavelength_nm, values, doubts: Vec::new() })
    }
}

/// The first layout of rawtoaces: maker, model and step, a line each, then R, G and B from 380 to 780 nm, parted by commas, blanks or tabs.
fn plain(bytes: &[u8]) -> Option<Found<Samples>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let is_word = |line: &&str| line.contains(|c: char| c.is_alphabetic()) && !line.contains([',', '\t', ';', '#']);
    let words = [lines.next().filter(is_word)?, lines.next()?];
    let step = lines.next().map(|line| line.strip_suffix("nm").unwrap_or(line).trim_end())?;
    let step: f64 = Some(step).filter(|step| step.bytes().all(|byte| byte.is_ascii_digit()))?.parse().ok()?;
    let number = |cell: &str| cell.trim().parse::<f64>().ok();
    let row = |line: &str| -> Option<Vec<f64>> {
        let has_commas = line.contains(',');
        if has_commas { line.split(',').map(number).collect() } else { line.split_whitespace().map(number).collect() }
    };
    let mut rows = Vec::new();
    for line in lines.take(MAX_SAMPLES) {
        match row(line) {
            Some(row) => rows.push(row),
            None => {
                return Some(Err(format!("`{}` is no row of R, G and B", line.chars().take(20).collect::<String>())));
            }
        }
    }
    let found = range([PLAIN_NM[0], PLAIN_NM[1], step], rows.len()).and_then(|wavelength_nm| {
        let values = by_class(rows, [0, 1, 2])?;
        Ok(Samples { about: about(words), wavelength_nm, values, doubts: Vec::new() })
    });
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Samples {
        samples("r", text.as_bytes()).unwrap().unwrap()
    }

    fn complaint(text: &str) -> String {
        samples("r", text.as_bytes()).unwrap_err().to_string()
    }

    const RAWTOACES: &str = r#"{
        "header": {"schema_version": "1.0.0", "manufacturer": "A", "model": "B", "laboratory": null},
        "spectral_data": {"units": "relative", "index": {"main": ["R", "G", "B"]},
            "data": {"main": {"400": [1, 2, 3], "390": [4, 5, 6]}}}
    }"#;
    const DCAMPROF: &str = r#"{"camera_name": "A B", "ssf_bands": [400, 420, 10],
        "red_ssf": [1, 4, 7], "green_ssf": [2, 5, 8], "blue_ssf": [3, 6, 9]}"#;

    #[test]
    fn all_layouts_give_the_same() {
        let wanted = Samples {
            about: "A B".into(),
            wavelength_nm: vec![400.0, 410.0, 420.0],
            values: [vec![1.0, 4.0, 7.0], vec![2.0, 5.0, 8.0], vec![3.0, 6.0, 9.0]],
            doubts: Vec::new(),
        };
        assert_eq!(read(DCAMPROF), wanted);
        assert_eq!(read(&DCAMPROF.replace("420, 10", "410, 420")), wanted);
        let early =
            r#"{"maker": "A", "model": "B", "range": [400, 420, 10], "sensitivity": [[1,2,3],[4,5,6],[7,8,9]]}"#;
        assert_eq!(read(early), wanted);
        let found = read(RAWTOACES);
        assert_eq!((found.about.as_str(), &found.wavelength_nm[..]), ("A B", &[400.0, 390.0][..]));
        assert_eq!(found.values, [vec![1.0, 4.0], vec![2.0, 5.0], vec![3.0, 6.0]]);
        // Channels are taken by name.
        let exchanged = read(&RAWTOACES.replace(r#"["R", "G", "B"]"#, r#"["b", "G", "R"]"#));
        assert_eq!(exchanged.values, [vec![3.0, 6.0], vec![2.0, 5.0], vec![1.0, 4.0]]);
        let plain = read("a\n5d\n200\n1, 2, 3\n4, 5, 6\n7, 8, 9\n");
        for same in ["a\n5d\n200 nm\n1 2 3\n4  5 6\n7 8 9", "a\n5d\n200nm\n1\t2\t3\n4\t5\t6\n7 8\t9\n"] {
            assert_eq!(read(same), plain, "{same}");
        }
        assert_eq!(plain, Samples { about: "a 5d".into(), wavelength_nm: vec![380.0, 580.0, 780.0], ..wanted });
        // Tables are left to those who read them.
        for table in [
            "nm,R,G,B\n400,1,2,3\n",
            "400 1 2 3\n410 1 2 3\n500 1 2 3\n",
            "# a\n# b\n5\n1,2,3\n",
            "wavelength\n\n\n",
            "",
        ] {
            assert_eq!(samples("r", table.as_bytes()).unwrap(), None, "{table}");
        }
    }

    #[test]
    fn what_such_files_lack_is_named() {
        let other = |right: &str, wrong: &str| {
            assert!(RAWTOACES.contains(right), "{right}");
            complaint(&RAWTOACES.replace(right, wrong))
        };
        assert!(
            other("relative", "transmittance").contains("its `units` are `transmittance`; a response has `relative`")
        );
        assert!(other(r#""R", "G""#, r#""C", "G""#).contains("its channels are C, G, B; R, G and B are wanted"));
        assert!(other(r#""R", "G""#, r#""R", "G", "G2""#).contains("its channels are R, G, G2, B"));
        assert!(other("[1, 2, 3]", "[1, 2]").contains("it has 2 channels"));
        assert!(other("[1, 2, 3]", "[1, null, 3]").contains("as JSON: invalid type: null"));
        assert!(other("\"400\"", "\"blue\"").contains("`blue` is no wavelength in nm"));
        assert!(other("\"data\": {\"main\"", "\"data\": {\"other\"").contains("its `data` has no `main`"));
        assert!(other("\"index\": {\"main\"", "\"index\": {\"other\"").contains("its `index` has no `main`"));
        assert!(other("[1, 2, 3],", "[1, 2, 3]").contains("as JSON: expected `,`"));
        assert!(complaint("{\"a\": 1}").contains("it is JSON, but no response of rawtoaces"));
        let dcamprof = |right: &str, wrong: &str| complaint(&DCAMPROF.replace(right, wrong));
        assert!(dcamprof("[1, 4, 7]", "[1, 4]").contains("400 to 420 nm by 10 nm, are not 2"));
        assert!(dcamprof("[2, 5, 8]", "[2, 5]").contains("it has 3 bands, but 3, 2 and 3 samples"));
        assert!(dcamprof("420, 10", "420, 0").contains("are not 3"));
        assert!(dcamprof("[400, 420, 10]", "[400, 420]").contains("it has 2 bands, but 3, 3 and 3"));
        assert!(complaint("a\n5d\n5\n1,2,3\n").contains("380 to 780 nm by 5 nm, are not 1"));
        assert!(complaint("a\n5d\n400\n1,2,3\n1,2,x\n").contains("`1,2,x` is no row of R, G and B"));
        assert!(complaint("a\n5d\n400\n0,1 0,2 0,3\n").contains("`0,1 0,2 0,3` is no row of R, G and B"));
        assert!(complaint("a\n5d\n400\n1,2\n1,2\n").contains("it has 2 channels"));
        let two = RAWTOACES.replace("\"main\": {", "\"infrared\": {}, \"main\": {");
        assert_eq!(read(&two).doubts, ["of its sets of samples `main` is read, infrared not"]);
        let deep = format!("{{\"spectral_data\": {}", "[".repeat(100_000));
        assert!(complaint(&deep).contains("as JSON: "));
    }
}

//! The keys of files that people write: what each is, in which unit, and who needs it; and files to begin with.
//!
//! The texts beside this one have a line for each key: its path, type, unit, default, who needs it, and what it is. Tests compare
//! them with the types that readers fill, key by key.

use crate::analysis::characterization::MATRIX_SCHEMA;
use crate::camera::sensor::SENSOR_SCHEMA;
use crate::metadata::{METADATA_SCHEMA, METADATA_TEMPLATE};
use crate::names::Named;
use std::path::Path;

/// A kind of file whose keys are described.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyPage {
    /// Sensor files.
    Sensor,
    /// Matrix files.
    Matrix,
    /// Metadata of frames: sidecars, and what files carry.
    Metadata,
}

impl Named for KeyPage {
    const ALL: &'static [Self] = &[Self::Sensor, Self::Matrix, Self::Metadata];

    fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Matrix => "matrix",
            Self::Metadata => "metadata",
        }
    }

    fn other_names(self) -> &'static [&'static str] {
        match self {
            Self::Sensor => &["sensors"],
            Self::Matrix => &["matrices"],
            Self::Metadata => &[],
        }
    }
}

/// A key: its path, type, unit, default, who needs it, and what it is.
pub type Key = [&'static str; 6];

impl KeyPage {
    /// The keys, in the order in which files have them.
    pub fn keys(self) -> impl Iterator<Item = Key> {
        let text = match self {
            Self::Sensor => include_str!("sensor.txt"),
            Self::Matrix => include_str!("matrix.txt"),
            Self::Metadata => include_str!("metadata.txt"),
        };
        text.lines().map(|line| {
            let mut cells = line.split('|').map(str::trim);
            std::array::from_fn(|_| cells.next().unwrap_or_default())
        })
    }

    /// All keys in plain text, each over what it means, under a line that says what they are of.
    pub fn table(self) -> String {
        self.table_of(&[]).unwrap_or_default()
    }

    /// The same of the keys in whose path one of these words stands, in any case, or all where there are no words; none where there is
    /// no such key.
    pub fn table_of(self, words: &[String]) -> Option<String> {
        let is_wanted = |key: &Key| {
            let path = key[0].to_lowercase();
            words.is_empty() || words.iter().any(|word| path.contains(&word.to_lowercase()))
        };
        let entry = |[path, kind, unit, default, needed, meaning]: Key| {
            let of = [("", kind), ("", unit), ("default ", default), ("needed ", needed)];
            let about = of.iter().filter(|(_, cell)| !cell.is_empty()).map(|(what, cell)| format!("{what}{cell}"));
            let head = format!("{path}: {}", about.collect::<Vec<_>>().join("; "));
            format!("{}\n{}\n", wrapped(&head, ""), wrapped(meaning, INDENT))
        };
        let entries = self.keys().filter(is_wanted).map(entry).collect::<String>();
        (!entries.is_empty()).then(|| format!("{}\n\n{entries}", self.title()))
    }

    fn title(self) -> &'static str {
        match self {
            Self::Sensor => "Sensor files (--sensor FILE.yaml)",
            Self::Matrix => "Matrix files (--matrix FILE.yaml)",
            Self::Metadata => "Metadata of frames (FRAME.yaml beside a frame, --metadata FILE.yaml)",
        }
    }

    /// A file to begin with, which is read as it is.
    pub fn template(self) -> &'static str {
        match self {
            Self::Sensor => include_str!("sensor.yaml"),
            Self::Matrix => include_str!("matrix.yaml"),
            Self::Metadata => METADATA_TEMPLATE,
        }
    }
}

/// What a key means stands so far from the edge, as does what has no room in the line of a key.
const INDENT: &str = "    ";

/// The words of a text in lines of at most 100 characters, but for a longer word; the first is indented so, the others by
/// [`INDENT`].
fn wrapped(text: &str, indent: &str) -> String {
    const COLUMNS: usize = 100;
    let mut lines = vec![indent.to_owned()];
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.trim().is_empty() => line.push_str(word),
            Some(line) if line.chars().count() + 1 + word.chars().count() <= COLUMNS => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("{INDENT}{word}")),
        }
    }
    lines.join("\n")
}

/// What schemas begin with, and what is wanted there.
pub(super) const KINDS: [(KeyPage, &str, &str, &str); 3] = [
    (KeyPage::Sensor, "cyanometer-sensor/", "a sensor file, for --sensor", SENSOR_SCHEMA),
    (KeyPage::Matrix, "cyanometer-matrix/", "a matrix file, for --matrix", MATRIX_SCHEMA),
    (KeyPage::Metadata, "cyanometer/", "the metadata of a frame, for --metadata", METADATA_SCHEMA),
];

/// What a text says that it is, where it is one of our YAML files.
pub fn kind_of(text: &str) -> Option<&'static str> {
    let schema = text.lines().find_map(|line| line.strip_prefix("schema:"))?;
    let schema = schema.trim().trim_matches(['"', '\'']);
    KINDS.iter().find(|(_, begin, ..)| schema.starts_with(begin)).map(|(_, _, kind, _)| *kind)
}

/// The same of a file, where it is small enough to be one.
pub fn kind_of_file(path: &Path) -> Option<&'static str> {
    const MOST_BYTES: u64 = 1 << 20;
    let is_small = std::fs::metadata(path).is_ok_and(|about| about.is_file() && about.len() <= MOST_BYTES);
    kind_of(&std::fs::read_to_string(path).ok().filter(|_| is_small)?)
}

/// All keys of all files.
pub fn tables() -> String {
    KeyPage::ALL.iter().map(|page| page.table()).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::characterization::{CameraMatrix, ChartRecord, MatrixUncertainty, Training};
    use crate::camera::linearity::Linearization;
    use crate::camera::optics::Exposure;
    use crate::camera::readout::ReadOut;
    use crate::camera::sensor::{CurveFile, Provenance, ResponseFiles, Sensor};
    use crate::camera::taps::Taps;
    use crate::color::difference::DifferenceReport;
    use crate::formats::yaml::{Keys, field_names, parse_matrix, parse_metadata, parse_sensor};
    use crate::metadata::*;
    use crate::spectrum::WavelengthGrid;
    use serde_yaml::{Mapping, Value};
    use std::collections::BTreeSet;

    /// The types that are filled, each by the path of the keys above it.
    fn types(page: KeyPage) -> Vec<(&'static str, Keys)> {
        match page {
            KeyPage::Sensor => vec![
                ("", field_names::<Sensor>()),
                ("provenance.", &["KEY"]),
                ("provenance.KEY.", field_names::<Provenance>()),
                ("readout.", field_names::<ReadOut>()),
                ("readout.", &["settings"]),
                ("readout.settings.", &["name", "KEY"]),
                ("readout.linearization.", field_names::<Linearization>()),
                ("readout.taps.", field_names::<Taps>()),
                ("response.", field_names::<ResponseFiles>()),
                ("response.quantum_efficiency.", field_names::<CurveFile>()),
                ("response.relative_response.", field_names::<CurveFile>()),
                ("response.cover_glass.", field_names::<CurveFile>()),
            ],
            KeyPage::Matrix => vec![
                ("", field_names::<CameraMatrix>()),
                ("camera_settings.", field_names::<CameraSettings>()),
                ("response.", field_names::<ResponseFiles>()),
                ("response.quantum_efficiency.", field_names::<CurveFile>()),
                ("response.relative_response.", field_names::<CurveFile>()),
                ("response.cover_glass.", field_names::<CurveFile>()),
                ("training.", field_names::<Training>()),
                ("uncertainty.", field_names::<MatrixUncertainty>()),
                // What stands in the record itself, and the four differences beside it.
                ("performance.", &["library", "samples", "white"]),
                ("performance.", field_names::<DifferenceReport>()),
                ("chart.", field_names::<ChartRecord>()),
                ("wavelengths.", field_names::<WavelengthGrid>()),
            ],
            KeyPage::Metadata => vec![
                ("", field_names::<Metadata>()),
                ("black_noise.", field_names::<BlackNoise>()),
                ("camera_settings.", field_names::<CameraSettings>()),
                ("capture.", field_names::<CaptureRecord>()),
                ("noise_profile.", field_names::<ProfileRecord>()),
                ("exposure.", field_names::<Exposure>()),
                ("relative_matrix.", field_names::<RelativeMatrix>()),
                ("scene.", field_names::<Scene>()),
                ("scene.upsampling.", field_names::<UpsamplingRecord>()),
                ("noise.", field_names::<NoiseRecord>()),
                ("adc.", field_names::<AdcRecord>()),
                ("adc.linearization.", field_names::<Linearization>()),
                ("average.", field_names::<ExposuresRecord>()),
                ("average.cut_off.", field_names::<CutOffRecord>()),
                ("averaged.", field_names::<DrawnExposures>()),
                ("correction.", field_names::<CorrectionRecord>()),
                ("correction.masters.", field_names::<MasterRecord>()),
                ("correction.masters.average.", field_names::<AverageRecord>()),
                ("correction.masters.noise.", field_names::<MasterNoise>()),
                ("correction.flat.", field_names::<FlatRecord>()),
                ("correction.flat.illumination.", field_names::<Illumination>()),
                ("correction.defects.", field_names::<DefectsRecord>()),
                ("demosaic.", field_names::<DemosaicRecord>()),
                ("color.", field_names::<ColorRecord>()),
                ("color.adapted.", field_names::<AdaptationRecord>()),
                ("color.matrix_residual.", field_names::<MatrixResidual>()),
                ("predicted.", field_names::<PredictedRecord>()),
                ("uncertainty.", field_names::<Coverage>()),
                ("left_out.", field_names::<LeftOut>()),
                ("history.", field_names::<HistoryEntry>()),
                ("seal.", field_names::<Seal>()),
                ("samples.", field_names::<SamplesRecord>()),
            ],
        }
    }

    #[test]
    fn every_key_that_is_read_is_described_and_no_other() {
        for page in KeyPage::ALL {
            let mut read = BTreeSet::new();
            for (above, keys) in types(*page) {
                assert!(!keys.is_empty(), "{page:?}: nothing is read into {above}");
                read.extend(keys.iter().map(|key| format!("{above}{key}")));
            }
            let described: Vec<Key> = page.keys().collect();
            let paths: BTreeSet<String> = described.iter().map(|[path, ..]| (*path).to_owned()).collect();
            assert_eq!(paths.len(), described.len(), "{page:?}: a key stands twice");
            let (missing, unknown) = (read.difference(&paths), paths.difference(&read));
            assert_eq!((missing.collect::<Vec<_>>(), unknown.collect::<Vec<_>>()), (vec![], vec![]), "{page:?}");
            for [path, kind, _, default, needed, meaning] in described {
                assert!(!kind.is_empty() && !meaning.is_empty(), "{path}");
                assert!(!(default.is_empty() && needed.is_empty()), "{path}: is it needed, or what stands in for it?");
                // Keys that hold others are told with these, or say where they are.
                let has_more = paths.iter().any(|other| other.starts_with(&format!("{path}.")));
                let is_elsewhere = meaning.contains("as in ") || meaning.contains("as in masters");
                assert_eq!(kind.ends_with("keys"), has_more || kind.ends_with("keys") && is_elsewhere, "{path}");
            }
        }
    }

    /// Whether a file of a kind is read.
    fn reads(page: KeyPage, text: &str) -> bool {
        match page {
            KeyPage::Sensor => parse_sensor("s.yaml", text.as_bytes()).is_ok_and(|sensor| sensor.check().is_ok()),
            KeyPage::Matrix => parse_matrix("m.yaml", text.as_bytes()).is_ok_and(|matrix| matrix.check().is_ok()),
            KeyPage::Metadata => parse_metadata("f.yaml", text).is_ok(),
        }
    }

    /// A template with all its examples in use.
    fn in_use(page: KeyPage) -> String {
        let is_example = |line: &str| {
            let (key, rest) = line.trim_start().split_once(':').unwrap_or(("?", ""));
            line.starts_with("  ")
                || key.chars().all(|c| c.is_ascii_lowercase() || c == '_') && (rest.is_empty() || rest.starts_with(' '))
        };
        let line = |line: &'static str| match line.trim_start().strip_prefix("# ") {
            Some(example) if is_example(example) => {
                // Another value of a key that is in use.
                let indent = &line[..line.len() - line.trim_start().len()];
                if example.starts_with("unit:") { String::new() } else { format!("{indent}{example}\n") }
            }
            _ => format!("{line}\n"),
        };
        page.template().lines().map(line).collect()
    }

    /// The mapping that holds a path's last key, and the key.
    fn holder<'a>(mut within: &'a mut Mapping, path: &'a str) -> Option<(&'a mut Mapping, &'a str)> {
        let (above, last) = path.rsplit_once('.').unwrap_or(("", path));
        for key in above.split('.').filter(|key| !key.is_empty()) {
            within = within.get_mut(key)?.as_mapping_mut()?;
        }
        Some((within, last))
    }

    #[test]
    fn templates_are_read_as_they_are_and_in_full_and_keys_are_needed_as_it_is_said() {
        for (page, most) in [(KeyPage::Sensor, 25), (KeyPage::Matrix, 6), (KeyPage::Metadata, 30)] {
            assert!(reads(page, page.template()), "{page:?}");
            let text = in_use(page);
            assert!(reads(page, &text), "{page:?}: {text}");
            let whole: Mapping = serde_yaml::from_str(&text).unwrap();
            let mut tried = 0;
            for [path, _, _, _, needed, _] in page.keys() {
                let mut less = whole.clone();
                let Some((within, key)) = holder(&mut less, path) else { continue };
                if within.remove(key).is_none() {
                    continue;
                }
                tried += 1;
                let is_needed = needed == "always" || needed.starts_with("in ") || needed.starts_with("one of the");
                let text = serde_yaml::to_string(&Value::Mapping(less)).unwrap();
                assert_eq!(reads(page, &text), !is_needed, "{page:?} without {path}, which is needed {needed}");
            }
            assert!(tried >= most, "{page:?}: {tried}");
        }
    }

    #[test]
    fn a_file_of_another_kind_is_told() {
        let said = |error: crate::error::Error| error.to_string();
        let [sensor, matrix, metadata] = [KeyPage::Sensor, KeyPage::Matrix, KeyPage::Metadata].map(KeyPage::template);
        assert_eq!(
            said(parse_sensor("x.yaml", matrix.as_bytes()).unwrap_err()),
            "x.yaml: it is a matrix file, for --matrix; a sensor file is wanted here"
        );
        assert_eq!(
            said(parse_matrix("x.yaml", sensor.as_bytes()).unwrap_err()),
            "x.yaml: it is a sensor file, for --sensor; a matrix file is wanted here"
        );
        assert_eq!(
            said(parse_matrix("x.yaml", metadata.as_bytes()).unwrap_err()),
            "x.yaml: it is the metadata of a frame, for --metadata; a matrix file is wanted here"
        );
        assert_eq!(
            said(parse_metadata("x.yaml", sensor).unwrap_err()),
            "x.yaml: it is a sensor file, for --sensor; the metadata of a frame is wanted here"
        );
        let nameless = sensor.replace("schema: ", "# schema: ");
        assert_eq!(
            said(parse_sensor("x.yaml", nameless.as_bytes()).unwrap_err()),
            "x.yaml: it has no `schema`; a sensor file begins with `schema: cyanometer-sensor/2`, as `cyanometer template sensor` \
             shows"
        );
    }
}

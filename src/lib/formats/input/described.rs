//! Whether samples are those that metadata describe.

use crate::formats::digest::SamplesDigest;
use crate::formats::register;
use crate::frame::Geometry;
use crate::metadata::{SamplesRecord, Seal};

/// What the samples of a frame are held against, by who tells their digest and by what stands ahead of them, and what is wrong already.
pub(super) fn begin(
    of_all: Option<(&SamplesRecord, &str)>,
    seal: Option<&Seal>,
    stored: &Geometry,
    name: &str,
) -> (Option<DigestCheck>, Option<String>) {
    let wrong = seal.and_then(|seal| other_size(seal, stored, name));
    let check = of_all.map(|(samples, by)| DigestCheck::of_all(samples, by, stored));
    (check.or_else(|| seal.map(DigestCheck::of_first_row)).filter(|_| wrong.is_none()), wrong)
}

/// A digest to compare with once the rows are in that it is of.
pub(super) struct DigestCheck {
    expected: String,
    /// What to say of other samples.
    problem: String,
    /// Whether who tells the digest is wrong then.
    is_doubt: bool,
    digest: SamplesDigest,
    /// Rows from the top that are still to come.
    rows: usize,
}

impl DigestCheck {
    /// Of all rows, by the sidecar or another place that tells their digest.
    fn of_all(samples: &SamplesRecord, by: &str, stored: &Geometry) -> Self {
        let problem = format!("its samples are not those that {by} describes; one of the two was changed");
        Self::of(&samples.digest, problem, true, stored.height)
    }

    /// Of all rows, by a digest that may be of other samples.
    pub(super) fn of_made(digest: &str, stored: &Geometry) -> Self {
        Self::of(digest, "its samples are others".into(), false, stored.height)
    }

    /// Of the first row alone, by what metadata tell that stand ahead of the samples.
    fn of_first_row(seal: &Seal) -> Self {
        let problem = "its samples are not those that its metadata were written with: another program changed them, and what the \
                       metadata tell of levels, place and noise need not hold any more"
            .to_owned();
        Self::of(&seal.first_row, problem, true, 1)
    }

    fn of(expected: &str, problem: String, is_doubt: bool, rows: usize) -> Self {
        Self { expected: expected.to_owned(), problem, is_doubt, digest: SamplesDigest::like(expected), rows }
    }

    /// Takes the next rows of the frame `name`, and gives the warning that they are others once all are in; it is registered where
    /// who tells the digest is wrong then.
    pub(super) fn take(check: &mut Option<Self>, rows: &[f32], stored: &Geometry, name: &str) -> Option<String> {
        let of = check.as_mut()?;
        let taken = of.rows.min(rows.len() / stored.row_samples());
        of.digest.update_rows(&rows[..taken * stored.row_samples()], stored);
        of.rows -= taken;
        let Self { expected, problem, is_doubt, digest, .. } = check.take_if(|of| of.rows == 0)?;
        if digest.finish() == expected {
            return None;
        }
        Some(told(name, &problem, is_doubt))
    }
}

/// A warning of a frame of another size than its metadata were written for; none of the right size.
fn other_size(seal: &Seal, stored: &Geometry, name: &str) -> Option<String> {
    let Geometry { width, height, .. } = stored;
    let [had_width, had_height] = seal.size;
    if seal.size == [*width, *height] {
        return None;
    }
    let problem = format!(
        "it is of {width}x{height} pixels, and its metadata were written for {had_width}x{had_height}: another program cropped, turned or \
         scaled it, and what the metadata tell of filter array, levels, place and noise need not hold any more"
    );
    Some(told(name, &problem, true))
}

fn told(name: &str, problem: &str, is_doubt: bool) -> String {
    let text = format!("{name}: {problem}");
    is_doubt.then(|| register::doubt(text.clone()));
    text
}

#[cfg(test)]
mod tests {
    use crate::formats::input::{FrameReader, InputOptions};
    use crate::formats::output::{FrameWriter, OutputOptions, SampleKind};
    use crate::formats::places::sidecar_path;
    use crate::formats::tiff::{TiffCompression, TiffSamples, TiffSettings, TiffTags, TiffWriter};
    use crate::frame::Geometry;
    use crate::metadata::{FrameHeader, Metadata};
    use crate::stream::{Counts, RowSink, RowSource};
    use crate::units::QuantityKind;
    use std::fs::{self, File};
    use std::path::Path;

    const SIZE: [usize; 2] = [4, 4];

    /// Codes that no turn or mirror of the frame leaves as they are.
    fn codes() -> Vec<f32> {
        (0_u8..16).map(|at| f32::from(at) * f32::from(at) + 20.0).collect()
    }

    /// Writes a frame as the options say, without a sidecar.
    fn write(path: &Path, options: OutputOptions) {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some("rggb".parse().unwrap());
        metadata.black_level_adu = Some(16.0.into());
        metadata.white_level_adu = Some(4095.0.into());
        let header = FrameHeader { name: "in".into(), geometry: Geometry::new(SIZE[0], SIZE[1], &["Y"]), metadata };
        let options = OutputOptions { path: Some(path.to_owned()), ..options };
        let mut writer = FrameWriter::create(&options, &header).unwrap();
        codes().chunks(2 * SIZE[0]).for_each(|rows| writer.write(rows).unwrap());
        writer.finish(Counts::default()).unwrap();
        fs::remove_file(sidecar_path(path)).unwrap();
    }

    /// What is said of a frame that is read to its end.
    fn told(path: &Path) -> Option<String> {
        let mut reader =
            FrameReader::open(&InputOptions { path: Some(path.to_owned()), ..InputOptions::default() }).unwrap();
        assert_eq!(reader.header().metadata.seal, None);
        let Geometry { height, .. } = reader.header().geometry;
        reader.read(height, &mut Vec::new()).unwrap();
        reader.mismatch().map(str::to_owned)
    }

    #[test]
    fn frames_are_what_they_were_written_as_however_they_are_stored() {
        let directory = tempfile::tempdir().unwrap();
        for (end, samples, is_viewable) in [
            ("exr", Some(SampleKind::F32), false),
            ("exr", Some(SampleKind::F16), false),
            ("exr", Some(SampleKind::F16), true),
            ("exr", None, true),
            ("tiff", Some(SampleKind::F32), false),
            ("tiff", Some(SampleKind::U16), true),
            ("dng", None, false),
            ("png", None, true),
        ] {
            let path = directory.path().join(format!("in.{end}"));
            write(&path, OutputOptions { samples, is_viewable, ..OutputOptions::default() });
            assert_eq!(told(&path), None, "{end} {samples:?} {is_viewable}");
        }
    }

    /// Another program changes the samples, and keeps what stands in the file's description.
    #[test]
    fn frames_that_another_program_changed_are_told() {
        let directory = tempfile::tempdir().unwrap();
        let [own, changed] = ["own.tiff", "changed.tiff"].map(|name| directory.path().join(name));
        write(&own, OutputOptions::default());
        let reader = FrameReader::open(&InputOptions { path: Some(own), ..InputOptions::default() }).unwrap();
        let description = reader.reader.embedded().map(str::to_owned);
        let [width, height] = SIZE;
        let all = codes();
        let at = |of: fn(usize, usize) -> [usize; 2]| -> Vec<f32> {
            let places = (0..height).flat_map(|y| (0..width).map(move |x| of(x, y)));
            places.map(|[x, y]| all[y * width + x]).collect()
        };
        let scaled = |of: fn(f32) -> f32| all.iter().map(|code| of(*code).round()).collect();
        for (what, size, samples, wanted) in [
            ("nothing", SIZE, all.clone(), None),
            (
                "cut off below",
                [4, 3],
                all[..12].to_vec(),
                Some("it is of 4x3 pixels, and its metadata were written for 4x4"),
            ),
            ("cut in halves", [2, 4], all[..8].to_vec(), Some("it is of 2x4 pixels")),
            ("turned", SIZE, at(|x, y| [y, 3 - x]), Some("another program changed them")),
            ("mirrored", SIZE, at(|x, y| [3 - x, y]), Some("another program changed them")),
            ("upside down", SIZE, at(|x, y| [x, 3 - y]), Some("another program changed them")),
            ("moved", SIZE, at(|x, y| [(x + 1) % 4, y]), Some("another program changed them")),
            ("multiplied", SIZE, scaled(|code| 2.0 * code), Some("another program changed them")),
            (
                "encoded",
                SIZE,
                scaled(|code| 4095.0 * (code / 4095.0).powf(1.0 / 2.2)),
                Some("another program changed them"),
            ),
        ] {
            let settings = TiffSettings {
                samples: TiffSamples::U16,
                scale: 1.0,
                compression: TiffCompression::None,
                tags: TiffTags { description: description.clone(), software: Some("another".into()) },
                extra: Vec::new(),
                exif: Vec::new(),
            };
            let file = File::create(&changed).unwrap();
            let geometry = Geometry::new(size[0], size[1], &["Y"]);
            let mut writer = TiffWriter::create(file, "changed", &geometry, settings).unwrap();
            writer.write_rows(&samples).unwrap();
            writer.finish().unwrap();
            let said = told(&changed);
            let is_right = said.as_deref().zip(wanted).is_some_and(|(said, wanted)| said.contains(wanted));
            assert!(is_right || said.is_none() && wanted.is_none(), "{what}: {said:?}");
        }
    }
}

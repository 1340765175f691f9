//! Files whose layers stand in a part of their own, read as if they stood beside the image.

use super::header::canonical_order;
use super::read::ExrReader;
use crate::error::{Error, Result};
use crate::formats::format::{ColorTags, Rest, SampleReader, SampleType};
use crate::frame::Geometry;
use crate::metadata::Metadata;
use std::fs::File;

/// The part of the image, and that of its layers.
const PARTS: [usize; 2] = [0, 1];

/// Opens part `part` of what begins where a file stands; an image of ours with its layers.
///
/// # Errors
///
/// Those of [`ExrReader::open`].
pub(super) fn open(file: File, name: &str, part: usize) -> Result<Box<dyn SampleReader>> {
    let other = file.try_clone().map_err(|e| Error::disk(name, "read", e))?;
    let image = ExrReader::open(file, name, part)?;
    if part != PARTS[0] || !image.has_layers() {
        return Ok(Box::new(image));
    }
    let layers = ExrReader::open(other, name, PARTS[1])?;
    // The order is that of a file of one part, which has its channels by their names.
    let parts = [&image, &layers];
    let names =
        |part: usize| parts[part].geometry().channels.iter().enumerate().map(move |(at, name)| (name, part, at));
    let mut all: Vec<_> = PARTS.into_iter().flat_map(names).collect();
    all.sort_by_key(|(name, ..)| name.as_bytes());
    let names: Vec<String> = all.iter().map(|(name, ..)| (*name).clone()).collect();
    let sources: Vec<(usize, usize)> = canonical_order(&names).into_iter().map(|at| (all[at].1, all[at].2)).collect();
    let channels = sources.iter().map(|&(part, at)| parts[part].geometry().channels[at].clone()).collect();
    let geometry = Geometry { channels, ..image.geometry().clone() };
    Ok(Box::new(WithLayers { image, layers, geometry, sources, rows: Default::default() }))
}

/// An image and its layers, of one size and place.
struct WithLayers {
    image: ExrReader,
    layers: ExrReader,
    geometry: Geometry,
    /// For each channel its part, and its place there.
    sources: Vec<(usize, usize)>,
    /// Rows of each.
    rows: [Vec<f32>; 2],
}

impl SampleReader for WithLayers {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn tells_place(&self) -> bool {
        self.image.tells_place()
    }

    fn stored_as(&self) -> Option<SampleType> {
        self.image.stored_as().filter(|stored| self.layers.stored_as() == Some(*stored))
    }

    fn natural_rows(&self) -> usize {
        self.image.natural_rows()
    }

    fn embedded(&self) -> Option<&str> {
        self.image.embedded()
    }

    fn own_tags(&self) -> &Metadata {
        self.image.own_tags()
    }

    fn colors(&self) -> ColorTags {
        self.image.colors()
    }

    fn notes(&self) -> &[String] {
        self.image.notes()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let [image, layers] = &mut self.rows;
        image.clear();
        layers.clear();
        self.image.read(rows, image)?;
        self.layers.read(rows, layers)?;
        let width = self.geometry.width;
        let of_image = image.chunks_exact(self.image.geometry().row_samples());
        for (image, layers) in of_image.zip(layers.chunks_exact(self.layers.geometry().row_samples())) {
            for &(part, at) in &self.sources {
                samples.extend_from_slice(&[image, layers][part][at * width..][..width]);
            }
        }
        Ok(())
    }

    fn rest(&mut self) -> Result<Rest> {
        self.image.rest_behind(&self.layers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::exr::{ExrCompression, ExrSamples, ExrTags, ExrWriter, Layers, patch_table};
    use std::io::{Seek, SeekFrom};

    const CHANNELS: [&str; 8] = ["R", "G", "B", "covariance.XY", "sigma.R", "sigma.G", "sigma.B", "mask"];

    fn geometry(channels: &[&str]) -> Geometry {
        Geometry { origin: [-3, 5], ..Geometry::new(5, 37, channels) }
    }

    fn samples(channels: usize) -> Vec<f32> {
        // Halves hold them all.
        (0..u16::try_from(5 * 37 * channels).unwrap()).map(|at| f32::from(at % 1999) - 9.0).collect()
    }

    /// A file that begins with `before`.
    fn written(before: &[u8], channels: &[&str], storage: (ExrSamples, ExrCompression, Layers), text: &str) -> File {
        let (kind, compression, layers) = storage;
        let tags = ExrTags { metadata: Some(text.into()), interop_id: Some("lin".into()), ..ExrTags::default() };
        let geometry = geometry(channels);
        let mut writer = ExrWriter::create(Vec::new(), "a.exr", &geometry, kind, compression, layers, &tags).unwrap();
        writer.write(&samples(channels.len())).unwrap();
        let (bytes, table) = writer.finish().unwrap();
        let mut frame = std::io::Cursor::new(bytes);
        table.iter().for_each(|table| patch_table(&mut frame, "a.exr", table).unwrap());
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, &[before, frame.get_ref()].concat()).unwrap();
        file.seek(SeekFrom::Start(before.len() as u64)).unwrap();
        file
    }

    fn read(mut reader: Box<dyn SampleReader>, bands: &[usize]) -> (Vec<f32>, Rest) {
        let mut found = Vec::new();
        bands.iter().for_each(|rows| reader.read(*rows, &mut found).unwrap());
        let rest = reader.rest().unwrap();
        (found, rest)
    }

    const ALL: [ExrCompression; 5] =
        [ExrCompression::None, ExrCompression::Rle, ExrCompression::Zips, ExrCompression::Zip, ExrCompression::Piz];

    #[test]
    fn layers_apart_are_read_as_layers_beside_the_image() {
        for (kind, compression) in
            [ExrSamples::F32, ExrSamples::F16].into_iter().flat_map(|kind| ALL.map(|c| (kind, c)))
        {
            for layers in [Layers::BesideTheImage, Layers::InAPartOfTheirOwn] {
                let file = written(b"", &CHANNELS, (kind, compression, layers), "ours");
                let reader = open(file, "a.exr", 0).unwrap();
                assert_eq!(reader.geometry(), &geometry(&CHANNELS));
                assert_eq!(reader.embedded(), Some("ours"));
                let (found, rest) = read(reader, &[1, 17, 19]);
                assert_eq!(found, samples(CHANNELS.len()));
                assert!(matches!(rest, Rest::Nothing), "{compression:?} {layers:?}");
            }
        }
    }

    #[test]
    fn the_second_part_is_read_alone_where_it_is_asked_for_and_by_nobody_else_s_name() {
        let storage = (ExrSamples::F32, ExrCompression::None, Layers::InAPartOfTheirOwn);
        let layers = open(written(b"", &CHANNELS, storage, "ours"), "a.exr", 1).unwrap();
        let mut channels = layers.geometry().channels.clone();
        channels.sort_unstable();
        assert_eq!(channels, ["covariance.XY", "mask", "sigma.B", "sigma.G", "sigma.R"]);
        assert_eq!(layers.embedded(), None);
        // A frame without layers, and one of nothing else, are of one part.
        for channels in [&CHANNELS[..3], &CHANNELS[3..]] {
            let reader = open(written(b"", channels, storage, "ours"), "a.exr", 0).unwrap();
            assert_eq!(reader.geometry().channels.len(), channels.len());
            assert!(open(written(b"", channels, storage, "ours"), "a.exr", 1).is_err());
        }
    }

    #[test]
    fn what_lies_behind_both_parts_is_told() {
        for compression in ALL {
            let storage = (ExrSamples::F32, compression, Layers::InAPartOfTheirOwn);
            let mut file = written(b"something", &CHANNELS, storage, "ours");
            let end = file.metadata().unwrap().len();
            file.seek(SeekFrom::End(0)).unwrap();
            std::io::Write::write_all(&mut file, b"junk").unwrap();
            file.seek(SeekFrom::Start(9)).unwrap();
            let (found, rest) = read(open(file, "a.exr", 0).unwrap(), &[37]);
            assert_eq!(found, samples(CHANNELS.len()));
            assert!(matches!(rest, Rest::File(_, at) if at == end), "{compression:?}");
        }
    }
}

//! Writing rows.

use super::PLACE;
use crate::error::{Error, Result};
use crate::formats::foreign::png_refusal;
use crate::formats::interleave::interleave_u16;
use crate::frame::Geometry;
use crate::metadata::FrameHeader;
use png::chunk::ChunkType;
use png::{BitDepth, ColorType, Encoder, EncodingError, Info, SrgbRenderingIntent, StreamWriter};
use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

/// The most columns or rows.
const LONGEST_SIDE: u32 = i32::MAX.unsigned_abs();
/// Compressed bytes of a chunk.
const CHUNK_BYTES: usize = 64 << 10;
/// The keyword of our metadata.
const KEYWORD: &str = "cyanometer";
/// sRGB in numbers of ITU-T H.273: primaries, transfer function, RGB, full range \[PNG2025, Sec. 11.3.2.6].
const SRGB_CODE_POINTS: [u8; 4] = [1, 13, 0, 1];

/// Refuses a frame that a PNG cannot hold.
///
/// # Errors
///
/// [`Error::Usage`] for layers, and for what is neither a plane nor R, G and B; integers only are to be asked for.
pub fn check_frame(header: &FrameHeader) -> Result<()> {
    let is_plane = header.geometry.channels == ["Y"];
    if is_plane || header.geometry.channels == ["R", "G", "B"] {
        return Ok(());
    }
    Err(Error::Usage("a PNG holds one plane, or R, G and B, without layers; write an EXR".into()))
}

/// How a file is written.
#[derive(Debug, Clone, PartialEq)]
pub struct PngSettings {
    /// What each sample is multiplied with before it is rounded to an integer: 1 for ADU, 65535 for sRGB.
    pub scale: f32,
    /// Whether it says that its samples are sRGB.
    pub is_srgb: bool,
    /// The metadata.
    pub description: String,
    /// The program.
    pub software: String,
    /// A color profile, where samples are not sRGB.
    pub profile: Option<Vec<u8>>,
    /// A block of Exif, a TIFF of tags alone.
    pub exif: Option<Vec<u8>>,
}

/// Writes rows as a PNG of 16-bit integers, without a seek.
///
/// The bytes depend on what is written only, not on the number of rows per call. Memory is a few rows.
pub struct PngWriter<W: Write + 'static> {
    output: Shared<W>,
    stream: StreamWriter<'static, Shared<W>>,
    name: String,
    channels: usize,
    row_samples: usize,
    scale: f32,
    row: Vec<u8>,
    unfit: u64,
}

impl<W: Write + 'static> PngWriter<W> {
    /// Starts a file that the user calls `name`, of one plane or three.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] when the frame is larger than PNG can say; [`Error::Disk`].
    pub fn create(output: W, name: &str, geometry: &Geometry, settings: PngSettings) -> Result<Self> {
        let side = |length: usize| u32::try_from(length).ok().filter(|length| (1..=LONGEST_SIDE).contains(length));
        let (Some(width), Some(height)) = (side(geometry.width), side(geometry.height)) else {
            let size = format!("{}x{}", geometry.width, geometry.height);
            return Err(Error::format(name, format!("a PNG cannot hold {size} pixels")));
        };
        let channels = geometry.channels.len();
        let mut info = Info::with_size(width, height);
        info.color_type = if channels == 1 { ColorType::Grayscale } else { ColorType::Rgb };
        info.bit_depth = BitDepth::Sixteen;
        info.icc_profile = settings.profile.filter(|_| !settings.is_srgb).map(Into::into);
        info.exif_metadata = settings.exif.map(Into::into);
        let output = Shared(Arc::new(Mutex::new(Inner { output, error: None })));
        let begun = begin(&output, info, settings.is_srgb, geometry.origin, [settings.description, settings.software]);
        let stream = begun.map_err(|problem| output.problem(name, problem))?;
        let (row_samples, row) = (geometry.row_samples(), vec![0; 2 * geometry.row_samples()]);
        let (name, scale) = (name.to_owned(), settings.scale);
        Ok(Self { output, stream, name, channels, row_samples, scale, row, unfit: 0 })
    }

    /// Takes the next rows, laid out `[row][channel][column]`, as many as there are in `samples`.
    ///
    /// # Errors
    ///
    /// When the disk refuses.
    ///
    /// # Panics
    ///
    /// When these are not whole rows.
    pub fn write_rows(&mut self, samples: &[f32]) -> Result<()> {
        assert!(samples.len().is_multiple_of(self.row_samples));
        for samples in samples.chunks_exact(self.row_samples) {
            self.unfit += interleave_u16(samples, &mut self.row, self.channels, self.scale, |[low, high]| [high, low]);
            let written = self.stream.write_all(&self.row);
            written.map_err(|error| self.output.problem(&self.name, error.into()))?;
        }
        Ok(())
    }

    /// Writes what is left. Gives the output back, and the number of samples that did not fit into 16 bits, as a TIFF writer
    /// does.
    ///
    /// # Errors
    ///
    /// When rows are missing, or the disk refuses.
    pub fn finish(self) -> Result<(W, u64)> {
        let Self { output, stream, name, unfit, .. } = self;
        stream.finish().map_err(|problem| output.problem(&name, problem))?;
        let inner = Arc::into_inner(output.0).and_then(|inner| inner.into_inner().ok());
        let Some(Inner { output, error }) = inner else {
            return Err(Error::format(&name, "it cannot be written as PNG: its end is missing"));
        };
        // The crate writes the last bytes without a word.
        error.map_or(Ok((output, unfit)), |error| Err(Error::disk(&name, "write", error)))
    }
}

/// Writes all before the samples.
fn begin<W: Write + 'static>(
    output: &Shared<W>,
    info: Info<'static>,
    is_srgb: bool,
    place: [i32; 2],
    [description, software]: [String; 2],
) -> std::result::Result<StreamWriter<'static, Shared<W>>, EncodingError> {
    let mut encoder = Encoder::with_info(output.clone(), info)?;
    encoder.add_itxt_chunk(KEYWORD.into(), description)?;
    encoder.add_itxt_chunk("Software".into(), software)?;
    if is_srgb {
        encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    }
    let mut writer = encoder.write_header()?;
    if is_srgb {
        writer.write_chunk(ChunkType(*b"cICP"), &SRGB_CODE_POINTS)?;
    }
    if place != [0, 0] {
        let [x, y] = place.map(i32::to_be_bytes);
        writer.write_chunk(ChunkType(PLACE), &[&x[..], &y, &[0]].concat())?;
    }
    writer.into_stream_writer_with_size(CHUNK_BYTES)
}

/// An output that the crate writes to, which gives back nothing that it has taken.
struct Shared<W>(Arc<Mutex<Inner<W>>>);

struct Inner<W> {
    output: W,
    /// What went wrong first; of some errors the crate tells the words alone, of some nothing.
    error: Option<io::Error>,
}

impl<W> Shared<W> {
    /// What the output complained of, or else the crate.
    fn problem(&self, name: &str, problem: EncodingError) -> Error {
        let error = self.0.lock().unwrap_or_else(PoisonError::into_inner).error.take();
        error.map_or_else(|| png_refusal(name, problem), |error| Error::disk(name, "write", error))
    }
}

impl<W> Clone for Shared<W> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<W: Write> Write for Shared<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut inner = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match inner.output.write_all(bytes) {
            Ok(()) => Ok(bytes.len()),
            Err(error) => {
                let kind = error.kind();
                inner.error.get_or_insert(error);
                Err(kind.into())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::PngReader;
    use super::*;
    use crate::formats::format::SampleReader;
    use crate::formats::tiff::{ExtraTag, TagValue, exif_block};
    use std::io::Seek;

    const OURS: &str = "schema: cyanometer/1\nquantity: adu\nnote: µ\n";

    fn settings(is_srgb: bool) -> PngSettings {
        let scale = if is_srgb { 65_535.0 } else { 1.0 };
        let (description, software) = (OURS.into(), "cyanometer".into());
        PngSettings { scale, is_srgb, description, software, profile: None, exif: None }
    }

    fn written(geometry: &Geometry, samples: &[f32], together: usize, is_srgb: bool) -> (Vec<u8>, u64) {
        let mut writer = PngWriter::create(Vec::new(), "a.png", geometry, settings(is_srgb)).unwrap();
        samples.chunks(together * geometry.row_samples()).for_each(|rows| writer.write_rows(rows).unwrap());
        writer.finish().unwrap()
    }

    fn opened(bytes: &[u8]) -> PngReader {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        file.rewind().unwrap();
        PngReader::open(file, "a.png", 0).unwrap()
    }

    #[test]
    fn samples_place_and_metadata_come_back() {
        for (channels, origin) in [(&["Y"][..], [0, 0]), (&["R", "G", "B"], [7, 5]), (&["Y"], [-3, 1])] {
            let geometry = Geometry { origin, ..Geometry::new(50, 40, channels) };
            let samples: Vec<f32> = (0..40 * geometry.row_samples()).map(|at| (at * 40_503 % 65_536) as f32).collect();
            let (bytes, unfit) = written(&geometry, &samples, 1, false);
            assert_eq!((&bytes, unfit), (&written(&geometry, &samples, 7, false).0, 0));
            let mut reader = opened(&bytes);
            assert_eq!((reader.geometry(), reader.embedded()), (&geometry, Some(OURS)));
            let mut back = Vec::new();
            reader.read(40, &mut back).unwrap();
            assert!(back == samples && reader.notes().is_empty());
        }
    }

    #[test]
    fn what_does_not_fit_is_counted() {
        let geometry = Geometry::new(5, 1, &["Y"]);
        let (bytes, unfit) = written(&geometry, &[-1.0, 65_535.4, 65_536.0, f32::NAN, 2.5], 1, false);
        let mut back = Vec::new();
        opened(&bytes).read(1, &mut back).unwrap();
        assert_eq!((back, unfit), (vec![0.0, 65_535.0, 65_535.0, 0.0, 2.0], 3));
    }

    #[test]
    fn srgb_says_so() {
        let geometry = Geometry::new(1, 1, &["R", "G", "B"]);
        let (bytes, unfit) = written(&geometry, &[1.0, 0.5, 0.0], 1, true);
        let mut reader = png::Decoder::new(io::Cursor::new(&bytes)).read_info().unwrap();
        let info = reader.info();
        let code_points = info.coding_independent_code_points.unwrap();
        assert_eq!(info.srgb, Some(SrgbRenderingIntent::RelativeColorimetric));
        assert_eq!([code_points.color_primaries, code_points.transfer_function], [1, 13]);
        assert!(code_points.matrix_coefficients == 0 && code_points.is_video_full_range_image);
        assert_eq!((reader.next_row().unwrap().unwrap().data(), unfit), (&[255, 255, 128, 0, 0, 0][..], 0));
    }

    /// What is not ours has the exposure of its Exif.
    #[test]
    fn an_exposure_comes_back() {
        let ratio = |number, above, below| ExtraTag { number, value: TagValue::Ratios(vec![[above, below]]) };
        let exif = exif_block(&[ratio(33434, 1, 50), ratio(33437, 8, 1)], "a.png").unwrap();
        let settings = PngSettings { description: "a dog".into(), exif, ..settings(false) };
        let mut writer = PngWriter::create(Vec::new(), "a.png", &Geometry::new(1, 1, &["Y"]), settings).unwrap();
        writer.write_rows(&[7.0]).unwrap();
        let told = opened(&writer.finish().unwrap().0).own_tags().exposure.unwrap();
        assert_eq!((told.exposure_s, told.f_number), (0.02, 8.0));
    }

    /// A disk that has room for so many bytes.
    struct Small(usize);

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let fits = bytes.len().min(self.0);
            self.0 -= fits;
            if fits == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(fits) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Wherever in the file the disk is full, the last byte included.
    #[test]
    fn a_full_disk_is_told() {
        let geometry = Geometry::new(50, 40, &["Y"]);
        let samples: Vec<f32> = (0..2000).map(|at| (at * 40_503 % 65_536) as f32).collect();
        let length = written(&geometry, &samples, 40, false).0.len();
        let full = |room: usize| -> Result<()> {
            let mut writer = PngWriter::create(Small(room), "a.png", &geometry, settings(false))?;
            writer.write_rows(&samples)?;
            writer.finish().map(drop)
        };
        for room in [0, 20, 200, length / 2, length - 20, length - 12, length - 1] {
            let error = full(room).unwrap_err();
            assert!(matches!(error, Error::Disk { action: "write", .. }), "{room}: {error}");
        }
        full(length).unwrap();
        let missing =
            PngWriter::create(Vec::new(), "a.png", &geometry, settings(false)).unwrap().finish().err().unwrap();
        assert!(missing.to_string().starts_with("a.png: it cannot be written as PNG: "), "{missing}");
    }
}

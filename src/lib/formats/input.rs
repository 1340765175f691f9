//! Opens frames: EXR and TIFF, files and pipes, with the metadata that belongs to them.

use super::data::read_file;
use super::digest::SamplesDigest;
use super::exr::{ExrReader, Primaries, is_streamable};
use super::pipe;
use super::tiff::TiffReader;
use super::yaml;
use crate::camera::optics::Exposure;
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, Metadata};
use crate::spectrum::channel_wavelength_nm;
use crate::stream::RowSource;
use crate::units::QuantityKind;
use std::fs::File;
use std::io::{self, IsTerminal, Read, Seek, SeekFrom};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

/// How messages call the standard input.
pub const STDIN_NAME: &str = "standard input";

/// Chromaticities that mark XYZ stored as R, G, B: an OpenEXR convention.
pub const XYZ_PRIMARIES: Primaries = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]];

/// What to open.
#[derive(Debug, Clone, Default)]
pub struct InputOptions {
    /// The file; none or `-` for the standard input.
    pub path: Option<PathBuf>,
    /// Part of a multi-part EXR, page of a TIFF.
    pub part: usize,
    /// A file whose metadata count before all others.
    pub metadata: Option<PathBuf>,
    /// Whether channels besides R, G, B or Y are kept.
    pub all_channels: bool,
}

/// What full-scale sRGB is in 16 bits.
pub const U16_FULL_SCALE: f32 = 65535.0;

/// Identity of an opened file: device and inode.
pub type FileId = (u64, u64);

/// A frame that is being read.
pub struct FrameReader {
    file: Rows,
    header: FrameHeader,
    /// Channels of the file; the first of them are those of the header.
    stored: Geometry,
    stored_as: &'static str,
    id: Option<FileId>,
    rows_read: usize,
    check: Option<DigestCheck>,
    buffer: Vec<f32>,
    /// What stored samples are divided by: sRGB in 16 bits runs to 65535.
    divisor: Option<f32>,
    notes: Vec<String>,
}

enum Rows {
    Exr(Box<ExrReader>),
    Tiff(Box<TiffReader>),
}

/// A digest to compare with once all samples are in.
struct DigestCheck {
    expected: String,
    sidecar: String,
    digest: SamplesDigest,
}

impl FrameReader {
    /// Opens a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where a terminal would be waited on; [`Error::Disk`] and [`Error::Format`] for what cannot be
    /// opened or is no frame.
    pub fn open(options: &InputOptions) -> Result<Self> {
        let path = options.path.as_deref().filter(|path| *path != Path::new("-"));
        let (name, input) = match path {
            Some(path) => (path.display().to_string(), open_path(path)?),
            None => (STDIN_NAME.to_owned(), open_stdin()?),
        };
        Self::open_file(input, &name, path, options)
    }

    /// Opens a frame in a file that is open already and stands at the frame's first byte; `path` leads to its sidecar.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn open_file(input: File, name: &str, path: Option<&Path>, options: &InputOptions) -> Result<Self> {
        let id = input.metadata().ok().map(|m| file_id(&m));
        let (file, id) = sort_out(input, name, options.part, id)?;
        let (stored, stored_as) = match &file {
            Rows::Exr(reader) => (reader.geometry().clone(), reader.stored_as()),
            Rows::Tiff(reader) => (reader.geometry().clone(), reader.stored_as()),
        };
        let mut notes = Vec::new();
        let (metadata, sidecar) = find_metadata(&file, name, path, options)?;
        let geometry = keep_planes(&stored, options.all_channels, metadata.quantity);
        if geometry.channels.len() < stored.channels.len() {
            let dropped = stored.channels[geometry.channels.len()..].join(", ");
            notes.push(format!("{name}: channels {dropped} are left out"));
        }
        let check = metadata.samples.as_ref().zip(sidecar).map(|(samples, sidecar)| DigestCheck {
            digest: SamplesDigest::like(&samples.digest),
            expected: samples.digest.clone(),
            sidecar,
        });
        let is_integer = stored_as.starts_with('u');
        let divisor = (metadata.quantity == QuantityKind::Srgb && is_integer).then_some(U16_FULL_SCALE);
        let header = FrameHeader { name: name.into(), geometry, metadata };
        Ok(Self { file, header, stored, stored_as, id, rows_read: 0, check, buffer: Vec::new(), divisor, notes })
    }

    /// Metadata to amend before a stage is built on them.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// How the file stores its samples.
    pub fn stored_as(&self) -> &'static str {
        self.stored_as
    }

    /// The file that is read, so that it is not written over; none for pipes.
    pub fn file(&self) -> Option<(FileId, String)> {
        self.id.map(|id| (id, self.header.name.clone()))
    }

    /// What a careful user should know: channels left out, a digest that does not match.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Compares the digest once the last row is in; gives the warning, if any.
    pub fn check_digest(&mut self) -> Option<String> {
        if self.rows_read < self.header.geometry.height {
            return None;
        }
        let DigestCheck { expected, sidecar, digest } = self.check.take()?;
        (digest.finish() != expected).then(|| {
            format!(
                "{}: its samples are not those that {sidecar} describes; one of the two was changed",
                self.header.name
            )
        })
    }
}

impl RowSource for FrameReader {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn natural_rows(&self) -> usize {
        match &self.file {
            Rows::Exr(reader) => reader.natural_rows(),
            Rows::Tiff(reader) => reader.natural_rows(),
        }
    }

    fn may_wait(&self) -> bool {
        matches!(&self.file, Rows::Exr(reader) if reader.is_stream())
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let whole = self.stored.row_samples();
        let kept = self.header.geometry.row_samples();
        let mut buffer = std::mem::take(&mut self.buffer);
        let direct = kept == whole;
        let start = if direct { samples.len() } else { 0 };
        let into: &mut Vec<f32> = if direct { samples } else { &mut buffer };
        into.truncate(start);
        match &mut self.file {
            Rows::Exr(reader) => reader.read(rows, into)?,
            Rows::Tiff(reader) => {
                into.resize(start + rows * whole, 0.0);
                reader.read_rows(self.rows_read, rows, &mut into[start..])?;
            }
        }
        if let Some(check) = &mut self.check {
            check.digest.update(&into[start..]);
        }
        if let Some(divisor) = self.divisor {
            into[start..].iter_mut().for_each(|sample| *sample /= divisor);
        }
        if !direct {
            for row in buffer.chunks_exact(whole) {
                samples.extend_from_slice(&row[..kept]);
            }
        }
        self.buffer = buffer;
        self.rows_read += rows;
        Ok(())
    }
}

/// Device and inode of a file.
pub fn file_id(metadata: &std::fs::Metadata) -> FileId {
    use std::os::unix::fs::MetadataExt;
    (metadata.dev(), metadata.ino())
}

/// The file at a path, so that it is not written over; none for pipes and devices.
pub fn regular_file(path: &Path) -> Option<(FileId, String)> {
    let metadata = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    Some((file_id(&metadata), path.display().to_string()))
}

/// Opens a named file.
///
/// # Errors
///
/// [`Error::Disk`], and [`Error::Format`] for directories.
fn open_path(path: &Path) -> Result<File> {
    let name = path.display().to_string();
    let file = File::open(path).map_err(|e| Error::disk(&name, "open", e))?;
    if file.metadata().is_ok_and(|m| m.is_dir()) {
        return Err(Error::format(&name, "it is a directory; name a file in it"));
    }
    Ok(file)
}

/// The standard input as a file.
///
/// # Errors
///
/// [`Error::Usage`] when it is a terminal.
pub fn open_stdin() -> Result<File> {
    let stdin = io::stdin();
    if stdin.is_terminal() {
        return Err(Error::Usage("no input: name a file, or pipe one in".into()));
    }
    let owned = stdin.as_fd().try_clone_to_owned().map_err(|e| Error::disk(STDIN_NAME, "open", e))?;
    Ok(File::from(owned))
}

/// Opens a named file, or the standard input. Gives the name for messages too.
///
/// # Errors
///
/// [`Error::Disk`], [`Error::Format`] for directories, [`Error::Usage`] for a terminal.
pub fn open_named(path: Option<&Path>) -> Result<(File, String)> {
    Ok(match path {
        Some(path) => (open_path(path)?, path.display().to_string()),
        None => (open_stdin()?, STDIN_NAME.to_owned()),
    })
}

/// Copies a stream to a temporary file and stands at its start.
///
/// # Errors
///
/// [`Error::Disk`].
pub fn spool(stream: &mut impl Read, name: &str) -> Result<File> {
    let mut copied = || -> io::Result<File> {
        let mut copy = tempfile::tempfile()?;
        io::copy(stream, &mut copy)?;
        copy.rewind()?;
        Ok(copy)
    };
    copied().map_err(|e| Error::disk(name, "copy to a temporary file", e))
}

/// Finds out what a file holds and opens it with the right reader. A stream that its format cannot read without seeking
/// is first copied to a temporary file.
fn sort_out(mut input: File, name: &str, part: usize, id: Option<FileId>) -> Result<(Rows, Option<FileId>)> {
    let seekable = input.metadata().is_ok_and(|m| m.is_file());
    let mut head = Vec::new();
    let start = if seekable { input.stream_position().unwrap_or(0) } else { 0 };
    (&mut input).take(8).read_to_end(&mut head).map_err(|e| Error::disk(name, "read", e))?;
    if head.is_empty() {
        let hint = if name == STDIN_NAME { "; the program before it wrote nothing" } else { "" };
        return Err(Error::format(name, format!("it is empty{hint}")));
    }
    let is_exr = head.starts_with(&[0x76, 0x2F, 0x31, 0x01]);
    let is_tiff = [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| head.starts_with(*magic));
    if !is_exr && !is_tiff {
        let is_text = head.iter().all(|&byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace());
        let hint = if is_text { "; it looks like text (a spectrum goes into `render-radiance`)" } else { "" };
        return Err(Error::format(name, format!("it is neither an EXR nor a TIFF file{hint}")));
    }
    if seekable {
        input.seek(SeekFrom::Start(start)).map_err(|e| Error::disk(name, "read", e))?;
    } else if is_streamable(&head) {
        if part != 0 {
            return Err(Error::Usage(format!("{name}: it has no part {part}; it has a single one")));
        }
        pipe::enlarge(&input);
        let whole = io::Cursor::new(head).chain(input);
        return Ok((Rows::Exr(Box::new(ExrReader::stream(Box::new(whole), name)?)), None));
    } else {
        input = spool(&mut io::Cursor::new(&head).chain(&mut input), name)?;
    }
    let id = id.filter(|_| seekable);
    if is_exr {
        Ok((Rows::Exr(Box::new(ExrReader::open(input, name, part)?)), id))
    } else {
        Ok((Rows::Tiff(Box::new(TiffReader::open(input, name, part)?)), id))
    }
}

/// The metadata in order of trust: `--metadata`, sidecar, embedded, the format's own tags; and the sidecar's name where
/// it is the one.
fn find_metadata(
    file: &Rows,
    name: &str,
    path: Option<&Path>,
    options: &InputOptions,
) -> Result<(Metadata, Option<String>)> {
    let from_file = |path: &Path| -> Result<Metadata> {
        let shown = path.display().to_string();
        let bytes = read_file(path)?;
        let text = String::from_utf8(bytes).map_err(|_| Error::format(&shown, "it is not UTF-8 text"))?;
        yaml::parse_metadata(&shown, &text)
    };
    if let Some(path) = &options.metadata {
        return Ok((from_file(path)?, None));
    }
    if let Some(sidecar) = path.map(sidecar_path).filter(|sidecar| sidecar.is_file()) {
        return Ok((from_file(&sidecar)?, Some(sidecar.display().to_string())));
    }
    let embedded = match file {
        Rows::Exr(reader) => reader.tags().metadata.clone(),
        // Other programs put their own words into tag 270.
        Rows::Tiff(reader) => reader.tags().description.clone().filter(|text| text.starts_with("schema: cyanometer/")),
    };
    if let Some(text) = embedded {
        return Ok((yaml::parse_metadata(name, &text)?, None));
    }
    let mut metadata = Metadata::new(QuantityKind::Unspecified);
    if let Rows::Exr(reader) = file {
        let tags = reader.tags();
        let known = tags.exposure_s.zip(tags.f_number);
        metadata.exposure = known
            .map(|(exposure_s, f_number)| Exposure { exposure_s, f_number, lens_transmittance: 1.0 })
            .and_then(|exposure| exposure.checked().ok());
        let near = |found: Primaries| {
            found.iter().flatten().zip(XYZ_PRIMARIES.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6)
        };
        if tags.primaries.is_some_and(near) {
            metadata.quantity = QuantityKind::Xyz;
        }
        if reader.geometry().channels.iter().any(|channel| channel_wavelength_nm(channel).is_some()) {
            metadata.quantity = QuantityKind::SpectralRadiance;
            metadata.unit = tags.emissive_units.clone().unwrap_or_default();
        } else {
            metadata.unit = metadata.quantity.unit().into();
        }
    }
    Ok((metadata, None))
}

/// `frame.exr` → `frame.exr.yaml`.
pub fn sidecar_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".yaml");
    PathBuf::from(name)
}

/// The channels that stages work on: the first three where they are R, G, B; Y alone; otherwise all.
fn keep_planes(stored: &Geometry, all: bool, quantity: QuantityKind) -> Geometry {
    let mut kept = stored.clone();
    let starts =
        |names: &[&str]| stored.channels.len() > names.len() && stored.channels.iter().zip(names).all(|(a, b)| a == b);
    if !all && quantity != QuantityKind::SpectralRadiance {
        if [["R", "G", "B"], ["x", "y", "Y"], ["L", "a", "b"]].iter().any(|planes| starts(planes)) {
            kept.channels.truncate(3);
        } else if starts(&["Y"]) {
            kept.channels.truncate(1);
        }
    }
    kept
}

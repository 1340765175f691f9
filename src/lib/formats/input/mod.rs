//! Opens frames of any format, from files and pipes, with the metadata that belongs to them.

mod camera;
mod changed;
mod checks;
mod codes;
mod described;
mod kept;
mod levels;
mod linear;
mod masked;
mod metadata;
mod opening;
mod options;
mod time;
mod top;

pub use options::{InputOptions, Linearizing, OfCamera};
pub(crate) use time::TOO_DARK;

use self::checks::Checks;
use self::described::DigestCheck;
use self::kept::{LEFT_OUT, Taken, count_marks, cut_to, left_out};
use self::metadata::{Found, doubt_of_marks, find_metadata, placed, take_scaling};
use self::opening::{head_of, is_file, of_upstream, open_part, open_piped, readers_of};
use super::dng::{DngReader, RawArea};
use super::files::{named, open_named, spool};
use super::format::{ColorTags, Rest, SampleReader, SampleType, U16_FULL_SCALE};
use super::makers::{MakersReader, Worker};
use super::sequence::Sequence;
use super::viewable::Scaling;
use super::{headerless, register, table, tiff};
use crate::camera::levels::{BlackLevel, BlackLevels};
use crate::camera::noise_profile::NoiseProfile;
use crate::camera::optics::Exposure;
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::FrameHeader;
use crate::stages::linearize::Linearize;
use crate::stages::saturation::{MASK_BITS, MASK_LAYER, with_mask};
use crate::stream::RowSource;
use crate::units::QuantityKind;
use std::fs::File;
use std::io::{Seek, SeekFrom};
use std::path::Path;

/// A frame that is being read.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::input::{FrameReader, InputOptions};
/// use cyanometer::formats::output::{FrameWriter, OutputOptions};
/// use cyanometer::stream::{Counts, RowSink, RowSource};
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let (metadata, geometry) = (Metadata::new(QuantityKind::Adu), Geometry::new(2, 2, &["Y"]));
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// let directory = tempfile::tempdir().unwrap();
/// let path = directory.path().join("codes.exr");
/// let mut writer = FrameWriter::create(&OutputOptions { path: Some(path.clone()), ..Default::default() }, &header)?;
/// writer.write(&[1.0, 2.0, 3.0, 4.0])?;
/// writer.finish(Counts::default())?;
///
/// let mut reader = FrameReader::open(&InputOptions { path: Some(path), ..InputOptions::default() })?;
/// assert_eq!(reader.header().geometry, header.geometry);
/// assert_eq!(reader.header().metadata.quantity, QuantityKind::Adu);
/// let mut samples = Vec::new();
/// reader.read(2, &mut samples)?;
/// assert_eq!(samples, [1.0, 2.0, 3.0, 4.0]);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub struct FrameReader {
    reader: Box<dyn SampleReader>,
    header: FrameHeader,
    rows_read: usize,
    check: Option<DigestCheck>,
    checks: Checks,
    mismatch: Option<String>,
    buffer: Vec<f32>,
    /// What stored samples were multiplied with for viewers.
    scaling: Option<Scaling>,
    /// What stored samples are divided by: sRGB in 16 bits runs to 65535.
    divisor: Option<f32>,
    linearize: Option<Linearize>,
    notes: Vec<String>,
    /// The place of the layer of marks among the stored channels, where stages do not see it.
    mask: Option<usize>,
    keeps_mask: bool,
    /// Pixels that the layer has marked so far, by [`MASK_BITS`], where stages do not see it.
    marked: [u64; MASK_BITS.len()],
    /// The first channel that is kept; the others follow it.
    first_channel: usize,
    /// What reports call the channel that was taken alone.
    called: Option<String>,
    /// Column and row of the stored frame that are kept first.
    corner: [usize; 2],
    has_begun: bool,
    /// Who reads on behind the frame; none where nothing may lie there.
    sequence: Option<Sequence>,
    /// Frames that follow in the same stream, at least.
    to_come: u64,
}

impl FrameReader {
    /// Opens a frame.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where a terminal would be waited on; [`Error::Disk`] and [`Error::Format`] for what cannot be
    /// opened or is no frame.
    pub fn open(options: &InputOptions) -> Result<Self> {
        if let Some(sequence) = &options.sequence {
            return Self::open_next(sequence, options);
        }
        let path = named(options.path.as_deref());
        register::check_inputs(options.metadata.as_deref().map(Some).into_iter().chain([path]))?;
        let (input, name) = open_named(path)?;
        Self::open_file(input, &name, path, options)
    }

    /// Opens the next frame of several.
    fn open_next(sequence: &Sequence, options: &InputOptions) -> Result<Self> {
        let next = sequence.take()?;
        // What lies beside a file tells of its first frame.
        let path = next.path.as_deref().filter(|_| next.number == 0);
        let name = next.name();
        let frame = match next.place {
            None => Self::open(&InputOptions { path: next.path.clone(), sequence: None, ..options.clone() }),
            Some(Rest::File(mut file, at)) => {
                file.seek(SeekFrom::Start(at)).map_err(|e| Error::disk(&name, "read", e))?;
                Self::open_file(file, &name, path, options)
            }
            Some(Rest::Pipe(pipe)) => Self::of(open_piped(pipe, &name, options.part)?, &name, path, options),
            Some(Rest::Nothing | Rest::Unread { .. }) => Err(Error::format(&name, "it is empty")),
        };
        let mut frame = frame?;
        sequence.expect(frame.to_come, &name)?;
        if let Some(path) = next.path.filter(|_| next.is_of_several_files) {
            frame.header.metadata.file = Some(path.display().to_string());
        }
        Ok(Self { sequence: Some(sequence.clone()), ..frame })
    }

    /// Opens a frame in a file that is open already and stands at the frame's first byte; `path` leads to its sidecar.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn open_file(input: File, name: &str, path: Option<&Path>, options: &InputOptions) -> Result<Self> {
        let reader = match options.raw {
            Some(layout) => headerless::open(input, name, options.part, layout)?,
            None => open_part(input, name, options.part, options.or_single_part)?,
        };
        Self::of(reader, name, path, options)
    }

    /// Opens a part of the raw image in a camera's file; those of makers' own formats are decoded by a worker.
    ///
    /// # Errors
    ///
    /// As [`Self::open`]; [`Error::Format`] for files that are no raws, and for what the worker does not decode.
    pub fn open_raw(options: &InputOptions, part: RawArea, worker: Worker) -> Result<Self> {
        let path = named(options.path.as_deref());
        register::check_inputs(options.metadata.as_deref().map(Some).into_iter().chain([path]))?;
        let (mut input, name) = open_named(path)?;
        if !is_file(&input, &name)? {
            input = spool(&mut input, &name)?;
        }
        let head = head_of(&mut input, &name)?;
        if let Some(format) = table::makers_raw(&input, &head, &name)? {
            let reader = MakersReader::open(worker, input, &name, format.name, part)?;
            return Self::of(Box::new(reader), &name, path, options);
        }
        // Those that are not read are refused here by name.
        let readers = readers_of(&head, &name)?;
        let is_raw = tiff::begins_so(&head) && table::by_tags(&input, &name)?.is_some();
        if !is_raw {
            // A damaged file may be a raw all the same.
            input.rewind().map_err(|e| Error::disk(&name, "read", e))?;
            (readers.open)(input, &name, 0)?;
            return Err(Error::format(&name, "it is no raw file of a camera; the other programs read it as it is"));
        }
        Self::of(Box::new(DngReader::open(input, &name, part)?), &name, path, options)
    }

    /// A frame of what a reader gives, whatever it reads; `path` leads to its sidecar. Of the options its place does not count.
    ///
    /// # Errors
    ///
    /// Those of its metadata; [`Error::Usage`] where it has not the channel or the rectangle that is wanted.
    pub fn of(reader: Box<dyn SampleReader>, name: &str, path: Option<&Path>, options: &InputOptions) -> Result<Self> {
        let mut notes: Vec<String> = reader.notes().iter().map(|note| format!("{name}: {note}")).collect();
        let Found { mut metadata, sidecar, place } =
            find_metadata(reader.as_ref(), name, path, options.metadata.as_deref())?;
        let stored = reader.geometry();
        let to_come = metadata.frames_to_come.take().unwrap_or_default();
        camera::describe(&mut metadata, &place, &options.camera)?;
        let scaling = take_scaling(reader.as_ref(), &mut metadata, &place, name)?;
        let origin = placed(reader.as_ref(), metadata.origin.take(), &place, name)?;
        let Taken { place: first_channel, called, geometry } = Taken::of(stored, options, name, &mut metadata)?;
        let left_out = match &options.channel {
            Some(_) => &[][..],
            None => &stored.channels[geometry.channels.len()..],
        };
        // Only what our programs made marks what they mean by it.
        let is_ours = !metadata.history.is_empty();
        let kept = first_channel..first_channel + geometry.channels.len();
        let mask = stored.channels.iter().position(|of| of == MASK_LAYER).filter(|at| is_ours && !kept.contains(at));
        notes.extend(kept::left_out(name, left_out));
        let seal = metadata.seal.take();
        // A digest is one of all samples.
        let of_all = metadata.samples.as_ref().zip(sidecar.as_deref()).filter(|_| options.crop.is_none());
        let (check, mismatch) = described::begin(of_all, seal.as_ref(), stored, name);
        let is_unsigned = reader.stored_as().is_some_and(SampleType::is_unsigned);
        let divisor = (metadata.quantity == QuantityKind::Srgb && is_unsigned).then_some(U16_FULL_SCALE);
        if let Some(file) = &metadata.file {
            // The first program of the pipe reads it.
            register::note_upstream(Path::new(file))?;
        }
        let mut header = FrameHeader { name: name.into(), geometry: Geometry { origin, ..geometry }, metadata };
        camera::say(&mut header, &options.camera);
        doubt_of_marks(&header, stored);
        let corner = cut_to(&mut header, options.crop, reader.picture())?;
        let linearize = match &options.linearize {
            Linearizing::No => None,
            Linearizing::As(sensor) => {
                header.metadata.sensor = header.metadata.sensor.or_else(|| sensor.as_deref().cloned());
                Some(Linearize::of(&mut header)?)
            }
        };
        Ok(Self {
            reader,
            header,
            rows_read: 0,
            check,
            checks: Checks::telling_top(options.tells_top && path.is_some()),
            mismatch,
            buffer: Vec::new(),
            scaling,
            divisor,
            linearize,
            notes,
            mask,
            keeps_mask: false,
            marked: [0; MASK_BITS.len()],
            first_channel,
            called,
            corner,
            has_begun: false,
            sequence: None,
            to_come,
        })
    }

    /// What reports call the channel that was taken alone, as the plane Y.
    pub fn taken_channel(&self) -> Option<&str> {
        self.called.as_deref()
    }

    /// Metadata to amend before a stage is built on them.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// Makes codes proportional to charge from now on, in rows and metadata.
    ///
    /// # Errors
    ///
    /// Those of [`Linearize::of`].
    pub fn linearize(&mut self) -> Result<()> {
        self.linearize = Some(Linearize::of(&mut self.header)?);
        Ok(())
    }

    /// Takes a black level that a user says for what no light reads, where metadata tell none: a frame far below it is told.
    pub fn expect_black(&mut self, black: BlackLevel) {
        self.checks.said_black = Some(black).filter(|_| self.header.metadata.black_level_adu.is_none());
    }

    /// Holds a black level that comes off against what masked photosites of the frame read.
    pub fn compare_masked(&mut self, black: BlackLevels) {
        self.checks.taken_black = Some(black);
    }

    /// How the file stores its samples, in a word: `u16`, `f32` …; `mixed` where channels differ.
    pub fn stored_as(&self) -> &'static str {
        self.reader.stored_as().map_or("mixed", SampleType::name)
    }

    /// The type of the stored samples; none where channels differ in it.
    pub fn sample_type(&self) -> Option<SampleType> {
        self.reader.stored_as()
    }

    /// The exposure by the file's own tags, whose units are the format's.
    pub fn tagged_exposure(&self) -> Option<Exposure> {
        self.reader.own_tags().exposure
    }

    /// What the file's tags say of its colors.
    pub fn colors(&self) -> ColorTags {
        self.reader.colors()
    }

    /// Whether the frame has a layer that marks pixels beside the channels that stages see.
    pub fn has_mask(&self) -> bool {
        self.mask.is_some()
    }

    /// Gives the layer of marks as the last channel from now on, where there is one.
    pub fn keep_mask(&mut self) {
        if self.mask.is_some() && !self.keeps_mask {
            self.keeps_mask = true;
            self.header = with_mask(self.header.clone());
        }
    }

    /// Keeps the channels `layer` too, where the file has them right behind those that are kept; tells whether it does.
    pub fn keep(&mut self, layer: &[&str]) -> bool {
        let kept = self.first_channel + self.header.geometry.channels.len();
        let stored = &self.reader.geometry().channels;
        let is_there = stored.get(kept..kept + layer.len()).is_some_and(|channels| channels.iter().eq(layer));
        if is_there {
            self.notes.retain(|note| !note.ends_with(LEFT_OUT));
            self.notes.extend(left_out(&self.header.name, &stored[kept + layer.len()..]));
            self.header.geometry.channels.extend(layer.iter().map(|name| (*name).to_owned()));
        }
        is_there
    }

    /// Pixels among those read so far that the frame's layer of marks tells, by [`MASK_BITS`]; of one that is handed on
    /// ([`Self::keep_mask`]) none are counted here.
    pub fn marked(&self) -> [u64; MASK_BITS.len()] {
        self.marked
    }

    /// What a careful user should know: channels left out, tags passed over.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The noise of the samples, where the file tells it.
    pub fn noise_profile(&self) -> Option<(&NoiseProfile, Option<f64>)> {
        let told = self.reader.own_tags().noise_profile.as_ref();
        Some((self.reader.noise_profile()?, told.map(|told| told.range_adu)))
    }

    /// The warning that its metadata describe other samples; of the right size, none before the rows are in that they tell.
    pub fn mismatch(&self) -> Option<&str> {
        self.mismatch.as_deref()
    }

    /// Whether a file holds a frame of the same size and place as `made`, the digest of whose samples is this, stored in one type, or
    /// channels in several.
    ///
    /// # Errors
    ///
    /// Those of [`Self::open_file`] and of reading.
    pub(super) fn holds(
        input: File,
        name: &str,
        made: &FrameHeader,
        (digest, stored): (&str, SampleType),
    ) -> Result<bool> {
        let options = InputOptions { all_channels: true, ..InputOptions::default() };
        let mut reader = Self::open_file(input, name, None, &options)?;
        let is_stored_so = reader.sample_type().is_none_or(|found| found == stored);
        if reader.header.geometry != made.geometry || !is_stored_so {
            return Ok(false);
        }
        reader.check = Some(DigestCheck::of_made(digest, reader.reader.geometry()));
        reader.drain()?;
        Ok(reader.mismatch.is_none())
    }

    /// Reads the rows that nobody has asked for.
    ///
    /// # Errors
    ///
    /// As [`RowSource::read`].
    pub fn drain(&mut self) -> Result<()> {
        let mut passed = Vec::new();
        while self.rows_read < self.header.geometry.height {
            let left = self.header.geometry.height - self.rows_read;
            passed.clear();
            self.read(self.header.geometry.step_rows(self.natural_rows()).clamp(1, left), &mut passed)?;
        }
        Ok(())
    }

    /// Reads rows as they are stored behind those of `into`, but for the scale of viewers, and holds them against what describes them.
    fn fetch(&mut self, rows: usize, into: &mut Vec<f32>) -> Result<()> {
        let start = into.len();
        let read = self.reader.read(rows, into);
        read.map_err(|error| of_upstream(error, &self.header.name))?;
        if let Some(scaling) = &self.scaling {
            scaling.undo(&mut into[start..]);
        }
        let other = DigestCheck::take(&mut self.check, &into[start..], self.reader.geometry(), &self.header.name);
        self.mismatch = self.mismatch.take().or(other);
        Ok(())
    }

    /// Reads rows above those that are kept.
    fn pass_over(&mut self, rows: usize, buffer: &mut Vec<f32>) -> Result<()> {
        let step = self.reader.geometry().step_rows(self.reader.natural_rows()).max(1);
        let mut left = rows;
        while left > 0 {
            buffer.clear();
            self.fetch(step.min(left), buffer)?;
            left -= step.min(left);
        }
        buffer.clear();
        Ok(())
    }

    /// Once the last row is in, hands on what lies behind it.
    fn end(&mut self) -> Result<()> {
        if self.rows_read < self.header.geometry.height {
            return Ok(());
        }
        let stored = self.reader.geometry().height;
        let below = stored - (self.corner[1] + self.header.geometry.height).min(stored);
        match self.sequence.take() {
            Some(sequence) => {
                self.pass_over(below, &mut Vec::new())?;
                sequence.go_on(self.reader.rest()?, &self.header.name)?;
            }
            None if below == 0 => self.reader.rest()?.end(&self.header.name)?,
            None => {}
        }
        self.checks.end(&self.header)
    }
}

impl RowSource for FrameReader {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn natural_rows(&self) -> usize {
        self.reader.natural_rows()
    }

    fn may_wait(&self) -> bool {
        self.reader.may_wait()
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let mut buffer = std::mem::take(&mut self.buffer);
        if !self.has_begun {
            self.has_begun = true;
            let is_tagged = self.header.metadata.time_s() == self.reader.own_tags().time_s();
            self.checks.linear_limit = self.reader.linear_limit();
            self.checks.doubt_of_black = self.reader.doubt_of_black();
            self.checks.begin(&self.header, self.mask.is_some(), self.linearize.is_none(), is_tagged);
            self.pass_over(self.corner[1], &mut buffer)?;
        }
        let stored = self.reader.geometry();
        let (whole, stored_width) = (stored.row_samples(), stored.width);
        let mask = self.mask.filter(|_| self.keeps_mask);
        let width = self.header.geometry.width;
        let kept = self.header.geometry.channels.len() - usize::from(mask.is_some());
        let direct = kept * width == whole;
        let first = samples.len();
        let start = if direct { first } else { 0 };
        let into: &mut Vec<f32> = if direct { samples } else { &mut buffer };
        into.truncate(start);
        self.fetch(rows, into)?;
        if let Some(divisor) = self.divisor {
            into[start..].iter_mut().for_each(|sample| *sample /= divisor);
        }
        if !direct {
            for row in buffer.chunks_exact(whole) {
                let plane = |channel: usize| &row[channel * stored_width + self.corner[0]..][..width];
                for channel in self.first_channel..self.first_channel + kept {
                    samples.extend_from_slice(plane(channel));
                }
                if let Some(mask) = mask {
                    samples.extend_from_slice(plane(mask));
                } else if let Some(mask) = self.mask {
                    count_marks(plane(mask), &mut self.marked);
                }
            }
        }
        self.checks.look(&samples[first..], &self.header)?;
        if let Some(linearize) = &self.linearize {
            let rows = samples[first..].chunks_exact_mut(self.header.geometry.row_samples());
            rows.zip(self.rows_read..).for_each(|(row, y)| linearize.apply(&mut row[..kept * width], y));
        }
        self.buffer = buffer;
        self.rows_read += rows;
        self.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::statistics::Region;
    use crate::camera::levels::BlackLevel;
    use crate::formats::exr::{ExrCompression, ExrSamples, ExrTags, ExrWriter, Layers, XYZ_PRIMARIES};
    use crate::formats::output::{FrameWriter, OutputOptions};
    use crate::metadata::Metadata;
    use crate::stream::{Counts, RowSink};
    use std::path::PathBuf;

    const CROP: Region = Region { x: 2, y: 3, width: 4, height: 2 };

    /// An EXR of 7x6 pixels, each sample of another value, at a place of the sensor.
    fn written(directory: &Path, channels: &[&str], metadata: &Metadata) -> PathBuf {
        let path = directory.join("in.exr");
        let geometry = Geometry { origin: [10, -5], ..Geometry::new(7, 6, channels) };
        let header = FrameHeader { name: "in".into(), geometry, metadata: metadata.clone() };
        let options = OutputOptions { path: Some(path.clone()), ..OutputOptions::default() };
        let mut writer = FrameWriter::create(&options, &header).unwrap();
        for y in 0_u8..6 {
            let row: Vec<f32> = (0_u8..7 * u8::try_from(channels.len()).unwrap())
                .map(|at| f32::from(y) * 100.0 + f32::from(at / 7) * 10.0 + f32::from(at % 7))
                .collect();
            writer.write(&row).unwrap();
        }
        writer.finish(Counts::default()).unwrap();
        path
    }

    fn read(options: &InputOptions) -> Result<(FrameReader, Vec<f32>)> {
        let mut reader = FrameReader::open(options)?;
        let mut samples = Vec::new();
        for _ in 0..reader.header().geometry.height {
            reader.read(1, &mut samples)?;
        }
        Ok((reader, samples))
    }

    /// XYZ of another program are shares of the luminance of white, covariances of its square; where nothing tells it they stay.
    #[test]
    fn xyz_of_another_program_are_scaled_by_their_white() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("xyz.exr");
        let geometry = Geometry::new(1, 1, &["R", "G", "B", "covariance.XX"]);
        for (white_luminance, wanted, unit) in
            [(Some(80.0), [20.0_f32, 40.0, 80.0, 6400.0], "cd m-2"), (None, [0.25, 0.5, 1.0, 1.0], "relative")]
        {
            let primaries = Some(XYZ_PRIMARIES);
            let tags = ExrTags { white_luminance, primaries, ..ExrTags::default() };
            let (kind, beside) = (ExrSamples::F32, Layers::BesideTheImage);
            let none = ExrCompression::None;
            let mut writer = ExrWriter::create(Vec::new(), "xyz.exr", &geometry, kind, none, beside, &tags).unwrap();
            writer.write(&[0.25, 0.5, 1.0, 1.0]).unwrap();
            std::fs::write(&path, writer.finish().unwrap().0).unwrap();
            let options = InputOptions { path: Some(path.clone()), all_channels: true, ..InputOptions::default() };
            let (reader, samples) = read(&options).unwrap();
            // The scale and its inverse are rounded once each.
            assert!(samples.iter().zip(wanted).all(|(a, b)| (a - b).abs() <= 3.0 * f32::EPSILON * b), "{samples:?}");
            assert_eq!(reader.header().metadata.unit, unit);
            assert_eq!(reader.notes().len(), usize::from(white_luminance.is_none()));
        }
    }

    #[test]
    fn a_crop_is_a_part_of_the_frame_that_keeps_its_place() {
        let directory = tempfile::tempdir().unwrap();
        let path = Some(written(directory.path(), &["R", "G", "B"], &Metadata::new(QuantityKind::Adu)));
        let options = InputOptions { path, crop: Some(CROP), ..InputOptions::default() };
        let (reader, samples) = read(&options).unwrap();
        let geometry = Geometry { origin: [12, -2], ..Geometry::new(4, 2, &["R", "G", "B"]) };
        assert_eq!(reader.header().geometry, geometry);
        assert_eq!(samples[..8], [302.0, 303.0, 304.0, 305.0, 312.0, 313.0, 314.0, 315.0]);
        assert_eq!((samples.len(), samples[23]), (24, 425.0));
        assert_eq!((reader.mismatch(), &reader.header().metadata.samples), (None, &None));
        for (x, width) in [(4, 4), (0, 0), (usize::MAX, 1)] {
            let options = InputOptions { crop: Some(Region { x, width, ..CROP }), ..options.clone() };
            let complaint = FrameReader::open(&options).err().unwrap().to_string();
            assert!(complaint.ends_with("does not lie within the frame of 7x6; give another `crop`"), "{complaint}");
        }
    }

    /// A frame of 4x4 codes behind an array, whose black level tells the sites, at a place of the sensor.
    fn write_at(path: &Path, origin: [i32; 2]) {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some("rggb".parse().unwrap());
        metadata.black_level_adu = Some(BlackLevel::Sites([1.0, 2.0, 3.0, 4.0]));
        metadata.white_level_adu = Some(4095.0.into());
        let geometry = Geometry { origin, ..Geometry::new(4, 4, &["Y"]) };
        let header = FrameHeader { name: "in".into(), geometry, metadata };
        let options = OutputOptions { path: Some(path.to_owned()), ..OutputOptions::default() };
        let mut writer = FrameWriter::create(&options, &header).unwrap();
        writer.write(&[7.0; 16]).unwrap();
        writer.finish(Counts::default()).unwrap();
    }

    /// Where a frame begins, and its first black level.
    fn place(path: &Path, metadata: Option<&Path>) -> Result<([i32; 2], f64)> {
        let options =
            InputOptions { path: Some(path.into()), metadata: metadata.map(Into::into), ..Default::default() };
        let (reader, _) = read(&options)?;
        assert_eq!(reader.header().metadata.origin, None);
        Ok((reader.header().geometry.origin, reader.header().black_levels()?.unwrap().row(0).at(0)))
    }

    fn sidecar(path: &Path) -> PathBuf {
        crate::formats::files::sidecar_path(path)
    }

    /// Files that another program wrote anew without the place, beside the sidecar of the frame that they were.
    #[test]
    fn a_place_that_a_file_lost_is_that_of_its_metadata() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        for end in ["tiff", "png", "dng", "exr"] {
            let [crop, whole] = ["crop", "whole"].map(|name| at(&format!("{name}.{end}")));
            write_at(&crop, [3, 1]);
            write_at(&whole, [0, 0]);
            assert_eq!(place(&crop, None).unwrap(), ([3, 1], 4.0), "{end}");
            assert!(!std::fs::read_to_string(sidecar(&whole)).unwrap().contains("origin"));
            // The file alone says it too, or what it carries.
            let told = std::fs::read(sidecar(&crop)).unwrap();
            std::fs::remove_file(sidecar(&crop)).unwrap();
            assert_eq!(place(&crop, None).unwrap(), ([3, 1], 4.0), "{end}");
            std::fs::copy(&whole, &crop).unwrap();
            assert_eq!(place(&crop, None).unwrap(), ([0, 0], 1.0), "{end}");
            std::fs::write(sidecar(&crop), &told).unwrap();
            if end != "exr" {
                assert_eq!(place(&crop, None).unwrap(), ([3, 1], 4.0), "{end}");
                continue;
            }
            // A data window says where it begins: nothing tells which of the two is right.
            let said = place(&crop, None).unwrap_err().to_string();
            let shown = sidecar(&crop).display().to_string();
            assert!(said.contains(&format!("begins at column 3, row 1 of the sensor by {shown} (`origin`), but at column 0, row 0 by the file itself")), "{said}");
            assert!(said.ends_with(", else give metadata whose `origin` counts, --metadata FILE"), "{said}");
            assert_eq!(place(&crop, Some(&sidecar(&crop))).unwrap(), ([3, 1], 4.0));
            assert_eq!(place(&crop, Some(&sidecar(&whole))).unwrap(), ([0, 0], 1.0));
        }
        // A place that no position of a TIFF can tell.
        let path = at("before.tiff");
        write_at(&path, [-1, 3]);
        assert_eq!(place(&path, None).unwrap(), ([-1, 3], 4.0));
        // A crop of a crop moves on.
        let crop = Some(Region { x: 2, y: 1, width: 2, height: 2 });
        let (reader, _) = read(&InputOptions { path: Some(at("crop.tiff")), crop, ..InputOptions::default() }).unwrap();
        assert_eq!(reader.header().geometry.origin, [5, 2]);
    }

    /// A PNG whose metadata another program dropped keeps its place; one whose place it changed, to the corner too, is refused.
    #[test]
    fn the_place_of_a_png_is_in_its_own_chunk() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("crop.png");
        write_at(&path, [3, 1]);
        std::fs::remove_file(sidecar(&path)).unwrap();
        let written = std::fs::read(&path).unwrap();
        let change = |kind: &[u8], of: &dyn Fn(&mut [u8])| {
            let mut bytes = written.clone();
            let mut at = 8;
            while at < bytes.len() {
                let length = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
                let data = at + 8..at + 8 + length;
                if &bytes[at + 4..at + 8] == kind {
                    of(&mut bytes[data.clone()]);
                    let mut sum = flate2::Crc::new();
                    sum.update(&bytes[at + 4..data.end]);
                    bytes[data.end..data.end + 4].copy_from_slice(&sum.sum().to_be_bytes());
                }
                at = data.end + 4;
            }
            assert_ne!(bytes, written);
            std::fs::write(&path, bytes).unwrap();
        };
        change(b"oFFs", &|place| place.fill(0));
        let said = place(&path, None).unwrap_err().to_string();
        assert!(
            said.contains("column 3, row 1 of the sensor by its metadata (`origin`), but at column 0, row 0"),
            "{said}"
        );
        for kind in [b"iTXt", b"zTXt", b"tEXt"].into_iter().filter(|kind| written.windows(4).any(|at| at == *kind)) {
            change(kind, &|text| text[0] = b'x');
        }
        let options = InputOptions { path: Some(path), ..InputOptions::default() };
        assert_eq!(FrameReader::open(&options).unwrap().header().geometry.origin, [3, 1]);
    }

    #[test]
    fn a_dng_whose_description_another_program_wrote_keeps_its_place() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("crop.dng");
        write_at(&path, [3, 1]);
        let change = |from: &[u8], to: &[u8]| {
            let mut bytes = std::fs::read(&path).unwrap();
            let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
            bytes[at..at + to.len()].copy_from_slice(to);
            std::fs::write(&path, bytes).unwrap();
        };
        change(b"schema: cyanometer/1", b"a chart, noon, west.");
        // By its Software the positions are still those of ours.
        assert_eq!(place(&path, None).unwrap(), ([3, 1], 4.0));
        let told = std::fs::read(sidecar(&path)).unwrap();
        std::fs::remove_file(sidecar(&path)).unwrap();
        assert_eq!(place(&path, None).unwrap(), ([3, 1], 4.0));
        std::fs::write(sidecar(&path), told).unwrap();
        change(format!("cyanometer {}", env!("CARGO_PKG_VERSION")).as_bytes(), b"another one");
        assert_eq!(place(&path, None).unwrap(), ([3, 1], 4.0));
    }

    #[test]
    fn files_without_a_place_take_that_of_metadata_beside_them() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.fits");
        let cards = ["SIMPLE  = T", "BITPIX  = 16", "NAXIS   = 2", "NAXIS1  = 2", "NAXIS2  = 2", "END"];
        let mut bytes: Vec<u8> = cards.iter().flat_map(|card| format!("{card:<80}").into_bytes()).collect();
        bytes.resize(2880, b' ');
        bytes.resize(2 * 2880, 0);
        std::fs::write(&path, bytes).unwrap();
        let text = "schema: cyanometer/1\nquantity: adu\ncfa: rggb\nblack_level_adu: [1, 2, 3, 4]\norigin: [3, 1]\n";
        std::fs::write(sidecar(&path), text).unwrap();
        assert_eq!(place(&path, None).unwrap(), ([3, 1], 4.0));
    }

    #[test]
    fn a_channel_is_taken_alone() {
        let directory = tempfile::tempdir().unwrap();
        let path = Some(written(directory.path(), &["R", "G", "B"], &Metadata::new(QuantityKind::Adu)));
        let channel = Some("G".to_owned());
        let options = InputOptions { path, channel, ..InputOptions::default() };
        let (reader, samples) = read(&options).unwrap();
        assert_eq!((reader.header().geometry.channels.join(" ").as_str(), reader.taken_channel()), ("Y", Some("G")));
        assert_eq!((samples.len(), samples[0], samples[41], reader.mismatch()), (42, 10.0, 516.0, None));
        let (_, samples) = read(&InputOptions { crop: Some(CROP), ..options.clone() }).unwrap();
        assert_eq!(samples, [312.0, 313.0, 314.0, 315.0, 412.0, 413.0, 414.0, 415.0]);
        let none = InputOptions { channel: Some("Z".into()), ..options };
        let complaint = FrameReader::open(&none).err().unwrap().to_string();
        assert!(complaint.ends_with("there is no channel `Z`; it has R, G, B; give another `channel`"), "{complaint}");
    }

    /// Channels of several units have one each, and so have their standard deviations.
    #[test]
    fn a_channel_that_is_taken_alone_has_its_own_unit() {
        let directory = tempfile::tempdir().unwrap();
        let channels = ["CCT", "Duv", "Y", "sigma.CCT", "sigma.Duv", "sigma.Y"];
        let path = Some(written(directory.path(), &channels, &Metadata::new(QuantityKind::Cct)));
        for (channel, unit) in [("CCT", "K"), ("duv", "1"), ("Y", "cd m-2"), ("sigma.CCT", "K"), ("sigma.Y", "cd m-2")]
        {
            let options =
                InputOptions { path: path.clone(), channel: Some(channel.to_owned()), ..InputOptions::default() };
            let (reader, _) = read(&options).unwrap();
            assert_eq!(reader.header().metadata.unit, unit, "{channel}");
            assert!(reader.header().metadata.contradictions().is_empty(), "{channel}");
        }
        let (reader, _) = read(&InputOptions { path, ..InputOptions::default() }).unwrap();
        assert_eq!(reader.header().metadata.unit, "K, 1, cd m-2");
    }

    /// XYZ are stored as R, G, B, and called X, Y, Z by reports.
    #[test]
    fn a_channel_is_taken_by_the_name_that_reports_give_it() {
        let directory = tempfile::tempdir().unwrap();
        let channels = ["R", "G", "B", "sigma.R", "sigma.G", "sigma.B"];
        let path = Some(written(directory.path(), &channels, &Metadata::new(QuantityKind::Xyz)));
        let taken = |channel: &str| {
            let options =
                InputOptions { path: path.clone(), channel: Some(channel.to_owned()), ..InputOptions::default() };
            read(&options).map(|(_, samples)| samples[0])
        };
        for (channel, first) in [("X", 0.0), ("z", 20.0), ("G", 10.0), ("sigma.X", 30.0), ("sigma.B", 50.0)] {
            assert_eq!(taken(channel).unwrap(), first, "{channel}");
        }
        let complaint = taken("W").unwrap_err().to_string();
        assert!(complaint.contains("it has X, Y, Z, sigma.R, sigma.G, sigma.B;"), "{complaint}");
    }

    #[test]
    fn marks_of_a_crop_are_those_within() {
        let directory = tempfile::tempdir().unwrap();
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.history.push(crate::metadata::HistoryEntry {
            program: "test".into(),
            version: "1".into(),
            arguments: Vec::new(),
        });
        let path = Some(written(directory.path(), &["R", "G", "B", MASK_LAYER], &metadata));
        let options = InputOptions { path, crop: Some(CROP), ..InputOptions::default() };
        // 332 to 335 and 432 to 435: each bit is set in half of them.
        assert_eq!(read(&options).unwrap().0.marked(), [4; 4]);
        let mut reader = FrameReader::open(&options).unwrap();
        reader.keep_mask();
        let mut samples = Vec::new();
        reader.read(2, &mut samples).unwrap();
        assert_eq!((samples.len(), samples[12], samples[31]), (32, 332.0, 435.0));
    }
}

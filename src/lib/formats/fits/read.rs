//! Reading rows of an image.

use super::header::{Array, BLOCK_BYTES, Header, Kind};
use super::keywords::{self, Told};
use super::sections::Sections;
use crate::error::{Error, Result};
use crate::formats::files::spool;
use crate::formats::format::{
    FrameFormat, Readers, Reading, Rest, SampleReader, SampleType, Sign, Streaming, behind_zeros,
};
use crate::formats::read_ahead::Pipe;
use crate::formats::register;
use crate::formats::rounded::Rounded;
use crate::frame::{Geometry, to_sample};
use crate::metadata::Metadata;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::FileExt;

/// FITS, the Flexible Image Transport System.
pub const FORMAT: FrameFormat = FrameFormat {
    name: "a FITS",
    sign: Sign::Bytes(begins_so),
    reading: Reading::Rows(Readers {
        open: |file, name, part| Ok(Box::new(FitsReader::open(file, name, part)?)),
        stream: Some(Streaming {
            is_streamable: begins_so,
            has_parts: true,
            open: |input, name| Ok(Box::new(FitsReader::stream(input, name)?)),
        }),
    }),
};

fn begins_so(head: &[u8]) -> bool {
    head.starts_with(b"SIMPLE  =")
}

/// Bytes that are read together where rows come in order.
const READ_BYTES: usize = 1 << 18;

/// Reads the rows of one image, the top one first, whichever the file begins with.
///
/// A plane is `Y`, three are `R`, `G`, `B`, others `C0`, `C1` … The values are those of the standard, `BZERO` + `BSCALE` ·
/// stored; a sample that is `BLANK` is NaN. Doubles and integers beyond 2²⁴ are rounded to `f32`.
pub struct FitsReader {
    name: String,
    source: Source,
    form: Form,
    geometry: Geometry,
    told: Told,
    next_row: usize,
    /// One row of one plane, as stored.
    stored: Vec<u8>,
    array: Array,
    /// What is rounded off.
    rounded: Rounded,
}

/// Where rows come from.
enum Source {
    /// One row after another, perhaps from another program.
    InOrder(Box<dyn Read + Send>, bool),
    /// From a file that holds the array from this byte on.
    Anywhere(File, u64),
}

/// How samples are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Form {
    stored: SampleType,
    scale: f64,
    zero: f64,
    blank: Option<f64>,
}

impl FitsReader {
    /// Opens a part (HDU) of a file, counted from 0, that stands at its start.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where there is no such part; [`Error::Format`] for what is damaged or no image; [`Error::Disk`].
    pub fn open(mut file: File, name: &str, part: usize) -> Result<Self> {
        let failed = |e| Error::disk(name, "read", e);
        let mut place = file.stream_position().map_err(failed)?;
        let mut primary = None;
        for number in 0..=part {
            let Some((mut header, array)) = part_at(&mut file, place, name)? else {
                return Err(Error::Usage(format!("{name}: there is no part {part}; its last one is {}", number - 1)));
            };
            let data = place + header.bytes;
            if number < part {
                place = data + array.padded_bytes();
                primary.get_or_insert(header);
                continue;
            }
            if !array.is_image() {
                // What is damaged further on is no matter here.
                let after = next_image(&mut file, data + array.padded_bytes(), part + 1, name).unwrap_or(None);
                return Err(no_image(name, part, &array.kind, after));
            }
            primary.iter().for_each(|primary| header.inherit(primary));
            return Self::placed(name, &header, array, file, data);
        }
        Err(Error::cut_short(name))
    }

    /// Opens the first part of a stream. Where rows do not come in order it is first copied to a temporary file.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn stream(mut input: Pipe, name: &str) -> Result<Self> {
        let header = Header::read(&mut input, name)?.ok_or_else(|| Error::format(name, "it is empty"))?;
        let array = Array::of(&header, name)?;
        if !array.is_image() {
            let next = if array.bytes == 0 { Header::read(&mut input, name).unwrap_or(None) } else { None };
            let next = next.and_then(|header| Array::of(&header, name).ok());
            return Err(no_image(name, 0, &array.kind, next.map(|array| (1, array))));
        }
        let (form, geometry, told) = described(name, &header, &array)?;
        if geometry.channels.len() == 1 && !told.is_bottom_up {
            let source = Source::InOrder(Box::new(BufReader::with_capacity(READ_BYTES, input)), true);
            return Ok(Self {
                name: name.into(),
                source,
                form,
                geometry,
                told,
                next_row: 0,
                stored: Vec::new(),
                array,
                rounded: Rounded::default(),
            });
        }
        let spooled = spool(&mut input, name)?;
        Self::placed(name, &header, array, spooled, 0)
    }

    /// The image whose array begins at the byte `data` of a file.
    fn placed(name: &str, header: &Header, array: Array, mut file: File, data: u64) -> Result<Self> {
        let failed = |e| Error::disk(name, "read", e);
        let (form, geometry, told) = described(name, header, &array)?;
        let length = file.seek(SeekFrom::End(0)).map_err(failed)?;
        if data.checked_add(array.bytes).is_none_or(|end| end > length) {
            return Err(Error::cut_short(name));
        }
        let source = if geometry.channels.len() == 1 && !told.is_bottom_up {
            file.seek(SeekFrom::Start(data)).map_err(failed)?;
            Source::InOrder(Box::new(BufReader::with_capacity(READ_BYTES, file)), false)
        } else {
            Source::Anywhere(file, data)
        };
        let (stored, rounded) = (Vec::new(), Rounded::default());
        Ok(Self { name: name.into(), source, form, geometry, told, next_row: 0, stored, array, rounded })
    }

    /// Brings one row of one plane, as stored.
    fn fetch(&mut self, row: usize, channel: usize) -> Result<()> {
        let Geometry { width, height, .. } = self.geometry;
        let bytes = width as u64 * self.form.stored.bytes() as u64;
        match &mut self.source {
            Source::InOrder(input, _) => {
                self.stored.clear();
                let read = input.by_ref().take(bytes).read_to_end(&mut self.stored);
                read.map_err(|e| Error::disk(&self.name, "read", e))?;
                if (self.stored.len() as u64) < bytes {
                    return Err(Error::cut_short(&self.name));
                }
            }
            Source::Anywhere(file, data) => {
                let row = if self.told.is_bottom_up { height - 1 - row } else { row };
                self.stored.resize(width * self.form.stored.bytes(), 0);
                let place = *data + (channel as u64 * height as u64 + row as u64) * bytes;
                file.read_exact_at(&mut self.stored, place).map_err(|e| Error::disk(&self.name, "read", e))?;
            }
        }
        Ok(())
    }
}

/// The header that begins at a place of the file, and what it says; none behind the last.
fn part_at(file: &mut File, place: u64, name: &str) -> Result<Option<(Header, Array)>> {
    file.seek(SeekFrom::Start(place)).map_err(|e| Error::disk(name, "read", e))?;
    let Some(header) = Header::read(&mut BufReader::new(file), name)? else { return Ok(None) };
    let array = Array::of(&header, name)?;
    Ok(Some((header, array)))
}

/// The next part that is an image, or would be one if it were not compressed, among those from a place on.
fn next_image(file: &mut File, mut place: u64, from: usize, name: &str) -> Result<Option<(usize, Array)>> {
    /// Parts that are looked at.
    const MOST: usize = 100;
    for number in from..from.saturating_add(MOST) {
        let Some((header, array)) = part_at(file, place, name)? else { return Ok(None) };
        if array.is_image() || array.kind == Kind::Tiles {
            return Ok(Some((number, array)));
        }
        place += header.bytes + array.padded_bytes();
    }
    Ok(None)
}

/// The complaint about a part that holds no image, with what to do instead.
fn no_image(name: &str, part: usize, kind: &Kind, after: Option<(usize, Array)>) -> Error {
    const UNPACK: &str = "unpack it first, for example with `funpack`";
    let problem = match kind {
        Kind::Tiles => {
            return Error::format(name, format!("its part {part} is an image in compressed tiles (ZIMAGE); {UNPACK}"));
        }
        Kind::Other(other) => format!("its part {part} is a {other}, not an image"),
        Kind::Array => format!("its part {part} holds no image"),
    };
    match after {
        Some((number, Array { kind: Kind::Tiles, .. })) => {
            Error::format(name, format!("{problem}, and part {number} one in compressed tiles (ZIMAGE); {UNPACK}"))
        }
        Some((number, array)) if array.is_image() => {
            Error::format(name, format!("{problem}, but part {number} does")).give(&["part"])
        }
        _ => Error::format(name, problem),
    }
}

/// How samples are stored, the size of the frame, and what else the header tells.
fn described(name: &str, header: &Header, array: &Array) -> Result<(Form, Geometry, Told)> {
    let form = Form::of(header, array.bitpix);
    let geometry = geometry(name, &array.axes)?;
    let mut told = keywords::read(header, geometry.channels.len(), array.bitpix > 0 && !form.is_scaled());
    told.notes.extend(form.notes());
    let Sections { masked, picture, notes } = Sections::of(header, &geometry, told.is_bottom_up);
    (told.metadata.masked_areas, told.picture) = (masked, picture);
    told.notes.extend(notes);
    told.doubts.drain(..).for_each(|doubt| register::doubt(format!("{name}: {doubt}")));
    Ok((form, geometry, told))
}

/// Columns, rows and planes.
fn geometry(name: &str, axes: &[u64]) -> Result<Geometry> {
    let side = |at: usize| {
        let side = axes.get(at).copied().unwrap_or(1);
        usize::try_from(side).ok().filter(|side| (1..=i32::MAX as usize).contains(side))
    };
    let (Some(width), Some(height), Some(planes)) = (side(0), side(1), side(2)) else {
        return Err(Error::format(name, "it is damaged: its header declares a size beyond any"));
    };
    if planes > usize::from(u16::MAX) || axes.iter().skip(3).any(|axis| *axis != 1) {
        let size: Vec<String> = axes.iter().map(u64::to_string).collect();
        let size = size.join("x");
        return Err(Error::format(name, format!("its array of {size} is no image of up to {} planes", u16::MAX)));
    }
    let channels = match planes {
        1 => vec!["Y".to_owned()],
        3 => ["R", "G", "B"].map(str::to_owned).to_vec(),
        _ => (0..planes).map(|plane| format!("C{plane}")).collect(),
    };
    Ok(Geometry { width, height, origin: [0, 0], channels })
}

/// BZERO of integers of 64 bits without sign, and the bit that it stands for.
const HALF_OF_64_BITS: f64 = 9_223_372_036_854_775_808.0;
const SIGN_OF_64_BITS: u64 = 1 << 63;

/// What no integers of 16 bits with sign are below: differences of frames may be negative, but not by so much.
const LEAST_WITH_SIGN: f32 = -16_384.0;

impl Form {
    /// Reads the keywords of samples.
    fn of(header: &Header, bitpix: i64) -> Self {
        let (scale, zero) = (header.number("BSCALE").unwrap_or(1.0), header.number("BZERO").unwrap_or(0.0));
        let stored = match (bitpix, scale == 1.0, zero) {
            (8, true, -128.0) => SampleType::I8,
            (8, ..) => SampleType::U8,
            (16, true, 32_768.0) => SampleType::U16,
            (16, ..) => SampleType::I16,
            (32, true, 2_147_483_648.0) => SampleType::U32,
            (32, ..) => SampleType::I32,
            (-32, ..) => SampleType::F32,
            (64, true, HALF_OF_64_BITS) => SampleType::U64,
            (64, ..) => SampleType::I64,
            _ => SampleType::F64,
        };
        let blank = header.number("BLANK").filter(|_| bitpix > 0);
        // Integers without sign are made of all their bits: doubles would round them beside so large a shift.
        let shift = if stored == SampleType::U64 { zero } else { 0.0 };
        Self { stored, scale, zero: zero - shift, blank: blank.map(|blank| blank + shift) }
    }

    /// Whether values are others than those that a program stored as integers or floats of this kind.
    fn is_scaled(&self) -> bool {
        let shift = match self.stored {
            SampleType::I8 => -128.0,
            SampleType::U16 => 32_768.0,
            SampleType::U32 => 2_147_483_648.0,
            _ => 0.0,
        };
        (self.scale, self.zero) != (1.0, shift)
    }

    /// What a user should know of it.
    fn notes(&self) -> Vec<String> {
        let Self { scale, zero, .. } = self;
        let scaled = || format!("its samples are {zero} + {scale} times what is stored (BZERO, BSCALE)");
        let blank = self.blank.map(|blank| format!("samples stored as {blank} (BLANK) are undefined: they are NaN"));
        let rounded = || "its samples of 64 bits are rounded to 32".to_owned();
        let is_wide = self.stored.bytes() == 8;
        self.is_scaled().then(scaled).into_iter().chain(blank).chain(is_wide.then(rounded)).collect()
    }

    /// Appends the values of stored samples.
    fn append(&self, stored: &[u8], samples: &mut Vec<f32>) -> std::result::Result<(), Overflow> {
        match self.stored {
            SampleType::U8 | SampleType::I8 => self.values(stored, samples, |[byte]: [u8; 1]| byte.into()),
            SampleType::U16 | SampleType::I16 => self.values(stored, samples, |bytes| i16::from_be_bytes(bytes).into()),
            SampleType::U32 | SampleType::I32 => self.values(stored, samples, |bytes| i32::from_be_bytes(bytes).into()),
            SampleType::U64 => {
                self.values(stored, samples, |bytes| (u64::from_be_bytes(bytes) ^ SIGN_OF_64_BITS) as f64)
            }
            SampleType::I64 => self.values(stored, samples, |bytes| i64::from_be_bytes(bytes) as f64),
            SampleType::F64 => self.values(stored, samples, f64::from_be_bytes),
            _ => self.values(stored, samples, |bytes| f32::from_be_bytes(bytes).into()),
        }
    }

    /// The values of stored samples before they are rounded, where single precision may round them.
    fn in_doubles(&self, stored: &[u8]) -> Vec<f64> {
        fn numbers<const BYTES: usize>(stored: &[u8], number: impl Fn([u8; BYTES]) -> f64) -> Vec<f64> {
            stored.as_chunks::<BYTES>().0.iter().map(|bytes| number(*bytes)).collect()
        }
        let mut found = match self.stored {
            SampleType::U32 | SampleType::I32 => numbers(stored, |bytes| i32::from_be_bytes(bytes).into()),
            SampleType::U64 => numbers(stored, |bytes| (u64::from_be_bytes(bytes) ^ SIGN_OF_64_BITS) as f64),
            SampleType::I64 => numbers(stored, |bytes| i64::from_be_bytes(bytes) as f64),
            _ => numbers(stored, f64::from_be_bytes),
        };
        for number in &mut found {
            *number = if self.blank == Some(*number) { f64::NAN } else { self.value(*number) };
        }
        found
    }

    /// value = BZERO + BSCALE · stored        \[FITS4, Eq. 3]
    fn value(&self, number: f64) -> f64 {
        if self.is_plain() { number } else { self.zero + self.scale * number }
    }

    /// Appends the values of stored samples by the number that each is.
    fn values<const BYTES: usize>(
        &self,
        stored: &[u8],
        samples: &mut Vec<f32>,
        number: impl Fn([u8; BYTES]) -> f64,
    ) -> std::result::Result<(), Overflow> {
        let start = samples.len();
        let mut overflows = false;
        samples.extend(stored.as_chunks::<BYTES>().0.iter().map(|bytes| {
            let number = number(*bytes);
            if self.blank == Some(number) {
                return f32::NAN;
            }
            let value = self.value(number);
            let sample = to_sample(value);
            overflows |= value.is_finite() && !sample.is_finite();
            sample
        }));
        debug_assert!(samples.len() - start == stored.len() / BYTES);
        if overflows { Err(Overflow) } else { Ok(()) }
    }

    /// The first of samples that tells that codes of 16 bits were stored as integers with sign, in which those above 32767 are negative.
    fn wrapped(&self, samples: &[f32]) -> Option<f32> {
        if self.stored != SampleType::I16 || !self.is_plain() {
            return None;
        }
        samples.iter().copied().find(|sample| *sample < LEAST_WITH_SIGN)
    }

    /// Whether values are the stored ones, of which NaN and infinities stay what they are.
    fn is_plain(&self) -> bool {
        (self.scale, self.zero) == (1.0, 0.0)
    }
}

/// A finite value beyond single precision.
struct Overflow;

impl SampleReader for FitsReader {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn stored_as(&self) -> Option<SampleType> {
        Some(self.form.stored)
    }

    fn natural_rows(&self) -> usize {
        1
    }

    fn may_wait(&self) -> bool {
        matches!(self.source, Source::InOrder(_, true))
    }

    fn embedded(&self) -> Option<&str> {
        None
    }

    fn own_tags(&self) -> &Metadata {
        &self.told.metadata
    }

    fn picture(&self) -> Option<(&'static str, [i64; 4])> {
        self.told.picture
    }

    fn notes(&self) -> &[String] {
        &self.told.notes
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        for row in self.next_row..self.next_row + rows {
            for channel in 0..self.geometry.channels.len() {
                self.fetch(row, channel)?;
                let start = samples.len();
                self.form.append(&self.stored, samples).map_err(|Overflow| {
                    Error::format(&self.name, "it has samples beyond 3.4e38, the largest of single precision")
                })?;
                if channel == 0 && Rounded::looks_at(self.form.stored, row) {
                    let values = self.form.in_doubles(&self.stored);
                    self.rounded.take(self.form.stored, &values, &samples[start..], self.geometry.width);
                }
                if let Some(sample) = self.form.wrapped(&samples[start..]) {
                    let problem = format!(
                        "it has a sample of {sample}, as codes above 32767 have that were stored as 16 bits with sign (BITPIX = 16 without \
                         BZERO); write them without sign, which in FITS is BZERO = 32768"
                    );
                    return Err(Error::format(&self.name, problem));
                }
            }
        }
        self.next_row += rows;
        if self.next_row == self.geometry.height {
            self.rounded.doubt(&self.name).into_iter().for_each(register::doubt);
        }
        Ok(())
    }

    fn rest(&mut self) -> Result<Rest> {
        let fill = self.array.padded_bytes() - self.array.bytes;
        let head = match &mut self.source {
            Source::InOrder(input, _) => behind(&mut BufReader::new(input), fill, &self.name)?,
            Source::Anywhere(file, data) => {
                let end = *data + self.array.bytes;
                file.seek(SeekFrom::Start(end)).map_err(|e| Error::disk(&self.name, "read", e))?;
                behind(&mut BufReader::with_capacity(READ_BYTES, file), fill, &self.name)?
            }
        };
        Ok(Rest::of_head(head, false))
    }
}

/// The first bytes behind an array, which `fill` bytes fill up, that are no other part of the file; none where all are. Zeros are
/// nothing.
fn behind(input: &mut impl BufRead, fill: u64, name: &str) -> Result<Vec<u8>> {
    let failed = |e| Error::disk(name, "read", e);
    let mut skip = fill;
    loop {
        io::copy(&mut input.take(skip), &mut io::sink()).map_err(failed)?;
        let (zeros, head) = behind_zeros(input).map_err(failed)?;
        let is_part = zeros.is_multiple_of(BLOCK_BYTES as u64) && head.starts_with(b"XTENSION=");
        if !is_part {
            return Ok(head);
        }
        let Some(header) = Header::read(&mut head.as_slice().chain(&mut *input), name)? else { return Ok(Vec::new()) };
        let array = Array::of(&header, name)?;
        if io::copy(&mut input.take(array.bytes), &mut io::sink()).map_err(failed)? < array.bytes {
            return Err(Error::cut_short(name));
        }
        skip = array.padded_bytes() - array.bytes;
    }
}

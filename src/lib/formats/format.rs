//! What a format of frames is to the rest of the library: how its files are known, and a reader of their samples.
//!
//! A new format is a file that ends in a [`FrameFormat`], and a line in [`super::table`].

use super::read_ahead::Pipe;
use super::tiff::{Directory, TiffFile};
use crate::camera::noise_profile::NoiseProfile;
use crate::color::rgb::{Encoding, Primaries};
use crate::error::Result;
use crate::frame::Geometry;
use crate::metadata::Metadata;
use std::fs::File;
use std::io::{self, BufRead, Read};

/// Reads the samples of one frame, top to bottom, and says what its file tells about it.
pub trait SampleReader: Send {
    /// Size, place and channels.
    fn geometry(&self) -> &Geometry;

    /// Whether the file itself says where on the sensor the frame begins; where it does not, its metadata may (`origin`).
    fn tells_place(&self) -> bool {
        self.geometry().origin != [0, 0]
    }

    /// How samples are stored; none where channels differ in it.
    fn stored_as(&self) -> Option<SampleType>;

    /// The number of rows that decode together; asking for multiples of it saves work.
    fn natural_rows(&self) -> usize;

    /// Whether the rows come from another program, which may take any time to give them.
    fn may_wait(&self) -> bool {
        false
    }

    /// The project's metadata that the file carries, YAML.
    fn embedded(&self) -> Option<&str>;

    /// Whether those were written when the samples were known, as a sidecar is, so that they describe them.
    fn describes_samples(&self) -> bool {
        false
    }

    /// What the format's own tags say, in the project's terms, the rest as in [`Metadata::new`]: where no metadata of ours
    /// are found, they stand in.
    fn own_tags(&self) -> &Metadata;

    /// Which part of the frame is the picture, X, Y, width and height, and what of the file says so; none where all of it is.
    fn picture(&self) -> Option<(&'static str, [i64; 4])> {
        None
    }

    /// What the format's own tags say of the colors of R, G and B.
    fn colors(&self) -> ColorTags {
        ColorTags::default()
    }

    /// What of the file was passed over, and why.
    fn notes(&self) -> &[String];

    /// The noise of the samples, where the file tells it.
    fn noise_profile(&self) -> Option<&NoiseProfile> {
        None
    }

    /// From which share of the range between black and white on, and from which sample, the file says that samples may be far from linear
    /// in light; none where it says so of none.
    fn linear_limit(&self) -> Option<(f64, f64)> {
        None
    }

    /// A doubt of a black level of 0 that the file does not tell, and its format takes for what is not told.
    fn doubt_of_black(&self) -> Option<&'static str> {
        None
    }

    /// Appends the next `rows` rows, laid out as `[row][channel][column]`; the values are those stored, integers not
    /// scaled. Rows beyond the last must not be asked for.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::Format`] where the file is damaged or cut short, [`crate::error::Error::Disk`] where
    /// reading fails.
    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()>;

    /// Hands out what lies behind the frame, of which the last row has been read.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::Disk`]; [`crate::error::Error::Format`] where damage hides where the frame ends.
    fn rest(&mut self) -> Result<Rest> {
        Ok(Rest::Nothing)
    }
}

/// What lies behind a frame.
pub enum Rest {
    /// Nothing, or what is part of it.
    Nothing,
    /// What comes of a stream, if anything.
    Pipe(Pipe),
    /// The bytes of a file from this one on.
    File(File, u64),
    /// What is not read on: behind a frame of this format none can follow.
    Unread {
        /// Up to [`HEAD_BYTES`] of what comes first.
        head: Vec<u8>,
        /// Whether it may be part of the frame, named by data that only its maker reads.
        may_belong: bool,
    },
}

impl Rest {
    /// What comes of `input`, which is not read on; zeros fill up and are nothing.
    ///
    /// # Errors
    ///
    /// What the input says.
    pub(super) fn unread(input: &mut impl BufRead, may_belong: bool) -> io::Result<Self> {
        let (_, head) = behind_zeros(input)?;
        Ok(Self::of_head(head, may_belong))
    }

    /// What begins so, and is not read on.
    pub(super) fn of_head(head: Vec<u8>, may_belong: bool) -> Self {
        if head.is_empty() { Self::Nothing } else { Self::Unread { head, may_belong } }
    }
}

/// Takes the zeros that come first, and up to [`HEAD_BYTES`] of what comes behind them; tells how many zeros there were.
///
/// # Errors
///
/// What the input says.
pub(super) fn behind_zeros(input: &mut impl BufRead) -> io::Result<(u64, Vec<u8>)> {
    let mut zeros = 0;
    loop {
        let bytes = input.fill_buf()?;
        let passed = bytes.iter().take_while(|byte| **byte == 0).count();
        let has_ended = passed < bytes.len() || bytes.is_empty();
        input.consume(passed);
        zeros += passed as u64;
        if has_ended {
            let mut head = Vec::new();
            input.take(HEAD_BYTES as u64).read_to_end(&mut head)?;
            return Ok((zeros, head));
        }
    }
}

/// What the tags of a file say of the colors of its R, G and B.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ColorTags {
    /// Primaries and white.
    pub primaries: Option<Primaries>,
    /// How samples, relative to full scale where they are integers, stand for linear light.
    pub encoding: Option<Encoding>,
    /// Luminance of R = G = B = 1 in cd m⁻².
    pub white_luminance: Option<f64>,
    /// What says more of them and is not read, as in `its color profile (iCCP)`.
    pub unread: Option<String>,
}

/// How a sample is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleType {
    /// 8-bit unsigned integer.
    U8,
    /// 8-bit signed integer.
    I8,
    /// 16-bit unsigned integer.
    U16,
    /// 16-bit signed integer.
    I16,
    /// 32-bit unsigned integer.
    U32,
    /// 32-bit signed integer.
    I32,
    /// 64-bit unsigned integer.
    U64,
    /// 64-bit signed integer.
    I64,
    /// Half-precision float.
    F16,
    /// Single-precision float.
    F32,
    /// Double-precision float.
    F64,
}

impl SampleType {
    /// Its short name: `u8`, `f32` …
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::U64 => "u64",
            Self::I64 => "i64",
            Self::F16 => "f16",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// Its bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The largest of an unsigned integer of 8 or 16 bits, which a picture's full scale is.
    pub fn full_scale(self) -> Option<f32> {
        match self {
            Self::U8 => Some(255.0),
            Self::U16 => Some(U16_FULL_SCALE),
            _ => None,
        }
    }

    /// Whether it is a float.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    /// Whether it is an integer without sign.
    pub fn is_unsigned(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32 | Self::U64)
    }
}

/// What full-scale sRGB is in 16 bits.
pub const U16_FULL_SCALE: f32 = 65535.0;

/// A format of frames: how its files are known, and what is done with them.
#[derive(Debug, Clone, Copy)]
pub struct FrameFormat {
    /// What messages call a file of it, with the article: `an EXR`.
    pub name: &'static str,
    /// How its files are known.
    pub sign: Sign,
    /// What is done with them.
    pub reading: Reading,
}

/// How the files of a format are known.
#[derive(Debug, Clone, Copy)]
pub enum Sign {
    /// By their first bytes, of which up to [`HEAD_BYTES`] are given.
    Bytes(fn(&[u8]) -> bool),
    /// They begin as a TIFF does: by the tags of their first image.
    Tags(fn(&mut TiffFile, &Directory) -> Result<bool>),
}

/// What is done with the files of a format.
#[derive(Debug, Clone, Copy)]
pub enum Reading {
    /// Their samples are read.
    Rows(Readers),
    /// A maker's own raw format: `import-raw` alone reads them ([`super::makers`]).
    MakersRaw,
    /// They are not read yet: what a user can do instead.
    NotYet(&'static str),
}

/// A reader of any format, or why there is none.
pub type Opened = Result<Box<dyn SampleReader>>;

/// How the files of a format are read.
#[derive(Debug, Clone, Copy)]
pub struct Readers {
    /// Opens a part (or page) of a file that can seek and stands at its start; the name is for messages.
    pub open: fn(File, &str, usize) -> Opened,
    /// How to read some of them without a seek.
    pub stream: Option<Streaming>,
}

/// How a file is read that comes down a pipe.
#[derive(Debug, Clone, Copy)]
pub struct Streaming {
    /// Whether a file that begins so is one that needs no seek, or settles itself how much of one it needs.
    pub is_streamable: fn(&[u8]) -> bool,
    /// Whether such a file may have parts besides the first, which need a seek.
    pub has_parts: bool,
    /// Opens it; the name is for messages.
    pub open: fn(Pipe, &str) -> Opened,
}

/// First bytes that tell most formats apart.
pub const HEAD_BYTES: usize = 16;

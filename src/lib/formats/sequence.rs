//! Frames one after another in a stream or a file, each complete with its own metadata, as netpbm's and pfstools' are.

use super::files::{STDIN_NAME, named, open_named, spool};
use super::format::{HEAD_BYTES, Rest};
use super::places::FRAME_OF;
use super::{pipe, register, table};
use crate::error::{Error, Result};
use crate::text::counted;
use std::fmt;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What may hold several frames, of which readers take one after another, each when the one before is read to its end.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::input::{FrameReader, InputOptions};
/// use cyanometer::formats::output::{FrameWriter, OutputOptions};
/// use cyanometer::formats::sequence::Sequence;
/// use cyanometer::stream::{Counts, RowSink, RowSource};
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Adu);
/// # let header = FrameHeader { name: "example".into(), geometry: Geometry::new(2, 2, &["Y"]), metadata };
///
/// let directory = tempfile::tempdir().unwrap();
/// let mut bytes = Vec::new();
/// for level in [1.0, 2.0, 3.0] {
///     let path = directory.path().join("one.exr");
///     let options = OutputOptions { path: Some(path.clone()), ..Default::default() };
///     let mut writer = FrameWriter::create(&options, &header)?;
///     writer.write(&[level; 4])?;
///     writer.finish(Counts::default())?;
///     bytes.extend(std::fs::read(path).unwrap());
/// }
/// let path = directory.path().join("all.exr");
/// std::fs::write(&path, bytes).unwrap();
///
/// let sequence = Sequence::of(Some(&path));
/// let mut levels = Vec::new();
/// while sequence.has_more()? {
///     let options = InputOptions { sequence: Some(sequence.clone()), ..Default::default() };
///     let mut samples = Vec::new();
///     FrameReader::open(&options)?.read(2, &mut samples)?;
///     levels.push(samples[0]);
/// }
/// assert_eq!(levels, [1.0, 2.0, 3.0]);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Clone)]
pub struct Sequence(Arc<Mutex<State>>);

struct State {
    path: Option<PathBuf>,
    at: At,
    /// Frames that were taken.
    taken: u64,
    /// Frames that the last says must follow it.
    to_come: u64,
    /// The frame that was taken last, where it can be taken again.
    last: Option<(File, u64)>,
    is_of_several_files: bool,
    /// Whether what comes behind a frame is looked at before the frame counts as read.
    is_settled: bool,
}

enum At {
    /// Nothing is open yet.
    Start,
    /// Before a frame, or at the end.
    Behind(Rest),
    /// In a frame that is not read to its end.
    Within,
}

/// The next frame of a sequence.
pub(super) struct Next {
    /// Where its bytes are; none where they are those of the file or stream that is not open yet.
    pub place: Option<Rest>,
    /// The file; none for the standard input.
    pub path: Option<PathBuf>,
    /// Its number, counted from 0.
    pub number: u64,
    /// Whether its metadata are to tell which file it comes from.
    pub is_of_several_files: bool,
}

impl Sequence {
    /// The frames of a file, or of the standard input for `-` or none; nothing is opened yet.
    pub fn of(path: Option<&Path>) -> Self {
        let path = named(path).map(Path::to_owned);
        let state = State {
            path,
            at: At::Start,
            taken: 0,
            to_come: 0,
            last: None,
            is_of_several_files: false,
            is_settled: false,
        };
        Self(Arc::new(Mutex::new(state)))
    }

    /// The same of one of several files: metadata of its frames tell which.
    pub fn among_others(self) -> Self {
        self.state().is_of_several_files = true;
        self
    }

    /// The same whose frames go into named files, which get their names once no bytes but frames come behind: these are waited for, unless
    /// the frame says itself that others follow.
    #[must_use]
    pub fn settled(self) -> Self {
        self.state().is_settled = true;
        self
    }

    /// The same, of which each frame can be taken [again](Self::again): what comes of a stream is copied to a temporary file
    /// first.
    ///
    /// # Errors
    ///
    /// Those of [`open_named`]; [`Error::Disk`].
    pub fn of_repeatable(path: Option<&Path>) -> Result<Self> {
        let sequence = Self::of(path);
        let (mut file, name) = open_named(path)?;
        if !file.metadata().map_err(|e| Error::disk(&name, "read", e))?.is_file() {
            file = spool(&mut file, &name)?;
        }
        let first = file.stream_position().map_err(|e| Error::disk(&name, "read", e))?;
        sequence.state().at = At::Behind(Rest::File(file, first));
        Ok(sequence)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Whoever panics leaves it as it was.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What messages call it.
    fn name(path: Option<&Path>) -> String {
        path.map_or_else(|| STDIN_NAME.to_owned(), |path| path.display().to_string())
    }

    /// Whether another frame comes. What has not been opened yet has one, as will turn out.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for bytes behind a frame that are no frame, and where more were to come; [`Error::Disk`].
    pub fn has_more(&self) -> Result<bool> {
        let State { path, at, taken, to_come, .. } = &mut *self.state();
        let name = Self::name(path.as_deref());
        let comes = match at {
            At::Start => Ok(true),
            At::Within => Ok(false),
            // What is wrong with the first is told by those who open it.
            At::Behind(_) if *taken == 0 => Ok(true),
            At::Behind(rest) => rest.begins_frame(&name),
        };
        let has_ended = matches!(comes, Ok(false));
        // Where nobody knows how many frames there are, the program before tells that it has not given all.
        let may_lack = *to_come > 0 || *taken > 0 && matches!(at, At::Behind(_));
        if has_ended && may_lack && path.is_none() && pipe::has_failed() {
            return Err(Error::Upstream);
        }
        if *to_come > 0 && has_ended {
            let came = counted(*taken, "frames");
            let problem =
                format!("it ends behind {came}, and {to_come} more were to come: the program before has failed");
            return Err(Error::format(&name, problem));
        }
        comes
    }

    /// Notes how many frames at least follow the one that was taken last.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where these are fewer than the frame before has left: some are missing between them, or their order is another.
    pub(super) fn expect(&self, to_come: u64, name: &str) -> Result<()> {
        let wanted = std::mem::replace(&mut self.state().to_come, to_come).saturating_sub(1);
        if to_come < wanted {
            let problem = format!(
                "{to_come} frames follow it, by what it says, where {wanted} should, by the frame before: between them some are missing, or \
                 their order is not that in which they were written"
            );
            return Err(Error::format(name, problem));
        }
        Ok(())
    }

    /// How many frames at least follow the one that was taken last, by what it says itself.
    pub fn to_come(&self) -> u64 {
        self.state().to_come
    }

    /// Goes back to the first byte of the frame that was taken last.
    pub fn again(&self) {
        let state = &mut *self.state();
        if let Some((file, at)) = state.last.take() {
            state.at = At::Behind(Rest::File(file, at));
            state.taken -= 1;
        }
    }

    /// The next frame, which is about to be read.
    pub(super) fn take(&self) -> Result<Next> {
        let state = &mut *self.state();
        let place = match std::mem::replace(&mut state.at, At::Within) {
            At::Start => None,
            At::Behind(rest) => Some(rest),
            At::Within => {
                return Err(Error::Data(format!("{}: it has no more frames", Self::name(state.path.as_deref()))));
            }
        };
        state.last = match &place {
            Some(Rest::File(file, at)) => file.try_clone().ok().map(|file| (file, *at)),
            _ => None,
        };
        let number = state.taken;
        state.taken += 1;
        Ok(Next { place, path: state.path.clone(), number, is_of_several_files: state.is_of_several_files })
    }

    /// Goes on behind a frame of such a name that was read to its end.
    ///
    /// # Errors
    ///
    /// Those of [`Self::has_more`], as far as it is known what comes.
    pub(super) fn go_on(&self, mut rest: Rest, name: &str) -> Result<()> {
        // What a file holds is known now; what a stream brings may take its time.
        if !matches!(rest, Rest::Pipe(_)) {
            rest.begins_frame(name)?;
        }
        let is_waited_for = {
            let mut state = self.state();
            state.at = At::Behind(rest);
            state.is_settled && state.to_come == 0
        };
        if is_waited_for { self.has_more().map(drop) } else { Ok(()) }
    }
}

impl fmt::Debug for Sequence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let State { path, taken, .. } = &*self.state();
        f.debug_struct("Sequence").field("path", path).field("taken", taken).finish_non_exhaustive()
    }
}

impl Next {
    /// What messages call the frame.
    pub fn name(&self) -> String {
        let name = Sequence::name(self.path.as_deref());
        if self.number == 0 { name } else { format!("{name}{FRAME_OF}{}", self.number) }
    }
}

impl Rest {
    /// Up to [`HEAD_BYTES`] of what comes first.
    fn head(&mut self, name: &str) -> Result<Vec<u8>> {
        let head = match self {
            Self::Nothing => Ok(Vec::new()),
            Self::Unread { head, .. } => Ok(head.clone()),
            Self::Pipe(pipe) => pipe.head(HEAD_BYTES).map(<[u8]>::to_vec),
            Self::File(file, at) => {
                let mut head = Vec::new();
                let found = file.seek(SeekFrom::Start(*at));
                found.and_then(|_| file.take(HEAD_BYTES as u64).read_to_end(&mut head)).map(|_| head)
            }
        };
        head.map_err(|e| Error::disk(name, "read", e))
    }

    /// Whether a frame comes, of those that can stand behind another.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for bytes that are none; [`Error::Disk`].
    pub(super) fn begins_frame(&mut self, name: &str) -> Result<bool> {
        let head = self.head(name)?;
        if head.is_empty() {
            return Ok(false);
        }
        if !matches!(self, Self::Unread { .. }) && table::may_follow(&head) {
            return Ok(true);
        }
        self.refuse(&head, name).map(|()| false)
    }

    /// Makes sure that nothing comes.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where something does; [`Error::Disk`].
    pub(super) fn end(mut self, name: &str) -> Result<()> {
        if self.begins_frame(name)? { Err(Error::format(name, ANOTHER)) } else { Ok(()) }
    }

    /// Complains of what begins so; of what may be part of the frame a doubt is noted.
    fn refuse(&self, head: &[u8], name: &str) -> Result<()> {
        if let Some(format) = table::known_by(head) {
            let problem = format!(
                "behind it comes {}; a stream has one frame, or several that are EXR of one part in scanlines: give each a file of its own",
                format.name
            );
            return Err(Error::format(name, problem));
        }
        if matches!(self, Self::Unread { may_belong: true, .. }) {
            register::doubt(format!("{name}: behind what its tags name come more bytes, which are passed over"));
            return Ok(());
        }
        Err(Error::format(name, NO_FRAME))
    }
}

/// The complaint about bytes that are none.
const NO_FRAME: &str = "behind its last row come bytes that are no part of it; cut them off";
/// The complaint about a frame that nobody asked for.
const ANOTHER: &str = "behind it comes another frame, where one is wanted; give each a file of its own";

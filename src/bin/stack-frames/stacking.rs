//! Frames into stacks, and out of them.

use crate::read::{Stack, StackedFrame};
use crate::write::{StackOptions, StackWriter};
use clap::Args;
use cyanometer::error::{Error, Result};
use cyanometer::formats::input::FrameReader;
use cyanometer::formats::output::CompressionKind;
use cyanometer::formats::places::{is_pattern, is_stack, named, names_stack};
use cyanometer::requests::options::{Following, Input, Output};
use cyanometer::requests::values;
use cyanometer::stream::RowSource;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Which frames are taken.
#[derive(Debug, Clone, Default, Args)]
pub struct StackRequest {
    /// Take these frames of each stack alone, A to B - 1, counted from 0
    #[arg(long, value_name = "A..B", value_parser = values::exposures)]
    frames: Option<Range<u32>>,
}

/// Frames in stacks, of which some are wanted.
pub struct Stacked(Vec<(Arc<Stack>, Range<u64>)>);

/// A frame in a stack.
pub struct StackedTurn<'a> {
    stack: &'a Arc<Stack>,
    index: u64,
    /// How many come before it in the same run, and how many behind.
    number: u64,
    left: u64,
}

impl StackRequest {
    /// The frames that are wanted of stacks; none where the inputs are frames.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where stacks and frames come together, frames of what is no stack are chosen, or a stack has not so many;
    /// those of [`Stack::open`].
    pub fn stacked(&self, input: &Input, output: &Output) -> Result<Option<Stacked>> {
        let (stacks, frames): (Vec<_>, Vec<_>) =
            input.inputs.iter().partition(|path| names_stack(path) || is_stack(path));
        match (stacks.first(), frames.first()) {
            (Some(stack), Some(frame)) => {
                let [stack, frame] = [stack, frame].map(|path| path.display());
                return Err(Error::Usage(format!(
                    "{stack} is a stack and {frame} is none; take one kind at a time, or put them one behind \
                     the other: (stack-frames {stack}; cat {frame}) | stack-frames -o NEW.zarr"
                )));
            }
            (None, _) if self.frames.is_some() => {
                let problem = "frames are chosen out of stacks, and no input is one";
                return Err(Error::Usage(problem.into()).leave_out(&["frames"]));
            }
            (None, _) => return Ok(None),
            (Some(_), None) => {}
        }
        let mut all = Vec::new();
        for path in stacks {
            check_outside(path, output)?;
            std::fs::metadata(path).map_err(|e| Error::disk(&path.display().to_string(), "open", e))?;
            let stack = Stack::open(path)?;
            let has = 0..stack.frames();
            let wanted = self.frames.clone().map_or(has.clone(), |Range { start, end }| start.into()..end.into());
            if wanted.end > has.end {
                let problem = format!("{}: its frames are 0..{}", stack.name(), has.end);
                return Err(Error::Usage(problem).change(&["frames"]));
            }
            all.push((stack, wanted));
        }
        Ok(Some(Stacked(all)))
    }
}

/// Makes sure that nothing is written into a stack that is read, where the next one would replace it.
fn check_outside(stack: &Path, output: &Output) -> Result<()> {
    let Some(target) = named(output.output.as_deref()) else { return Ok(()) };
    let whole = |path: &Path| std::fs::canonicalize(path).ok();
    let above =
        target.ancestors().skip(1).map(|above| if above.as_os_str().is_empty() { Path::new(".") } else { above });
    let inside =
        above.filter_map(whole).next().zip(whole(stack)).is_some_and(|(above, stack)| above.starts_with(stack));
    if inside {
        let (target, stack) = (target.display(), stack.display());
        let problem = format!("{target}: it would lie inside the stack {stack}; name a place outside");
        return Err(Error::Usage(problem).change(&["output"]));
    }
    Ok(())
}

impl Stacked {
    /// How many they are.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|(_, wanted)| wanted.end - wanted.start).sum()
    }

    /// One after another.
    pub fn turns(&self) -> impl Iterator<Item = StackedTurn<'_>> {
        let all = self.0.iter().flat_map(|(stack, wanted)| wanted.clone().map(move |index| (stack, index)));
        let count = self.count();
        (0..).zip(all).map(move |(number, (stack, index))| StackedTurn {
            stack,
            index,
            number,
            left: count - number - 1,
        })
    }
}

impl StackedTurn<'_> {
    /// Opens the frame, and tells where it goes.
    ///
    /// # Errors
    ///
    /// Those of [`StackedFrame::open`] and [`FrameReader::of`].
    pub fn open(&self, input: &Input, output: &Output) -> Result<(FrameReader, Output)> {
        let frame = StackedFrame::open(self.stack, self.index)?;
        let name = frame.name();
        let reader = FrameReader::of(Box::new(frame), &name, None, &input.options_for_all())?;
        let following = Following { exposures: 1, inputs_left: self.left, ..Following::default() };
        Ok((reader, Output { index: self.number, following, ..output.clone() }))
    }
}

/// The stack that frames go to.
pub struct SharedStack(Mutex<StackWriter>);

impl SharedStack {
    /// Begins the stack that an output names; none where frames go out.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for options that stacks have not; those of [`StackWriter::create`].
    pub fn of(output: &Output) -> Result<Option<Self>> {
        let Some(path) = named(output.output.as_deref()).filter(|path| names_stack(path)) else { return Ok(None) };
        let wrong = |problem: &str| Error::Usage(format!("{}: {problem}", path.display()));
        if is_pattern(Path::new(path.as_os_str().to_string_lossy().trim_end_matches('/'))) {
            return Err(wrong("all frames go into one stack, which has a plain name"));
        }
        let chosen: [(bool, &str, &'static [&'static str]); 4] = [
            (output.separate_layers, "layers are arrays of their own in a stack", &["separate_layers"]),
            (output.resume, "a stack is whole or not at all", &["resume"]),
            (output.viewable, "stacks are for arrays, not for viewers", &["viewable"]),
            (output.format.is_some(), "a stack is no such format", &["format"]),
        ];
        if let Some((_, problem, option)) = chosen.into_iter().find(|(is_chosen, ..)| *is_chosen) {
            return Err(wrong(problem).leave_out(option));
        }
        let is_compressed = match output.compression {
            None | Some(CompressionKind::None) => false,
            Some(CompressionKind::Deflate) => true,
            Some(_) => return Err(wrong("a stack is compressed by deflate, or not at all").change(&["compression"])),
        };
        let options = StackOptions { samples: output.sample_type, is_compressed };
        Ok(Some(Self(Mutex::new(StackWriter::create(path, options)?))))
    }

    /// Adds a frame.
    ///
    /// # Errors
    ///
    /// Those of [`StackWriter::add`].
    pub fn add(&self, frame: &mut dyn RowSource) -> Result<()> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).add(frame)
    }

    /// Ends the stack; tells how many frames it has.
    ///
    /// # Errors
    ///
    /// Those of [`StackWriter::finish`].
    pub fn finish(self) -> Result<u64> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner).finish()
    }
}

//! What a running program does besides its computation: words, history, threads, outputs.

use super::general::{General, ProgressWhen};
use super::history::Signature;
use super::words::complain;
use crate::error::{Error, Result};
use crate::formats::input::FrameReader;
use crate::formats::output::{Format, FrameWriter, OutputOptions};
use crate::formats::places::{FRAME_OF, named, place, sidecar_path};
use crate::formats::{register, resume};
use crate::frame::Geometry;
use crate::masking::Masking;
use crate::metadata::FrameHeader;
use crate::requests::batch;
use crate::requests::correction::OpenCorrection;
use crate::requests::options::Output;
use crate::requests::{self, Note};
use crate::stages::darks::DarkFrames;
use crate::stages::saturation::{MASK_LAYER, with_mask};
use crate::stream::{Counts, MemoryFrame, RowSink, RowSource, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::collections::HashSet;
use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// What a running program says besides its output.
#[derive(Debug, Clone)]
pub struct Session {
    pub(super) program: &'static str,
    pub(super) general: General,
    /// The command line behind the program's name, wildcards expanded.
    words: Arc<[OsString]>,
    signature: Arc<Signature>,
    /// All frames that are worked on, and their sidecars, where there are several.
    frames: Arc<HashSet<String>>,
    /// The input that is worked on, where there are several.
    input: Option<PathBuf>,
    run: Arc<Mutex<Run>>,
}

/// What all frames of a run have in common.
#[derive(Debug, Default)]
struct Run {
    /// What was said, whichever frame it was about.
    said: HashSet<String>,
    /// Where frames went; none is the standard output.
    written: HashSet<Option<PathBuf>>,
}

impl Session {
    pub(super) fn new(program: &'static str, words: Vec<OsString>, general: General) -> Self {
        let signature = Arc::new(Signature::of(words.iter().cloned(), &[]));
        Self {
            program,
            words: words.into(),
            general,
            signature,
            frames: Arc::default(),
            input: None,
            run: Arc::default(),
        }
    }

    /// The same for a run of several inputs.
    pub fn among(&self, inputs: &[PathBuf]) -> Self {
        let signature = Arc::new(Signature::of(self.words.iter().cloned(), inputs));
        let frames = if inputs.len() > 1 {
            inputs.iter().flat_map(|input| with_sidecar(input)).collect()
        } else {
            HashSet::new()
        };
        Self { signature, frames: Arc::new(frames), ..self.clone() }
    }

    /// The same for one of them.
    pub fn on(&self, input: Option<&Path>) -> Self {
        Self { input: input.map(Path::to_owned), ..self.clone() }
    }

    /// The same without progress of its own.
    pub(super) fn without_progress(&self) -> Self {
        Self { general: General { progress: ProgressWhen::Never, ..self.general.clone() }, ..self.clone() }
    }

    fn run(&self) -> MutexGuard<'_, Run> {
        // Whoever panics leaves it as it was.
        self.run.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says something that the user should hear, unless `--quiet`; what it said of another frame of the same stream it does not
    /// say again.
    pub fn warn(&self, text: &str) {
        if !self.general.quiet && self.run().said.insert(of_any_frame(text)) {
            complain(self.program, &format!("warning: {text}"));
        }
    }

    /// Says something to those who asked with `--verbose`.
    pub fn note(&self, text: &str) {
        if self.general.verbose && self.run().said.insert(of_any_frame(text)) {
            complain(self.program, text);
        }
    }

    /// Says what came up in a request.
    pub fn tell(&self, notes: &[Note]) {
        for note in notes {
            match note {
                Note::Warning(text) => self.warn(text),
                Note::Remark(text) => self.note(text),
            }
        }
    }

    /// Warns of what was found out too late to refuse it.
    pub(super) fn warn_of_doubts(&self) {
        register::doubts().iter().for_each(|doubt| self.warn(doubt));
    }

    /// How many threads work.
    pub(super) fn threads() -> usize {
        rayon::current_num_threads()
    }

    /// Settles how many threads work: what was asked for; or one where frames come or go through a pipe, at whose other end
    /// another program has a processor of its own; or all; or one where the system starts no more.
    pub(super) fn settle_threads(&self) {
        let General { threads, pipeline, .. } = self.general;
        let count = threads.or(pipeline.then_some(1)).unwrap_or_default();
        let pool = |count| rayon::ThreadPoolBuilder::new().num_threads(count);
        // One thread is this one: no other is started.
        let global = if count == 1 { pool(count).use_current_thread() } else { pool(count) };
        if global.build_global().is_err() {
            // Only the first global pool counts, and that has failed: one of this thread alone stands in.
            self.note("the system starts no more threads; one works");
            std::mem::forget(pool(1).use_current_thread().build());
        } else if threads.is_none() && count == 1 {
            self.note("one thread, as frames pass through a pipe; --threads gives it more");
        }
    }

    /// Adds this program to a frame's history and says what it leaves out. The history of a frame that is one of several
    /// inputs names this one alone.
    pub fn sign(&self, header: &mut FrameHeader) {
        self.sign_exposure(header, None);
    }

    /// The same for one of several exposures, which is told from the others as if it were drawn alone.
    pub fn sign_exposure(&self, header: &mut FrameHeader, exposure: Option<u32>) {
        let drawn = exposure.map(|number| ["--frame".to_owned(), number.to_string()]);
        let entry = self.signature.entry(self.program, self.input.as_deref(), drawn.into_iter().flatten());
        header.metadata.history.push(entry);
        for left_out in header.metadata.left_out.iter().filter(|entry| entry.program == self.program) {
            self.note(&format!("left out: {} ({})", left_out.what, left_out.why));
        }
    }

    /// Says what a reader noticed.
    pub fn report_reader(&self, reader: &FrameReader) {
        self.tell(&requests::of_reader(reader));
    }

    /// A progress bar over rows or frames, on terminals only.
    pub fn progress(&self, count: usize) -> ProgressBar {
        let shown = match self.general.progress {
            ProgressWhen::Always => true,
            ProgressWhen::Never => false,
            ProgressWhen::Auto => !self.general.quiet && std::io::stderr().is_terminal(),
        };
        let bar = ProgressBar::with_draw_target(Some(count as u64), ProgressDrawTarget::hidden());
        if shown {
            let template = format!("{} {{bar:30}} {{percent}} % {{eta}}", self.program);
            if let Ok(style) = ProgressStyle::with_template(&template) {
                bar.set_style(style);
            }
            bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        bar
    }

    /// Drives a frame through a stage from an open reader to a new output.
    ///
    /// # Errors
    ///
    /// Those of reader, stage and writer.
    pub fn drive<S: Stage>(&self, mut reader: FrameReader, stage: &S, output: &Output) -> Result<()> {
        self.report_reader(&reader);
        let layers = output.options().holds_layers()?;
        let masking = Masking::of(reader.header(), reader.has_mask(), stage.header(), layers);
        reader.keep_mask();
        let no_darks: Option<&mut DarkFrames<FrameReader>> = None;
        let made = masking.header(stage);
        let known = unmarked(&reader, stage.header());
        let mut own = Counts::default();
        let counts = self.write(&made, output, |writer, progress| {
            own = masking.run(stage, &mut reader, no_darks, writer, progress)?;
            Ok(Counts { saturated_pixels: own.saturated_pixels.max(known), ..own })
        })?;
        self.ended(reader, counts.map(|_| own)).map(drop)
    }

    /// Drives the rows that have become of a frame `read` without a layer of marks, of which so much was counted before, through a stage
    /// to a new output.
    ///
    /// # Errors
    ///
    /// Those of rows, stage and writer.
    pub(super) fn drive_rows<S: Stage>(
        &self,
        read: &FrameHeader,
        (rows, before): (&mut dyn RowSource, Counts),
        stage: &S,
        output: &Output,
    ) -> Result<Option<Counts>> {
        let masking = Masking::of(read, false, stage.header(), output.options().holds_layers()?);
        let made = masking.header(stage);
        let no_darks: Option<&mut DarkFrames<FrameReader>> = None;
        self.write(&made, output, |writer, progress| {
            Ok(before.plus(masking.run(stage, rows, no_darks, writer, progress)?))
        })
    }

    /// Passes a frame from an open reader on to a new output as it is; what its sidecar counted is counted on.
    ///
    /// # Errors
    ///
    /// Those of reader and writer; [`Error::Usage`] where the output has no place for marks of pixels.
    pub fn pass(&self, mut reader: FrameReader, output: &Output) -> Result<()> {
        let mut made = reader.header().clone();
        let has_marks =
            made.geometry.channels.len() > 1 && made.geometry.channels.last().is_some_and(|last| last == MASK_LAYER);
        if has_marks && !output.options().holds_layers()? {
            return Err(Error::Usage(format!(
                "{}: only an EXR has a layer for the marks of its pixels; write one",
                made.name
            )));
        }
        let counts = made.metadata.samples.take().map_or_else(Counts::default, |record| Counts::recorded(&record));
        let counts = self.write(&made, output, |writer, progress| {
            let Geometry { height, .. } = made.geometry;
            let step = made.geometry.step_rows(reader.natural_rows()).max(1);
            let (mut rows, mut done) = (Vec::new(), 0);
            while done < height {
                rows.clear();
                reader.read(step.min(height - done), &mut rows)?;
                writer.write(&rows)?;
                done += step.min(height - done);
                progress(done);
            }
            Ok(counts)
        })?;
        if counts.is_some() { Ok(()) } else { reader.drain() }
    }

    /// Corrects a frame from an open reader to a new output; tells whether it had to be.
    ///
    /// # Errors
    ///
    /// Those of readers and writer.
    pub fn correct(&self, mut reader: FrameReader, correction: &mut OpenCorrection, output: &Output) -> Result<bool> {
        self.report_reader(&reader);
        let layers = output.options().holds_layers()?;
        let OpenCorrection { stage, corrections, .. } = correction;
        let is_masked = reader.has_mask();
        let counts = if corrections.may_mark() {
            let made = if layers { with_mask(stage.header().clone()) } else { stage.header().clone() };
            reader.keep_mask();
            self.write(&made, output, |writer, progress| {
                corrections.run(stage, &mut reader, [is_masked, layers], writer, progress)
            })?
        } else {
            let masking = Masking::of(reader.header(), is_masked, stage.header(), layers);
            reader.keep_mask();
            self.write(&masking.header(stage), output, |writer, progress| {
                masking.run(stage, &mut reader, corrections.darks.as_mut(), writer, progress)
            })?
        };
        self.ended(reader, counts)
    }

    /// Says what was counted of a frame; one that was complete is passed over. Tells whether it was made.
    pub(super) fn ended(&self, mut reader: FrameReader, counts: Option<Counts>) -> Result<bool> {
        match counts {
            Some(counts) => counts.warnings().iter().for_each(|warning| self.warn(warning)),
            None => reader.drain()?,
        }
        Ok(counts.is_some())
    }

    /// Has `run` write a frame whose head is `made`, beside a progress bar; nothing is counted of one that is complete already, with
    /// `--resume`.
    ///
    /// # Errors
    ///
    /// Those of `run` and of the writer; [`Error::Usage`] where another frame of this run went to the same place.
    pub fn write(
        &self,
        made: &FrameHeader,
        output: &Output,
        run: impl FnOnce(&mut FrameWriter, &mut dyn FnMut(usize)) -> Result<Counts>,
    ) -> Result<Option<Counts>> {
        let options = self.place(made, output)?;
        if output.resume && output.is_stream() {
            let problem = "a stream keeps nothing of an earlier run; name files for what is made";
            return Err(Error::Usage(problem.into()).leave_out(&["resume"]));
        }
        if output.resume && !self.is_outdated(&options, made) && resume::is_complete(&options, made)? {
            self.note(&format!("{} is complete", place_of(&options)));
            return Ok(None);
        }
        let mut writer = FrameWriter::create(&options, made)?;
        let bar = self.progress(made.geometry.height);
        let counts = run(&mut writer, &mut |rows| bar.set_position(rows as u64))?;
        bar.finish_and_clear();
        let did_not_fit = writer.finish(counts)?;
        if did_not_fit > 0 {
            self.warn(&format!("{did_not_fit} samples do not fit 16 bits; they are stored as 0 or 65535, NaN as 0"));
        }
        Ok(Some(counts))
    }

    /// Whether one of the files that the frame `made` is made of was changed after it was written.
    fn is_outdated(&self, options: &OutputOptions, made: &FrameHeader) -> bool {
        let Some(written) = named(options.path.as_deref()).and_then(modified) else { return false };
        let own = |path: &Path| with_sidecar(path).into_iter().collect::<HashSet<String>>();
        let of_it = self.input.as_deref().map(own).unwrap_or_default();
        let changed = register::changed_after(written, |name| !self.frames.contains(name) || of_it.contains(name));
        // Of what comes through a pipe the first program has read the file.
        let file = made.metadata.file.as_deref().map(Path::new);
        let names = file.into_iter().flat_map(with_sidecar);
        let changed = changed
            .or_else(|| names.into_iter().find(|name| modified(Path::new(name)).is_some_and(|time| time > written)));
        changed
            .iter()
            .for_each(|name| self.note(&format!("{name} was changed since; {} is made anew", place_of(options))));
        changed.is_some()
    }

    /// Signs a frame in memory, and writes it.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn write_whole(&self, frame: &mut MemoryFrame, output: &Output) -> Result<()> {
        self.sign(&mut frame.header);
        self.write(&frame.header, output, |writer, _| writer.write(&frame.samples).map(|()| Counts::default()))?;
        Ok(())
    }

    /// Where and how a frame is written.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where another frame of this run went to the same place, and cannot be followed there; those of
    /// [`batch::check_named`].
    pub fn place(&self, made: &FrameHeader, output: &Output) -> Result<OutputOptions> {
        let options = output.options_for(made);
        if made.metadata.file.is_none() {
            batch::check_named(options.path.as_deref())?;
        }
        let path = named(options.path.as_deref()).filter(|_| !output.is_stream());
        if self.run().written.insert(place(path)) {
            return Ok(options);
        }
        match path {
            Some(path) => Err(Error::Usage(format!(
                "{}: another frame of this run went there; give names with {{stem}}, that of its file, {{frame}}, the number of \
                 the exposure, or {{index}}, that in the stream",
                path.display()
            ))),
            None if options.format.is_none_or(|format| format == Format::Exr) => Ok(options),
            None => Err(Error::Usage("of several frames in one stream each is an EXR; leave out --format".into())),
        }
    }
}

/// When a file was changed last.
fn modified(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|about| about.modified()).ok()
}

/// The names of a frame and of its sidecar.
fn with_sidecar(frame: &Path) -> [String; 2] {
    [frame, &sidecar_path(frame)].map(|path| path.display().to_string())
}

/// How messages call a file that is written.
fn place_of(options: &OutputOptions) -> String {
    options.path.as_deref().map(|path| path.display().to_string()).unwrap_or_default()
}

/// A text without the number of the frame in its stream.
fn of_any_frame(text: &str) -> String {
    let Some((before, behind)) = text.split_once(FRAME_OF) else { return text.to_owned() };
    format!("{before}{}", behind.trim_start_matches(|c: char| c.is_ascii_digit()))
}

/// How many pixels of a frame that becomes another of as many planes were made of saturated samples by its sidecar, where nothing marks
/// which: they are no fewer there.
fn unmarked(reader: &FrameReader, made: &FrameHeader) -> u64 {
    let frame = reader.header();
    let counted = frame.metadata.samples.as_ref().and_then(|samples| samples.saturated);
    counted
        .filter(|_| frame.leads_with_three_planes() && made.geometry.channels.len() >= 3 && !reader.has_mask())
        .unwrap_or(0)
}

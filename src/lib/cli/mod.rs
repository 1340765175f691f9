//! The command line: start, complain, exit; what a program says beside its output.

mod advice;
pub mod demo;
mod documents;
pub mod examples;
mod general;
mod help;
mod history;
mod memory;
pub mod pages;
pub mod programs;
mod signals;
mod usage;

pub use general::{General, ProgressWhen};
pub use history::history_entry;
pub use memory::Memory;

use crate::error::{Error, Result};
use crate::formats::atomic::remove_pending_now;
use crate::formats::input::FrameReader;
use crate::formats::output::FrameWriter;
use crate::formats::places::STDOUT_NAME;
use crate::formats::{keys, register, standard};
use crate::masking::Masking;
use crate::metadata::{FrameHeader, METADATA_TEMPLATE};
use crate::numerics::vectors::Instructions;
use crate::requests::correction::OpenCorrection;
use crate::requests::options::Output;
use crate::requests::{self, Note};
use crate::stages::darks::DarkFrames;
use crate::stages::saturation::with_mask;
use crate::stream::{Counts, RowSource, Stage};
use crate::text::one_line;
use clap::{Command, CommandFactory, FromArgMatches};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;

/// Exit status after an internal error, as Rust's programs have it.
const PANICKED: i32 = 101;

/// What a running program says besides its output.
#[derive(Debug)]
pub struct Session {
    program: &'static str,
    general: General,
}

/// Parses the arguments, runs a program, and says in one line what went wrong.
pub fn start<A: CommandFactory + FromArgMatches>(
    program: &'static str,
    general: impl FnOnce(&A) -> General,
    body: impl FnOnce(&A, &Session) -> Result<()>,
) -> ExitCode {
    std::panic::set_hook(Box::new(move |panic| {
        let place = panic.location().map_or(String::new(), |at| format!(" at {}:{}", at.file(), at.line()));
        complain(program, &format!("internal error{place}; please report it with the command that led to it"));
        remove_pending_now();
        std::process::exit(PANICKED);
    }));
    memory::complain_as(program);
    signals::tidy_up_first();
    register::keep();
    let command = help::arranged(program, &A::command());
    if let Some(text) = documents::asked_for(std::env::args_os().skip(1), &command) {
        let text = text.map_err(Error::Usage);
        return ended(program, text.and_then(|text| show(|| std::io::stdout().write_all(&text))));
    }
    for (option, text) in [("metadata_template", METADATA_TEMPLATE), ("describe_keys", &keys::tables())] {
        if asks_for(option, &command) {
            return ended(program, show(|| std::io::stdout().write_all(text.as_bytes())));
        }
    }
    let parsed = command.version(version(program)).try_get_matches().and_then(|matches| A::from_arg_matches(&matches));
    let arguments = match parsed {
        Ok(arguments) => arguments,
        Err(error) if !error.use_stderr() => return ended(program, show(|| error.print())),
        Err(error) => {
            complain(program, &usage::one_line(program, &error, &A::command()));
            return ExitCode::from(2);
        }
    };
    let general = general(&arguments);
    let session = Session { program, general };
    session.settle_threads();
    let done = Instructions::allowed().and_then(|_| body(&arguments, &session));
    register::doubts().iter().for_each(|doubt| session.warn(doubt));
    match done {
        Ok(()) | Err(Error::ClosedPipe) => ExitCode::SUCCESS,
        Err(error) => {
            complain(program, &advice::advised(&error, &A::command()));
            ExitCode::from(error.exit_status())
        }
    }
}

/// What `--version` says behind the name of a program: the project, its version, and the commit that the build was told in
/// `CYANOMETER_COMMIT`. To look for it in every build would cost a new one after each commit.
fn version(program: &str) -> &'static str {
    let project = if program == env!("CARGO_PKG_NAME") { "" } else { concat!("(", env!("CARGO_PKG_NAME"), ") ") };
    let commit = option_env!("CYANOMETER_COMMIT").filter(|commit| !commit.is_empty());
    let commit = commit.map_or(String::new(), |commit| format!(" ({commit})"));
    String::leak(format!("{project}{}{commit}", env!("CARGO_PKG_VERSION")))
}

/// Whether a text is wanted that an option prints, whatever else the program would need.
fn asks_for(id: &str, command: &Command) -> bool {
    let option = command.get_arguments().find(|argument| argument.get_id() == id);
    let long = option.and_then(|option| option.get_long()).map(|long| format!("--{long}"));
    long.is_some_and(|long| std::env::args_os().skip(1).take_while(|word| word != "--").any(|word| *word == *long))
}

/// Writes what was asked for instead of a frame, as help.
fn show(print: impl FnOnce() -> std::io::Result<()>) -> Result<()> {
    standard::open_stdout()?;
    print().and_then(|()| std::io::stdout().flush()).map_err(|e| Error::disk(STDOUT_NAME, "write", e))
}

/// The status after something that was shown; a closed pipe is no error.
fn ended(program: &str, shown: Result<()>) -> ExitCode {
    match shown {
        Ok(()) | Err(Error::ClosedPipe) => ExitCode::SUCCESS,
        Err(error) => {
            complain(program, &error.to_string());
            ExitCode::from(error.exit_status())
        }
    }
}

/// Writes one line to the standard error.
fn complain(program: &str, text: &str) {
    // In one piece, so that the lines of several programs do not mix. Where the standard error is closed there is nobody to tell.
    let line = format!("{program}: {}\n", one_line(text));
    drop(std::io::stderr().write_all(line.as_bytes()));
}

impl Session {
    /// Says something that the user should hear, unless `--quiet`.
    pub fn warn(&self, text: &str) {
        if !self.general.quiet {
            complain(self.program, &format!("warning: {text}"));
        }
    }

    /// Says something to those who asked with `--verbose`.
    pub fn note(&self, text: &str) {
        if self.general.verbose {
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

    /// Settles how many threads work: what was asked for; or one where frames come or go through a pipe, at whose other end
    /// another program has a processor of its own; or all; or one where the system starts no more.
    fn settle_threads(&self) {
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

    /// Does something for each of several inputs, of program `A`. Where one alone fails the others are done all the same, and
    /// each failure is told.
    ///
    /// # Errors
    ///
    /// That of a single input; [`Error::Data`] with the number of those that failed.
    pub fn each<A: CommandFactory, T>(&self, inputs: &[T], work: impl Fn(&T) -> Result<()>) -> Result<()> {
        if let [input] = inputs {
            return work(input);
        }
        let mut failed = 0;
        for input in inputs {
            match work(input) {
                Err(Error::ClosedPipe) => return Err(Error::ClosedPipe),
                Err(error) => {
                    failed += 1;
                    complain(self.program, &advice::advised(&error, &A::command()));
                }
                Ok(()) => {}
            }
        }
        let summary = |done: usize| format!("{done} of {} inputs", inputs.len());
        if failed > 0 {
            let others = if failed < inputs.len() { "; the others are done" } else { "" };
            return Err(Error::Data(format!("{} failed{others}", summary(failed))));
        }
        self.note(&format!("{} are done", summary(inputs.len())));
        Ok(())
    }

    /// Adds this program to a frame's history and says what it leaves out.
    pub fn sign(&self, header: &mut FrameHeader) {
        self.sign_among(header, &[]);
    }

    /// The same for a frame of one of several inputs: the history is that of this one alone.
    pub fn sign_among(&self, header: &mut FrameHeader, others: &[&Path]) {
        // A file's name may be no UTF-8; the history is.
        let words = std::env::args_os().skip(1).filter(|word| !others.contains(&Path::new(word)));
        let arguments = words.map(|word| word.to_string_lossy().into_owned());
        header.metadata.history.push(history_entry(self.program, arguments));
        for left_out in header.metadata.left_out.iter().filter(|entry| entry.program == self.program) {
            self.note(&format!("left out: {} ({})", left_out.what, left_out.why));
        }
    }

    /// Says what a reader noticed.
    pub fn report_reader(&self, reader: &FrameReader) {
        self.tell(&requests::of_reader(reader));
    }

    /// A progress bar over rows, on terminals only.
    pub fn progress(&self, rows: usize) -> ProgressBar {
        let shown = match self.general.progress {
            ProgressWhen::Always => true,
            ProgressWhen::Never => false,
            ProgressWhen::Auto => !self.general.quiet && std::io::stderr().is_terminal(),
        };
        let bar = ProgressBar::with_draw_target(Some(rows as u64), ProgressDrawTarget::hidden());
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
    pub fn drive<S: Stage>(&self, mut reader: FrameReader, stage: &S, output: &Output) -> Result<Counts> {
        self.report_reader(&reader);
        let layers = output.options().holds_layers()?;
        let masking = Masking::of(reader.header(), reader.has_mask(), stage.header(), layers);
        reader.keep_mask();
        let no_darks: Option<&mut DarkFrames<FrameReader>> = None;
        self.write(&masking.header(stage), output, |writer, progress| {
            masking.run(stage, &mut reader, no_darks, writer, progress)
        })
    }

    /// Corrects a frame from an open reader to a new output.
    ///
    /// # Errors
    ///
    /// Those of readers and writer.
    pub fn correct(&self, mut reader: FrameReader, correction: &mut OpenCorrection, output: &Output) -> Result<Counts> {
        self.report_reader(&reader);
        let layers = output.options().holds_layers()?;
        let OpenCorrection { stage, corrections, .. } = correction;
        let is_masked = reader.has_mask();
        if corrections.may_mark() {
            let made = if layers { with_mask(stage.header().clone()) } else { stage.header().clone() };
            reader.keep_mask();
            return self.write(&made, output, |writer, progress| {
                corrections.run(stage, &mut reader, [is_masked, layers], writer, progress)
            });
        }
        let masking = Masking::of(reader.header(), is_masked, stage.header(), layers);
        reader.keep_mask();
        self.write(&masking.header(stage), output, |writer, progress| {
            masking.run(stage, &mut reader, corrections.darks.as_mut(), writer, progress)
        })
    }

    /// Has `run` write a frame whose head is `made`, beside a progress bar.
    fn write(
        &self,
        made: &FrameHeader,
        output: &Output,
        run: impl FnOnce(&mut FrameWriter, &mut dyn FnMut(usize)) -> Result<Counts>,
    ) -> Result<Counts> {
        let mut writer = FrameWriter::create(&output.options(), made)?;
        let bar = self.progress(made.geometry.height);
        let counts = run(&mut writer, &mut |rows| bar.set_position(rows as u64))?;
        bar.finish_and_clear();
        self.finish(writer, counts)?;
        Ok(counts)
    }

    /// Ends an output, and says what was counted.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn finish(&self, writer: FrameWriter, counts: Counts) -> Result<()> {
        let did_not_fit = writer.finish(counts)?;
        if did_not_fit > 0 {
            self.warn(&format!("{did_not_fit} samples do not fit 16 bits; they are stored as 0 or 65535, NaN as 0"));
        }
        for warning in counts.warnings() {
            self.warn(&warning);
        }
        Ok(())
    }
}

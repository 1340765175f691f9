//! The frames that a run goes through: of files and of streams, one exposure of each or several, on one thread or on many.

use super::advice;
use super::session::Session;
use super::words::complain;
use crate::error::{Error, Result};
use crate::formats::places::is_numbered;
use crate::formats::sequence::Sequence;
use crate::requests::batch::{self, Job};
use crate::requests::options::{Following, Input, Makes, Output};
use clap::CommandFactory;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

/// A frame to work on.
pub struct Turn<'a> {
    /// What the program says and does besides.
    pub session: &'a Session,
    /// Where the frame comes from.
    pub input: &'a Input,
    /// Where what is made of it goes.
    pub output: &'a Output,
    /// Which of several exposures is meant; none where there is one.
    pub exposure: Option<u32>,
}

/// How several things are done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// Side by side.
    Any,
    /// One after another.
    Kept,
    /// One after another into a stream, in which nothing can follow what failed.
    Stream,
    /// One after another into what is made of all, or not at all.
    Whole,
}

impl Session {
    /// Does something for each of several inputs, of program `A`, side by side where threads are at hand and outputs allow it.
    /// Where one alone fails the others are done all the same, and each failure is told.
    ///
    /// # Errors
    ///
    /// That of a single input; [`Error::Data`] with the number of those that failed.
    pub fn each<A: CommandFactory, T: Sync>(
        &self,
        inputs: &[T],
        in_order: bool,
        work: impl Fn(&Self, &T) -> Result<()> + Sync,
    ) -> Result<()> {
        if let [input] = inputs {
            return work(self, input);
        }
        let order = if in_order { Order::Stream } else { Order::Any };
        self.all::<A>(inputs.len(), "inputs", order, |session, index| work(session, &inputs[index]))
    }

    /// Does something with each frame of all inputs, of program `A`.
    ///
    /// # Errors
    ///
    /// Those of [`batch::jobs`], of [`Sequence`] and of `work`; [`Error::Data`] with the number of inputs that failed.
    pub fn each_frame<A: CommandFactory>(
        &self,
        input: &Input,
        output: &Output,
        work: impl Fn(&Turn<'_>) -> Result<()> + Sync,
    ) -> Result<()> {
        self.each_exposure::<A>(input, output, None, work)
    }

    /// The same for each of some exposures of each frame.
    ///
    /// # Errors
    ///
    /// As [`Self::each_frame`].
    pub fn each_exposure<A: CommandFactory>(
        &self,
        input: &Input,
        output: &Output,
        exposures: Option<Range<u32>>,
        work: impl Fn(&Turn<'_>) -> Result<()> + Sync,
    ) -> Result<()> {
        let jobs = batch::jobs(&input.inputs, output.output.as_deref(), output.extension(), &[])?;
        batch::check_directories(&jobs)?;
        let session = self.among(&input.inputs);
        let drawn = exposures.clone().map_or(1, |range| range.len());
        if let Some(path) =
            output.output.as_deref().filter(|path| drawn > 1 && !output.is_stream() && !is_numbered(path))
        {
            let problem =
                format!("{}: {drawn} exposures would go there; name the output with {{frame}}", path.display());
            return Err(Error::Usage(problem));
        }
        // Frames of a stream, and those that go into one, have an order; so have those of a single file that holds several.
        let in_order = output.is_stream() || input.is_pipe();
        let order = match output.makes {
            Makes::Frames => Order::Stream,
            Makes::Reports => Order::Kept,
            Makes::One => Order::Whole,
        };
        if in_order || jobs.len() * drawn == 1 {
            let all = || exposures.clone().map_or_else(|| vec![None], |range| range.map(Some).collect());
            let one = |session: &Self, index: usize| {
                let job: &Job = &jobs[index];
                let inputs_left = (jobs.len() - index - 1) as u64;
                let output = Output { following: Following { inputs_left, ..Following::default() }, ..output.clone() };
                session.on(job.input.as_deref()).frames(job, input, &output, &all(), &work)
            };
            return if jobs.len() == 1 { one(&session, 0) } else { session.all::<A>(jobs.len(), "inputs", order, one) };
        }
        let one = |session: &Self, index: usize| {
            let job = &jobs[index / drawn];
            let exposure = exposures.clone().and_then(|mut range| range.nth(index % drawn));
            let files_left = if index.is_multiple_of(drawn) { drawn as u64 - 1 } else { 0 };
            let following = Following { files_left, ..Following::default() };
            let output = Output { index: (index % drawn) as u64, following, ..output.clone() };
            session.on(job.input.as_deref()).frames(job, input, &output, &[exposure], &work)
        };
        session.all::<A>(jobs.len() * drawn, "frames", Order::Any, one)
    }

    /// Does something with one thing after another, so many, until one fails.
    ///
    /// # Errors
    ///
    /// Those of `work`.
    pub fn one_by_one<T>(
        &self,
        count: u64,
        things: impl IntoIterator<Item = T>,
        work: impl Fn(&Self, T) -> Result<()>,
    ) -> Result<()> {
        let bar = self.progress(usize::try_from(count).unwrap_or(usize::MAX));
        let quiet = self.without_progress();
        for thing in things {
            work(&quiet, thing)?;
            self.warn_of_doubts();
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// Works on all frames of an input, each exposed several times.
    fn frames(
        &self,
        job: &Job,
        input: &Input,
        output: &Output,
        exposures: &[Option<u32>],
        work: &impl Fn(&Turn<'_>) -> Result<()>,
    ) -> Result<()> {
        let path: Option<&Path> = job.input.as_deref();
        let sequence = if exposures.len() > 1 { Sequence::of_repeatable(path)? } else { Sequence::of(path) };
        let sequence = if input.inputs.len() > 1 { sequence.among_others() } else { sequence };
        let sequence = if output.is_stream() { sequence } else { sequence.settled() };
        let input = input.only(path, Some(sequence.clone()));
        let exposed = exposures.len() as u64;
        let mut output = Output { output: job.frame.clone(), ..output.clone() };
        output.following = Following { sequence: Some(sequence.clone()), exposures: exposed, ..output.following };
        loop {
            for (round, exposure) in (0..).zip(exposures) {
                if round > 0 {
                    sequence.again();
                }
                output.following.exposures_left = exposed - round - 1;
                if exposed > 1 {
                    output.following.files_left = if round == 0 { exposed - 1 } else { 0 };
                }
                work(&Turn { session: self, input: &input, output: &output, exposure: *exposure })?;
                self.warn_of_doubts();
                output.index += 1;
            }
            if !sequence.has_more()? {
                return Ok(());
            }
        }
    }

    /// Does so many things; what fails is told, and the rest is done where it can be.
    fn all<A: CommandFactory>(
        &self,
        count: usize,
        what: &str,
        order: Order,
        work: impl Fn(&Self, usize) -> Result<()> + Sync,
    ) -> Result<()> {
        let (next, failed, is_closed) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
        let bar = self.progress(count);
        let quiet = self.without_progress();
        let some = |stop_at_failure: bool| {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= count || is_closed.load(Ordering::Relaxed) {
                    return;
                }
                match work(&quiet, index) {
                    Err(Error::ClosedPipe) => is_closed.store(true, Ordering::Relaxed),
                    Err(error) => {
                        failed.fetch_add(1, Ordering::Relaxed);
                        if !matches!(error, Error::Upstream) {
                            bar.suspend(|| complain(self.program, &advice::advised(&error, &A::command())));
                        }
                        if stop_at_failure {
                            return;
                        }
                    }
                    Ok(()) => {}
                }
                bar.inc(1);
            }
        };
        let threads = if order != Order::Any { 1 } else { Self::threads().min(count) };
        if threads > 1 {
            thread::scope(|scope| {
                for _ in 0..threads {
                    let alone = || {
                        // One frame a thread: what works on it finds no other.
                        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
                        some(false);
                        drop(pool);
                    };
                    // Where the system starts no more threads, fewer do the work.
                    drop(thread::Builder::new().spawn_scoped(scope, alone));
                }
            });
        }
        // What is left where no thread could be started, or all.
        some(matches!(order, Order::Stream | Order::Whole));
        bar.finish_and_clear();
        let (failed, tried) = (failed.into_inner(), next.into_inner().min(count));
        if is_closed.into_inner() {
            return Err(Error::ClosedPipe);
        }
        if failed > 0 {
            let rest = match (order, failed < count) {
                (Order::Whole, _) => "; nothing is made of the others",
                (Order::Stream, _) if tried < count => "; the stream ends there",
                (_, true) => "; the others are done",
                (_, false) => "",
            };
            return Err(Error::Data(format!("{failed} of {count} {what} failed{rest}")));
        }
        self.note(&format!("{count} of {count} {what} are done"));
        Ok(())
    }
}

//! Where the rows go that work makes: into a sink at once, or to a thread that writes them behind the work.

use super::bands::{UNDER_WAY, ended, no_more_threads};
use super::stage::RowSink;
use crate::error::{Error, Result};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;

/// Samples on their way to the sink: a buffer, and how many of it count.
type Made = (Vec<f32>, usize);

/// Takes rows, top to bottom, and hands them to a sink.
pub struct Outlet<'a>(Way<'a>);

enum Way<'a> {
    /// The sink itself, and a buffer to make rows in.
    AtOnce(&'a mut dyn RowSink, Vec<f32>),
    /// A thread that writes, and the buffers that it gives back.
    Behind(SyncSender<Made>, Receiver<Vec<f32>>),
}

impl Outlet<'_> {
    /// Has `make` fill so many samples, whole rows, and hands them on; it finds them as others left them.
    ///
    /// # Errors
    ///
    /// Those of the sink; any where its thread has ended, whose own is the one to tell.
    pub fn make<T>(&mut self, samples: usize, make: impl FnOnce(&mut [f32]) -> T) -> Result<T> {
        let in_buffer = |buffer: &mut Vec<f32>| {
            if buffer.len() < samples {
                buffer.resize(samples, 0.0);
            }
            make(&mut buffer[..samples])
        };
        match &mut self.0 {
            Way::AtOnce(sink, buffer) => {
                let made = in_buffer(buffer);
                sink.write(&buffer[..samples])?;
                Ok(made)
            }
            Way::Behind(hand_on, spare) => {
                let mut buffer = spare.recv().map_err(|_| Error::ClosedPipe)?;
                let made = in_buffer(&mut buffer);
                hand_on.send((buffer, samples)).map_err(|_| Error::ClosedPipe)?;
                Ok(made)
            }
        }
    }
}

impl RowSink for Outlet<'_> {
    fn write(&mut self, samples: &[f32]) -> Result<()> {
        match &mut self.0 {
            Way::AtOnce(sink, _) => sink.write(samples),
            Way::Behind(..) => self.make(samples.len(), |copy| copy.copy_from_slice(samples)),
        }
    }
}

/// Gives `work` an outlet to a sink; with `is_behind`, the sink writes on a thread of its own.
///
/// # Errors
///
/// Those of the sink, and those of `work`, whichever came first.
pub(super) fn with_outlet<T>(
    sink: &mut dyn RowSink,
    is_behind: bool,
    work: impl FnOnce(&mut Outlet<'_>) -> Result<T>,
) -> Result<T> {
    if !is_behind {
        return work(&mut Outlet(Way::AtOnce(sink, Vec::new())));
    }
    thread::scope(|scope| {
        let (hand_on, made) = sync_channel(1);
        let (give_back, spare) = channel();
        for _ in 0..UNDER_WAY {
            // The receiver is at hand.
            drop(give_back.send(Vec::new()));
        }
        let writer = thread::Builder::new().spawn_scoped(scope, move || write_behind(sink, &made, &give_back));
        let writer = writer.map_err(|_| no_more_threads())?;
        let worked = work(&mut Outlet(Way::Behind(hand_on, spare)));
        // What the writer met belongs to an earlier band than what the work met.
        ended(writer).and(worked)
    })
}

/// Writes what comes until no more does, and gives the buffers back.
fn write_behind(sink: &mut dyn RowSink, made: &Receiver<Made>, give_back: &Sender<Vec<f32>>) -> Result<()> {
    for (buffer, samples) in made {
        sink.write(&buffer[..samples])?;
        drop(give_back.send(buffer));
    }
    Ok(())
}

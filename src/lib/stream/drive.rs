//! Drives a frame through a stage: bands that move between a few buffers, on one thread or on several.

use super::counts::Counts;
use super::stage::{RowSink, RowSource, Stage};
use crate::error::Result;
use crate::frame::{Rows, Window};
use rayon::prelude::*;
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::thread::{self, ScopedJoinHandle};

/// Bands of each side that are under way at a time where reading, computing and writing overlap: one that is read or
/// written while the other is computed on.
const UNDER_WAY: usize = 2;

/// Drives a whole frame through a stage, band by band; memory is a few bands whatever the height.
///
/// On one thread, bands are read, computed and written in turn. On several, bands are cut into as many pieces as there
/// are threads, and the next band is read and the last one written meanwhile. `progress` hears of the rows done so far.
///
/// # Errors
///
/// Those of the source and the sink, whichever meets the first band that goes wrong.
///
/// # Examples
///
/// ```
/// use cyanometer::stages::mosaic::Mosaic;
/// use cyanometer::stream::{MemoryFrame, Stage, run};
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Adu);
/// # let geometry = Geometry::new(4, 100, &["R", "G", "B"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// // Any reader of frames is a source, any writer a sink; so is a frame in memory.
/// let mut source = MemoryFrame::new(header.clone(), vec![7.0; 4 * 3 * 100]);
/// let stage = Mosaic::new(&header, None)?;
/// let mut sink = MemoryFrame::new(stage.header().clone(), Vec::new());
/// let mut rows_done = 0;
/// run(&stage, &mut source, &mut sink, &mut |rows| rows_done = rows)?;
/// assert_eq!(rows_done, 100);
/// assert_eq!(sink.samples, vec![7.0; 4 * 100]);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub fn run<S: Stage>(
    stage: &S,
    source: &mut dyn RowSource,
    sink: &mut dyn RowSink,
    progress: &mut dyn FnMut(usize),
) -> Result<Counts> {
    let threads = rayon::current_num_threads();
    let bands = Bands::new(stage, source, threads);
    if threads > 1 && bands.are_several() {
        overlapped(stage, bands, sink, progress, threads)
    } else {
        in_turn(stage, bands, sink, progress, threads)
    }
}

/// The bands of a frame, top to bottom.
struct Bands<'a> {
    source: &'a mut dyn RowSource,
    height: usize,
    reach: usize,
    step: usize,
    band_rows: usize,
    row_samples: usize,
    /// The first row of the next band.
    first: usize,
    /// Rows read so far.
    read: usize,
    /// The last of them, which the next band sees too, and the first of these.
    kept: Vec<f32>,
    kept_from: usize,
}

/// Rows to make, and those of the input that they depend on.
struct Band {
    first: usize,
    end: usize,
    window_first: usize,
    window: Vec<f32>,
}

impl<'a> Bands<'a> {
    fn new<S: Stage>(stage: &S, source: &'a mut dyn RowSource, threads: usize) -> Self {
        let input = &source.header().geometry;
        let output = &stage.header().geometry;
        let step = output.step_rows(input.step_rows(source.natural_rows()));
        Self {
            height: input.height,
            reach: stage.reach(),
            step,
            band_rows: input.band_rows(step, threads).min(output.band_rows(step, threads)),
            row_samples: input.row_samples(),
            first: 0,
            read: 0,
            kept: Vec::new(),
            kept_from: 0,
            source,
        }
    }

    fn are_several(&self) -> bool {
        self.band_rows < self.height
    }

    /// Reads what the next band needs; none after the last. `spare` is a buffer that has served.
    fn next(&mut self, mut spare: Vec<f32>) -> Result<Option<Band>> {
        let (first, window_first) = (self.first, self.kept_from);
        if first == self.height {
            return Ok(None);
        }
        let end = (first + self.band_rows).min(self.height);
        let needed = (end + self.reach).min(self.height);
        spare.clear();
        let mut window = std::mem::replace(&mut self.kept, spare);
        if needed > self.read {
            // What a source decodes together is asked for together, the halo included.
            let wanted = (needed - self.read).next_multiple_of(self.step).min(self.height - self.read);
            self.source.read(wanted, &mut window)?;
            self.read += wanted;
        }
        self.kept_from = end.saturating_sub(self.reach).max(window_first);
        self.kept.extend_from_slice(&window[(self.kept_from - window_first) * self.row_samples..]);
        self.first = end;
        Ok(Some(Band { first, end, window_first, window }))
    }
}

/// Makes a band in `made`, which grows to the size that it needs, and gives what was counted and how many samples it is.
fn make<S: Stage>(stage: &S, band: &Band, input: &Shape, made: &mut Vec<f32>, threads: usize) -> (Counts, usize) {
    let output = &stage.header().geometry;
    let rows = band.end - band.first;
    let samples = rows * output.row_samples();
    if made.len() < samples {
        made.resize(samples, 0.0);
    }
    let apply = |first: usize, samples: &mut [f32]| {
        let window = Window::new(input.height, band.window_first, input.width, input.channels, &band.window);
        stage.apply(window, Rows::new(first, output.width, output.channels.len(), samples))
    };
    let made = &mut made[..samples];
    if threads == 1 {
        return (apply(band.first, made), samples);
    }
    let piece_rows = rows.div_ceil(threads);
    let pieces = made.par_chunks_mut(piece_rows * output.row_samples()).enumerate();
    let counts = pieces.map(|(piece, samples)| apply(band.first + piece * piece_rows, samples));
    (counts.reduce(Counts::default, Counts::plus), samples)
}

/// What a window on the input has to know.
struct Shape {
    height: usize,
    width: usize,
    channels: usize,
}

impl Shape {
    fn of(source: &dyn RowSource) -> Self {
        let geometry = &source.header().geometry;
        Self { height: geometry.height, width: geometry.width, channels: geometry.channels.len() }
    }
}

fn in_turn<S: Stage>(
    stage: &S,
    mut bands: Bands<'_>,
    sink: &mut dyn RowSink,
    progress: &mut dyn FnMut(usize),
    threads: usize,
) -> Result<Counts> {
    let input = Shape::of(bands.source);
    let (mut spare, mut made) = (Vec::new(), Vec::new());
    let mut counts = Counts::default();
    while let Some(band) = bands.next(spare)? {
        let (counted, samples) = make(stage, &band, &input, &mut made, threads);
        counts = counts.plus(counted);
        sink.write(&made[..samples])?;
        progress(band.end);
        spare = band.window;
    }
    Ok(counts)
}

/// Samples on their way to the sink: a buffer, and how many of it count.
type Made = (Vec<f32>, usize);

/// Reads ahead and writes behind, each on a thread of its own.
///
/// Where the source waits for another program, it is read in turn: a thread that waits could not be told to stop, and the
/// pipe reads ahead itself.
fn overlapped<S: Stage>(
    stage: &S,
    bands: Bands<'_>,
    sink: &mut dyn RowSink,
    progress: &mut dyn FnMut(usize),
    threads: usize,
) -> Result<Counts> {
    let input = Shape::of(bands.source);
    thread::scope(|scope| {
        let (to_sink, written) = sync_channel::<Made>(1);
        let (give_back, spare) = channel();
        for _ in 0..UNDER_WAY {
            // The receiver is at hand.
            drop(give_back.send(Vec::new()));
        }
        let writer = scope.spawn(move || write_behind(sink, &written, &give_back));
        let mut compute = |band: &Band, counts: &mut Counts| {
            // The writer has ended where no buffer comes back; its error is told in the end.
            let Ok(mut made) = spare.recv() else { return false };
            let (counted, samples) = make(stage, band, &input, &mut made, threads);
            *counts = counts.plus(counted);
            let is_taken = to_sink.send((made, samples)).is_ok();
            progress(band.end);
            is_taken
        };
        let mut counts = Counts::default();
        let read = if bands.source.may_wait() {
            read_in_turn(bands, |band| compute(band, &mut counts))
        } else {
            read_ahead(scope, bands, |band| compute(band, &mut counts))
        };
        drop(to_sink);
        // What the writer met belongs to an earlier band than what the reader met.
        ended(writer).and(read).map(|()| counts)
    })
}

/// Gives all bands to `compute` until it wants no more.
fn read_in_turn(mut bands: Bands<'_>, mut compute: impl FnMut(&Band) -> bool) -> Result<()> {
    let mut spare = Vec::new();
    while let Some(band) = bands.next(spare)? {
        if !compute(&band) {
            break;
        }
        spare = band.window;
    }
    Ok(())
}

/// As [`read_in_turn`], and reads the next bands meanwhile.
fn read_ahead<'scope, 'a: 'scope>(
    scope: &'scope thread::Scope<'scope, '_>,
    mut bands: Bands<'a>,
    mut compute: impl FnMut(&Band) -> bool,
) -> Result<()> {
    let (to_stage, read) = sync_channel::<Band>(1);
    let (give_back, spare) = channel::<Vec<f32>>();
    for _ in 0..UNDER_WAY {
        // The receiver is at hand.
        drop(give_back.send(Vec::new()));
    }
    let reader = scope.spawn(move || -> Result<()> {
        // Either channel is closed where the stage wants no more.
        while let Ok(spare) = spare.recv()
            && let Some(band) = bands.next(spare)?
            && to_stage.send(band).is_ok()
        {}
        Ok(())
    });
    for band in &read {
        if !compute(&band) {
            break;
        }
        drop(give_back.send(band.window));
    }
    drop((read, give_back));
    ended(reader)
}

/// Writes what comes until no more does, and gives the buffers back.
fn write_behind(sink: &mut dyn RowSink, made: &Receiver<Made>, give_back: &Sender<Vec<f32>>) -> Result<()> {
    for (buffer, samples) in made {
        sink.write(&buffer[..samples])?;
        drop(give_back.send(buffer));
    }
    Ok(())
}

/// What a thread ended with; a panic goes on here.
fn ended(thread: ScopedJoinHandle<'_, Result<()>>) -> Result<()> {
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::{FrameHeader, Metadata};
    use crate::units::{Any, QuantityKind};

    /// A frame whose samples are the numbers of their rows, some of which cannot be read.
    struct Numbered {
        header: FrameHeader,
        next: usize,
        fails_at: usize,
        may_wait: bool,
    }

    impl RowSource for Numbered {
        fn header(&self) -> &FrameHeader {
            &self.header
        }

        fn natural_rows(&self) -> usize {
            1
        }

        fn may_wait(&self) -> bool {
            self.may_wait
        }

        fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
            for row in self.next..self.next + rows {
                if row == self.fails_at {
                    return Err(self.header.refuse("the source fails"));
                }
                samples.resize(samples.len() + self.header.geometry.width, row as f32);
            }
            self.next += rows;
            Ok(())
        }
    }

    /// Takes rows up to one, and knows how many.
    struct Taking {
        header: FrameHeader,
        rows: usize,
        fails_at: usize,
    }

    impl RowSink for Taking {
        fn write(&mut self, samples: &[f32]) -> Result<()> {
            for row in samples.chunks_exact(self.header.geometry.width) {
                if self.rows == self.fails_at {
                    return Err(self.header.refuse("the sink fails"));
                }
                let height = self.header.geometry.height;
                let sum = self.rows.saturating_sub(1) + (self.rows + 1).min(height - 1);
                assert!(row.iter().all(|sample| *sample == sum as f32), "row {}", self.rows);
                self.rows += 1;
            }
            Ok(())
        }
    }

    /// The sum of the rows above and below, or of the edge itself.
    struct Neighbors(FrameHeader);

    impl Stage for Neighbors {
        type Input = Any;
        type Output = Any;

        fn header(&self) -> &FrameHeader {
            &self.0
        }

        fn reach(&self) -> usize {
            1
        }

        fn apply(&self, input: Window<'_>, mut output: Rows<'_>) -> Counts {
            for y in output.range() {
                let rows = [y.saturating_sub(1), (y + 1).min(self.0.geometry.height - 1)];
                let [above, below] = rows.map(|y| input.row(y.cast_signed(), 0));
                for ((sum, a), b) in output.row(y, 0).iter_mut().zip(above).zip(below) {
                    *sum = a + b;
                }
            }
            Counts { negative: output.range().len() as u64, ..Counts::default() }
        }
    }

    /// However a frame is driven, the same rows leave, and the error is that of the first band that goes wrong.
    #[test]
    fn threads_change_neither_rows_nor_errors() {
        let never = usize::MAX;
        // Bands of 4 rows, for one thread as for several.
        let geometry = Geometry::new(70_000, 83, &["Y"]);
        let header = FrameHeader { name: "rows".into(), geometry, metadata: Metadata::new(QuantityKind::Unspecified) };
        for (source_fails, sink_fails) in
            [(never, never), (40, never), (never, 24), (40, 16), (16, 40), (0, 0), (82, 82)]
        {
            let drive = |threads: usize, may_wait: bool| {
                let mut source = Numbered { header: header.clone(), next: 0, fails_at: source_fails, may_wait };
                let mut sink = Taking { header: header.clone(), rows: 0, fails_at: sink_fails };
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let done = pool.install(|| run(&Neighbors(header.clone()), &mut source, &mut sink, &mut |_| ()));
                (done.map_err(|error| error.to_string()), sink.rows)
            };
            let alone = drive(1, false);
            for (threads, may_wait) in [(1, true), (2, false), (2, true), (5, false)] {
                assert_eq!(drive(threads, may_wait), alone, "{source_fails} {sink_fails} {threads} {may_wait}");
            }
            if (source_fails, sink_fails) == (never, never) {
                assert_eq!(alone, (Ok(Counts { negative: 83, ..Counts::default() }), 83));
            } else {
                assert!(alone.0.unwrap_err().contains(if source_fails <= sink_fails { "source" } else { "sink" }));
            }
        }
    }
}

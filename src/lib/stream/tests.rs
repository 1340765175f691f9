//! However frames are cut into bands and whatever threads there are, the same rows pass and the same errors are told.

use super::{Counts, RowSink, RowSource, Stage, fold, fold_into, run};
use crate::error::Result;
use crate::frame::{Geometry, Rows, Window};
use crate::metadata::{FrameHeader, Metadata};
use crate::units::{Any, QuantityKind};

const NEVER: usize = usize::MAX;

/// A frame whose samples are the numbers of their rows, some of which cannot be read.
struct Numbered {
    header: FrameHeader,
    next: usize,
    natural_rows: usize,
    fails_at: usize,
    may_wait: bool,
}

impl RowSource for Numbered {
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn natural_rows(&self) -> usize {
        self.natural_rows
    }

    fn may_wait(&self) -> bool {
        self.may_wait
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        for row in self.next..self.next + rows {
            if row == self.fails_at {
                return Err(self.header.refuse("the source fails"));
            }
            samples.resize(samples.len() + self.header.geometry.row_samples(), row as f32);
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

fn header(name: &str, width: usize, height: usize, channels: &[&str]) -> FrameHeader {
    let geometry = Geometry::new(width, height, channels);
    FrameHeader { name: name.into(), geometry, metadata: Metadata::new(QuantityKind::Unspecified) }
}

/// On so many threads.
fn on<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// However a frame is driven, the same rows leave, and the error is that of the first band that goes wrong.
#[test]
fn threads_change_neither_rows_nor_errors() {
    // Bands of 4 rows, for one thread as for several.
    let header = header("rows", 70_000, 83, &["Y"]);
    for (source_fails, sink_fails) in [(NEVER, NEVER), (40, NEVER), (NEVER, 24), (40, 16), (16, 40), (0, 0), (82, 82)] {
        let drive = |threads: usize, may_wait: bool| {
            let mut source =
                Numbered { header: header.clone(), next: 0, natural_rows: 1, fails_at: source_fails, may_wait };
            let mut sink = Taking { header: header.clone(), rows: 0, fails_at: sink_fails };
            let done = on(threads, || run(&Neighbors(header.clone()), &mut source, &mut sink, &mut |_| ()));
            (done.map_err(|error| error.to_string()), sink.rows)
        };
        let alone = drive(1, false);
        for (threads, may_wait) in [(1, true), (2, false), (2, true), (5, false)] {
            assert_eq!(drive(threads, may_wait), alone, "{source_fails} {sink_fails} {threads} {may_wait}");
        }
        if (source_fails, sink_fails) == (NEVER, NEVER) {
            assert_eq!(alone, (Ok(Counts { negative: 83, ..Counts::default() }), 83));
        } else {
            assert!(alone.0.unwrap_err().contains(if source_fails <= sink_fails { "source" } else { "sink" }));
        }
    }
}

/// Frames of one height and unlike widths, planes and blocks; the one numbered `broken` fails at row `fails_at`.
fn frames(count: usize, height: usize, broken: usize, fails_at: usize, may_wait: bool) -> Vec<Numbered> {
    let shapes: [(usize, &[&str], usize); 3] = [(70_000, &["Y"], 1), (900, &["R", "G", "B"], 16), (1, &["Y"], 32)];
    let frame = |(index, (width, channels, natural_rows)): (usize, (usize, &[&str], usize))| Numbered {
        header: header(&format!("frame {index}"), width, height, channels),
        next: 0,
        natural_rows,
        fails_at: if index == broken { fails_at } else { NEVER },
        may_wait: may_wait && index == 1,
    };
    shapes.into_iter().enumerate().map(frame).take(count).collect()
}

/// What `fold` gives of some frames: rows in their order, or the error; each row is checked to be that of every frame.
fn folded(frames: &mut [Numbered], rows: usize) -> (Option<String>, usize) {
    let shapes: Vec<Geometry> = frames.iter().map(|frame| frame.header.geometry.clone()).collect();
    let mut seen = 0;
    let sources = frames.iter_mut().map(|frame| -> &mut dyn RowSource { frame });
    let done = fold(sources, rows, |band| {
        assert_eq!(band.rows().start, seen);
        for (source, shape) in shapes.iter().enumerate() {
            let window = band.window::<Any>(source);
            assert_eq!(
                [window.width(), window.channels(), window.frame_height()],
                [shape.width, shape.channels.len(), shape.height]
            );
            for (y, channel) in band.rows().flat_map(|y| (0..window.channels()).map(move |channel| (y, channel))) {
                assert!(window.row(y.cast_signed(), channel).iter().all(|sample| *sample == y as f32));
            }
        }
        seen = band.rows().end;
        Ok(())
    });
    (done.err().map(|error| error.to_string()), seen)
}

/// All rows come, once and in order, from one source or several, in bands of any size, on one thread or several.
#[test]
fn a_fold_gives_every_row_of_every_source() {
    for height in [1_usize, 2, 83] {
        for count in 1..=3 {
            for (threads, may_wait) in [(1, false), (2, false), (2, true), (5, false)] {
                for rows in [height, height.div_ceil(2)] {
                    let mut sources = frames(count, height, 0, NEVER, may_wait);
                    assert_eq!(on(threads, || folded(&mut sources, rows)), (None, rows), "{height} {count} {threads}");
                    assert!(sources.iter().all(|source| source.next == rows), "no row is read beyond the last");
                }
            }
        }
    }
}

/// The error of a source at any row is told, after the bands before it.
#[test]
fn a_fold_tells_which_source_failed() {
    for (broken, fails_at) in [(0, 0), (0, 40), (1, 40), (2, 0), (2, 82)] {
        for (threads, may_wait) in [(1, false), (2, false), (2, true), (5, false)] {
            let mut sources = frames(3, 83, broken, fails_at, may_wait);
            let (error, seen) = on(threads, || folded(&mut sources, 83));
            assert_eq!(error, Some(format!("frame {broken}: the source fails")), "{fails_at} {threads} {may_wait}");
            assert!(seen <= fails_at && seen + 32 > fails_at.min(82), "{seen} {fails_at}");
        }
    }
}

/// Rows that a fold makes reach the sink, made in place or handed over; what fails first is told.
#[test]
fn a_fold_writes_what_it_makes() {
    for (work_fails, sink_fails) in [(NEVER, NEVER), (40, 16), (16, 40), (NEVER, 0)] {
        let fold_on = |threads: usize, in_place: bool| {
            let mut sources = frames(2, 83, 0, NEVER, false);
            let mut sink = Taking { header: header("sums", 10, 83, &["Y"]), rows: 0, fails_at: sink_fails };
            let sources = sources.iter_mut().map(|frame| -> &mut dyn RowSource { frame });
            let done = on(threads, || {
                fold_into(sources, 83, &mut sink, |band, outlet| {
                    if band.rows().contains(&work_fails) {
                        return Err(crate::error::Error::Data("the work fails".into()));
                    }
                    let sums = band.rows().flat_map(|y| [(y.saturating_sub(1) + (y + 1).min(82)) as f32; 10]);
                    let sums: Vec<f32> = sums.collect();
                    if in_place {
                        outlet.make(sums.len(), |made| made.copy_from_slice(&sums))
                    } else {
                        outlet.write(&sums)
                    }
                })
            });
            (done.map_err(|error| error.to_string()), sink.rows)
        };
        let alone = fold_on(1, true);
        for (threads, in_place) in [(1, false), (2, true), (2, false), (5, true)] {
            assert_eq!(fold_on(threads, in_place), alone, "{work_fails} {sink_fails} {threads} {in_place}");
        }
        match (work_fails, sink_fails) {
            (NEVER, NEVER) => assert_eq!(alone, (Ok(()), 83)),
            (work, sink) => {
                let told = if work < sink { "the work fails" } else { "sums: the sink fails" };
                assert_eq!(alone.0.unwrap_err(), told);
            }
        }
    }
}

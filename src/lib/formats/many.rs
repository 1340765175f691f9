//! Frames that are read in step, however many there are: those that the system does not let be open together are opened for
//! each band anew.

use super::format::SampleType;
use super::input::{FrameReader, InputOptions};
use crate::error::Result;
use crate::metadata::FrameHeader;
use crate::stages::saturation::with_mask;
use crate::stream::RowSource;
use nix::sys::resource::{Resource, getrlimit, setrlimit};

/// Files besides those frames that a program may have open.
const OTHERS: u64 = 48;

/// A frame among many.
pub struct OneOfMany {
    header: FrameHeader,
    natural_rows: usize,
    may_wait: bool,
    notes: Vec<String>,
    stored_as: Option<SampleType>,
    /// None while the file is closed.
    reader: Option<FrameReader>,
    options: InputOptions,
    rows_read: usize,
    stays_open: bool,
    has_mask: bool,
    keeps_mask: bool,
}

/// How many files may be open besides [`OTHERS`], once the limit is raised as far as it goes.
fn allowed(wanted: u64) -> u64 {
    let Ok((soft, hard)) = getrlimit(Resource::RLIMIT_NOFILE) else { return 128 };
    let raised = (wanted + OTHERS).min(hard).max(soft);
    let is_raised = raised > soft && setrlimit(Resource::RLIMIT_NOFILE, raised, hard).is_ok();
    (if is_raised { raised } else { soft }).saturating_sub(OTHERS)
}

impl OneOfMany {
    /// Opens frames, the standard input among them at most once; `already` are opened besides.
    ///
    /// # Errors
    ///
    /// Those of [`FrameReader::open`].
    pub fn open_all(all: Vec<InputOptions>, already: usize) -> Result<Vec<Self>> {
        let room = allowed((all.len() + already) as u64).saturating_sub(already as u64);
        let open = |(index, options): (usize, InputOptions)| {
            let reader = FrameReader::open(&options)?;
            let is_stream = options.path.as_deref().is_none_or(|path| path.as_os_str() == "-") || reader.may_wait();
            let stays_open = is_stream || (index as u64) < room;
            Ok(Self {
                header: reader.header().clone(),
                has_mask: reader.has_mask(),
                keeps_mask: false,
                natural_rows: reader.natural_rows(),
                may_wait: reader.may_wait(),
                notes: reader.notes().to_vec(),
                stored_as: reader.sample_type(),
                reader: stays_open.then_some(reader),
                options,
                rows_read: 0,
                stays_open,
            })
        };
        all.into_iter().enumerate().map(open).collect()
    }

    /// Its head, to which what a user says of it may be added.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// Gives the layer of marks as the last channel from now on, where there is one.
    pub fn keep_mask(&mut self) {
        if self.has_mask && !self.keeps_mask {
            self.keeps_mask = true;
            self.header = with_mask(self.header.clone());
            if let Some(reader) = &mut self.reader {
                reader.keep_mask();
            }
        }
    }

    /// The type of its stored samples; none where channels differ in it.
    pub fn stored_as(&self) -> Option<SampleType> {
        self.stored_as
    }

    /// What a careful user should know of it.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

impl RowSource for OneOfMany {
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
        let mut reader = match self.reader.take() {
            Some(reader) => reader,
            None => {
                let mut reader = FrameReader::open(&self.options)?;
                if self.keeps_mask {
                    reader.keep_mask();
                }
                let mut passed = Vec::new();
                let step = self.natural_rows.max(1);
                let mut left = self.rows_read;
                while left > 0 {
                    passed.clear();
                    reader.read(step.min(left), &mut passed)?;
                    left -= step.min(left);
                }
                reader
            }
        };
        reader.read(rows, samples)?;
        self.rows_read += rows;
        let is_done = self.rows_read >= self.header.geometry.height;
        self.reader = (self.stays_open && !is_done).then_some(reader);
        Ok(())
    }
}

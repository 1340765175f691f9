//! Rows of a maker's raw file, as the child gives them.

use super::Worker;
use super::describe::{Described, describe};
use super::worker::Running;
use crate::error::Result;
use crate::formats::dng::{RawArea, Rectangle};
use crate::formats::format::{SampleReader, SampleType};
use crate::frame::Geometry;
use crate::metadata::Metadata;
use std::fs::File;

/// Reads rows of the raw image of a maker's raw file, decoded by a child: one plane behind a filter array, or of a monochrome
/// sensor. The child holds the image; here is one row of it.
#[derive(Debug)]
pub struct MakersReader {
    /// None once the last row has come.
    running: Option<Running>,
    stored_width: usize,
    stored_height: usize,
    area: Rectangle,
    geometry: Geometry,
    own_tags: Metadata,
    notes: Vec<String>,
    /// The stored row that comes next.
    next_row: usize,
    /// One stored row.
    stored: Vec<u8>,
}

impl MakersReader {
    /// Opens a part of a file that can seek, of which messages have the name and what it is.
    ///
    /// # Errors
    ///
    /// [`Error::Format`](crate::error::Error::Format) where it is not decoded, or holds what no sensor records;
    /// [`Error::Disk`](crate::error::Error::Disk).
    pub fn open(worker: Worker, file: File, name: &str, kind: &str, part: RawArea) -> Result<Self> {
        let (head, running) = worker.start(file, name, kind)?;
        let Described { area, metadata, notes } = describe(&head, name, part)?;
        let origin = [area.left, area.top].map(|place| i32::try_from(place).unwrap_or(i32::MAX));
        Ok(Self {
            running: Some(running),
            stored_width: head.width,
            stored_height: head.height,
            area,
            geometry: Geometry { origin, ..Geometry::new(area.width, area.height, &["Y"]) },
            own_tags: metadata,
            notes,
            next_row: 0,
            stored: Vec::new(),
        })
    }

    /// Takes the next stored row.
    fn take_row(&mut self) -> Result<()> {
        self.stored.resize(self.stored_width * size_of::<u16>(), 0);
        if let Some(running) = &mut self.running {
            running.fill(&mut self.stored)?;
        }
        self.next_row += 1;
        Ok(())
    }

    /// Once the last row of the part is there: takes what lies below it, and sees that the child ends well.
    fn finish(&mut self) -> Result<()> {
        while self.next_row < self.stored_height {
            self.take_row()?;
        }
        self.running.take().map_or(Ok(()), |mut running| running.finish())
    }
}

impl SampleReader for MakersReader {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn tells_place(&self) -> bool {
        true
    }

    fn stored_as(&self) -> Option<SampleType> {
        Some(SampleType::U16)
    }

    fn natural_rows(&self) -> usize {
        1
    }

    fn embedded(&self) -> Option<&str> {
        None
    }

    fn own_tags(&self) -> &Metadata {
        &self.own_tags
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        for _ in 0..rows {
            while self.next_row < self.area.top {
                self.take_row()?;
            }
            self.take_row()?;
            let (words, _) = self.stored.as_chunks();
            let kept = &words[self.area.left..][..self.area.width];
            samples.extend(kept.iter().map(|word| f32::from(u16::from_le_bytes(*word))));
        }
        if self.next_row == self.area.top + self.area.height {
            self.finish()?;
        }
        Ok(())
    }
}

//! Statistics of several frames, one after another.

use super::{ReportFormat, finished, render, unwritable};
use crate::analysis::statistics::{Laws, Report};
use crate::error::{Error, Result};
use crate::formats::places::in_stream;
use crate::formats::{output, yaml_writer};
use crate::metadata::FrameHeader;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// What a report is about.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Subject {
    /// The file as the user named it, here or in the first program of the pipe, or the standard input.
    pub file: String,
    /// The number of the exposure, or, where the frame does not tell it, that in its stream.
    pub frame: u64,
}

impl Subject {
    /// A frame, which is the one of this number in its stream.
    pub fn of(frame: &FrameHeader, index: u64) -> Self {
        let exposure = frame.metadata.noise.as_ref().map(|noise| u64::from(noise.frame));
        let file = frame.metadata.file.clone().unwrap_or_else(|| in_stream(&frame.name).to_owned());
        Self { file, frame: exposure.unwrap_or(index) }
    }
}

/// A report among several.
#[derive(Serialize)]
struct Entry<'a> {
    #[serde(flatten)]
    subject: &'a Subject,
    #[serde(flatten)]
    report: &'a Report,
}

/// Writes the reports of frames as they come: that of a single frame as [`render`] does; of several a line each as JSON, rows under one
/// head as CSV, documents as YAML, each with file and frame.
#[derive(Debug)]
pub struct Reports {
    format: ReportFormat,
    are_several: bool,
    /// The first, until it is known whether it is the only one.
    first: Option<(Subject, Report)>,
    count: u64,
}

impl Reports {
    /// Reports to come, of which there `are_several` for certain or perhaps one.
    pub fn new(format: ReportFormat, are_several: bool) -> Self {
        Self { format, are_several, first: None, count: 0 }
    }

    /// Takes the next report, and gives what can be written now.
    ///
    /// # Errors
    ///
    /// Those of [`render`].
    pub fn add(&mut self, subject: Subject, report: Report) -> Result<String> {
        self.count += 1;
        if self.count == 1 && !self.are_several {
            self.first = Some((subject, report));
            return Ok(String::new());
        }
        let mut text = String::new();
        if let Some((subject, report)) = self.first.take() {
            text = self.entry(&subject, &report, true)?;
        }
        text += &self.entry(&subject, &report, self.count == 1)?;
        Ok(text)
    }

    /// What is left to write when no more come.
    ///
    /// # Errors
    ///
    /// Those of [`render`].
    pub fn end(self) -> Result<String> {
        self.first.map_or(Ok(String::new()), |(_, report)| render(&report, self.format))
    }

    fn entry(&self, subject: &Subject, report: &Report, is_first: bool) -> Result<String> {
        let entry = Entry { subject, report };
        Ok(match self.format {
            ReportFormat::Json => serde_json::to_string(&entry).map_err(unwritable)? + "\n",
            ReportFormat::Yaml => format!("---\n{}", yaml_writer::document("the report", &entry)?),
            ReportFormat::Text => {
                let Subject { file, frame } = subject;
                let gap = if is_first { "" } else { "\n" };
                format!("{gap}{file}, frame {frame}:\n{}", render(report, self.format)?)
            }
            ReportFormat::Csv => rows(subject, &render(report, self.format)?, is_first)?,
        })
    }
}

/// The rows of a table with two columns more; the head comes before the first.
fn rows(Subject { file, frame }: &Subject, table: &str, with_head: bool) -> Result<String> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(table.as_bytes());
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (index, row) in reader.records().enumerate() {
        let row = row.map_err(unwritable)?;
        let frame = frame.to_string();
        let more = if index == 0 { ["file", "frame"] } else { [file.as_str(), &frame] };
        if index > 0 || with_head {
            writer.write_record(row.iter().chain(more)).map_err(unwritable)?;
        }
    }
    finished(writer)
}

/// Reports of all frames of a run on their way out, and what the checks among them say.
pub struct Findings {
    output: Option<PathBuf>,
    are_several: bool,
    found: Mutex<Found>,
    laws: Mutex<Laws>,
}

#[derive(Debug)]
struct Found {
    reports: Reports,
    /// What goes to a file, which is written when it is whole.
    text: String,
    checked: usize,
    failed: Vec<(Subject, Error)>,
}

impl Findings {
    /// Reports to come, which go to a file or the standard output.
    pub fn new(format: ReportFormat, are_several: bool, output: Option<PathBuf>) -> Self {
        let reports = Reports::new(format, are_several);
        Self {
            output,
            are_several,
            laws: Mutex::default(),
            found: Mutex::new(Found { reports, text: String::new(), checked: 0, failed: Vec::new() }),
        }
    }

    /// Measures a frame with the laws of those before it.
    pub fn measure<T>(&self, measure: impl FnOnce(&mut Laws) -> T) -> T {
        measure(&mut self.laws.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes the report of a frame, and writes what can be.
    ///
    /// # Errors
    ///
    /// Those of [`Reports::add`] and of writing.
    pub fn add(&self, frame: &FrameHeader, index: u64, report: Report) -> Result<()> {
        let Found { reports, text, checked, failed } = &mut *self.found.lock().unwrap_or_else(PoisonError::into_inner);
        let subject = Subject::of(frame, index);
        if let Some(verdict) = report.check {
            *checked += 1;
            failed.extend(verdict.judge(&frame.name).err().map(|error| (subject.clone(), error)));
        }
        *text += &reports.add(subject, report)?;
        if output::is_stdout(self.output.as_deref()) && !text.is_empty() {
            output::write_text(None, &std::mem::take(text))?;
        }
        Ok(())
    }

    /// Writes what is left, as the work on all frames ended: of one stream that failed nothing gets a name, of several files those that
    /// are whole are told.
    ///
    /// # Errors
    ///
    /// That of the work; those of writing; [`Error::Data`] where a frame is not as predicted.
    pub fn end(self, work: Result<()>) -> Result<()> {
        if work.is_err() && !self.are_several && !output::is_stdout(self.output.as_deref()) {
            return work;
        }
        work.and(self.write())
    }

    fn write(self) -> Result<()> {
        let Found { reports, mut text, checked, failed } =
            self.found.into_inner().unwrap_or_else(PoisonError::into_inner);
        text += &reports.end()?;
        if !text.is_empty() {
            output::write_text(self.output.as_deref(), &text)?;
        }
        match (checked, failed.len(), failed.into_iter().next()) {
            (_, 0, _) | (_, _, None) => Ok(()),
            (1, _, Some((_, error))) => Err(error),
            (_, count, Some((first, error))) => {
                let Subject { frame, .. } = first;
                Err(Error::Data(format!(
                    "{count} of {checked} frames are not as predicted, the first of them frame {frame}: {error}"
                )))
            }
        }
    }
}

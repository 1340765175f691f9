//! Exposures: how the rows of a frame go through their noise, once, or several times where columns have something in common.

use super::session::Session;
use crate::error::Result;
use crate::formats::input::FrameReader;
use crate::formats::stored_rows::StoredRows;
use crate::propagation::{self, Equations};
use crate::requests::options::Output;
use crate::stages::noise::bloom::Spilling;
use crate::stages::noise::{AddNoise, ColumnLight, NoiseSettings};
use crate::stream::{Counts, RowSink, RowSource, Stage, run};

/// Rows that are in memory at a time on their way up.
const TOGETHER: usize = 64;

impl Session {
    /// Draws one exposure of a frame from an open reader to a new output. Where smear hangs on rows that come later, or charge spills
    /// along columns, the frame waits in a temporary file meanwhile.
    ///
    /// # Errors
    ///
    /// Those of [`AddNoise::new`] and [`AddNoise::check_columns`], of reader and writer, and of the temporary file.
    pub fn expose(
        &self,
        mut reader: FrameReader,
        settings: &NoiseSettings,
        exposure: Option<u32>,
        output: &Output,
    ) -> Result<()> {
        let mut stage = AddNoise::new(reader.header(), settings)?;
        stage.check_columns()?;
        let announce = |stage: &mut AddNoise| {
            propagation::note(stage.header_mut(), Equations::Exact);
            self.sign_exposure(stage.header_mut(), exposure);
            stage.warning().iter().for_each(|warning| self.warn(warning));
        };
        let light = stage.light_wanted();
        if light.is_none() && !stage.blooms() {
            announce(&mut stage);
            return self.drive(reader, &stage, output);
        }
        if reader.has_mask() {
            return Err(reader.header().refuse(
                "it has a layer of marks, which does not go with rows that wait for each other, as smear and blooming have them do",
            ));
        }
        self.report_reader(&reader);
        let head = reader.header().clone();
        let mut stored;
        let mut rows: &mut dyn RowSource = &mut reader;
        if let Some(mut light) = light {
            self.note("the frame waits in a temporary file until the light of its columns is known, for their smear");
            stored = store(rows, &mut light)?;
            rows = &mut stored;
            stage = stage.with_light(&light);
        }
        let counts = if stage.blooms() {
            self.note("charge waits in a temporary file until all of it has spilled along its columns");
            let (mut charges, before) = spill(&mut stage, rows)?;
            self.warn_of_bloomed(&stage);
            announce(&mut stage);
            self.drive_rows(&head, (&mut charges, before), &stage.reading(), output)?
        } else {
            announce(&mut stage);
            self.drive_rows(&head, (rows, Counts::default()), &stage, output)?
        };
        self.ended(reader, counts).map(drop)
    }

    fn warn_of_bloomed(&self, stage: &AddNoise) {
        let count = stage.header().metadata.bloomed_photosites.unwrap_or_default();
        if count > 0 {
            self.warn(&format!(
                "{count} photosites took up charge that spilled over from others of their columns: nothing is predicted of the \
                 frame, and no uncertainty told"
            ));
        }
    }
}

/// Keeps all rows, and adds up the light of their columns.
fn store(rows: &mut dyn RowSource, light: &mut ColumnLight) -> Result<StoredRows> {
    let header = rows.header().clone();
    let (geometry, row_samples) = (&header.geometry, header.geometry.row_samples());
    let mut stored = StoredRows::new(&header)?;
    let (mut samples, mut left) = (Vec::new(), geometry.height);
    while left > 0 {
        let count = geometry.step_rows(rows.natural_rows()).clamp(1, left);
        samples.clear();
        rows.read(count, &mut samples)?;
        samples.chunks_exact(row_samples).for_each(|row| light.add(row));
        stored.write(&samples)?;
        left -= count;
    }
    Ok(stored)
}

/// Collects all charge and lets it spill.
fn spill(stage: &mut AddNoise, rows: &mut dyn RowSource) -> Result<(StoredRows, Counts)> {
    let mut charges = StoredRows::new(stage.header_mut())?;
    let row_samples = charges.header().geometry.row_samples();
    let mut spilling = Spilling::new(stage.spill(row_samples), row_samples, &mut charges);
    let counts = run(&stage.collected(), rows, &mut spilling, &mut |_| ())?;
    let mut spill = spilling.spill;
    spill.turn();
    charges.change_from_the_last(TOGETHER, |row| spill.up(row))?;
    stage.header_mut().metadata.bloomed_photosites = Some(spill.bloomed());
    Ok((charges, Counts { full_well: spill.full(), ..counts }))
}

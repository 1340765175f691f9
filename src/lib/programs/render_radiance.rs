//! `render-radiance`: expected electrons from spectral radiance.

use crate::cli;
use crate::error::Result;
use crate::requests::{Scene, options};
use clap::Parser;
use std::process::ExitCode;

/// Render what a camera expects to collect of a spectral radiance: electrons per photosite and sensor class
///
/// Takes a spectrum (CSV: wavelength in nm, radiance), one of a library, or a spectral EXR (channels like S0.550,000000nm) whose
/// every pixel becomes a patch; a picture in R, G, B, for which smooth spectra are made up; or electrons given outright. Nothing
/// is random yet: add-noise comes next.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    scene: Scene,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.output.is_pipe());
    cli::start("render-radiance", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let mut scene = arguments.scene.open()?;
    let mut notes = std::mem::take(&mut scene.notes);
    session.sign(scene.header_mut());
    let made = scene.header().clone();
    session.write(&made, &arguments.output, |writer, progress| {
        let (counts, found) = scene.draw(writer, progress)?;
        notes.extend(found);
        Ok(counts)
    })?;
    session.tell(&notes);
    Ok(())
}

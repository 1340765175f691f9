//! `correct-frame`: codes without black, dark signal, the traces of charge transfer, and what photosites differ by.

use crate::cli;
use crate::error::Result;
use crate::propagation::{self, Equations};
use crate::requests::correction::Correction;
use crate::requests::{self, described::Described, options};
use clap::Parser;
use std::process::ExitCode;

/// Take black level, dark signal, charge transfer, uneven response and defects back from a frame of ADU
///
/// Works before demosaicking, in the order of the signal backwards: black level, or dark and bias frames; charge transfer;
/// flat field; defects. Values become signed and fractional, and nothing is clipped at zero. Saturated, defective and
/// interpolated samples are marked in the layer `mask`. What each step adds to the noise is in the predictions of later
/// programs.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: options::Input,
    #[command(flatten)]
    described: Described,
    #[command(flatten)]
    correction: Correction,
    #[command(flatten)]
    output: options::Output,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.between(&arguments.input, &arguments.output);
    cli::start("correct-frame", general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    arguments.correction.check(&arguments.input)?;
    session.each_frame::<Arguments>(&arguments.input, &arguments.output, |turn| correct(arguments, turn))
}

fn correct(arguments: &Arguments, turn: &cli::Turn<'_>) -> Result<()> {
    let cli::Turn { session, input, output, .. } = *turn;
    let mut reader = arguments.described.open(&input.options())?;
    session.tell(&arguments.correction.prepare(&mut reader)?);
    let mut correction = arguments.correction.open(reader.header_mut(), input, &arguments.described)?;
    arguments.correction.compare_masked(&mut reader)?;
    let header = correction.stage.header_mut();
    session.sign(header);
    propagation::note(header, Equations::Exact);
    session.tell(requests::of_levels(correction.header()).as_slice());
    session.tell(requests::of_listed_defects(correction.header()).as_slice());
    session.tell(&correction.notes);
    if session.correct(reader, &mut correction, output)? {
        session.tell(&correction.findings());
    }
    Ok(())
}

//! `color-difference`: how far images or colors differ to the eye.

use crate::cli;
use crate::error::{Error, Result};
use crate::formats::output::{self, FrameWriter, OutputOptions};
use crate::formats::places::{same_place, sidecar_path};
use crate::formats::register;
use crate::report::{self, ReportFormat};
use crate::requests::{self, ColorPair, Note, values};
use crate::stream::{Counts, RowSink};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare two images or colors by the CIE 1976, 1994 and 2000 formulas
///
/// Each of A and B is an image of XYZ, xyY or L*a*b* (EXR, TIFF, PNG or FITS, `-` for standard input), or a color: three numbers
/// between commas. Numbers are XYZ, or L*a*b* with --space lab. The name of a file that exists is a file. A is the
/// reference: the 1994 formula is not symmetric.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    pair: ColorPair,
    /// EXR file for the differences of each pixel, channels delta_e_76, jnd, delta_e_94, delta_e_2000
    #[arg(long, value_name = "FILE.exr", value_parser = values::exr_file())]
    map: Option<PathBuf>,
    /// Scale the map by a power of two so that viewers show it which show channels by name: 100, the difference of black and white, comes into (½, 1].
    /// Programs of this toolchain undo it to the bit
    #[arg(long, requires = "map")]
    viewable: bool,
    /// Form of the report; by default that of the ending of its file, or text
    #[arg(long, value_parser = values::choice::<ReportFormat>())]
    output_format: Option<ReportFormat>,
    /// File for the report; by default standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    general: cli::General,
}

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.pair.is_pipe());
    cli::start("color-difference", general, run)
}

fn run(Arguments { pair, map, viewable, output, output_format, .. }: &Arguments, session: &cli::Session) -> Result<()> {
    if map.is_some() && same_place(map.as_deref(), output.as_deref()) {
        return Err(Error::Usage("the map and the report have the same place; name a file for each".into()));
    }
    let sidecar = map.as_deref().map(sidecar_path);
    register::announce(&[output.as_deref(), map.as_deref(), sidecar.as_deref()])?;
    let (mut comparison, notes) = pair.open()?;
    session.tell(&notes);
    let mut writer = None;
    if let Some(map) = map {
        let mut header = comparison.map_header()?;
        session.sign(&mut header);
        let options = OutputOptions { path: Some(map.clone()), is_viewable: *viewable, ..Default::default() };
        writer = Some(FrameWriter::create(&options, &header)?);
    }
    let bar = session.progress(comparison.height());
    let sink = writer.as_mut().map(|writer| -> &mut dyn RowSink { writer });
    comparison.run(sink, &mut |rows| bar.set_position(rows as u64))?;
    bar.finish_and_clear();
    let report = comparison.report()?;
    if let Some(writer) = writer {
        writer.finish(Counts { not_finite: report.not_finite, ..Default::default() })?;
    }
    let form = report::form_of(*output_format, output.as_deref())?.unwrap_or(ReportFormat::Text);
    output::write_text(output.as_deref(), &report::difference(&report, form)?)?;
    session.tell(Note::not_finite(report.not_finite).as_slice());
    comparison.frames().for_each(|frame| session.tell(&requests::of_marks(frame)));
    Ok(())
}

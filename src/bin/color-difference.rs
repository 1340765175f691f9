//! `color-difference`: how far images or colors differ to the eye.

use clap::Parser;
use cyanometer::analysis::comparison::{Comparison, ComparisonSettings, Side};
use cyanometer::cli::{self, options, options::FrameOrColor};
use cyanometer::color::{Space, White};
use cyanometer::error::{Error, Result};
use cyanometer::formats::files::sidecar_path;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::output::{self, FrameWriter, OutputOptions};
use cyanometer::report::{self, ReportFormat};
use cyanometer::stream::{Counts, RowSink};
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare two images or colors by the CIE 1976, 1994 and 2000 formulas
///
/// Each of A and B is an image of XYZ, xyY or L*a*b* (EXR or TIFF, `-` for standard input), or a color: three numbers
/// between commas. Numbers are XYZ, or L*a*b* with --space lab. The name of a file that exists is a file. A is the
/// reference: the 1994 formula is not symmetric.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Reference: an image, or a color as X,Y,Z or L,a,b
    #[arg(value_parser = options::frame_or_color(), allow_hyphen_values = true)]
    a: FrameOrColor,
    /// What is compared with it: an image, or a color as X,Y,Z or L,a,b
    #[arg(value_parser = options::frame_or_color(), allow_hyphen_values = true)]
    b: FrameOrColor,
    /// What colors given as numbers are, and what images without metadata hold; by default xyz
    #[arg(long, value_parser = options::choice(&[("xyz", Space::Xyz), ("lab", Space::Lab)]))]
    space: Option<Space>,
    /// White of XYZ and xyY: d65, e, or its absolute X,Y,Z; by default that in the metadata of an image, or d65
    #[arg(long, value_name = "d65|e|X,Y,Z", value_parser = options::white, allow_hyphen_values = true)]
    white: Option<White>,
    /// Luminance of the white in cd/m2; by default that in the metadata of an image, or 100 for colors given as numbers
    #[arg(long, value_name = "CD_PER_M2", value_parser = options::positive, allow_negative_numbers = true)]
    white_luminance: Option<f64>,
    /// EXR file for the differences of each pixel, channels delta_e_76, jnd, delta_e_94, delta_e_2000
    #[arg(long, value_name = "FILE.exr", value_parser = options::exr_file())]
    map: Option<PathBuf>,
    /// Form of the report
    #[arg(long, default_value = "text", value_parser = options::choice(&[("text", ReportFormat::Text), ("json", ReportFormat::Json), ("yaml", ReportFormat::Yaml), ("csv", ReportFormat::Csv)]))]
    output_format: ReportFormat,
    /// File for the report; by default standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    general: options::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| {
        arguments.general.clone().in_pipeline([&arguments.a, &arguments.b].into_iter().any(FrameOrColor::is_pipe))
    };
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { a, b, map, output, white, white_luminance, .. } = arguments;
    if a.is_standard_input() && b.is_standard_input() {
        return Err(Error::Usage("only one of A and B can be the standard input; name a file for the other".into()));
    }
    if map.is_some() && output::same_place(map.as_deref(), output.as_deref()) {
        return Err(Error::Usage("the map and the report have the same place; name a file for each".into()));
    }
    let open = |given: &FrameOrColor| match given {
        FrameOrColor::Color(color) => Ok(Side::Color(*color)),
        FrameOrColor::Frame(path) => {
            FrameReader::open(&InputOptions { path: Some(path.clone()), ..Default::default() }).map(Side::Frame)
        }
    };
    let settings = ComparisonSettings { space: arguments.space, white: *white, white_luminance: *white_luminance };
    let mut comparison = Comparison::new(open(a)?, open(b)?, &settings)?;
    if comparison.white().is_none() && (white.is_some() || white_luminance.is_some()) {
        session.warn("both are L*a*b* already; --white and --white-luminance have no effect");
    }
    comparison.frames().for_each(|frame| session.report_reader(frame));
    let inputs: Vec<_> = comparison.frames().filter_map(FrameReader::file).collect();
    let read = [a, b].into_iter().filter_map(FrameOrColor::path);
    let sidecar = map.as_deref().map(sidecar_path);
    output::check_outputs(&[output.as_deref(), map.as_deref(), sidecar.as_deref()], &read.collect::<Vec<_>>())?;
    let mut writer = None;
    if let Some(map) = map {
        let mut header = comparison.map_header()?;
        session.sign(&mut header);
        let options = OutputOptions { path: Some(map.clone()), ..Default::default() };
        writer = Some(FrameWriter::create(&options, &header, &inputs)?);
    }
    let bar = session.progress(comparison.height());
    let sink = writer.as_mut().map(|writer| -> &mut dyn RowSink { writer });
    comparison.run(sink, &mut |rows| bar.set_position(rows as u64))?;
    bar.finish_and_clear();
    let report = comparison.report()?;
    if let Some(writer) = writer {
        writer.finish(Counts { not_finite: report.not_finite, ..Default::default() })?;
    }
    output::write_text(output.as_deref(), &report::difference(&report, arguments.output_format)?, None)?;
    for warning in comparison.frames_mut().filter_map(FrameReader::check_digest) {
        session.warn(&warning);
    }
    if report.not_finite > 0 {
        session.warn(&format!("{} pixels are NaN or infinite; they are left out of the statistics", report.not_finite));
    }
    Ok(())
}

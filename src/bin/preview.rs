//! `preview`: a PNG picture of any frame.

use clap::Parser;
use cyanometer::analysis::statistics::Region;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::picture::{PictureSettings, Range, write_png};
use cyanometer::formats::register::announce;
use cyanometer::requests::{self, described::DescribedInput, values};
use std::path::PathBuf;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Write a frame as a PNG picture to look at
///
/// Electrons and ADU are shown plane by plane, R as red and so on, from what no light reads to the most that the stage
/// holds; XYZ in its colors. For measurements use the frame itself: a picture has 8 bits.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    input: DescribedInput,
    /// PNG file to write; `-` for standard output
    #[arg(short, long, value_name = "FILE.png", value_parser = values::png_file())]
    output: PathBuf,
    /// Rectangle X,Y,W,H in pixels to show; by default the whole frame
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region)]
    region: Option<Region>,
    /// Show every pixel as a square of N x N
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=64))]
    zoom: usize,
    /// What is black and what is white: full, LOW,HIGH in the unit of the samples, or so many standard deviations about the mean of each plane, as in 4sigma
    #[arg(long, default_value = "full", value_name = "full|LOW,HIGH|Nsigma", value_parser = range)]
    range: Range,
    #[command(flatten)]
    general: cli::General,
}

fn range(text: &str) -> std::result::Result<Range, String> {
    let wrong = || "give full, LOW,HIGH, or a number of standard deviations such as 4sigma".to_owned();
    if text == "full" {
        return Ok(Range::Full);
    }
    if let Some(count) = text.strip_suffix("sigma") {
        return values::positive(count).map(Range::Deviations).map_err(|_| wrong());
    }
    let (low, high) = text.split_once(',').ok_or_else(wrong)?;
    Ok(Range::Values(values::number(low).map_err(|_| wrong())?, values::number(high).map_err(|_| wrong())?))
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.input.frame.is_pipe());
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    announce(&[Some(&arguments.output)])?;
    let mut reader = arguments.input.open()?;
    session.report_reader(&reader);
    let settings = PictureSettings { region: arguments.region, zoom: arguments.zoom, range: arguments.range };
    write_png(&mut reader, &settings, &arguments.output)?;
    session.tell(&requests::of_marks(&reader));
    Ok(())
}

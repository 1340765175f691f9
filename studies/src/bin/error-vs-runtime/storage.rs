//! Sample types and compressions of files.

use crate::Study;
use crate::bench::Work;
use crate::page::{Section, digits, time};
use crate::pareto::{self, Choice, Group};
use cyanometer::color::difference::delta_e_76;
use cyanometer::color::{D65_XY, lab_from_xyz, xyz_of_chromaticity};
use cyanometer::error::{Error, Result};
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::output::{CompressionKind, FrameWriter, OutputOptions, SampleKind};
use cyanometer::names::Named;
use cyanometer::plot::Plot;
use cyanometer::stages::demosaic::Method;
use cyanometer::stream::{Counts, MemoryFrame, RowSink, RowSource};
use cyanometer_studies::frames::{codes, colors, demosaicked, exposed, mosaicked};
use cyanometer_studies::pages::{Table, number};
use std::hint::black_box;
use std::path::{Path, PathBuf};

const EXR: [CompressionKind; 5] =
    [CompressionKind::None, CompressionKind::Rle, CompressionKind::Zips, CompressionKind::Zip, CompressionKind::Piz];
const TIFF: [CompressionKind; 3] = [CompressionKind::None, CompressionKind::Lzw, CompressionKind::Deflate];
/// Rows that are handed over together, as the programs do with a band.
const BAND: usize = 64;

/// A way to store a frame.
struct Way {
    group: usize,
    compression: CompressionKind,
    path: PathBuf,
    options: OutputOptions,
    /// Codes: largest error in ADU. XYZ: largest ΔE*ab.
    error: f64,
    /// Bits of a sample in the file.
    bits: f64,
    write: f64,
    read: f64,
}

const GROUPS: [&str; 4] = ["EXR, f32", "EXR, f16", "TIFF, f32", "TIFF, u16"];

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let size = if study.quick { [160, 120] } else { [640, 480] };
    let directory = tempfile::tempdir().map_err(|e| Error::disk("a temporary directory", "make", e))?;
    let plane = codes(&exposed(&mosaicked(&study.sky_with_gradient(size))?, study.seed(7), study.seed(7))?)?;
    let xyz = colors(&demosaicked(&plane, Method::EffectiveColor)?, &study.color)?;
    let of_codes = |stored: &MemoryFrame| {
        let difference = |(a, b): (&f32, &f32)| f64::from((a - b).abs());
        plane.samples.iter().zip(&stored.samples).map(difference).fold(0.0, f64::max)
    };
    let of_codes_ways = judge(study, &plane, 4, directory.path(), &of_codes)?;
    let of_xyz = |stored: &MemoryFrame| largest_delta_e(&xyz, stored);
    let of_xyz_ways = judge(study, &xyz, 3, directory.path(), &of_xyz)?;

    let groups = |ways: &[Way], of: &dyn Fn(&Way) -> f64| -> Vec<Group> {
        let group = |(index, name): (usize, &&str)| {
            let of_group = ways.iter().filter(|way| way.group == index);
            let point = |way: &Way| Choice::new(way.compression.name(), (way.write + way.read) * 1e9, of(way));
            Group::new(*name, of_group.map(point).collect())
        };
        GROUPS.iter().enumerate().map(group).filter(|group| !group.choices.is_empty()).collect()
    };
    let x = "CPU time to write and read a sample, ns";
    let mut plot = Plot::new(
        "Storage: size against time",
        pareto::panel(
            "codes of 12 bits, CFA plane",
            [x, "bits per sample"],
            &groups(&of_codes_ways, &|w| w.bits),
            1e-9,
        ),
    );
    plot.panels.push(pareto::panel("XYZ", [x, "bits per sample"], &groups(&of_xyz_ways, &|w| w.bits), 1e-9));
    let mut errors = Plot::new(
        "Storage: error against time (lossless at the foot)",
        pareto::panel(
            "codes of 12 bits, CFA plane",
            [x, "largest error, ADU"],
            &groups(&of_codes_ways, &|w| w.error),
            1e-2,
        ),
    );
    errors.panels.push(pareto::panel("XYZ", [x, "largest ΔE*ab"], &groups(&of_xyz_ways, &|w| w.error), 1e-4));

    let table = |ways: &[Way], unit: &str| {
        let mut table = Table::new(&[
            "samples",
            "compression",
            &format!("largest error, {unit}"),
            "bits per sample",
            "write, per sample",
            "read, per sample",
        ]);
        for way in ways {
            table.row(&[
                GROUPS[way.group].into(),
                way.compression.name().into(),
                if way.error == 0.0 { "none".into() } else { digits(way.error, 2) },
                number(way.bits, 1),
                time(way.write),
                time(way.read),
            ]);
        }
        table
    };
    let tables = vec![
        ("Codes of 12 bits, one plane:".to_owned(), table(&of_codes_ways, "ADU")),
        ("XYZ, three planes:".to_owned(), table(&of_xyz_ways, "ΔE\\*ab")),
    ];
    Ok(Section {
        title: "Sample type and compression of files".into(),
        method: format!(
            "A noisy sky with a gradient, {}×{}: codes behind the filter array, and XYZ after ECI, written to a file and read back \
             (`--sample-type`, `--compression`). Times are CPU time of one thread with the BLAKE3 digest that each named file gets, \
             both ways, and what the system does for the file, but no waiting for a disk. Bits are those of the whole file.",
            size[0], size[1]
        ),
        figures: vec![
            ("storage-size".into(), "Size against time, by sample type and compression".into(), plot),
            ("storage-error".into(), "Error against time, by sample type and compression".into(), errors),
        ],
        tables,
        advice: advice(&of_codes_ways, &of_xyz_ways),
    })
}

fn largest_delta_e(truth: &MemoryFrame, stored: &MemoryFrame) -> f64 {
    let width = truth.header.geometry.width;
    let white = truth.samples.iter().fold(0.0, |a: f64, b| a.max(f64::from(*b)));
    let white = xyz_of_chromaticity(D65_XY, white);
    let lab = |row: &[f32], x: usize| lab_from_xyz([0, 1, 2].map(|i| f64::from(row[i * width + x])), white);
    let rows = truth.samples.chunks_exact(3 * width).zip(stored.samples.chunks_exact(3 * width));
    rows.flat_map(|(a, b)| (0..width).map(move |x| delta_e_76(lab(a, x), lab(b, x)))).fold(0.0, f64::max)
}

fn write(frame: &MemoryFrame, options: &OutputOptions) -> Result<()> {
    let mut writer = FrameWriter::create(options, &frame.header)?;
    for band in frame.samples.chunks(BAND * frame.header.geometry.row_samples()) {
        writer.write(band)?;
    }
    writer.finish(Counts::default()).map(|_| ())
}

fn read(path: &Path) -> Result<MemoryFrame> {
    let mut reader = FrameReader::open(&InputOptions { path: Some(path.to_owned()), ..InputOptions::default() })?;
    let header = reader.header().clone();
    let mut samples = Vec::new();
    let (height, natural) = (header.geometry.height, reader.natural_rows());
    let step = BAND.next_multiple_of(natural.max(1));
    let mut first = 0;
    while first < height {
        let rows = step.min(height - first);
        reader.read(rows, &mut samples)?;
        first += rows;
    }
    Ok(MemoryFrame::new(header, samples))
}

/// Stores a frame in every way of the first groups.
fn judge(
    study: &Study,
    frame: &MemoryFrame,
    groups: usize,
    directory: &Path,
    error: &dyn Fn(&MemoryFrame) -> f64,
) -> Result<Vec<Way>> {
    let samples = frame.samples.len() as f64;
    let kinds =
        [(SampleKind::F32, "exr"), (SampleKind::F16, "exr"), (SampleKind::F32, "tiff"), (SampleKind::U16, "tiff")];
    let mut ways = Vec::new();
    for (group, (kind, end)) in kinds.into_iter().enumerate().take(groups) {
        for &compression in if end == "exr" { EXR.as_slice() } else { &TIFF } {
            let path = directory.join(format!("{groups}-{group}-{}.{end}", compression.name()));
            let options = OutputOptions {
                path: Some(path.clone()),
                compression: Some(compression),
                samples: Some(kind),
                ..OutputOptions::default()
            };
            write(frame, &options)?;
            let stored = read(&path)?;
            let bytes =
                std::fs::metadata(&path).map_err(|e| Error::disk(&path.display().to_string(), "read", e))?.len();
            ways.push(Way {
                group,
                compression,
                path,
                options,
                error: error(&stored),
                bits: 8.0 * bytes as f64 / samples,
                write: 0.0,
                read: 0.0,
            });
        }
    }
    let mut works: Vec<Work<'_>> = Vec::new();
    for way in &ways {
        works.push(Box::new(|| write(frame, &way.options)));
        works.push(Box::new(|| {
            black_box(read(&way.path)?);
            Ok(())
        }));
    }
    let times = study.bench.medians(&mut works)?;
    drop(works);
    for (way, times) in ways.iter_mut().zip(times.chunks_exact(2)) {
        (way.write, way.read) = (times[0] / samples, times[1] / samples);
    }
    Ok(ways)
}

fn advice(codes: &[Way], xyz: &[Way]) -> String {
    let name = |way: &Way| format!("{} with `{}`", GROUPS[way.group], way.compression.name());
    let cost = |way: &Way| way.write + way.read;
    let least = |ways: &[Way], of: &dyn Fn(&Way) -> f64| -> String {
        let best = ways.iter().filter(|way| way.error == 0.0).min_by(|a, b| of(a).total_cmp(&of(b)));
        best.map_or(String::new(), |way| {
            format!("{} ({} a sample, {} bits)", name(way), time(cost(way)), number(way.bits, 1))
        })
    };
    let three = |ways: &[Way]| {
        format!(
            "fastest is {}, smallest {}, and the least product of both has {}",
            least(ways, &cost),
            least(ways, &|way| way.bits),
            least(ways, &|way| way.bits * cost(way)),
        )
    };
    let half = |ways: &[Way]| ways.iter().find(|way| way.group == 1).map_or(f64::NAN, |way| way.error);
    format!(
        "Without loss, codes: {}. XYZ: {}. 16-bit floats cost up to {} ADU of codes and ΔE {} of colors: enough for pictures, \
         not for codes, which 16-bit integers hold exactly.",
        three(codes),
        three(xyz),
        digits(half(codes), 2),
        digits(half(xyz), 2),
    )
}

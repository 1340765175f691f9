//! The chain on arbitrary metadata: a small frame that says of itself what the text says, through every stage that takes it,
//! with uncertainty, statistics, predictions and pictures of what comes out.
#![no_main]

use cyanometer::analysis::statistics::{Saturated, measure, patches};
use cyanometer::color::{Space, White};
use cyanometer::formats::output::{FrameWriter, OutputOptions};
use cyanometer::formats::picture::{PictureSettings, Range, write_png};
use cyanometer::formats::yaml::parse_metadata;
use cyanometer::frame::Geometry;
use cyanometer::metadata::FrameHeader;
use cyanometer::propagation::{self, Equations};
use cyanometer::report::{self, ReportFormat};
use cyanometer::sigma::WithSigma;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{Counts, MemoryFrame, RowSink, Stage};
use cyanometer_fuzz::{mutation, settle};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use std::path::Path;

/// Stages in a row: the frames of every stage are seeds, so that two reach everything.
const DEPTH: usize = 2;

fuzz_target!(|bytes: &[u8]| {
    settle();
    // The first byte says which channels the frame has, where it lies and what its samples are; the rest is the text.
    let Some((first, text)) = bytes.split_first() else { return };
    let Ok(text) = std::str::from_utf8(text) else { return };
    let Ok(metadata) = parse_metadata("in", text) else { return };
    let channels: &[&str] =
        [&["R", "G", "B"][..], &["Y"], &["Y", "mask"], &["R", "G", "B", "sigma.R", "sigma.G", "sigma.B"]]
            [usize::from(first & 3)];
    let origin = [[0, 0], [1, -1], [7, 3], [i32::MAX - 20, i32::MIN]][usize::from(first >> 2 & 3)];
    let geometry = Geometry { origin, ..Geometry::new(10, 8, channels) };
    let scale = [1.0, 100.0, 3e4, 1e30][usize::from(first >> 4 & 3)];
    let samples = (0..80 * channels.len()).map(|i| (i * 7919 % 101) as f32 / 100.0 * scale).collect();
    follow(&MemoryFrame::new(FrameHeader { name: "in".into(), geometry, metadata }, samples), DEPTH);
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    // The first byte is no part of the document.
    let made = data.get(1..size).and_then(|text| std::str::from_utf8(text).ok()).filter(|_| seed % 8 != 0);
    match made.and_then(|text| mutation::changed(text, seed)) {
        Some(text) if text.len() < max_size => {
            data[0] = data[0].wrapping_add((seed % 5 / 4) as u8);
            data[1..=text.len()].copy_from_slice(text.as_bytes());
            text.len() + 1
        }
        _ => fuzzer_mutate(data, size, max_size),
    }
});

/// Looks at a frame in all ways, and has all stages that take it make theirs of it.
fn follow(frame: &MemoryFrame, depth: usize) {
    look_at(frame);
    if depth == 0 {
        return;
    }
    let head = &frame.header;
    if let Ok(mut stage) = AddNoise::new(head, &NoiseSettings { seed: 7, ..NoiseSettings::default() }) {
        propagation::note(stage.header_mut(), Equations::Exact);
        go_on(frame, &stage, depth);
    }
    if let Ok(mut stage) = Digitize::new(head, &AdcSettings::default()) {
        propagation::note(stage.header_mut(), Equations::Exact);
        go_on(frame, &stage, depth);
    }
    if let Ok(stage) = Mosaic::new(head, None) {
        go_on(frame, &stage, depth);
    }
    for black in [Black::Auto, Black::None] {
        if let Ok(stage) = CorrectFrame::new(head, &CorrectionSettings { black, cte: None }, None) {
            go_on(frame, &stage, 1);
        }
    }
    for method in Method::ALL {
        let Ok(stage) = Demosaic::new(head, method, Black::Auto, None) else { continue };
        go_on(frame, &stage, 1);
        if method != Method::default() {
            continue;
        }
        if let Ok(stage) = WithSigma::of_demosaicking(stage) {
            go_on(frame, &stage, 1);
        }
    }
    for space in [Space::Xyz, Space::Xyy, Space::Lab, Space::Srgb] {
        let settings = ColorSettings {
            is_relative: false,
            xyz_from_camera: [[0.9, 0.4, 0.3], [0.3, 0.9, 0.1], [0.05, -0.1, 1.4]],
            method: None,
            residual: None,
            space,
            white: White::D65,
            white_luminance: Some(100.0),
        };
        let Ok(stage) = ToXyz::new(head, &settings) else { continue };
        go_on(frame, &stage, 1);
        if let Ok(stage) = WithSigma::of_conversion(stage, head) {
            go_on(frame, &stage, 1);
        }
    }
}

fn go_on<S: Stage>(frame: &MemoryFrame, stage: &S, depth: usize) {
    if let Ok((made, _)) = frame.through(stage) {
        follow(&made, depth - 1);
    }
}

/// Statistics, predictions, a picture and a file of a frame.
fn look_at(frame: &MemoryFrame) {
    let again = || MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    for equations in [Equations::Exact, Equations::Paper] {
        drop(propagation::of_frame(&frame.header, equations));
    }
    if let Ok(report) = measure(&mut again(), &[], Saturated::LeftOut, Equations::Exact, Some(1e-4)) {
        drop(report::render(&report, ReportFormat::Text));
    }
    for size in [None, Some([5, 4])] {
        drop(patches::measure(&mut again(), size, Saturated::LeftOut, Equations::Exact));
    }
    for range in [Range::Full, Range::Deviations(2.0)] {
        let settings = PictureSettings { range: Some(range), ..PictureSettings::default() };
        drop(write_png(&mut again(), &settings, Path::new("/dev/null")));
    }
    let options = OutputOptions { path: Some("/dev/null".into()), ..OutputOptions::default() };
    if let Ok(mut writer) = FrameWriter::create(&options, &frame.header) {
        drop(writer.write(&frame.samples));
        drop(writer.finish(Counts::default()));
    }
}

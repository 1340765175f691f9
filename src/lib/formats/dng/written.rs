//! What is written is read again, to the bit, and its tags say what they should.

use super::tags::{self, DngTag};
use super::{DngReader, DngWriter, RawArea, check_frame};
use crate::camera::levels::{BlackLevel, WhiteLevel};
use crate::camera::optics::Exposure;
use crate::camera::sensor::tests::kaf5101ce;
use crate::color::D65_XY;
use crate::error::Result;
use crate::formats::format::SampleReader;
use crate::formats::tiff::{Directory, TiffCompression, TiffFile, TiffSamples};
use crate::formats::yaml;
use crate::frame::Geometry;
use crate::metadata::{
    AdcRecord, CorrectionRecord, DemosaicRecord, ExposuresRecord, FrameHeader, Metadata, NoiseRecord, PoissonKind,
    ProfileRecord,
};
use crate::propagation::{Equations, Photosite};
use crate::random::Source;
use crate::stages::noise::NoiseModel;
use crate::units::QuantityKind;
use std::fs::File;
use std::io::{Cursor, Write};

const XYZ_FROM_CAMERA: [[f64; 3]; 3] = [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]];

/// A frame that a simulation leaves.
fn frame(size: [usize; 2], origin: [i32; 2], cfa: &str) -> FrameHeader {
    let mut metadata = Metadata::new(QuantityKind::Adu);
    metadata.cfa = Some(cfa.parse().unwrap());
    metadata.black_level_adu = Some(1757.25.into());
    metadata.white_level_adu = Some(4095.0.into());
    let mut sensor = kaf5101ce();
    sensor.xyz_from_camera = Some(XYZ_FROM_CAMERA);
    metadata.sensor = Some(sensor);
    metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 5.6, lens_transmittance: 0.9 });
    let geometry = Geometry { origin, ..Geometry::new(size[0], size[1], &["Y"]) };
    FrameHeader { name: "in".into(), geometry, metadata }
}

fn codes(header: &FrameHeader) -> Vec<f32> {
    (0..header.geometry.width * header.geometry.height).map(|i| (i * i % 65_521) as f32).collect()
}

fn bytes(
    header: &FrameHeader,
    samples: &[f32],
    (kind, compression): (TiffSamples, TiffCompression),
    rows: usize,
) -> Result<Vec<u8>> {
    check_frame(header, "out.dng")?;
    let texts = [yaml::write_metadata(&header.metadata)?, "cyanometer".into()];
    let output = Cursor::new(Vec::new());
    let mut writer = DngWriter::create(output, "out.dng", header, kind, compression, texts)?;
    for rows in samples.chunks(rows * header.geometry.width) {
        writer.write_rows(rows)?;
    }
    Ok(writer.finish()?.into_inner())
}

const PLAIN: (TiffSamples, TiffCompression) = (TiffSamples::U16, TiffCompression::None);

fn stored(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file
}

/// Reads all samples, and checks that metadata and place are those of the frame.
fn read_back(header: &FrameHeader, bytes: &[u8]) -> (DngReader, Vec<f32>) {
    let mut reader = DngReader::open(stored(bytes), "out.dng", RawArea::Active).unwrap();
    assert_eq!(*reader.geometry(), header.geometry);
    let found = yaml::parse_metadata("out.dng", reader.embedded().unwrap()).unwrap();
    assert_eq!(found, header.metadata);
    let mut samples = Vec::new();
    reader.read(header.geometry.height, &mut samples).unwrap();
    (reader, samples)
}

fn same(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Black at each photosite, by metadata.
fn blacks(header: &FrameHeader, metadata: &Metadata) -> Vec<f64> {
    let header = FrameHeader { metadata: metadata.clone(), ..header.clone() };
    let levels = header.black_levels().unwrap().unwrap();
    let geometry = &header.geometry;
    (0..geometry.height).flat_map(|y| (0..geometry.width).map(|x| levels.row(y).at(x)).collect::<Vec<_>>()).collect()
}

#[test]
fn every_phase_comes_back_from_every_place() {
    let arrays = ["rggb", "bggr", "grbg", "gbrg", "monochrome", "4x4:RRGGRRGGGGBBGGBB", "2x2:CMYW"];
    for (index, cfa) in arrays.into_iter().enumerate() {
        for (origin, size) in
            [([0, 0], [8, 6]), ([1, 0], [5, 3]), ([0, 1], [1, 1]), ([3, 5], [301, 7]), ([152, 27], [2, 259])]
        {
            let mut header = frame(size, origin, cfa);
            if index % 2 == 1 {
                header.metadata.black_level_adu = Some(BlackLevel::Sites([64.5, 65.0, 66.125, 1757.25]));
                header.metadata.black_by_row = (0..400).map(|y| f64::from(y % 7) / 4.0 - 0.5).collect();
                header.metadata.black_by_column = (0..310).map(|x| f64::from(x % 5) / 8.0 - 0.25).collect();
            }
            let samples = codes(&header);
            let bytes = bytes(&header, &samples, PLAIN, 3).unwrap();
            let (reader, found) = read_back(&header, &bytes);
            assert!(same(&found, &samples), "{cfa} {origin:?} {size:?}");
            // The tags alone say the same, to readers of other programs.
            let told = reader.own_tags();
            assert_eq!((told.cfa, told.white_level_adu), (header.metadata.cfa, Some(4095.0.into())));
            assert_eq!(blacks(&header, told), blacks(&header, &header.metadata), "{cfa} {origin:?}");
            let exposure = told.exposure.unwrap();
            assert_eq!((exposure.exposure_s, exposure.f_number), (0.033, 5.6));
        }
    }
}

#[test]
fn floats_come_back_to_the_bit() {
    for compression in [TiffCompression::None, TiffCompression::Deflate] {
        let mut header = frame([6, 50], [1, 2], "gbrg");
        header.metadata.black_level_adu = Some(0.0.into());
        header.metadata.white_level_adu = Some(WhiteLevel::Classes([2337.75, 2338.5, 2330.0]));
        let mut samples: Vec<f32> = (0..300_i16).map(|i| f32::from(i) * 13.7 - 900.3).collect();
        samples[..4].copy_from_slice(&[f32::NAN, f32::NEG_INFINITY, -0.0, 1e-40]);
        let bytes = bytes(&header, &samples, (TiffSamples::F32, compression), 7).unwrap();
        let (reader, found) = read_back(&header, &bytes);
        assert!(same(&found, &samples));
        // The largest, rounded down.
        assert_eq!(reader.own_tags().white_level_adu, Some(2338.0.into()));
        let (mut file, first, _) = directories(&bytes);
        assert_eq!(numbers(&mut file, &first, tags::DNG_BACKWARD_VERSION), [1.0, 4.0, 0.0, 0.0]);
        header.metadata.white_level_adu = None;
        let missing = self::bytes(&header, &samples, (TiffSamples::F32, compression), 7).unwrap_err();
        assert_eq!(missing.to_string(), "in: the metadata has no `white_level_adu`");
        // Whoever gave one hears what became of it.
        let dark = CorrectionRecord { dark_frames: 1, ..CorrectionRecord::of_black(0.0.into(), false) };
        header.metadata.correction = Some(dark);
        let lost = self::bytes(&header, &samples, (TiffSamples::F32, compression), 7).unwrap_err().to_string();
        assert!(lost.contains("how far the dark frames lowered that of this frame is not known"), "{lost}");
    }
}

#[test]
fn a_black_level_below_zero_is_that_of_columns() {
    let mut header = frame([4, 3], [1, 1], "rggb");
    header.metadata.black_level_adu = Some(BlackLevel::Sites([-10.5, 2.0, -1.0, 0.0]));
    for by_column in [vec![], vec![0.0, 1.0, 2.0, 3.0, 4.0]] {
        header.metadata.black_by_column = by_column;
        let bytes = bytes(&header, &codes(&header), PLAIN, 3).unwrap();
        let (reader, _) = read_back(&header, &bytes);
        assert_eq!(blacks(&header, reader.own_tags()), blacks(&header, &header.metadata));
    }
}

#[test]
fn bytes_do_not_hang_on_bands() {
    let header = frame([301, 207], [3, 2], "grbg");
    let samples = codes(&header);
    let [first, others @ ..] = [207, 1, 50].map(|rows| bytes(&header, &samples, PLAIN, rows).unwrap());
    assert!(others.iter().all(|other| *other == first));
}

/// The file, its first directory and that of the raw image.
fn directories(bytes: &[u8]) -> (TiffFile, Directory, Directory) {
    let mut file = TiffFile::open(stored(bytes), "out.dng").unwrap();
    let first = file.directory(0).unwrap();
    let below = tags::SUB_IFDS.one(&mut file, &first).unwrap().unwrap();
    let below = file.directory_below(below as u64).unwrap();
    (file, first, below)
}

fn numbers(file: &mut TiffFile, directory: &Directory, tag: DngTag) -> Vec<f64> {
    tag.numbers(file, directory, 100).unwrap().unwrap_or_default()
}

/// Noise, converter and levels that agree.
fn with_noise(header: &mut FrameHeader) -> Photosite {
    let adc = AdcRecord::new(16, 800.0, 0.8);
    let metadata = &mut header.metadata;
    metadata.adc = Some(adc);
    metadata.noise = Some(NoiseRecord {
        sources: vec![Source::Dcsn, Source::Dcnu, Source::Ssn, Source::Prnu, Source::Ron],
        seed: 1,
        sensor_seed: 1,
        frame: 0,
        temperature_k: 300.0,
        dark_e: 73.0,
        hot_pixel_e: 0.0,
        poisson: PoissonKind::Exact,
        cte: None,
        smear_per_row: 0.0,
    });
    metadata.black_level_adu = Some((800.0 + 0.8 * 73.0).into());
    metadata.white_level_adu = Some(65_535.0.into());
    metadata.sensor.as_mut().unwrap().readout.as_mut().unwrap().full_well_e = 1e6;
    let model = NoiseModel::of(header, header.metadata.noise.as_ref().unwrap()).unwrap();
    Photosite::of_electrons(model, Equations::Exact).digitized(adc)
}

#[test]
fn the_noise_profile_is_the_variance_of_codes() {
    let mut header = frame([4, 4], [0, 0], "rggb");
    let photosite = with_noise(&mut header);
    let (mut file, _, raw) = directories(&bytes(&header, &codes(&header), PLAIN, 4).unwrap());
    let profile = numbers(&mut file, &raw, tags::NOISE_PROFILE);
    assert_eq!((profile.len(), &profile[2..4]), (6, &profile[..2]));
    let range = 65_535.0 - (800.0 + 0.8 * 73.0);
    for expected_e in [0.0, 500.0, 30_000.0] {
        let codes = photosite.moments(expected_e).moments;
        let x = 0.8 * expected_e / range;
        // Fixed patterns are not in it. That of the dark signal is cut off at zero five deviations down: 10⁻⁷ of it.
        let model = &photosite.model;
        let patterns = (model.prnu * x).powi(2) + (model.dcnu * 0.8 * model.dark_e / range).powi(2);
        let variance = (profile[0] * x + profile[1] + patterns) * range * range;
        assert!((variance / codes.variance - 1.0).abs() < 3e-7, "{expected_e}: {variance} {}", codes.variance);
    }
    // What follows no such line has none.
    header.metadata.noise.as_mut().unwrap().cte = Some(0.9999);
    let (mut file, _, raw) = directories(&bytes(&header, &codes(&header), PLAIN, 4).unwrap());
    assert!(numbers(&mut file, &raw, tags::NOISE_PROFILE).is_empty());
}

/// What a raw file told of its picture and its noise is in the DNG that is made of it, on the scale of its range.
#[test]
fn what_the_raw_file_told_is_told_on() {
    let mut header = frame([6, 4], [2, 1], "rggb");
    let lines = vec![[1.2e-4, 3.4e-7], [1.1e-4, 3.3e-7], [1.3e-4, 3.5e-7]];
    let range_adu = 4095.0 - 1757.25;
    header.metadata.noise_profile = Some(ProfileRecord { lines: lines.clone(), range_adu });
    header.metadata.orientation = Some(6);
    let told = |header: &FrameHeader| {
        let bytes = bytes(header, &codes(header), PLAIN, 4).unwrap();
        let (mut file, first, raw) = directories(&bytes);
        let orientation = numbers(&mut file, &first, tags::ORIENTATION);
        let own = DngReader::open(stored(&bytes), "out.dng", RawArea::Active).unwrap().own_tags().clone();
        (numbers(&mut file, &raw, tags::NOISE_PROFILE), orientation, own)
    };
    let (profile, orientation, own) = told(&header);
    assert_eq!((&profile[..], &orientation[..]), (lines.as_flattened(), &[6.0][..]));
    assert_eq!((own.noise_profile, own.orientation), (header.metadata.noise_profile.clone(), Some(6)));
    // The same variances of a range that is twice as large.
    let mut wide = header.clone();
    wide.metadata.sensor = None;
    wide.metadata.white_level_adu = Some(6432.0.into());
    wide.metadata.black_level_adu = Some((6432.0 - 2.0 * range_adu).into());
    let (profile, ..) = told(&wide);
    assert!((profile[2] / 0.55e-4 - 1.0).abs() < 1e-12 && (profile[3] / 0.825e-7 - 1.0).abs() < 1e-12, "{profile:?}");
    // Of an average, and once dark frames came off, it is another.
    let average = ExposuresRecord {
        frames: 2,
        combine: crate::numerics::averages::Combine::Mean,
        clip: None,
        quantity: QuantityKind::Adu,
        demosaicked: false,
        unlike_levels: 0.0,
        cut_off: None,
    };
    let dark = CorrectionRecord { dark_frames: 1, ..CorrectionRecord::of_black(0.0.into(), false) };
    let changes: [&dyn Fn(&mut Metadata); 2] = [&|m| m.average = Some(average), &|m| m.correction = Some(dark.clone())];
    for change in changes {
        let mut other = header.clone();
        change(&mut other.metadata);
        assert!(told(&other).0.is_empty());
    }
    header.metadata.noise_profile = None;
    header.metadata.orientation = None;
    let (profile, orientation, own) = told(&header);
    assert_eq!((profile.len(), &orientation[..], own.orientation), (0, &[1.0][..], None));
}

#[test]
fn colors_and_places_are_told() {
    let header = frame([7, 5], [1, 2], "rggb");
    let (mut file, first, raw) = directories(&bytes(&header, &codes(&header), PLAIN, 4).unwrap());
    let mut of_file = |tag| numbers(&mut file, &first, tag);
    let color = super::signals::CameraColor::of(&XYZ_FROM_CAMERA, (D65_XY, tags::D65), D65_XY).unwrap();
    let near = |found: &[f64], expected: &[f64]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8);
    assert!(near(&of_file(tags::COLOR_MATRIX_1), color.camera_from_xyz.as_flattened()));
    assert!(near(&of_file(tags::AS_SHOT_NEUTRAL), &color.neutral));
    assert_eq!(of_file(tags::CALIBRATION_ILLUMINANT_1), [21.0]);
    assert_eq!(of_file(tags::DNG_VERSION), [1.0, 4.0, 0.0, 0.0]);
    assert_eq!(of_file(tags::DNG_BACKWARD_VERSION), [1.0, 1.0, 0.0, 0.0]);
    assert_eq!(of_file(tags::NEW_SUBFILE_TYPE), [1.0]);
    let mut of_raw = |tag| numbers(&mut file, &raw, tag);
    assert_eq!(of_raw(tags::ACTIVE_AREA), [0.0, 0.0, 5.0, 7.0]);
    assert_eq!(of_raw(tags::DEFAULT_CROP_SIZE), [7.0, 5.0]);
    // One column on: the first row of the frame is green and red.
    assert_eq!(of_raw(tags::CFA_PATTERN), [1.0, 0.0, 2.0, 1.0]);
    assert_eq!(of_raw(tags::BLACK_LEVEL), [1757.25]);
}

fn complaint(header: &FrameHeader) -> String {
    bytes(header, &codes(header), PLAIN, 1).unwrap_err().to_string()
}

#[test]
fn what_is_no_raw_is_refused() {
    let good = frame([4, 4], [0, 0], "rggb");
    let begin = "out.dng: a DNG holds codes behind a filter array, one plane of ADU, and this frame is";
    let three = Geometry::new(4, 4, &["R", "G", "B"]);
    let changed = |quantity, geometry: &Geometry| {
        let mut header = FrameHeader { geometry: geometry.clone(), ..good.clone() };
        header.metadata.quantity = quantity;
        header.metadata.cfa = header.metadata.cfa.filter(|_| geometry.channels.len() == 1);
        header
    };
    for (quantity, geometry, end) in [
        (QuantityKind::Electrons, &good.geometry, "a CFA plane of electrons; run `digitize` first"),
        (QuantityKind::Electrons, &three, "three planes of electrons; run `mosaic` and `digitize` first"),
        (QuantityKind::Adu, &three, "three planes of ADU; run `mosaic` first"),
        (QuantityKind::Srgb, &three, "three planes of sRGB; write an EXR or a TIFF"),
    ] {
        assert_eq!(complaint(&changed(quantity, geometry)), format!("{begin} {end}"));
    }
    let mut demosaicked = changed(QuantityKind::Adu, &three);
    let (method, cfa) = ("bilinear".into(), "rggb".parse().unwrap());
    demosaicked.metadata.demosaic =
        Some(DemosaicRecord { method, cfa, black: 0.0.into(), black_deltas: false, plane: None });
    assert!(complaint(&demosaicked).ends_with("three demosaicked planes of ADU; write an EXR or a TIFF"));
    let mut unknown = good.clone();
    unknown.metadata.cfa = None;
    assert_eq!(complaint(&unknown), "in: the metadata has no `cfa`");
    let mut unknown = good.clone();
    unknown.metadata.black_level_adu = None;
    assert_eq!(complaint(&unknown), "in: the metadata has no `black_level_adu`");
    let mut outside = good.clone();
    outside.geometry.origin = [-1, 3];
    assert!(complaint(&outside).ends_with("begins at column -1, row 3 of the sensor; write an EXR"));
    let mut dark = good.clone();
    dark.metadata.black_level_adu = Some(4095.0.into());
    assert!(
        complaint(&dark).contains("black level of this frame, 4095 ADU, is no less than its white level, 4095 ADU")
    );
}

#[test]
fn samples_that_are_no_codes_are_refused() {
    for sample in [-1.0, 65_536.0, 0.5, f32::NAN, f32::INFINITY] {
        let said = bytes(&frame([1, 1], [0, 0], "rggb"), &[sample], PLAIN, 1).unwrap_err().to_string();
        assert_eq!(said, format!("out.dng: the sample {sample} is no code of 16 bits; write 32-bit floats (f32)"));
    }
}

//! Black levels by site, row and column, white levels by class, and filter arrays that are no Bayer patterns, through all
//! stages that meet them.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Report, Saturated, measure};
use cyanometer::camera::levels::{BlackLevel, WhiteLevel};
use cyanometer::cfa::{CfaPattern, Class, FilterArray};
use cyanometer::color::{Space, matrix};
use cyanometer::error::Result;
use cyanometer::formats::picture::{PictureSettings, write_png};
use cyanometer::formats::yaml::{parse_metadata, write_metadata};
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::{CameraSettings, FrameHeader, Metadata, Scene};
use cyanometer::propagation::{self, Equations, Unpredictable};
use cyanometer::sigma::WithSigma;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::darks::DarkStack;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::ToXyz;
use cyanometer::stream::{MemoryFrame, Stage};
use cyanometer::units::QuantityKind;
use nalgebra::Vector3;
use support::chain::color_settings;
use support::*;

/// None of them a 32-bit float.
const SITES: [f64; 4] = [100.1, 103.3, 98.7, 101.9];
const X_TRANS: &str = "6x6:GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG";

/// A plane of codes behind an array, its levels unknown.
fn plane(width: usize, height: usize, array: FilterArray) -> MemoryFrame {
    let mut head = header(QuantityKind::Adu, Geometry::new(width, height, &["Y"]));
    head.metadata.cfa = Some(array);
    frame(head, |x, y, _| (200.0 + 3000.0 * scatter(x, y, 0)).round())
}

/// The same with a level for each site, row and column.
fn with_levels(mut frame: MemoryFrame) -> MemoryFrame {
    let metadata = &mut frame.header.metadata;
    metadata.black_level_adu = Some(BlackLevel::Sites(SITES));
    metadata.black_by_row = (0..40).map(|y| f64::from(y * 7 % 5) / 8.0).collect();
    metadata.black_by_column = (0..50).map(|x| f64::from(x * 11 % 7) / 10.0).collect();
    metadata.white_level_adu = Some(4095.0.into());
    frame
}

/// Codes less their black level, worked out photosite by photosite.
fn by_hand(frame: &MemoryFrame) -> MemoryFrame {
    let metadata = &frame.header.metadata;
    let [x0, y0] = frame.header.geometry.origin.map(|at| usize::try_from(at).unwrap());
    let mut made = support::frame(frame.header.clone(), |x, y, channel| {
        let (column, row) = (x + x0, y + y0);
        let site = metadata.black_level_adu.unwrap().sites()[row % 2 * 2 + column % 2];
        let delta = |deltas: &[f64], at: usize| deltas.get(at).copied().unwrap_or(0.0);
        let black = site + delta(&metadata.black_by_row, row) + delta(&metadata.black_by_column, column);
        to_sample(f64::from(at(frame, x, y, channel)) - black)
    });
    made.header.metadata.set_black_adu(None);
    made
}

fn correct(frame: &FrameHeader, black: Black, cte: Option<f64>) -> Result<CorrectFrame> {
    CorrectFrame::new(frame, &CorrectionSettings { black, cte }, None)
}

fn statistics(frame: &MemoryFrame) -> Report {
    measure(&mut frame.clone(), &[], Saturated::Kept, Equations::Exact, None).unwrap()
}

fn refused<T>(result: Result<T>, complaint: &str) {
    match result {
        Ok(_) => panic!("not refused: {complaint}"),
        Err(error) => assert!(error.to_string().contains(complaint), "{error}"),
    }
}

/// Widths that are cut into strips and that are not; frames that start at every phase of the array.
#[test]
fn black_comes_off_each_photosite_before_it_is_interpolated() {
    for method in Method::ALL {
        for (width, origin) in [(17, [0, 0]), (17, [1, 0]), (16, [0, 1]), (9, [3, 5])] {
            let mut codes = with_levels(plane(width, 11, CfaPattern::Grbg.into()));
            codes.header.geometry.origin = origin;
            let expected = by_hand(&codes);
            let corrected = through(&codes, &correct(&codes.header, Black::Auto, None).unwrap());
            assert_same(&corrected, &expected, "corrected");
            let at_once = Demosaic::new(&codes.header, method, Black::Auto, None).unwrap();
            let after = Demosaic::new(&expected.header, method, Black::None, None).unwrap();
            assert_same(&through(&codes, &at_once), &through(&expected, &after), method.names()[0]);
            for cuts in [&[1][..], &[2, 7], &[5]] {
                assert_same(&through_cuts(&codes, &at_once, cuts).0, &through(&codes, &at_once), "in bands");
            }
            let metadata = &at_once.header().metadata;
            assert_eq!(metadata.black_level_adu, Some(0.0.into()));
            assert!(metadata.black_by_row.is_empty() && metadata.black_by_column.is_empty());
            let record = metadata.demosaic.as_ref().unwrap();
            assert_eq!((record.black, record.black_deltas), (BlackLevel::Sites(SITES), true));
        }
    }
    let mut wide = plane(1100, 5, CfaPattern::Rggb.into());
    wide.header.metadata.black_level_adu = Some(BlackLevel::Sites(SITES));
    let expected = by_hand(&wide);
    let at_once = Demosaic::new(&wide.header, Method::Malvar, Black::Auto, None).unwrap();
    let after = Demosaic::new(&expected.header, Method::Malvar, Black::None, None).unwrap();
    assert_same(&through(&wide, &at_once), &through(&expected, &after), "wide");
}

/// Four equal levels are one, with the bits of the short form.
#[test]
fn equal_sites_are_a_uniform_level() {
    let mut short = plane(20, 9, CfaPattern::Rggb.into());
    let mut long = short.clone();
    short.header.metadata.black_level_adu = Some(102.34.into());
    long.header.metadata.black_level_adu = Some(BlackLevel::Sites([102.34; 4]));
    long.header.metadata.black_by_row = vec![0.0; 9];
    for method in Method::ALL {
        let made =
            |frame: &MemoryFrame| through(frame, &Demosaic::new(&frame.header, method, Black::Auto, None).unwrap());
        assert_same(&made(&short), &made(&long), method.names()[0]);
        let level =
            |black| Demosaic::new(&long.header, method, black, None).unwrap().header().uniform_black_adu().unwrap();
        // A level that is said of a camera's frame is its black level.
        assert_eq!([level(Black::None), level(Black::Level(2.34.into()))], [102.34, 0.0]);
    }
}

/// The law of crops: what is subtracted hangs on a photosite's place on the sensor.
#[test]
fn a_crop_loses_what_the_whole_loses() {
    let whole = with_levels(plane(30, 24, CfaPattern::Rggb.into()));
    let subtract = |frame: &MemoryFrame| through(frame, &correct(&frame.header, Black::Auto, None).unwrap());
    let demosaic = |frame: &MemoryFrame| {
        through(frame, &Demosaic::new(&frame.header, Method::EffectiveColor, Black::Auto, None).unwrap())
    };
    let corner = |x: usize, y: usize| [x, y, 30 - x, 24 - y];
    for [x, y, width, height] in [corner(1, 0), corner(0, 1), corner(5, 3), [2, 2, 9, 8]] {
        let part = crop(&whole, x, y, width, height);
        assert_same(&subtract(&part), &crop(&subtract(&whole), x, y, width, height), "corrected");
        // Away from the edges, which are mirrored.
        let margin = Method::EffectiveColor.reach();
        let inner = |frame: &MemoryFrame, x: usize, y: usize| {
            crop(frame, x + margin, y + margin, width - 2 * margin, height - 2 * margin)
        };
        assert_same(&inner(&demosaic(&part), 0, 0), &inner(&demosaic(&whole), x, y), "demosaicked");
    }
    let beyond = {
        let mut frame = whole.clone();
        frame.header.geometry.origin = [0, 20];
        frame
    };
    let complaint = "`black_by_row` has the levels of 40 rows, but the frame has rows 20 to 43 of the sensor";
    refused(correct(&beyond.header, Black::Auto, None), complaint);
    refused(Demosaic::new(&beyond.header, Method::Bilinear, Black::Auto, None), complaint);
    refused(measure(&mut beyond.clone(), &[], Saturated::Kept, Equations::Exact, None), complaint);
}

#[test]
fn levels_by_site_that_no_word_is_left_for_are_refused() {
    let codes = with_levels(plane(12, 8, CfaPattern::Rggb.into()));
    let mut simulated = codes.header.clone();
    simulated.metadata.adc = Some(cyanometer::metadata::AdcRecord::new(12, 100.0, 0.1));
    for (frame, black) in [(&codes.header, Black::None), (&simulated, Black::Level(100.0.into()))] {
        let made = Demosaic::new(frame, Method::Bilinear, black, None);
        refused(made, "what is left of its black level differs among photosites, which three planes cannot tell");
    }
    // Of a plane each site keeps its own; of a camera's nothing is left of a level that is said.
    let less = |frame| correct(frame, Black::Level(100.0.into()), None).unwrap().header().metadata.clone();
    let left = less(&simulated);
    assert_eq!(left.black_level_adu, Some(BlackLevel::Sites(SITES.map(|level| level - 100.0))));
    assert_eq!(left.black_by_row, codes.header.metadata.black_by_row);
    assert_eq!((less(&codes.header).black_level_adu, less(&codes.header).black_by_row), (Some(0.0.into()), Vec::new()));
    for black in [Black::None, Black::Level(100.0.into())] {
        let mut codes = codes.clone();
        codes.header.metadata.adc = Some(cyanometer::metadata::AdcRecord::new(12, 100.0, 0.1));
        refused(correct(&codes.header, black, Some(0.999)), "differs among photosites, so that it is no charge");
        assert!(correct(&codes.header, Black::Auto, Some(0.999)).is_ok());
    }
    let mut three = frame(header(QuantityKind::Adu, Geometry::new(6, 4, &["R", "G", "B"])), |_, _, _| 500.0);
    three.header.metadata.black_level_adu = Some(BlackLevel::Sites(SITES));
    refused(
        ToXyz::new(&three.header, &color_settings(Space::Xyz)),
        "its black level differs among photosites; subtract it",
    );
    let mut camera = Demosaic::new(&codes.header, Method::Bilinear, Black::Auto, None).unwrap();
    camera.header_mut().metadata.black_level_adu = Some(BlackLevel::Sites(SITES));
    refused(WithSigma::of_demosaicking(camera), "its black level differs among photosites");
    // What adds to a level needs one.
    let mut without = codes.header.clone();
    without.metadata.black_level_adu = None;
    refused(correct(&without, Black::Auto, None), "but not the level itself; write `black_level_adu`");
}

/// Charge transfer is undone of what is left once each photosite has lost its black.
#[test]
fn transfer_is_undone_behind_levels_by_site() {
    let codes = with_levels(plane(12, 8, CfaPattern::Rggb.into()));
    let expected = by_hand(&codes);
    let at_once = through(&codes, &correct(&codes.header, Black::Auto, Some(0.9999)).unwrap());
    let mut after = expected.header.clone();
    after.metadata.black_level_adu = Some(0.0.into());
    let after = MemoryFrame::new(after, expected.samples);
    let after = through(&after, &correct(&after.header, Black::Level(0.0.into()), Some(0.9999)).unwrap());
    // The first rounds to 32 bits once, the second twice, of codes below 2¹².
    let off = at_once.samples.iter().zip(&after.samples).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off <= 2.0_f32.powi(-11), "{off}");
}

#[test]
fn nothing_is_predicted_behind_levels_by_site() {
    let scene = Scene::uniform("test", [100.0; 3]);
    let mut codes = with_levels(plane(12, 8, CfaPattern::Rggb.into()));
    codes.header.metadata.scene = Some(scene);
    codes.header.metadata.adc = Some(cyanometer::metadata::AdcRecord::new(12, 100.0, 0.1));
    let why = propagation::of_frame(&codes.header, Equations::Exact).unwrap_err();
    assert_eq!(why, Unpredictable::Beyond("the black level differs among photosites"));
    let corrected = correct(&codes.header, Black::Auto, None).unwrap();
    let camera = Demosaic::new(&codes.header, Method::Bilinear, Black::Auto, None).unwrap();
    for head in [corrected.header(), camera.header()] {
        let why = propagation::of_frame(head, Equations::Exact).unwrap_err();
        assert_eq!(why, Unpredictable::Beyond("the black level that was subtracted differs among photosites"));
    }
}

/// R is clipped at 1000, G at 2000, B at 3000; the samples on either side of each are counted by hand.
#[test]
fn each_class_is_clipped_at_its_own_white() {
    let whites = [1000.0, 2000.0, 3000.0];
    let values = [0.0, 1.0, 999.0, 1000.0, 1999.0, 2000.0, 2999.0, 3000.0, f32::NAN];
    let count = |samples: &[(f32, Class)], class: Option<Class>| {
        let is_clipped = |(sample, of): &&(f32, Class)| {
            class.is_none_or(|class| class == *of) && (*sample <= 0.0 || f64::from(*sample) >= whites[*of as usize])
        };
        samples.iter().filter(is_clipped).count() as u64
    };
    for array in ["rggb", "gbrg", X_TRANS] {
        let array: FilterArray = array.parse().unwrap();
        let head = FrameHeader { ..plane(19, 13, array).header };
        let mut codes = frame(head, |x, y, _| values[(x * 5 + y * 3 + x * y) % 9]);
        codes.header.geometry.origin = [1, 2];
        codes.header.metadata.white_level_adu = Some(WhiteLevel::Classes(whites));
        let class_of = |index: usize| array.class((index % 19 + 1) as i64, (index / 19 + 2) as i64).unwrap();
        let samples: Vec<_> =
            codes.samples.iter().enumerate().map(|(index, sample)| (*sample, class_of(index))).collect();
        let region = &statistics(&codes).regions[0];
        assert_eq!(region.channels[0].clipped, Some(count(&samples, None)), "{array}");
        for (class, report) in Class::ALL.into_iter().zip(&region.classes) {
            assert_eq!(report.clipped, Some(count(&samples, Some(class))), "{array} {class:?}");
            let finite = samples.iter().filter(|(sample, of)| *of == class && sample.is_finite()).count() as u64;
            assert_eq!(report.count, finite);
        }
    }
    let head = header(QuantityKind::Adu, Geometry::new(9, 5, &["R", "G", "B"]));
    let mut three = frame(head, |x, y, channel| values[(x * 5 + y * 3 + channel) % 9]);
    three.header.metadata.white_level_adu = Some(WhiteLevel::Classes(whites));
    for (channel, report) in statistics(&three).regions[0].channels.iter().enumerate() {
        let of_channel: Vec<_> =
            three.samples.chunks(9).skip(channel).step_by(3).flatten().map(|s| (*s, Class::ALL[channel])).collect();
        assert_eq!(report.clipped, Some(count(&of_channel, None)), "{channel}");
    }
    // A mosaic of them keeps the three levels.
    let mosaic = Mosaic::new(&three.header, Some(CfaPattern::Gbrg)).unwrap();
    assert_eq!(mosaic.header().metadata.white_level_adu, Some(WhiteLevel::Classes(whites)));
}

/// Full photosites of green lie at two levels once black is off: the lower is where the first of them is full.
#[test]
fn white_follows_what_is_subtracted_from_its_class() {
    let mut codes = plane(12, 8, CfaPattern::Grbg.into());
    codes.header.metadata.white_level_adu = Some(4095.0.into());
    codes.header.metadata.black_level_adu = Some(BlackLevel::Sites(SITES));
    // Sites of grbg: green, red, blue, green.
    let expected = WhiteLevel::Classes([4095.0 - SITES[1], 4095.0 - SITES[3], 4095.0 - SITES[2]]);
    let camera = Demosaic::new(&codes.header, Method::Bilinear, Black::Auto, None).unwrap();
    assert_eq!(camera.header().metadata.white_level_adu, Some(expected));
    let corrected = correct(&codes.header, Black::Auto, None).unwrap();
    assert_eq!(corrected.header().metadata.white_level_adu, Some(expected));
    // From one white of three classes and one black: three; and on a sensor of unknown classes the least.
    codes.header.metadata.white_level_adu = Some(WhiteLevel::Classes([1000.0, 2000.0, 3000.0]));
    codes.header.metadata.black_level_adu = Some(100.0.into());
    let camera = Demosaic::new(&codes.header, Method::Bilinear, Black::Auto, None).unwrap();
    assert_eq!(camera.header().metadata.white_level_adu, Some(WhiteLevel::Classes([900.0, 1900.0, 2900.0])));
    let lab = ToXyz::new(camera.header(), &color_settings(Space::Lab)).unwrap();
    // By the white one class is full, and no other beyond it.
    let inverse = matrix(&sensor().xyz_from_camera.unwrap()).try_inverse().unwrap();
    let signals = inverse * Vector3::from(lab.white()) * EXPOSURE.exposure_s_sr();
    let fullest = (0..3).map(|k| signals[k] / [900.0, 1900.0, 2900.0][k]).fold(0.0, f64::max);
    assert!((fullest - 1.0).abs() < 1e-12, "{signals}");
    let mut x_trans = plane(12, 8, X_TRANS.parse().unwrap());
    x_trans.header.metadata.white_level_adu = Some(4095.0.into());
    x_trans.header.metadata.black_level_adu = Some(BlackLevel::Sites(SITES));
    let corrected = correct(&x_trans.header, Black::Auto, None).unwrap();
    assert_eq!(corrected.header().metadata.white_level_adu, Some((4095.0 - 103.3).into()));
}

/// Signal is what lies above the mean black of the photosites that it was measured at.
#[test]
fn signal_to_noise_is_above_the_black_of_each_class() {
    let mut codes = plane(12, 8, CfaPattern::Rggb.into());
    codes.header.metadata.black_level_adu = Some(BlackLevel::Sites([100.0, 200.0, 300.0, 400.0]));
    codes.header.metadata.black_by_column = (0..12).map(f64::from).collect();
    let db = |mean: f64, std: f64| 20.0 * (mean / std).log10();
    let region = &statistics(&codes).regions[0];
    // Columns add 5 to red on average, 6 to blue, 5.5 to both greens together and to all.
    for (report, black) in region.classes.iter().chain(&region.channels).zip([105.0, 255.5, 406.0, 255.5]) {
        let expected = db(report.mean.unwrap() - black, report.std.unwrap());
        assert!((report.snr_db.unwrap() - expected).abs() < 1e-9, "{}", report.name);
    }
}

/// What is measured of other arrays: each class, whatever the period; of other filters, and none, the whole plane.
#[test]
fn other_arrays_are_measured() {
    let x_trans: FilterArray = X_TRANS.parse().unwrap();
    let mut codes = plane(20, 15, x_trans);
    codes.header.geometry.origin = [2, -3];
    let level = |class: Class| [10.0, 20.0, 30.0][class as usize];
    let class = |x: usize, y: usize| x_trans.class(x as i64 + 2, y as i64 - 3).unwrap();
    let codes = frame(codes.header, |x, y, _| level(class(x, y)) + scatter(x, y, 3));
    let region = &statistics(&codes).regions[0];
    assert_eq!(region.classes.iter().map(|class| class.count).sum::<u64>(), 300);
    for (class, report) in Class::ALL.into_iter().zip(&region.classes) {
        let above = report.mean.unwrap() - f64::from(level(class));
        assert!((0.3..0.7).contains(&above) && report.max.unwrap() < f64::from(level(class)) + 1.001, "{report:?}");
    }
    let mut plain = codes.clone();
    plain.header.metadata.cfa = None;
    let plain = &statistics(&plain).regions[0];
    assert!((region.channels[0].mean.unwrap() - plain.channels[0].mean.unwrap()).abs() < 1e-9);
    assert!((region.channels[0].std.unwrap() - plain.channels[0].std.unwrap()).abs() < 1e-9);
    for array in ["monochrome", "2x2:RGBW", "2x2:CYGM"] {
        let mut codes = codes.clone();
        codes.header.metadata.cfa = Some(array.parse().unwrap());
        let region = &statistics(&codes).regions[0];
        assert!(region.classes.is_empty(), "{array}");
        assert_eq!(region.channels, plain.channels, "{array}");
    }
}

#[test]
fn other_arrays_are_refused_by_name() {
    for (array, name) in [
        (X_TRANS, "an X-Trans filter array"),
        ("monochrome", "no color filters (monochrome)"),
        ("4x4:RRGGRRGGGGBBGGBB", "a quad Bayer filter array"),
        ("2x2:CYGM", "a filter array of 2x2 sites"),
    ] {
        let array: FilterArray = array.parse().unwrap();
        let mut codes = plane(12, 12, array);
        codes.header.metadata.black_level_adu = Some(64.0.into());
        let complaint = format!("test: its sensor has {name}; only Bayer arrays are demosaicked");
        refused(Demosaic::new(&codes.header, Method::Bilinear, Black::Auto, None), &complaint);
        // Who names a pattern knows better.
        assert!(Demosaic::new(&codes.header, Method::Bilinear, Black::Auto, Some(CfaPattern::Rggb)).is_ok());
        let mut rates = codes.header.clone();
        rates.metadata.quantity = QuantityKind::ExpectedElectrons;
        refused(AddNoise::new(&rates, &NoiseSettings::default()), "only Bayer arrays are given noise");
        let mut three = expected(4, 4, |_, _, _| 1.0).header;
        three.metadata.sensor.as_mut().unwrap().readout.as_mut().unwrap().cfa = array;
        refused(Mosaic::new(&three, None), &format!("its sensor has {name}; mosaics are made of Bayer arrays alone"));
        assert!(Mosaic::new(&three, Some(CfaPattern::Bggr)).is_ok());
        refused(Mosaic::new(&codes.header, None), "it is ");
    }
    assert_eq!(plane(2, 2, FilterArray::Monochrome).header.holds(), "a monochrome plane of ADU");
}

/// Corrections serve planes behind any array.
#[test]
fn planes_of_a_monochrome_sensor_are_corrected() {
    let codes = with_levels(plane(12, 8, FilterArray::Monochrome));
    let corrected = through(&codes, &correct(&codes.header, Black::Auto, None).unwrap());
    assert_same(&corrected, &by_hand(&codes), "corrected");
    assert_eq!(corrected.header.metadata.cfa, Some(FilterArray::Monochrome));
}

/// Metadata say levels as they came, short or long.
#[test]
fn levels_and_arrays_are_written_and_read() {
    let mut metadata = with_levels(plane(4, 4, X_TRANS.parse().unwrap())).header.metadata;
    metadata.white_level_adu = Some(WhiteLevel::Classes([1.0, 2.0, 3.0]));
    let text = write_metadata(&metadata).unwrap();
    assert_eq!(parse_metadata("x", &text).unwrap(), metadata);
    assert!(text.contains(&format!("cfa: {X_TRANS}\n")), "{text}");
    metadata.set_black_adu(Some(64.0.into()));
    metadata.white_level_adu = Some(4095.0.into());
    metadata.cfa = Some(CfaPattern::Rggb.into());
    let text = write_metadata(&metadata).unwrap();
    assert!(text.contains("cfa: rggb\nblack_level_adu: 64.0\nwhite_level_adu: 4095.0\n"), "{text}");
    let complaint = |of: &str, wrong: &str| {
        let text = format!("schema: cyanometer/1\n{of}: {wrong}\n");
        parse_metadata("x", &text).unwrap_err().to_string()
    };
    assert!(complaint("black_level_adu", "[1, 2]").contains("four for the 2x2 sites"));
    assert!(complaint("white_level_adu", "[1, 2]").contains("three for R, G and B"));
    assert!(complaint("cfa", "6x6:RGB").contains("`6x6:RGB` is no filter array"));
}

/// A picture runs from the least black to each plane's white.
#[test]
fn pictures_know_levels_by_site_and_class() {
    let directory = tempfile::TempDir::new().unwrap();
    let path = directory.path().join("a.png");
    let head = header(QuantityKind::Adu, Geometry::new(2, 1, &["R", "G", "B"]));
    let mut three = frame(head, |x, _, channel| if x == 0 { 10.0 } else { [100.0, 200.0, 300.0][channel] });
    three.header.metadata.black_level_adu = Some(BlackLevel::Sites([10.0, 20.0, 30.0, 40.0]));
    three.header.metadata.white_level_adu = Some(WhiteLevel::Classes([100.0, 200.0, 300.0]));
    let settings = PictureSettings::default();
    write_png(&mut three, &settings, &path).unwrap();
    let shown = image::open(&path).unwrap().to_rgb8();
    assert_eq!((shown.get_pixel(0, 0).0, shown.get_pixel(1, 0).0), ([0; 3], [255; 3]));
}

/// An unknown black level is not zero: what subtracts black refuses, and says by which key.
#[test]
fn a_black_level_that_nobody_states_is_not_taken_as_zero() {
    let codes = plane(12, 8, CfaPattern::Rggb.into());
    let complaint = "the metadata has no `black_level_adu`";
    refused(Demosaic::new(&codes.header, Method::Bilinear, Black::Auto, None), complaint);
    refused(correct(&codes.header, Black::Auto, None), complaint);
    let three = header(QuantityKind::Adu, Geometry::new(6, 4, &["R", "G", "B"]));
    let three = FrameHeader { name: "test".into(), ..three };
    refused(ToXyz::new(&three, &color_settings(Space::Xyz)), complaint);
    // Who says that there is none goes on.
    for black in [Black::None, Black::Level(0.0.into()), Black::Level(70.0.into())] {
        let made = Demosaic::new(&codes.header, Method::Bilinear, black, None).unwrap();
        assert_eq!(made.header().metadata.black_level_adu, Some(0.0.into()));
    }
    // Noisy electrons have a dark signal; where it is not known, neither is the black level of their codes.
    for (quantity, known) in [(QuantityKind::Electrons, None), (QuantityKind::ExpectedElectrons, Some(1753.0.into()))] {
        let mut electrons = codes.header.clone();
        electrons.metadata.quantity = quantity;
        let made = Digitize::new(&electrons, &AdcSettings::default()).unwrap();
        assert_eq!(made.header().metadata.black_level_adu, known);
        let made = Demosaic::new(&electrons, Method::Bilinear, Black::Auto, None);
        match known {
            Some(_) => assert!(made.is_ok()),
            None => refused(made, "the metadata has no `dark_signal_e`"),
        }
    }
}

/// What demosaicking took off stays off when a mosaic is made of it again: to the bit, whatever is asked.
#[test]
fn a_mosaic_of_demosaicked_planes_has_lost_its_black() {
    let codes = with_levels(plane(12, 8, CfaPattern::Rggb.into()));
    let rgb = through(&codes, &Demosaic::new(&codes.header, Method::Malvar, Black::Auto, None).unwrap());
    let again = through(&rgb, &Mosaic::new(&rgb.header, Some(CfaPattern::Rggb)).unwrap());
    assert_same(&again, &by_hand(&codes), "measured samples, less black");
    let record = again.header.metadata.correction.clone().unwrap();
    assert_eq!((record.black_adu, record.black_deltas), (BlackLevel::Sites(SITES), true));
    let twice = through(&again, &Demosaic::new(&again.header, Method::Malvar, Black::Auto, None).unwrap());
    assert_same(&twice, &rgb, "demosaicked twice");
    let more = Demosaic::new(&again.header, Method::Malvar, Black::Level(100.0.into()), None);
    refused(more, "its black level is off already");
    refused(correct(&again.header, Black::None, Some(0.999)), "corrected already");
    // Where nothing was taken off, nothing is noted.
    let mut black_free = codes.clone();
    black_free.header.metadata.set_black_adu(Some(0.0.into()));
    let rgb = through(&black_free, &Demosaic::new(&black_free.header, Method::Malvar, Black::Auto, None).unwrap());
    let again = Mosaic::new(&rgb.header, None).unwrap();
    assert_eq!(again.header().metadata.correction, None);
}

/// Darks are those of the same sensor, without light, as far as metadata tell; where they do not, a warning says so.
#[test]
fn darks_of_other_sensors_or_lit_scenes_are_refused() {
    let taken = |electrons: f64, sensor_seed: u64| {
        let mut light = header(QuantityKind::ExpectedElectrons, Geometry::new(8, 6, &["R", "G", "B"]));
        light.metadata.scene = Some(Scene::uniform("test", [electrons; 3]));
        let noise = NoiseSettings { sensor_seed, ..NoiseSettings::default() };
        let noisy = AddNoise::new(&light, &noise).unwrap();
        Digitize::new(noisy.header(), &AdcSettings::default()).unwrap().header().clone()
    };
    let corrected = |frame: &FrameHeader, dark: &FrameHeader| {
        let stack = DarkStack::of([dark]).unwrap();
        CorrectFrame::new(frame, &CorrectionSettings { black: Black::None, cte: None }, stack.as_ref())
    };
    let frame = taken(100.0, 1);
    assert!(corrected(&frame, &taken(0.0, 1)).unwrap().warnings().is_empty());
    refused(corrected(&frame, &taken(0.0, 2)), "its sensor seed is 2, but that of test is 1");
    refused(corrected(&frame, &taken(50.0, 1)), "its scene, `test`, was lit");
    let mut other = taken(0.0, 1);
    other.metadata.sensor.as_mut().unwrap().name = "other".into();
    refused(corrected(&frame, &other), "its sensor is other, but that of test is kaf-5101ce");
    let mut coarse = taken(0.0, 1);
    coarse.metadata.white_level_adu = Some(1023.0.into());
    refused(corrected(&frame, &coarse), "its white level is 1023 ADU, but that of test is 4095 ADU");
    // As files of cameras tell it.
    let set = |camera: &str, iso_speed: f64, mut header: FrameHeader| {
        (header.metadata.camera, header.metadata.iso_speed) = (Some(camera.into()), Some(iso_speed));
        header
    };
    let [frame_a, dark_a] = [taken(100.0, 1), taken(0.0, 1)].map(|header| set("A", 100.0, header));
    assert!(corrected(&frame_a, &dark_a).unwrap().warnings().is_empty());
    refused(corrected(&frame_a, &set("B", 100.0, dark_a.clone())), "its camera is B, but that of test is A");
    refused(corrected(&frame_a, &set("A", 400.0, dark_a)), "its sensitivity is ISO 400, but that of test is ISO 100");
    let with = |settings: CameraSettings, mut header: FrameHeader| {
        header.metadata.camera_settings = Some(settings);
        header
    };
    let set = |gain: f64| CameraSettings { gain: Some(gain), ..CameraSettings::default() };
    let settings = CameraSettings { e_per_adu: Some(0.8), offset: Some(21.0), readout_mode: None, ..set(139.0) };
    let [frame_s, dark_s] = [taken(100.0, 1), taken(0.0, 1)].map(|header| with(settings.clone(), header));
    assert!(corrected(&frame_s, &dark_s).unwrap().warnings().is_empty());
    // What one of them alone tells is no difference.
    assert!(corrected(&frame_s, &with(set(139.0), taken(0.0, 1))).is_ok());
    for (other, said) in [
        (set(0.0), "its gain in units of the camera is 0, but that of test is 139"),
        (
            CameraSettings { e_per_adu: Some(3.0), ..settings.clone() },
            "its gain in e-/ADU is 3, but that of test is 0.8",
        ),
        (
            CameraSettings { offset: Some(8.0), ..settings },
            "its offset in units of the camera is 8, but that of test is 21",
        ),
    ] {
        refused(corrected(&frame_s, &with(other, taken(0.0, 1))), said);
    }
    for unsaid in [|m: &mut Metadata| m.scene = None, |m: &mut Metadata| (m.noise, m.scene) = (None, None)] {
        let mut silent = taken(0.0, 1);
        unsaid(&mut silent.metadata);
        let made = corrected(&frame, &silent).unwrap();
        let [warning] = made.warnings() else { panic!("{:?}", made.warnings()) };
        assert!(warning.contains("do not tell whether it is a dark frame of the sensor that took test"), "{warning}");
    }
}

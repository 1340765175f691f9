//! Headers put together by hand; the files of other programs are those of tests/outside.

use super::header::{Header, Value};
use super::keywords;
use super::read::FitsReader;
use crate::error::Result;
use crate::formats::format::{SampleReader, SampleType};
use crate::formats::read_ahead::Pipe;
use crate::metadata::{CameraSettings, TakenAs};
use crate::units::QuantityKind;
use std::fs::File;
use std::io::{Cursor, Seek, Write};

/// A card: keyword, and value as it is written.
fn card(keyword: &str, value: &str) -> String {
    format!("{:<80}", format!("{keyword:<8}= {value}"))
}

/// Cards up to the end of a block.
fn header(cards: &[(&str, &str)]) -> Vec<u8> {
    let mut text: String = cards.iter().map(|(keyword, value)| card(keyword, value)).collect();
    text += &format!("{:<80}", "END");
    let mut bytes = text.into_bytes();
    bytes.resize(bytes.len().next_multiple_of(2880), b' ');
    bytes
}

/// A part of 16-bit integers of three columns and two rows in planes.
fn part(first: (&str, &str), axes: &[&str], more: &[(&str, &str)], samples: &[i16]) -> Vec<u8> {
    let count = axes.len().to_string();
    let keys: Vec<String> = (1..=axes.len()).map(|axis| format!("NAXIS{axis}")).collect();
    let sizes = keys.iter().map(String::as_str).zip(axes.iter().copied());
    let cards: Vec<(&str, &str)> =
        [first, ("BITPIX", "16"), ("NAXIS", &count)].into_iter().chain(sizes).chain(more.iter().copied()).collect();
    let mut bytes = header(&cards);
    bytes.extend(samples.iter().flat_map(|sample| sample.to_be_bytes()));
    bytes.resize(bytes.len().next_multiple_of(2880), 0);
    bytes
}

fn plane(more: &[(&str, &str)]) -> Vec<u8> {
    part(("SIMPLE", "T"), &["3", "2"], more, &[1, 2, 3, -4, 5, 6])
}

fn file(bytes: &[u8]) -> File {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file.rewind().unwrap();
    file
}

/// What both ways read, or of what both complain.
fn both(bytes: &[u8]) -> Result<(FitsReader, Vec<f32>)> {
    let read = |opened: Result<FitsReader>| -> Result<(FitsReader, Vec<f32>)> {
        let mut reader = opened?;
        let mut samples = Vec::new();
        for _ in 0..reader.geometry().height {
            reader.read(1, &mut samples)?;
        }
        Ok((reader, samples))
    };
    let streamed = read(FitsReader::stream(Pipe::of(Cursor::new(bytes.to_vec())), "in.fits"));
    let placed = read(FitsReader::open(file(bytes), "in.fits", 0));
    match (placed, streamed) {
        (Ok(placed), Ok(streamed)) => {
            assert_eq!(placed.0.geometry(), streamed.0.geometry());
            assert_eq!(placed.0.notes(), streamed.0.notes());
            let bits = |samples: &[f32]| samples.iter().map(|sample| sample.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&placed.1), bits(&streamed.1));
            Ok(placed)
        }
        (Err(placed), Err(streamed)) => {
            assert_eq!(placed.to_string(), streamed.to_string());
            Err(placed)
        }
        (Ok(_), Err(error)) | (Err(error), Ok(_)) => panic!("one way alone complains: {error}"),
    }
}

fn complaint(bytes: &[u8]) -> String {
    both(bytes).map(drop).unwrap_err().to_string()
}

#[test]
fn rows_come_from_the_top() {
    let (reader, samples) = both(&plane(&[("ROWORDER", "'TOP-DOWN'")])).unwrap();
    assert_eq!(reader.geometry().channels, ["Y"]);
    assert_eq!((samples, reader.notes()), (vec![1.0, 2.0, 3.0, -4.0, 5.0, 6.0], &[][..]));
    let (reader, samples) = both(&plane(&[("ROWORDER", "'BOTTOM-UP'")])).unwrap();
    assert_eq!((samples, reader.notes()), (vec![-4.0, 5.0, 6.0, 1.0, 2.0, 3.0], &[][..]));
    let (reader, samples) = both(&plane(&[])).unwrap();
    assert_eq!(samples[0], 1.0);
    assert_eq!(reader.notes(), ["it has no ROWORDER; its first row is taken as the top one"]);
    let order = |order: &str| {
        let told = keywords::read(&Header::of(&[("ROWORDER", text(order))]), 1, true);
        (told.is_bottom_up, told.doubts.len())
    };
    assert_eq!(
        [order("bottom up"), order("BOTTOM_UP"), order("TopDown"), order("LEFT")],
        [(true, 0), (true, 0), (false, 0), (false, 1)]
    );
}

#[test]
fn planes_are_channels() {
    let samples: Vec<i16> = (0..18).collect();
    let top_down = [("ROWORDER", "'TOP-DOWN'")];
    let (reader, read) = both(&part(("SIMPLE", "T"), &["3", "2", "3"], &top_down, &samples)).unwrap();
    assert_eq!(reader.geometry().channels, ["R", "G", "B"]);
    let wanted: [u8; 18] = [0, 1, 2, 6, 7, 8, 12, 13, 14, 3, 4, 5, 9, 10, 11, 15, 16, 17];
    assert_eq!(read, wanted.map(f32::from));
    let (reader, _) = both(&part(("SIMPLE", "T"), &["3", "2", "2", "1"], &top_down, &samples)).unwrap();
    assert_eq!(reader.geometry().channels, ["C0", "C1"]);
    assert_eq!(
        complaint(&part(("SIMPLE", "T"), &["3", "1", "2", "3"], &top_down, &samples)),
        "in.fits: its array of 3x1x2x3 is no image of up to 65535 planes"
    );
}

#[test]
fn values_are_those_of_the_standard() {
    let (reader, samples) = both(&plane(&[("BZERO", "32768.0"), ("BSCALE", "1.0D0")])).unwrap();
    assert_eq!(reader.stored_as().unwrap().name(), "u16");
    assert_eq!(samples, [32769.0, 32770.0, 32771.0, 32764.0, 32773.0, 32774.0]);
    let (reader, samples) = both(&plane(&[("BZERO", "100"), ("BSCALE", ".5"), ("BLANK", "-4")])).unwrap();
    assert_eq!(samples[..3], [100.5, 101.0, 101.5]);
    assert!(samples[3].is_nan());
    assert_eq!(
        reader.notes()[1..],
        [
            "its samples are 100 + 0.5 times what is stored (BZERO, BSCALE)",
            "samples stored as -4 (BLANK) are undefined: they are NaN"
        ]
    );
    let of = |bitpix: &str, bytes: &[u8]| {
        let axes = [("NAXIS", "2"), ("NAXIS1", "2"), ("NAXIS2", "1"), ("ROWORDER", "'TOP-DOWN'")];
        let cards: Vec<_> = [("SIMPLE", "T"), ("BITPIX", bitpix)].into_iter().chain(axes).collect();
        both(&[&header(&cards), bytes].concat()).map(|(reader, samples)| (reader.notes().concat(), samples))
    };
    assert_eq!(of("8", &[0, 255]).unwrap().1, [0.0, 255.0]);
    assert_eq!(of("32", &[0, 0, 1, 0, 255, 255, 255, 255]).unwrap().1, [256.0, -1.0]);
    let floats = [1.5_f32, f32::INFINITY].map(f32::to_be_bytes).concat();
    assert_eq!(of("-32", &floats).unwrap().1, [1.5, f32::INFINITY]);
    let doubles = |values: [f64; 2]| of("-64", &values.map(f64::to_be_bytes).concat());
    let (notes, samples) = doubles([1e-3, f64::NEG_INFINITY]).unwrap();
    assert_eq!((notes.as_str(), samples), ("its samples of 64 bits are rounded to 32", vec![1e-3, f32::NEG_INFINITY]));
    let complaint = doubles([1e40, 0.0]).unwrap_err().to_string();
    assert_eq!(complaint, "in.fits: it has samples beyond 3.4e38, the largest of single precision");
    let wide = [-7_i64, 1 << 40].map(i64::to_be_bytes).concat();
    assert_eq!(
        of("64", &wide).unwrap(),
        ("its samples of 64 bits are rounded to 32".into(), vec![-7.0, 1_099_511_627_776.0])
    );
    // Without sign: codes are what they were, beside a shift that doubles would lose them in.
    let shifted = [1757_u64, 65_535].map(|code| (code ^ 1 << 63).to_be_bytes()).concat();
    let cards = [("BITPIX", "64"), ("NAXIS", "2"), ("NAXIS1", "2"), ("NAXIS2", "1"), ("BZERO", "9223372036854775808")];
    let cards: Vec<_> = [("SIMPLE", "T")].into_iter().chain(cards).collect();
    let (reader, samples) = both(&[&header(&cards)[..], &shifted].concat()).unwrap();
    assert_eq!((reader.stored_as(), samples), (Some(SampleType::U64), vec![1757.0, 65_535.0]));
}

/// Codes of 35 216 as 16 bits with sign are -30 320; with a BZERO, and BLANK, they are what they say.
#[test]
fn codes_without_sign_are_not_stored_with_one() {
    let of = |more: &[(&str, &str)], sample: i16| part(("SIMPLE", "T"), &["3", "2"], more, &[1, 2, 3, sample, 5, 6]);
    for cards in [Vec::new(), vec![("BZERO", "0.0")]] {
        let said = complaint(&of(&cards, -30_320));
        assert!(said.starts_with("in.fits: it has a sample of -30320, as codes above 32767 have"), "{said}");
        assert!(said.ends_with("write them without sign, which in FITS is BZERO = 32768"), "{said}");
        assert_eq!(both(&of(&cards, -16_384)).unwrap().1[3], -16_384.0);
    }
    assert_eq!(both(&of(&[("BZERO", "32768")], -30_320)).unwrap().1[3], 2448.0);
    assert_eq!(both(&of(&[("BZERO", "1")], -30_320)).unwrap().1[3], -30_319.0);
    assert!(both(&of(&[("BLANK", "-32768")], i16::MIN)).unwrap().1[3].is_nan());
}

#[test]
fn parts_are_chosen() {
    let empty = || part(("SIMPLE", "T"), &[], &[], &[]);
    let image = || part(("XTENSION", "'IMAGE   '"), &["3", "2"], &[("PCOUNT", "0"), ("GCOUNT", "1")], &[7; 6]);
    let tiles = part(("XTENSION", "'BINTABLE'"), &["3", "2"], &[("ZIMAGE", "T")], &[7; 6]);
    let table = part(("XTENSION", "'BINTABLE'"), &["3", "2"], &[("PCOUNT", "3000")], &[7; 3006]);
    let of = |parts: &[Vec<u8>], number: usize| {
        let mut reader = FitsReader::open(file(&parts.concat()), "in.fits", number)?;
        let mut samples = Vec::new();
        reader.read(2, &mut samples)?;
        Ok::<_, crate::error::Error>(samples)
    };
    let said = |parts: &[Vec<u8>], number: usize| of(parts, number).unwrap_err().to_string();
    let parts = [empty(), table.clone(), image()];
    assert_eq!(of(&parts, 2).unwrap(), [7.0; 6]);
    assert_eq!(said(&parts, 0), "in.fits: its part 0 holds no image, but part 2 does; give `part`");
    assert_eq!(said(&parts, 1), "in.fits: its part 1 is a BINTABLE, not an image, but part 2 does; give `part`");
    assert_eq!(said(&parts, 3), "in.fits: there is no part 3; its last one is 2");
    assert_eq!(
        complaint(&[empty(), image()].concat()),
        "in.fits: its part 0 holds no image, but part 1 does; give `part`"
    );
    let unpack = "unpack it first, for example with `funpack`";
    assert_eq!(
        complaint(&[empty(), tiles.clone()].concat()),
        format!("in.fits: its part 0 holds no image, and part 1 one in compressed tiles (ZIMAGE); {unpack}")
    );
    assert_eq!(
        said(&[empty(), tiles], 1),
        format!("in.fits: its part 1 is an image in compressed tiles (ZIMAGE); {unpack}")
    );
    assert_eq!(complaint(&empty()), "in.fits: its part 0 holds no image");
}

/// What the primary header tells counts for an extension that says so, and is warned of where it does not.
#[test]
fn keywords_of_the_primary_header_are_inherited() {
    let opened = |primary: Vec<u8>, more: &[(&str, &str)]| {
        let image = part(("XTENSION", "'IMAGE   '"), &["3", "2"], more, &[1, 2, 3, 4, 5, 6]);
        let mut reader = FitsReader::open(file(&[primary, image].concat()), "in.fits", 1).unwrap();
        let mut samples = Vec::new();
        reader.read(2, &mut samples).unwrap();
        (reader, samples)
    };
    let told = [
        ("ROWORDER", "'BOTTOM-UP'"),
        ("EXPTIME", "500.0 / [ms]"),
        ("IMAGETYP", "'DARK'"),
        ("BUNIT", "'adu'"),
        ("BZERO", "7"),
        ("INSTRUME", "'one'"),
    ];
    let empty = || part(("SIMPLE", "T"), &[], &told, &[]);
    let (reader, samples) = opened(empty(), &[("INHERIT", "T"), ("BAYERPAT", "'RGGB'"), ("INSTRUME", "'other'")]);
    // The structure of the primary array is its own.
    assert_eq!(samples, [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
    let metadata = reader.own_tags();
    assert_eq!((metadata.exposure_time_s, metadata.camera.as_deref()), (Some(0.5), Some("other")));
    assert_eq!((metadata.taken_as, metadata.quantity), (Some(TakenAs::Dark), QuantityKind::Adu));
    let with_array = part(("SIMPLE", "T"), &["3", "2"], &told, &[7; 6]);
    assert_eq!(opened(with_array, &[("INHERIT", "T")]).0.own_tags().quantity, QuantityKind::Unspecified);
    for inherit in [&[][..], &[("INHERIT", "F")]] {
        let (reader, samples) = opened(empty(), inherit);
        assert_eq!((samples[0], reader.own_tags().exposure_time_s), (1.0, None));
    }
    let header = |cards: &[(&str, Value)]| Header::of(cards);
    let doubts = |extension: &[(&str, Value)], primary: &[(&str, Value)]| {
        let mut extension = header(extension);
        extension.inherit(&header(primary));
        keywords::read(&extension, 1, true).doubts.concat()
    };
    let primary = [("NAXIS", Value::Number(0.0)), ("EXPTIME", Value::Number(3.0)), ("GAIN", Value::Number(100.0))];
    let lost = doubts(&[], &primary);
    assert!(lost.starts_with("its primary header has EXPTIME, GAIN, and this part neither has them"), "{lost}");
    let inherit = ("INHERIT", Value::Logical(true));
    assert_eq!(doubts(&[inherit], &primary), "");
    // Another keyword tells the time.
    assert_eq!(doubts(&[("EXPOSURE", Value::Number(2.0)), ("GAIN", Value::Number(1.0))], &primary), "");
}

/// A unit between brackets at the start of a comment is that of the number \[FITS4, Sec. 4.3.2]; another word is a doubt.
#[test]
fn comments_name_units() {
    let told = |cards: &[(&str, &str)]| {
        let cards = [&[("SIMPLE", "T")], cards].concat();
        let header = Header::read(&mut Cursor::new(header(&cards)), "in.fits").unwrap().unwrap();
        keywords::read(&header, 1, true)
    };
    let time = |value: &str| {
        let told = told(&[("EXPTIME", value)]);
        (told.metadata.exposure_time_s.unwrap(), told.doubts.concat())
    };
    for (value, time_s) in [
        ("33000.0 / [us] integration", 0.033),
        ("33 / [ms]", 0.033),
        ("2.0 / [min] exposure", 120.0),
        ("'1.5' / [Sec.] as text", 1.5),
        ("3 / [s] not in ms", 3.0),
        ("3 / exposure in seconds, to the ms", 3.0),
        ("3 / the camera's exposure", 3.0),
        ("3 / [INDI] exposure", 3.0),
        ("0 / microseconds", 0.0),
    ] {
        assert_eq!(time(value), (time_s, String::new()), "{value}");
    }
    for (value, wanted) in [
        (
            "33000 / microseconds",
            "its EXPTIME of 33000 counts as s, as is the rule, and its comment tells us; 33000 us is 0.033 s",
        ),
        ("33 / in ms", "33 ms is 0.033 s, which a comment that begins with [ms] says"),
        ("2.0 / minutes", "2 min is 120 s"),
    ] {
        let (time_s, doubt) = time(value);
        assert!(doubt.contains(wanted) && time_s > 1.0, "{value}: {doubt}");
    }
    assert_eq!(told(&[("EXPOINUS", "500 / microseconds")]).metadata.exposure_time_s, Some(5e-4));
    let kelvin = |value: &str| told(&[("CCD-TEMP", value)]).metadata.sensor_temperature_k;
    let values = ["90.0 / [K]", "-10 / [C] of the sensor", "-10 / CCD temperature", "14.0 / [degF]", "263.15"];
    assert_eq!(values.map(kelvin), [Some(90.0), Some(263.15), Some(263.15), Some(263.15), None]);
    assert!(told(&[("CCD-TEMP", "90 / in Kelvin")]).doubts[0].contains("its comment tells K"));
    let lens = told(&[("EXPTIME", "1.0"), ("FOCALLEN", "40 / [cm]"), ("APTDIA", "100 / in mm")]);
    assert_eq!((lens.metadata.exposure.unwrap().f_number, lens.doubts.len()), (4.0, 0));
}

#[test]
fn damage_is_told() {
    let whole = plane(&[("ROWORDER", "'TOP-DOWN'")]);
    let cut_short = "in.fits: the file ends before its last row; it was cut short";
    assert_eq!(complaint(&whole[..2880 + 11]), cut_short);
    assert_eq!(complaint(&whole[..2880]), cut_short);
    assert_eq!(complaint(&whole[..300]), "in.fits: the file ends within a header; it was cut short");
    // What fills the last block may be missing.
    assert!(both(&whole[..2880 + 12]).is_ok());
    let with = |key: &str, value: &str| {
        let mut cards =
            vec![("SIMPLE", "T"), ("BITPIX", "16"), ("NAXIS", "2"), ("NAXIS1", "3"), ("NAXIS2", "2"), ("GROUPS", "F")];
        cards.iter_mut().filter(|(name, _)| *name == key).for_each(|(_, old)| *old = value);
        complaint(&[header(&cards), vec![0; 2880]].concat())
    };
    for (key, value, wanted) in [
        ("SIMPLE", "F", "it says itself that it departs from the standard (SIMPLE is not T)"),
        ("BITPIX", "12", "it is damaged: its header has no valid BITPIX"),
        ("BITPIX", "16.5", "it is damaged: its header has no valid BITPIX"),
        ("NAXIS", "1000", "it is damaged: its header has no valid NAXIS"),
        ("NAXIS", "3", "it is damaged: its header has no valid NAXIS3"),
        ("NAXIS1", "-3", "it is damaged: its header has no valid NAXIS1"),
        ("NAXIS1", "4e15", "it is damaged: its header declares a size beyond any"),
        ("NAXIS1", "'x'", "it is damaged: its header has no valid NAXIS1"),
        ("NAXIS2", "0", "its part 0 holds no image"),
        ("GROUPS", "T", "it holds random groups, not an image"),
    ] {
        assert_eq!(with(key, value), format!("in.fits: {wanted}"), "{key} = {value}");
    }
    let mut no_text = whole.clone();
    no_text[100] = 0xFF;
    assert_eq!(complaint(&no_text), "in.fits: it is damaged: its header is no text");
    let endless = [&whole[..80], &[b' '; 2800]].concat();
    assert_eq!(complaint(&endless), "in.fits: the file ends within a header; it was cut short");
    // A row that is declared and not there takes no memory.
    let wide =
        [header(&[("SIMPLE", "T"), ("BITPIX", "-64"), ("NAXIS", "2"), ("NAXIS1", "2147483647"), ("NAXIS2", "9")])];
    assert_eq!(complaint(&wide.concat()), cut_short);
}

fn text(value: &str) -> Value {
    Value::Text(value.into())
}

#[test]
fn patterns_are_those_of_the_picture() {
    let of = |letters: &str, x: f64, y: f64| {
        let cards = [("BAYERPAT", text(letters)), ("XBAYROFF", Value::Number(x)), ("YBAYROFF", Value::Number(y))];
        let told = keywords::read(&Header::of(&cards), 1, true);
        assert_eq!(
            told.metadata.quantity,
            if told.metadata.cfa.is_some() { QuantityKind::Adu } else { Default::default() }
        );
        told.metadata.cfa.map(|array| array.to_string())
    };
    assert_eq!(of("RGGB", 0.0, 0.0).unwrap(), "rggb");
    assert_eq!(of("rggb ", 1.0, 0.0).unwrap(), "grbg");
    assert_eq!(of("RGGB", 0.0, 1.0).unwrap(), "gbrg");
    assert_eq!(of("RGGB", 1.0, -1.0).unwrap(), "bggr");
    let x_trans = "GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG";
    assert_eq!(of(x_trans, 0.0, 0.0).unwrap(), format!("6x6:{x_trans}"));
    for unknown in ["TRUE", "RGGX", "RGB", "MONO", "RGG"] {
        assert_eq!(of(unknown, 0.0, 0.0), None);
    }
    assert_eq!(of("RGGB", 0.5, 0.0), None);
    let told = keywords::read(&Header::of(&[("COLORTYP", text("GRBG"))]), 3, true);
    assert_eq!(told.metadata.cfa, None);
    assert!(told.notes[1].contains("it has 3 planes, not one"));
    let binned = [("BAYERPAT", text("RGGB")), ("XBINNING", Value::Number(2.0))];
    assert!(keywords::read(&Header::of(&binned), 1, true).notes[1].contains("were binned"));
}

#[test]
fn lenses_in_meters_are_told() {
    let number = Value::Number;
    // In m they are no mm, and of no lens.
    let cards = |length: f64, diameter: f64| {
        let cards = [("EXPTIME", number(0.5)), ("FOCALLEN", number(length)), ("APTDIA", number(diameter))];
        keywords::read(&Header::of(&cards), 1, true)
    };
    let (meters, millimeters) = (cards(0.4, 100.0), cards(400.0, 100.0));
    assert_eq!((meters.metadata.exposure, meters.metadata.exposure_time_s), (None, Some(0.5)));
    let wanted = "make an f-number of 0.00400, which no lens has: FOCALLEN looks like m, with which it is 4.00; they do not count";
    assert!(meters.doubts[0].contains(wanted), "{:?}", meters.doubts);
    assert!(cards(400.0, 0.1).doubts[0].contains("APTDIA looks like m"));
    assert!(millimeters.doubts.is_empty() && cards(0.4, 0.1).metadata.exposure == millimeters.metadata.exposure);
}

#[test]
fn keywords_of_the_camera_are_used_or_told() {
    let number = Value::Number;
    let told = |cards: &[(&str, Value)]| {
        let told = keywords::read(&Header::of(&[cards, &[("ROWORDER", text("TOP-DOWN"))]].concat()), 1, true);
        (told.metadata, told.notes.join("; "))
    };
    let lens = [("FOCALLEN", number(400.0)), ("APTDIA", number(100.0))];
    for time in [("EXPTIME", number(0.5)), ("EXPOSURE", number(0.5)), ("EXPOINUS", number(5e5))] {
        let (metadata, notes) = told(&[&lens[..], &[time]].concat());
        let exposure = metadata.exposure.unwrap();
        assert_eq!((exposure.exposure_s, exposure.f_number, exposure.lens_transmittance), (0.5, 4.0, 1.0));
        assert_eq!(notes, "");
    }
    let (metadata, notes) = told(&[("EXPTIME", text("2.5"))]);
    assert_eq!(metadata.exposure, None);
    assert!(notes.starts_with("its exposure time of 2.5 s tells dark frames apart and no more: it has no f-number"));
    assert!(told(&lens).1.starts_with("its f-number of 4 is passed over: it has no exposure time"));
    // Flats and darks need no f-number.
    let seconds = |value: f64| told(&[("EXPTIME", number(value))]).0.exposure_time_s;
    assert_eq!([2.5, 0.0, -1.0].map(seconds), [Some(2.5), Some(0.0), None]);
    let notes = told(&[("EXPTIME", number(-1.0))]).1;
    assert_eq!(notes, "its exposure time of -1 s (EXPTIME) is passed over: there is none");
    let (metadata, notes) = told(&[("EXPTIME", number(0.0)), ("FOCRATIO", number(4.0))]);
    assert_eq!(metadata.exposure, None);
    assert!(notes.starts_with("its exposure is passed over: an exposure of 0 s is impossible"));
    let (metadata, notes) = told(&[
        ("INSTRUME", text("ASI533MC")),
        ("CCD-TEMP", number(-10.0)),
        ("EGAIN", number(0.5)),
        ("GAIN", number(100.0)),
        ("PEDESTAL", number(-100.0)),
    ]);
    assert_eq!((metadata.black_level_adu, metadata.quantity), (None, QuantityKind::Unspecified));
    assert_eq!(metadata.sensor_temperature_k, Some(263.15));
    assert_eq!(metadata.camera.as_deref(), Some("ASI533MC"));
    let settings = CameraSettings { gain: Some(100.0), e_per_adu: Some(0.5), ..CameraSettings::default() };
    assert_eq!(metadata.camera_settings, Some(settings));
    let (metadata, _) = told(&[("OFFSET", number(21.0)), ("READOUTM", text("High Gain Mode"))]);
    let readout_mode = Some("High Gain Mode".to_owned());
    let settings = CameraSettings { offset: Some(21.0), readout_mode, ..CameraSettings::default() };
    assert_eq!(metadata.camera_settings, Some(settings));
    assert_eq!(told(&[("EGAIN", number(-1.0))]).0.camera_settings, None);
    assert_eq!(told(&[("CCD-TEMP", number(-999.0))]).0.sensor_temperature_k, None);
    assert_eq!(
        notes,
        "its header tells how the camera was set, which no number hangs on here, but frames of other settings are told by: 0.5 e-/ADU (EGAIN), which is an `adu_per_e` of 2, GAIN 100 in units of the camera; its PEDESTAL of -100 is not taken as the \
         black level: programs disagree on its sign and scale"
    );
    assert_eq!(told(&[("BUNIT", text("ADU"))]).0.quantity, QuantityKind::Adu);
    assert_eq!(told(&[("BUNIT", text("electron")), ("BAYERPAT", text("RGGB"))]).0.quantity, QuantityKind::Electrons);
    let quantity = |unit: &str| told(&[("BUNIT", text(unit))]).0.quantity;
    for (unit, wanted) in [
        ("DN", QuantityKind::Adu),
        ("counts", QuantityKind::Adu),
        ("analog-to-digital units", QuantityKind::Adu),
        ("adu/pixel", QuantityKind::Adu),
        ("E-", QuantityKind::Electrons),
        ("electron pix-1", QuantityKind::Electrons),
        ("adu/s", QuantityKind::Unspecified),
        ("electron/s", QuantityKind::Unspecified),
        ("photon", QuantityKind::Unspecified),
    ] {
        assert_eq!(quantity(unit), wanted, "{unit}");
    }
    let (metadata, _) = told(&[("BUNIT", text("MJy/sr")), ("BAYERPAT", text("RGGB"))]);
    assert_eq!((metadata.quantity, metadata.unit.as_str()), (QuantityKind::Unspecified, "MJy/sr"));
}

/// Filters by their names, and the white level of codes alone.
#[test]
fn filters_and_saturation_are_told() {
    let told = |cards: &[(&str, Value)]| keywords::read(&Header::of(cards), 1, true).metadata;
    let saturate =
        |unit: &str, level: f64| told(&[("BUNIT", text(unit)), ("SATURATE", Value::Number(level))]).white_level_adu;
    assert_eq!(saturate("ADU", 65_000.0), Some(65_000.0.into()));
    assert_eq!([saturate("ADU", 0.0), saturate("electron", 65_000.0)], [None; 2]);
    let filter = |name: &str| told(&[("FILTER", text(name))]).camera_settings.and_then(|settings| settings.filter);
    assert_eq!([filter("Ha"), filter("  ")], [Some("Ha".to_owned()), None]);
}

#[test]
fn values_of_cards() {
    let cards = header(&[
        ("SIMPLE", "                   T / conforms"),
        ("INSTRUME", "'O''Brien / Sons  ' / a camera"),
        ("EXPTIME", "1.5D-3/s"),
        ("GAIN", "(1, 2)"),
        ("EGAIN", ""),
        ("BAYERPAT", "'RGGB"),
        ("GAIN", "3"),
    ]);
    let header = Header::read(&mut Cursor::new(cards), "in.fits").unwrap().unwrap();
    assert!(header.is_true("SIMPLE"));
    assert_eq!(header.text("INSTRUME"), Some("O'Brien / Sons"));
    assert_eq!(header.number("EXPTIME"), Some(1.5e-3));
    // The first of two counts, though it is of no use.
    assert_eq!((header.number("GAIN"), header.number("EGAIN"), header.text("BAYERPAT")), (None, None, None));
}

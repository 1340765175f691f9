//! What `preview` shows, looked at pixel by pixel.

use crate::support;
use cyanometer::color::ramp::ramp;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::formats::picture::{PictureSettings, Range, thumbnail};
use cyanometer::units::QuantityKind;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

/// A picture that `preview` made.
struct Picture {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    fn read(shop: &Workshop, name: &str) -> Self {
        let picture = image::load_from_memory(&shop.bytes(name)).expect("preview writes pictures").into_rgb8();
        Self { width: picture.width() as usize, pixels: picture.into_raw().as_chunks::<3>().0.to_vec() }
    }

    fn height(&self) -> usize {
        self.pixels.len() / self.width
    }
}

/// One row of 256 numbers: each is a color of its own, the lowest the first of the ramp.
#[test]
fn false_colors_run_along_the_ramp_from_the_lowest_number_to_the_highest() {
    let shop = Workshop::new();
    let row: Vec<u8> = (0..=255_u16).flat_map(|code| (1000 + 2 * code).to_le_bytes()).collect();
    std::fs::write(shop.path("row.bin"), &row).unwrap();
    shop.run("preview --raw 256x1:u16le row.bin --false-color -o whole.png", &[]);
    shop.run("preview --raw 256x1:u16le row.bin --false-color --range 1000,1254 -o low.png", &[]);
    shop.run("preview --raw 256x1:u16le row.bin --false-color --range 20%,80% -o middle.png", &[]);
    let ramp = ramp();
    let line = |name: &str| {
        let picture = Picture::read(&shop, name);
        // Below a line of words: the corner is that of the picture.
        let corner = picture.width * (12 + 25) + 12;
        picture.pixels[corner..corner + 256].to_vec()
    };
    assert_eq!(line("whole.png"), ramp);
    // 1254 is the 127th of the numbers: places are 255/127 apart.
    let low = line("low.png");
    assert!(low[127..].iter().all(|color| *color == ramp[255]) && low[0] == ramp[0] && low[64] == ramp[129]);
    // Ranks 51 and 204 of 0 to 255.
    let middle = line("middle.png");
    assert!(
        middle[..=51].iter().all(|color| *color == ramp[0]) && middle[204..].iter().all(|color| *color == ramp[255])
    );
    // (1256 − 1102)/306 · 255 = 128.3
    assert_eq!(middle[128], ramp[128]);
}

/// Squares of a filter array are whole periods, so that a uniform scene makes one gray, that of the mean of its photosites.
#[test]
fn fitted_pictures_are_exact_means() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 3000,9000,15000 --size 160x104 -o three.exr", &[]);
    shop.run("mosaic three.exr -o plane.exr", &[]);
    shop.run("preview plane.exr --fit 60 --range 0,18000 -o plane.png", &[]);
    let picture = Picture::read(&shop, "plane.png");
    assert_eq!((picture.width, picture.height()), (40, 26));
    // Half of the range in linear light is code 188 of sRGB: 255 (1.055 · 0.5^(1/2.4) − 0.055) = 187.5.
    assert!(picture.pixels.iter().all(|pixel| *pixel == [188; 3]), "{:?}", picture.pixels[0]);
    shop.run("preview three.exr --fit 60 --range 0,18000 -o three.png", &[]);
    let picture = Picture::read(&shop, "three.png");
    assert_eq!((picture.width, picture.height()), (54, 35));
    assert!(picture.pixels.iter().all(|pixel| pixel[0] < pixel[1] && pixel[1] == 188 && pixel[1] < pixel[2]));
}

/// Of a map the first quantity is what one looks for.
#[test]
fn maps_are_shown_in_false_color_without_a_word() {
    let shop = Workshop::with_frames();
    shop.run("render-radiance --electrons 8000,12000,9500 --size 8x6 -o lit.exr", &[]);
    for (seed, name) in [(1, "a"), (2, "b")] {
        shop.run(&format!("add-noise lit.exr --seed {seed} -o n.exr"), &[]);
        for stage in ["digitize n.exr -o c.exr", "mosaic c.exr -o p.exr", "demosaic p.exr -o d.exr"] {
            shop.run(stage, &[]);
        }
        shop.run(&format!("to-xyz d.exr --matrix matrix.yaml -o {name}.exr"), &[]);
    }
    shop.run("to-xyz d.exr --matrix matrix.yaml --space cct -o cct.exr", &[]);
    shop.run("color-difference a.exr b.exr --map map.exr", &[]);
    for (map, plane) in [("map", "delta_e_2000"), ("cct", "CCT")] {
        shop.run(&format!("preview {map}.exr -o short.png"), &[]);
        shop.run(&format!("preview {map}.exr --plane {plane} --false-color -o long.png"), &[]);
        assert_eq!(shop.bytes("short.png"), shop.bytes("long.png"));
    }
}

#[test]
fn planes_that_are_not_there_are_told() {
    let shop = Workshop::with_frames();
    for (line, status, said) in [
        ("preview xyz.exr --plane Q -o a.png", BAD_USAGE, "xyz.exr: there is no plane `Q`; it has X, Y, Z"),
        ("preview plane.exr --plane C -o a.png", BAD_USAGE, "plane.exr: there is no plane `C`; it has Y, R, G, B"),
        (
            "preview rgb.exr --false-color -o a.png",
            BAD_USAGE,
            "one of its 3 planes, R, G, B; say which, as with --plane R",
        ),
        ("preview xyz.exr --plane Y -o a.png", BAD_DATA, "give --range LOW,HIGH, or --false-color"),
        ("preview rgb.exr --range 9%,1% -o a.png", BAD_USAGE, "the lower share stands first"),
        ("preview rgb.exr --fit 4 -o a.png", BAD_USAGE, "--fit"),
        ("preview rgb.exr --fit 40 --zoom 2 -o a.png", BAD_USAGE, "--zoom"),
    ] {
        let output = shop.attempt(line, &[]);
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(status) && complaint.contains(said), "{line}: {complaint}");
    }
    shop.run("preview xyz.exr --plane Y --range 0,100 -o gray.png", &[]);
    assert_eq!((Picture::read(&shop, "gray.png").width, Picture::read(&shop, "gray.png").height()), (8, 6));
}

/// A few numbers far off do not take the colors from all others, and are told; an even spread has all its numbers.
#[test]
fn false_colors_leave_numbers_far_off_to_the_ends() {
    let shop = Workshop::new();
    let ramp = ramp();
    let mut numbers: Vec<f32> = (0..512_u16).map(f32::from).collect();
    let picture = |numbers: &[f32]| {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        std::fs::write(shop.path("row.bin"), bytes).unwrap();
        shop.run("preview --raw 512x1:f32le row.bin --false-color -o row.png", &[]);
        let picture = Picture::read(&shop, "row.png");
        let corner = picture.width * (12 + 25) + 12;
        (picture.height(), picture.pixels[corner..corner + 512].to_vec())
    };
    let (height, all) = picture(&numbers);
    assert_eq!((all[0], all[511], all[256]), (ramp[0], ramp[255], ramp[128]));
    numbers[7] = 1e6;
    let (taller, others) = picture(&numbers);
    // Ranks 2.555 and 508.445 of 511, where 7 has gone to the end: (257 − 2.555)/(509.445 − 2.555) · 255 = 128.0.
    assert_eq!((others[7], others[257]), (ramp[255], ramp[128]));
    assert!(others.windows(2).filter(|pair| pair[0] != pair[1]).count() > 200);
    // A line below the picture says so.
    assert_eq!(taller, height + 17);
}

/// One stretch for all planes: colors stay those of the light, of planes and of XYZ, which is not shown plane by plane.
#[test]
fn a_stretch_keeps_colors() {
    let shop = Workshop::with_frames();
    shop.run("render-radiance --electrons 9000,9000,3000 --size 40x30 -o planes.exr", &[]);
    shop.run("preview planes.exr --range 0%,100% -o planes.png", &[]);
    let pixel = Picture::read(&shop, "planes.png").pixels[0];
    assert_eq!(pixel, [255, 255, 0], "white is the most of all planes, black the least");
    // White light of D65 at four luminances, in a column, is gray from black to white.
    let light = |luminance: f32| [0.950_46, 1.0, 1.089_06].map(|part| part * luminance);
    shop.write_colors("light.exr", QuantityKind::Xyz, &[0.0, 10.0, 30.0, 40.0].map(light));
    let shown = |range: &str| {
        shop.run(&format!("preview light.exr --range {range} -o light.png"), &[]);
        let pixels = Picture::read(&shop, "light.png").pixels;
        // The four decimals of the matrix of sRGB are a code at most.
        assert!(
            pixels.iter().all(|[red, green, blue]| red.abs_diff(*green) < 2 && blue.abs_diff(*green) < 2),
            "{pixels:?}"
        );
        pixels.iter().map(|pixel| pixel[1]).collect::<Vec<u8>>()
    };
    // A quarter and three quarters of white are codes 137 and 225.
    assert_eq!(shown("0,40"), [0, 137, 225, 255]);
    assert_eq!(shown("0%,100%"), [0, 137, 225, 255]);
    // 20 of 30 is code 213.
    assert_eq!(shown("10,40"), [0, 0, 213, 255]);
}

/// What is no number has a color that no number has, and the scale names it.
#[test]
fn what_is_not_finite_is_seen() {
    let shop = Workshop::new();
    let row: Vec<u8> = [1.0_f32, f32::NAN, 3.0, f32::INFINITY].iter().flat_map(|sample| sample.to_le_bytes()).collect();
    std::fs::write(shop.path("row.bin"), &row).unwrap();
    shop.run("preview --raw 4x1:f32le row.bin --false-color -o a.png", &[]);
    let picture = Picture::read(&shop, "a.png");
    let corner = picture.width * (12 + 25) + 12;
    let ramp = ramp();
    assert_eq!(picture.pixels[corner..corner + 4], [ramp[0], [0xcc, 0x79, 0xa7], ramp[255], [0xcc, 0x79, 0xa7]]);
    std::fs::write(shop.path("none.bin"), f32::NAN.to_le_bytes()).unwrap();
    let output = shop.attempt("preview --raw 1x1:f32le none.bin --false-color -o a.png", &[]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("there is nothing to show"));
    // A constant has a scale, too.
    std::fs::write(shop.path("one.bin"), 7.0_f32.to_le_bytes()).unwrap();
    shop.run("preview --raw 1x1:f32le one.bin --false-color -o a.png", &[]);
}

/// A frame that makes no picture, or no range, does not take the others of a sheet with it; alone it is told what would show.
#[test]
fn a_sheet_shows_every_frame() {
    let shop = Workshop::with_frames();
    for (name, sample) in [("zero", 0.0_f32), ("none", f32::NAN)] {
        let bytes: Vec<u8> = (0..20 * 10).flat_map(|_| sample.to_le_bytes()).collect();
        std::fs::write(shop.path(&format!("{name}.bin")), bytes).unwrap();
    }
    let raw = "preview --raw 20x10:f32le";
    shop.run(&format!("{raw} --columns 2 zero.bin none.bin -o sheet.png"), &[]);
    let pixels = Picture::read(&shop, "sheet.png").pixels;
    for color in [[0x80; 3], [0xcc, 0x79, 0xa7]] {
        assert!(pixels.iter().filter(|pixel| **pixel == color).count() >= 20 * 10, "{color:?}");
    }
    // False colors of frames of several planes, too.
    shop.run("preview rgb.exr plane.exr --false-color -o sheet.png", &[]);
    for (line, status, said) in [
        (
            "zero.bin -o a.png",
            BAD_USAGE,
            "all its samples are 0, which makes no range from black to white; name one with --range",
        ),
        ("none.bin -o a.png", BAD_DATA, "there is nothing to show"),
        ("zero.bin none.bin --range 3,3 -o a.png", BAD_USAGE, "a range from 3 to 3 shows nothing"),
    ] {
        let output = shop.attempt(&format!("{raw} {line}"), &[]);
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(status) && complaint.contains(said), "{line}: {complaint}");
    }
}

/// A sheet holds the picture of each frame, in the order given; a frame of several scenes is told apart by its gray.
#[test]
fn a_sheet_shows_frames_in_their_order() {
    let shop = Workshop::new();
    for (name, code) in [("a", 60_u8), ("b", 120), ("c", 180)] {
        std::fs::write(shop.path(&format!("{name}.bin")), [code; 40 * 30]).unwrap();
    }
    let files = "a.bin b.bin c.bin";
    shop.run(&format!("preview --raw 40x30:u8 --range 0,255 --columns 3 {files} -o row.png"), &[]);
    let gray = |picture: &Picture| -> Vec<[u8; 3]> {
        // The middle of the pictures, 15 below the margin.
        let row = &picture.pixels[picture.width * 27..][..picture.width];
        let mut seen: Vec<[u8; 3]> =
            row.chunk_by(|a, b| a == b).filter(|run| run.len() == 40).map(|run| run[0]).collect();
        seen.retain(|pixel| *pixel != [255; 3]);
        seen
    };
    let grays = gray(&Picture::read(&shop, "row.png"));
    assert_eq!(grays.len(), 3);
    assert!(grays.is_sorted_by(|a, b| a[0] < b[0]));
    shop.run("preview --raw 40x30:u8 --range 0,255 --columns 3 c.bin a.bin b.bin -o other.png", &[]);
    assert_eq!(gray(&Picture::read(&shop, "other.png")), [grays[2], grays[0], grays[1]]);
    let output = shop.attempt("preview --raw 40x30:u8 a.bin - -o x.png", &[]);
    assert_eq!(output.status.code(), Some(BAD_USAGE));
    let output = shop.attempt("preview --raw 40x30:u8 a.bin missing.bin -o x.png", &[]);
    assert!(output.status.code() == Some(BAD_DATA) && !shop.path("x.png").exists());
}

/// Frames that are no picture are shown by one plane; all stages make one sheet.
#[test]
fn all_stages_make_a_sheet() {
    let shop = Workshop::with_frames();
    shop.run("to-xyz rgb.exr --matrix matrix.yaml --space lab -o lab.exr", &[]);
    shop.run("color-difference xyz.exr xyz.exr --map map.exr", &[]);
    shop.run("preview expected.exr noisy.exr codes.exr plane.exr rgb.exr xyz.exr lab.exr map.exr -o sheet.png", &[]);
    shop.run("preview xyz.exr lab.exr --region 1,1,4,3 --zoom 8 -o part.png", &[]);
}

/// The lines below a picture, of which the numbers are those of `measure`, though a part of the pixels is saturated.
#[test]
fn captions_count_what_measure_counts() {
    let shop = Workshop::new();
    // Programs warn of saturated pixels.
    for line in [
        "render-radiance --electrons 39500,20000,20000 --size 60x40 -o expected.exr",
        "add-noise expected.exr --seed 3 -o noisy.exr",
        "digitize noisy.exr -o codes.exr",
        "mosaic codes.exr -o plane.exr",
        "demosaic plane.exr -o rgb.exr",
    ] {
        assert!(shop.attempt(line, &[]).status.success(), "{line}");
    }
    let digits = |value: f64| {
        format!(
            "{value:.*}",
            if value >= 1000.0 {
                1
            } else if value >= 100.0 {
                2
            } else {
                3
            }
        )
    };
    for (name, kept) in [("rgb.exr", false), ("plane.exr", true)] {
        let path = Some(shop.path(name));
        let mut reader = FrameReader::open(&InputOptions { path, ..InputOptions::default() }).unwrap();
        reader.keep_mask();
        let tile = thumbnail(&mut reader, &PictureSettings::default()).unwrap();
        let measured: serde_json::Value =
            serde_json::from_slice(&shop.attempt(&format!("measure {name} --output-format json"), &[]).stdout).unwrap();
        let region = &measured["regions"][0];
        let saturated = region["saturated"].as_u64().unwrap();
        assert!((100..2300).contains(&saturated), "{name}: {saturated}");
        let groups = if kept { &region["classes"] } else { &region["channels"] };
        for group in groups.as_array().unwrap() {
            let [mean, std] = ["mean", "std"].map(|key| digits(group[key].as_f64().unwrap()));
            let wanted = format!("{}: mean {mean}, std {std}", group["name"].as_str().unwrap());
            assert!(tile.caption.contains(&wanted), "{name}: no {wanted} in {:?}", tile.caption);
        }
        let left_out = format!("left out: {saturated} saturated or marked");
        assert_eq!(tile.caption.contains(&left_out), !kept, "{name}: {:?}", tile.caption);
        // Photosites at the white level are shown and counted, and it is said how many there are.
        let full = format!("saturated: {saturated} of 2400 samples");
        assert_eq!(tile.caption.contains(&full), kept, "{name}: {:?}", tile.caption);
        let words: Vec<&str> = if kept { vec!["a CFA plane of ADU"] } else { vec!["three demosaicked planes of ADU"] };
        assert!(tile.caption[0].starts_with(words[0]), "{:?}", tile.caption);
        assert!(tile.caption.last().unwrap().starts_with("black "), "{:?}", tile.caption);
    }
}

/// A channel that is taken alone is called by its name below the picture and beside its bar, and layers as `measure` calls them.
#[test]
fn a_channel_alone_keeps_its_name() {
    let shop = Workshop::with_frames();
    for line in ["demosaic plane.exr --sigma -o s.exr", "to-xyz s.exr --matrix matrix.yaml --sigma -o sure.exr"] {
        assert!(shop.attempt(line, &[]).status.success(), "{line}");
    }
    let tile = |name: &str, channel: &str, false_color: bool| {
        let options =
            InputOptions { path: Some(shop.path(name)), channel: Some(channel.to_owned()), ..InputOptions::default() };
        let mut reader = FrameReader::open(&options).unwrap();
        let channel = reader.taken_channel().map(str::to_owned);
        let settings = PictureSettings {
            channel,
            false_color,
            range: Some(Range::Shares(0.0, 1.0)),
            ..PictureSettings::default()
        };
        thumbnail(&mut reader, &settings).unwrap()
    };
    for (name, channel, line) in
        [("rgb.exr", "G", "G: mean "), ("xyz.exr", "x", "X: mean "), ("xyz.exr", "B", "Z: mean ")]
    {
        let caption = tile(name, channel, false).caption;
        assert!(caption.iter().any(|said| said.starts_with(line)), "{name}: {caption:?}");
    }
    assert_eq!(tile("xyz.exr", "X", true).bar.unwrap().label, "X / cd m⁻²");
    assert_eq!(tile("sure.exr", "sigma.Y", true).bar.unwrap().label, "standard deviation of Y / cd m⁻²");
    assert!(tile("sure.exr", "sigma.Y", false).caption.iter().any(|said| said.starts_with("sigma.G: mean ")));
}

/// A plane of several units is told in its own; the range of color temperatures is one of their inverses, and never below 0.
#[test]
fn a_plane_is_told_in_its_own_unit() {
    let shop = Workshop::with_frames();
    assert!(shop.attempt("to-xyz rgb.exr --matrix matrix.yaml --space cct -o cct.exr", &[]).status.success());
    let mut frame = shop.frame("cct.exr");
    let [width, planes] = [frame.header.geometry.width, frame.header.geometry.channels.len()];
    for row in frame.samples.chunks_exact_mut(width * planes) {
        let kelvin = |place: usize| if place.is_multiple_of(2) { 4000.0 } else { 20_000.0 };
        row[..width].iter_mut().enumerate().for_each(|(place, sample)| *sample = kelvin(place));
    }
    shop.write("hot.exr", &frame.header, &frame.samples);
    let shown = |name: &str, plane: &str, range: Range, false_color: bool| {
        let path = Some(shop.path(name));
        let mut reader = FrameReader::open(&InputOptions { path, ..InputOptions::default() }).unwrap();
        let plane = Some(plane.to_owned());
        let settings = PictureSettings { plane, false_color, range: Some(range), ..PictureSettings::default() };
        thumbnail(&mut reader, &settings).unwrap()
    };
    for (plane, unit) in [("Y", " cd m⁻²"), ("CCT", " K"), ("Duv", "")] {
        let tile = shown("cct.exr", plane, Range::Values(-1.0, 9.0), false);
        assert_eq!(tile.caption.last().unwrap(), &format!("black −1, white 9{unit}"));
    }
    // Half of the pixels each 1/4000 and 1/20000: the mean is 1/6666.7, the standard deviation 10⁻⁴ and some.
    for (count, high) in [(1.0, 20_000.0), (4.0, 20_000.0), (0.5, 10_000.0)] {
        let (low_end, high_end) = shown("hot.exr", "CCT", Range::Deviations(count), true).bar.unwrap().range;
        let pixels = (frame.header.geometry.height * width) as f64;
        let spread = count * 1e-4 * (pixels / (pixels - 1.0)).sqrt();
        assert!((low_end * (1.5e-4 + spread) - 1.0).abs() < 1e-5, "{count}: {low_end}");
        assert!((high_end / high - 1.0).abs() < 0.05, "{count}: {high_end}");
        let tile = shown("hot.exr", "CCT", Range::Deviations(count), false);
        assert!(!tile.caption.last().unwrap().contains('−'), "{:?}", tile.caption);
    }
}

/// A long caption has lines as long as the picture is wide, or as people read.
#[test]
fn a_long_caption_is_parted() {
    let shop = Workshop::new();
    std::fs::write(shop.path("a.bin"), [60_u8; 40 * 30]).unwrap();
    let text = "a caption of a picture that says at some length what is seen and why ".repeat(12);
    let line = "preview --raw 40x30:u8 --range 0,255 a.bin -o a.png";
    let made = shop.command(line).arg(format!("--caption={text}")).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let picture = Picture::read(&shop, "a.png");
    assert!(picture.width < 520 && picture.height() > 30 + 12 * 17, "{} {}", picture.width, picture.height());
}

/// A caption stands below the picture, which stays as it is.
#[test]
fn a_caption_leaves_the_picture_as_it_is() {
    let shop = Workshop::new();
    let codes: Vec<u8> = (0..40 * 30_u32).map(|place| u8::try_from(place % 251).unwrap()).collect();
    std::fs::write(shop.path("a.bin"), &codes).unwrap();
    shop.run("preview --raw 40x30:u8 --range 0,255 a.bin -o plain.png", &[]);
    let plain = Picture::read(&shop, "plain.png");
    for caption in ["--caption", "--caption=a few words"] {
        let mut command = shop.command("preview --raw 40x30:u8 --range 0,255 a.bin -o said.png");
        assert!(command.arg(caption).status().unwrap().success());
        let said = Picture::read(&shop, "said.png");
        assert!(said.height() > 30 + 2 * 12 + 17, "{caption}: {}", said.height());
        for y in 0..30 {
            let row = &said.pixels[(y + 12) * said.width + 12..][..40];
            assert_eq!(row, &plain.pixels[y * 40..][..40], "{caption}: row {y}");
        }
    }
    let output = shop.attempt("preview --raw 40x30:u8 --caption a.bin a.bin -o x.png", &[]);
    assert_eq!(output.status.code(), Some(BAD_USAGE));
}

/// A picture without a number, or of a range that no number lies in, is black or white all over: that is said.
#[test]
fn pictures_of_nothing_are_told() {
    let shop = Workshop::new();
    let write = |name: &str, samples: &[f32]| {
        let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
        std::fs::write(shop.path(name), bytes).unwrap();
    };
    write("nan.bin", &[f32::NAN; 64]);
    write("one.bin", &[&[7.5][..], &[f32::INFINITY; 63]].concat());
    let ramp: Vec<f32> = (0..64_u8).map(|step| f32::from(step) + 100.0).collect();
    write("ramp.bin", &ramp);
    let none = "none of its pixels has a number that is finite; there is nothing to show";
    for options in
        ["", " --range 0,1", " --range 4sigma", " --range 1%,99%", " --false-color", " --false-color --range 0,1"]
    {
        let done = shop.attempt(&format!("preview --raw 8x8:f32le nan.bin{options} -o a.png"), &[]);
        assert_eq!(done.status.code(), Some(BAD_DATA), "{options}");
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(said.starts_with("preview: nan.bin: ") && said.ends_with(&format!("{none}\n")), "{options}: {said}");
        assert!(!shop.path("a.png").exists());
    }
    assert!(shop.attempt("preview --raw 8x8:f32le one.bin -o a.png", &[]).status.success());
    for (options, range) in [
        (" --range 0,99", Some("0 to 99")),
        (" --range 164,200", Some("164 to 200")),
        (" --range 0,99 --caption", Some("0 to 99")),
        (" --range 0,99 --false-color", Some("0 to 99")),
        (" --range 163,200", None),
        (" --range 0,100 --false-color", None),
        ("", None),
    ] {
        let done = shop.attempt(&format!("preview --raw 8x8:f32le ramp.bin{options} -o a.png"), &[]);
        assert!(done.status.success() && shop.path("a.png").exists());
        let said = String::from_utf8_lossy(&done.stderr);
        let wanted = range.map_or(String::new(), |range| {
            format!(
                "preview: warning: ramp.bin: all numbers, from 100.00 to 163.00, lie outside the range from {range}, which shows \
                 nothing of them; give another with --range\n"
            )
        });
        assert_eq!(said, wanted, "{options}");
    }
}

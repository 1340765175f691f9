//! Pictures in R, G, B as scenes, and clean partners of noisy frames.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::color::rgb::{Encoding, NamedPrimaries, xyz_from_rgb};
use cyanometer::color::xyz_of_chromaticity;
use cyanometer::formats::exr::{ExrCompression, ExrSamples, ExrTags, ExrWriter, Layers};
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use cyanometer::units::QuantityKind;
use nalgebra::Vector3;
use std::fs;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};
use support::{EXPOSURE, TREE, sensor};

/// Pixels of a small picture: gray, primaries, mixtures, black, one brighter than white, one outside of sRGB that has a
/// spectrum.
const PIXELS: [[f32; 3]; 12] = [
    [1.0, 1.0, 1.0],
    [0.2, 0.2, 0.2],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
    [0.3, 0.1, 0.6],
    [0.02, 0.3, 0.01],
    [0.0, 0.0, 0.0],
    [7.0, 5.0, 2.0],
    [0.5, 0.4, 0.3],
    [-0.01, 0.3, 0.2],
];

/// A sensor that sees as the CIE 1931 observer does: each class gives electrons in proportion to X, Y or Z.
fn observing(shop: &Workshop) {
    let observer = fs::read_to_string(format!("{TREE}/sample_data/observers/cie1931_2deg_1nm.csv")).unwrap();
    let mut table = String::from("wavelength_nm,R,G,B\n");
    for row in observer.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())) {
        let numbers: Vec<f64> = row.split(',').map(|part| part.parse().unwrap()).collect();
        let efficiency = |k: usize| (OBSERVED * numbers[k] / numbers[0]).max(0.0);
        table += &format!("{},{:e},{:e},{:e}\n", numbers[0], efficiency(1), efficiency(2), efficiency(3));
    }
    fs::write(shop.path("observer.csv"), table).unwrap();
    let known = fs::read_to_string(format!("{TREE}/sample_data/sensors/kaf-5101ce.yaml")).unwrap();
    let lines = known.lines().filter(|line| !line.starts_with("cover_glass"));
    let changed: Vec<String> = lines.map(|line| line.replace("kaf5101ce_est_qe_1nm.csv", "observer.csv")).collect();
    fs::write(shop.path("observer.yaml"), changed.join("\n")).unwrap();
}

/// Electrons per photon of a color-matching function of 1 at 1 nm.
const OBSERVED: f64 = 200.0;

/// Expected electrons of a camera that sees X, Y, Z in cd m⁻²: A H λ/(h c) of 683 lm W⁻¹ \[HP2005, Eq. 5].
fn electrons_of(xyz: f64) -> f64 {
    let photons_per_joule_nm = 1e-9 / (6.626_070_15e-34 * 299_792_458.0);
    xyz / (683.0 * 1e4)
        * sensor().pixel_area_cm2().unwrap()
        * EXPOSURE.exposure_s_sr()
        * photons_per_joule_nm
        * OBSERVED
}

/// The camera that sees as the observer does gives back the XYZ of every pixel, whatever its luminance: to 3·10⁻⁶ of X + Y +
/// Z, the most that nodes (10⁻⁶), samples (10⁻⁷) and the table of D65's white, (0.31272, 0.32903) for (0.3127, 0.3290), leave.
#[test]
fn an_observing_camera_gives_back_the_colors() {
    let shop = Workshop::new();
    observing(&shop);
    shop.write_colors("in.exr", QuantityKind::Unspecified, &PIXELS);
    shop.run("render-radiance in.exr --sensor observer.yaml --luminance 250 -o out.exr", &[]);
    let (samples, metadata) = shop.read("out.exr");
    // D65 as its table and the observer's have it.
    let table = |file: &str, column: usize| -> Vec<f64> {
        let text = fs::read_to_string(format!("{TREE}/sample_data/{file}")).unwrap();
        let rows = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        rows.map(|row| row.split(',').nth(column).unwrap().parse().unwrap()).collect()
    };
    let d65 = table("illuminants/cie_d65_1nm.csv", 1);
    let sums = [1, 2, 3].map(|column| {
        let matching = table("observers/cie1931_2deg_1nm.csv", column);
        matching.iter().zip(&d65).map(|(a, b)| a * b).sum::<f64>()
    });
    let white = sums.map(|sum| sum / sums[1]);
    let matrix = xyz_from_rgb(&NamedPrimaries::Srgb.chromaticities(), white).unwrap();
    for (pixel, made) in PIXELS.iter().zip(samples.as_chunks::<3>().0) {
        let xyz = matrix * Vector3::from(pixel.map(f64::from)) * 250.0;
        let expected: [f64; 3] = xyz.map(electrons_of).into();
        let total: f64 = expected.iter().sum();
        for i in 0..3 {
            assert!((f64::from(made[i]) - expected[i]).abs() <= 3e-6 * total, "{pixel:?}: {made:?}, not {expected:?}");
        }
    }
    let upsampling = metadata.scene.unwrap().upsampling.unwrap();
    assert_eq!((upsampling.illuminant.as_str(), upsampling.white_luminance), ("d65", 250.0));
    assert_eq!((upsampling.encoding.as_str(), upsampling.method.as_str()), ("linear", "jakob-hanika-2019"));

    // Under another light gray has its color, at the luminance of its reflectance.
    shop.run("render-radiance in.exr --sensor observer.yaml --luminance 250 --illuminant a --quiet -o a.exr", &[]);
    let (under_a, _) = shop.read("a.exr");
    let gray = xyz_of_chromaticity([0.447_58, 0.407_45], 50.0).map(electrons_of);
    for i in 0..3 {
        assert!((f64::from(under_a[3 + i]) / gray[i] - 1.0).abs() < 2e-4, "{under_a:?}");
    }
}

/// A PNG of 8 or 16 bits.
fn png(width: u32, depth: png::BitDepth, color: png::ColorType, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let row = width as usize * color.samples() * depth as usize / 8;
    let mut encoder = png::Encoder::new(&mut bytes, width, u32::try_from(data.len() / row).unwrap());
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

/// Codes of PNG are those of sRGB unless said otherwise: the same light as floats gives the same electrons, to the rounding
/// of floats.
#[test]
fn codes_and_floats_of_the_same_light_give_the_same_scene() {
    let shop = Workshop::new();
    let codes: Vec<u8> = (0..=255).chain((0..=255).rev()).chain(128..=255).chain(0..128).collect();
    fs::write(shop.path("in.png"), png(1, png::BitDepth::Eight, png::ColorType::Rgb, &codes)).unwrap();
    for (option, encoding) in
        [("", Encoding::Srgb), (" --rgb linear", Encoding::Linear), (" --rgb 2", Encoding::Power(2.0))]
    {
        let light: Vec<f32> = codes.iter().map(|code| to_sample(encoding.decode(f64::from(*code) / 255.0))).collect();
        shop.write_colors("in.exr", QuantityKind::Unspecified, light.as_chunks::<3>().0);
        shop.run(&format!("render-radiance in.png --luminance 100 -o a.exr{option}"), &[]);
        shop.run("render-radiance in.exr --luminance 100 -o b.exr", &[]);
        let ((a, _), (b, _)) = (shop.read("a.exr"), shop.read("b.exr"));
        let most = a.iter().copied().fold(0.0, f32::max);
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= 1e-5 * most), "{option}");
    }
    let wide: Vec<u8> = codes.iter().flat_map(|code| [*code, *code]).collect();
    fs::write(shop.path("wide.png"), png(1, png::BitDepth::Sixteen, png::ColorType::Rgb, &wide)).unwrap();
    shop.run("render-radiance in.png --luminance 100 -o a.exr", &[]);
    shop.run("render-radiance wide.png --luminance 100 -o b.exr", &[]);
    assert_eq!(shop.read("a.exr").0, shop.read("b.exr").0);
}

/// Threads, bands, vectors, cuts and the exposure change no bit that they should not.
#[test]
fn the_scene_does_not_hang_on_how_it_is_worked_out() {
    let shop = Workshop::new();
    let codes: Vec<u8> = (0_u32..70 * 40 * 3).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    fs::write(shop.path("in.png"), png(70, png::BitDepth::Eight, png::ColorType::Rgb, &codes)).unwrap();
    let render = |options: &str| {
        shop.run(&format!("render-radiance in.png -o out.exr --quiet --luminance {options}"), &[]);
        shop.read("out.exr").0
    };
    let whole = render("100 --threads 1");
    assert_eq!(render("100 --threads 3"), whole);
    let mut baseline = shop.command("render-radiance in.png --luminance 100 -o out.exr");
    assert!(baseline.env("CYANOMETER_VECTORS", "baseline").status().unwrap().success());
    assert_eq!(shop.read("out.exr").0, whole);
    let cut = render("100 --size 30x20");
    assert_eq!(cut[..30], whole[..30]);
    assert_eq!(cut[19 * 90 + 60..][..30], whole[19 * 210 + 140..][..30]);
    let sample = render("100 --sample 75 --size 1x1");
    assert_eq!(sample, [whole[210 + 5], whole[210 + 75], whole[210 + 145]]);
    let patches = render("100 --patch 2x3");
    assert_eq!(patches[5 * 420..][..4], [whole[210], whole[210], whole[211], whole[211]]);
    let double = render("200");
    assert!(double.iter().zip(&whole).all(|(a, b)| (a / (2.0 * b) - 1.0).abs() < 2e-7 || *b == 0.0));
}

#[test]
fn what_is_no_picture_or_not_said_is_told() {
    let shop = Workshop::new();
    let write = |name: &str, color: png::ColorType, data: &[u8]| {
        fs::write(shop.path(name), png(1, png::BitDepth::Eight, color, data)).unwrap();
    };
    write("gray.png", png::ColorType::Grayscale, &[1, 2]);
    write("alpha.png", png::ColorType::Rgba, &[10, 20, 30, 40]);
    write("rgb.png", png::ColorType::Rgb, &[10, 20, 30]);
    shop.write_colors("nan.exr", QuantityKind::Unspecified, &[[0.1, 0.2, 0.3], [0.1, f32::NAN, 0.3]]);
    shop.write_colors("xyz.exr", QuantityKind::Xyz, &[[0.1, 0.2, 0.3]]);
    shop.write_colors("red.exr", QuantityKind::Unspecified, &[[1.0, 0.0, 0.0]]);
    let table = "nm,power\n400,1\n700,-1\n";
    fs::write(shop.path("dark.csv"), table).unwrap();
    for (line, status, said) in [
        ("gray.png", BAD_DATA, "it holds no spectral radiance"),
        ("nan.exr --luminance 1", BAD_DATA, "its pixel 0,1 is [0.1, NaN, 0.3]; no light has such a color"),
        ("xyz.exr", BAD_DATA, "neither spectral radiance nor a picture in R, G, B"),
        ("rgb.png --illuminant f2", BAD_USAGE, "there is no illuminant `f2`; known are a, d50, d55, d65, d75, e and"),
        ("rgb.png --illuminant dark.csv", BAD_DATA, "it is no light"),
        ("rgb.png --primaries 0.3,0.3,0.3,0.3,0.3,0.3,0.3,0.3", BAD_DATA, "its primaries lie on a line"),
        ("rgb.png --primaries bt709", BAD_USAGE, "give one of srgb, display-p3"),
        ("rgb.png --rgb gamma", BAD_USAGE, "give srgb, linear, or the power"),
        ("rgb.png --column R", BAD_USAGE, "--column and --radiance-unit are for spectra"),
        ("rgb.png --sample 1", BAD_USAGE, "there is no sample 1"),
        ("rgb.png --luminance 0", BAD_USAGE, "--luminance"),
        ("SAMPLES/skies/clear_zenith.csv --size 2x2 --luminance 5", BAD_USAGE, "are for a picture in R, G, B"),
        ("SAMPLES/skies/kider2014.exr --illuminant a", BAD_USAGE, "are for a picture in R, G, B"),
        ("--dark --size 2x2 --rgb linear", BAD_USAGE, "are for a picture in R, G, B"),
    ] {
        let output = shop.attempt(&format!("render-radiance {line} -o out.exr"), &[]);
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(status) && complaint.contains(said), "{line}: {complaint}");
    }
    for (line, said) in [
        ("rgb.png", "white is taken to have 1000 cd/m2; --luminance says otherwise"),
        ("alpha.png --luminance 1", "channels A are left out; colors are taken as stored"),
        ("red.exr --luminance 1 --primaries rec2020", "1 pixels have colors that no smooth spectrum has"),
    ] {
        let output = shop.attempt(&format!("render-radiance {line} -o out.exr"), &[]);
        let warning = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && warning.contains(said), "{line}: {warning}");
    }
    assert!(shop.run("render-radiance rgb.png --expose-to 0.5 -o out.exr", &[]).is_empty());
}

/// The mean of noisy frames of many seeds and sensors is the clean one: z of each of 16 levels from darkness to three quarters
/// of full well, for electrons, and for codes about the clean one before it is rounded, which `digitize` does by at most ½. A
/// level has 64 frames of 3 · 128 photosites; one of 32 z is beyond 4.5 in 5000 sets of seeds. Dark current is spread by 0.8, so
/// that a tenth of the photosites have none and the mean is lifted by 4 %, 5 standard errors: without that the test fails.
#[test]
fn the_clean_partner_is_the_mean_of_noisy_frames() {
    const LEVELS: usize = 16;
    let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
    let mut warm = sensor();
    warm.readout.as_mut().unwrap().dcnu = 0.8;
    metadata.sensor = Some(warm);
    metadata.exposure = Some(EXPOSURE);
    let geometry = Geometry::new(LEVELS, 128, &["R", "G", "B"]);
    let row: Vec<f32> = (0..LEVELS).map(|level| 2000.0 * level as f32).collect();
    let samples = row.repeat(3 * 128);
    let light = MemoryFrame::new(FrameHeader { name: "light".into(), geometry, metadata }, samples);
    let exposed = |settings: &NoiseSettings| {
        let stage = AddNoise::new(&light.header, settings).unwrap();
        light.through(&stage).unwrap().0
    };
    let digitized =
        |frame: &MemoryFrame| frame.through(&Digitize::new(&frame.header, &AdcSettings::default()).unwrap()).unwrap().0;
    let clean = exposed(&NoiseSettings { clean: true, seed: 99, ..NoiseSettings::default() });
    let dark_e = clean.header.metadata.dark_signal_e.unwrap();
    assert!(dark_e > 17.0, "{dark_e}");
    assert!((f64::from(clean.samples[1]) - 2000.0 - dark_e).abs() < 1e-3);
    let readout = clean.header.readout().unwrap().clone();
    let code = |electrons: f32| readout.bias_adu + readout.adu_per_e * f64::from(electrons);
    let rounded = digitized(&clean).samples;
    assert!(clean.samples.iter().zip(&rounded).all(|(e, adu)| (code(*e) - f64::from(*adu)).abs() <= 0.5 + 1e-3));
    let mut sums = [[[0.0_f64; 2]; LEVELS]; 2];
    let seeds = 64_u32;
    for seed in (0..seeds).map(u64::from) {
        let noisy = exposed(&NoiseSettings { seed, sensor_seed: seed, ..NoiseSettings::default() });
        let codes = digitized(&noisy).samples;
        for (index, (&e, &adu)) in noisy.samples.iter().zip(&codes).enumerate() {
            let level = index % LEVELS;
            let of_clean = clean.samples[index];
            for (sums, difference) in
                sums.iter_mut().zip([f64::from(e) - f64::from(of_clean), f64::from(adu) - code(of_clean)])
            {
                sums[level][0] += difference;
                sums[level][1] += difference * difference;
            }
        }
    }
    let n = f64::from(seeds * 3 * 128);
    for (kind, sums) in sums.iter().enumerate() {
        for (level, [sum, squares]) in sums.iter().enumerate() {
            let mean = sum / n;
            let z = mean / ((squares / n - mean * mean) / n).sqrt();
            assert!(z.abs() < 4.5, "kind {kind}, level {level}: z {z}");
        }
    }
}

#[test]
fn a_clean_frame_says_so_and_takes_no_sources() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 100,200,300 --size 4x2 -o in.exr", &[]);
    shop.run("add-noise in.exr --clean -o clean.exr", &[]);
    let (samples, metadata) = shop.read("clean.exr");
    let record = metadata.noise.unwrap();
    assert!(record.sources.is_empty() && samples[..4].iter().all(|e| *e == samples[0] && *e > 100.0));
    for idle in ["--without ron", "--seed 1", "--sensor-seed 1", "--frame 1", "--poisson gaussian"] {
        let output = shop.attempt(&format!("add-noise in.exr --clean {idle} -o x.exr"), &[]);
        assert_eq!(output.status.code(), Some(BAD_USAGE), "{idle}");
    }
}

/// Writes a spectral image in which all channels of a pixel are alike.
fn write_spectral(shop: &Workshop, name: &str, unit: Option<&str>, channels: &[&str], rows: &[[f32; 4]]) {
    let samples: Vec<f32> = rows.iter().flat_map(|row| channels.iter().flat_map(|_| *row)).collect();
    write_planes(shop, name, unit, &Geometry::new(4, rows.len(), channels), &samples);
}

/// Writes the samples of an image, its channels within rows.
fn write_planes(shop: &Workshop, name: &str, unit: Option<&str>, geometry: &Geometry, samples: &[f32]) {
    let tags = ExrTags { emissive_units: unit.map(str::to_owned), ..ExrTags::default() };
    let file = fs::File::create(shop.path(name)).unwrap();
    let (kind, compression) = (ExrSamples::F32, ExrCompression::None);
    let mut writer = ExrWriter::create(file, name, geometry, kind, compression, Layers::BesideTheImage, &tags).unwrap();
    writer.write(samples).unwrap();
    writer.finish().unwrap();
}

const BANDS: [&str; 3] = ["S0.360,000000nm", "S0.550,000000nm", "S0.830,000000nm"];

/// A clear sky in W m⁻² sr⁻¹ nm⁻¹, 0.1, is 1500 times as bright as a white cloud, 6.7·10⁻⁵, where W cm⁻² are assumed.
#[test]
fn spectral_images_that_are_too_bright_for_their_unit_are_told() {
    let shop = Workshop::new();
    let (sky, dark) = ([0.1; 4], [1e-6; 4]);
    let write = |unit, rows: &[[f32; 4]]| write_spectral(&shop, "a.exr", unit, &BANDS, rows);
    let bright = "1500 times as bright as a white cloud in the sun";
    write(None, &[dark, dark, sky]);
    for line in ["render-radiance a.exr -o out.exr", "predict-noise a.exr --all-samples --expose-to 0.5"] {
        let said = shop.said(line, BAD_DATA);
        let wanted = "a.exr: it does not say the unit of its radiance; in W cm-2 sr-1 nm-1 it would be";
        assert!(said.contains(wanted) && said.contains(bright) && said.contains("give --radiance-unit"), "{said}");
    }
    // Of a chosen pixel the others do not matter.
    assert!(!shop.said("render-radiance a.exr --sample 3 --size 2x2 -o out.exr", 0).contains(bright));
    assert!(shop.said("render-radiance a.exr --sample 9 --size 2x2 -o out.exr", BAD_DATA).contains(bright));
    let given = shop.said("render-radiance a.exr --radiance-unit W/m2/sr/nm -o out.exr", 0);
    assert!(!given.contains("white cloud"), "{given}");

    // A stated unit counts: it is asked about once, where most pixels are so bright, which those of a lamp are not.
    let stated = "W.cm^-2.sr^-1.nm^-1";
    for (rows, is_told) in [(&[sky, sky, dark][..], true), (&[dark, sky, dark], false), (&[dark], false)] {
        write(Some(stated), rows);
        for line in ["render-radiance a.exr -o out.exr", "predict-noise a.exr --all-samples --expose-to 0.5"] {
            let said = shop.said(line, 0);
            assert_eq!(said.matches("is that its unit?").count(), usize::from(is_told), "{line}: {said}");
        }
    }
}

/// Planes of zeros beside bright ones are told, of the pixels that are looked at; black pixels are light as any.
#[test]
fn spectral_images_that_are_cut_off_are_told() {
    let shop = Workshop::new();
    let nm: Vec<f32> = (0..48_u8).map(|band| 360.0 + 10.0 * f32::from(band)).collect();
    let names: Vec<String> = nm.iter().map(|nm| format!("S0.{nm},000000nm")).collect();
    let channels: Vec<&str> = names.iter().map(String::as_str).collect();
    let write = |name: &str, last_nm: f32, share: f32| {
        let sky = |nm: f32| if nm <= last_nm { 1e-5 * (nm / 450.0).powf(-3.2) } else { 0.0 };
        let samples: Vec<f32> = nm.iter().flat_map(|nm| [share * sky(*nm), sky(*nm)]).collect();
        let rows = [samples.clone(), samples].concat();
        write_planes(&shop, name, Some("W.cm^-2.sr^-1.nm^-1"), &Geometry::new(2, 2, &channels), &rows);
    };
    write("cut.exr", 600.0, 0.5);
    write("whole.exr", 800.0, 0.5);
    write("black.exr", 800.0, 0.0);
    for (line, whose) in [
        ("render-radiance FILE -o out.exr", ", the brightest pixel of its first row: "),
        ("predict-noise FILE --sample 3", ", sample 3: "),
        ("predict-noise FILE --all-samples --expose-to 0.5", ", on average: "),
    ] {
        let told = format!(
            "cut.exr{whose}it is exactly 0 from 610 nm on, beside 20 % of its largest, which counts as no light"
        );
        let said = shop.said(&line.replace("FILE", "cut.exr"), 0);
        assert_eq!(said.matches(&told).count(), 1, "{line}: {said}");
        let said = shop.said(&line.replace("FILE", "whole.exr"), 0);
        assert!(!said.contains("exactly 0"), "{line}: {said}");
    }
    assert!(shop.said("predict-noise black.exr --sample 0", 0).contains("black.exr, sample 0: all radiances are 0"));
}

#[test]
fn channels_in_um_are_those_in_nm_and_others_are_told() {
    let shop = Workshop::new();
    let rows = [[1e-6, 2e-6, 3e-6, 4e-6]; 2];
    let mut seen = Vec::new();
    for channels in [BANDS, ["S0.0,360um", "S0.0,55um", "S0.0,830000um"]] {
        write_spectral(&shop, "a.exr", Some("W.cm^-2.sr^-1.nm^-1"), &channels, &rows);
        assert!(shop.attempt("render-radiance a.exr -o out.exr", &[]).status.success());
        seen.push(shop.frame("out.exr").samples);
    }
    assert_eq!(seen[0], seen[1]);
    write_spectral(&shop, "a.exr", None, &["S0.545,1THz", "S0.600,0THz"], &rows);
    let said = shop.said("render-radiance a.exr -o out.exr", BAD_DATA);
    assert!(
        said.contains("its channel `S0.545,1THz` does not count wavelengths in nm or um, which alone are read"),
        "{said}"
    );
}

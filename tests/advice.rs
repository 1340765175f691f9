//! Advice that works: each complaint is provoked, what it says is done to the letter, and the command succeeds.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use support::TREE;
use support::advised::{UNLISTED, named, options_of};
use support::workshop::{Workshop, programs};

/// A mistake, what the complaint advises, and that advice followed: what comes last succeeds.
struct Advice {
    mistake: &'static str,
    says: &'static str,
    followed: &'static [&'static str],
}

const fn advice(mistake: &'static str, says: &'static str, followed: &'static [&'static str]) -> Advice {
    Advice { mistake, says, followed }
}

const SENSOR: &str = "give --sensor NAME|FILE";
const BLACK: &str = "no `black_level_adu`; give --black N, 0 where it is off already";
const UNIT: &str = "as bright as a white cloud in the sun; give --radiance-unit";

/// Frames whose metadata lack what a program needs: `silent.yaml` says nothing, `plane.yaml`, `expected.yaml` … nearly all.
const MISSING: &[Advice] = &[
    advice(
        "demosaic plane.exr --metadata silent.yaml -o out.exr",
        "no `cfa`; give --cfa PATTERN",
        &["demosaic plane.exr --metadata silent.yaml --pattern rggb --black 1757 -o out.exr"],
    ),
    advice(
        "demosaic plane.exr --metadata silent.yaml --pattern rggb -o out.exr",
        BLACK,
        &[
            "demosaic plane.exr --metadata silent.yaml --pattern rggb --black none -o out.exr",
            "demosaic plane.exr --metadata silent.yaml --pattern rggb --black 0 -o out.exr",
            "demosaic plane.exr --metadata silent.yaml --pattern rggb --black 1757 -o out.exr",
        ],
    ),
    advice(
        "demosaic electrons.exr --metadata electrons.yaml -o out.exr",
        "no `dark_signal_e`; give --black N",
        &["demosaic electrons.exr --metadata electrons.yaml --black 73 -o out.exr"],
    ),
    advice(
        "demosaic plane.exr --metadata plane.yaml --sigma -o out.exr",
        SENSOR,
        &["demosaic plane.exr --metadata exposed.yaml --sigma --sensor kaf-5101ce -o out.exr"],
    ),
    advice(
        "demosaic plane.exr --metadata plane.yaml --sensor kaf-5101ce --sigma -o out.exr",
        "no `exposure_time_s`; give --exposure S",
        &[
            "demosaic plane.exr --metadata plane.yaml --sensor kaf-5101ce --sigma --exposure 0.033 -o out.exr",
            "demosaic plane.exr --metadata exposed.yaml --sensor kaf-5101ce --sigma -o out.exr",
        ],
    ),
    advice(
        "correct-frame plane.exr --metadata silent.yaml --black auto -o out.exr",
        BLACK,
        &[
            "correct-frame plane.exr --metadata silent.yaml --black 0 -o out.exr",
            "correct-frame plane.exr --metadata silent.yaml --black 1757 -o out.exr",
        ],
    ),
    advice(
        "correct-frame plane.exr --metadata silent.yaml --cte 0.9999 -o out.exr",
        "no `adc`; give --black N",
        &["correct-frame plane.exr --metadata silent.yaml --cte 0.9999 --black 1757 -o out.exr"],
    ),
    advice(
        "add-noise expected.exr --metadata expected.yaml -o out.exr",
        SENSOR,
        &["add-noise expected.exr --metadata rendered.yaml --sensor kaf-5101ce -o out.exr"],
    ),
    advice(
        "add-noise expected.exr --metadata expected.yaml --sensor kaf-5101ce -o out.exr",
        "no `exposure`; give --exposure S and --f-number N",
        &[
            "add-noise expected.exr --metadata expected.yaml --sensor kaf-5101ce --exposure 0.033 --f-number 8 -o out.exr",
            "add-noise expected.exr --metadata rendered.yaml --sensor kaf-5101ce -o out.exr",
        ],
    ),
    advice(
        "digitize noisy.exr --metadata electrons.yaml -o out.exr",
        "or all of --bits, --bias and --slope",
        &[
            "digitize noisy.exr --metadata electrons.yaml --sensor kaf-5101ce -o out.exr",
            "digitize noisy.exr --metadata electrons.yaml --bits 12 --bias 100 --slope 0.05 -o out.exr",
        ],
    ),
    advice(
        "to-xyz rgb.exr --metadata silent.yaml --matrix matrix.yaml -o out.exr",
        "no `exposure`; give --exposure S and --f-number N",
        &[
            "to-xyz rgb.exr --metadata silent.yaml --matrix matrix.yaml --exposure 0.03 --f-number 8 --black 0 -o out.exr",
        ],
    ),
    advice(
        "to-xyz rgb.exr --metadata silent.yaml --matrix matrix.yaml --exposure 0.03 --f-number 8 -o out.exr",
        BLACK,
        &[
            "to-xyz rgb.exr --metadata silent.yaml --matrix matrix.yaml --exposure 0.03 --f-number 8 --black 0 -o out.exr",
        ],
    ),
    advice(
        "to-xyz rgb.exr --matrix matrix.yaml --black 7 -o out.exr",
        "leave out --black",
        &["to-xyz rgb.exr --matrix matrix.yaml -o out.exr"],
    ),
    advice(
        "to-xyz rgb.exr --metadata silent.yaml --matrix matrix.yaml --exposure 1 --f-number 8 --black 0 --space lab -o out.exr",
        "no `white_level_adu`; give --white-luminance CD_PER_M2",
        &[
            "to-xyz rgb.exr --metadata silent.yaml --matrix matrix.yaml --exposure 1 --f-number 8 --black 0 --space lab \
           --white-luminance 100 -o out.exr",
        ],
    ),
    advice(
        "to-xyz rgb.exr --metadata sites.yaml --matrix matrix.yaml -o out.exr",
        "subtract it with `correct-frame --black auto` first",
        &[
            "correct-frame rgb.exr --metadata sites.yaml --black auto -o flat.exr",
            "to-xyz flat.exr --matrix matrix.yaml -o out.exr",
        ],
    ),
];

/// Programs in the wrong order, and frames that are what they should not be.
const ORDER: &[Advice] = &[
    advice(
        "demosaic codes.exr -o out.exr",
        "run `mosaic` first",
        &["mosaic codes.exr -o p.exr", "demosaic p.exr -o out.exr"],
    ),
    advice(
        "add-noise codes.exr -o out.exr",
        "run `render-radiance` first",
        &["render-radiance --electrons 1,2,3 --size 4x4 -o e.exr", "add-noise e.exr -o out.exr"],
    ),
    advice(
        "to-xyz plane.exr --matrix matrix.yaml -o out.exr",
        "run `demosaic` first",
        &["demosaic plane.exr -o d.exr", "to-xyz d.exr --matrix matrix.yaml -o out.exr"],
    ),
    advice(
        "correct-frame noisy.exr --black auto -o out.exr",
        "run `digitize` first",
        &["digitize noisy.exr -o c.exr", "correct-frame c.exr --black auto -o out.exr"],
    ),
    advice(
        "correct-frame codes.exr -o out.exr",
        "give --black, --dark, --bias, --flat, --defects, --linearize or --cte",
        &[
            "correct-frame codes.exr --black auto -o out.exr",
            "correct-frame codes.exr --metadata silent.yaml --black 1757 --cte 0.9999 -o out.exr",
            "correct-frame codes.exr --dark dark.exr -o out.exr",
            "correct-frame codes.exr --bias dark.exr -o out.exr",
        ],
    ),
    advice(
        "correct-frame codes.exr --dark lit.exr -o out.exr",
        "as `render-radiance --dark` renders it",
        &[
            "render-radiance --dark --size 8x6 -o d0.exr",
            "add-noise d0.exr -o d1.exr",
            "digitize d1.exr -o d2.exr",
            "correct-frame codes.exr --dark d2.exr -o out.exr",
        ],
    ),
    advice("demosaic again.exr --black 1757 -o out.exr", "leave out --black", &["demosaic again.exr -o out.exr"]),
    advice(
        "color-difference rgb.exr xyz.exr",
        "run `to-xyz` first",
        &["to-xyz rgb.exr --matrix matrix.yaml -o x.exr", "color-difference x.exr xyz.exr"],
    ),
    advice(
        "color-difference srgb.tiff xyz.exr",
        "compare the frames that it was made of, behind `to-xyz --space lab`",
        &["to-xyz rgb.exr --matrix matrix.yaml --space lab -o x.exr", "color-difference x.exr xyz.exr"],
    ),
    advice("measure --patches noisy.exr", "give --patches=WxH", &["measure --patches=4x3 noisy.exr"]),
    advice(
        "preview lab.exr -o out.png",
        "as with --plane L --false-color",
        &["preview lab.exr --plane L --false-color -o out.png"],
    ),
    advice(
        "preview xyz.exr --false-color -o out.png",
        "as with --plane Y",
        &["preview xyz.exr --false-color --plane Y -o out.png"],
    ),
    advice(
        "digitize xyz.exr -o out.exr",
        "goes into `to-xyz --space`, `color-difference`, `measure` and `preview`",
        &[
            "to-xyz xyz.exr --space xyy -o out.exr",
            "color-difference xyz.exr xyz.exr",
            "measure xyz.exr",
            "preview xyz.exr -o out.png",
        ],
    ),
    advice(
        "add-noise lab.exr -o out.exr",
        "goes into `color-difference`, `measure` and `preview`",
        &["measure lab.exr"],
    ),
    advice("preview lab.tiff -o out.png", "give --range LOW,HIGH", &["preview lab.tiff --range 0,100 -o out.png"]),
    advice(
        "preview whiteless.exr -o out.png",
        "or make it anew with `to-xyz --white-luminance CD_PER_M2`",
        &[
            "preview whiteless.exr --range 0,100 -o out.png",
            "to-xyz rgb.exr --metadata silent.yaml --matrix matrix.yaml --exposure 1 --f-number 8 --black 0 --white-luminance 100 \
         -o white.exr",
            "preview white.exr -o out.png",
        ],
    ),
];

/// Outputs that cannot be as they are asked for.
const OUTPUTS: &[Advice] = &[
    advice("preview noisy.exr -o out.jpg", "end the name in .png", &["preview noisy.exr -o out.png"]),
    advice(
        "digitize noisy.exr -o out.jpg",
        "end the name in .exr, .tiff, .dng or .png (for a stack of frames in .zarr, by `stack-frames`), or give --format",
        &[
            "digitize noisy.exr -o out.exr",
            "digitize noisy.exr -o out.tiff",
            "digitize noisy.exr -o out.png",
            "digitize noisy.exr -o out.jpg --format tiff",
        ],
    ),
    advice(
        "demosaic plane.exr -o out.png",
        "write a TIFF or an EXR, or make a picture with `to-xyz --space srgb` or `preview`",
        &[
            "demosaic plane.exr -o out.tiff",
            "demosaic plane.exr -o rgb.exr",
            "to-xyz rgb.exr --matrix matrix.yaml --space srgb -o out.png",
            "preview rgb.exr -o out.png",
        ],
    ),
    advice(
        "digitize noisy.exr -o out.png --compression lzw",
        "it is one of deflate",
        &["digitize noisy.exr -o out.png --compression deflate"],
    ),
    advice("demosaic plane.exr -o no/out.exr", "make it first", &["mkdir no", "demosaic plane.exr -o no/out.exr"]),
    advice("demosaic plane.exr --sigma -o out.tiff", "write an EXR", &["demosaic plane.exr --sigma -o out.exr"]),
    advice(
        "add-noise expected.exr --sample-type u16 -o out.tiff",
        "write f32",
        &["add-noise expected.exr --sample-type f32 -o out.tiff"],
    ),
    advice(
        "color-difference 1,2,3 4,5,6 --map map.exr",
        "a map needs an image",
        &["color-difference xyz.exr 4,5,6 --map map.exr"],
    ),
    advice(
        "predict-noise --sweep 10:1000:5 --plot out.jpg",
        "end the name in .svg or .png",
        &["predict-noise --sweep 10:1000:5 --plot out.svg", "predict-noise --sweep 10:1000:5 --plot out.png"],
    ),
    advice(
        "to-xyz rgb.exr --matrix matrix.yaml --space srgb -o out.exr",
        "for a picture name a .png or .tiff, or let `preview` make one",
        &[
            "to-xyz rgb.exr --matrix matrix.yaml --space srgb -o out.png",
            "to-xyz rgb.exr --matrix matrix.yaml --space srgb -o out.tiff",
            "preview out.tiff -o out.png",
            "preview xyz.exr -o out.png",
        ],
    ),
];

/// Spectra and libraries.
const SPECTRA: &[Advice] = &[
    advice(
        "render-radiance bare.csv --size 2x2 -o out.exr",
        UNIT,
        &[
            "render-radiance named.csv --exposure 0.005 --size 2x2 -o out.exr",
            "render-radiance bare.csv --radiance-unit W/m2/sr/nm --exposure 0.005 --size 2x2 -o out.exr",
        ],
    ),
    advice(
        "render-radiance named.csv --radiance-unit W/cm2/sr/nm --size 2x2 -o out.exr",
        "leave out --radiance-unit",
        &["render-radiance named.csv --exposure 0.005 --size 2x2 -o out.exr"],
    ),
    advice(
        "render-radiance scaled.csv --size 2x2 -o out.exr",
        "a unit with a number before it; give --radiance-unit",
        &["render-radiance scaled.csv --radiance-unit W/m2/sr/nm --exposure 0.001 --size 2x2 -o out.exr"],
    ),
    advice(
        "render-radiance two.csv --size 2x2 -o out.exr",
        "choose one with --column NAME or --sample N",
        &[
            "render-radiance two.csv --column b --exposure 0.001 --size 2x2 -o out.exr",
            "render-radiance two.csv --sample 1 --exposure 0.001 --size 2x2 -o out.exr",
        ],
    ),
    advice(
        "render-radiance micrometers.csv --size 2x2 -o out.exr",
        "name their unit in the heading, such as `wavelength_um`",
        &["render-radiance renamed.csv --exposure 0.005 --size 2x2 -o out.exr"],
    ),
    advice(
        "render-radiance named.csv --wavelengths 0.36:0.83:0.01 --size 2x2 -o out.exr",
        "give nm, such as 360:830:1",
        &["render-radiance named.csv --exposure 0.005 --wavelengths 360:830:1 --size 2x2 -o out.exr"],
    ),
    advice(
        "render-radiance energies.csv --size 2x2 -o out.exr",
        "name their unit in the heading, such as `energy_eV`",
        &["render-radiance in_ev.csv --exposure 0.005 --size 2x2 -o out.exr"],
    ),
    advice(
        "render-radiance titled.csv --size 2x2 -o out.exr",
        "put a # before it if it is a title",
        &["render-radiance commented.csv --exposure 0.005 --size 2x2 -o out.exr"],
    ),
    advice(
        "render-radiance named.csv --exposure 0,005 --size 2x2 -o out.exr",
        "write 0.005",
        &["render-radiance named.csv --exposure 0.005 --size 2x2 -o out.exr"],
    ),
    advice(
        "render-radiance --size 2x2 --electrons 10,5;20,5;30 -o out.exr",
        "write 10.5,20.5,30",
        &["render-radiance --size 2x2 --electrons 10.5,20.5,30 -o out.exr"],
    ),
    advice(
        "render-radiance --size 2×2 --dark -o out.exr",
        "write 2x2",
        &["render-radiance --size 2x2 --dark -o out.exr"],
    ),
    advice(
        "predict-noise SAMPLES/skies/kider2014.exr",
        "choose one with --sample N",
        &["predict-noise SAMPLES/skies/kider2014.exr --sample 3 --exposure 0.001"],
    ),
    advice(
        "predict-noise",
        "give a spectrum, --electrons R,G,B, --dark or --sweep",
        &["predict-noise named.csv --exposure 0.005", "predict-noise --electrons 1,2,3", "predict-noise --dark"],
    ),
    advice(
        "predict-noise --electrons 1,2,3 --uncertainty 1jnd",
        "give --matrix FILE",
        &["predict-noise --electrons 1,2,3 --uncertainty 1jnd --matrix matrix.yaml"],
    ),
    advice(
        "predict-noise --electrons 9,9,9 --method mhc --equations paper",
        "choose bi, shti or eci",
        &["predict-noise --electrons 9,9,9 --method eci --equations paper"],
    ),
    advice(
        "fit-matrix SAMPLES/skies/sky912.exr --hold-out maritime23",
        "give them with --labels FILE:COLUMN",
        &["fit-matrix SAMPLES/skies/sky912.exr --hold-out maritime23 --labels SAMPLES/skies/sky912_meta.csv:aerosol"],
    ),
    advice(
        "fit-matrix SAMPLES/skies/sky912.exr --white-sample 3",
        "leave out --white-sample, or choose another --regression",
        &[
            "fit-matrix SAMPLES/skies/sky912.exr",
            "fit-matrix SAMPLES/skies/sky912.exr --white-sample 3 --regression sky-rad-sppls",
        ],
    ),
    advice(
        "render-radiance --dark --size 2x2 --expose-to 75 -o out.exr",
        "75 looks like per cent, which is 0.75",
        &["render-radiance named.csv --size 2x2 --expose-to 0.75 -o out.exr"],
    ),
    advice(
        "render-radiance --dark --size 2x2 --lens-transmittance 95 -o out.exr",
        "95 looks like per cent, which is 0.95",
        &["render-radiance --dark --size 2x2 --lens-transmittance 0.95 -o out.exr"],
    ),
    advice(
        "render-radiance --dark --size 2x2 --exposure 33 -o out.exr",
        "33 ms is 0.033 s",
        &["render-radiance --dark --size 2x2 --exposure 0.033 -o out.exr"],
    ),
    advice(
        "render-radiance --dark --size 2x2 --exposure 33ms -o out.exr",
        "it looks like 0.033 s",
        &["render-radiance --dark --size 2x2 --exposure 0.033 -o out.exr"],
    ),
    advice(
        "render-radiance --dark --size 2x2 --f-number f/5.6 -o out.exr",
        "it looks like 5.6",
        &["render-radiance --dark --size 2x2 --f-number 5.6 -o out.exr"],
    ),
    advice(
        "add-noise expected.exr --cte 99.999 -o out.exr",
        "99.999 looks like per cent, which is 0.99999",
        &["add-noise expected.exr --cte 0.99999 --quiet -o out.exr"],
    ),
    advice(
        "add-noise expected.exr --temperature 20 -o out.exr",
        "looks like degrees Celsius, which is 293.15 K",
        &["add-noise expected.exr --temperature 293.15 -o out.exr"],
    ),
    advice(
        "add-noise expected.exr --temperature -20 -o out.exr",
        "looks like degrees Celsius, which is 253.15 K",
        &["add-noise expected.exr --temperature 253.15 -o out.exr"],
    ),
];

/// A workshop with frames of each stage, and with those that the tables speak of.
fn shop() -> Workshop {
    let shop = Workshop::with_frames();
    let head = "schema: cyanometer/1\n";
    let exposure = "exposure: {exposure_s: 0.033, f_number: 8, lens_transmittance: 1}\n";
    let plane = "quantity: adu\ncfa: rggb\nblack_level_adu: 1757\n";
    let sites = "quantity: adu\nblack_level_adu: [1, 2, 3, 4]\n";
    for (name, text) in [
        ("silent.yaml", String::new()),
        ("plane.yaml", plane.to_owned()),
        ("exposed.yaml", format!("{plane}{exposure}")),
        ("expected.yaml", "quantity: expected_electrons\n".to_owned()),
        ("rendered.yaml", format!("quantity: expected_electrons\n{exposure}")),
        ("electrons.yaml", "quantity: electrons\ncfa: rggb\n".to_owned()),
        ("sites.yaml", format!("{sites}{exposure}")),
    ] {
        fs::write(shop.path(name), format!("{head}{text}")).unwrap();
    }
    let rows = "360,0.1\n600,0.2\n830,0.1\n";
    for (name, text) in [
        ("bare.csv", format!("wavelength_nm,radiance\n{rows}")),
        ("named.csv", format!("wavelength_nm,radiance (W m-2 sr-1 nm-1)\n{rows}")),
        ("scaled.csv", format!("wavelength_nm,radiance (100 W m-2 sr-1 nm-1)\n{rows}")),
        ("two.csv", "# Unit: W/m2/sr/nm\nnm,a,b\n360,0.1,0.1\n830,0.2,0.1\n".to_owned()),
        ("micrometers.csv", "wavelength,L W/m2/sr/nm\n0.36,0.1\n0.83,0.2\n".to_owned()),
        ("energies.csv", "E,L W/m2/sr/nm\n1.5,0.1\n3.4,0.2\n".to_owned()),
        ("in_ev.csv", "energy_eV,L W/m2/sr/nm\n1.48,0.1\n3.45,0.2\n".to_owned()),
        ("titled.csv", format!("Sky at noon\n{rows}")),
        ("commented.csv", format!("# Sky at noon, W/m2/sr/nm\n{rows}")),
        ("renamed.csv", "wavelength_um,L W/m2/sr/nm\n0.36,0.1\n0.83,0.2\n".to_owned()),
    ] {
        fs::write(shop.path(name), text).unwrap();
    }
    shop.run("mosaic noisy.exr -o electrons.exr", &[]);
    shop.run("mosaic rgb.exr -o again.exr", &[]);
    shop.pipe("render-radiance --dark --size 8x6 | add-noise | digitize -o dark.exr");
    fs::copy(shop.path("codes.exr"), shop.path("lit.exr")).unwrap();
    let color = "to-xyz rgb.exr --matrix matrix.yaml";
    shop.run(&format!("{color} --space lab -o lab.tiff"), &[]);
    shop.run(&format!("{color} --space lab -o lab.exr"), &[]);
    shop.run(&format!("{color} --space srgb -o srgb.tiff"), &[]);
    let whiteless = "--metadata silent.yaml --exposure 1 --f-number 8 --black 0 -o whiteless.exr";
    shop.run(&format!("{color} {whiteless}"), &[]);
    shop
}

fn follow(table: &[Advice]) {
    let shop = shop();
    for Advice { mistake, says, followed } in table {
        let done = shop.attempt(mistake, &[]);
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(said.contains(says), "{mistake}: {said}");
        // Some are warned of, and done all the same.
        assert_eq!(done.status.success(), said.contains(": warning: "), "{mistake}: {said}");
        for line in *followed {
            let done = shop.attempt(line, &[]);
            let said = String::from_utf8_lossy(&done.stderr);
            assert!(done.status.success() && !said.contains("warning"), "{mistake} advises {says}, but {line}: {said}");
        }
    }
}

#[test]
fn what_metadata_lack_can_be_given() {
    follow(MISSING);
}

#[test]
fn the_program_that_is_named_helps() {
    follow(ORDER);
}

#[test]
fn outputs_are_written_as_advised() {
    follow(OUTPUTS);
}

#[test]
fn spectra_are_read_as_advised() {
    follow(SPECTRA);
}

/// The texts between quotes in the sources of library and programs, tests and documentation left out.
fn texts() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut waiting = vec![PathBuf::from(TREE).join("src")];
    while let Some(place) = waiting.pop() {
        if place.is_dir() {
            waiting.extend(fs::read_dir(place).unwrap().map(|entry| entry.unwrap().path()));
        } else if place.extension().is_some_and(|end| end == "rs") {
            let source = fs::read_to_string(&place).unwrap();
            let code = source.split("#[cfg(test)]").next().unwrap();
            let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            let code =
                lines.map(str::trim_start).collect::<Vec<_>>().join("\n").replace("\\\n", "").replace("\\\"", "'");
            let shown = place.strip_prefix(Path::new(TREE)).unwrap().display().to_string();
            found.extend(code.split('"').skip(1).step_by(2).map(|text| (shown.clone(), text.to_owned())));
        }
    }
    found
}

/// Every option that a text names is one of a program; of that which the text names with it, where it names one.
#[test]
fn options_that_are_named_exist() {
    let all: BTreeSet<String> = programs().iter().filter_map(|program| options_of(program)).flatten().collect();
    let mut checked = 0;
    for (place, text) in texts() {
        for command in text.split('`').skip(1).step_by(2) {
            let Some(known) = options_of(command.split(' ').next().unwrap()) else { continue };
            for name in named(command) {
                assert!(known.contains(&name), "{place}: `{command}` has no --{name}: {known:?}");
                checked += 1;
            }
        }
        let outside: String = text.split('`').step_by(2).collect::<Vec<_>>().join(" ");
        for name in named(&outside).into_iter().filter(|name| !name.contains(['{', '}'])) {
            if UNLISTED.contains(&name.as_str()) {
                continue;
            }
            assert!(all.contains(&name), "{place}: no program has --{name}: {text}");
            checked += 1;
        }
    }
    assert!(checked > 40, "{checked}");
}

/// What the parts of the library belong to: their texts name options that all these programs have.
const OWNERS: [(&str, &[&str]); 16] = [
    ("src/lib/requests/scene/layout.rs", &["render-radiance"]),
    ("src/lib/requests/scene/picture.rs", &["render-radiance"]),
    ("src/lib/requests/scene/illuminated.rs", &["render-radiance"]),
    ("src/lib/requests/scene", &["render-radiance", "predict-noise"]),
    ("src/lib/requests/fit", &["fit-matrix"]),
    ("src/lib/requests/photon_transfer", &["photon-transfer"]),
    ("src/lib/requests/prediction", &["predict-noise"]),
    ("src/lib/requests/correction.rs", &["correct-frame"]),
    ("src/lib/requests/conversion.rs", &["to-xyz"]),
    ("src/lib/requests/comparison.rs", &["color-difference"]),
    ("src/lib/requests/measurement.rs", &["measure"]),
    ("src/lib/requests/picture.rs", &["preview"]),
    ("src/lib/formats/picture", &["preview"]),
    ("src/lib/formats/csv.rs", &["render-radiance", "predict-noise", "fit-matrix"]),
    ("src/lib/formats/radiance_unit.rs", &["render-radiance", "predict-noise", "fit-matrix"]),
    ("src/lib/formats/spectral.rs", &["render-radiance", "predict-noise", "fit-matrix"]),
];

/// A text that several programs may say names no option that one of them lacks, such as --wavelengths of predict-noise.
#[test]
fn options_that_are_named_are_those_of_who_names_them() {
    let mut checked = 0;
    for (place, text) in texts() {
        let Some((_, owners)) = OWNERS.iter().find(|(part, _)| place.starts_with(part)) else { continue };
        // Not what an option is called in the sources, or does in its help; nor what is said to those alone who gave the option.
        let given = ["--rgb, --primaries", "a smaller step of --wavelengths"];
        if !text.contains(' ') || given.iter().any(|begin| text.starts_with(begin)) {
            continue;
        }
        let outside: String = text.split('`').step_by(2).collect::<Vec<_>>().join(" ");
        for (owner, name) in owners.iter().flat_map(|owner| named(&outside).into_iter().map(move |name| (owner, name)))
        {
            let is_there = name.contains(['{', '}']) || options_of(owner).unwrap().contains(&name);
            assert!(is_there || UNLISTED.contains(&name.as_str()), "{place}: {owner} has no --{name}: {text}");
            checked += 1;
        }
    }
    assert!(checked > 40, "{checked}");
}

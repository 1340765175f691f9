//! What tags of a DNG tell of its samples that is not done here, and tags that another program changed in a DNG of ours.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs;
use support::dng::dng_with_ratios;
use support::workshop::{BAD_DATA, Workshop};

const SIZE: [u32; 2] = [12, 10];

/// Writes a DNG of SIZE of such codes, black at 0 and white at 4000, with these tags besides.
fn write(shop: &Workshop, name: &str, of: impl Fn(u16) -> u16, more: &[(u16, &[u32])]) {
    let strip: Vec<u8> = (0..120).flat_map(|at| of(at).to_le_bytes()).collect();
    fs::write(shop.path(name), dng_with_ratios(SIZE, &strip, &[&[(50717, &[4000][..])], more].concat())).unwrap();
}

/// Of codes 0, 33 … 3927 ten lie above nine tenths of the range and below white; saturated ones are told elsewhere.
#[test]
fn samples_that_may_be_far_from_linear_are_counted() {
    let shop = Workshop::new();
    let limit: (u16, &[u32]) = (50734, &[9, 10]);
    write(&shop, "raw.dng", |at| 33 * at, &[limit]);
    let told = "raw.dng: 10 of its samples (8.33 %) lie above 3600 ADU and below saturation, where the response may be far from linear \
                (LinearResponseLimit 0.9)";
    for line in ["measure raw.dng", "import-raw raw.dng -o out.tiff", "demosaic raw.dng -o out.exr"] {
        assert!(shop.said(line, 0).contains(told), "{line}");
    }
    for (of, limit) in [(30, [9, 10]), (33, [1, 1]), (33, [0, 0]), (33, [3, 2])] {
        write(&shop, "raw.dng", |at| of * at, &[(50734, &limit)]);
        assert_eq!(shop.said("measure raw.dng", 0), "", "{of} {limit:?}");
    }
    write(&shop, "raw.dng", |at| if at < 60 { 100 } else { 4000 }, &[limit]);
    assert!(!shop.said("measure raw.dng", 0).contains("linear"));
}

/// A list of opcodes as bytes, each a number of 32 bits here: number, version, flags and four bytes of each.
fn list(opcodes: &[u32]) -> Vec<u32> {
    let whole = |number: u32| number.to_be_bytes().map(u32::from);
    let of_each = opcodes.iter().flat_map(|number| [*number, 0x0103_0000, 0, 4, 7].map(whole).concat());
    whole(u32::try_from(opcodes.len()).unwrap()).into_iter().chain(of_each).collect()
}

#[test]
fn corrections_that_are_not_made_are_told() {
    let shop = Workshop::new();
    for (tag, opcodes, wanted) in [
        (51009, &[9, 9][..], "its OpcodeList2 has GainMap, by which DNG evens out what falls off"),
        (51008, &[8], "its OpcodeList1 has MapPolynomial, by which DNG makes other levels of its samples"),
        (
            51008,
            &[4, 5],
            "its OpcodeList1 has FixBadPixelsConstant, FixBadPixelsList, which tells defective photosites",
        ),
        (51022, &[1, 3], "its OpcodeList3 has FixVignetteRadial, by which"),
        (51022, &[1, 6], ""),
    ] {
        write(&shop, "raw.dng", |at| 300 + at, &[(tag, &list(opcodes))]);
        let said = shop.said("measure raw.dng", 0);
        assert!(said.contains(wanted) && said.is_empty() == wanted.is_empty(), "{opcodes:?}: {said}");
    }
    write(&shop, "raw.dng", |at| 300 + at, &[(50935, &[1, 2])]);
    assert!(shop.said("measure raw.dng", 0).contains("noise was taken out of its samples"));
    write(&shop, "raw.dng", |at| 300 + at, &[(50935, &[0, 0])]);
    assert_eq!(shop.said("measure raw.dng", 0), "");
}

/// Levels of a quad array, no sum of sites, rows and columns: frames are read, and what needs their black says so.
#[test]
fn black_levels_of_many_sites_are_not_known() {
    let shop = Workshop::new();
    let levels: Vec<u32> = (0..16).map(|at| [64, 65, 66, 70][at / 8 * 2 + at % 4 / 2]).collect();
    write(&shop, "raw.dng", |at| 300 + at, &[(50713, &[4, 4]), (50714, &levels)]);
    let told = "raw.dng: its black levels repeat after 4x4 sites (BlackLevelRepeatDim)";
    assert!(shop.said("measure raw.dng", 0).contains(told));
    let said = shop.said("correct-frame raw.dng --black auto -o out.exr", BAD_DATA);
    assert!(said.contains("`black_level_adu`"), "{said}");
    assert!(shop.said("correct-frame raw.dng --black 66 -o out.exr", 0).contains(told));
    let sums: Vec<u32> = (0..16_u32).map(|at| 64 + at / 4 * 3 + at % 4 * 2).collect();
    write(&shop, "raw.dng", |at| 300 + at, &[(50713, &[4, 4]), (50714, &sums)]);
    assert_eq!(shop.said("correct-frame raw.dng --black auto -o out.exr", 0), "");
    for (at, left) in (0_u16..).zip(shop.read("out.exr").0) {
        let [x, y] = [at % 12, at / 12];
        assert!((left - f32::from(300 + at) + f32::from(64 + y % 4 * 3 + x % 4 * 2)).abs() < 1e-4, "{x},{y}");
    }
}

/// The bytes of a file with the value of the first entry changed that has this tag, type and count: where it stands in the table, or where the
/// table says it does.
fn changed(bytes: &[u8], tag: u16, kind: u16, count: u32, change: impl Fn(&mut [u8])) -> Vec<u8> {
    let key =
        [tag.to_le_bytes(), kind.to_le_bytes()].concat().into_iter().chain(count.to_le_bytes()).collect::<Vec<_>>();
    let at = bytes.windows(key.len()).position(|window| window == key).unwrap() + key.len();
    let size = usize::try_from(count).unwrap() * [0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8][usize::from(kind)];
    let place = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let from = if size > 4 { usize::try_from(place).unwrap() } else { at };
    let mut bytes = bytes.to_vec();
    change(&mut bytes[from..from + size]);
    bytes
}

/// Levels, colors and filter array of tags beside those of our metadata in the same file, with the sidecar and without; a frame of a
/// simulation, whose white level is the level of full well, and one of a camera.
#[test]
fn tags_that_another_program_changed_are_told() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 1000,2000,3000 --size 16x12 --cfa rggb | add-noise | digitize -o drawn.dng");
    let colors: [(u16, &[u32]); 2] =
        [(50721, &[8, 10, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 9, 10]), (50728, &[6, 10, 1, 1, 7, 10])];
    write(&shop, "raw.dng", |at| 300 + at, &[&colors[..], &[(50714, &[64]), (34855, &[400])]].concat());
    shop.run("import-raw raw.dng -o camera.dng", &[]);
    let lower = |value: &mut [u8]| {
        let white = u32::from_le_bytes(value.try_into().unwrap()) - 100;
        value.copy_from_slice(&white.to_le_bytes());
    };
    let other = |value: &mut [u8]| value[0] ^= 1;
    let larger = |value: &mut [u8]| value[4] ^= 4;
    let moved = |value: &mut [u8]| value.copy_from_slice(&[1, 0, 2, 1]);
    type Change<'a> = (u16, u16, u32, &'a dyn Fn(&mut [u8]), &'a str);
    let of_white: Change = (50717, 4, 1, &lower, "its white level in ADU is ");
    let of_pattern: Change = (33422, 1, 4, &moved, "its filter array is another by the tags");
    let of_neutral: Change =
        (50728, 5, 3, &larger, "its colors are others by the tags of the file (ColorMatrix1, AsShotNeutral)");
    let of_matrix: Change = (50721, 10, 9, &larger, "its colors are others by the tags");
    let of_speed: Change = (34855, 3, 1, &other, "");
    let cases = [("drawn", of_white), ("drawn", of_pattern), ("camera", of_white), ("camera", of_neutral)];
    for (name, change) in cases.into_iter().chain([("camera", of_matrix), ("camera", of_speed)]) {
        let (tag, kind, count, change, wanted) = change;
        let bytes = changed(&shop.bytes(&format!("{name}.dng")), tag, kind, count, change);
        fs::write(shop.path("alone.dng"), &bytes).unwrap();
        fs::write(shop.path("beside.dng"), &bytes).unwrap();
        fs::copy(shop.path(&format!("{name}.dng.yaml")), shop.path("beside.dng.yaml")).unwrap();
        for file in ["alone.dng", "beside.dng"] {
            let said = shop.said(&format!("measure {file}"), 0);
            // Sensitivities are held to a few per cent.
            assert!(said.contains(wanted) && said.contains("by the tags") != wanted.is_empty(), "{tag} {file}: {said}");
        }
    }
    for file in ["drawn.dng", "camera.dng"] {
        assert!(!shop.said(&format!("measure {file}"), 0).contains("by the tags"), "{file}");
    }
}

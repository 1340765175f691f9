//! Numbers that look wrong, by every way in which they come: no program takes them without a word.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

mod support;

use std::fs;
use support::workshop::Workshop;

/// Replaces a text in a file, which must have it.
#[track_caller]
fn edit(shop: &Workshop, file: &str, from: &str, to: &str) {
    let text = fs::read_to_string(shop.path(file)).unwrap();
    assert!(text.contains(from), "{file}: {text}");
    fs::write(shop.path(file), text.replace(from, to)).unwrap();
}

/// One plane of codes with what belongs to it.
fn codes() -> Workshop {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 1000,2000,3000 --size 16x12 --cfa rggb | add-noise | digitize -o plane.exr");
    shop
}

#[test]
fn exposures_and_lenses_in_other_units_are_told_by_whatever_way_they_come() {
    let shop = codes();
    let long = "an exposure of 33 s is long; 33 ms is 0.033 s";
    let small = "an f-number of 2800 is that of no lens; in thousandths it is 2.8";
    let short = "a focal length of 0.05 mm is that of few lenses; 0.05 m is 50 mm";
    // By options.
    let scene = "--electrons 1,2,3 --size 8x6";
    for (line, wanted) in [
        (format!("render-radiance {scene} --f-number 2800 -o a.exr"), small),
        (format!("render-radiance {scene} --exposure 33 -o a.exr"), long),
        (format!("render-radiance {scene} --vignetting --focal-length 0.05 -o a.exr"), short),
        ("predict-noise --electrons 1,2,3 --f-number 2800".into(), small),
        ("fit-matrix sky912.exr --f-number 2800 -o m.yaml".into(), small),
    ] {
        assert!(shop.said(&line, 0).contains(wanted), "{line}");
    }
    shop.run("predict-noise --electrons 1,2,3 --f-number 180", &[]);
    // By metadata: the sidecar of a frame that another program of ours wrote, a file that is given, and one without a history.
    fs::copy(shop.path("plane.exr.yaml"), shop.path("given.yaml")).unwrap();
    for file in ["given.yaml", "plane.exr.yaml"] {
        edit(&shop, file, "exposure_s: 0.033", "exposure_s: 33.0");
        edit(&shop, file, "f_number: 8.0", "f_number: 2800.0");
    }
    let said = shop.said("measure plane.exr --metadata given.yaml", 0);
    assert!(said.contains(long) && said.contains(small), "{said}");
    let said = shop.said("measure plane.exr", 0);
    assert!(said.contains("its exposure time in s is 33, but 0.033 in the file of the frame; the sidecar counts"), "{said}");
    fs::write(shop.path("short.yaml"), "schema: cyanometer/1\nquantity: adu\nexposure_time_s: 33.0\n").unwrap();
    let said = shop.said("measure plane.exr --metadata short.yaml", 0);
    assert!(said.contains(long), "{said}");
}

//! Everyday use: tables as people have them, and what is said where a word would help.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

/// What a program says of a run that ends well.
fn told(shop: &Workshop, line: &str) -> String {
    let done = shop.attempt(line, &[]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{line}: {said}");
    said
}

#[test]
fn uncertainties_are_no_spectra() {
    let shop = Workshop::new();
    let rows = |with: bool| -> String {
        let row = |nm: u32| format!("{nm},{}{}\n", f64::from(nm) * 1e-9, if with { ",3.5" } else { "" });
        (36..=83).map(|ten| row(10 * ten)).collect()
    };
    let unit = "radiance (W cm-2 sr-1 nm-1)";
    fs::write(shop.path("plain.csv"), format!("nm,{unit}\n{}", rows(false))).unwrap();
    fs::write(shop.path("with.csv"), format!("nm,{unit},uncertainty (%)\n{}", rows(true))).unwrap();
    let line = |name: &str| format!("render-radiance {name}.csv --size 4x4 -o {name}.exr");
    assert_eq!(told(&shop, &line("plain")), "");
    assert!(
        told(&shop, &line("with")).contains("with.csv: by its name `uncertainty (%)` is an uncertainty, no spectrum")
    );
    assert_eq!(shop.frame("plain.exr").samples, shop.frame("with.exr").samples);
}

/// What marks quality makes no black patch, and what marks a missing value no light.
#[test]
fn marks_are_no_radiances() {
    let shop = Workshop::new();
    let rows =
        |more: &str| -> String { (36..=83).map(|ten| format!("{}0,{}{more}\n", ten, f64::from(ten) * 1e-3)).collect() };
    let unit = "radiance (W m-2 sr-1 nm-1)";
    fs::write(shop.path("plain.csv"), format!("nm,{unit}\n{}", rows(""))).unwrap();
    fs::write(shop.path("flagged.csv"), format!("nm,{unit},quality flag\n{}", rows(",0"))).unwrap();
    for name in ["plain", "flagged"] {
        let said = told(&shop, &format!("render-radiance {name}.csv --exposure 0.005 --size 4x4 -o {name}.exr"));
        assert_eq!(said.contains("`quality flag` is a flag, no spectrum"), name == "flagged", "{said}");
    }
    assert_eq!(shop.frame("plain.exr").samples, shop.frame("flagged.exr").samples);
    for fill in ["-999", "-9999", "9.96921e36", "9.969209968386869E+36", "9.97e36", "1e20", "-9999.0", "1.0E+20"] {
        fs::write(shop.path("filled.csv"), format!("nm,{unit}\n400,0.1\n\n500,{fill}\n600,0.2\n")).unwrap();
        let refused = shop.said("render-radiance filled.csv --size 4x4 -o a.exr", BAD_DATA);
        let wanted = format!("filled.csv: line 4, column 2: `{fill}` marks a value that is missing; leave out its row");
        assert!(refused.contains(&wanted), "{refused}");
    }
    for (name, kind) in [
        ("sqrt radiance", "a logarithm or a root, not the radiance itself"),
        ("ln(L)", "of log10 take 10^value, of ln e^value, of sqrt value^2"),
        ("normalized radiance", "of no scale"),
    ] {
        for heading in [name.to_owned(), format!("{name} (W m-2 sr-1 nm-1)")] {
            fs::write(shop.path("made.csv"), format!("nm,{heading}\n400,0.1\n600,0.2\n")).unwrap();
            let refused = shop.said("render-radiance made.csv --size 4x4 -o a.exr", BAD_DATA);
            assert!(refused.contains(&format!("its values are in `{heading}`")) && refused.contains(kind), "{refused}");
        }
    }
}

/// That there are several spectra is told before their unit is asked for; that the first is none, before that.
#[test]
fn several_spectra_are_told_before_their_unit() {
    let shop = Workshop::new();
    let said = |text: &str, options: &str| {
        fs::write(shop.path("t.csv"), text).unwrap();
        String::from_utf8(shop.attempt(&format!("render-radiance t.csv{options} --size 4x4 -o a.exr"), &[]).stderr)
            .unwrap()
    };
    let several = "t.csv: it holds 2 spectra, a, b; choose one with --column NAME or --sample N";
    let numbers = "400,1,2\n700,2,1\n";
    for heading in ["nm,a,b", "wavenumber (cm-1),a,b"] {
        let numbers = if heading.starts_with("nm") { numbers } else { "14000,1,2\n25000,2,1\n" };
        let found = said(&format!("{heading}\n{numbers}"), "");
        assert!(found.contains(several), "{heading}: {found}");
    }
    let found = said(&format!("nm,a,b\n{numbers}"), " --column b");
    assert!(found.contains("it does not say the unit of its radiance"), "{found}");
    let found = said(&format!("nm,edir,uu\n{numbers}"), "");
    assert!(found.contains("`edir`, an irradiance") && found.contains("`uu` may hold them"), "{found}");
    let rows = said("# W m-2 sr-1 nm-1\nname,L_400,L_550,L_700\na,0.1,0.1,0.1\nb,0.2,0.1,0.1\n", "");
    assert!(rows.contains(several), "{rows}");
}

/// The same light counted by wavelength, and by the energy of its photons per nm and per eV, of which 1 eV is λ²/1239.84 nm.
#[test]
fn energies_of_photons_are_the_wavelengths_that_they_have() {
    const NM_EV: f64 = 1_239.841_984;
    let shop = Workshop::new();
    // Smooth, and so finely sampled that straight lines between are as good in all.
    let light = |nm: f64| 0.1 + 0.05 * (nm / 60.0).sin();
    let rows = |row: &dyn Fn(f64) -> String| -> String { (350..=850).map(|nm| row(f64::from(nm))).collect() };
    let unit = "W m-2 sr-1";
    let ev = |nm: f64| NM_EV / nm;
    for (name, heading, text) in [
        ("nm", format!("nm,L ({unit} nm-1)"), rows(&|nm| format!("{nm},{}\n", light(nm)))),
        ("ev", format!("photon energy (eV),L ({unit} nm-1)"), rows(&|nm| format!("{:.9},{}\n", ev(nm), light(nm)))),
        (
            "density",
            format!("energy_eV,L ({unit} eV-1)"),
            rows(&|nm| format!("{:.9},{:.9}\n", ev(nm), light(nm) * nm * nm / NM_EV)),
        ),
    ] {
        fs::write(shop.path(&format!("{name}.csv")), format!("{heading}\n{text}")).unwrap();
        shop.run(&format!("render-radiance {name}.csv --exposure 0.004 --size 2x2 -o {name}.exr"), &[]);
    }
    let wanted = shop.frame("nm.exr").samples;
    for name in ["ev", "density"] {
        let found = shop.frame(&format!("{name}.exr")).samples;
        assert!(found.iter().zip(&wanted).all(|(a, b)| (a / b - 1.0).abs() < 1e-4), "{name}: {found:?} {wanted:?}");
    }
    fs::write(shop.path("bare.csv"), "energy_eV,L\n1.5,0.1\n3.4,0.2\n").unwrap();
    let refused = shop.said("render-radiance bare.csv --size 2x2 -o a.exr", BAD_DATA);
    assert!(
        refused.contains("it is by photon energy and does not say whether its radiance is per nm or per eV"),
        "{refused}"
    );
}

#[test]
fn spectra_that_come_with_the_programs_are_told_where_frames_are_wanted() {
    let shop = Workshop::new();
    for line in ["measure clear_zenith.csv", "add-noise clear_zenith.csv -o a.exr", "preview clear_zenith -o a.png"] {
        let refused = shop.said(line, BAD_DATA);
        assert!(refused.contains("`render-radiance clear_zenith.csv` makes a frame of it"), "{refused}");
    }
}

#[test]
fn relative_radiances_are_warned_of() {
    let shop = Workshop::new();
    fs::write(shop.path("lamp.csv"), "nm,lamp (a.u.)\n360,1e-3\n830,2e-3\n").unwrap();
    let refused = shop.said("render-radiance lamp.csv --size 4x4 -o a.exr", BAD_DATA);
    assert!(
        refused.contains("`a.u.`, of no scale, which does not tell how bright the light is; give --radiance-unit"),
        "{refused}"
    );
    let line = "render-radiance lamp.csv --radiance-unit W/m2/sr/nm --expose-to 0.5 --size 4x4 -o a.exr";
    let said = told(&shop, line);
    assert!(said.contains("they count as W m-2 sr-1 nm-1, as --radiance-unit says"), "{said}");
    let refused = shop.said("render-radiance lamp.csv --radiance-unit a.u. --size 4x4 -o a.exr", BAD_USAGE);
    assert!(refused.contains("that is of no scale"), "{refused}");
}

#[test]
fn a_light_by_wavenumber_is_refused_whatever_its_rows_are() {
    let shop = Workshop::with_frames();
    shop.run("to-xyz rgb.exr --space srgb -o picture.tiff", &[]);
    fs::write(shop.path("lamp.csv"), "nm,L (mW/(m2 sr cm-1))\n360,1\n830,2\n").unwrap();
    let refused = shop.said("render-radiance picture.tiff --illuminant lamp.csv -o a.exr", BAD_DATA);
    assert!(refused.contains("a light by wavenumber is not read; give its power per nm by wavelength"), "{refused}");
}

#[test]
fn the_matrix_of_the_sensor_is_named_as_for_predictions() {
    let shop = Workshop::with_frames();
    let own = told(&shop, "to-xyz rgb.exr -o own.exr");
    assert_eq!(told(&shop, "to-xyz rgb.exr --matrix sensor -o named.exr"), own);
    assert_eq!(shop.frame("own.exr").samples, shop.frame("named.exr").samples);
    let refused = shop.said("to-xyz named.exr --matrix sensor --space lab -o lab.exr", BAD_USAGE);
    assert!(refused.contains("leave out --matrix"), "{refused}");
}

#[test]
fn what_is_typed_wrong_is_told_what_it_may_be() {
    let shop = Workshop::with_frames();
    for (line, status, wanted) in [
        (
            "cyanometer measur codes.exr --plot a.svg",
            BAD_USAGE,
            "there is no program `measur`; did you mean `measure`?",
        ),
        ("cyanometer help digitise", BAD_USAGE, "there is no program `digitise`; did you mean `digitize`?"),
        ("cyanometer sky.csv", BAD_USAGE, "there is no program `sky.csv`; `cyanometer` alone lists the programs"),
        ("measure codes.ex", BAD_DATA, "codes.ex: cannot open: no such file or directory; did you mean `codes.exr`?"),
        (
            "to-xyz rgb.exr --matrix kaf-5101ce -o x.exr",
            BAD_DATA,
            "kaf-5101ce: that is a sensor, and a file of a matrix is wanted; `fit-matrix sky912.exr --sensor kaf-5101ce -o matrix.yaml` \
             makes one for it",
        ),
        (
            "preview codes.exr --range 9,1 -o a.png",
            BAD_USAGE,
            "codes.exr: a range from 9 to 1 shows nothing; --range takes black first and then white, which is larger",
        ),
        (
            "preview codes.exr noisy.exr --caption -o a.png",
            BAD_USAGE,
            "the frames of a sheet have captions, which say what each is; leave out --caption",
        ),
    ] {
        let said = shop.said(line, status);
        assert!(said.contains(wanted), "{line}: {said}");
    }
}

/// In 33 s the dark signal of the default sensor fills its codes.
#[test]
fn an_exposure_without_codes_for_light_is_told() {
    let shop = Workshop::new();
    let line = "fit-matrix SAMPLES/skies/sky912.exr --exposure 33 --evaluate SAMPLES/skies/sky912.exr -o m.yaml";
    let said = shop.said(line, BAD_DATA);
    let wanted = "in 33 s the dark signal fills the range of the codes, and no white saturates the camera; expose for a shorter time; \
                  give --white-luminance";
    assert!(said.contains(wanted), "{said}");
}

/// Keys and values of sensor files as people write them first.
#[test]
fn sensor_files_are_told_what_to_write() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 900,900,900 --size 4x4 -o e.exr", &[]);
    let whole = fs::read_to_string(format!("{}/sample_data/sensors/kaf-5101ce.yaml", support::TREE)).unwrap();
    for (from, to, wanted) in [
        ("read_noise_e: 15.7", "read_noise_e: 15,7", "is `15,7`, not a number (line 29, column 15); write 15.7"),
        (
            "prnu: 0.008",
            "prnu: 0.8%",
            "is `0.8%`, not a number (line 25, column 7); write it as a fraction of 1, 0.008",
        ),
        ("bits: 12", "bits: 12.0", "; write 12"),
        ("bits: 12", "bit_depth: 12", "here it is `bits`, bits of the converter"),
        ("temperature_k: 333", "temperature_k: 60 C", "; write 333.15, which is 60 C in K"),
        ("bits: 12", "bits:12", "a key lacks its colon, or the blank behind it, at or above this place"),
        ("adu_per_e:", "e_per_adu:", "unknown key `e_per_adu`; here it is `adu_per_e`, its inverse"),
        (
            "temperature_k: 333",
            "temperature_c: 60",
            "here it is `temperature_k`, in K, 273.15 more than degrees Celsius",
        ),
        (
            "quantum_efficiency: {file: kaf5101ce_est_qe_1nm.csv}",
            "quantum_efficiency: qe.csv",
            "not a list of keys and values (line 17, column 21); a file is named so: {file: qe.csv}",
        ),
    ] {
        assert!(whole.contains(from), "{from}");
        fs::write(shop.path("s.yaml"), whole.replacen(from, to, 1)).unwrap();
        let said = shop.said("add-noise e.exr --sensor s.yaml -o n.exr", BAD_DATA);
        assert!(said.contains(wanted), "{to}: {said}");
    }
}

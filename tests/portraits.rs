//! What figures of frames show: beside the prediction, and beside sums of a few lines.

use crate::support;
use cyanometer::analysis::statistics::portrait::{LAGS, Portrait};
use cyanometer::analysis::statistics::{Laws, Region, Report, Saturated, measure_with_portrait};
use cyanometer::frame::Geometry;
use cyanometer::plot::Marks;
use cyanometer::propagation::Equations;
use cyanometer::stream::MemoryFrame;
use cyanometer::units::QuantityKind;
use support::workshop::{BAD_USAGE, Workshop};
use support::{frame, header};

fn drawn(frame: &MemoryFrame, regions: &[Region]) -> (Report, Portrait) {
    measure_with_portrait(&mut Laws::default(), &mut frame.clone(), regions, Saturated::LeftOut, Equations::Exact, None)
        .expect("a frame is measured")
}

/// Autocorrelations, means of columns and rows, and the law of frames of 200 × 160 are as predicted, at all stages.
///
/// A correlation of n pairs has a standard error of at most √(Σ ρ²/n) over all lags, both axes together; Σ ρ² is below 6 for ECI and
/// XYZ of it. 5 standard errors: 0.07 of 32 000 pixels, 0.06 of 8000 independent samples. Squares of so many points of a profile, over
/// their variance, are 1 within 5·√(2·2.5/points), as neighbors of demosaicked pixels hang together.
#[test]
fn frames_look_as_predicted() {
    let shop = Workshop::new();
    shop.run("fit-matrix SAMPLES/skies/sky912.exr -o matrix.yaml", &[]);
    shop.run("render-radiance --electrons 8000,12000,20000 --size 200x160 -o expected.exr", &[]);
    shop.run("add-noise expected.exr --seed 5 -o noisy.exr", &[]);
    shop.run("digitize noisy.exr -o codes.exr", &[]);
    shop.run("mosaic codes.exr -o plane.exr", &[]);
    shop.run("demosaic plane.exr --method eci -o rgb.exr", &[]);
    shop.run("to-xyz rgb.exr --matrix matrix.yaml -o xyz.exr", &[]);
    for name in ["noisy.exr", "codes.exr", "plane.exr", "rgb.exr", "xyz.exr"] {
        let (report, portrait) = drawn(&shop.frame(name), &[]);
        let region = &report.regions[0];
        let reports = if region.classes.is_empty() { &region.channels } else { &region.classes };
        assert_eq!(portrait.groups.len(), 3, "{name}");
        assert_eq!(portrait.is_whole, ["codes.exr", "plane.exr"].contains(&name));
        let mut largest = 0.0_f64;
        for (group, report) in portrait.groups.iter().zip(reports) {
            assert_eq!(group.name, report.name);
            assert_eq!(group.histogram.total(), report.count);
            let (mean, std) = (group.mean().unwrap(), group.std().unwrap());
            assert!((mean - report.mean.unwrap()).abs() < 1e-9 * mean, "{name}: {mean}");
            assert!((std / report.std.unwrap() - 1.0).abs() < 1e-4, "{name}: {std}");
            let foreseen = group.predicted.as_ref().unwrap();
            assert_eq!(foreseen.mean, report.predicted_mean.unwrap());
            let of_phases = foreseen.stds.iter().map(|std| std * std).sum::<f64>() / foreseen.stds.len() as f64;
            assert!((of_phases.sqrt() / report.predicted_std.unwrap() - 1.0).abs() < 1e-9, "{name}");
            for axis in 0..2 {
                let predicted = &foreseen.correlations.as_ref().unwrap()[axis];
                assert_eq!(predicted.len(), LAGS);
                for (one, predicted) in group.correlations[axis].iter().zip(predicted) {
                    let value = one.value.unwrap();
                    assert!(
                        (value - predicted).abs() < 0.07,
                        "{name} {} lag {}: {value}, not {predicted}",
                        group.name,
                        one.lag
                    );
                    largest = largest.max(value.abs());
                }
                let std = foreseen.profile_std.unwrap()[axis];
                let squares: Vec<f64> =
                    group.profiles[axis].points().map(|[_, mean]| ((mean - foreseen.mean) / std).powi(2)).collect();
                let ratio = squares.iter().sum::<f64>() / squares.len() as f64;
                let tolerance = 5.0 * (5.0 / squares.len() as f64).sqrt();
                assert!((ratio - 1.0).abs() < tolerance.min(0.9), "{name} {} axis {axis}: {ratio}", group.name);
            }
        }
        // Demosaicked neighbors hang together, others do not.
        assert_eq!(largest > 0.2, ["rgb.exr", "xyz.exr"].contains(&name), "{name}: {largest}");
    }
}

/// Sums of a few lines: a pattern of two columns, one sample that is not finite, a region that begins off the corner.
#[test]
fn profiles_correlations_and_bins_are_those_of_plain_sums() {
    let head = header(QuantityKind::Electrons, Geometry::new(12, 9, &["R", "G", "B"]));
    let value = |x: usize, y: usize, channel: usize| match (x, y) {
        (5, 4) => f32::NAN,
        _ => (10 * channel + 3 * (x % 2)) as f32 + ((x * 7 + y * 5) % 11) as f32 / 4.0,
    };
    let region = Region { x: 3, y: 2, width: 8, height: 6 };
    let (_, portrait) = drawn(&frame(head, value), &[region]);
    for (channel, group) in portrait.groups.iter().enumerate() {
        let sample = |x: usize, y: usize| f64::from(value(x + 3, y + 2, channel));
        let finite = |values: Vec<f64>| -> Vec<f64> { values.into_iter().filter(|value| value.is_finite()).collect() };
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let all = finite((0..6).flat_map(|y| (0..8).map(move |x| (x, y))).map(|(x, y)| sample(x, y)).collect());
        assert_eq!((all.len() as u64, group.histogram.total()), (47, 47));
        for (bin, count) in &group.histogram.counts {
            let (from, to) = (group.histogram.begin(*bin), group.histogram.begin(bin + 1));
            assert_eq!(all.iter().filter(|value| (from..to).contains(*value)).count() as u64, *count);
        }
        let columns: Vec<[f64; 2]> = group.profiles[0].points().collect();
        for (x, [at, seen]) in columns.into_iter().enumerate() {
            let wanted = mean(&finite((0..6).map(|y| sample(x, y)).collect()));
            assert!(at == x as f64 && (seen - wanted).abs() < 1e-12, "{x}: {seen}");
        }
        let variance = mean(&all.iter().map(|value| (value - mean(&all)).powi(2)).collect::<Vec<_>>());
        for (axis, lag) in [(0, 1), (0, 2), (1, 1), (1, 3)] {
            let (dx, dy) = [(lag, 0), (0, lag)][axis];
            let pairs: Vec<(f64, f64)> = (0..6 - dy)
                .flat_map(|y| (0..8 - dx).map(move |x| (x, y)))
                .map(|(x, y)| (sample(x, y), sample(x + dx, y + dy)))
                .filter(|(a, b)| a.is_finite() && b.is_finite())
                .collect();
            let [a, b] = [pairs.iter().map(|p| p.0).collect::<Vec<_>>(), pairs.iter().map(|p| p.1).collect()];
            let covariance = mean(&pairs.iter().map(|(x, y)| (x - mean(&a)) * (y - mean(&b))).collect::<Vec<_>>());
            let seen = group.correlations[axis][lag - 1];
            assert!((seen.value.unwrap() - covariance / variance).abs() < 1e-6, "axis {axis}, lag {lag}: {seen:?}");
        }
    }
}

#[test]
fn a_figure_has_its_panels_and_what_it_cannot_be_is_told() {
    let shop = Workshop::with_frames();
    let text = |line: &str| {
        shop.run(&format!("{line} --plot plot.svg"), &[]);
        String::from_utf8(shop.bytes("plot.svg")).unwrap()
    };
    for (line, wanted, missing) in [
        (
            "measure noisy.exr",
            &["predicted: normal", "mean − predicted mean / e⁻", "distance along y", "/ e⁻"][..],
            "ellipse",
        ),
        ("measure codes.exr", &["predicted: normal, rounded", "share per ADU"], "95 %"),
        ("measure plane.exr", &["a CFA plane of ADU", "row, 2 together", "predicted ±σ of a mean"], "95 %"),
        ("measure rgb.exr", &["predicted: normal by phase"], "95 %"),
        ("measure xyz.exr", &["measured, 95 %", "predicted, 95 %", "cd m⁻²"], "rounded"),
        ("measure expected.exr --region 1,1,5,4", &["5 × 4"], "rounded"),
    ] {
        let svg = text(line);
        assert!(svg.starts_with("<svg") && !svg.contains("NaN"), "{line}");
        for words in wanted {
            assert!(svg.contains(words), "{line}: no {words}");
        }
        assert!(!svg.contains(missing), "{line}: {missing}");
    }
    shop.run("measure xyz.exr --plot plot.png -o report.txt", &[]);
    assert!(shop.bytes("plot.png").starts_with(b"\x89PNG"));
    // The report is the same with a plot.
    assert_eq!(shop.bytes("report.txt"), shop.run("measure xyz.exr", &[]));
    for line in [
        "measure xyz.exr --plot plot.pdf",
        "measure xyz.exr --plot x.svg --region 0,0,2,2 --region 1,1,2,2",
        "measure xyz.exr --plot x.svg --patches=2x2",
        "measure xyz.exr --plot xyz.exr",
    ] {
        assert_eq!(shop.attempt(line, &[]).status.code(), Some(BAD_USAGE), "{line}");
    }
    assert!(!shop.path("x.svg").exists());
}

/// All that a figure says, lines that belong together too.
fn words(svg: &str) -> String {
    let lines = svg.split("</text>").filter_map(|before| before.rsplit('>').next());
    lines.collect::<Vec<_>>().join(" ")
}

/// One sample far off leaves the scale to all others, and is told; so are its row and column.
#[test]
fn samples_far_off_do_not_make_the_scale() {
    let shop = Workshop::new();
    let noise = |place: u16| 1000.0 + 10.0 * (f32::from(place.wrapping_mul(7919) % 997) / 997.0 - 0.5);
    for (far, said) in
        [(vec![], [false; 3]), (vec![(7, 1e6)], [true; 3]), (vec![(64 * 30 + 5, -1e6), (64 * 31 + 9, 3e4)], [true; 3])]
    {
        let mut samples: Vec<f32> = (0..64 * 48).map(noise).collect();
        far.iter().for_each(|(place, value)| samples[*place] = *value);
        let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
        std::fs::write(shop.path("a.bin"), bytes).unwrap();
        shop.run("measure --raw 64x48:f32le a.bin --plot plot.svg", &[]);
        let svg = String::from_utf8(shop.bytes("plot.svg")).unwrap();
        let count = far.len();
        let wanted = [
            format!("{count} of 3072 samples beyond the axes, as far as "),
            format!("{count} of 64 means of columns beyond the axes, as far as "),
            format!("{count} of 48 means of rows beyond the axes, as far as "),
        ];
        let all = words(&svg);
        assert_eq!(wanted.map(|words| all.contains(&words)), said, "{far:?}");
        // Ticks tell the scale of the others.
        assert!(!svg.contains(">1.0·10⁶<") && !svg.contains(">500000<"), "{far:?}");
    }
}

/// What lies within the axes of a panel is drawn and not told as beyond, though it is beyond the middle of its own class.
#[test]
fn what_another_class_makes_room_for_is_not_beyond() {
    let shop = Workshop::new();
    // R within 1 of 1000 but for a sample 30 off, which B's spread of 100 has room for; one of G is beyond all.
    let head = header(QuantityKind::Electrons, Geometry::new(64, 48, &["R", "G", "B"]));
    let part = |x: usize, y: usize, channel: usize| ((x * 131 + y * 7919 + channel * 17) % 997) as f32 / 997.0 - 0.5;
    let sample = |x: usize, y: usize, channel: usize| match (channel, x, y) {
        (0, 7, 0) => 1030.0,
        (1, 9, 3) => 2000.0,
        (2, ..) => 1000.0 + 200.0 * part(x, y, channel),
        _ => 1000.0 + 2.0 * part(x, y, channel),
    };
    let made = frame(head, sample);
    shop.write("a.exr", &made.header, &made.samples);
    assert!(shop.attempt("measure a.exr --plot plot.svg", &[]).status.success());
    let all = words(&String::from_utf8(shop.bytes("plot.svg")).unwrap());
    let wanted = format!("1 of {} samples beyond the axes, as far as 100", 3 * 64 * 48);
    assert!(all.contains(&wanted), "{all}");
}

/// A heap of saturated samples leaves the axis to all others, and is told; no normal law is drawn over it. Nothing is heaped where all is within the codes.
#[test]
fn saturated_samples_do_not_make_the_scale() {
    let shop = Workshop::new();
    let figure = |electrons: &str| {
        let render = format!("render-radiance --electrons {electrons} --size 200x160 -o expected.exr");
        for line in [&render, "add-noise expected.exr --seed 3 -o noisy.exr", "digitize noisy.exr -o codes.exr"] {
            assert!(shop.attempt(line, &[]).status.success(), "{line}");
        }
        assert!(shop.attempt("measure codes.exr --plot plot.svg", &[]).status.success());
        String::from_utf8(shop.bytes("plot.svg")).unwrap()
    };
    let is_law = |line: &&str| line.contains("stroke=\"#000000\"") && line.contains("stroke-dasharray");
    let laws = |svg: &str| svg.lines().filter(is_law).count();
    let (plain, saturated) = (figure("8000,12000,20000"), figure("8000,12000,40100"));
    assert!(!plain.contains("in its highest bin"));
    assert!(words(&saturated).contains(" % of B in its highest bin, beyond the axis"));
    assert!(laws(&plain) > laws(&saturated), "{} {}", laws(&plain), laws(&saturated));
    // Electrons at full well are spread by read noise: no heap, but no normal law either.
    assert!(shop.attempt("measure noisy.exr --plot full.svg", &[]).status.success());
    let full = String::from_utf8(shop.bytes("full.svg")).unwrap();
    assert!(words(&full).contains("no law drawn over B: full well clips it"), "{}", words(&full));
    figure("8000,12000,20000");
    assert!(shop.attempt("measure noisy.exr --plot open.svg", &[]).status.success());
    let open = String::from_utf8(shop.bytes("open.svg")).unwrap();
    assert!(laws(&open) > laws(&full) && !words(&open).contains("no law"), "{}", words(&open));
}

/// A law of which hot photosites make the spread shows no other sample, and is not drawn; where they make next to nothing of it, it is.
#[test]
fn no_law_is_drawn_of_what_hot_photosites_make() {
    let shop = Workshop::new();
    let template = shop.run("cyanometer template sensor", &[]);
    std::fs::write(shop.path("sensor.yaml"), template).unwrap();
    let figure = |excess: &str, electrons: &str| {
        let sensor = std::fs::read_to_string(shop.path("sensor.yaml")).unwrap();
        let hot = format!("readout:\n  hot_pixel_share: 0.001\n  hot_pixel_dark_current_e_per_s: {excess}\n");
        std::fs::write(shop.path("hot.yaml"), sensor.replacen("readout:\n", &hot, 1)).unwrap();
        let render = format!("render-radiance --electrons {electrons} --size 64x48 --sensor hot.yaml -o expected.exr");
        for line in [
            &render,
            "add-noise expected.exr --seed 3 -o noisy.exr",
            "digitize noisy.exr -o codes.exr",
            "measure codes.exr --plot plot.svg",
        ] {
            assert!(shop.attempt(line, &[]).status.success(), "{line}");
        }
        words(&String::from_utf8(shop.bytes("plot.svg")).unwrap())
    };
    let (told, law) = ("no law drawn: few photosites far off make its spread", "predicted: normal, rounded");
    // Excesses of 33 and 3300 e- in 33 ms beside 30 e- of noise or more: 2·10⁻³·33² e-² and 2·10⁻³·3300² e-².
    for (excess, electrons, is_told) in
        [("1000", "100,100,100", false), ("100000", "100,100,100", true), ("10000", "30000,30000,30000", false)]
    {
        let all = figure(excess, electrons);
        assert_eq!((all.contains(told), all.contains(law)), (is_told, !is_told), "{excess} {electrons}: {all}");
    }
}

/// Color temperatures are shown by their inverses, in which equal steps are equally visible: 4000 K are 250 MK⁻¹.
#[test]
fn color_temperatures_are_shown_by_their_inverses() {
    let shop = Workshop::with_frames();
    assert!(shop.attempt("to-xyz rgb.exr --matrix matrix.yaml --space cct -o cct.exr", &[]).status.success());
    let mut frame = shop.frame("cct.exr");
    let kelvin = |place: usize| if place.is_multiple_of(2) { 4000.0 } else { 1e6 };
    let [width, planes] = [frame.header.geometry.width, frame.header.geometry.channels.len()];
    for row in frame.samples.chunks_exact_mut(width * planes) {
        row[..width].iter_mut().enumerate().for_each(|(place, sample)| *sample = kelvin(place));
    }
    let (_, portrait) = drawn(&frame, &[]);
    let inverse = &portrait.groups[0];
    assert_eq!((inverse.name.as_str(), portrait.unit.as_str()), ("1/CCT", "MK-1, 1, cd m-2"));
    // Half of the pixels of an even number of columns each: 250 and 1.
    assert!((inverse.mean().unwrap() - 125.5).abs() < 1e-4, "{:?}", inverse.mean());
    assert!(inverse.histogram.ends.iter().zip([1.0, 250.0]).all(|(end, wanted)| (end - wanted).abs() < 1e-4));
    assert!(shop.attempt("measure cct.exr --plot plot.svg", &[]).status.success());
    let svg = String::from_utf8(shop.bytes("plot.svg")).unwrap();
    assert!(svg.contains("sample − mean / MK⁻¹") && svg.contains(">1/CCT</text>"));
}

/// Channels of several units have panels of their own; a single row has neither a profile along y nor pairs.
#[test]
fn units_and_single_rows_have_the_panels_that_they_can_have() {
    let shop = Workshop::with_frames();
    shop.run("to-xyz rgb.exr --matrix matrix.yaml --space xyy -o xyy.exr", &[]);
    for (line, panels, labels) in [
        // Two of histograms, four of profiles, two of correlations.
        ("xyy.exr", 8, &[("share per cd m⁻²", 1), ("density", 1), (" / cd m⁻²", 3)][..]),
        // Of XYZ one of a histogram, one of chromaticities, a profile and a correlation.
        (
            "xyz.exr --region 0,2,8,1",
            4,
            &[("distance along x / pixels", 1), ("distance along y / pixels", 0), ("row", 0)],
        ),
        ("xyz.exr --region 3,0,1,6", 4, &[("distance along x / pixels", 0), ("column", 0), ("row", 1)]),
    ] {
        shop.run(&format!("measure {line} --plot plot.svg"), &[]);
        let svg = String::from_utf8(shop.bytes("plot.svg")).unwrap();
        assert_eq!(svg.matches("<clipPath").count(), panels, "{line}");
        for (label, count) in labels {
            assert_eq!(svg.matches(&format!("{label}</text>")).count(), *count, "{line}: {label}");
        }
    }
    // Profiles name what their colors are, as correlations do; the histogram has the mean as well.
    shop.run("measure noisy.exr --plot plot.svg", &[]);
    let svg = String::from_utf8(shop.bytes("plot.svg")).unwrap();
    let report: serde_json::Value =
        serde_json::from_slice(&shop.run("measure noisy.exr --output-format json", &[])).unwrap();
    let green = &report["regions"][0]["channels"][1];
    let mean = green["mean"].as_f64().unwrap();
    let predicted = green["predicted_mean"].as_f64().unwrap();
    let told = format!(">G, mean {mean:.2} e⁻, predicted {predicted:.2}</text>");
    assert!((mean - predicted).abs() > 0.01, "{mean} {predicted}");
    assert_eq!((svg.matches(">G</text>").count(), svg.matches(&told).count()), (4, 1), "{told}");
}

/// Samples of which the first is farther from others than the largest single: all count, in mean, spread and correlations. Sums of
/// doubles: 10⁻¹² of the range; correlations as of the same frame 2¹⁰⁰ times as small, but for what singles round.
#[test]
fn ranges_larger_than_any_single_are_shown() {
    let value = |x: usize, y: usize| if (x + y).is_multiple_of(3) { f32::MAX } else { -0.75 * f32::MAX };
    let of = |factor: f32| {
        let head = header(QuantityKind::Unspecified, Geometry::new(12, 9, &["Y"]));
        drawn(&frame(head, |x, y, _| factor * value(x, y)), &[])
    };
    let ((report, portrait), (_, small)) = (of(1.0), of(2.0_f32.powi(-100)));
    let (group, small, channel) = (&portrait.groups[0], &small.groups[0], &report.regions[0].channels[0]);
    let range = 2.0 * f64::from(f32::MAX);
    assert!((group.mean().unwrap() - channel.mean.unwrap()).abs() < 1e-12 * range, "{:?}", group.mean());
    // That of the report has one degree of freedom less.
    let std = channel.std.unwrap() * (107.0_f64 / 108.0).sqrt();
    assert!((group.std().unwrap() / std - 1.0).abs() < 1e-6, "{:?} {std}", group.std());
    for axis in 0..2 {
        for (one, wanted) in group.correlations[axis].iter().zip(&small.correlations[axis]) {
            assert!((one.value.unwrap() - wanted.value.unwrap()).abs() < 1e-6, "{one:?} {wanted:?}");
        }
    }
}

/// Frames that have no histogram: uniform expected electrons, and one that is saturated throughout.
#[test]
fn a_figure_says_why_it_shows_nothing() {
    let shop = Workshop::new();
    // Programs warn of the saturated one.
    for line in [
        "render-radiance --electrons 20000,20000,20000 --size 20x16 -o expected.exr",
        "render-radiance --electrons 90000,90000,90000 --size 20x16 -o bright.exr",
        "add-noise bright.exr --seed 1 -o noisy.exr",
        "digitize noisy.exr -o codes.exr",
        "mosaic codes.exr -o plane.exr",
        "demosaic plane.exr -o rgb.exr",
    ] {
        assert!(shop.attempt(line, &[]).status.success(), "{line}");
    }
    for (name, said, panels) in [("expected.exr", "are the same", 2), ("rgb.exr", "No pixel is left", 0)] {
        assert!(shop.attempt(&format!("measure {name} --plot plot.svg"), &[]).status.success(), "{name}");
        let svg = String::from_utf8(shop.bytes("plot.svg")).unwrap();
        assert!(svg.contains(said) && !svg.contains("correlation</text>"), "{name}");
        // Each panel clips what it shows once.
        assert_eq!(svg.matches("<clipPath").count(), panels, "{name}");
    }
}

/// Where a region lies, what its mean is, and which share of it is not shown stand in its figure.
#[test]
fn a_figure_says_where_it_is_of_and_what_is_left_out() {
    let shop = Workshop::new();
    // Rows of 64 samples of which 1 in 16 is no number; the others are 500 to 507.
    let sample = |place: u16| if place % 16 == 3 { f32::NAN } else { 500.0 + f32::from(place % 8) };
    let bytes: Vec<u8> = (0..64 * 48).flat_map(|place| sample(place).to_le_bytes()).collect();
    std::fs::write(shop.path("a.bin"), bytes).unwrap();
    let figure = |options: &str| {
        assert!(
            shop.attempt(&format!("measure --raw 64x48:f32le a.bin{options} --plot plot.svg"), &[]).status.success()
        );
        String::from_utf8(shop.bytes("plot.svg")).unwrap()
    };
    // Of 15 finite samples 0 to 7 and 0 to 7 without one 3: 53/15.
    let whole = figure("");
    assert!(
        whole.contains("64 × 48; 6.2 % are not finite</text>") && whole.contains(", mean 503.53</text>"),
        "{whole}"
    );
    assert!(!whole.contains(">100<"));
    let part = figure(" --region 32,24,32,24");
    // Ticks of both profiles are those of the frame.
    assert!(part.contains("32 × 24; 6.2 % are not finite</text>") && part.contains(">60<"), "{part}");
    assert!(part.contains(">45<") || part.contains(">40<"), "{part}");
    let full = figure(" --region 4,0,12,8");
    assert!(!full.contains("not finite"), "{full}");
}

/// Of 3072 samples 3071 are not finite, which is not all; and means of samples that are alike scatter by nothing that a float can tell.
#[test]
fn a_figure_magnifies_no_rounding() {
    let shop = Workshop::new();
    let bytes: Vec<u8> =
        (0..64 * 48).flat_map(|place| if place == 99 { 1.0 } else { f32::NAN }.to_le_bytes()).collect();
    std::fs::write(shop.path("a.bin"), bytes).unwrap();
    shop.run("measure -q --raw 64x48:f32le a.bin --plot plot.svg", &[]);
    let seen = words(&String::from_utf8(shop.bytes("plot.svg")).unwrap());
    assert!(seen.contains("99.97 % are not finite"), "{seen}");
    shop.run("render-radiance --electrons 8000.3,12000.7,9500.1 --size 32x24 -o expected.exr", &[]);
    shop.run("measure expected.exr --plot plot.svg", &[]);
    let seen = words(&String::from_utf8(shop.bytes("plot.svg")).unwrap());
    assert!(seen.contains("mean − predicted mean") && !seen.contains("10⁻"), "{seen}");
}

/// A ramp through all codes of eight bits, one column each, is as high at its ends as elsewhere, be they called codes or not.
#[test]
fn bins_of_whole_numbers_are_alike() {
    for quantity in [QuantityKind::Adu, QuantityKind::Unspecified] {
        let head = header(quantity, Geometry::new(256, 8, &["Y"]));
        let (report, portrait) =
            drawn(&frame(head, |x, _, _| x as f32), &[Region { x: 0, y: 0, width: 256, height: 8 }]);
        let plot = cyanometer::report::portrait(&portrait, &report.regions[0]);
        let Marks::Line(steps) = &plot.panels[0].series[0].marks else { panic!("{:?}", plot.panels[0].series) };
        assert!(steps.iter().all(|[_, density]| (density * 256.0 - 1.0).abs() < 1e-9), "{quantity}: {steps:?}");
        assert_eq!([steps[0][0], steps[steps.len() - 1][0]], [-128.0, 128.0]);
        let widths: Vec<f64> = steps.chunks_exact(2).map(|ends| ends[1][0] - ends[0][0]).collect();
        assert!(widths.iter().all(|width| *width == widths[0] && width.fract() == 0.0), "{widths:?}");
    }
}

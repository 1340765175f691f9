use super::*;
use crate::numerics::normal;

/// Whether every element that is opened is closed, in order, and nothing stands where XML has no place for it.
fn assert_well_formed(svg: &str) {
    let mut open = Vec::new();
    let mut rest = svg;
    while let Some(start) = rest.find('<') {
        assert!(!rest[..start].contains('>'), "{}", &rest[..start]);
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start + 1..end];
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        assert!(!tag.contains('<'), "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap());
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty(), "{open:?}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

/// Width, height and colors of a PNG.
fn decoded(png: &[u8]) -> (u32, u32, std::collections::BTreeSet<[u8; 3]>) {
    let picture = image::load_from_memory_with_format(png, image::ImageFormat::Png).unwrap().into_rgb8();
    (picture.width(), picture.height(), picture.pixels().map(|pixel| pixel.0).collect())
}

fn log_steps(low: f64, high: f64, count: u32) -> impl Iterator<Item = f64> {
    (0..=count).map(move |index| low * (high / low).powf(f64::from(index) / f64::from(count)))
}

/// Read noise 16 e⁻, PRNU 1 %: total noise and its parts over the signal.
fn photon_transfer() -> Plot {
    let (read, prnu) = (16.0_f64, 0.01);
    let curve = |noise: &dyn Fn(f64) -> f64| log_steps(1.0, 4e4, 200).map(|n| [n, noise(n)]).collect::<Vec<_>>();
    let total = |n: f64| (read * read + n + (prnu * n).powi(2)).sqrt();
    let mut panel = Panel::new(Axis::log10("signal / e⁻"), Axis::log10("noise σ / e⁻"));
    panel.add("total, predicted", Color::Black, Marks::Line(curve(&total)));
    panel.add("read", Color::Blue, Marks::Dashed(curve(&|_| read)));
    panel.add("shot", Color::Green, Marks::Dashed(curve(&f64::sqrt)));
    panel.add("fixed pattern", Color::Vermillion, Marks::Dashed(curve(&|n| prnu * n)));
    panel.add("measured", Color::Purple, Marks::Points(log_steps(3.0, 3.9e4, 14).map(|n| [n, total(n)]).collect()));
    let region = |from, to, label: &str, color| Region { from, to, label: label.into(), color };
    panel.regions = vec![
        region(0.0, read * read, "read noise", Color::Blue),
        region(read * read, prnu.powi(-2), "shot noise", Color::Green),
        region(prnu.powi(-2), f64::INFINITY, "fixed pattern", Color::Vermillion),
    ];
    panel.vertical_lines = vec![ReferenceLine { at: 3.8e4, label: "full well".into() }];
    Plot::new("Photon transfer, KAF-5101CE", panel)
}

/// Three channels, measured and predicted: noise above, SNR below.
fn two_panels() -> Plot {
    let channels = [("R", Color::Vermillion, 18.0), ("G", Color::Green, 16.0), ("B", Color::Blue, 24.0)];
    let x = || Axis::log10("mean signal μ / e⁻");
    let mut above = Panel::new(x(), Axis::log10("noise σ / e⁻"));
    let mut below = Panel::new(x(), Axis::linear("SNR / dB"));
    for (name, color, read) in channels {
        let sigma = |n: f64| (n + read * read + 1e-4 * n * n).sqrt();
        let snr = |n: f64| 20.0 * (n / sigma(n)).log10();
        let wobble = |n: f64| 1.0 + 0.06 * (37.0 * n.ln()).sin();
        let predicted = |f: &dyn Fn(f64) -> f64| Marks::Line(log_steps(20.0, 3e4, 100).map(|n| [n, f(n)]).collect());
        above.add(&format!("{name} predicted"), color, predicted(&sigma));
        below.add("", color, predicted(&snr));
        let spots: Vec<f64> = log_steps(30.0, 2.5e4, 11).collect();
        above.add(
            &format!("{name} measured"),
            color,
            Marks::Points(spots.iter().map(|n| [*n, sigma(*n) * wobble(*n)]).collect()),
        );
        below.add("", color, Marks::Points(spots.iter().map(|n| [*n, snr(*n) + wobble(*n) - 1.0]).collect()));
        let bars = spots.iter().map(|n| [*n, sigma(*n) * (wobble(*n) - 0.05), sigma(*n) * (wobble(*n) + 0.05)]);
        above.add("", color, Marks::ErrorBars(bars.collect()));
    }
    below.horizontal_lines = vec![ReferenceLine { at: 40.0, label: "PRNU limit, 40 dB".into() }];
    Plot { title: "Noise and SNR, Δλ = 10 nm".into(), panels: vec![above, below], arrangement: Arrangement::Stacked }
}

fn histogram() -> Plot {
    let (mean, std) = (1043.0, 23.5);
    let density = |x: f64| 1e5 * normal::density((x - mean) / std) / std;
    let codes = (0..61).map(|index| 940.0 + f64::from(index) * 3.4);
    let curve: Vec<[f64; 2]> = (0..=300).map(|i| 930.0 + 0.75 * f64::from(i)).map(|x| [x, density(x)]).collect();
    let mut panel = Panel::new(Axis::linear("sample / ADU"), Axis::linear("pixels per ADU"));
    let tops = codes.map(|x| [x, density(x) * (1.0 + 0.05 * (x * 7.0).sin())]).collect();
    panel.add("", Color::Gray, Marks::Band(curve.iter().map(|[x, y]| [*x, 0.95 * y, 1.05 * y]).collect()));
    panel.add("measured", Color::SkyBlue, Marks::Bars { width: 3.4, tops });
    panel.add("predicted, N(μ, σ²)", Color::Vermillion, Marks::Line(curve));
    let line = |at, label: &str| ReferenceLine { at, label: label.into() };
    panel.vertical_lines = vec![line(mean, "μ"), line(mean - std, "μ − σ"), line(mean + std, "μ + σ")];
    Plot::new("Green, 512x512 at 0,0", panel)
}

/// Writes the pictures for looking at: `CYANOMETER_PLOTS=DIR cargo test plot`.
fn keep(name: &str, plot: &Plot) {
    if let Some(directory) = std::env::var_os("CYANOMETER_PLOTS") {
        for end in ["svg", "png"] {
            plot.write(&Path::new(&directory).join(format!("{name}.{end}")), None).unwrap();
        }
    }
}

#[test]
fn an_svg_says_what_the_plot_says() {
    let plot = photon_transfer();
    keep("photon-transfer", &plot);
    let svg = plot.svg();
    assert_well_formed(&svg);
    for text in ["Photon transfer, KAF-5101CE", "signal / e⁻", "shot noise", "full well", "measured", ">1000<", ">10⁴<"]
    {
        assert!(svg.contains(text), "{text}");
    }
    for color in ["#0072b2", "#009e73", "#d55e00", "#cc79a7"] {
        assert!(svg.contains(color), "{color}");
    }
    // 15 measured points and one in the legend, each a diamond.
    assert_eq!(svg.matches("fill=\"#cc79a7\"").count(), 16);
    assert_eq!(svg.matches("stroke-dasharray=\"7 4\"").count(), 6);
}

#[test]
fn a_png_is_a_picture_of_900_by_600() {
    let (width, height, colors) = decoded(&photon_transfer().png().unwrap());
    assert_eq!((width, height), (900, 600));
    for color in [[255; 3], Color::Black.rgb(), Color::Green.rgb(), Color::Vermillion.rgb()] {
        assert!(colors.contains(&color), "{color:?}");
    }
}

#[test]
fn panels_are_stacked_or_side_by_side() {
    let mut plot = two_panels();
    keep("two-panels", &plot);
    assert_well_formed(&plot.svg());
    let (width, height, _) = decoded(&plot.png().unwrap());
    assert_eq!(width, 900);
    assert!(height > 600);
    plot.arrangement = Arrangement::SideBySide;
    keep("side-by-side", &plot);
    let (width, height, _) = decoded(&plot.png().unwrap());
    assert!(width > 1200 && height < 600);
}

#[test]
fn a_histogram_stands_on_its_axis() {
    let plot = histogram();
    keep("histogram", &plot);
    let svg = plot.svg();
    assert_well_formed(&svg);
    assert!(svg.contains("μ − σ"));
}

#[test]
fn the_same_plot_has_the_same_bytes() {
    assert_eq!(two_panels().svg(), two_panels().svg());
    assert_eq!(two_panels().png().unwrap(), two_panels().png().unwrap());
}

#[test]
fn what_an_axis_cannot_show_is_left_out_of_the_line() {
    let axes = || (Axis::log10("").range(1.0, 100.0), Axis::log10("").range(1.0, 100.0));
    let path = |points: Vec<[f64; 2]>| {
        let mut panel = Panel::new(axes().0, axes().1);
        panel.add("", Color::Blue, Marks::Line(points));
        Plot::new("", panel).svg()
    };
    let holes = vec![[1.0, 1.0], [2.0, f64::NAN], [f64::INFINITY, 2.0], [3.0, 0.0], [-1.0, 3.0], [100.0, 100.0]];
    assert_eq!(path(holes), path(vec![[1.0, 1.0], [100.0, 100.0]]));
}

#[test]
fn empty_and_odd_data_make_a_plot_all_the_same() {
    for scale in [Axis::linear("x"), Axis::log10("x")] {
        for points in [
            vec![],
            vec![[f64::NAN; 2]],
            vec![[0.0, 0.0]],
            vec![[5.0, 5.0]; 3],
            vec![[1e308, -1e308], [1e-320, 1e308]],
            vec![[1.0, 1e99], [2.0, 1.0]],
        ] {
            let ranges: Vec<[f64; 3]> = points.iter().map(|[x, y]| [*x, -y, *y]).collect();
            for marks in [
                Marks::Line(points.clone()),
                Marks::Dashed(points.clone()),
                Marks::Points(points.clone()),
                Marks::LineAndPoints(points.clone()),
                Marks::Bars { width: 1.0, tops: points.clone() },
                Marks::Band(ranges.clone()),
                Marks::ErrorBars(ranges.clone()),
            ] {
                let mut panel = Panel::new(scale.clone(), scale.clone());
                panel.add("name", Color::Orange, marks);
                panel.vertical_lines = vec![ReferenceLine { at: f64::NAN, label: "nowhere".into() }];
                panel.horizontal_lines = vec![ReferenceLine { at: -1.0, label: "far".into() }];
                panel.regions = vec![Region { from: f64::NAN, to: 1.0, label: "nothing".into(), color: Color::Yellow }];
                let plot = Plot::new("odd", panel);
                assert_well_formed(&plot.svg());
                assert_eq!(decoded(&plot.png().unwrap()).0, 900);
            }
        }
    }
    let nothing = Plot { title: String::new(), panels: vec![], arrangement: Arrangement::SideBySide };
    assert_well_formed(&nothing.svg());
    assert!(nothing.png().is_ok());
}

#[test]
fn texts_are_escaped() {
    let mut panel = Panel::new(Axis::linear("a < b & \"c\" > d"), Axis::linear("\u{1}"));
    panel.add("<x>", Color::of_index(7), Marks::Line(vec![]));
    let svg = Plot::new("5 > 4", panel).svg();
    assert_well_formed(&svg);
    assert!(svg.contains("a &lt; b &amp; &quot;c&quot; &gt; d"));
}

#[test]
fn the_extension_chooses_the_format() {
    let directory = tempfile::tempdir().unwrap();
    let plot = histogram();
    let path = |name: &str| directory.path().join(name);
    plot.write(&path("a.svg"), None).unwrap();
    plot.write(&path("a.PNG"), None).unwrap();
    assert_eq!(std::fs::read_to_string(path("a.svg")).unwrap(), plot.svg());
    assert_eq!(std::fs::read(path("a.PNG")).unwrap(), plot.png().unwrap());
    for name in ["a.pdf", "a", "svg"] {
        let error = plot.write(&path(name), None).unwrap_err();
        assert!(matches!(&error, Error::Usage(text) if text.contains(".svg or .png")), "{error}");
    }
    // Nothing but the two files is left.
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
}

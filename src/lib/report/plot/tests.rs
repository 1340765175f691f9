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

/// Segments, circles, arrows and an inset, on axes of equal scale.
fn diagram() -> Plot {
    let axis = |label: &str| Axis::linear(label).range(0.0, 10.0);
    let mut panel = Panel::new(axis("a / mm"), axis("b / mm"));
    let angles = || (0..24).map(|index| 0.26 * f64::from(index));
    let spot = |angle: f64| [5.0 + 2.5 * angle.cos(), 4.0 + 1.5 * angle.sin()];
    let segment = |angle: f64| {
        let [x, y] = spot(angle);
        [x, y, x + 0.6 * angle.cos(), y + 0.6]
    };
    panel.add("measured", Color::Blue, Marks::Points(angles().map(spot).collect()));
    panel.add("errors", Color::Gray, Marks::Segments(angles().map(segment).collect()));
    let circle = |angle: f64| [spot(angle)[0], spot(angle)[1], 3.0 * angle];
    panel.add("differences", Color::Purple, Marks::Circles(angles().map(circle).collect()));
    panel.arrows = vec![
        Arrow { from: [9.0, 5.5], to: spot(0.0), label: "this one".into(), color: Color::Black },
        Arrow { from: [1.0, 0.2], to: spot(3.12), label: "and that one".into(), color: Color::Black },
        Arrow { from: [5.0, 5.0], to: [5.0, 12.0], label: String::new(), color: Color::Green },
    ];
    panel.circle_sizes = [6.0, 24.0]
        .map(|diameter| CircleSize { diameter, label: format!("{} mm", diameter / 3.0), color: Color::Purple })
        .into();
    panel.equal_scale = true;
    let mut small = Panel::new(Axis::linear("a / mm"), Axis::log10("c").range(1.0, 1e3));
    small.add("unseen", Color::Vermillion, Marks::Line((0..10).map(|x| [f64::from(x), 2_f64.powi(x)]).collect()));
    small.add("", Color::Blue, Marks::Points(vec![[2.0, 100.0], [6.0, 20.0]]));
    panel.inset = Some(Box::new(Inset { panel: small, corner: Corner::TopRight, share: 0.4 }));
    Plot::new("Errors", panel)
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
                Marks::Segments(points.iter().map(|[x, y]| [*x, *y, -y, *x]).collect()),
                Marks::Circles(ranges.clone()),
            ] {
                let mut panel = Panel::new(scale.clone(), scale.clone());
                panel.add("name", Color::Orange, marks);
                let arrow = |from, to| Arrow { from, to, label: "→".into(), color: Color::Black };
                panel.arrows = points.iter().map(|at| arrow(*at, [1.0, 1.0])).collect();
                panel.arrows.push(arrow([1.0; 2], [f64::NAN; 2]));
                panel.equal_scale = true;
                panel.circle_sizes = [f64::NAN, -1.0, f64::INFINITY]
                    .map(|diameter| CircleSize { diameter, label: "none".into(), color: Color::Black })
                    .into();
                for share in [f64::NAN, -1.0, 0.02, 0.5, 2.0] {
                    let inset = Inset { panel: panel.clone(), corner: Corner::BottomLeft, share };
                    panel.inset = Some(Box::new(inset));
                    assert_well_formed(&Plot::new("odd", panel.clone()).svg());
                }
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

#[test]
fn segments_circles_arrows_and_insets_are_drawn() {
    let plot = diagram();
    keep("diagram", &plot);
    let svg = plot.svg();
    assert_well_formed(&svg);
    assert!(plot.png().is_ok());
    for text in ["this one", "and that one", "2 mm", "8 mm", ">1000<"] {
        assert!(svg.contains(text), "{text}");
    }
    // An inset has no legend.
    assert!(!svg.contains("unseen"));
    // 24 circles, one for the series in the legend and two for the sizes; the first has no size.
    assert_eq!(svg.matches("fill=\"none\" stroke=\"#cc79a7\"").count(), 27);
    assert!(svg.contains("r=\"12\" fill=\"none\" stroke=\"#cc79a7\""));
    // 24 segments and one in the legend.
    assert_eq!(svg.matches("fill=\"none\" stroke=\"#777777\"").count(), 25);
}

/// Left, top, width and height of the frames: the panel's, then the inset's.
fn frames(plot: &Plot) -> Vec<[f64; 4]> {
    let svg = plot.svg();
    let closed = svg.lines().filter(|line| line.contains("Z\" fill=\"none\" stroke=\"#444444\""));
    let frame = |line: &str| {
        let path = line.split('"').nth(1).unwrap();
        let numbers: Vec<f64> = path.split(['M', 'L', 'Z', ' ']).filter_map(|number| number.parse().ok()).collect();
        [numbers[0], numbers[1], numbers[4] - numbers[0], numbers[5] - numbers[1]]
    };
    closed.map(frame).collect()
}

#[test]
fn units_are_equally_long_where_asked_for() {
    let mut plot = diagram();
    let aspect = |plot: &Plot| frames(plot)[0][2] / frames(plot)[0][3];
    // To a pixel in some five hundred.
    assert!((aspect(&plot) - 1.0).abs() < 0.005, "{}", aspect(&plot));
    plot.panels[0].x = Axis::linear("").range(0.0, 2.5);
    assert!((aspect(&plot) - 0.25).abs() < 0.005, "{}", aspect(&plot));
    plot.panels[0].y = Axis::linear("").range(0.0, 0.5);
    assert!((aspect(&plot) - 5.0).abs() < 0.05, "{}", aspect(&plot));
    // What would be a line stays as it is, and so do axes that have no common unit.
    let free = |plot: &Plot| (1.4..1.8).contains(&aspect(plot));
    plot.panels[0].y = Axis::linear("").range(0.0, 1e-3);
    assert!(free(&plot));
    plot.panels[0].y = Axis::log10("").range(1.0, 10.0);
    assert!(free(&plot));
}

#[test]
fn an_inset_lies_in_its_corner() {
    for (corner, is_left, is_top) in [
        (Corner::TopLeft, true, true),
        (Corner::TopRight, false, true),
        (Corner::BottomLeft, true, false),
        (Corner::BottomRight, false, false),
    ] {
        for equal_scale in [false, true] {
            let mut plot = diagram();
            let inset = plot.panels[0].inset.as_mut().unwrap();
            inset.corner = corner;
            inset.panel.y = Axis::linear("").range(0.0, 10.0);
            inset.panel.x = Axis::linear("").range(0.0, 5.0);
            inset.panel.equal_scale = equal_scale;
            let [outer, inner] = frames(&plot)[..] else { panic!("two frames") };
            for axis in [0, 1] {
                let (before, size) = (inner[axis] - outer[axis], inner[axis + 2]);
                let after = outer[axis + 2] - before - size;
                assert!(before > 0.0 && after > 0.0 && size < 0.4 * outer[axis + 2]);
                // Labels and some room are on the near side.
                let near = if [is_left, is_top][axis] { before } else { after };
                assert!(near < 60.0, "{corner:?} {axis} {near}");
            }
        }
    }
}

#[test]
fn segments_and_circles_that_an_axis_cannot_show_are_left_out() {
    let svg = |marks| {
        let mut panel = Panel::new(Axis::log10("").range(1.0, 100.0), Axis::linear("").range(1.0, 100.0));
        panel.add("", Color::Blue, marks);
        Plot::new("", panel).svg()
    };
    let segments = vec![[1.0, 1.0, 5.0, 5.0], [0.0, 1.0, 5.0, 5.0], [1.0, f64::NAN, 5.0, 5.0], [1.0, 1.0, 5.0, 1e200]];
    assert_eq!(svg(Marks::Segments(segments.clone())), svg(Marks::Segments(segments[..1].to_vec())));
    let circles = vec![[1.0, 1.0, 5.0], [-1.0, 1.0, 5.0], [1.0, 1.0, -5.0], [1.0, 1.0, f64::NAN], [1.0, f64::NAN, 5.0]];
    assert_eq!(svg(Marks::Circles(circles.clone())), svg(Marks::Circles(circles[..1].to_vec())));
}

//! Reads the pictures back: what an SVG and a PNG show is what the plot says.

mod laws;
mod reading;

use super::*;
use reading::{Element, ROUNDING, axes, difference, elements, frames, pixels, words};

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
        let predicted = |f: &dyn Fn(f64) -> f64| Marks::Line(log_steps(20.0, 3e4, 100).map(|n| [n, f(n)]).collect());
        above.add(&format!("{name} predicted"), color, predicted(&sigma));
        below.add("", color, predicted(&snr));
        let spots: Vec<f64> = log_steps(30.0, 2.5e4, 11).collect();
        let measured = Marks::Points(spots.iter().map(|n| [*n, 1.04 * sigma(*n)]).collect());
        above.add(&format!("{name} measured"), color, measured);
        below.add("", color, Marks::Points(spots.iter().map(|n| [*n, snr(*n) + 0.3]).collect()));
        let bars = spots.iter().map(|n| [*n, 0.97 * sigma(*n), 1.11 * sigma(*n)]);
        above.add("", color, Marks::ErrorBars(bars.collect()));
    }
    below.horizontal_lines = vec![ReferenceLine { at: 40.0, label: "PRNU limit, 40 dB".into() }];
    Plot { title: "Noise and SNR, Δλ = 10 nm".into(), panels: vec![above, below], arrangement: Arrangement::Stacked }
}

/// Two panels of equal scale with notes.
fn diagrams() -> Plot {
    let axis = |label: &str| Axis::linear(label).range(0.0, 10.0);
    let mut panel = Panel::new(axis("a / mm"), axis("b / mm"));
    panel.title = "errors".into();
    panel.equal_scale = true;
    let spots: Vec<[f64; 2]> =
        (0..24).map(|i| 0.26 * f64::from(i)).map(|t| [5.0 + 2.5 * t.cos(), 4.0 + 1.5 * t.sin()]).collect();
    for [x, y] in &spots {
        panel.notes.push(Note::Line { points: vec![[*x, *y], [x + 0.5, y + 0.6]], color: Color::Gray });
        panel.notes.push(Note::Circle { at: [*x, *y], diameter: 3.0 * x, color: Color::Vermillion });
    }
    panel.add("measured", Color::Blue, Marks::Points(spots));
    for (y, anchor) in [(7.0, Anchor::Start), (8.0, Anchor::Middle), (9.0, Anchor::End)] {
        panel.notes.push(Note::Text { at: [3.0, y], anchor, text: "a word".into() });
    }
    let mut other = panel.clone();
    (other.title, other.x) = ("others".into(), Axis::linear("a / mm").range(0.0, 25.0));
    Plot { title: "Errors".into(), panels: vec![panel, other], arrangement: Arrangement::SideBySide }
}

/// Writes the pictures for looking at: `CYANOMETER_PLOTS=DIR cargo test plot`.
fn keep(name: &str, plot: &Plot) {
    if let Some(directory) = std::env::var_os("CYANOMETER_PLOTS") {
        let path = |end| std::path::Path::new(&directory).join(format!("{name}.{end}"));
        std::fs::write(path("svg"), plot.svg()).unwrap();
        std::fs::write(path("png"), plot.png().unwrap()).unwrap();
    }
}

fn figures() -> [(&'static str, Plot); 4] {
    let beside = Plot { arrangement: Arrangement::SideBySide, ..two_panels() };
    [("photon-transfer", photon_transfer()), ("two-panels", two_panels()), ("beside", beside), ("diagrams", diagrams())]
}

fn hex(color: Color) -> String {
    let [r, g, b] = color.rgb();
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Whether a place is where a value should be.
fn is_at([x, y]: [f64; 2], [x_axis, y_axis]: &[reading::ReadAxis; 2], value: [f64; 2]) -> bool {
    (x_axis.pixel(value[0]) - x).abs() < ROUNDING && (y_axis.pixel(value[1]) - y).abs() < ROUNDING
}

fn within([x, y]: [f64; 2], [left, top, right, bottom]: [f64; 4]) -> bool {
    (left..=right).contains(&x) && (top..=bottom).contains(&y)
}

fn overlap(a: [f64; 4], b: [f64; 4]) -> bool {
    (0..2).all(|axis| a[axis] < b[axis + 2] && b[axis] < a[axis + 2])
}

/// The lines of series of a color, in a panel's frame.
fn lines(plot: &Plot, frame: [f64; 4], color: Color) -> Vec<Element> {
    let is_line = |element: &Element| {
        element.is_clipped && !element.is_closed() && element.name == "path" && element.get("stroke") == hex(color)
    };
    elements(plot).into_iter().filter(|e| is_line(e) && within(e.places()[0], frame)).collect()
}

#[test]
fn lines_points_and_error_bars_stand_where_the_axes_say() {
    for (name, plot) in figures() {
        keep(name, &plot);
        let all = elements(&plot);
        for ((panel, frame), axes) in plot.panels.iter().zip(frames(&plot)).zip(axes(&plot)) {
            for series in &panel.series {
                let (color, points) = (hex(series.color), series.marks.points());
                let of_color = lines(&plot, frame, series.color);
                match &series.marks {
                    Marks::Line(_) | Marks::Dashed(_) | Marks::LineAndPoints(_) => {
                        let is_it = |line: &&Element| {
                            let places = line.places();
                            places.len() == points.len()
                                && places.iter().zip(points).all(|(place, point)| is_at(*place, &axes, *point))
                        };
                        let line = of_color.iter().find(is_it).unwrap_or_else(|| panic!("{name}: {}", series.name));
                        let is_dashed = line.attributes.contains_key("stroke-dasharray");
                        assert_eq!(is_dashed, matches!(series.marks, Marks::Dashed(_)));
                    }
                    Marks::Points(_) => {
                        let mark = |element: &&Element| element.get("fill") == color && !element.is_clipped;
                        // The middle of a mark, whatever its form, is within a pixel of its value.
                        let middles: Vec<[f64; 2]> = all.iter().filter(mark).map(middle).collect();
                        for [x, y] in points {
                            let at = [axes[0].pixel(*x), axes[1].pixel(*y)];
                            let near = |place: &&[f64; 2]| f64::hypot(place[0] - at[0], place[1] - at[1]) < 1.0;
                            assert_eq!(middles.iter().filter(near).count(), 1, "{name}: {} {x} {y}", series.name);
                        }
                    }
                    Marks::ErrorBars(ranges) => {
                        for [x, low, high] in ranges {
                            let is_bar = |line: &&Element| {
                                let ends = line.places();
                                is_at(ends[0], &axes, [*x, *low]) && is_at(ends[1], &axes, [*x, *high])
                            };
                            assert_eq!(of_color.iter().filter(is_bar).count(), 1, "{name}: {x} {low} {high}");
                        }
                    }
                }
            }
        }
    }
}

/// The middle between the outermost places of a shape.
fn middle(element: &Element) -> [f64; 2] {
    let [left, top, right, bottom] = element.bounds();
    [0.5 * (left + right), 0.5 * (top + bottom)]
}

#[test]
fn a_circle_stands_exactly_where_the_axes_say() {
    let values = [[-3.0, 2e-3], [0.0, 1.0], [4.5, 7e3]];
    let mut panel = Panel::new(Axis::linear("x"), Axis::log10("y"));
    panel.add("", Color::Blue, Marks::Points(values.to_vec()));
    let plot = Plot::new("", panel);
    let circles: Vec<Element> = elements(&plot).into_iter().filter(|element| element.name == "circle").collect();
    assert_eq!(circles.len(), 3);
    for (circle, value) in circles.iter().zip(values) {
        assert!(is_at(circle.places()[0], &axes(&plot)[0], value), "{value:?}");
    }
}

#[test]
fn axes_end_at_the_corners_of_the_frame() {
    let plot = Plot::new("", Panel::new(Axis::linear("x").range(-2.0, 6.0), Axis::log10("y").range(1e-3, 1e6)));
    let [left, top, right, bottom] = frames(&plot)[0];
    let [axes] = &axes(&plot)[..] else { panic!("one panel") };
    assert!(is_at([left, bottom], axes, [-2.0, 1e-3]) && is_at([right, top], axes, [6.0, 1e6]));
}

#[test]
fn regions_and_reference_lines_stand_at_their_values() {
    let plot = photon_transfer();
    let [left, top, right, bottom] = frames(&plot)[0];
    let [x, _] = &axes(&plot)[0];
    let all = elements(&plot);
    for (region, edges) in plot.panels[0].regions.iter().zip([
        [left, x.pixel(256.0)],
        [x.pixel(256.0), x.pixel(1e4)],
        [x.pixel(1e4), right],
    ]) {
        let color = hex(region.color);
        let shades = all.iter().filter(|e| e.get("fill") == color && e.get("fill-opacity") == "0.12");
        let found: Vec<[f64; 4]> = shades.map(Element::bounds).collect();
        let expected = [edges[0], top, edges[1], bottom];
        assert_eq!(found.len(), 1);
        assert!(found[0].iter().zip(expected).all(|(a, b)| (a - b).abs() < ROUNDING), "{found:?} {expected:?}");
        // Its name stands above it.
        let (_, word) = words(&plot).into_iter().find(|(word, _)| *word == region.label).unwrap();
        assert!((0.5 * (word[0] + word[2] - edges[0] - edges[1])).abs() < 0.02 && word[3] < top);
    }
    let reference = |plot: &Plot| -> Vec<[f64; 4]> {
        elements(plot).iter().filter(|e| e.get("stroke-dasharray") == "2 3").map(Element::bounds).collect()
    };
    let [line] = reference(&plot)[..] else { panic!("one line") };
    assert!((line[0] - x.pixel(3.8e4)).abs() < ROUNDING && line[0] == line[2] && [line[1], line[3]] == [top, bottom]);
    let plot = two_panels();
    let [left, _, right, _] = frames(&plot)[1];
    let [line] = reference(&plot)[..] else { panic!("one line") };
    assert!((line[1] - axes(&plot)[1][1].pixel(40.0)).abs() < ROUNDING && [line[0], line[2]] == [left, right]);
}

#[test]
fn notes_stand_at_their_places_below_series() {
    let plot = diagrams();
    let all = elements(&plot);
    for frame in frames(&plot) {
        let here = |e: &&Element| ["path", "circle"].contains(&e.name.as_str()) && within(e.places()[0], frame);
        let inside: Vec<&Element> = all.iter().filter(here).collect();
        let last_note = inside.iter().rposition(|e| e.is_clipped).unwrap();
        let first_mark = inside.iter().position(|e| e.get("fill") == hex(Color::Blue)).unwrap();
        assert!(last_note < first_mark);
    }
    for (panel, axes) in plot.panels.iter().zip(axes(&plot)) {
        for note in &panel.notes {
            let is_it = |element: &&Element| match note {
                Note::Line { points, color } => {
                    let places = element.places();
                    element.get("stroke") == hex(*color)
                        && places.len() == points.len()
                        && places.iter().zip(points).all(|(place, point)| is_at(*place, &axes, *point))
                }
                Note::Circle { at, diameter, color } => {
                    element.name == "circle"
                        && element.get("stroke") == hex(*color)
                        && is_at(element.places()[0], &axes, *at)
                        && (2.0 * element.number("r") - diameter).abs() < 2.0 * ROUNDING
                }
                Note::Text { at, anchor, text } => {
                    let [left, top, right, bottom] = element.word_bounds();
                    let x = match anchor {
                        Anchor::Start => left,
                        Anchor::Middle => 0.5 * (left + right),
                        Anchor::End => right,
                    };
                    // Letters are 0.76 + 0.24 of 16 pixels high, digits 0.73: their middles are 1.7 pixels apart.
                    let y = 0.5 * (top + bottom) - 0.5 * (0.24 + 0.73 - 0.76) * 16.0;
                    element.text == *text
                        && (x - axes[0].pixel(at[0])).abs() < ROUNDING
                        && (y - axes[1].pixel(at[1])).abs() < 0.1
                }
            };
            let is_word = matches!(note, Note::Text { .. });
            let kind = |element: &&Element| (element.name == "text") == is_word && element.name != "rect";
            let found = all.iter().filter(kind).filter(|e| e.name != "title").filter(is_it).count();
            assert_eq!(found, 1, "{note:?}");
        }
    }
}

#[test]
fn what_lies_beyond_the_axes_is_not_seen_outside_the_frame() {
    let axis = || Axis::linear("").range(0.0, 10.0);
    let empty = Plot::new("", Panel::new(axis(), axis()));
    let mut plot = empty.clone();
    let panel = &mut plot.panels[0];
    // Far away, and so near that it would stand on the margins.
    let wild =
        vec![[-5.0, -5.0], [5.0, 15.0], [30.0, 5.0], [5.0, -40.0], [-0.2, 5.0], [5.0, 10.2], [10.2, 5.0], [5.0, -0.2]];
    panel.add("", Color::Blue, Marks::LineAndPoints(wild.clone()));
    panel.add("", Color::Green, Marks::Dashed(wild.iter().map(|[x, y]| [*y, *x]).collect()));
    panel.add("", Color::Orange, Marks::ErrorBars(vec![[5.0, -5.0, 20.0], [-3.0, 2.0, 4.0]]));
    panel.notes.push(Note::Line { points: wild.clone(), color: Color::Black });
    panel.notes.extend(wild.iter().map(|&at| Note::Circle { at, diameter: 900.0, color: Color::Purple }));
    panel.notes.extend(wild.iter().map(|&at| Note::Text { at, anchor: Anchor::End, text: "word".into() }));
    panel.vertical_lines = [-1.0, 11.0].map(|at| ReferenceLine { at, label: "beyond".into() }).into();
    panel.horizontal_lines = panel.vertical_lines.clone();
    panel.regions = vec![Region { from: 12.0, to: 14.0, label: "beyond".into(), color: Color::Yellow }];
    keep("beyond", &plot);
    let [left, top, right, bottom] = frames(&plot)[0];
    let seen = difference(&plot, &empty).unwrap();
    // The clip goes through the middle of pixels.
    assert!(seen[0] >= left - 0.5 && seen[1] >= top - 0.5 && seen[2] <= right + 0.5 && seen[3] <= bottom + 0.5);
    // It reaches all four sides all the same.
    assert!(seen[0] < left + 1.0 && seen[1] < top + 1.0 && seen[2] > right - 1.0 && seen[3] > bottom - 1.0);
}

#[test]
fn words_lie_beside_each_other_on_the_canvas() {
    let mut crowded = photon_transfer();
    crowded.panels[0].x = Axis::linear("a wide range").range(-123_456.0, 123_456.0);
    crowded.panels[0].vertical_lines =
        (0..9).map(|i| ReferenceLine { at: 5e3 * f64::from(i), label: format!("line number {i}") }).collect();
    let mut narrow = diagrams();
    narrow.panels.iter_mut().for_each(|panel| panel.notes.clear());
    narrow.panels[0].y = Axis::linear("b / mm").range(0.0, 60.0);
    narrow.panels[1].x = Axis::linear("a / mm").range(1.0, 1.000_000_07);
    narrow.panels.push(two_panels().panels[0].clone());
    for (name, plot) in figures().into_iter().chain([("crowded", crowded), ("narrow", narrow)]) {
        keep(name, &plot);
        let canvas = elements(&plot).iter().find(|element| element.name == "rect").unwrap().clone();
        let canvas = [0.0, 0.0, canvas.number("width"), canvas.number("height")];
        let words = words(&plot);
        for (index, (word, bounds)) in words.iter().enumerate() {
            let corners = [[bounds[0], bounds[1]], [bounds[2], bounds[3]]];
            assert!(corners.iter().all(|corner| within(*corner, canvas)), "{name}: {word} {bounds:?}");
            for (other, their) in &words[..index] {
                assert!(!overlap(*bounds, *their), "{name}: {word} {bounds:?}, {other} {their:?}");
            }
        }
    }
}

/// Long titles have as many lines as they need, and panels go below.
#[test]
fn a_title_stays_on_the_canvas() {
    for arrangement in [Arrangement::Stacked, Arrangement::SideBySide, Arrangement::Pairs] {
        for count in 1..=3 {
            let title = "a title of many words ".repeat(24) + &"of_a_path/".repeat(20);
            let panels = vec![photon_transfer().panels[0].clone(); count];
            let plot = Plot { title, panels, arrangement };
            let canvas = elements(&plot).iter().find(|element| element.name == "rect").unwrap().clone();
            let canvas = [0.0, 0.0, canvas.number("width"), canvas.number("height")];
            for (word, bounds) in words(&plot) {
                let corners = [[bounds[0], bounds[1]], [bounds[2], bounds[3]]];
                assert!(corners.iter().all(|corner| within(*corner, canvas)), "{word} {bounds:?}");
            }
            let last = words(&plot).into_iter().find(|(word, _)| word.ends_with("of_a_path/")).unwrap().1[3];
            assert!(frames(&plot).iter().all(|[_, top, ..]| *top > last), "{arrangement:?} {count}");
        }
    }
}

/// The legend lists what is seen, and what has no marks of its own; not what lies beyond the axes, or cannot be on them.
#[test]
fn a_legend_lists_what_is_seen() {
    let mut panel = Panel::new(Axis::log10("x").range(1.0, 100.0), Axis::log10("y").range(1.0, 100.0));
    for (name, marks) in [
        ("across", Marks::Line(vec![[0.1, 10.0], [1e3, 10.0]])),
        ("corner", Marks::Dashed(vec![[0.5, 3.0], [3.0, 0.5]])),
        ("one", Marks::Points(vec![[0.5, 3.0], [2.0, 3.0]])),
        ("bar", Marks::ErrorBars(vec![[2.0, 0.0, 5.0]])),
        ("key", Marks::Dashed(Vec::new())),
        ("below", Marks::Line(vec![[1.0, 0.1], [100.0, 0.9]])),
        ("beside", Marks::Line(vec![[0.1, 0.5], [0.5, 90.0]])),
        ("zero", Marks::Dashed(vec![[1.0, 0.0], [100.0, 0.0]])),
        ("away", Marks::Points(vec![[0.5, 3.0], [200.0, 3.0]])),
        ("short", Marks::ErrorBars(vec![[2.0, 0.1, 0.5], [200.0, 1.0, 5.0]])),
    ] {
        panel.add(name, Color::Blue, marks);
    }
    let plot = Plot::new("", panel);
    let words: Vec<String> = words(&plot).into_iter().map(|(word, _)| word).collect();
    let listed = |name: &str| words.iter().any(|word| word == name);
    for name in ["across", "corner", "one", "bar", "key"] {
        assert!(listed(name), "{name}: {words:?}");
    }
    for name in ["below", "beside", "zero", "away", "short"] {
        assert!(!listed(name), "{name}: {words:?}");
    }
}

#[test]
fn a_legend_shows_each_named_series_and_covers_none() {
    for (name, plot) in figures() {
        let all = elements(&plot);
        for ((panel, frame), axes) in plot.panels.iter().zip(frames(&plot)).zip(axes(&plot)) {
            let named: Vec<&Series> = panel.series.iter().filter(|series| !series.name.is_empty()).collect();
            let is_box = |e: &Element| e.is_closed() && e.get("fill-opacity") == "0.88" && within(middle(e), frame);
            let Some(start) = all.iter().position(is_box) else {
                assert!(named.is_empty(), "{name}");
                continue;
            };
            let bounds = all[start].bounds();
            assert!(within([bounds[0], bounds[1]], frame) && within([bounds[2], bounds[3]], frame));
            for (series, pair) in named.iter().zip(all[start + 1..].chunks_exact(2)) {
                let (swatch, word) = (&pair[0], &pair[1]);
                assert_eq!(word.text, series.name);
                let attribute = if matches!(series.marks, Marks::Points(_)) { "fill" } else { "stroke" };
                assert_eq!(swatch.get(attribute), hex(series.color));
                let is_dashed = swatch.attributes.contains_key("stroke-dasharray");
                assert_eq!(is_dashed, matches!(series.marks, Marks::Dashed(_)));
                // Beside each other, in the box.
                let [left, top, right, bottom] = word.word_bounds();
                let [x, y] = middle(swatch);
                assert!(x < left && (top..bottom).contains(&y), "{name}: {}", series.name);
                assert!(within([x, y], bounds) && within([right, bottom], bounds), "{name}: {}", series.name);
            }
            for [x, y] in panel.series.iter().flat_map(|series| series.marks.points()) {
                assert!(!within([axes[0].pixel(*x), axes[1].pixel(*y)], bounds), "{name}: {x} {y}");
            }
        }
    }
}

#[test]
fn a_png_has_the_colors_of_the_svg_at_its_places() {
    let mut found = 0;
    for (name, plot) in figures() {
        let picture = pixels(&plot);
        let all = elements(&plot);
        let background = &all[1];
        let size = [background.number("width"), background.number("height")];
        assert_eq!([picture.width(), picture.height()].map(f64::from), size);
        let marks: Vec<(usize, &Element)> =
            all.iter().enumerate().filter(|(_, e)| e.get("stroke") == "#ffffff" && e.get("fill") != "none").collect();
        found += marks.len();
        for (index, mark) in marks {
            let [x, y] = middle(mark);
            // Unless a later mark or line covers it.
            let covers = |e: &Element| {
                !["text", "title", "rect"].contains(&e.name.as_str())
                    && within([x, y], {
                        let [l, t, r, b] = e.reach();
                        [l - 2.0, t - 2.0, r + 2.0, b + 2.0]
                    })
                    && e.get("stroke") != "#444444"
            };
            if all[index + 1..].iter().any(covers) {
                continue;
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "places on the canvas")]
            let [r, g, b] = picture.get_pixel(x as u32, y as u32).0;
            assert_eq!(format!("#{r:02x}{g:02x}{b:02x}"), mark.get("fill"), "{name}: {x} {y}");
        }
    }
    assert!(found > 60, "{found}");
}

#[test]
fn letters_of_a_png_stand_where_the_svg_has_its_text() {
    let axis = |label| Axis::linear(label).range(0.0, 10.0);
    let plot = |text: &str, anchor| {
        let mut panel = Panel::new(axis("x"), axis("y"));
        panel.notes.push(Note::Text { at: [5.3, 4.2], anchor, text: text.into() });
        Plot::new("", panel)
    };
    for anchor in [Anchor::Start, Anchor::Middle, Anchor::End] {
        let plain = plot("", anchor);
        let with = plot("HxxgH", anchor);
        let (_, bounds) = words(&with).into_iter().find(|(word, _)| word == "HxxgH").unwrap();
        let seen = difference(&with, &plain).unwrap();
        // An H has 1.3 pixels on either side, and is 0.73 of the size high; g goes down by 0.21.
        let [left, top, right, bottom] = bounds;
        let expected = [left + 1.3, top + 0.03 * 16.0, right - 1.3, bottom - 0.03 * 16.0];
        assert!(seen.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1.1), "{anchor:?} {seen:?} {expected:?}");
    }
    // Upward: the label of the y axis.
    let labeled = |label| Plot::new("", Panel::new(axis("x"), axis(label)));
    let (with, other) = (labeled("HxxxH"), labeled(" "));
    let (_, [left, top, right, bottom]) = words(&with).into_iter().find(|(word, _)| word == "HxxxH").unwrap();
    let seen = difference(&with, &other).unwrap();
    let expected = [left + 0.03 * 17.0, top + 1.5, right - 0.24 * 17.0, bottom - 1.5];
    assert!(seen.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1.1), "{seen:?} {expected:?}");
}

#[test]
fn frames_lie_beside_or_below_each_other_with_their_edges_aligned() {
    let stacked = frames(&two_panels());
    let [[left, _, right, bottom], [other_left, other_top, other_right, _]] = stacked[..] else { panic!("two frames") };
    assert_eq!([left, right], [other_left, other_right]);
    assert!(bottom < other_top);
    let beside = frames(&Plot { arrangement: Arrangement::SideBySide, ..two_panels() });
    let [[_, top, right, bottom], [other_left, other_top, _, other_bottom]] = beside[..] else { panic!("two frames") };
    assert_eq!([top, bottom], [other_top, other_bottom]);
    assert!(right < other_left);
    let picture = pixels(&photon_transfer());
    assert_eq!((picture.width(), picture.height()), (900, 600));
}

#[test]
fn units_are_equally_long_where_asked_for() {
    let aspect = |x: Axis, y: Axis| {
        let plot = Plot::new("", Panel { equal_scale: true, ..Panel::new(x, y) });
        let [left, top, right, bottom] = frames(&plot)[0];
        (right - left) / (bottom - top)
    };
    let axis = |end| Axis::linear("").range(0.0, end);
    // To a pixel in some five hundred, or in a hundred.
    assert!((aspect(axis(10.0), axis(10.0)) - 1.0).abs() < 0.005);
    assert!((aspect(axis(2.5), axis(10.0)) - 0.25).abs() < 0.005);
    assert!((aspect(axis(2.5), axis(0.5)) - 5.0).abs() < 0.05);
    // What would be a line stays as it is, and so do axes that have no common unit.
    let free = 1.4..1.8;
    assert!(free.contains(&aspect(axis(2.5), axis(1e-3))));
    assert!(free.contains(&aspect(axis(2.5), Axis::log10("").range(1.0, 10.0))));
}

#[test]
fn what_an_axis_cannot_show_is_left_out_of_the_line() {
    let axis = || Axis::log10("").range(1.0, 100.0);
    let line = |points: Vec<[f64; 2]>| {
        let mut panel = Panel::new(axis(), axis());
        panel.add("", Color::Blue, Marks::Line(points));
        Plot::new("", panel).svg()
    };
    let holes = vec![[1.0, 1.0], [2.0, f64::NAN], [f64::INFINITY, 2.0], [3.0, 0.0], [-1.0, 3.0], [100.0, 100.0]];
    assert_eq!(line(holes), line(vec![[1.0, 1.0], [100.0, 100.0]]));
}

#[test]
fn the_same_plot_has_the_same_bytes() {
    assert_eq!(two_panels().svg(), two_panels().svg());
    assert_eq!(two_panels().png().unwrap(), two_panels().png().unwrap());
}

#[test]
fn texts_are_escaped() {
    let label = "a < b & \"c\" > d";
    let mut panel = Panel::new(Axis::linear(label), Axis::linear("\u{1}"));
    panel.add("<x>", Color::of_index(7), Marks::Line(vec![]));
    let plot = Plot::new("5 > 4", panel);
    let said: Vec<String> = words(&plot).into_iter().map(|(word, _)| word).collect();
    for text in [label, " ", "<x>", "5 > 4"] {
        assert!(said.iter().any(|word| word == text), "{text:?} in {said:?}");
    }
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
                Marks::ErrorBars(ranges.clone()),
            ] {
                let mut panel = Panel::new(scale.clone(), scale.clone());
                panel.add("name", Color::Orange, marks);
                panel.notes.push(Note::Line { points: points.clone(), color: Color::Black });
                for at in &points {
                    panel.notes.push(Note::Text { at: *at, anchor: Anchor::End, text: "→".into() });
                    panel.notes.push(Note::Circle { at: *at, diameter: at[0], color: Color::Black });
                }
                panel.equal_scale = true;
                panel.vertical_lines = vec![ReferenceLine { at: f64::NAN, label: "nowhere".into() }];
                panel.horizontal_lines = vec![ReferenceLine { at: -1.0, label: "far".into() }];
                panel.regions = vec![Region { from: f64::NAN, to: 1.0, label: "nothing".into(), color: Color::Yellow }];
                let plot = Plot::new("odd", panel);
                assert_eq!(frames(&plot).len(), 1);
                assert_eq!(pixels(&plot).width(), 900);
            }
        }
    }
    let nothing = Plot { title: String::new(), panels: vec![], arrangement: Arrangement::SideBySide };
    assert_eq!(frames(&nothing).len(), 0);
    assert!(nothing.png().is_ok());
}

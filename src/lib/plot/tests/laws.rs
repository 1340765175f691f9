//! What holds of every plot: words lie apart from each other and from what is shown, and all that is shown is seen.

use super::reading::{axes, difference, elements, frames, words};
use super::*;

/// Numbers from 0 to 1 that are the same at every run, after Park and Miller.
fn numbers(seed: u32) -> impl FnMut() -> f64 {
    let mut state = u64::from(seed);
    move || {
        state = state * 48_271 % 0x7fff_ffff;
        state as f64 / f64::from(0x7fff_ffff)
    }
}

/// Named points, half of them in a cluster, beside a line.
fn cluster(seed: u32, count: usize) -> Plot {
    let mut next = numbers(seed);
    let mut panel = Panel::new(Axis::linear("x").range(0.0, 10.0), Axis::linear("y").range(0.0, 10.0));
    panel.add("line", Color::Gray, Marks::Line(vec![[0.0, 5.0], [4.0, 5.0], [4.0, 2.0], [10.0, 2.0]]));
    let mut groups = [Vec::new(), Vec::new()];
    for index in 0..count {
        let place = [next(), next()].map(|part| if index % 2 == 0 { 1.0 + 8.0 * part } else { 4.5 + 1.5 * part });
        groups[index % 2].push(place);
        panel.name(place, &format!("p{index}"), [Color::Blue, Color::Vermillion][index % 2]);
    }
    let [spread, near] = groups;
    panel.add("spread", Color::Blue, Marks::Points(spread));
    panel.add("near", Color::Vermillion, Marks::Points(near));
    Plot::new("Names", panel)
}

/// What is between a place and a rectangle.
fn gap([x, y]: [f64; 2], [left, top, right, bottom]: [f64; 4]) -> f64 {
    f64::hypot(x - x.clamp(left, right), y - y.clamp(top, bottom))
}

#[test]
fn names_lie_apart_within_the_frame_and_belong_to_their_points() {
    for seed in 1..=20 {
        let plot = cluster(seed, 16);
        super::keep(&format!("names-{seed}"), &plot);
        let (panel, frame, axes) = (&plot.panels[0], frames(&plot)[0], &axes(&plot)[0]);
        let words = words(&plot);
        let at = |point: [f64; 2]| [axes[0].pixel(point[0]), axes[1].pixel(point[1])];
        let marks: Vec<[f64; 2]> = panel.names.iter().map(|name| at(name.at)).collect();
        let leaders: Vec<_> =
            elements(&plot).into_iter().filter(|e| e.get("stroke") == "#777777" && !e.is_clipped).collect();
        for (name, own) in panel.names.iter().zip(&marks) {
            let (_, bounds) =
                words.iter().find(|(word, _)| *word == name.text).unwrap_or_else(|| panic!("{seed}: {name:?}"));
            assert!(super::within([bounds[0], bounds[1]], frame) && super::within([bounds[2], bounds[3]], frame));
            for (other, their) in words.iter().filter(|(word, _)| *word != name.text) {
                assert!(!super::overlap(*bounds, *their), "{seed}: {} lies over {other}", name.text);
            }
            // Marks reach 5 pixels from their middle.
            assert!(marks.iter().all(|mark| gap(*mark, *bounds) > 4.0), "{seed}: {} lies over a mark", name.text);
            let is_led = leaders.iter().any(|leader| {
                let [from, to] = leader.places()[..] else { return false };
                f64::hypot(from[0] - own[0], from[1] - own[1]) < 7.0 && gap(to, *bounds) < 6.0
            });
            let is_nearest = marks.iter().all(|mark| gap(*mark, *bounds) >= gap(*own, *bounds));
            assert!(is_led || is_nearest, "{seed}: whose is {}?", name.text);
        }
    }
}

#[test]
fn names_beside_a_line_do_not_lie_on_it() {
    let mut panel = Panel::new(Axis::linear("x").range(0.0, 10.0), Axis::linear("y").range(0.0, 10.0));
    let line: Vec<[f64; 2]> = (0..=10).map(|x| [f64::from(x), f64::from(x)]).collect();
    panel.add("", Color::Blue, Marks::LineAndPoints(line.clone()));
    line[1..10].iter().for_each(|at| panel.name(*at, "a name", Color::Blue));
    let plot = Plot::new("", panel);
    let axes = &axes(&plot)[0];
    let named: Vec<_> = words(&plot).into_iter().filter(|(word, _)| word == "a name").collect();
    assert_eq!(named.len(), 9);
    for (_, bounds) in named {
        let passes = (0..=1000).map(|step| f64::from(step) / 100.0);
        let is_on = passes.map(|at| [axes[0].pixel(at), axes[1].pixel(at)]).any(|at| super::within(at, bounds));
        assert!(!is_on, "{bounds:?}");
    }
}

#[test]
fn points_of_one_name_that_touch_share_it() {
    let mut panel = Panel::new(Axis::linear("x").range(0.0, 10.0), Axis::linear("y").range(0.0, 10.0));
    for (color, x) in [(Color::Blue, 5.0), (Color::Green, 5.05), (Color::Orange, 8.0)] {
        panel.add("", color, Marks::Points(vec![[x, 5.0]]));
        panel.name([x, 5.0], "1 nm", color);
    }
    assert_eq!(words(&Plot::new("", panel)).iter().filter(|(word, _)| word == "1 nm").count(), 2);
}

#[test]
fn names_of_one_color_whose_marks_hide_each_other_stand_together() {
    let mut panel = Panel::new(Axis::linear("x").range(0.0, 10.0), Axis::linear("y").range(0.0, 10.0));
    panel.add("", Color::Blue, Marks::Points(vec![[5.0, 5.0], [5.01, 5.0], [8.0, 5.0]]));
    for (x, text) in [(5.0, "piz"), (5.01, "zips"), (8.0, "zip")] {
        panel.name([x, 5.0], text, Color::Blue);
    }
    let words: Vec<String> = words(&Plot::new("", panel)).into_iter().map(|(word, _)| word).collect();
    assert!(words.contains(&"piz, zips".into()) && words.contains(&"zip".into()), "{words:?}");
    assert!(!words.contains(&"zips".into()), "{words:?}");
}

/// A legend above one panel lowers the frame beside it, which was just high enough for its own.
#[test]
fn no_legend_is_lost_beside_another() {
    let mut panel = Panel::new(Axis::linear("x").range(0.0, 10.0), Axis::linear("y").range(0.0, 10.0));
    let zigzag = |step: f64| (0..200).map(|i| [f64::from(i) * 0.05, if i % 2 == 0 { 0.0 } else { step }]).collect();
    panel.add("low", Color::Blue, Marks::Line(zigzag(1.0)));
    let mut full = panel.clone();
    for index in 0..6 {
        full.add(&format!("a series with a long name, {index}"), Color::of_index(index), Marks::Line(zigzag(10.0)));
    }
    for height in [2.0, 4.0, 6.0, 6.5, 7.0, 7.25, 7.5, 7.75, 8.0, 8.25, 8.5, 8.75] {
        let mut panel = panel.clone();
        panel.add("high", Color::Vermillion, Marks::Line(zigzag(height)));
        let plot = Plot { title: "t".into(), panels: vec![panel, full.clone()], arrangement: Arrangement::Pairs };
        let words: Vec<String> = words(&plot).into_iter().map(|(word, _)| word).collect();
        assert!(words.contains(&"high".into()) && words.contains(&"low".into()), "{height}: {words:?}");
    }
}

#[test]
fn words_of_a_panel_without_axes_stay_within_its_cell() {
    let mut panel = Panel::new(Axis::linear(""), Axis::linear(""));
    (panel.has_axes, panel.title) = (false, "a long sentence of many words ".repeat(8));
    let panels = vec![panel, two_panels().panels[0].clone()];
    let plot = Plot { title: String::new(), panels, arrangement: Arrangement::Pairs };
    let said: Vec<_> = words(&plot).into_iter().filter(|(word, _)| word.contains("sentence")).collect();
    assert!(said.len() > 2);
    assert!(said.iter().all(|(_, [left, _, right, _])| *left >= 0.0 && *right <= 520.0), "{said:?}");
}

/// Labels of the y axis as long as these put the frame far from the middle of its cell.
#[test]
fn the_title_of_a_panel_stays_within_its_cell() {
    let title = "1 of 75 means of rows beyond the axes, as far as 158432";
    let panel = || {
        let mut panel = Panel::new(Axis::linear("row"), Axis::linear("mean").range(0.0, 123_456_789.0));
        panel.title = title.into();
        panel.add("a", Color::Blue, Marks::Line(vec![[0.0, 0.0], [1.0, 1e8]]));
        panel
    };
    let plot = Plot { title: String::new(), panels: vec![panel(), panel()], arrangement: Arrangement::Pairs };
    let titles: Vec<[f64; 4]> =
        words(&plot).into_iter().filter(|(text, _)| text == title).map(|(_, bounds)| bounds).collect();
    let [left, right] = titles[..] else { panic!("{titles:?}") };
    assert!(left[0] >= 0.0 && left[2] <= right[0] && right[2] <= 1040.0, "{titles:?}");
}

#[test]
fn every_series_is_seen_though_others_lie_over_it() {
    let places = vec![[1.0, 1.0], [2.0, 3.0], [3.0, 2.0]];
    let mut panel = Panel::new(Axis::linear("x").range(0.0, 4.0), Axis::linear("y").range(0.0, 4.0));
    let colors: Vec<Color> = (0..7).map(Color::of_index).collect();
    for color in &colors {
        panel.add("", *color, Marks::Points(places.clone()));
    }
    let plot = Plot::new("", panel);
    for (index, color) in colors.iter().enumerate() {
        let mut other = plot.clone();
        other.panels[0].series.remove(index);
        assert!(difference(&plot, &other).is_some(), "{color:?} is hidden");
    }
}

#[test]
fn colors_differ_in_the_form_of_points_and_in_dashes() {
    let mut looks = Vec::new();
    for color in (0..7).map(Color::of_index).chain([Color::Gray]) {
        let mut panel = Panel::new(Axis::linear("x").range(0.0, 1.0), Axis::linear("y").range(0.0, 1.0));
        panel.add("", color, Marks::Points(vec![[0.5, 0.5]]));
        let mark = elements(&Plot::new("", panel)).into_iter().find(|e| e.get("stroke") == "#ffffff");
        let mark = mark.unwrap_or_else(|| panic!("{color:?} has no mark"));
        let look = (mark.get("d").to_owned(), super::style::dashes(color));
        for (form, dashes) in &looks {
            assert!(*form != look.0 && *dashes != look.1, "{color:?}");
        }
        looks.push(look);
    }
}

#[test]
fn numbers_of_an_axis_are_written_alike() {
    for low in -6..5 {
        for high in low + 1..8 {
            let ends = (10_f64.powi(low), 4.0 * 10_f64.powi(high));
            let axis = Axis::log10("").range(ends.0, ends.1);
            let plot = Plot::new("", Panel::new(axis, Axis::linear("y").range(-7.0, -6.0)));
            let below = frames(&plot)[0][3];
            let ticks: Vec<String> =
                words(&plot).into_iter().filter(|(_, at)| at[1] > below).map(|(word, _)| word).collect();
            let powers = ticks.iter().filter(|tick| tick.chars().any(|c| "⁰¹²³⁴⁵⁶⁷⁸⁹".contains(c))).count();
            assert!(ticks.len() > 1 && (powers == 0 || powers == ticks.len()), "{ends:?}: {ticks:?}");
        }
    }
}

#[test]
fn a_legend_without_room_stands_above_the_frame() {
    let mut panel = Panel::new(Axis::linear("x"), Axis::linear("y"));
    let mut next = numbers(7);
    for index in 0..7 {
        let points = (0..60).map(|_| [next(), next()]).collect();
        panel.add(&format!("series number {index}"), Color::of_index(index), Marks::Points(points));
    }
    panel.regions.push(Region { from: 0.0, to: 0.5, label: "half".into(), color: Color::Yellow });
    let plot = Plot { panels: vec![panel; 3], ..two_panels() };
    for arrangement in [Arrangement::Stacked, Arrangement::SideBySide, Arrangement::Pairs] {
        let plot = Plot { arrangement, ..plot.clone() };
        super::keep(&format!("legends-{arrangement:?}"), &plot);
        let all = elements(&plot);
        let boxes: Vec<[f64; 4]> =
            all.iter().filter(|e| e.is_closed() && e.get("fill-opacity") == "0.88").map(|e| e.bounds()).collect();
        let frames = frames(&plot);
        assert_eq!((boxes.len(), frames.len()), (3, 3));
        let words = words(&plot);
        for (legend, frame) in boxes.iter().zip(&frames) {
            assert!(legend[3] < frame[1], "{legend:?} {frame:?}");
            assert!(frames.iter().all(|frame| !super::overlap(*legend, *frame)));
            let inside = |bounds: &[f64; 4]| super::within([bounds[0], bounds[1]], *legend);
            let others = words.iter().filter(|(word, _)| !word.starts_with("series"));
            assert!(others.clone().all(|(_, bounds)| !super::overlap(*bounds, *legend)), "{arrangement:?}");
            assert_eq!(words.iter().filter(|(_, bounds)| inside(bounds)).count(), 7);
        }
    }
}

#[test]
fn long_names_and_titles_stay_in_their_own_cell() {
    let mut panel = Panel::new(Axis::linear("x"), Axis::linear("y"));
    panel.title = "94 % of a class with some name in its lowest bin, beyond the axis; 94 % of another".into();
    let mut next = numbers(7);
    for index in 0..3 {
        let points = (0..60).map(|_| [next(), next()]).collect();
        let name = format!("{index}_very_long_layer_name_number_one.channel_of_the_north");
        panel.add(&name, Color::of_index(index), Marks::Points(points));
    }
    let plot = Plot { panels: vec![panel; 5], arrangement: Arrangement::Pairs, ..two_panels() };
    super::keep("long-names", &plot);
    let all = elements(&plot);
    let boxes: Vec<[f64; 4]> =
        all.iter().filter(|e| e.is_closed() && e.get("fill-opacity") == "0.88").map(|e| e.bounds()).collect();
    assert_eq!(boxes.len(), 5);
    for (index, legend) in boxes.iter().enumerate() {
        assert!(boxes[..index].iter().all(|other| !super::overlap(*legend, *other)), "{boxes:?}");
    }
    // Two cells are 1040 pixels wide, and the margin of a title 14.
    let written = words(&plot);
    assert!(
        written.iter().all(|(word, [left, _, right, _])| *left >= 13.0 && *right <= 1027.0 || word.is_empty()),
        "{written:?}"
    );
}

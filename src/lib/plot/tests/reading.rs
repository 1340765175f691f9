//! Reads pictures: an SVG back into shapes, words and values, a PNG into pixels.

use crate::plot::figure::{Plot, Scale};
use crate::plot::font;
use std::collections::BTreeMap;

/// Coordinates of an SVG are rounded to a hundredth of a pixel. A place is told from two ticks, each wrong by as much, and
/// the outermost ticks span at least half of an axis: half a hundredth for the place, three for the ticks.
pub const ROUNDING: f64 = 0.005 * (1.0 + 3.0);

/// An element without children but text.
#[derive(Debug, Clone, Default)]
pub struct Element {
    pub name: String,
    pub attributes: BTreeMap<String, String>,
    pub text: String,
    /// Whether it is seen within a clip only.
    pub is_clipped: bool,
}

impl Element {
    pub fn get(&self, name: &str) -> &str {
        self.attributes.get(name).map_or("", String::as_str)
    }

    pub fn number(&self, name: &str) -> f64 {
        self.get(name).parse().unwrap_or_else(|_| panic!("{name} of {self:?}"))
    }

    /// The corners of a path; the center of a circle.
    pub fn places(&self) -> Vec<[f64; 2]> {
        if self.name == "circle" {
            return vec![[self.number("cx"), self.number("cy")]];
        }
        let numbers: Vec<f64> =
            self.get("d").split(['M', 'L', 'Z', ' ']).filter_map(|number| number.parse().ok()).collect();
        numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
    }

    /// Left, top, right and bottom of the corners.
    pub fn bounds(&self) -> [f64; 4] {
        let places = self.places();
        let end = |axis: usize, pick: fn(f64, f64) -> f64| places.iter().map(|at| at[axis]).reduce(pick).unwrap();
        [end(0, f64::min), end(1, f64::min), end(0, f64::max), end(1, f64::max)]
    }

    /// The same with the width of a line or the radius of a circle.
    pub fn reach(&self) -> [f64; 4] {
        let [left, top, right, bottom] = self.bounds();
        let beyond = if self.name == "circle" { self.number("r") } else { 1.0 };
        [left - beyond, top - beyond, right + beyond, bottom + beyond]
    }

    pub fn is_closed(&self) -> bool {
        self.get("d").ends_with('Z')
    }

    /// Left, top, right and bottom of a text's letters.
    pub fn word_bounds(&self) -> [f64; 4] {
        let (x, y, size) = (self.number("x"), self.number("y"), self.number("font-size"));
        let width = font::width(&self.text, size);
        let start = match self.get("text-anchor") {
            "start" => 0.0,
            "middle" => -0.5 * width,
            "end" => -width,
            other => panic!("{other}"),
        };
        // Letters of DejaVu Sans reach 0.76 of the size up and 0.24 down.
        let (up, down) = (0.76 * size, 0.24 * size);
        if self.get("transform").starts_with("rotate(-90") {
            [x - up, y - start - width, x + down, y - start]
        } else {
            [x + start, y - up, x + start + width, y + down]
        }
    }
}

fn plain(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

/// All elements that show something, in their order. What is no XML, and a number that is none, stops the test.
pub fn elements(plot: &Plot) -> Vec<Element> {
    let svg = plot.svg();
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    let mut found = Vec::new();
    let mut open: Vec<Element> = Vec::new();
    let mut rest = svg.as_str();
    while let Some(start) = rest.find('<') {
        assert!(!rest[..start].contains('>'), "{}", &rest[..start]);
        if let Some(element) = open.last_mut() {
            element.text.push_str(&plain(rest[..start].trim_matches('\n')));
        }
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            let element = open.pop().unwrap();
            assert_eq!(element.name, name);
            found.extend(["text", "title"].contains(&name).then_some(element));
            continue;
        }
        let (name, attributes) = tag.trim_end_matches('/').split_once([' ']).unwrap_or((tag, ""));
        let parts: Vec<&str> = attributes.split('"').collect();
        assert_eq!(parts.len() % 2, 1, "{tag}");
        let attributes =
            parts.chunks_exact(2).map(|pair| (pair[0].trim().trim_end_matches('=').into(), plain(pair[1])));
        let is_clipped = open.iter().any(|element| element.name == "g");
        let element = Element { name: name.into(), attributes: attributes.collect(), text: String::new(), is_clipped };
        if tag.ends_with('/') {
            found.extend(open.iter().all(|outer| outer.name != "clipPath").then_some(element));
        } else {
            open.push(element);
        }
    }
    assert!(open.is_empty(), "{open:?}");
    found
}

/// What a plot's words say and where they are.
pub fn words(plot: &Plot) -> Vec<(String, [f64; 4])> {
    let texts = elements(plot).into_iter().filter(|element| element.name == "text");
    texts.map(|text| (text.text.clone(), text.word_bounds())).collect()
}

/// The frames between axes.
pub fn frames(plot: &Plot) -> Vec<[f64; 4]> {
    let closed = |element: &Element| element.is_closed() && element.get("stroke") == "#444444";
    elements(plot).iter().filter(|element| closed(element)).map(Element::bounds).collect()
}

/// The number that a tick's label says.
fn value(label: &str) -> Option<f64> {
    let lowered = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|high| high == c).map(|digit| digit.to_string());
    let exponent = |text: &str| {
        let digits: String = text.chars().map(|c| lowered(c).unwrap_or(c.to_string())).collect();
        digits.replace('⁻', "-").parse::<i32>().ok()
    };
    let label = label.replace('−', "-");
    match label.split_once("·10") {
        Some((mantissa, power)) => Some(mantissa.parse::<f64>().ok()? * 10_f64.powi(exponent(power)?)),
        None => match label.strip_prefix("10").filter(|rest| rest.starts_with(|c| c == '⁻' || lowered(c).is_some())) {
            Some(power) => Some(10_f64.powi(exponent(power)?)),
            None => label.parse().ok(),
        },
    }
}

/// An axis as a reader of the plot sees it: from the numbers beside its ticks.
pub struct ReadAxis {
    scale: Scale,
    /// Pixels and values (or their logarithms) of the outermost ticks.
    ends: [(f64, f64); 2],
}

impl ReadAxis {
    fn new(scale: Scale, ticks: &[(f64, f64)]) -> Self {
        let along = |value: f64| if scale == Scale::Log10 { value.log10() } else { value };
        let mut ticks: Vec<(f64, f64)> = ticks.iter().map(|(pixel, value)| (*pixel, along(*value))).collect();
        ticks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let axis = Self { scale, ends: [ticks[0], ticks[ticks.len() - 1]] };
        assert!(ticks.len() > 1, "one tick says nothing");
        // Numbers have few digits; the ticks stand where they say exactly.
        for (pixel, value) in &ticks {
            assert!((axis.pixel_along(*value) - pixel).abs() < ROUNDING, "a tick says {value} at {pixel}");
        }
        axis
    }

    fn pixel_along(&self, along: f64) -> f64 {
        let [(from, low), (to, high)] = self.ends;
        from + (along - low) / (high - low) * (to - from)
    }

    /// Where a value should stand.
    pub fn pixel(&self, value: f64) -> f64 {
        self.pixel_along(if self.scale == Scale::Log10 { value.log10() } else { value })
    }
}

/// The axes of each panel.
pub fn axes(plot: &Plot) -> Vec<[ReadAxis; 2]> {
    let elements = elements(plot);
    let ticks = elements.iter().filter(|element| element.name == "text" && element.number("font-size") == 16.0);
    let ticks: Vec<(&Element, f64)> = ticks.filter_map(|text| Some((text, value(&text.text)?))).collect();
    let axes = |(panel, [left, top, right, bottom]): (usize, [f64; 4])| {
        let below = |text: &Element| (bottom..bottom + 28.0).contains(&text.number("y"));
        let under = |text: &Element| (left - 1.0..right + 1.0).contains(&text.number("x")) && below(text);
        let beside = |text: &Element| (left - 24.0..left).contains(&text.number("x"));
        let level = |text: &Element| (top..bottom + 10.0).contains(&text.number("y")) && beside(text);
        let x: Vec<(f64, f64)> =
            ticks.iter().filter(|(text, _)| under(text)).map(|(text, value)| (text.number("x"), *value)).collect();
        // Digits are 0.73 of the size high; they are centered to the tick.
        let y: Vec<(f64, f64)> = ticks
            .iter()
            .filter(|(text, _)| level(text))
            .map(|(text, value)| (text.number("y") - 0.365 * 16.0, *value))
            .collect();
        [ReadAxis::new(plot.panels[panel].x.scale, &x), ReadAxis::new(plot.panels[panel].y.scale, &y)]
    };
    frames(plot).into_iter().enumerate().map(axes).collect()
}

/// The pixels of a plot's PNG.
pub fn pixels(plot: &Plot) -> image::RgbImage {
    let png = plot.png().unwrap();
    image::load_from_memory_with_format(&png, image::ImageFormat::Png).unwrap().into_rgb8()
}

/// Left, top, right and bottom of the pixels that differ.
pub fn difference(a: &Plot, b: &Plot) -> Option<[f64; 4]> {
    let (a, b) = (pixels(a), pixels(b));
    assert_eq!(a.dimensions(), b.dimensions());
    let differing = a.enumerate_pixels().filter(|(x, y, pixel)| *pixel != b.get_pixel(*x, *y));
    differing.fold(None, |bounds: Option<[f64; 4]>, (x, y, _)| {
        let [x, y] = [f64::from(x), f64::from(y)];
        let [left, top, right, bottom] = bounds.unwrap_or([x, y, x, y]);
        Some([left.min(x), top.min(y), right.max(x + 1.0), bottom.max(y + 1.0)])
    })
}

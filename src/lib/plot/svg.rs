//! Drawings as SVG.

use super::drawing::{Drawing, Ink, Item, Outline, Point, Stroke, Text};
use super::figure::Anchor;
use std::fmt::Write;

/// The drawing as an SVG document.
pub(super) fn document(drawing: &Drawing) -> String {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
         font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n<title>{2}</title>\n\
         <rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
        number(drawing.width),
        number(drawing.height),
        escaped(&drawing.title)
    );
    let mut clips = 0;
    for item in &drawing.items {
        match item {
            Item::Shape { outline, fill, stroke } => write_shape(&mut out, outline, *fill, *stroke),
            Item::Text(text) => write_text(&mut out, text),
            Item::Clip(Some(clip)) => {
                let _ = write!(out, "<clipPath id=\"clip{clips}\">");
                write_outline(&mut out, &clip.outline());
                let _ = writeln!(out, "/></clipPath>\n<g clip-path=\"url(#clip{clips})\">");
                clips += 1;
            }
            Item::Clip(None) => out.push_str("</g>\n"),
        }
    }
    out.push_str("</svg>\n");
    out
}

/// A coordinate, in hundredths of a pixel.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Text as XML; control characters, which XML cannot hold, become spaces.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || ('\u{FFFE}'..='\u{FFFF}').contains(&c) => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Begins an element with its geometry.
fn write_outline(out: &mut String, outline: &Outline) {
    let path = |out: &mut String, points: &[Point], end| {
        out.push_str("<path d=\"");
        for (index, [x, y]) in points.iter().enumerate() {
            let _ = write!(out, "{}{} {}", if index == 0 { 'M' } else { 'L' }, number(*x), number(*y));
        }
        out.push_str(end);
    };
    match outline {
        Outline::Circle([x, y], radius) => {
            let _ = write!(out, "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"", number(*x), number(*y), number(*radius));
        }
        Outline::Line(points) => path(out, points, "\""),
        Outline::Polygon(points) => path(out, points, "Z\""),
    }
}

fn write_shape(out: &mut String, outline: &Outline, fill: Option<Ink>, stroke: Option<Stroke>) {
    write_outline(out, outline);
    let opacity = |out: &mut String, name: &str, ink: Ink| {
        if ink.opacity < 1.0 {
            let _ = write!(out, " {name}=\"{}\"", number(ink.opacity));
        }
    };
    let _ = write!(out, " fill=\"{}\"", fill.map_or("none".into(), |ink| hex(ink.rgb)));
    if let Some(ink) = fill {
        opacity(out, "fill-opacity", ink);
    }
    if let Some(stroke) = stroke {
        let _ = write!(out, " stroke=\"{}\" stroke-width=\"{}\"", hex(stroke.ink.rgb), number(stroke.width));
        opacity(out, "stroke-opacity", stroke.ink);
        out.push_str(" stroke-linejoin=\"round\"");
        if !stroke.dashes.is_empty() {
            let dashes: Vec<String> = stroke.dashes.iter().map(|length| number(*length)).collect();
            let _ = write!(out, " stroke-dasharray=\"{}\"", dashes.join(" "));
        }
    }
    out.push_str("/>\n");
}

fn write_text(out: &mut String, text: &Text) {
    let [x, y] = text.at.map(number);
    let anchor = match text.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let _ = write!(out, "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" text-anchor=\"{anchor}\"", number(text.size));
    if text.upward {
        let _ = write!(out, " transform=\"rotate(-90 {x} {y})\"");
    }
    let _ = writeln!(out, " fill=\"{}\">{}</text>", hex(text.rgb), escaped(&text.text));
}

//! A list of shapes and texts, written as SVG or painted into a PNG.

use super::font;
use crate::error::{Error, Result};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::fmt::Write;
use tiny_skia::{FillRule, LineCap, LineJoin, Mask, Paint, PathBuilder, Pixmap, StrokeDash, Transform};

/// A place: x to the right, y downwards, in pixels.
pub(super) type Point = [f64; 2];

/// An upright rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rect {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Rect {
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    pub fn corners(&self) -> Vec<Point> {
        let Self { left, top, .. } = *self;
        vec![[left, top], [self.right(), top], [self.right(), self.bottom()], [left, self.bottom()]]
    }

    pub fn contains(&self, [x, y]: Point) -> bool {
        (self.left..=self.right()).contains(&x) && (self.top..=self.bottom()).contains(&y)
    }
}

/// A color and how much of it covers what is below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ink {
    pub rgb: [u8; 3],
    pub opacity: f64,
}

/// A line's ink, width and dashes (empty for none).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub ink: Ink,
    pub width: f64,
    pub dashes: &'static [f64],
}

/// Outlines that are painted at once, so that neighbors with a common edge show no seam.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Outline {
    Line(Vec<Point>),
    Polygons(Vec<Vec<Point>>),
    Circle(Point, f64),
}

/// Which part of a text stands at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A line of text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Text {
    pub text: String,
    /// Where the baseline is.
    pub at: Point,
    pub size: f64,
    pub anchor: Anchor,
    /// Whether it reads from bottom to top.
    pub upwards: bool,
    pub rgb: [u8; 3],
}

#[derive(Debug, Clone, PartialEq)]
enum Item {
    Shape {
        outline: Outline,
        fill: Option<Ink>,
        stroke: Option<Stroke>,
    },
    Text(Text),
    /// What follows is seen within the rectangle only, or everywhere again.
    Clip(Option<Rect>),
}

/// What is on the canvas, from the bottom up.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawing {
    width: f64,
    height: f64,
    /// What a screen reader says.
    title: String,
    items: Vec<Item>,
}

impl Drawing {
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        Self { width, height, title: title.into(), items: Vec::new() }
    }

    pub fn fill(&mut self, outline: Outline, ink: Ink) {
        self.items.push(Item::Shape { outline, fill: Some(ink), stroke: None });
    }

    pub fn stroke(&mut self, outline: Outline, stroke: Stroke) {
        self.items.push(Item::Shape { outline, fill: None, stroke: Some(stroke) });
    }

    pub fn shape(&mut self, outline: Outline, ink: Ink, stroke: Stroke) {
        self.items.push(Item::Shape { outline, fill: Some(ink), stroke: Some(stroke) });
    }

    pub fn text(&mut self, text: Text) {
        if !text.text.is_empty() {
            self.items.push(Item::Text(text));
        }
    }

    /// Draws within a rectangle only.
    pub fn within(&mut self, clip: Rect, draw: impl FnOnce(&mut Self)) {
        self.items.push(Item::Clip(Some(clip)));
        draw(self);
        self.items.push(Item::Clip(None));
    }

    pub fn svg(&self) -> String {
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
             font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n<title>{2}</title>\n\
             <rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
            number(self.width),
            number(self.height),
            escaped(&self.title)
        );
        let mut clips = 0;
        for item in &self.items {
            match item {
                Item::Shape { outline, fill, stroke } => shape_svg(&mut out, outline, *fill, *stroke),
                Item::Text(text) => text_svg(&mut out, text),
                Item::Clip(Some(clip)) => {
                    let _ = write!(out, "<clipPath id=\"clip{clips}\"><path d=\"");
                    path_svg(&mut out, &clip.corners(), true);
                    let _ = writeln!(out, "\"/></clipPath>\n<g clip-path=\"url(#clip{clips})\">");
                    clips += 1;
                }
                Item::Clip(None) => out.push_str("</g>\n"),
            }
        }
        out.push_str("</svg>\n");
        out
    }

    pub fn png(&self) -> Result<Vec<u8>> {
        let failed =
            |problem: &dyn std::fmt::Display| Error::Data(format!("the plot cannot be painted as a PNG: {problem}"));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the layout makes small sizes")]
        let (width, height) = (self.width.ceil() as u32, self.height.ceil() as u32);
        let mut canvas = Pixmap::new(width, height).ok_or_else(|| failed(&"it is too large"))?;
        canvas.fill(tiny_skia::Color::WHITE);
        let mut mask = None;
        for item in &self.items {
            match item {
                Item::Shape { outline, fill, stroke } => {
                    let Some(path) = outline_path(outline) else { continue };
                    let still = Transform::identity();
                    if let Some(ink) = fill {
                        canvas.fill_path(&path, &paint(*ink), FillRule::Winding, still, mask.as_ref());
                    }
                    if let Some(stroke) = stroke {
                        canvas.stroke_path(&path, &paint(stroke.ink), &skia_stroke(*stroke), still, mask.as_ref());
                    }
                }
                Item::Text(text) => paint_text(&mut canvas, text),
                Item::Clip(None) => mask = None,
                Item::Clip(Some(clip)) => {
                    let mut inside = Mask::new(width, height).ok_or_else(|| failed(&"it is too large"))?;
                    if let Some(path) = outline_path(&Outline::Polygons(vec![clip.corners()])) {
                        inside.fill_path(&path, FillRule::Winding, true, Transform::identity());
                    }
                    mask = Some(inside);
                }
            }
        }
        // The background is opaque, so that there is no alpha to keep.
        let rgb: Vec<u8> = canvas.data().chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied()).collect();
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
            .write_image(&rgb, width, height, ExtendedColorType::Rgb8)
            .map_err(|error| failed(&error))?;
        Ok(bytes)
    }
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

fn path_svg(out: &mut String, points: &[Point], closed: bool) {
    for (index, [x, y]) in points.iter().enumerate() {
        let _ = write!(out, "{}{} {}", if index == 0 { 'M' } else { 'L' }, number(*x), number(*y));
    }
    if closed {
        out.push('Z');
    }
}

fn shape_svg(out: &mut String, outline: &Outline, fill: Option<Ink>, stroke: Option<Stroke>) {
    match outline {
        Outline::Circle([x, y], radius) => {
            let _ = write!(out, "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"", number(*x), number(*y), number(*radius));
        }
        Outline::Line(points) => {
            out.push_str("<path d=\"");
            path_svg(out, points, false);
            out.push('"');
        }
        Outline::Polygons(polygons) => {
            out.push_str("<path d=\"");
            polygons.iter().for_each(|points| path_svg(out, points, true));
            out.push('"');
        }
    }
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

fn text_svg(out: &mut String, text: &Text) {
    let [x, y] = text.at.map(number);
    let anchor = match text.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let _ = write!(out, "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" text-anchor=\"{anchor}\"", number(text.size));
    if text.upwards {
        let _ = write!(out, " transform=\"rotate(-90 {x} {y})\"");
    }
    let _ = writeln!(out, " fill=\"{}\">{}</text>", hex(text.rgb), escaped(&text.text));
}

#[expect(clippy::cast_possible_truncation, reason = "places on the canvas")]
fn skia_points(points: &[Point]) -> impl Iterator<Item = (f32, f32)> {
    points.iter().map(|[x, y]| (*x as f32, *y as f32))
}

fn outline_path(outline: &Outline) -> Option<tiny_skia::Path> {
    let mut path = PathBuilder::new();
    let draw = |path: &mut PathBuilder, points: &[Point]| {
        for (index, (x, y)) in skia_points(points).enumerate() {
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
    };
    match outline {
        Outline::Line(points) => draw(&mut path, points),
        Outline::Polygons(polygons) => {
            for points in polygons {
                draw(&mut path, points);
                path.close();
            }
        }
        Outline::Circle(center, radius) => {
            let (x, y) = skia_points(&[*center]).next()?;
            #[expect(clippy::cast_possible_truncation, reason = "a few pixels")]
            path.push_circle(x, y, *radius as f32);
        }
    }
    path.finish()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a fraction of 255")]
fn paint(ink: Ink) -> Paint<'static> {
    let [r, g, b] = ink.rgb;
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (ink.opacity.clamp(0.0, 1.0) * 255.0).round() as u8);
    paint
}

#[expect(clippy::cast_possible_truncation, reason = "a few pixels")]
fn skia_stroke(stroke: Stroke) -> tiny_skia::Stroke {
    let dashes = stroke.dashes.iter().map(|length| *length as f32).collect();
    tiny_skia::Stroke {
        width: stroke.width as f32,
        line_cap: LineCap::Butt,
        line_join: LineJoin::Round,
        dash: StrokeDash::new(dashes, 0.0),
        ..tiny_skia::Stroke::default()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "places on the canvas")]
fn paint_text(canvas: &mut Pixmap, text: &Text) {
    let (Some(path), scale) = font::outline(&text.text, text.size) else { return };
    let shift = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -0.5 * font::width(&text.text, text.size),
        Anchor::End => -font::width(&text.text, text.size),
    };
    let ([x, y], scale, shift) = (text.at.map(|place| place as f32), scale as f32, shift as f32);
    // The font's y goes up, the canvas's down; an upward text goes along −y.
    let transform = if text.upwards {
        Transform::from_row(0.0, -scale, -scale, 0.0, x, y - shift)
    } else {
        Transform::from_row(scale, 0.0, 0.0, -scale, x + shift, y)
    };
    canvas.fill_path(&path, &paint(Ink { rgb: text.rgb, opacity: 1.0 }), FillRule::Winding, transform, None);
}

//! A list of shapes and texts on a canvas, from the bottom up.

use super::figure::Anchor;

/// A place: x to the right, y downward, in pixels.
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

    pub fn outline(&self) -> Outline {
        let Self { left, top, .. } = *self;
        Outline::Polygon(vec![[left, top], [self.right(), top], [self.right(), self.bottom()], [left, self.bottom()]])
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

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Outline {
    Line(Vec<Point>),
    Polygon(Vec<Point>),
    Circle(Point, f64),
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
    pub upward: bool,
    pub rgb: [u8; 3],
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Item {
    Shape {
        outline: Outline,
        fill: Option<Ink>,
        stroke: Option<Stroke>,
    },
    Text(Text),
    /// What follows is seen within the rectangle only, or everywhere again.
    Clip(Option<Rect>),
}

/// What is on the canvas.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawing {
    pub width: f64,
    pub height: f64,
    /// What a screen reader says.
    pub title: String,
    pub items: Vec<Item>,
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
}

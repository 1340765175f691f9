//! Plots.

mod drawing;
mod figure;
mod font;
mod layout;
mod legend;
mod marks;
mod pane;
mod png;
mod room;
mod ruler;
mod style;
mod svg;

use crate::error::Result;
pub use figure::{Anchor, Arrangement, Axis, Color, Marks, Note, Panel, Plot, ReferenceLine, Region, Scale, Series};
pub use ruler::power_of_ten;

impl Plot {
    /// The plot as an SVG document. Its text is text, in DejaVu Sans or what the viewer has instead.
    pub fn svg(&self) -> String {
        svg::document(&layout::draw(self))
    }

    /// The plot as a PNG, one pixel for each unit of the SVG: 900 × 600 for a single panel.
    ///
    /// # Errors
    ///
    /// [`Error::Data`](crate::error::Error::Data) when so many panels make no picture.
    pub fn png(&self) -> Result<Vec<u8>> {
        png::picture(&layout::draw(self))
    }
}

#[cfg(test)]
mod tests;

//! Plots: curves, points and error bars on linear or logarithmic axes, as SVG and as PNG.
//!
//! A [`Plot`] says what is shown; where margins, ticks, labels and the legend go follows from it. Nothing here knows what a
//! camera or a file is: [`Plot::svg`] gives text and [`Plot::png`] bytes, which
//! [`formats::plots`](crate::formats::plots) writes.
//!
//! ```
//! use cyanometer::plot::{Axis, Color, Marks, Panel, Plot, Region};
//!
//! let mut panel = Panel::new(Axis::log10("signal / e⁻"), Axis::log10("noise, rms / e⁻"));
//! let signals = [10.0, 100.0, 1000.0, 10_000.0_f64];
//! panel.add("shot noise", Color::Blue, Marks::Line(signals.map(|n| [n, n.sqrt()]).to_vec()));
//! panel.add("measured", Color::Vermillion, Marks::Points(vec![[98.0, 10.2], [1020.0, 31.0]]));
//! panel.regions.push(Region { from: 0.0, to: 256.0, label: "read noise".into(), color: Color::Green });
//! let plot = Plot::new("Photon transfer", panel);
//! assert!(plot.svg().starts_with("<svg"));
//! assert!(plot.png()?.starts_with(b"\x89PNG"));
//! # Ok::<(), cyanometer::error::Error>(())
//! ```
//!
//! Several [`Panel`]s stand below or beside each other with their edges aligned. What only one figure needs (arrows, circles,
//! a small diagram in a corner) is made of [`Note`]s: lines, circles and words at values of the axes. Words that belong to
//! points are [`Name`]s, which find their places themselves. A legend that would cover something stands above the frame.
//!
//! [`sheet()`] lays pictures of pixels out in a grid, with scale bars and captions.
//!
//! Both files hold the same drawing. A PNG needs no font of the system: a part of DejaVu Sans is embedded (its license and
//! how it was cut are in `assets/fonts`).
//!
//! # Why not a crate
//!
//! In November 2026 the five hardest figures of this project (photon transfer with its regimes; chromaticities of 912 skies
//! with errors, circles and the whole diagram in a corner; two Pareto fronts beside each other; three panels of curves, points
//! and error bars; twenty-two labeled points over twelve decades) were drawn with the crates that are well kept and write
//! both SVG and PNG without another program. This module is 1200 lines of code, and the five figures took 114 more.
//!
//! | crate | lines for the five | what its pictures lacked |
//! |---|---|---|
//! | [plotters](https://crates.io/crates/plotters) 0.3.7 | 273 | a logarithmic axis shorter than a decade has one number or none; numbers need a formatter of one's own (0.30000000000000004); margins, legends and names of regions are placed by hand; no equal scale; legends show no dashes; places are whole pixels, in SVG too |
//! | [kuva](https://crates.io/crates/kuva) 0.6.0 | 221 | values below 10⁻¹⁰ on a logarithmic axis are drawn at 10⁻¹⁰ without a word; axes shorter than a decade as above; in PNG dashed curves are solid and upright text is smeared; legends are placed by hand and may be narrower than their text; edges of panels are not aligned |
//!
//! With plotters, `svg`, `png`, `drawing` and `font` would go, some 350 lines; rulers, room for labels, the legend and
//! aligned panels would stay. kuva would replace all, for pictures that are worse and once wrong, and 95 000 lines that
//! change with every release. Of the others, charming and plotly need a JavaScript engine or a browser to make a picture,
//! gnuplot the program of that name; poloto writes SVG only, and textplots writes to terminals.

mod drawing;
mod figure;
mod font;
mod layout;
mod legend;
mod marks;
mod names;
mod pane;
mod png;
mod room;
mod ruler;
mod sheet;
mod style;
mod svg;

use crate::error::Result;
pub use figure::{
    Anchor, Arrangement, Axis, Color, Marks, Name, Note, Panel, Plot, ReferenceLine, Region, Scale, Series,
};
pub use font::lacking;
pub use ruler::{end_labels, power_of_ten};
pub use sheet::{Pixels, ScaleBar, Tile, sheet};

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

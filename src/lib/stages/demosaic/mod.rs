//! Demosaicking: the two classes that each photosite did not measure, from its neighbors [HP2005, App. A].
//!
//! One file a method. Each fills a row of the output from a few rows of the CFA plane, black level removed, edges
//! mirrored without repeating the edge sample, which keeps the phase of the filter array. Interpolation is in 32-bit
//! floats; each file says how far it may lie from the same in doubles.

mod bilinear;
mod effective_color;
mod malvar;
mod method;
#[cfg(test)]
mod reference;
mod rows;
mod smooth_hue;
pub mod stencil;
pub mod weights;

pub use method::Method;

use crate::camera::levels::BlackLevels;
use crate::cfa::{CfaPattern, Class};
use crate::error::Result;
use crate::frame::{Rows, Window, mirror, to_sample};
use crate::metadata::{DemosaicRecord, FrameHeader};
use crate::numerics::vectors::{self, Instructions};
use crate::stages::black::{Black, black_left, is_said, white_left};
use crate::stream::{Counts, Footprint, Stage};
use crate::units::{Any, QuantityKind};
use rows::{Planes, Ring, masks, mend, strips};
use stencil::phase;
use weights::WeightTable;

/// Interpolates the classes that each photosite of a CFA plane did not measure; values stay signed.
///
/// # Examples
///
/// ```
/// use cyanometer::cfa::CfaPattern;
/// use cyanometer::stages::black::Black;
/// use cyanometer::stages::demosaic::{Demosaic, Method};
/// use cyanometer::stream::MemoryFrame;
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Adu);
/// # let geometry = Geometry::new(6, 4, &["Y"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// // What is flat stays flat, less the black level, whatever the method.
/// let plane = MemoryFrame::new(header, vec![300.0; 6 * 4]);
/// for method in Method::ALL {
///     let stage = Demosaic::new(&plane.header, method, Black::Level(100.0.into()), Some(CfaPattern::Grbg))?;
///     assert_eq!(plane.through(&stage)?.0.samples, vec![200.0; 6 * 4 * 3]);
/// }
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Demosaic {
    header: FrameHeader,
    pattern: CfaPattern,
    method: Method,
    black: BlackLevels,
    /// Greens below this, above black, are counted.
    dim_green: Option<f32>,
}

impl Demosaic {
    /// The demosaicking of `input`; `pattern` counts where the metadata names none.
    ///
    /// # Errors
    ///
    /// [`Error::Order`](crate::error::Error::Order) unless the frame is one plane of photosites;
    /// [`Error::MissingKey`](crate::error::Error::MissingKey) when nothing gives a pattern;
    /// [`Error::Format`](crate::error::Error::Format) below 2×2, for arrays that are no Bayer pattern, and where what is
    /// left of the black level differs among photosites.
    pub fn new(input: &FrameHeader, method: Method, black: Black, pattern: Option<CfaPattern>) -> Result<Self> {
        check_plane(input)?;
        let metadata = &input.metadata;
        let cfa = match pattern {
            Some(pattern) => pattern,
            None => input.bayer("demosaicked")?.ok_or_else(|| input.missing("cfa"))?,
        };
        let (is_said, black) = (is_said(black, input), black.levels(input)?);
        let quantity = match metadata.quantity {
            QuantityKind::Unspecified => QuantityKind::Adu,
            known => known,
        };
        let mut made = metadata.becoming(quantity);
        if metadata.cfa.is_some_and(|known| known != cfa.into()) {
            // Seen through another pattern than its own, a uniform scene is none.
            made.scene = None;
        }
        made.cfa = None;
        made.demosaic = Some(DemosaicRecord {
            method: method.names()[0].into(),
            cfa,
            black: black.level(),
            black_deltas: black.has_deltas(),
            plane: input.taps().map(|_| input.geometry.on_sensor()),
        });
        let left = |before: Option<&BlackLevels>| {
            black_left(before, &black).ok_or_else(|| {
                input.refuse(
                    "what is left of its black level differs among photosites, which three planes cannot tell; subtract it \
                     with --black auto",
                )
            })
        };
        match quantity {
            QuantityKind::Adu => {
                let full = |white| white_left(white, &black, &input.geometry, Some(cfa));
                made.white_level_adu = made.white_level_adu.map(full);
                let known = input.black_levels()?.filter(|_| !is_said);
                made.set_black_adu(Some(left(known.as_ref())?.into()));
            }
            _ => {
                let dark = metadata.dark_signal_e.map(BlackLevels::uniform_at);
                made.dark_signal_e = dark.map(|dark| left(Some(&dark))).transpose()?;
            }
        }
        let geometry = input.geometry.with_channels(&["R", "G", "B"]);
        let header = FrameHeader { geometry, metadata: made, name: input.name.clone() };
        Ok(Self { header, pattern: cfa, method, black, dim_green: None })
    }

    /// The head of the demosaicked frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// Counts the pixels whose green is below a level above black, in the unit of the samples.
    pub fn count_greens_below(&mut self, level: f64) {
        self.dim_green = Some(to_sample(level));
    }

    /// What [`Stage::apply`] does, on one set of instructions; the bits are the same on all of them.
    pub fn apply_on(&self, instructions: Instructions, input: Window<'_>, output: Rows<'_>) -> Counts {
        self.interpolate(instructions, &input, output)
    }

    /// Strip by strip, row by row: loads the photosites that a row of the output reaches, derives what the method takes
    /// means of, and fills the row.
    fn interpolate(&self, instructions: Instructions, input: &Window<'_>, mut output: Rows<'_>) -> Counts {
        let (reach, rows) = (self.reach().cast_signed(), output.range());
        let [mut mended, mut dim] = [0; 2];
        let mut cfa = Ring::new();
        // Hues or differences, and green beside hues.
        let [mut derived, mut greens] = [Ring::new(), Ring::new()];
        for strip in strips(input.width()) {
            for ring in [&mut cfa, &mut derived, &mut greens] {
                ring.begin(strip.len());
            }
            let mut to_load = rows.start.cast_signed() - reach;
            let mut to_derive = rows.start.cast_signed() - 1;
            for row in rows.clone() {
                let y = row.cast_signed();
                while to_load <= y + reach {
                    let black = self.black.row(mirror(to_load, input.frame_height()));
                    cfa.load(instructions, to_load, input.row(to_load, 0), strip.start, black);
                    to_load += 1;
                }
                while to_derive <= y + 1 {
                    self.derive(instructions, to_derive, &cfa, &mut greens, &mut derived);
                    to_derive += 1;
                }
                let classes = self.pattern.row_classes(self.header.geometry.origin, row);
                let parity = usize::from(classes[0] == Class::Green);
                let [red, green, blue] = output.three(row).map(|plane| &mut plane[strip.clone()]);
                let [own, other] = if classes[parity] == Class::Red { [red, blue] } else { [blue, red] };
                let planes = [&mut *own, &mut *green, &mut *other];
                if self.fill(instructions, [&cfa, &greens, &derived], y, masks(parity, strip.len()), planes) {
                    mended += mend(cfa.about(y), parity, [&mut *own, &mut *green, &mut *other]);
                }
                if let Some(level) = self.dim_green {
                    dim += green.iter().filter(|green| **green < level).count() as u64;
                }
            }
        }
        // Bilinear values are no stand-ins for themselves.
        let undefined_hue = if self.method == Method::Bilinear { 0 } else { mended };
        Counts { undefined_hue, dim_green: dim, ..Counts::default() }
    }

    /// Derives the row `y`, of which the photosites around it are loaded.
    fn derive(&self, instructions: Instructions, y: isize, cfa: &Ring, greens: &mut Ring, derived: &mut Ring) {
        match self.method {
            Method::Bilinear | Method::Malvar => {}
            Method::SmoothHue => {
                let (green, hue) = (greens.wider_mut(y), derived.wider_mut(y));
                vectors::run_on(instructions, smooth_hue::Hues { cfa: cfa.about(y), green, hue });
            }
            Method::EffectiveColor => {
                let (cfa, to) = (cfa.about(y), derived.wider_mut(y));
                vectors::run_on(instructions, effective_color::Differences { cfa, to });
            }
        }
    }

    /// Fills the row `y`; tells whether it may hold values that are not finite.
    fn fill(
        &self,
        instructions: Instructions,
        [cfa, greens, derived]: [&Ring; 3],
        y: isize,
        masks: &[u32],
        planes: Planes<'_>,
    ) -> bool {
        let has_large = cfa.has_large(y, self.reach());
        match self.method {
            Method::Bilinear => {
                vectors::run_on(instructions, bilinear::Row { cfa: cfa.about(y), masks, planes });
                has_large
            }
            Method::SmoothHue => {
                let (cfa, green, hues) = (cfa.line(y), greens.line(y), derived.about(y));
                vectors::run_on(instructions, smooth_hue::Row { cfa, green, hues, masks, planes })
            }
            Method::EffectiveColor => {
                let (cfa, differences) = (cfa.line(y), derived.about(y));
                vectors::run_on(instructions, effective_color::Row { cfa, differences, masks, planes });
                has_large
            }
            Method::Malvar => {
                vectors::run_on(instructions, malvar::Row { cfa: cfa.about(y), masks, planes });
                has_large
            }
        }
    }
}

/// Makes sure that a frame is one plane of photosites that has every class.
fn check_plane(input: &FrameHeader) -> Result<()> {
    let holds = input.holds();
    if input.metadata.demosaic.is_some() {
        return Err(input.refuse(format!("it holds {holds}; demosaicking is done once")));
    }
    if input.geometry.channels.len() != 1 {
        let hint = match input.metadata.quantity {
            QuantityKind::Unspecified => {
                " (where one of its channels is such a plane, take that alone, for example with `--channel R`)"
            }
            _ => "",
        };
        return Err(input.out_of_order(format!("it holds {holds}, not a CFA plane{hint}"), "mosaic"));
    }
    let (width, height) = (input.geometry.width, input.geometry.height);
    if width < 2 || height < 2 {
        return Err(input
            .refuse(format!("a CFA plane of {width}x{height} lacks whole classes; demosaicking needs at least 2x2")));
    }
    let flat = input.metadata.correction.as_ref().and_then(|correction| correction.flat.as_ref());
    if flat.is_some_and(|flat| flat.means_adu.len() == 1) {
        return Err(input.refuse(
            "it was divided by a flat field as photosites of one class, which took the colors of the flat's light off it; correct the \
             frame again, and tell its pattern then",
        ));
    }
    Ok(())
}

impl Stage for Demosaic {
    type Input = Any;
    type Output = Any;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn reach(&self) -> usize {
        self.method.reach()
    }

    fn footprint(&self) -> Footprint {
        let table = WeightTable::of(self.method, self.pattern);
        let [x0, y0] = self.header.geometry.origin.map(i64::from);
        Footprint::Around([[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| table.sites(phase(x0 + x, y0 + y))))
    }

    fn apply(&self, input: Window<'_>, output: Rows<'_>) -> Counts {
        self.apply_on(Instructions::up_to_256_bits(), input, output)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::stream::MemoryFrame;

    fn plane(width: usize, height: usize, pattern: CfaPattern, f: impl Fn(usize, usize, Class) -> f32) -> MemoryFrame {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(pattern.into());
        metadata.black_level_adu = Some(0.0.into());
        let header = FrameHeader { name: "test".into(), geometry: Geometry::new(width, height, &["Y"]), metadata };
        let sites = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let samples = sites.map(|(x, y)| f(x, y, pattern.class(x as i64, y as i64))).collect();
        MemoryFrame::new(header, samples)
    }

    fn demosaicked(frame: &MemoryFrame, method: Method) -> (MemoryFrame, Counts) {
        frame.through(&Demosaic::new(&frame.header, method, Black::Auto, None).unwrap()).unwrap()
    }

    #[test]
    fn flat_stays_flat_at_every_phase_and_size() {
        let level = |class| [300.0, 500.0, 900.0][class as usize];
        for method in Method::ALL {
            for pattern in CfaPattern::ALL {
                for (width, height) in [(2, 2), (3, 5), (8, 7)] {
                    let (made, counts) =
                        demosaicked(&plane(width, height, pattern, |_, _, class| level(class)), method);
                    for row in made.samples.chunks(3 * width) {
                        for (class, samples) in Class::ALL.iter().zip(row.chunks(width)) {
                            assert!(samples.iter().all(|&s| (s - level(*class)).abs() < 1e-3), "{method:?} {pattern}");
                        }
                    }
                    assert_eq!(counts, Counts::default());
                }
            }
        }
    }

    #[test]
    fn measured_sites_are_kept() {
        let value = |x: usize, y: usize| ((x * 31 + y * 17) % 101) as f32;
        for method in Method::ALL {
            let (made, _) = demosaicked(&plane(9, 8, CfaPattern::Gbrg, |x, y, _| value(x, y) + 1.0), method);
            for y in 0..8 {
                for x in 0..9 {
                    let class = CfaPattern::Gbrg.class(x as i64, y as i64) as usize;
                    assert_eq!(made.samples[(y * 3 + class) * 9 + x], value(x, y) + 1.0);
                }
            }
        }
    }

    /// BI and ECI are exact on planes that are linear in position, away from the mirrored edges; SHTI is where the
    /// hues are constant.
    #[test]
    fn linear_ramps_are_restored() {
        let ramp = |class: Class, x: usize, y: usize| {
            (1.0 + f64::from(class as u8)) * (100.0 + 3.0 * x as f64 - 2.0 * y as f64)
        };
        let frame = plane(16, 14, CfaPattern::Grbg, |x, y, class| to_sample(ramp(class, x, y)));
        for method in Method::ALL {
            let (made, _) = demosaicked(&frame, method);
            for y in 3..11 {
                for x in 3..13 {
                    for class in Class::ALL {
                        let sample = f64::from(made.samples[(y * 3 + class as usize) * 16 + x]);
                        assert!((sample - ramp(class, x, y)).abs() < 1e-4, "{method:?} {class:?} {x} {y} {sample}");
                    }
                }
            }
        }
    }

    /// The worked examples of Appendix A, at the positions that it names (rows and columns from 1, B at 4,3).
    #[test]
    fn appendix_a_is_followed_with_its_misprints_mended() {
        // B at (row 4, column 3): rows even blue in odd columns, so the corner (1, 1) is G, (1, 2) R: grbg.
        let site = |row: usize, column: usize| ((row * 7919 + column * 104_729) % 997) as f64 + 500.0;
        let frame = plane(7, 8, CfaPattern::Grbg, |x, y, _| to_sample(site(y + 1, x + 1)));
        let at = |made: &MemoryFrame, class: Class, row: usize, column: usize| {
            f64::from(made.samples[((row - 1) * 3 + class as usize) * 7 + column - 1])
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-4 * b.abs(), "{a} {b}");
        let v = site;

        let (bi, _) = demosaicked(&frame, Method::Bilinear);
        near(at(&bi, Class::Green, 4, 3), (v(3, 3) + v(4, 4) + v(5, 3) + v(4, 2)) / 4.0);
        near(at(&bi, Class::Red, 4, 3), (v(3, 2) + v(3, 4) + v(5, 4) + v(5, 2)) / 4.0);

        let green = |r: usize, c: usize| (v(r - 1, c) + v(r + 1, c) + v(r, c - 1) + v(r, c + 1)) / 4.0;
        let ratio = |r: usize, c: usize| v(r, c) / green(r, c);
        let (shti, _) = demosaicked(&frame, Method::SmoothHue);
        near(at(&shti, Class::Blue, 4, 4), v(4, 4) * (ratio(4, 3) + ratio(4, 5)) / 2.0);
        near(at(&shti, Class::Blue, 3, 4), green(3, 4) * (ratio(2, 3) + ratio(2, 5) + ratio(4, 5) + ratio(4, 3)) / 4.0);

        let (eci, _) = demosaicked(&frame, Method::EffectiveColor);
        let k_up = |r: usize, c: usize| v(r, c) - (v(r - 1, c) + v(r + 1, c)) / 2.0;
        let k_side = |r: usize, c: usize| v(r, c) - (v(r, c - 1) + v(r, c + 1)) / 2.0;
        let full = |r: usize, c: usize| {
            v(r, c) + (k_up(r - 1, c) + k_up(r + 1, c) + k_side(r, c - 1) + k_side(r, c + 1)) / 4.0
        };
        near(at(&eci, Class::Green, 3, 4), full(3, 4));
        let k = |r: usize, c: usize| full(r, c) - v(r, c);
        near(at(&eci, Class::Red, 4, 4), v(4, 4) - (k(3, 4) + k(5, 4)) / 2.0);
        near(at(&eci, Class::Blue, 5, 4), full(5, 4) - (k(4, 5) + k(6, 5) + k(6, 3) + k(4, 3)) / 4.0);
    }

    #[test]
    fn a_green_of_zero_never_gives_infinity() {
        let frame =
            plane(12, 10, CfaPattern::Rggb, |x, _, class| if class == Class::Green { 0.0 } else { 5.0 + x as f32 });
        let (made, counts) = demosaicked(&frame, Method::SmoothHue);
        assert!(made.samples.iter().all(|s| s.is_finite()));
        assert!(counts.undefined_hue > 0);
    }

    #[test]
    fn the_black_level_comes_off_first() {
        let mut frame = plane(6, 6, CfaPattern::Rggb, |_, _, _| 1757.25);
        frame.header.metadata.black_level_adu = Some(1757.25.into());
        for method in Method::ALL {
            let (made, _) = demosaicked(&frame, method);
            assert!(made.samples.iter().all(|&s| s == 0.0));
            assert_eq!(made.header.metadata.black_level_adu, Some(0.0.into()));
        }
    }

    #[test]
    fn three_planes_are_sent_to_mosaic_first() {
        let header = FrameHeader {
            name: "e.exr".into(),
            geometry: Geometry::new(4, 4, &["R", "G", "B"]),
            metadata: Metadata::new(QuantityKind::Electrons),
        };
        let message = Demosaic::new(&header, Method::Bilinear, Black::Auto, None).unwrap_err().to_string();
        assert!(message.contains("e.exr") && message.contains("run `mosaic` first"), "{message}");
    }
}

//! The color filter array: of three planes, each photosite keeps the one that its filter lets through.

use crate::camera::levels::BlackLevel;
use crate::cfa::{CfaPattern, FilterArray};
use crate::error::Result;
use crate::frame::{Rows, Window};
use crate::metadata::{CorrectionRecord, FrameHeader, Metadata};
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::stream::{Counts, Stage};
use crate::units::{Any, QuantityKind};

/// Keeps of each pixel the sample of its photosite's class (the **M**_Bayer of [HP2005, Sec. 3.5]).
///
/// # Examples
///
/// ```
/// use cyanometer::cfa::CfaPattern;
/// use cyanometer::stages::mosaic::Mosaic;
/// use cyanometer::stream::MemoryFrame;
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let metadata = Metadata::new(QuantityKind::Adu);
/// # let geometry = Geometry::new(2, 2, &["R", "G", "B"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// // Two rows, each of R, G and B.
/// let planes = MemoryFrame::new(header, vec![1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
/// let plane = planes.through(&Mosaic::new(&planes.header, Some(CfaPattern::Rggb))?)?.0;
/// assert_eq!(plane.samples, [1.0, 2.0, 2.0, 3.0]);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Mosaic {
    header: FrameHeader,
    pattern: CfaPattern,
}

impl Mosaic {
    /// The mosaic of `input`; without a pattern, that of its sensor, or R G / G B.
    ///
    /// # Errors
    ///
    /// [`Error::Format`](crate::error::Error::Format) unless the frame has the three planes R, G and B of photosites, and
    /// for sensors with another array than Bayer's.
    pub fn new(input: &FrameHeader, pattern: Option<CfaPattern>) -> Result<Self> {
        match (input.geometry.channels.len(), input.metadata.cfa) {
            (1, Some(FilterArray::Monochrome)) => {
                return Err(input.refuse("it is the plane of a monochrome sensor, which has no filter array"));
            }
            (1, Some(cfa)) => return Err(input.refuse(format!("it is a CFA plane already, {cfa}"))),
            _ => {}
        }
        let is_light = !matches!(
            input.metadata.quantity,
            QuantityKind::Xyz
                | QuantityKind::Xyy
                | QuantityKind::Lab
                | QuantityKind::Luv
                | QuantityKind::Cct
                | QuantityKind::LinearSrgb
                | QuantityKind::Srgb
                | QuantityKind::SpectralRadiance
                | QuantityKind::ColorDifference
        );
        if !input.has_three_planes() || !is_light {
            return Err(input.refuse(format!(
                "it holds {}; a mosaic is made of the three planes R, G and B of a sensor",
                input.holds()
            )));
        }
        let readout = input.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
        let pattern = match (pattern, readout.map(|readout| readout.cfa)) {
            (Some(pattern), _) => pattern,
            (None, None) => CfaPattern::Rggb,
            (None, Some(array)) => array.bayer().ok_or_else(|| {
                let problem = format!("its sensor has {}; mosaics are made of Bayer arrays alone", array.in_words());
                input.refuse(format!("{problem}, such as --cfa rggb"))
            })?,
        };
        check_smear(input, pattern)?;
        let mut metadata = input.metadata.becoming(input.metadata.quantity);
        metadata.predicted.clone_from(&input.metadata.predicted);
        metadata.cfa = Some(pattern.into());
        metadata.correction = correction_of(&metadata);
        metadata.demosaic = None;
        let header = FrameHeader { geometry: input.geometry.with_channels(&["Y"]), metadata, name: input.name.clone() };
        Ok(Self { header, pattern })
    }

    /// The head of the mosaicked frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// What [`Stage::apply`] does, on one set of instructions; the bits are the same on all of them.
    pub fn apply_on(&self, instructions: Instructions, input: Window<'_>, mut output: Rows<'_>) -> Counts {
        for y in output.range() {
            let classes = self.pattern.row_classes(self.header.geometry.origin, y);
            let [even, odd] = classes.map(|class| input.row(y.cast_signed(), class as usize));
            vectors::run_on(instructions, Alternate { even, odd, to: output.row(y, 0) });
        }
        Counts::default()
    }
}

/// Makes sure that columns whose smear was drawn are those of the plane.
fn check_smear(frame: &FrameHeader, pattern: CfaPattern) -> Result<()> {
    let metadata = &frame.metadata;
    let has_smear = metadata.noise.as_ref().is_some_and(|noise| noise.smear_per_row > 0.0);
    let of_sensor = metadata.sensor.as_ref().and_then(|sensor| sensor.bayer().ok());
    match of_sensor {
        Some(own) if has_smear && own != pattern => Err(frame.refuse(format!(
            "its smear is that of columns behind the filter array of its sensor, {own}, not {pattern}; leave --pattern out"
        ))),
        _ => Ok(()),
    }
}

/// What is off the codes of a plane: what demosaicking subtracted, which it no longer tells, with what came off before.
fn correction_of(metadata: &Metadata) -> Option<CorrectionRecord> {
    let nothing = CorrectionRecord::of_black(BlackLevel::from(0.0), false);
    let is_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
    match metadata.demosaic.as_ref().filter(|_| is_codes) {
        Some(record) => {
            let before = metadata.correction.clone().unwrap_or_else(|| nothing.clone());
            let sum = before.and_black(record.black, record.black_deltas);
            Some(sum).filter(|sum| *sum != nothing)
        }
        None => metadata.correction.clone(),
    }
}

impl Stage for Mosaic {
    type Input = Any;
    type Output = Any;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn apply(&self, input: Window<'_>, output: Rows<'_>) -> Counts {
        self.apply_on(Instructions::widest(), input, output)
    }
}

/// Columns by columns from two rows: the even ones of the first, the odd ones of the second.
struct Alternate<'a> {
    even: &'a [f32],
    odd: &'a [f32],
    to: &'a mut [f32],
}

impl Kernel for Alternate<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (pairs, last) = self.to.as_chunks_mut::<2>();
        for ((to, even), odd) in pairs.iter_mut().zip(self.even.as_chunks::<2>().0).zip(self.odd.as_chunks::<2>().0) {
            *to = [even[0], odd[1]];
        }
        if let ([last], [.., sample]) = (last, self.even) {
            *last = *sample;
        }
    }
}

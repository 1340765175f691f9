//! What a user says of a frame; it counts before what comes with the frame.

use super::values;
use crate::camera::optics::Exposure;
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::formats::input::{FrameReader, InputOptions};
use crate::metadata::{FrameHeader, Metadata};
use crate::units::QuantityKind;
use clap::Args;

/// Filter array, white level and exposure of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct Described {
    /// Filter array of a single plane: rggb, bggr, grbg, gbrg, monochrome, or its period as 4x4:RRGGRRGGGGBBGGBB
    #[arg(long, value_name = "PATTERN", value_parser = str::parse::<FilterArray>)]
    pub cfa: Option<FilterArray>,
    /// White level: the largest code, on the scale of the samples
    #[arg(long = "white", value_name = "N", value_parser = values::number)]
    pub white_level_adu: Option<f64>,
    /// Exposure time in s
    #[arg(id = "exposure", long, value_name = "S", value_parser = values::seconds)]
    pub exposure_s: Option<f64>,
    /// Relative aperture
    #[arg(long, value_name = "N", value_parser = values::f_number)]
    pub f_number: Option<f64>,
}

/// All that, and the black level, for programs whose `--black` is nothing else.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct DescribedWithBlack {
    /// All but the black level.
    #[command(flatten)]
    pub described: Described,
    /// Black level: the code of no light, 0 where it is off
    #[arg(id = "black", long, value_name = "N", value_parser = values::number)]
    pub black_level_adu: Option<f64>,
}

impl Described {
    /// Opens a frame, as it is described.
    ///
    /// # Errors
    ///
    /// Those of [`FrameReader::open`] and [`Self::apply`].
    pub fn open(&self, options: &InputOptions) -> Result<FrameReader> {
        let mut reader = FrameReader::open(options)?;
        self.apply(reader.header_mut())?;
        Ok(reader)
    }

    /// Puts what is said into the metadata of a frame. One of unknown quantity whose array or levels are said is one of ADU.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for an array of a frame that has several planes, for levels of what is not ADU, for an exposure time
    /// or an f-number without the other, and for impossible ones.
    pub fn apply(&self, frame: &mut FrameHeader) -> Result<()> {
        if let Some(cfa) = self.cfa {
            if frame.geometry.channels.len() != 1 {
                let problem = format!("{}: it holds {}; a filter array stands before one", frame.name, frame.holds());
                return Err(Error::Usage(problem).leave_out(&["cfa"]));
            }
            frame.metadata.cfa = Some(cfa);
            as_codes(&mut frame.metadata);
        }
        if let Some(white) = self.white_level_adu {
            check_codes(frame, "white")?;
            frame.metadata.white_level_adu = Some(white.into());
        }
        let known = frame.metadata.exposure;
        let said = self.exposure_s.is_some() || self.f_number.is_some();
        let exposure_s = self.exposure_s.or(known.map(|exposure| exposure.exposure_s));
        let f_number = self.f_number.or(known.map(|exposure| exposure.f_number));
        let lens_transmittance = known.map_or(1.0, |exposure| exposure.lens_transmittance);
        match exposure_s.zip(f_number) {
            Some((exposure_s, f_number)) if said => {
                frame.metadata.exposure = Some(Exposure { exposure_s, f_number, lens_transmittance }.checked()?);
            }
            None if said => {
                let other = if self.f_number.is_none() { &["f_number"] } else { &["exposure"] };
                let problem = format!("{}: an exposure is a time and an f-number, and one is not known", frame.name);
                return Err(Error::Usage(problem).give(other));
            }
            _ => {}
        }
        Ok(())
    }
}

impl DescribedWithBlack {
    /// Opens a frame, as it is described.
    ///
    /// # Errors
    ///
    /// Those of [`FrameReader::open`] and [`Self::apply`].
    pub fn open(&self, options: &InputOptions) -> Result<FrameReader> {
        let mut reader = FrameReader::open(options)?;
        self.apply(reader.header_mut())?;
        Ok(reader)
    }

    /// Puts what is said into the metadata of a frame.
    ///
    /// # Errors
    ///
    /// As [`Described::apply`]; [`Error::Usage`] for a black level of what is not ADU.
    pub fn apply(&self, frame: &mut FrameHeader) -> Result<()> {
        self.described.apply(frame)?;
        if let Some(black) = self.black_level_adu {
            check_codes(frame, "black")?;
            frame.metadata.set_black_adu(Some(black.into()));
        }
        Ok(())
    }
}

/// Takes samples of unknown quantity for codes.
fn as_codes(metadata: &mut Metadata) {
    if metadata.quantity == QuantityKind::Unspecified {
        metadata.quantity = QuantityKind::Adu;
        metadata.unit = QuantityKind::Adu.unit().into();
    }
}

/// Makes sure that a frame is one of ADU, of which a level is said.
fn check_codes(frame: &mut FrameHeader, option: &'static str) -> Result<()> {
    as_codes(&mut frame.metadata);
    if frame.metadata.quantity == QuantityKind::Adu {
        return Ok(());
    }
    let problem = format!("{}: it holds {}, which have no level of codes", frame.name, frame.holds());
    Err(Error::Usage(problem).leave_out(if option == "white" { &["white"] } else { &["black"] }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;

    fn frame(quantity: QuantityKind, channels: &[&str]) -> FrameHeader {
        let geometry = Geometry::new(4, 4, channels);
        FrameHeader { name: "in".into(), geometry, metadata: Metadata::new(quantity) }
    }

    #[test]
    fn what_is_said_counts() {
        let mut plane = frame(QuantityKind::Unspecified, &["Y"]);
        Described::default().apply(&mut plane).unwrap();
        assert_eq!(plane, frame(QuantityKind::Unspecified, &["Y"]));
        let said = Described {
            cfa: Some("gbrg".parse().unwrap()),
            white_level_adu: Some(4095.0),
            exposure_s: Some(0.5),
            f_number: Some(4.0),
        };
        DescribedWithBlack { described: said, black_level_adu: Some(64.0) }.apply(&mut plane).unwrap();
        let metadata = &plane.metadata;
        assert_eq!((metadata.quantity, metadata.unit.as_str()), (QuantityKind::Adu, QuantityKind::Adu.unit()));
        assert_eq!((metadata.cfa, metadata.white_level_adu), (said.cfa, Some(4095.0.into())));
        assert_eq!(metadata.black_level_adu, Some(64.0.into()));
        // One of the two replaces what is known.
        Described { f_number: Some(8.0), ..Described::default() }.apply(&mut plane).unwrap();
        let exposure = Exposure { exposure_s: 0.5, f_number: 8.0, lens_transmittance: 1.0 };
        assert_eq!(plane.metadata.exposure, Some(exposure));
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let said = |described: Described, frame: &mut FrameHeader| described.apply(frame).unwrap_err().to_string();
        let mut plane = frame(QuantityKind::Unspecified, &["Y"]);
        let time = Described { exposure_s: Some(1.0), ..Described::default() };
        assert_eq!(
            said(time, &mut plane),
            "in: an exposure is a time and an f-number, and one is not known; give `f_number`"
        );
        let mut three = frame(QuantityKind::Electrons, &["R", "G", "B"]);
        let cfa = Described { cfa: Some("rggb".parse().unwrap()), ..Described::default() };
        assert_eq!(
            said(cfa, &mut three),
            "in: it holds three planes of electrons; a filter array stands before one; leave out `cfa`"
        );
        let white = Described { white_level_adu: Some(1.0), ..Described::default() };
        let complaint = "in: it holds three planes of electrons, which have no level of codes; leave out ";
        assert_eq!(said(white, &mut three), format!("{complaint}`white`"));
        let black = DescribedWithBlack { black_level_adu: Some(1.0), ..DescribedWithBlack::default() }
            .apply(&mut three)
            .unwrap_err();
        assert_eq!(black.to_string(), format!("{complaint}`black`"));
    }
}

//! The head of a frame: size, place, channels, and what is known of it.

use super::{DrawnExposures, Metadata};
use crate::camera::levels::BlackLevels;
use crate::camera::optics::Exposure;
use crate::camera::readout::ReadOut;
use crate::camera::sensor::Sensor;
use crate::camera::taps::Taps;
use crate::cfa::{CfaPattern, FilterArray};
use crate::error::{Error, Result};
use crate::frame::{Geometry, bare_name};
use crate::units::QuantityKind;

/// The head of a frame that streams by.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameHeader {
    /// The frame as messages call it: a file name or `standard input`.
    pub name: String,
    /// Size, place, channels.
    pub geometry: Geometry,
    /// What is known about it.
    pub metadata: Metadata,
}

impl FrameHeader {
    /// What reports call a channel: its own name, but X where XYZ is stored as R, G, B, and the like (TIFF has no other
    /// names).
    pub fn channel_name(&self, index: usize) -> &str {
        self.name_of(&self.geometry.channels[index])
    }

    /// The same of a channel by the name that it is stored by.
    pub fn name_of<'a>(&self, name: &'a str) -> &'a str {
        let [first, second, third] = match self.metadata.quantity {
            QuantityKind::Xyz => ["X", "Y", "Z"],
            QuantityKind::Xyy => ["x", "y", "Y"],
            QuantityKind::Lab => ["L", "a", "b"],
            QuantityKind::Luv => ["L", "u", "v"],
            QuantityKind::Cct => ["CCT", "Duv", "Y"],
            _ => return name,
        };
        match name {
            "R" => first,
            "G" => second,
            "B" => third,
            other => other,
        }
    }

    /// Seeds and numbers of the exposures in which its noise was drawn: its own, or those that it is the average of.
    pub fn drawn(&self) -> Vec<DrawnExposures> {
        let noise = self.metadata.noise.as_ref().filter(|noise| !noise.sources.is_empty());
        match noise.map(|noise| (noise.seed, noise.frame)) {
            Some((seed, frame)) if self.metadata.averaged.is_empty() => vec![DrawnExposures::one(seed, frame)],
            _ => self.metadata.averaged.clone(),
        }
    }

    /// Whether noise that an exposure draws anew may be in it; not where it was simulated without.
    pub fn is_noisy(&self) -> bool {
        match &self.metadata.noise {
            Some(noise) => noise.sources.iter().any(|source| !source.is_fixed_pattern()),
            None => self.metadata.scene.is_none(),
        }
    }

    /// Whether it was simulated and no exposure drawn: its samples are what is expected. A clean frame of `add-noise` is a draw of nothing.
    pub fn is_undrawn(&self) -> bool {
        self.metadata.scene.is_some() && self.metadata.noise.is_none()
    }

    /// The same without what tells it from other exposures of its scene: its name, its seed and number, how the camera was held, what
    /// its samples were counted to be, where charge spilled, and what this version does not know.
    #[must_use]
    pub fn without_exposure(&self) -> Self {
        let mut head = Self { name: String::new(), ..self.clone() };
        head.metadata.history.clear();
        (head.metadata.samples, head.metadata.file, head.metadata.bloomed_photosites) = (None, None, None);
        head.metadata.averaged.clear();
        head.metadata.orientation = None;
        if let Some(noise) = &mut head.metadata.noise {
            (noise.seed, noise.frame) = (0, 0);
        }
        head.metadata.unknown.clear();
        head
    }

    /// Whether the frame has the three planes R, G and B (or what was made of them).
    pub fn has_three_planes(&self) -> bool {
        self.geometry.channels.iter().map(|name| bare_name(name)).eq(["R", "G", "B"])
    }

    /// Whether the first planes are R, G and B (or what was made of them), whatever follows.
    pub fn leads_with_three_planes(&self) -> bool {
        self.geometry.channels.iter().map(|name| bare_name(name)).take(3).eq(["R", "G", "B"])
    }

    /// The sensor, or the error that names the key.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`].
    pub fn sensor(&self) -> Result<&Sensor> {
        self.metadata.sensor.as_ref().ok_or_else(|| self.missing("sensor"))
    }

    /// The read-out of the sensor, or the error that names the key.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`].
    pub fn readout(&self) -> Result<&ReadOut> {
        let readout = self.sensor()?.readout.as_ref();
        readout.ok_or_else(|| self.missing("sensor.readout"))
    }

    /// The pattern of a plane behind a Bayer array; none where the metadata name no array. `done` says what is done to
    /// Bayer arrays alone.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] naming another array.
    pub fn bayer(&self, done: &str) -> Result<Option<CfaPattern>> {
        match self.metadata.cfa.map(|array| (array, array.bayer())) {
            None => Ok(None),
            Some((_, Some(pattern))) => Ok(Some(pattern)),
            Some((array, None)) => {
                Err(self.refuse(format!("its sensor has {}; only Bayer arrays are {done}", array.in_words())))
            }
        }
    }

    /// The black level in ADU of each photosite; none where none is known.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where what rows or columns add is not known for all of the frame.
    pub fn black_levels(&self) -> Result<Option<BlackLevels>> {
        let Metadata { black_level_adu, black_by_row, black_by_column, .. } = &self.metadata;
        let geometry = &self.geometry;
        let Some(level) = *black_level_adu else {
            if black_by_row.is_empty() && black_by_column.is_empty() {
                return Ok(None);
            }
            return Err(self.refuse(
                "what rows or columns add to the black level is given, but not the level itself; write `black_level_adu` \
                 beside it, 0 if that is meant",
            ));
        };
        let size = [geometry.width, geometry.height];
        let levels = BlackLevels::new(level, black_by_row, black_by_column, geometry.origin, size);
        levels.map(Some).map_err(|problem| self.refuse(problem))
    }

    /// The black level in ADU.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] where none is known; [`Error::Format`] where it differs among photosites.
    pub fn uniform_black_adu(&self) -> Result<f64> {
        if self.black_levels()?.is_none() {
            return Err(self.missing("black_level_adu"));
        }
        self.metadata.uniform_black_adu().ok_or_else(|| {
            self.refuse("its black level differs among photosites; subtract it with `correct-frame --black auto` first")
        })
    }

    /// The exposure, or the error that names the key.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`].
    pub fn exposure(&self) -> Result<Exposure> {
        self.metadata.exposure.ok_or_else(|| self.missing("exposure"))
    }

    /// Makes sure that the frame starts at the sensor's corner, from where moves of charge are counted.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for a crop that starts elsewhere.
    pub fn check_corner(&self) -> Result<()> {
        let [column, row] = self.geometry.origin;
        if [column, row] == [0, 0] {
            return Ok(());
        }
        Err(self.refuse(format!(
            "it starts at column {column}, row {row} of the sensor; charge of the photosites before these is missing, \
             so that transfer cannot be followed"
        )))
    }

    /// The amplifiers that its sensor is read through; none where there is one, or nothing is known.
    pub fn taps(&self) -> Option<&Taps> {
        self.metadata.sensor.as_ref()?.readout.as_ref()?.taps.as_ref()
    }

    /// Makes sure that all charge goes to one output, as charge transfer is simulated and undone.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for a sensor that is read through several amplifiers.
    pub fn check_one_output(&self) -> Result<()> {
        match self.taps() {
            None => Ok(()),
            Some(_) => Err(self.refuse(
                "its sensor is read through several `taps`, but charge transfer is that to one output, in the sensor's corner",
            )),
        }
    }

    /// An [`Error::MissingKey`] about this frame.
    pub fn missing(&self, key: &'static str) -> Error {
        Error::MissingKey { file: self.name.clone(), key }
    }

    /// An [`Error::Format`] about this frame.
    pub fn refuse(&self, problem: impl Into<String>) -> Error {
        Error::format(&self.name, problem)
    }

    /// An [`Error::Order`] about this frame.
    pub fn out_of_order(&self, problem: impl Into<String>, first: &'static str) -> Error {
        let (problem, takers) = (problem.into(), self.metadata.quantity.takers());
        if !takers.is_empty() {
            return self.refuse(format!("{problem}; it stands at the end of the chain, and goes into {takers}"));
        }
        Error::Order { file: self.name.clone(), problem, first }
    }

    /// The names of the first channels.
    fn some_channels(&self) -> String {
        let names = &self.geometry.channels;
        let more = if names.len() > 4 { ", …" } else { "" };
        names[..names.len().min(4)].join(", ") + more
    }

    /// What the frame holds, in a few words: `three planes of electrons`, `a CFA plane of ADU`.
    pub fn holds(&self) -> String {
        let quantity = self.metadata.quantity;
        match (self.geometry.channels.len(), self.metadata.cfa) {
            (1, Some(FilterArray::Monochrome)) => format!("a monochrome plane of {quantity}"),
            (1, Some(_)) => format!("a CFA plane of {quantity}"),
            (1, None) => format!("one plane of {quantity}"),
            (3, _) if !self.has_three_planes() => {
                format!("the planes {} of {quantity}", self.some_channels())
            }
            (3, _) if self.metadata.demosaic.is_some() => {
                format!("three demosaicked planes of {quantity}")
            }
            (3, _) => format!("three planes of {quantity}"),
            (n, _) if self.leads_with_three_planes() => {
                let layers = &self.geometry.channels[3..];
                let more = if layers.len() > 2 { ", …" } else { "" };
                let names = layers[..layers.len().min(2)].join(", ") + more;
                let count = if n == 4 { "a layer".to_owned() } else { format!("{} layers", n - 3) };
                format!("three planes of {quantity} and {count} ({names})")
            }
            (n, _) => format!("{n} planes ({}) of {quantity}", self.some_channels()),
        }
    }
}

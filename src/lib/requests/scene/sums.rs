//! Sums over wavelengths that turn radiance into electrons, and what comes up with them.

use super::light::{Judged, Seen};
use super::picture::Losses;
use crate::analysis::characterization::stimuli;
use crate::camera::optics::Exposure;
use crate::camera::response::GridWeights;
use crate::error::Result;
use crate::formats::cut_off::doubt_of_radiances;
use crate::formats::data::{self, LoadedSensor};
use crate::metadata::{Metadata, UpsamplingRecord};
use crate::numerics::quadrature::Rule;
use crate::requests::notes::Note;
use crate::spectrum::{SpectralLibrary, WavelengthGrid};
use crate::units::QuantityKind;

/// Share of a sensor's response beyond the summed wavelengths from which it is told.
const TOLD_BEYOND: f64 = 1e-3;

/// What comes up while a scene is opened.
pub(super) struct Found {
    /// What is left out, and the error of the sum over wavelengths.
    pub(super) metadata: Metadata,
    pub(super) notes: Vec<Note>,
    /// The radiance of a uniform scene, where a spectrum was summed.
    pub(super) radiance: Option<SpectralLibrary>,
    /// How the spectra of a picture are made up, and what is lost of its colors on the way.
    pub(super) upsampling: Option<UpsamplingRecord>,
    pub(super) losses: Losses,
    /// How bright the pixels of a spectral image are that is drawn.
    pub(super) judged: Option<Judged>,
}

impl Found {
    /// Nothing yet.
    pub(super) fn none() -> Self {
        let metadata = Metadata::new(QuantityKind::ExpectedElectrons);
        Self { metadata, notes: Vec::new(), radiance: None, upsampling: None, losses: Losses::default(), judged: None }
    }

    /// Notes what no light has in the radiance of a pixel.
    pub(super) fn doubt_of_radiance(&mut self, whose: &str, wavelength_nm: &[f64], radiance: &[f64]) {
        self.notes.extend(doubt_of_radiances(whose, wavelength_nm, radiance).map(Note::Warning));
    }
}

/// The sums over wavelengths that turn radiance into electrons.
pub(super) struct Sums<'a> {
    loaded: &'a LoadedSensor,
    exposure: &'a Exposure,
    grid: WavelengthGrid,
    /// Whether a radiance whose samples are closer than the grid's is integrated between them instead.
    follows: bool,
    pub(super) weights: GridWeights,
}

impl<'a> Sums<'a> {
    /// Those of a grid that was `chosen`, or of the default.
    pub(super) fn on(
        chosen: Option<WavelengthGrid>,
        quadrature: Rule,
        loaded: &'a LoadedSensor,
        exposure: &'a Exposure,
    ) -> Result<Self> {
        let grid = WavelengthGrid { quadrature, ..chosen.unwrap_or_default() };
        let weights = loaded.response()?.weights_on(&loaded.sensor, exposure, &grid)?;
        Ok(Self { loaded, exposure, grid, follows: chosen.is_none(), weights })
    }

    /// The camera for radiances at these wavelengths, those of `name`.
    pub(super) fn camera(&self, sampled_nm: &[f64], name: &str, notes: &mut Vec<Note>) -> Result<Seen> {
        let response = self.loaded.response()?;
        let (of_sum, uncovered) = self.weights.camera(sampled_nm);
        let exact = response.weights_between(&self.loaded.sensor, self.exposure, &self.grid, sampled_nm)?;
        let exact = exact.camera(sampled_nm).0;
        let is_followed = self.follows && self.grid.is_coarser_than(sampled_nm);
        let WavelengthGrid { start_nm, end_nm, step_nm, .. } = self.grid;
        if is_followed {
            notes.push(Note::Remark(format!(
                "{name}: its samples are closer than {step_nm} nm: it is integrated between them"
            )));
        }
        let beyond = response.beyond(&self.grid);
        if beyond > TOLD_BEYOND {
            notes.push(Note::Warning(format!(
                "{:.1} % of the response of the sensor {} lies beyond {start_nm} to {end_nm} nm, where nothing is summed; \
                 `render-radiance --wavelengths` sets other ends",
                100.0 * beyond,
                self.loaded.sensor.name
            )));
        }
        if uncovered > 1e-6 {
            let text = format!(
                "{name}: it covers {} to {} nm; {:.2} % of the sensor's response lies beyond, where its radiance is \
                 taken as zero",
                sampled_nm[0],
                sampled_nm[sampled_nm.len() - 1],
                100.0 * uncovered
            );
            // What rounds to none is no reason to warn.
            notes.push(if uncovered < 5e-5 { Note::Remark(text) } else { Note::Warning(text) });
        }
        Ok(Seen { camera: if is_followed { exact.clone() } else { of_sum }, exact })
    }
}

/// XYZ of a radiance itself in cd m⁻², which no camera has come near.
///
/// # Errors
///
/// Those of [`stimuli`].
pub(in crate::requests) fn own_xyz(radiance: &SpectralLibrary) -> Result<[f64; 3]> {
    let xyz = stimuli(radiance, &data::load_observer()?, &WavelengthGrid::default())?;
    Ok(std::array::from_fn(|i| xyz[(0, i)]))
}

/// A warning of wavelengths that are missing: steps much wider than most, or most of them wide.
pub(super) fn gap(sampled_nm: &[f64], name: &str) -> Option<Note> {
    /// Times as wide as most, and nm, from which it is told.
    const WIDE: f64 = 10.0;
    const WIDE_NM: f64 = 20.0;
    /// Fewer samples are meant as the straight lines that they make.
    const FEWEST: usize = 4;
    let mut steps: Vec<(f64, f64)> = sampled_nm.windows(2).map(|pair| (pair[1] - pair[0], pair[0])).collect();
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (usual, (widest, from)) = (steps.get(steps.len() / 2)?.0, *steps.last()?);
    let text = if widest > WIDE * usual && widest >= WIDE_NM {
        format!(
            "{name}: nothing lies between {from} and {} nm, where its samples are otherwise {usual:.3} nm apart; a straight line is \
             taken there",
            from + widest
        )
    } else if usual > WIDE_NM && sampled_nm.len() >= FEWEST {
        format!(
            "{name}: its samples are {usual:.3} nm apart, with straight lines between them; where the light is not straight the sums are \
             off (of a sky every 50 nm by 4 %)"
        )
    } else {
        return None;
    };
    Some(Note::Warning(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_wavelengths_are_told() {
        let told = |nm: &[f64]| {
            gap(nm, "sky.csv").map(|note| match note {
                Note::Warning(text) | Note::Remark(text) => text,
            })
        };
        let (low, high) = (360..=480, 620..=830);
        let with_gap: Vec<f64> = low.chain(high).map(f64::from).collect();
        assert!(told(&with_gap).unwrap().starts_with("sky.csv: nothing lies between 480 and 620 nm"));
        assert!(told(&[350.0, 400.0, 450.0, 500.0]).unwrap().starts_with("sky.csv: its samples are 50.000 nm apart"));
        for whole in [&[400.0, 700.0][..], &[360.0, 460.0, 830.0], &[400.0, 401.0, 402.0, 419.0], &[500.0]] {
            assert_eq!(told(whole), None);
        }
    }
}

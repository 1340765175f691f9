//! Spectral images: EXR channels named `S0.<nm>nm`, decimal comma, as in `S0.550,000000nm` \[Fichet2021], or by bins of
//! wavelength, as in `400.00-410.00nm`.

use super::cells::MAX_CELLS;
use super::csv::SpectralTable;
use super::cut_off::doubt_of_radiances;
use super::data::{near_spectrum, spectrum_file, without_data};
use super::files::{hint_of_missing, named, open_named, read_table, spool};
use super::format::HEAD_BYTES;
use super::input::{FrameReader, InputOptions};
use super::radiance_unit::{self, Brightness, FileSays, times_white};
use super::table;
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::spectrum::{
    Along, Between, SpectralLibrary, channel_bin_nm, channel_wavelength_nm, chart_columns, check_wavelengths,
    is_channel_of_another_unit,
};
use crate::stream::{RowSource, fold};
use crate::units::{Any, OtherUnit, RadianceUnit, Stated, unit_of_heading};
use ndarray::{Array2, ArrayView1, Axis};
use std::io::{self, Read, Seek};
use std::path::Path;

/// The spectral channels of a frame, by ascending wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralChannels {
    /// Places of the channels in the frame.
    pub channels: Vec<usize>,
    /// Their wavelengths in nm.
    pub wavelength_nm: Vec<f64>,
    /// The unit of their samples.
    pub unit: RadianceUnit,
    /// A warning, where the unit is assumed.
    pub warning: Option<String>,
    /// Whether neither file nor user says the unit.
    pub is_assumed: bool,
}

impl SpectralChannels {
    /// Finds the spectral channels; `unit` is what the user says of them.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] when there are none or two share a wavelength; those of [`radiance_unit::settle`].
    pub fn of(frame: &FrameHeader, unit: Option<RadianceUnit>) -> Result<Self> {
        let mut found: Vec<(f64, usize)> = frame
            .geometry
            .channels
            .iter()
            .enumerate()
            .filter_map(|(place, name)| channel_wavelength_nm(name).map(|nm| (nm, place)))
            .collect();
        if found.is_empty() {
            let hint = match frame.geometry.channels.len() {
                1 => "; of a gray picture store the plane three times, as R, G and B, for `render-radiance`",
                _ => " (of a picture `render-radiance` takes R, G and B)",
            };
            let other = frame.geometry.channels.iter().find(|name| is_channel_of_another_unit(name));
            return Err(frame.refuse(match other {
                Some(other) => format!(
                    "its channel `{other}` does not count wavelengths in nm or um, which alone are read, as in S0.550,000000nm; name \
                     its channels so"
                ),
                None => format!(
                    "it holds no spectral radiance: no channel is named like S0.550,000000nm; give a spectrum as CSV or a \
                     spectral EXR{hint}"
                ),
            }));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (wavelength_nm, channels): (Vec<f64>, Vec<usize>) = found.into_iter().unzip();
        check_wavelengths(&wavelength_nm).map_err(|problem| frame.refuse(problem))?;
        let stated = frame.metadata.unit.as_str();
        // What is no unit at all is none of radiance.
        let unknown = || Stated::Other { text: stated.to_owned(), kind: OtherUnit::Unknown };
        let heading = (!stated.is_empty()).then(|| unit_of_heading(stated).unwrap_or_else(unknown));
        if stated.is_empty()
            && unit.is_none()
            && frame.geometry.channels.iter().any(|name| channel_bin_nm(name).is_some())
        {
            let problem = "its channels are bins of wavelength, and it does not say the unit of its radiance";
            return Err(frame.refuse(problem).give(&["radiance_unit"]));
        }
        let is_assumed = heading.is_none() && unit.is_none();
        let place = "in the attribute `emissiveUnits`, as `W.m^-2.sr^-1.nm^-1`";
        let says = FileSays { name: &frame.name, heading: heading.as_ref(), remarks: &[], place };
        let (unit, warning) = radiance_unit::settle(says, unit)?;
        Ok(Self { channels, wavelength_nm, unit, warning, is_assumed })
    }

    /// The wavelengths at which its radiances are taken: those of its channels, and more where they are per interval of wavenumber,
    /// no straight lines in nm.
    pub fn between(&self) -> Between {
        Between::new(&self.wavelength_nm, Along::Wavelength, self.unit.is_per_wavenumber())
    }

    /// What a sample of 1 is in W cm⁻² sr⁻¹ nm⁻¹, by wavelength.
    pub fn factors(&self, between: &Between) -> Vec<f64> {
        between.wavelength_nm.iter().map(|nm| self.unit.in_w_per_cm2_sr_nm(*nm)).collect()
    }
}

/// A source of radiances: a table, or an image.
pub enum Radiances {
    /// Spectra as CSV.
    Table(Box<SpectralTable>),
    /// A frame, which should be a spectral EXR.
    Image(Box<FrameReader>),
}

/// Opens a table or a spectral image, also one of a data directory by its bare name; the standard input for `-` or none. An image that comes down a pipe is copied to a
/// temporary file first.
///
/// # Errors
///
/// Those of the readers, and [`Error::Disk`].
pub fn open(options: &InputOptions) -> Result<Radiances> {
    let found = named(options.path.as_deref()).map(spectrum_file);
    let path = found.as_deref();
    let (mut file, opened) = open_named(path).map_err(|error| with_near_name(error, path))?;
    // As it was given: where data lie is no matter of a frame.
    let name = options.path.as_ref().filter(|_| path.is_some()).map_or(opened, |path| path.display().to_string());
    let failed = |e| Error::disk(&name, "read", e);
    let mut head = Vec::new();
    (&mut file).take(HEAD_BYTES as u64).read_to_end(&mut head).map_err(failed)?;
    if table::by_head(&head, &name)?.is_some() {
        if file.metadata().is_ok_and(|m| m.is_file()) {
            file.rewind().map_err(failed)?;
        } else {
            file = spool(&mut io::Cursor::new(head).chain(file), &name)?;
        }
        let options = InputOptions { all_channels: true, ..options.clone() };
        return Ok(Radiances::Image(Box::new(FrameReader::open_file(file, &name, path, &options)?)));
    }
    let bytes = read_table(io::Cursor::new(head).chain(file), &name)?;
    Ok(Radiances::Table(Box::new(SpectralTable::parse(&name, &bytes)?)))
}

/// A complaint of a file that is not there, with the file beside it, or the spectrum of a data directory, that may be meant, or that
/// there are no data.
pub fn with_near_name(error: Error, path: Option<&Path>) -> Error {
    let advice = || {
        let beside = path.and_then(hint_of_missing);
        let of_data = |near| format!("did you mean `{near}`? `cyanometer list spectra` tells those known by name");
        beside.or_else(|| path.and_then(near_spectrum).map(of_data)).or_else(|| path.and_then(without_data))
    };
    let is_missing = matches!(&error, Error::Disk { source, .. } if source.kind() == io::ErrorKind::NotFound);
    match (error, is_missing.then(advice).flatten()) {
        (Error::Disk { file, .. }, Some(advice)) => Error::format(&file, format!("there is no such file; {advice}")),
        (error, _) => error,
    }
}

/// Reads a whole library of spectra, CSV or spectral EXR, in W cm⁻² sr⁻¹ nm⁻¹, with what a user should be warned of; pixels
/// count row by row.
///
/// # Errors
///
/// [`Error::Format`] for what is no library, or a radiance that is not finite.
pub fn read_library(path: &Path, unit: Option<RadianceUnit>) -> Result<(SpectralLibrary, Vec<String>)> {
    let name = path.display().to_string();
    let options = InputOptions { path: Some(path.to_owned()), ..InputOptions::default() };
    let mut warnings = Vec::new();
    let library = match open(&options)? {
        Radiances::Image(mut reader) => {
            let spectral = SpectralChannels::of(reader.header(), unit)?;
            let between = spectral.between();
            let factors = spectral.factors(&between);
            let (unit, is_assumed) = (spectral.unit, spectral.is_assumed);
            let mut brightness = Brightness::default();
            warnings.extend(spectral.warning);
            let geometry = reader.header().geometry.clone();
            // A header may declare any size: memory is taken as rows come.
            let mut radiance = Vec::new();
            fold([&mut *reader as &mut dyn RowSource], geometry.height, |band| {
                let window = band.window::<Any>(0);
                for y in band.rows() {
                    let lines: Vec<&[f32]> =
                        spectral.channels.iter().map(|&channel| window.row(y.cast_signed(), channel)).collect();
                    let pixel = |x: usize| between.values(|channel| f64::from(lines[channel][x]));
                    (0..geometry.width).for_each(|x| {
                        let first = radiance.len();
                        radiance.extend(pixel(x).into_iter().zip(&factors).map(|(value, factor)| value * factor));
                        let brightest = radiance[first..].iter().copied().fold(0.0, f64::max);
                        brightness = brightness.plus(Brightness::of([times_white(brightest)]));
                    });
                }
                Ok(())
            })?;
            warnings.extend(brightness.judge(&name, unit, is_assumed)?);
            let samples = radiance.len() / factors.len();
            let radiance = Array2::from_shape_vec((samples, factors.len()), radiance)
                .map_err(|_| Error::format(&name, "its rows differ in length"))?;
            SpectralLibrary { wavelength_nm: between.wavelength_nm, radiance, columns: geometry.width }
        }
        Radiances::Table(table) => {
            let between = table.between(unit);
            let (samples, wavelengths) = (table.columns.len(), between.wavelength_nm.len());
            if samples.saturating_mul(wavelengths) > MAX_CELLS {
                let problem = format!(
                    "taken at every nm its {samples} spectra by wavenumber would have more than {MAX_CELLS} numbers; part it \
                     into smaller tables"
                );
                return Err(Error::format(&name, problem));
            }
            let mut radiance = Array2::zeros((samples, wavelengths));
            for (index, mut curve) in radiance.rows_mut().into_iter().enumerate() {
                curve.assign(&ArrayView1::from(&table.radiances(index, unit, &between)?));
                warnings.extend(table.radiance_unit(index, unit)?.1.filter(|_| index == 0));
            }
            let columns = chart_columns(samples);
            SpectralLibrary { wavelength_nm: between.wavelength_nm, radiance, columns }
        }
    };
    match library.radiance.indexed_iter().find(|(_, value)| !value.is_finite()) {
        Some(((sample, place), value)) => {
            let nm = library.wavelength_nm[place];
            Err(Error::format(
                &name,
                format!("sample {sample} is not finite but {value} at {nm} nm; write a radiance there"),
            ))
        }
        None => {
            warnings.extend(negative(&name, &library.radiance));
            warnings.extend(cut_off_on_average(&name, &library));
            Ok((library, warnings))
        }
    }
}

/// A warning of a mean radiance that no light has.
fn cut_off_on_average(name: &str, library: &SpectralLibrary) -> Option<String> {
    let mean = library.radiance.mean_axis(Axis(0))?;
    doubt_of_radiances(&format!("{name}, on average"), &library.wavelength_nm, &mean.to_vec())
}

/// A warning of radiances below zero, if there are any.
fn negative(name: &str, radiance: &Array2<f64>) -> Option<String> {
    let samples = radiance.rows().into_iter().filter(|sample| sample.iter().any(|value| *value < 0.0)).count();
    let all = radiance.nrows();
    (samples > 0).then(|| format!("{name}: {samples} of {all} samples have radiances below 0, which no light is"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::units::QuantityKind;

    /// What becomes of channels in a unit, and another that a user gives.
    fn seen(channels: &[&str], unit: &str, given: Option<RadianceUnit>) -> Result<SpectralChannels> {
        let mut metadata = Metadata::new(QuantityKind::SpectralRadiance);
        metadata.unit = unit.into();
        let frame = FrameHeader { name: "a.exr".into(), geometry: Geometry::new(2, 2, channels), metadata };
        SpectralChannels::of(&frame, given)
    }

    #[test]
    fn channels_are_found_by_wavelength() {
        let names = ["R", "G", "B", "S0.500,000nm", "S0.400,000nm", "S1.400,000nm"];
        let found = seen(&names, "W.m^-2.sr^-1.nm^-1", None).unwrap();
        assert_eq!((found.channels, found.wavelength_nm), (vec![4, 3], vec![400.0, 500.0]));
        let per_wavenumber = seen(&names, "W/(m2 sr cm-1)", None).unwrap();
        // 10⁷/λ² cm⁻¹ per nm: 62.5 at 400 nm, 40 at 500 nm.
        for (factor, wanted) in per_wavenumber
            .factors(&Between::new(&per_wavenumber.wavelength_nm, Along::Wavelength, false))
            .into_iter()
            .zip([62.5e-4, 40e-4])
        {
            assert!((factor / wanted - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn bins_have_their_centers_and_no_unit_of_their_own() {
        let names = ["400.00-410.00nm", "410.00-420.00nm"];
        let refused = seen(&names, "", None).unwrap_err().to_string();
        let wanted = "a.exr: its channels are bins of wavelength, and it does not say the unit of its radiance; give `radiance_unit`";
        assert_eq!(refused, wanted);
        let found = seen(&names, "", Some(RadianceUnit::USUAL[1])).unwrap();
        assert_eq!(found.wavelength_nm, [405.0, 415.0]);
        let refused = seen(&["S0.400,0nm"], "W.m^-2", None).unwrap_err().to_string();
        assert!(
            refused.contains("give `radiance_unit`") || refused.contains("spectral radiances are wanted"),
            "{refused}"
        );
    }
}

//! Tables of charts: what a camera read of patches, and the colors that they have.

use super::cells::numeric;
use super::csv::{SpectralTable, columns, text_column};
use super::data;
use super::files::read_file;
use crate::color::illuminant::Illuminant;
use crate::color::{xyz_from_lab, xyz_of_chromaticity};
use crate::error::{Error, Result};
use crate::spectrum::{Curve, Observer, WavelengthGrid};
use nalgebra::Matrix3;
use std::path::Path;

/// The reference that every program carries: the patches of a ColorChecker.
pub const DEFAULT_REFERENCE: &str = "colorchecker";

/// Luminances above this, of a perfect diffuser's, are per cent.
const PER_CENT_ABOVE: f64 = 2.0;

/// Names, colors and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The table as messages call it.
    pub name: String,
    /// Names of the patches.
    pub names: Vec<String>,
    /// Their colors.
    pub colors: Colors,
}

/// The colors of patches.
#[derive(Debug, Clone, PartialEq)]
pub enum Colors {
    /// XYZ, Y = 1 for a perfect diffuser.
    Xyz(Vec<[f64; 3]>),
    /// CIE 1976 L*a*b*.
    Lab(Vec<[f64; 3]>),
    /// Reflectances.
    Reflectance(Vec<Curve>),
}

/// Means of patches by hand or by another program.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchMeans {
    /// Names, where the table has them.
    pub names: Option<Vec<String>>,
    /// Means of R, G and B.
    pub means: Vec<[f64; 3]>,
    /// Their covariances; zero where nothing is said.
    pub covariances: Vec<Matrix3<f64>>,
}

/// Reads a reference: that of a known chart, or a table of X,Y,Z; x,y,Y; L,a,b; or reflectances, with a column `name`.
///
/// # Errors
///
/// [`Error::Usage`] for an unknown name; those of readers.
pub fn load_reference(reference: &str) -> Result<Reference> {
    let (name, bytes) = data::chart(reference)?;
    let headers = columns(&name, &bytes)?;
    let has = |wanted: [&str; 3]| wanted.iter().all(|column| headers.iter().any(|header| header == column));
    let three = |wanted: [&str; 3]| three_columns(&name, &bytes, wanted);
    let colors = if has(["X", "Y", "Z"]) {
        Colors::Xyz(three(["X", "Y", "Z"])?)
    } else if has(["x", "y", "Y"]) {
        let of_row = |[x, y, luminance]: [f64; 3]| xyz_of_chromaticity([x, y], luminance);
        Colors::Xyz(three(["x", "y", "Y"])?.into_iter().map(of_row).collect())
    } else if has(["L", "a", "b"]) {
        Colors::Lab(three(["L", "a", "b"])?)
    } else {
        return reflectances(name, &bytes);
    };
    let colors = match colors {
        Colors::Xyz(colors) => Colors::Xyz(shares(&name, colors)?),
        other => other,
    };
    let count = match &colors {
        Colors::Xyz(colors) | Colors::Lab(colors) => colors.len(),
        Colors::Reflectance(curves) => curves.len(),
    };
    let names = if headers.iter().any(|header| header == "name") {
        text_column(&name, &bytes, "name")?
    } else {
        (1..=count).map(|number| number.to_string()).collect()
    };
    Ok(Reference { name, names, colors })
}

/// XYZ of which a perfect diffuser has Y = 1, of such or of per cent.
fn shares(name: &str, colors: Vec<[f64; 3]>) -> Result<Vec<[f64; 3]>> {
    let largest = colors.iter().map(|xyz| xyz[1]).fold(0.0, f64::max);
    if !colors.as_flattened().iter().all(|value| value.is_finite()) || largest > 200.0 {
        return Err(Error::format(name, "its Y are no shares of a perfect diffuser, 0 to 1 or 0 to 100"));
    }
    let unit = if largest > PER_CENT_ABOVE { 100.0 } else { 1.0 };
    Ok(colors.into_iter().map(|xyz| xyz.map(|value| value / unit)).collect())
}

/// A table of reflectances.
fn reflectances(name: String, bytes: &[u8]) -> Result<Reference> {
    let told = |error| match error {
        Error::Format { file, problem } => Error::Format {
            file,
            problem: format!("{problem}; a reference has columns X,Y,Z, x,y,Y or L,a,b, or is a table of reflectances"),
        },
        other => other,
    };
    let table = SpectralTable::parse(&name, bytes).map_err(told)?;
    (0..table.columns.len()).try_for_each(|index| table.check(index)).map_err(told)?;
    let mut curves = Vec::with_capacity(table.columns.len());
    for (index, column) in table.columns.iter().enumerate() {
        let curve = table.curve_at(index)?;
        let (low, high) = curve.extremes();
        if low < 0.0 || high > 1.5 {
            let problem = format!("`{column}` runs from {low} to {high}; a reflectance is a fraction of 1");
            return Err(Error::format(&name, problem));
        }
        curves.push(curve);
    }
    Ok(Reference { names: table.columns, name, colors: Colors::Reflectance(curves) })
}

/// Reads means of patches: columns `R`, `G`, `B`, and where they are there `name`, `std_R`, `std_G`, `std_B`, `cov_RG`, `cov_RB`,
/// `cov_GB`.
///
/// # Errors
///
/// Those of readers; [`Error::Format`] for what is no covariance.
pub fn load_patches(path: &Path) -> Result<PatchMeans> {
    let name = path.display().to_string();
    let bytes = read_file(path)?;
    let headers = columns(&name, &bytes)?;
    let has = |column: &str| headers.iter().any(|header| header == column);
    let means = three_columns(&name, &bytes, ["R", "G", "B"])?;
    let three_or_none = |wanted: [&str; 3]| -> Result<Vec<[f64; 3]>> {
        if wanted.iter().any(|column| has(column)) {
            three_columns(&name, &bytes, wanted)
        } else {
            Ok(vec![[0.0; 3]; means.len()])
        }
    };
    let stds = three_or_none(["std_R", "std_G", "std_B"])?;
    let mixed = three_or_none(["cov_RG", "cov_RB", "cov_GB"])?;
    let covariance = |(row, (std, mixed)): (usize, (&[f64; 3], &[f64; 3]))| {
        let [[r, g, b], [rg, rb, gb]] = [*std, *mixed];
        let matrix = Matrix3::new(r * r, rg, rb, rg, g * g, gb, rb, gb, b * b);
        let smallest = matrix.symmetric_eigenvalues().min();
        if std.iter().any(|std| *std < 0.0) || smallest.is_nan() || smallest < -1e-9 * matrix.amax() {
            let problem = format!("row {}: its deviations and covariances are no covariance matrix", row + 1);
            return Err(Error::format(&name, problem));
        }
        Ok(matrix)
    };
    let covariances = stds.iter().zip(&mixed).enumerate().map(covariance).collect::<Result<_>>()?;
    let names = has("name").then(|| text_column(&name, &bytes, "name")).transpose()?;
    Ok(PatchMeans { names, means, covariances })
}

/// Three columns of numbers, row by row.
fn three_columns(name: &str, bytes: &[u8], wanted: [&str; 3]) -> Result<Vec<[f64; 3]>> {
    let number = |column: &str, (row, text): (usize, String)| {
        numeric(text.trim())
            .ok_or_else(|| Error::format(name, format!("row {}: `{column}` is `{text}`, which is no number", row + 1)))
    };
    let column = |column: &str| -> Result<Vec<f64>> {
        text_column(name, bytes, column)?.into_iter().enumerate().map(|cell| number(column, cell)).collect()
    };
    let [first, second, third] = [column(wanted[0])?, column(wanted[1])?, column(wanted[2])?];
    Ok(first.into_iter().zip(second).zip(third).map(|((a, b), c)| [a, b, c]).collect())
}

/// A light as it falls on a chart.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// An illuminant.
    Illuminant(Illuminant),
    /// The curve of a file.
    Measured(String, Curve),
}

impl Light {
    /// A light by the name of an illuminant, a temperature, or a file of its spectrum.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for neither; those of readers.
    pub fn load(text: &str) -> Result<Self> {
        match text.parse() {
            Ok(illuminant) => Ok(Self::Illuminant(illuminant)),
            Err(expected) if Path::new(text).extension().is_none() => {
                Err(Error::Usage(format!("there is no light `{text}`; {expected}, or a file of its spectrum")))
            }
            Err(_) => {
                let table = SpectralTable::parse(text, &read_file(Path::new(text))?)?;
                let curve = table.light()?;
                if curve.extremes().0 < 0.0 || curve.extremes().1 <= 0.0 {
                    return Err(Error::format(
                        text,
                        "a light has a power above 0 at some wavelengths, and below at none",
                    ));
                }
                Ok(Self::Measured(text.into(), curve))
            }
        }
    }

    /// Its name.
    pub fn name(&self) -> String {
        match self {
            Self::Illuminant(illuminant) => illuminant.to_string(),
            Self::Measured(name, _) => name.clone(),
        }
    }

    /// XYZ of reflectances in this light, and of a perfect diffuser, which has Y = 1: sums by 1 nm from 360 to 830 nm.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] where light or reflectances leave out more than 10⁻³ of what the observer weighs.
    pub fn xyz(&self, reflectances: &[Curve], observer: &Observer) -> Result<(Vec<[f64; 3]>, [f64; 3])> {
        /// Share of Y.
        const UNCOVERED: f64 = 1e-3;
        let daylight = data::load_daylight()?;
        let at = |nm: f64| match self {
            Self::Illuminant(illuminant) => illuminant.power(nm, |nm| daylight.each_ref().map(|curve| curve.at(nm))),
            Self::Measured(_, curve) => curve.at(nm),
        };
        let (wavelengths, _) = WavelengthGrid::default().points()?;
        let sums = |curve: &dyn Fn(f64) -> f64| {
            observer
                .matching
                .each_ref()
                .map(|matching| wavelengths.iter().map(|nm| matching.at(*nm) * at(*nm) * curve(*nm)).sum::<f64>())
        };
        let white = sums(&|_| 1.0);
        let covers = |curve: &Curve| {
            let (first, last) = (curve.wavelengths_nm()[0], curve.wavelengths_nm()[curve.wavelengths_nm().len() - 1]);
            let inside = sums(&|nm| f64::from(u8::from((first..=last).contains(&nm))));
            (0..3).all(|k| inside[k] >= (1.0 - UNCOVERED) * white[k])
        };
        if !reflectances.iter().all(covers) {
            return Err(Error::Data(
                "the reflectances do not cover the wavelengths that the observer weighs; 380 to 730 nm is the least"
                    .into(),
            ));
        }
        let share = |xyz: [f64; 3]| xyz.map(|value| value / white[1]);
        Ok((reflectances.iter().map(|curve| share(sums(&|nm| curve.at(nm)))).collect(), share(white)))
    }
}

impl Reference {
    /// XYZ of the patches of which a perfect diffuser has Y = 1, and those of this, in the light that a table of colors is for.
    pub fn colors_in(&self, white: [f64; 3]) -> Option<Vec<[f64; 3]>> {
        match &self.colors {
            Colors::Xyz(colors) => Some(colors.clone()),
            Colors::Lab(colors) => Some(colors.iter().map(|lab| xyz_from_lab(*lab, white)).collect()),
            Colors::Reflectance(_) => None,
        }
    }
}

//! What a unit, or the name of a quantity, is that is none of spectral radiance.

/// What a unit is that is none of spectral radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherUnit {
    /// Power per area, from all directions.
    Irradiance,
    /// Photons instead of energy.
    Photons,
    /// Per interval of frequency, or of what is wavenumber.
    PerFrequency,
    /// Per centimeter, which may be one of wavelength or 1 cm⁻¹ of wavenumber.
    PerCentimeter,
    /// Radiance over all wavelengths.
    AllWavelengths,
    /// With a number before it.
    Scaled,
    /// A radiance beside which a factor stands.
    BesideFactor,
    /// Two units of radiance.
    Several,
    /// A mean or a sum over all directions: libRadtran's `uavg`, an actinic flux.
    Mean,
    /// Power into a direction, of all that shines.
    Intensity,
    /// Power per wavelength, of no area and no direction.
    Power,
    /// Per another solid angle than steradians: square seconds of arc, square degrees.
    OtherAngle,
    /// A radiance over an irradiance: remote sensing reflectance.
    PerIrradiance,
    /// The temperature of a black body as bright.
    Temperature,
    /// A share of the light of a black body.
    Emissivity,
    /// Magnitudes per square second of arc.
    Magnitude,
    /// A logarithm of a transmittance: optical depth, density, absorbance.
    Depth,
    /// What a detector makes of power: A/W.
    Responsivity,
    /// Of `MW`, which may be milliwatts.
    Megawatt,
    /// Behind what divides stand steradians or lengths that no power or stroke makes divisors: `W m-2 sr nm`.
    Undivided,
    /// A unit of radiance beside the name of another quantity, or the unit of another beside the name of radiance.
    Contradiction,
    /// Of light as the eye weights it.
    Photometric,
    /// Energy instead of power: a radiance summed over time.
    Energy,
    /// A share, or a ratio to other light: reflectance, transmittance, per cent.
    Ratio,
    /// What an instrument reads: counts, codes, volts.
    Reading,
    /// A radiance for each of what an instrument reads: `W m-2 sr-1 nm-1 / count`.
    PerReading,
    /// Of no scale: arbitrary units, relative values.
    Relative,
    /// A logarithm or a root of radiance.
    Function,
    /// None that is known.
    Unknown,
}

impl OtherUnit {
    /// What it is, in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Irradiance => "an irradiance, which has no sr-1",
            Self::Photons => "a unit of photons, not of energy",
            Self::PerFrequency => "per interval of frequency or wavenumber, not of wavelength",
            Self::PerCentimeter => {
                "per cm, of wavelength as it is written; per cm-1 of wavenumber is `/ cm-1`, as in `W m-2 sr-1 / cm-1`"
            }
            Self::AllWavelengths => "a radiance over all wavelengths, which has no nm-1",
            Self::Scaled => "a unit with a number before it",
            Self::BesideFactor => {
                "a radiance beside a factor that may be in the values already or not; say what they are in as they stand"
            }
            Self::Several => "two units of radiance; say in which they are",
            Self::Mean => "a mean over all directions, or their sum, not the radiance of one",
            Self::Intensity => "a radiant intensity, which has no m-2",
            Self::Power => "a power, which has no m-2 sr-1",
            Self::OtherAngle => "per another solid angle than sr",
            Self::PerIrradiance => "a radiance over an irradiance, not the radiance itself",
            Self::Temperature => "a temperature, not the radiance itself",
            Self::Emissivity => "a share of the light of a black body, not the radiance itself",
            Self::Magnitude => "a logarithm of brightness, not the radiance itself",
            Self::Depth => "a logarithm of a transmittance, not the radiance itself",
            Self::Responsivity => "what a detector makes of light, not the light itself",
            Self::Megawatt => "of megawatts as it is written, which milliwatts (mW) may be; megawatts are `1e6 W`",
            Self::Undivided => {
                "times sr or a length as it is written; what divides has a power, as in `W m-2 sr-1 nm-1`, or stands behind a stroke"
            }
            Self::Contradiction => "the name of one quantity beside the unit of another, one of which is wrong",
            Self::Photometric => "of light as the eye weights it, from which no spectrum of energy follows",
            Self::Energy => "of energy, a radiance summed over time, which has no s-1",
            Self::Ratio => "a ratio, not the radiance itself",
            Self::Reading => "what an instrument reads, not what that means",
            Self::PerReading => "a radiance for each count or volt that an instrument reads, not the radiance itself",
            Self::Relative => "of no scale, which does not tell how bright the light is",
            Self::Function => "a logarithm or a root, not the radiance itself",
            Self::Unknown => "no unit of spectral radiance that is known",
        }
    }

    /// What makes spectral radiances of such numbers, in words; none of what may be them already.
    pub fn conversion(self) -> Option<&'static str> {
        Some(match self {
            Self::Irradiance => {
                "take those of one direction from where these come from, as `uu` of uvspec; of a matt white surface they are the irradiance over pi"
            }
            Self::Mean | Self::Power => "take those of one direction from where these come from",
            Self::Intensity => "divide each value by the area that shines, as it is seen from there",
            // 1 sr = (180/pi)^2 deg2.
            Self::OtherAngle => "of a radiance per arcsec2 multiply each value by 4.254517e10, per deg2 by 3282.806",
            Self::PerIrradiance => "multiply each value by the irradiance that it is of",
            Self::Temperature => "take the radiance of a black body of that temperature, by Planck's law",
            Self::Emissivity => {
                "multiply each value by the radiance of a black body of its temperature, by Planck's law"
            }
            Self::Magnitude => "multiply 10^(-0.4 value) by the radiance of 0 mag/arcsec2",
            Self::Depth => {
                "multiply the radiance of the same light without the layer by the transmittance: e^-value of a depth, 10^-value of a density"
            }
            Self::Photons => "multiply each value by the energy of its photons, h c / wavelength",
            Self::PerFrequency => "of a radiance per Hz multiply each value by c / wavelength^2",
            Self::AllWavelengths => "divide the value of each band by the width of the band in nm",
            Self::Photometric | Self::Responsivity => "take the spectrum from where these come from",
            Self::Energy => "divide each value by the time in s",
            Self::Ratio => {
                "multiply each value, as a fraction of 1, by the radiance that a perfect white, or no filter, has in the same light"
            }
            Self::Reading => "multiply each value by the calibration of the instrument",
            Self::PerReading => "multiply what the instrument reads by each value",
            Self::Function => "of log10 take 10^value, of ln e^value, of sqrt value^2",
            Self::PerCentimeter
            | Self::Scaled
            | Self::BesideFactor
            | Self::Several
            | Self::Undivided
            | Self::Contradiction
            | Self::Relative
            | Self::Megawatt
            | Self::Unknown => return None,
        })
    }
}

//! The lights that the color matrices of a DNG are for.

use super::tags;
use crate::color::locus::planckian;
use crate::color::temperature::correlated;
use crate::color::{D50_XY, D65_XY, chromaticity};
use crate::error::Result;
use crate::formats::data::load_observer;
use crate::formats::tiff::{Directory, TiffFile};
use crate::spectrum::{Curve, Observer};

/// Numbers of illuminants (Exif, LightSource) and their temperatures, K, as Adobe's DNG SDK has them: of fluorescent lamps
/// the middle of their range.
const ILLUMINANTS: [(usize, f64); 20] = [
    (1, 5500.0),
    (2, 4150.0),
    (3, 2850.0),
    (4, 5500.0),
    (9, 5500.0),
    (10, 6500.0),
    (11, 7500.0),
    (12, 6400.0),
    (13, 5050.0),
    (14, 4150.0),
    (15, 3525.0),
    (16, 2925.0),
    (17, 2850.0),
    (18, 5500.0),
    (19, 6500.0),
    (20, 5500.0),
    (21, 6500.0),
    (22, 7500.0),
    (23, 5000.0),
    (24, 3200.0),
];

/// The number of a light that has data of its own.
const OTHER: usize = 255;
/// So many samples the data of a light may have, and bytes before them and in each \[DNG2023, IlluminantData1].
const SAMPLES: std::ops::RangeInclusive<usize> = 2..=1000;
const BEFORE_SAMPLES: usize = 22;
const RATIO: usize = 8;

/// Temperature of an illuminant by its number; none of those that have none.
pub(in crate::formats) fn temperature_k(number: usize) -> Option<f64> {
    ILLUMINANTS.into_iter().find(|(known, _)| *known == number).map(|(_, kelvin)| kelvin)
}

/// Chromaticities of illuminants by their numbers, where three are told: those of the CIE \[CIE 015], of fluorescent lamps of F1, F8, F2, F3 and
/// F4, whose temperatures lie in the ranges of Exif.
const WHITES: [(&[usize], [f64; 2]); 12] = [
    (&[3, 17], [0.447_57, 0.407_45]),
    (&[18], [0.348_42, 0.351_61]),
    (&[19], [0.310_06, 0.316_16]),
    (&[23], D50_XY),
    (&[1, 4, 9, 20], [0.332_42, 0.347_43]),
    (&[10, 21], D65_XY),
    (&[11, 22], [0.299_02, 0.314_85]),
    (&[12], [0.313_10, 0.337_27]),
    (&[13], [0.345_88, 0.358_75]),
    (&[2, 14], [0.372_08, 0.375_29]),
    (&[15], [0.409_10, 0.394_30]),
    (&[16], [0.440_18, 0.403_29]),
];
/// Tungsten of studios, a black body of 3200 K.
const STUDIO_TUNGSTEN: usize = 24;

/// Chromaticity of an illuminant (0, 1, 2), by its number or its data; none where the file does not tell.
///
/// # Errors
///
/// Those of the disk, and of damaged tags.
pub(super) fn white_of_illuminant(
    file: &mut TiffFile,
    directory: &Directory,
    index: usize,
) -> Result<Option<[f64; 2]>> {
    match tags::CALIBRATION_ILLUMINANTS[index].one(file, directory)? {
        Some(OTHER) => white_of_data(file, directory, index),
        Some(STUDIO_TUNGSTEN) => Ok(Some(planckian(&load_observer()?, 3200.0))),
        number => {
            Ok(WHITES.into_iter().find(|(known, _)| number.is_some_and(|n| known.contains(&n))).map(|(_, xy)| xy))
        }
    }
}

/// Temperature in K of the first or second illuminant (0, 1), by its number or its data; none where the file does not tell.
///
/// # Errors
///
/// Those of the disk, and of damaged tags.
pub(super) fn temperature_of(file: &mut TiffFile, directory: &Directory, index: usize) -> Result<Option<f64>> {
    let number = tags::CALIBRATION_ILLUMINANTS[index].one(file, directory)?;
    if number != Some(OTHER) {
        return Ok(number.and_then(temperature_k));
    }
    let white = white_of_data(file, directory, index)?;
    let observer = load_observer()?;
    Ok(white.map(|white| correlated(&observer, white).temperature_k))
}

/// The chromaticity that the data of an illuminant tell.
fn white_of_data(file: &mut TiffFile, directory: &Directory, index: usize) -> Result<Option<[f64; 2]>> {
    let most = BEFORE_SAMPLES + RATIO * SAMPLES.end();
    let Some(data) = tags::ILLUMINANT_DATA[index].numbers(file, directory, most as u64)? else { return Ok(None) };
    #[expect(clippy::cast_possible_truncation, reason = "the tag holds bytes")]
    let data: Vec<u8> = data.into_iter().map(|byte| byte as u8).collect();
    let observer = load_observer()?;
    Ok(white_of(&data, &observer, |bytes| file.number(bytes)))
}

/// The chromaticity that the data of a light tell, whose numbers `number` makes of bytes: kind 0, x and y; kind 1, the number of samples,
/// the first wavelength in nm, the step, and the samples of its spectrum. None where they make no sense.
fn white_of(data: &[u8], observer: &Observer, number: impl Fn(&[u8]) -> u64) -> Option<[f64; 2]> {
    let whole = |at: usize, bytes: usize| Some(number(data.get(at..at + bytes)?));
    let ratio = |at: usize| Some(whole(at, 4)? as f64 / whole(at + 4, 4)? as f64).filter(|ratio| ratio.is_finite());
    let white = match whole(0, 2)? {
        0 => [ratio(2)?, ratio(10)?],
        1 => {
            let samples = usize::try_from(whole(2, 4)?).ok().filter(|samples| SAMPLES.contains(samples))?;
            let (first_nm, step_nm) = (ratio(6)?, ratio(14)?);
            let nm = (0..samples).map(|sample| first_nm + sample as f64 * step_nm).collect();
            let power = (0..samples).map(|sample| ratio(BEFORE_SAMPLES + RATIO * sample)).collect::<Option<_>>()?;
            let power = Curve::new(nm, power).ok()?;
            let sum =
                |curve: &Curve| curve.wavelengths_nm().iter().map(|nm| curve.at(*nm) * power.at(*nm)).sum::<f64>();
            chromaticity(observer.matching.each_ref().map(sum))
        }
        _ => return None,
    };
    white.iter().all(|part| (0.0..1.0).contains(part)).then_some(white)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ratios of 10⁶, least byte first.
    fn ratios(numbers: &[f64]) -> Vec<u8> {
        const BELOW: u32 = 1_000_000;
        #[expect(clippy::cast_possible_truncation, reason = "numbers of the test are small")]
        let ratio = |number: &f64| [(number * f64::from(BELOW)).round() as u32, BELOW].map(u32::to_le_bytes).concat();
        numbers.iter().flat_map(ratio).collect()
    }

    fn spectrum(first_nm: f64, step_nm: f64, power: &[f64]) -> Vec<u8> {
        let count = u32::try_from(power.len()).unwrap().to_le_bytes();
        [vec![1, 0], count.to_vec(), ratios(&[first_nm, step_nm]), ratios(power)].concat()
    }

    fn told(data: &[u8]) -> Option<f64> {
        let observer = load_observer().unwrap();
        let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |all, byte| all << 8 | u64::from(*byte));
        white_of(data, &observer, number).map(|white| correlated(&observer, white).temperature_k)
    }

    /// Correlated color temperatures of CIE 15: 2856 K of A, 6504 K of D65, 5454 K of equal energy.
    #[test]
    fn lights_have_the_temperature_of_their_data() {
        let chromaticity = |x, y| told(&[vec![0, 0], ratios(&[x, y])].concat()).unwrap();
        assert!((chromaticity(0.44757, 0.40745) - 2856.0).abs() < 1.0);
        assert!((chromaticity(0.31271, 0.32902) - 6504.0).abs() < 2.0);
        assert!((told(&spectrum(360.0, 10.0, &[1.0; 48])).unwrap() - 5454.0).abs() < 3.0);
        // λ⁻⁵ / (exp(c₂ / λ T) − 1) of 4000 K, by 5 nm.
        let below = |nm: f64| (1.438_777e7 / (nm * 4000.0)).exp_m1();
        let body = |nm: f64| (560.0 / nm).powi(5) * below(560.0) / below(nm);
        let body: Vec<f64> = (0..=94_u8).map(|step| body(360.0 + 5.0 * f64::from(step))).collect();
        assert!((told(&spectrum(360.0, 5.0, &body)).unwrap() - 4000.0).abs() < 1.0);
    }

    #[test]
    fn data_that_make_no_sense_tell_nothing() {
        let good = spectrum(400.0, 100.0, &[1.0, 2.0, 1.0, 0.5]);
        assert!(told(&good).is_some());
        for data in [
            &good[..good.len() - 1],
            &[0],
            &[0, 0, 1],
            &[2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            &[vec![0, 0], ratios(&[0.3, 1.3])].concat(),
            &[vec![0, 0], vec![0; 16]].concat(),
            &spectrum(400.0, 0.0, &[1.0, 1.0]),
            &spectrum(400.0, 100.0, &[1.0]),
            &spectrum(400.0, 100.0, &[0.0, 0.0]),
        ] {
            assert_eq!(told(data), None, "{data:?}");
        }
    }
}

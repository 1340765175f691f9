//! The read-out of a sensor: geometry, wells, noise, converter; and its dark current.

use super::linearity::Linearization;
use super::taps::Taps;
use crate::cfa::FilterArray;
use crate::units::{BOLTZMANN_EV_PER_K, CM_PER_UM, kelvin, of_per_cent};
use serde::{Deserialize, Serialize};

/// The smallest and the largest pitch in µm that does not look like another unit.
const LEAST_PITCH_UM: f64 = 0.2;
/// See [`LEAST_PITCH_UM`].
const MOST_PITCH_UM: f64 = 300.0;
/// The lowest temperature in K that does not look like °C: charge freezes out below.
pub const LEAST_TEMPERATURE_K: f64 = 70.0;
/// The largest non-uniformity of dark current that does not look like per cent.
pub const MOST_DCNU: f64 = 2.0;
/// The same of the response.
const MOST_PRNU: f64 = 0.5;
/// The same of whole rows and columns: gains of amplifiers differ by less.
const MOST_LINE_PRNU: f64 = 0.05;
/// The longest time that a packet stays at a photosite which it passes that does not look like µs, s.
const MOST_SMEAR_LINE_S: f64 = 0.01;
/// The smallest full well in e⁻ that does not look like thousands of them.
const LEAST_WELL_E: f64 = 100.0;
/// So many times the range of the converter is beyond what amplifiers are set to.
const MOST_RANGES: f64 = 100.0;
/// Rows over which a level can drift.
const LEAST_DRIFT_ROWS: f64 = 2.0;

/// What a sensor makes of charge, in numbers: what photon transfer measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReadOut {
    /// Name of the setting, of gain, ISO or conversion gain, that the numbers are of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub setting: Option<String>,
    /// Photosites in a row.
    pub width: u32,
    /// Rows of photosites.
    pub height: u32,
    /// Distance of neighboring photosites in µm; only light needs it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel_pitch_um: Option<f64>,
    /// Color filter array.
    pub cfa: FilterArray,
    /// Charge that a photosite holds, in e⁻.
    pub full_well_e: f64,
    /// Dark-current density at 300 K in nA cm⁻², i_d of Eq. 6.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark_current_na_per_cm2: Option<f64>,
    /// Dark current of a photosite at `temperature_k` in e⁻ s⁻¹, for sensors whose density is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark_current_e_per_s: Option<f64>,
    /// Operating temperature in K.
    pub temperature_k: f64,
    /// Dark-current non-uniformity: rms, fraction of 1.
    pub dcnu: f64,
    /// Photo-response non-uniformity: rms, fraction of 1.
    pub prnu: f64,
    /// Read noise: rms, e⁻.
    pub read_noise_e: f64,
    /// Noise that the photosites of a row have in common in one exposure: rms, e⁻.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub row_noise_e: f64,
    /// The same of a column.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub column_noise_e: f64,
    /// Drift of the black level along the rows of one exposure: rms, e⁻.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub black_drift_e: f64,
    /// Rows from one level that is drawn to the next, between which it drifts smoothly.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub black_drift_rows: f64,
    /// Fixed offsets of photosites, read out with their charge whatever the exposure: rms, e⁻.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub dsnu_e: f64,
    /// Fixed offsets of rows: rms, e⁻.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub dsnu_row_e: f64,
    /// Fixed offsets of columns: rms, e⁻.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub dsnu_column_e: f64,
    /// Non-uniformity of the response from row to row: rms, fraction of 1.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub prnu_row: f64,
    /// Non-uniformity of the response from column to column: rms, fraction of 1.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub prnu_column: f64,
    /// Share of photosites that are hot: fraction of 1.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub hot_pixel_share: f64,
    /// Mean excess of their dark current at `temperature_k`, exponentially distributed: e⁻ s⁻¹.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub hot_pixel_dark_current_e_per_s: f64,
    /// Share of photosites whose reading jumps, random telegraph signals: fraction of 1.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rts_share: f64,
    /// Mean amplitude of their jumps, exponentially distributed: e⁻.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rts_amplitude_e: f64,
    /// Time for which the light of each photosite that a packet passes on its way along its column counts, smear: s.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub smear_line_s: f64,
    /// Share of the charge beyond full well that spills along its column, and is not drained: fraction of 1.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub blooming: f64,
    /// Bits of the converter.
    pub bits: u32,
    /// What the converter adds, ADU.
    pub bias_adu: f64,
    /// Slope of the converter, ADU per e⁻.
    pub adu_per_e: f64,
    /// What makes its codes proportional to charge; none where they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linearization: Option<Linearization>,
    /// The amplifiers that it is read through; none where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taps: Option<Taps>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Checks the temperature of a sensor, which `key` has in K.
///
/// # Errors
///
/// What is wrong, in words: degrees Celsius, and what no sensor has.
pub fn check_temperature(key: &str, temperature_k: f64) -> Result<(), String> {
    const MOST_K: f64 = 1000.0;
    if temperature_k < LEAST_TEMPERATURE_K {
        let kelvin = kelvin(temperature_k);
        return Err(format!(
            "`{key}` is {temperature_k}; it is in K, and {temperature_k} looks like degrees Celsius, which is {kelvin} K"
        ));
    }
    if !(..=MOST_K).contains(&temperature_k) {
        return Err(format!("`{key}` is {temperature_k}, which is the temperature of no sensor in K"));
    }
    Ok(())
}

impl ReadOut {
    /// Checks that every number is possible.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    #[allow(clippy::too_many_lines, reason = "a table of keys")]
    pub fn check(&self) -> Result<(), String> {
        let positive = [
            ("pixel_pitch_um", self.pixel_pitch_um.unwrap_or(1.0)),
            ("full_well_e", self.full_well_e),
            ("temperature_k", self.temperature_k),
            ("adu_per_e", self.adu_per_e),
            ("width", f64::from(self.width)),
            ("height", f64::from(self.height)),
        ];
        for (key, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("`{key}` is {value}; it must be above 0"));
            }
        }
        let not_negative = [
            ("dark_current_na_per_cm2", self.dark_current_na_per_cm2.unwrap_or(0.0)),
            ("dark_current_e_per_s", self.dark_current_e_per_s.unwrap_or(0.0)),
            ("dcnu", self.dcnu),
            ("prnu", self.prnu),
            ("read_noise_e", self.read_noise_e),
            ("row_noise_e", self.row_noise_e),
            ("column_noise_e", self.column_noise_e),
            ("black_drift_e", self.black_drift_e),
            ("black_drift_rows", self.black_drift_rows),
            ("dsnu_e", self.dsnu_e),
            ("dsnu_row_e", self.dsnu_row_e),
            ("dsnu_column_e", self.dsnu_column_e),
            ("prnu_row", self.prnu_row),
            ("prnu_column", self.prnu_column),
            ("hot_pixel_share", self.hot_pixel_share),
            ("hot_pixel_dark_current_e_per_s", self.hot_pixel_dark_current_e_per_s),
            ("rts_share", self.rts_share),
            ("rts_amplitude_e", self.rts_amplitude_e),
            ("smear_line_s", self.smear_line_s),
            ("blooming", self.blooming),
        ];
        for (key, value) in not_negative {
            if !(0.0..f64::INFINITY).contains(&value) {
                return Err(format!("`{key}` is {value}; it must not be negative"));
            }
        }
        let pairs = [
            (
                ("hot_pixel_share", self.hot_pixel_share),
                ("hot_pixel_dark_current_e_per_s", self.hot_pixel_dark_current_e_per_s),
            ),
            (("rts_share", self.rts_share), ("rts_amplitude_e", self.rts_amplitude_e)),
            (("black_drift_e", self.black_drift_e), ("black_drift_rows", self.black_drift_rows)),
        ];
        for (share, mean) in pairs {
            for ((here, value), (other, missing)) in [(share, mean), (mean, share)] {
                if value > 0.0 && missing == 0.0 {
                    return Err(format!("`{here}` is {value}, which says nothing without `{other}`"));
                }
            }
        }
        if self.black_drift_e > 0.0 && self.black_drift_rows < LEAST_DRIFT_ROWS {
            return Err(format!(
                "`black_drift_rows` is {}; it must be {LEAST_DRIFT_ROWS} at least, what changes from row to row is `row_noise_e`",
                self.black_drift_rows
            ));
        }
        if !(1..=16).contains(&self.bits) {
            return Err(format!("`bits` is {}; it must be 1 to 16", self.bits));
        }
        if !self.bias_adu.is_finite() {
            return Err(format!("`bias_adu` is {}; it must be a finite number", self.bias_adu));
        }
        self.check_units()?;
        match (self.dark_current_na_per_cm2, self.dark_current_e_per_s, self.pixel_pitch_um) {
            (Some(_), None, None) => {
                Err("`dark_current_na_per_cm2` is that of an area, which needs `pixel_pitch_um`".into())
            }
            (Some(_), None, Some(_)) | (None, Some(_), _) => Ok(()),
            (Some(_), Some(_), _) => {
                Err("it has both `dark_current_na_per_cm2` and `dark_current_e_per_s`; leave one of them out".into())
            }
            (None, None, _) => Err("it must have `dark_current_na_per_cm2` or `dark_current_e_per_s`".into()),
        }
    }

    /// Checks that no number looks as if it were in another unit.
    fn check_units(&self) -> Result<(), String> {
        let suspect = |key: &str, value: f64, unit: &str, like: String| {
            Err(format!("`{key}` is {value}; it is in {unit}, and {value} looks like {like}"))
        };
        if let Some(pitch) = self.pixel_pitch_um.filter(|pitch| *pitch < LEAST_PITCH_UM) {
            return suspect("pixel_pitch_um", pitch, "um", "mm or m".into());
        }
        if let Some(pitch) = self.pixel_pitch_um.filter(|pitch| *pitch > MOST_PITCH_UM) {
            return suspect("pixel_pitch_um", pitch, "um", "nm".into());
        }
        check_temperature("temperature_k", self.temperature_k)?;
        let patterns = [
            ("dcnu", self.dcnu, MOST_DCNU),
            ("prnu", self.prnu, MOST_PRNU),
            ("prnu_row", self.prnu_row, MOST_LINE_PRNU),
            ("prnu_column", self.prnu_column, MOST_LINE_PRNU),
            ("hot_pixel_share", self.hot_pixel_share, 1.0),
            ("rts_share", self.rts_share, 1.0),
            ("blooming", self.blooming, 1.0),
        ];
        for (key, value, most) in patterns {
            if value > most {
                return suspect(key, value, "fractions of 1", format!("per cent, which is {}", of_per_cent(value)));
            }
        }
        if self.smear_line_s > MOST_SMEAR_LINE_S {
            let seconds = self.smear_line_s / 1e6;
            return suspect("smear_line_s", self.smear_line_s, "s", format!("us, which is {seconds:e} s"));
        }
        if self.full_well_e < LEAST_WELL_E {
            let electrons = self.full_well_e * 1000.0;
            return suspect(
                "full_well_e",
                self.full_well_e,
                "electrons",
                format!("thousands of them, which is {electrons}"),
            );
        }
        if let Some((key, noise)) = self.added_e().into_iter().find(|(_, noise)| *noise >= self.full_well_e) {
            return Err(format!(
                "`{key}` is {noise}, no less than `full_well_e`, {}; both are in electrons",
                self.full_well_e
            ));
        }
        let top_code = 2_f64.powi(i32::try_from(self.bits).unwrap_or_default()) - 1.0;
        if self.bias_adu > top_code {
            return Err(format!(
                "`bias_adu` is {}; the largest code of {} bits is {top_code}",
                self.bias_adu, self.bits
            ));
        }
        if let Some(curve) = self.linearization {
            curve.check_rises([-0.5, top_code + 0.5].map(|edge| edge - self.bias_adu))?;
        }
        self.taps.as_ref().map_or(Ok(()), |taps| self.check_taps(taps, top_code))
    }

    fn check_taps(&self, taps: &Taps, top_code: f64) -> Result<(), String> {
        taps.check(self.full_well_e)?;
        for tap in 0..taps.count() {
            let bias_adu = self.of_tap(tap).bias_adu;
            if bias_adu > top_code {
                return Err(format!(
                    "`taps.offset_e` of tap {tap} makes its bias {bias_adu}; the largest code of {} bits is {top_code}",
                    self.bits
                ));
            }
            if let Some(curve) = self.linearization {
                curve.check_rises([-0.5, top_code + 0.5].map(|edge| edge - bias_adu))?;
            }
        }
        Ok(())
    }

    /// The tap of a photosite, by column and row on the sensor; 0 of sensors that have one.
    pub fn tap(&self, at: [i64; 2]) -> usize {
        self.taps.as_ref().map_or(0, |taps| taps.tap([self.width, self.height], at))
    }

    /// The taps that read a column (axis 0) or row (1) of the sensor: before the middle and behind it.
    pub fn taps_of_line(&self, axis: usize, line: i64) -> [usize; 2] {
        let middle = [self.width, self.height].map(|extent| i64::from(extent / 2));
        [-1, 0].map(|side| {
            let mut at = middle.map(|middle| middle + side);
            at[axis] = line;
            self.tap(at)
        })
    }

    /// The read-out as if all went through one of its taps.
    #[must_use]
    pub fn of_tap(&self, tap: usize) -> Self {
        let Some(taps) = &self.taps else { return self.clone() };
        let adu_per_e = self.adu_per_e * taps.gain(tap);
        Self {
            read_noise_e: taps.read_noise_e(tap, self.read_noise_e),
            bias_adu: self.bias_adu + adu_per_e * taps.offset_e(tap),
            adu_per_e,
            taps: None,
            ..self.clone()
        }
    }

    /// The read noise of each of its taps, e⁻.
    pub fn read_noises_e(&self) -> impl Iterator<Item = f64> {
        let count = self.taps.as_ref().map_or(1, Taps::count);
        (0..count)
            .map(|tap| self.taps.as_ref().map_or(self.read_noise_e, |taps| taps.read_noise_e(tap, self.read_noise_e)))
    }

    /// What is added to charge when it is read, rms or mean in e⁻, by key.
    pub fn added_e(&self) -> [(&'static str, f64); 8] {
        [
            ("read_noise_e", self.read_noise_e),
            ("row_noise_e", self.row_noise_e),
            ("column_noise_e", self.column_noise_e),
            ("black_drift_e", self.black_drift_e),
            ("dsnu_e", self.dsnu_e),
            ("dsnu_row_e", self.dsnu_row_e),
            ("dsnu_column_e", self.dsnu_column_e),
            ("rts_amplitude_e", self.rts_amplitude_e),
        ]
    }

    /// What is possible, but may not be meant: a warning each.
    pub fn doubts(&self) -> Vec<String> {
        let codes = 2_f64.powi(i32::try_from(self.bits).unwrap_or_default());
        let reached = self.full_well_e * self.adu_per_e / codes;
        let inverse = (reached > MOST_RANGES).then(|| {
            format!(
                "`adu_per_e` is {}, with which full well reaches {reached:.0} times the range of {} bits; it looks like \
                 electrons per ADU, which is {} ADU per electron",
                self.adu_per_e,
                self.bits,
                1.0 / self.adu_per_e
            )
        });
        inverse.into_iter().collect()
    }

    /// Area of a photosite in cm², where the pitch is known.
    pub fn pixel_area_cm2(&self) -> Option<f64> {
        self.pixel_pitch_um.map(|pitch| (pitch * CM_PER_UM).powi(2))
    }

    /// Dark current of a photosite in e⁻ s⁻¹ at a temperature in K.
    ///
    /// I = 2.5·10¹⁵ A_p i_d T^1.5 exp(−E_g / 2kT)        [HP2005, Eq. 6]
    ///
    /// A dark current that was measured at the sensor's own temperature is scaled by the same law.
    pub fn dark_current_e_per_s(&self, temperature_k: f64) -> f64 {
        /// Electrons per s, cm² and nA cm⁻² that Eq. 6 has in front of T^1.5.
        const PREFACTOR: f64 = 2.5e15;
        let law = dark_current_law;
        match (self.dark_current_na_per_cm2.zip(self.pixel_area_cm2()), self.dark_current_e_per_s) {
            (Some((density, area)), _) => PREFACTOR * area * density * law(temperature_k),
            (None, Some(measured)) => measured * law(temperature_k) / law(self.temperature_k),
            (None, None) => 0.0,
        }
    }

    /// Mean excess of the dark current of hot photosites in e⁻ s⁻¹ at a temperature in K, by the same law.
    pub fn hot_pixel_e_per_s(&self, temperature_k: f64) -> f64 {
        match self.hot_pixel_dark_current_e_per_s {
            0.0 => 0.0,
            measured => measured * dark_current_law(temperature_k) / dark_current_law(self.temperature_k),
        }
    }

    /// Mean dark charge of a photosite and mean excess of hot ones in an exposure, e⁻. None where there is dark current and nobody knows
    /// for how long; without any no time matters.
    pub fn dark_charges_e(&self, temperature_k: f64, exposure_s: Option<f64>) -> Option<[f64; 2]> {
        let rates = [self.dark_current_e_per_s(temperature_k), self.hot_pixel_e_per_s(temperature_k)];
        let time_s = exposure_s.or((rates == [0.0; 2]).then_some(0.0))?;
        Some(rates.map(|rate| rate * time_s))
    }
}

/// What Eq. 6 of \[HP2005] makes of temperature: T^1.5 exp(−E_g / 2kT), T in K.
pub fn dark_current_law(temperature_k: f64) -> f64 {
    let t = temperature_k;
    t.powf(1.5) * (-silicon_band_gap_ev(t) / (2.0 * BOLTZMANN_EV_PER_K * t)).exp()
}

/// Band gap of silicon in eV at a temperature in K.
///
/// E_g = 1.1557 − 7.021·10⁻⁴ T² / (1108 + T)        [Varshni1967, constants for silicon]
pub fn silicon_band_gap_ev(temperature_k: f64) -> f64 {
    1.1557 - 7.021e-4 * temperature_k.powi(2) / (1108.0 + temperature_k)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::camera::taps::TapLayout;
    use crate::cfa::CfaPattern;

    /// That of the default sensor.
    pub(crate) fn kaf5101ce() -> ReadOut {
        ReadOut {
            setting: None,
            width: 2654,
            height: 1996,
            pixel_pitch_um: Some(6.8),
            cfa: CfaPattern::Rggb.into(),
            full_well_e: 40_000.0,
            dark_current_na_per_cm2: Some(0.068558),
            dark_current_e_per_s: None,
            temperature_k: 333.0,
            dcnu: 0.2,
            prnu: 0.008,
            read_noise_e: 15.7,
            row_noise_e: 0.0,
            column_noise_e: 0.0,
            black_drift_e: 0.0,
            black_drift_rows: 0.0,
            dsnu_e: 0.0,
            dsnu_row_e: 0.0,
            dsnu_column_e: 0.0,
            prnu_row: 0.0,
            prnu_column: 0.0,
            hot_pixel_share: 0.0,
            hot_pixel_dark_current_e_per_s: 0.0,
            rts_share: 0.0,
            rts_amplitude_e: 0.0,
            smear_line_s: 0.0,
            blooming: 0.0,
            bits: 12,
            bias_adu: 1753.0,
            adu_per_e: 0.058824,
            linearization: None,
            taps: None,
        }
    }

    /// Table 1 gives 40 mV s⁻¹ at 333 K and 720 mV for 40 000 e⁻; MODEL's recomputation of Eq. 6 gives 2218.6 e⁻ s⁻¹.
    #[test]
    fn the_dark_current_is_that_of_the_data_sheet() {
        let current = kaf5101ce().dark_current_e_per_s(333.0);
        assert!((current - 2218.6).abs() < 0.05, "{current}");
        assert!((current * 0.018 - 39.93).abs() < 0.005);
        assert!((current * 0.033 - 73.21).abs() < 0.005);
    }

    #[test]
    fn a_measured_dark_current_follows_the_same_law() {
        let by_density = kaf5101ce();
        let measured = ReadOut {
            pixel_pitch_um: None,
            dark_current_na_per_cm2: None,
            dark_current_e_per_s: Some(by_density.dark_current_e_per_s(333.0)),
            ..kaf5101ce()
        };
        assert_eq!(measured.check(), Ok(()));
        for t in [200.0, 300.0, 350.0] {
            let ratio = measured.dark_current_e_per_s(t) / by_density.dark_current_e_per_s(t);
            assert!((ratio - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn impossible_numbers_are_refused_by_key() {
        let complaint = |readout: ReadOut| readout.check().unwrap_err();
        assert!(complaint(ReadOut { read_noise_e: f64::NAN, ..kaf5101ce() }).contains("read_noise_e"));
        assert!(complaint(ReadOut { adu_per_e: 0.0, ..kaf5101ce() }).contains("adu_per_e"));
        assert!(complaint(ReadOut { bits: 17, ..kaf5101ce() }).contains("bits"));
        assert!(
            complaint(ReadOut { dark_current_na_per_cm2: None, ..kaf5101ce() })
                .contains("it must have `dark_current_na_per_cm2` or")
        );
        assert!(complaint(ReadOut { pixel_pitch_um: Some(0.0), ..kaf5101ce() }).contains("pixel_pitch_um"));
        assert!(complaint(ReadOut { pixel_pitch_um: None, ..kaf5101ce() }).contains("needs `pixel_pitch_um`"));
        assert_eq!(kaf5101ce().check(), Ok(()));
    }

    #[test]
    fn numbers_that_look_like_another_unit_are_refused() {
        for (readout, wanted) in [
            (ReadOut { pixel_pitch_um: Some(0.0068), ..kaf5101ce() }, "it is in um, and 0.0068 looks like mm or m"),
            (ReadOut { pixel_pitch_um: Some(6800.0), ..kaf5101ce() }, "6800 looks like nm"),
            (ReadOut { temperature_k: 20.0, ..kaf5101ce() }, "looks like degrees Celsius, which is 293.15 K"),
            (
                ReadOut { prnu: 5.0, ..kaf5101ce() },
                "`prnu` is 5; it is in fractions of 1, and 5 looks like per cent, which is 0.05",
            ),
            (ReadOut { dcnu: 20.0, ..kaf5101ce() }, "20 looks like per cent, which is 0.2"),
            (ReadOut { blooming: 30.0, ..kaf5101ce() }, "30 looks like per cent, which is 0.3"),
            (ReadOut { smear_line_s: 1.2, ..kaf5101ce() }, "it is in s, and 1.2 looks like us, which is 1.2e-6 s"),
            (ReadOut { full_well_e: 40.0, ..kaf5101ce() }, "40 looks like thousands of them, which is 40000"),
            (ReadOut { read_noise_e: 50_000.0, ..kaf5101ce() }, "no less than `full_well_e`"),
            (ReadOut { bits: 8, ..kaf5101ce() }, "the largest code of 8 bits is 255"),
        ] {
            let said = readout.check().unwrap_err();
            assert!(said.contains(wanted), "{said}");
        }
        let [doubt] = &ReadOut { adu_per_e: 17.0, ..kaf5101ce() }.doubts()[..] else { panic!("no doubt") };
        assert!(doubt.contains("166 times the range of 12 bits; it looks like electrons per ADU"), "{doubt}");
        assert!(kaf5101ce().doubts().is_empty());
    }

    #[test]
    fn impossible_taps_are_refused_by_key() {
        let taps = |layout, gain: &[f64]| Taps { layout, gain: gain.to_vec(), offset_e: vec![], read_noise_e: vec![] };
        let complaint = |taps: Taps| ReadOut { taps: Some(taps), ..kaf5101ce() }.check().unwrap_err();
        let halves = taps(TapLayout::LeftRight, &[1.0, 1.01]);
        for (wrong, said) in [
            (taps(TapLayout::LeftRight, &[]), "`taps` has none of `gain`, `offset_e` and `read_noise_e`"),
            (taps(TapLayout::Columns, &[1.0; 5]), "`taps` has numbers of 5 taps; the layout `columns` has 2 to 4"),
            (taps(TapLayout::Quadrants, &[1.0; 2]), "the layout `quadrants` has 4"),
            (taps(TapLayout::TopBottom, &[1.0, 101.0]), "`taps.gain` is 101 for tap 1; it is relative to `adu_per_e`"),
            (taps(TapLayout::TopBottom, &[f64::NAN, 1.0]), "`taps.gain` is NaN for tap 0"),
            (Taps { offset_e: vec![0.0], ..halves.clone() }, "`taps.offset_e` has 1 numbers, but there are 2 taps"),
            (Taps { offset_e: vec![0.0, -1e5], ..halves.clone() }, "`taps.offset_e` is -100000 for tap 1"),
            (Taps { offset_e: vec![39_990.0, 0.0], ..halves.clone() }, "`taps.offset_e` of tap 0 makes its bias 4105"),
            (Taps { read_noise_e: vec![15.0, -1.0], ..halves.clone() }, "`taps.read_noise_e` is -1 for tap 1"),
        ] {
            let found = complaint(wrong);
            assert!(found.contains(said), "{found}");
        }
        assert_eq!(ReadOut { taps: Some(halves), ..kaf5101ce() }.check(), Ok(()));
    }
}

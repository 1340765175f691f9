//! Spectra between their samples, where these are no straight lines in nm: by wavenumber, or per interval of wavenumber.

/// Below and beyond these nothing that a camera sees lies between samples, in nm.
const SHORTEST_NM: f64 = 100.0;
const LONGEST_NM: f64 = 2000.0;

/// What a table counts along, in which it is straight between its rows as far as anybody knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// Wavelength, in whichever unit.
    Wavelength,
    /// Wavenumber.
    Wavenumber,
}

impl Along {
    /// How far a wavelength lies from a first to a second, as a part of their distance.
    fn share(self, nm: f64, [first, second]: [f64; 2]) -> f64 {
        let part = (nm - first) / (second - first);
        match self {
            Self::Wavelength => part,
            // (1/λ₁ − 1/λ)/(1/λ₁ − 1/λ₂)
            Self::Wavenumber => part * second / nm,
        }
    }
}

/// Wavelengths so close that a spectrum is all but straight in nm between them, each a mixture of two samples.
///
/// Between samples farther apart than 2 nm all whole nanometers that are 1 nm from them or more are put in. What bends as λ⁻³
/// (straight in wavenumber, and per wavenumber) is off by no more than (3/λ)²·12/8 of itself between samples less than 3 nm apart, where
/// none may be put in, 8·10⁻⁵ at 400 nm, and exact where sums by 1 nm look otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Between {
    /// Wavelengths in nm, ascending.
    pub wavelength_nm: Vec<f64>,
    /// The sample below each, and the share of the next; none where they are the samples themselves.
    parts: Option<Vec<(usize, f64)>>,
}

impl Between {
    /// Between ascending wavelengths in nm; `is_bent` where values are per interval of wavenumber, whatever they are counted along.
    pub fn new(sampled_nm: &[f64], along: Along, is_bent: bool) -> Self {
        if along == Along::Wavelength && !is_bent {
            return Self { wavelength_nm: sampled_nm.to_vec(), parts: None };
        }
        let (mut wavelength_nm, mut parts) = (Vec::new(), Vec::new());
        for (index, &nm) in sampled_nm.iter().enumerate() {
            wavelength_nm.push(nm);
            parts.push((index, 0.0));
            let Some(&next) = sampled_nm.get(index + 1) else { continue };
            let (mut at, last) = ((nm + 1.0).ceil().max(SHORTEST_NM), (next - 1.0).min(LONGEST_NM));
            while at <= last {
                wavelength_nm.push(at);
                parts.push((index, along.share(at, [nm, next])));
                at += 1.0;
            }
        }
        Self { wavelength_nm, parts: Some(parts) }
    }

    /// The values at all its wavelengths of samples at those that it is between.
    pub fn values(&self, sample: impl Fn(usize) -> f64) -> Vec<f64> {
        match &self.parts {
            None => (0..self.wavelength_nm.len()).map(sample).collect(),
            Some(parts) => parts.iter().map(|part| mixed(*part, &sample)).collect(),
        }
    }

    /// Weights of so many samples that give the sum which `weights` at all its wavelengths give.
    pub fn folded(&self, weights: Vec<f64>, samples: usize) -> Vec<f64> {
        let Some(parts) = &self.parts else { return weights };
        let mut folded = vec![0.0; samples];
        for ((index, share), weight) in parts.iter().zip(weights) {
            folded[*index] += (1.0 - share) * weight;
            if *share > 0.0 {
                folded[index + 1] += share * weight;
            }
        }
        folded
    }
}

/// A sample, or a mixture of two.
fn mixed((index, share): (usize, f64), sample: &impl Fn(usize) -> f64) -> f64 {
    if share > 0.0 { (1.0 - share) * sample(index) + share * sample(index + 1) } else { sample(index) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_straight_in_wavenumber_is_so_at_every_nanometer() {
        let rows = [400.25, 402.0, 500.0, 800.5];
        let line = |nm: f64| 3.0 - 5e2 / nm;
        let between = Between::new(&rows, Along::Wavenumber, false);
        let values = between.values(|index| line(rows[index]));
        for (nm, value) in between.wavelength_nm.iter().zip(&values) {
            assert!((value - line(*nm)).abs() < 1e-12, "{nm}: {value}");
        }
        let nm = &between.wavelength_nm;
        assert!(nm.windows(2).all(|pair| (1.0..=2.0).contains(&(pair[1] - pair[0]))));
        assert!(rows.iter().all(|row| nm.contains(row)) && nm.contains(&501.0) && !nm.contains(&800.0));
        // Sums are the same, with what is put in or folded onto the samples.
        let weights: Vec<f64> = nm.iter().map(|nm| (nm / 100.0).sin()).collect();
        let sum: f64 = weights.iter().zip(&values).map(|(weight, value)| weight * value).sum();
        let folded: f64 =
            between.folded(weights, rows.len()).iter().zip(rows).map(|(weight, nm)| weight * line(nm)).sum();
        assert!((sum - folded).abs() < 1e-10, "{sum} {folded}");
    }

    #[test]
    fn straight_lines_in_nm_stay_as_they_are() {
        let rows = [400.0, 500.0, 5000.0];
        let straight = Between::new(&rows, Along::Wavelength, false);
        assert_eq!(
            (straight.wavelength_nm.as_slice(), straight.values(|index| rows[index])),
            (&rows[..], rows.to_vec())
        );
        let bent = Between::new(&rows, Along::Wavelength, true);
        let values = bent.values(|index| rows[index]);
        assert!(values.iter().zip(&bent.wavelength_nm).all(|(value, nm)| (value / nm - 1.0).abs() < 1e-12));
        assert_eq!(bent.wavelength_nm.len(), 3 + 99 + 1500);
    }

    /// Between samples that are too close to a whole nanometer straight lines in nm stay: at most (3/λ)²·12/8 of what bends as λ⁻³.
    #[test]
    fn what_is_left_of_straight_lines_is_small() {
        for step in [20, 80, 100, 200, 1000] {
            let rows: Vec<f64> = (12_000..=25_000).rev().step_by(step).map(|per_cm| 1e7 / f64::from(per_cm)).collect();
            let between = Between::new(&rows, Along::Wavenumber, true);
            let nm = &between.wavelength_nm;
            let (mut worst, value) = (0.0_f64, |nm: f64| nm.powi(-3));
            for pair in nm.windows(2) {
                let middle = 0.5 * (pair[0] + pair[1]);
                let line = 0.5 * (value(pair[0]) + value(pair[1]));
                worst = worst.max(line / value(middle) - 1.0);
            }
            assert!(worst < 1.5 * (3.0_f64 / 400.0).powi(2), "{step} cm-1: {worst}");
        }
    }
}

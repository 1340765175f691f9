//! Digests: of a frame's samples, by which a sidecar knows its frame, and of data files.

use crate::frame::Geometry;
use crate::stages::saturation::MASK_LAYER;
use sha2::{Digest, Sha256};

/// Digest of samples as little-endian 32-bit floats.
pub struct SamplesDigest {
    kind: Kind,
    /// The one value that all samples have so far; none of no samples, and of samples that differ.
    value: Option<f32>,
    differ: bool,
}

enum Kind {
    Blake3(Box<blake3::Hasher>),
    Sha256(Box<Sha256>),
}

impl SamplesDigest {
    /// The digest that sidecars are written with, BLAKE3, of no samples yet.
    pub fn new() -> Self {
        Self::of(Kind::Blake3(Box::default()))
    }

    fn of(kind: Kind) -> Self {
        Self { kind, value: None, differ: false }
    }

    /// The digest, of no samples yet, to compare with `expected`: SHA-256 where it says so, as older sidecars do.
    pub fn like(expected: &str) -> Self {
        if expected.starts_with("sha256:") { Self::of(Kind::Sha256(Box::default())) } else { Self::new() }
    }

    /// Adds samples.
    pub fn update(&mut self, samples: &[f32]) {
        if let (false, Some(first)) = (self.differ, samples.first()) {
            let value = *self.value.get_or_insert(*first);
            self.differ = samples.iter().any(|sample| sample.to_bits() != value.to_bits());
        }
        if cfg!(target_endian = "little") {
            self.update_bytes(bytemuck::cast_slice(samples));
        } else {
            samples.iter().for_each(|sample| self.update_bytes(&sample.to_le_bytes()));
        }
    }

    /// Adds whole rows of a frame; a layer of marks, the last of its channels, is not of the samples.
    pub fn update_rows(&mut self, rows: &[f32], geometry: &Geometry) {
        match geometry.channels.split_last() {
            Some((last, others)) if last == MASK_LAYER && !others.is_empty() => {
                let kept = others.len() * geometry.width;
                rows.chunks_exact(geometry.row_samples()).for_each(|row| self.update(&row[..kept]));
            }
            _ => self.update(rows),
        }
    }

    fn update_bytes(&mut self, bytes: &[u8]) {
        match &mut self.kind {
            Kind::Blake3(digest) => {
                digest.update(bytes);
            }
            Kind::Sha256(digest) => digest.update(bytes),
        }
    }

    /// Whether all samples have one value: such frames are alike though each was exposed by itself.
    pub fn is_of_one_value(&self) -> bool {
        !self.differ
    }

    /// The digest of all samples: `blake3:` or `sha256:`, and hexadecimal digits.
    pub fn finish(self) -> String {
        match self.kind {
            Kind::Blake3(digest) => format!("blake3:{}", digest.finalize().to_hex()),
            Kind::Sha256(digest) => format!("sha256:{}", hex(&digest.finalize())),
        }
    }
}

/// SHA-256 of a file's bytes, in hexadecimal digits: by which a sensor names its curves.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Default for SamplesDigest {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1024 bytes that count to 250 again and again, as in the test vectors of BLAKE3; the other digest is that of
    /// `sha256sum`.
    #[test]
    fn digests_are_those_of_other_programs() {
        let bytes: Vec<u8> = (0..=250).cycle().take(1024).collect();
        let samples: Vec<f32> = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        for expected in [
            "blake3:42214739f095a406f3fc83deb889744ac00df831c10daa55189b5d121c855af7",
            "sha256:2bce1ba628720664be4b9fdd77aae0678e5f0f3f02fc6ff641ec879094f6a404",
        ] {
            if let Some(digits) = expected.strip_prefix("sha256:") {
                assert_eq!(sha256(&bytes), digits);
            }
            let mut digest = SamplesDigest::like(expected);
            digest.update(&samples[..100]);
            digest.update(&samples[100..]);
            assert_eq!(digest.finish(), expected);
        }
    }
}

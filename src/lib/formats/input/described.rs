//! Whether samples are those that metadata describe.

use super::FrameReader;
use crate::formats::digest::SamplesDigest;
use crate::formats::register;

/// A digest to compare with once all samples are in.
pub(super) struct DigestCheck {
    pub expected: String,
    /// Who tells it, where that would be wrong.
    pub sidecar: Option<String>,
    pub digest: SamplesDigest,
}

impl FrameReader {
    /// Compares the digest, once the last row is in.
    pub(super) fn check_digest(&mut self) {
        let Some(DigestCheck { expected, sidecar, digest }) = self.check.take() else { return };
        if digest.finish() != expected {
            let name = &self.header.name;
            let by = sidecar.as_deref().unwrap_or("its digest");
            let text = format!("{name}: its samples are not those that {by} describes; one of the two was changed");
            sidecar.is_some().then(|| register::doubt(text.clone()));
            self.mismatch = Some(text);
        }
    }
}

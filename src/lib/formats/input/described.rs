//! Whether samples are those that metadata describe.

use crate::formats::digest::SamplesDigest;
use crate::formats::register;

/// A digest to compare with once all samples are in.
pub(super) struct DigestCheck {
    pub expected: String,
    /// Who tells it, where that would be wrong.
    pub sidecar: Option<String>,
    pub digest: SamplesDigest,
}

impl DigestCheck {
    /// A warning of samples of the frame `name` that are others, once all are in; it is registered where a sidecar is wrong then.
    pub(super) fn end(self, name: &str) -> Option<String> {
        let Self { expected, sidecar, digest } = self;
        if digest.finish() == expected {
            return None;
        }
        let by = sidecar.as_deref().unwrap_or("its digest");
        let text = format!("{name}: its samples are not those that {by} describes; one of the two was changed");
        sidecar.is_some().then(|| register::doubt(text.clone()));
        Some(text)
    }
}

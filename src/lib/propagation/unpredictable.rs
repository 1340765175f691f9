//! Why nothing is predicted.

/// Why nothing is said of what takes too long.
pub(super) const TOO_LONG: &str = "hot pixels or random telegraph signals go over so many counts and codes that the sum of what is made \
                                   of each would take too long";

/// Why nothing is said of offsets beside patterns that take too long.
pub(super) const OFFSETS_TOO_LONG: &str =
    "fixed offsets beside patterns of the charge, over codes that show or end, take too many evaluations";

/// Why nothing is said of patterns that take too long.
pub(super) const PATTERNS_TOO_LONG: &str =
    "patterns of the response and of the dark current, over codes that show or end, take too many evaluations";

/// Why nothing is predicted of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unpredictable {
    /// The metadata lack a key.
    #[error("the metadata has no `{0}`")]
    Missing(&'static str),
    /// Photosites of a class expect different signals.
    #[error("the scene is not uniform")]
    NotUniform,
    /// There is no formula for what was done.
    #[error("{0}")]
    Beyond(&'static str),
}

/// A prediction, or why there is none.
pub type Predicted<T> = Result<T, Unpredictable>;

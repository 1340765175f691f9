//! The names of the programs.

/// All programs but the front door, about in the order in which a frame meets them.
pub const PROGRAMS: [&str; 16] = [
    "render-radiance",
    "add-noise",
    "digitize",
    "mosaic",
    "import-raw",
    "correct-frame",
    "demosaic",
    "fit-matrix",
    "to-xyz",
    "stack-frames",
    "average-frames",
    "measure",
    "predict-noise",
    "photon-transfer",
    "color-difference",
    "preview",
];
/// Those that are linked with much that no other needs, so that they are executables of their own.
pub const APART: [&str; 2] = ["import-raw", "stack-frames"];
/// What the front door does itself: a demonstration, and pages.
pub const OWN: [&str; 4] = ["demo", "list", "keys", "template"];

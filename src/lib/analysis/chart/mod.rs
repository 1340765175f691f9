//! Charts of known colors: where their patches lie in a frame, what the camera reads of them, and the matrix that follows.

pub mod fit;
pub mod grid;
pub mod judgment;
pub mod neutrals;
pub mod order;
pub mod outliers;
pub mod reading;

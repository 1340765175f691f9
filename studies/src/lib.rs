//! What the studies share.

pub mod markdown;

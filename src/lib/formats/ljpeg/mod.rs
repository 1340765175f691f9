//! Lossless JPEG as raw files hold it: process 14 of \[T81], SOF3, by Huffman codes; row by row.
//!
//! Any number of components up to four, all in one scan and none subsampled; 2 to 16 bits; predictors 1 to 7; a point
//! transform; restart intervals. The crate `jpeg-decoder` knows images of one, three or four components, and decodes them as a whole.

mod entropy;
mod header;
mod rows;
#[cfg(test)]
pub(super) mod tests;

pub(super) use rows::LjpegRows;

/// What is said of a stream that ends early.
const SHORT: &str = "ends before its last row; it was cut short or damaged";

/// A damaged stream, in words that follow the name of its strip or tile.
fn damaged(what: impl std::fmt::Display) -> String {
    format!("is damaged; its lossless JPEG {what}")
}

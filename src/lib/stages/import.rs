//! Frames of cameras as they come: what was read becomes a frame of its own, no sample changed.

use crate::error::Result;
use crate::frame::{Rows, Window};
use crate::metadata::FrameHeader;
use crate::stream::{Counts, Stage};
use crate::units::{Any, QuantityKind};

/// Hands a plane of codes on as it is.
#[derive(Debug, Clone)]
pub struct Import {
    header: FrameHeader,
}

impl Import {
    /// The import of `input`.
    ///
    /// # Errors
    ///
    /// [`Error::Format`](crate::error::Error::Format) unless it is one plane of ADU, as its metadata may say otherwise.
    pub fn new(input: &FrameHeader) -> Result<Self> {
        if input.metadata.quantity != QuantityKind::Adu || input.geometry.channels.len() != 1 {
            return Err(input.refuse(format!(
                "its metadata say that it holds {}; what is imported is a plane of ADU",
                input.holds()
            )));
        }
        Ok(Self { header: FrameHeader { metadata: input.metadata.becoming(QuantityKind::Adu), ..input.clone() } })
    }

    /// The head of the frame that is made, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }
}

impl Stage for Import {
    type Input = Any;
    type Output = Any;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn apply(&self, input: Window<'_>, mut output: Rows<'_>) -> Counts {
        for y in output.range() {
            output.row(y, 0).copy_from_slice(input.row(y.cast_signed(), 0));
        }
        Counts::default()
    }
}

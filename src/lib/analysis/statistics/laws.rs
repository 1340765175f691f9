//! How samples of mixed pixels scatter in the regions of a frame.

use super::region::Region;
use crate::metadata::FrameHeader;
use crate::propagation::PixelMoments;
use crate::propagation::sampling::{Place, Sampling};
use nalgebra::Matrix3;

/// Sampling laws by place: regions of one size and phase share one.
#[derive(Default)]
pub(super) struct Samplings(Vec<(Place, Sampling)>);

impl Samplings {
    /// The law of a region of a frame of mixed pixels.
    pub fn of(&mut self, mixture: &PixelMoments, frame: &FrameHeader, region: Region) -> Sampling {
        let place = region.place(frame);
        if let Some((_, known)) = self.0.iter().find(|(of, _)| *of == place) {
            return known.clone();
        }
        let mut made = Sampling::of(&mixture.weights, &mixture.sites, &place);
        made.covariance += mixture.beyond_weights();
        made.mean_covariance += common(mixture);
        self.0.push((place, made.clone()));
        made
    }
}

/// What all pixels are off together: each channel as the class that it is named for.
fn common(mixture: &PixelMoments) -> Matrix3<f64> {
    let classes = Matrix3::from_diagonal(&mixture.sites.map(|site| site.common).into());
    mixture.from_camera * classes * mixture.from_camera.transpose()
}

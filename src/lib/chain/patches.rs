//! How uncertain the mean of a patch is.

use crate::metadata::FrameHeader;
use crate::propagation::drift;
use crate::propagation::frame::{Predicted, Unpredictable};
use crate::propagation::sampling::{Place, Sampling};
use crate::propagation::{Equations, FramePrediction, PixelMoments, SiteCovariance, of_frame};
use nalgebra::Matrix3;

/// Covariances of means of patches of a frame.
pub(super) struct PatchMeans<'a> {
    prediction: &'a FramePrediction,
    /// That of a pixel.
    covariance: &'a Matrix3<f64>,
    equations: Equations,
    /// That of the patch that is asked for.
    pub asked: Option<Matrix3<f64>>,
}

impl<'a> PatchMeans<'a> {
    /// Of a frame as large as the sensor, what is `predicted` of it and the covariance of its pixels; the patch asked for has a `size`, and
    /// its corner `at` a column and row, or anywhere.
    ///
    /// # Errors
    ///
    /// Why the patch is not predicted, where the frame is.
    pub fn of(
        head: &FrameHeader,
        predicted: (&'a FramePrediction, &'a Matrix3<f64>),
        equations: Equations,
        size: Option<[usize; 2]>,
        at: Option<[i64; 2]>,
    ) -> Predicted<Self> {
        let (prediction, covariance) = predicted;
        let mut patches = Self { prediction, covariance, equations, asked: None };
        patches.asked = match (size, at) {
            (None, _) => None,
            (Some(size), Some(at)) if equations == Equations::Exact => Some(patches.in_place(head, size, at)?),
            (Some(size), _) => Some(patches.anywhere(size)),
        };
        Ok(patches)
    }

    /// Of a patch whose corner lies on any place of the period of the filters, on average. Before demosaicking, and by the paper, its
    /// pixels count as independent.
    pub fn anywhere(&self, size: [usize; 2]) -> Matrix3<f64> {
        match self.prediction {
            FramePrediction::Pixels(mixture) if self.equations == Equations::Exact => {
                mixture.patch_mean_covariance(None, size)
            }
            FramePrediction::Planes(classes) => {
                let sites = SiteCovariance::of(classes);
                let [columns, rows] = size.map(|extent| extent as f64);
                let own = sites.own_of_planes();
                let of_rows = if sites.drifts() {
                    let shared = drift::of_mean_of_rows(size[1], sites.drift_rows);
                    (sites.row - sites.drift) / rows + sites.drift * shared
                } else {
                    sites.row / rows
                };
                own / (columns * rows) + of_rows + sites.column / columns
            }
            FramePrediction::Tapped(pixels) => pixels.patch_mean(None, size),
            FramePrediction::Groups(sites) => sites.patch_mean(size),
            FramePrediction::Pixels(_) => self.covariance / (size[0] as f64 * size[1] as f64),
        }
    }

    /// Of a patch where it lies: at the edges of the sensor samples are mirrored, and amplifiers have theirs to read.
    fn in_place(&self, head: &FrameHeader, size: [usize; 2], at: [i64; 2]) -> Predicted<Matrix3<f64>> {
        const BEYOND: Unpredictable = Unpredictable::Beyond("the patch does not lie within the frame");
        let geometry = &head.geometry;
        let frame = [geometry.width, geometry.height];
        let corner = [0, 1].map(|axis| usize::try_from(at[axis] - i64::from(geometry.origin[axis])));
        let [Ok(x), Ok(y)] = corner else { return Err(BEYOND) };
        let corner = [x, y];
        let is_within = |axis: usize| corner[axis].checked_add(size[axis]).is_some_and(|end| end <= frame[axis]);
        if !(is_within(0) && is_within(1)) {
            return Err(BEYOND);
        }
        let in_frame = |mixture: &PixelMoments| {
            let do_rows_drift = mixture.site_covariance().drifts();
            let place = Place { frame, origin: geometry.origin, corner, size }.canonical(do_rows_drift);
            Sampling::of(&mixture.weights, &mixture.sites, &place).mean_covariance
        };
        match self.prediction {
            FramePrediction::Pixels(mixture) => Ok(in_frame(mixture)),
            FramePrediction::Planes(_) => Ok(self.anywhere(size)),
            FramePrediction::Groups(_) | FramePrediction::Tapped(_) => {
                let mut part = head.clone();
                [part.geometry.width, part.geometry.height] = size;
                part.geometry.origin = [0, 1]
                    .map(|axis| geometry.origin[axis].saturating_add(i32::try_from(corner[axis]).unwrap_or(i32::MAX)));
                let prediction = of_frame(&part, self.equations)?;
                match &prediction {
                    FramePrediction::Tapped(pixels) => Ok(pixels.sampling().mean_covariance),
                    // Behind one amplifier, and so are all samples within reach.
                    FramePrediction::Pixels(mixture) => Ok(in_frame(mixture)),
                    of_sites => Ok(PatchMeans { prediction: of_sites, ..*self }.anywhere(size)),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::camera::optics::Exposure;
    use crate::camera::readout::ReadOut;
    use crate::camera::taps::{TapLayout, Taps};
    use crate::chain::{CameraSetup, ChainStage, Predictor, PredictorSettings};
    use crate::formats::data::load_sensor;
    use crate::stages::demosaic::Method;

    /// Variances of the mean of a patch of demosaicked pixels, of a sensor behind R G / G B that was changed.
    fn variances(change: &dyn Fn(&mut ReadOut), at: Option<[i64; 2]>, size: [usize; 2]) -> [f64; 3] {
        let mut sensor = load_sensor("kaf-5101ce").unwrap().sensor;
        change(sensor.readout.as_mut().unwrap());
        let exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };
        let camera = CameraSetup { method: Method::Bilinear, ..CameraSetup::new(sensor, exposure) };
        let settings = PredictorSettings { patch: Some(size), patch_at: at, ..PredictorSettings::of(camera) };
        let stages = Predictor::new(settings).unwrap().predict([900.0; 3]).unwrap().stages;
        let stage = stages.into_iter().find(|stage| stage.stage == ChainStage::Demosaicked).unwrap();
        stage.patch_mean_std.unwrap().map(|std| std * std)
    }

    fn assert_near(found: [f64; 3], wanted: [f64; 3]) {
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - wanted).abs() <= 1e-9 * wanted, "{found} {wanted}");
        }
    }

    #[test]
    fn at_the_edges_mirrored_samples_count() {
        let of = |at, size| variances(&|_| {}, Some(at), size);
        // At a red photosite green is the mean of four, blue of four on the diagonals; in the corner of two, and of one.
        let [red, green, blue] = of([20, 34], [1, 1]);
        assert_near(of([0, 0], [1, 1]), [red, 2.0 * green, 4.0 * blue]);
        // On the upper rim: one below counts twice, 1/16 + 1/16 + 1/4; two on the diagonals twice each.
        assert_near(of([20, 0], [1, 1]), [red, 1.5 * green, 2.0 * blue]);
        // All places of the period, far from the edges: 16 pixels of each phase are as many anywhere.
        let anywhere = variances(&|_| {}, None, [8, 8]);
        let mean = [[20, 20], [21, 20], [20, 21], [21, 21]].map(|at| of(at, [8, 8]));
        assert_near([0, 1, 2].map(|k| mean.iter().map(|of| of[k]).sum::<f64>() / 4.0), anywhere);
    }

    #[test]
    fn a_patch_has_the_noise_of_the_amplifiers_that_read_it() {
        let halves = |layout| {
            move |readout: &mut ReadOut| {
                readout.taps =
                    Some(Taps { layout, gain: vec![1.0, 1.0], offset_e: Vec::new(), read_noise_e: vec![20.0, 200.0] });
            }
        };
        let quiet = variances(&|readout| readout.read_noise_e = 20.0, Some([100, 100]), [6, 4]);
        let loud = variances(&|readout| readout.read_noise_e = 200.0, Some([100, 100]), [6, 4]);
        let of = |layout, at| variances(&halves(layout), Some(at), [6, 4]);
        assert_near(of(TapLayout::LeftRight, [100, 100]), quiet);
        assert_near(of(TapLayout::LeftRight, [2000, 100]), loud);
        assert_near(of(TapLayout::TopBottom, [2000, 100]), quiet);
        // In the corner as that of a sensor without others.
        let corner = variances(&|readout| readout.read_noise_e = 20.0, Some([0, 0]), [1, 1]);
        assert_near(variances(&halves(TapLayout::LeftRight), Some([0, 0]), [1, 1]), corner);
        // Red columns are read by the one, blue columns by the other, whether pixels are measured or made of neighbors.
        let [red, _, blue] = of(TapLayout::Columns, [100, 100]);
        assert_near([red, blue, 1.0], [quiet[0], loud[2], 1.0]);
    }
}

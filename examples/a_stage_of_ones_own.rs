//! A stage of one's own among those of the library: capacitance between photosites, which makes a camera look less noisy,
//! and its gain smaller, than it is.
//!
//!     cargo run --example a_stage_of_ones_own

#![allow(clippy::print_stdout, reason = "an example talks")]

use cyanometer::camera::optics::Exposure;
use cyanometer::cfa::CfaPattern;
use cyanometer::error::Result;
use cyanometer::formats::data::load_sensor;
use cyanometer::frame::{Geometry, Rows, Window, mirror};
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::numerics::moments::Moments;
use cyanometer::random::Source;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::{Counts, MemoryFrame, Stage};
use cyanometer::units::{Electrons, QuantityKind};

/// Each photosite shows this share of its charge at each of its four neighbors.
struct Coupling {
    share: f32,
    header: FrameHeader,
}

impl Stage for Coupling {
    // What goes in and what comes out are types: this stage cannot be given codes.
    type Input = Electrons;
    type Output = Electrons;

    // The head of what comes out: here that of what goes in.
    fn header(&self) -> &FrameHeader {
        &self.header
    }

    // A row hangs on the one above and the one below: the window holds them.
    fn reach(&self) -> usize {
        1
    }

    // Frames come in bands. What a row becomes must not hang on where the band ends.
    fn apply(&self, input: Window<'_, Electrons>, mut output: Rows<'_, Electrons>) -> Counts {
        for y in output.range() {
            for channel in 0..input.channels() {
                let [above, own, below] = [-1, 0, 1].map(|step| input.row(y.cast_signed() + step, channel));
                for (x, made) in output.row(y, channel).iter_mut().enumerate() {
                    let beside = [-1, 1].map(|step| own[mirror(x.cast_signed() + step, own.len())]);
                    *made = own[x] + self.share * (above[x] + below[x] + beside[0] + beside[1] - 4.0 * own[x]);
                }
            }
        }
        Counts::default()
    }
}

/// Variance over mean of a frame with shot noise alone, before and after coupling: a photon transfer curve takes it for 1.
pub fn variance_over_mean(share: f32) -> Result<[f64; 2]> {
    let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
    metadata.sensor = Some(load_sensor("kaf-5101ce")?.sensor);
    metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
    metadata.cfa = Some(CfaPattern::Rggb.into());
    let geometry = Geometry::new(1000, 1000, &["Y"]);
    let light = MemoryFrame::new(FrameHeader { name: "gray".into(), geometry, metadata }, vec![20_000.0; 1_000_000]);

    // The library's stage, then ours.
    let shot_noise =
        NoiseSettings { without: vec![Source::Dcnu, Source::Prnu, Source::Ron], ..NoiseSettings::default() };
    let noisy = light.through(&AddNoise::new(&light.header, &shot_noise)?)?.0;
    let coupled = noisy.through(&Coupling { share, header: noisy.header.clone() })?.0;
    Ok([noisy, coupled].map(|frame| {
        let mut moments = Moments::new(1);
        moments.add(&[&frame.samples]);
        moments.covariance(0, 0).unwrap_or(f64::NAN) / moments.mean[0]
    }))
}

fn main() -> Result<()> {
    let share = 0.01;
    let [before, after] = variance_over_mean(share)?;
    println!("variance over mean: {before:.4} before, {after:.4} after");
    let law = (1.0 - 4.0 * share).powi(2) + 4.0 * share.powi(2);
    println!("the gain seems {:.4} of what it is; by the law (1 − 4a)² + 4a² it is {law:.4}", after / before);
    Ok(())
}

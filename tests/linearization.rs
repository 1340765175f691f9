//! Converters that are not straight: codes, what they are made straight to, and the moments of both.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::{Saturated, measure};
use cyanometer::camera::linearity::Linearization;
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::readout::ReadOut;
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::{FrameHeader, Metadata, Scene};
use cyanometer::propagation::Equations;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use cyanometer::units::QuantityKind;
use support::{sensor, straightened, through};

/// Electrons of a uniform scene as a camera has them.
fn electrons(readout: &ReadOut, electrons: [f64; 3], seed: u64) -> MemoryFrame {
    let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
    let mut camera = sensor();
    camera.readout = Some(readout.clone());
    metadata.sensor = Some(camera);
    metadata.exposure = Some(Exposure { exposure_s: 0.05, f_number: 8.0, lens_transmittance: 1.0 });
    metadata.scene = Some(Scene::uniform("test", electrons));
    let header = FrameHeader { name: "test".into(), geometry: Geometry::new(160, 120, &["R", "G", "B"]), metadata };
    let scene = support::frame(header, |_, _, channel| to_sample(electrons[channel]));
    let settings = NoiseSettings { seed, sensor_seed: seed + 1, ..Default::default() };
    through(&scene, &AddNoise::new(&scene.header, &settings).unwrap())
}

fn digitized(frame: &MemoryFrame) -> MemoryFrame {
    through(frame, &Digitize::new(&frame.header, &AdcSettings::default()).unwrap())
}

/// z scores of the mean and the spread of each plane.
fn scores(frame: &MemoryFrame) -> Vec<[f64; 2]> {
    let mut source = frame.clone();
    let report = measure(&mut source, &[], Saturated::Kept, Equations::Exact, None).unwrap();
    let region = report.regions.into_iter().next().unwrap();
    let z = |class: &cyanometer::analysis::statistics::ChannelReport| [class.z_mean, class.z_std].map(Option::unwrap);
    region.channels.iter().map(z).collect()
}

/// A camera that sags by up to 8 %, or bends as a table has it, or swings; 8 to 14 bits, with codes that read noise leaves visible
/// and codes that it hides.
fn camera(index: u32) -> ReadOut {
    let share =
        |salt: u32| f64::from(index.wrapping_mul(2_654_435_761).rotate_left(salt) >> 8) / f64::from(1_u32 << 24);
    let bits = [8, 10, 12, 14][index as usize % 4];
    let top = f64::from((1_u32 << bits) - 1);
    let bend = 0.16 * (share(3) - 0.5) / top;
    let swing = 0.1 * (share(9) - 0.5) / (top * top);
    let linearization = if index.is_multiple_of(3) {
        let codes: Vec<f64> = (0..=8).map(|k| top * f64::from(k) / 8.0).collect();
        let linear = codes.iter().map(|code| code * (1.0 + bend * code)).collect();
        Linearization::table(codes, linear).unwrap()
    } else {
        Linearization::polynomial(vec![1.0 + 0.1 * (share(5) - 0.5), bend, swing]).unwrap()
    };
    ReadOut {
        bits,
        bias_adu: 0.02 * top,
        adu_per_e: top / 40_000.0 * (0.5 + share(13)),
        read_noise_e: 2.0 + 40.0 * share(17),
        linearization: Some(linearization),
        ..support::readout()
    }
}

/// Levels in the middle, in the dark, at the top code and about full well; codes as they are and made straight. Of 480 normal scores
/// the largest exceeds 5 in one of 3600 cases; their rms is 1 to within 4/√960 = 0.13.
#[test]
fn codes_and_what_is_made_of_them_are_as_predicted() {
    for is_straightened in [false, true] {
        let (mut square, mut count, mut worst) = (0.0, 0.0, (0.0, String::new()));
        for index in 0..40 {
            let readout = camera(index);
            let top_e = (2_f64.powi(readout.bits.cast_signed()) - 1.0 - readout.bias_adu) / readout.adu_per_e;
            let light = [0.0, 0.3 * top_e, 0.5 * top_e].map(|e| f64::from(to_sample(e)));
            let frame = digitized(&electrons(&readout, light, 7 * u64::from(index)));
            let frame = if is_straightened { straightened(&frame) } else { frame };
            for (plane, z) in scores(&frame).into_iter().enumerate() {
                for z in z {
                    square += z * z;
                    count += 1.0;
                    if z.abs() > worst.0 {
                        worst = (z.abs(), format!("camera {index}, plane {plane}: {z}; {readout:?}"));
                    }
                }
            }
        }
        let rms = (square / count).sqrt();
        assert!(worst.0 < 5.0, "{worst:?}");
        assert!((rms - 1.0).abs() < 4.0 / (2.0 * count).sqrt(), "rms {rms}; {worst:?}");
    }
}

/// Made straight, codes are those of the straight converter but for their rounding: means of a plane agree to the sampling error of
/// what rounding adds, 1/12 of the squared step for each of 19 200 photosites, five times.
#[test]
fn straightened_codes_are_those_of_a_straight_converter() {
    for index in 0..12 {
        let bent = ReadOut { bits: 14, adu_per_e: 0.25, ..camera(4 * index + 3) };
        let straight = ReadOut { linearization: None, ..bent.clone() };
        let light = [500.0, 8000.0, 20_000.0];
        let [found, expected] = [&bent, &straight].map(|readout| digitized(&electrons(readout, light, 5)));
        let found = straightened(&found);
        let count = 160.0 * 120.0;
        for channel in 0..3 {
            let mean = |frame: &MemoryFrame| -> f64 {
                let rows = frame.samples.chunks_exact(160).skip(channel).step_by(3);
                rows.flatten().map(|sample| f64::from(*sample)).sum::<f64>() / count
            };
            let difference = mean(&found) - mean(&expected);
            assert!(difference.abs() < 5.0 * (2.0_f64 / 12.0 * 1.3 / count).sqrt(), "{index} {channel}: {difference}");
        }
    }
}

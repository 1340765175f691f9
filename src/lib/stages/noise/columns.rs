//! What columns of a frame have by themselves: offsets, gains, smear.

use super::model::{LineNoise, NoiseModel};
use super::smear::{self, Known};
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::{FrameHeader, NoiseRecord};
use crate::random::{LineDraws, of_column};

/// What the frame's columns have by themselves; empty where they have nothing.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    /// Electrons that are added.
    pub offsets: Vec<f32>,
    /// Relative gains less 1.
    pub gains: Vec<f32>,
    /// Smear, expected electrons.
    pub smear: Vec<f32>,
}

impl Columns {
    pub fn of(frame: &FrameHeader, model: &NoiseModel, record: &NoiseRecord) -> Self {
        let LineNoise { column_noise_e, dsnu_column_e, prnu_column, .. } = model.lines;
        let has_offsets = column_noise_e > 0.0 || dsnu_column_e > 0.0;
        if !has_offsets && prnu_column <= 0.0 {
            return Self::default();
        }
        let seeds = [record.seed, record.sensor_seed];
        let draws = (0..frame.geometry.width).map(|x| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_possible_wrap,
                reason = "wraps as sensor columns do"
            )]
            let column = frame.geometry.origin[0].wrapping_add(x as i32);
            of_column(seeds, record.frame, column)
        });
        let offset = |draw: &LineDraws| to_sample(column_noise_e * draw.temporal + dsnu_column_e * draw.offset);
        let gain = |draw: &LineDraws| to_sample(prnu_column * draw.response);
        let (offsets, gains): (Vec<f32>, Vec<f32>) = draws.map(|draw| (offset(&draw), gain(&draw))).unzip();
        Self {
            offsets: if has_offsets { offsets } else { Vec::new() },
            gains: if prnu_column > 0.0 { gains } else { Vec::new() },
            smear: Vec::new(),
        }
    }

    /// Adds smear, of which packets take such a share of the light; tells whether the head of the frame says enough.
    pub fn add_smear(&mut self, frame: &FrameHeader, share: f64) -> Result<bool> {
        if share > 0.0 {
            match smear::known(frame, frame.sensor()?.bayer()?, share)? {
                Known::Smear(smear) => self.smear = smear,
                Known::Nothing => return Ok(false),
            }
        }
        Ok(true)
    }
}

//! Counts at rates that are known before any is drawn.

use super::model::NoiseModel;
use crate::frame::to_sample;
use crate::metadata::{FrameHeader, PoissonKind};
use crate::numerics::vectors::Instructions;
use crate::random::poisson::Table;
use std::sync::Arc;

/// Counts at rates that are known beforehand: those of the dark signal, and of light where the scene is uniform.
#[derive(Debug, Clone, Default)]
pub(super) struct Tables {
    pub dark: Option<Arc<Table>>,
    pub light: [Option<Arc<Table>>; 3],
}

impl Tables {
    /// The tables that a frame is large enough for.
    pub fn of(frame: &FrameHeader, model: &NoiseModel, instructions: Instructions) -> Self {
        /// Photosites from which on a table saves more than it costs.
        const WORTHWHILE: usize = 1 << 17;
        /// Rates from which on the widest vectors work counts out faster than they are looked up.
        const FEW: f64 = 10.0;
        let geometry = &frame.geometry;
        if model.poisson != PoissonKind::Exact || geometry.width * geometry.height < WORTHWHILE {
            return Self::default();
        }
        let table = |rate: f64| Table::new(to_sample(rate)).map(Arc::new);
        let scene = frame.metadata.scene.as_ref().filter(|scene| scene.uniform && model.signal_shot);
        let rates = scene.and_then(|scene| scene.expected_electrons);
        let is_slow = |rates: &[f64; 3]| instructions == Instructions::Avx512 && rates.iter().all(|&rate| rate >= FEW);
        let light = rates.filter(|rates| !is_slow(rates)).map(|rates| rates.map(table));
        let dark = if model.dark_shot && model.dark_e > 0.0 { table(model.dark_e) } else { None };
        Self { dark, light: light.unwrap_or_default() }
    }
}

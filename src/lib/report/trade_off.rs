//! The plot of what a matrix leaves of errors of color and of noise.

use crate::analysis::characterization::noise_aware::TradeOff;
use crate::plot::{Axis, Color, Marks, Panel, Plot};

/// Noise of a pixel against error of the matrix, one point for each noise weight, along the curve.
pub fn trade_off(curve: &[TradeOff]) -> Plot {
    let x = Axis::log10("error of the matrix, rms ΔE*ab");
    let y = Axis::log10("noise of a pixel, rms ΔE*ab");
    let mut panel = Panel::new(x, y);
    let place = |point: &TradeOff| [point.model_delta_e, point.noise_delta_e];
    panel.add("noise weights from 0 to 100", Color::Blue, Marks::LineAndPoints(curve.iter().map(place).collect()));
    for (weight, name) in [(1.0, "weight 1: single pixels"), (0.0, "weight 0: the best colors")] {
        for point in curve.iter().filter(|point| point.noise_weight == weight) {
            panel.name(place(point), name, Color::Black);
        }
    }
    Plot::new("Errors of color against noise", panel)
}

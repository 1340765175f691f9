//! The plot of what a matrix leaves of errors of color and of noise.

use crate::analysis::characterization::noise_aware::TradeOff;
use crate::plot::{Axis, Color, Marks, Panel, Plot};

/// Noise of a pixel against error of the matrix, one point for each noise weight, along the curve.
pub fn trade_off(curve: &[TradeOff]) -> Plot {
    let x = Axis::log10("error of the matrix, rms ΔE*ab");
    let y = Axis::log10("noise of a pixel, rms ΔE*ab");
    let mut panel = Panel::new(x, y);
    let points = |chosen: &dyn Fn(&TradeOff) -> bool| {
        curve.iter().filter(|p| chosen(p)).map(|p| [p.model_delta_e, p.noise_delta_e]).collect::<Vec<_>>()
    };
    panel.add("noise weights from 0 to 100", Color::Blue, Marks::LineAndPoints(points(&|_| true)));
    panel.add("weight 1: single pixels", Color::Vermillion, Marks::Points(points(&|p| p.noise_weight == 1.0)));
    panel.add("weight 0: the best colors", Color::Green, Marks::Points(points(&|p| p.noise_weight == 0.0)));
    Plot::new("Errors of color against noise", panel)
}

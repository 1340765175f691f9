//! Stages and predictions together: one camera, and the noise budget of what it sees.
//!
//! [`CameraSetup`] builds the heads of frames and the stages that follow them; [`Predictor`] goes down the same heads by
//! formula.

pub mod camera;
mod causes;
mod patches;
pub mod predicted;
pub mod predictor;

pub use camera::{CameraSetup, CameraStages, uniform_frame};
pub use predicted::{CauseVariance, ChainPrediction, ChainStage, NoiseDeltaE, PhaseCovariance, StagePrediction};
pub use predictor::{Predictor, PredictorSettings, Uncertainty};

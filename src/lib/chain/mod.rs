//! Stages and predictions together: one camera, and the noise budget of what it sees.
//!
//! [`CameraSetup`] builds the heads of frames and the stages that follow them; [`Predictor`] goes down the same heads by
//! formula.

pub mod camera;
pub mod predictor;

pub use camera::{CameraSetup, CameraStages, uniform_frame};
pub use predictor::{
    CauseVariance, ChainPrediction, ChainStage, NoiseDeltaE, PhaseCovariance, Predictor, PredictorSettings,
    StagePrediction, Uncertainty,
};

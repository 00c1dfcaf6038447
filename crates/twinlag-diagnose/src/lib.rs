//! What a two-sensor model leaves over, and which physical effect it lacks.

mod chain;
mod defects;
mod dense;
mod diagnose;
mod diagnosis;
mod effect;
mod error;
mod excitation;
mod held_out;
mod model;
mod naming;
mod observations;
mod plant;
mod prepare;
mod residual;
mod search;
mod settings;
mod spectrum;
mod spline;
mod summary;
mod weighting;
mod whitening;

pub use diagnose::{diagnose, fit_with};
pub use diagnosis::{
    BeforeAfter, Diagnosis, ErrorBudget, Evidence, Found, Limit, ModelFit, TimeConstant, Trace, Unexplained, Value,
    Verdict,
};
pub use effect::{About, Identifier};
pub use error::DiagnoseError;
pub use model::KnownTimeConstant;
pub use observations::{Observations, Stretch};
pub use settings::{KnownEffect, Settings, Watch};

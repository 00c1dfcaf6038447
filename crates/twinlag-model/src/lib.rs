//! Two first-order sensors with any further physical effects: the inverse of the whole rig with its
//! noise, and its fit.

mod between;
mod blocks;
mod chain;
mod chance;
mod correlation;
mod cost;
mod defects;
pub mod dense;
mod departure;
mod deviance;
mod directions;
mod disagreement;
mod effect;
mod error;
mod extended;
mod fit;
mod fitted;
mod flow;
mod gas;
mod held_out;
mod implied;
mod influence;
mod instants;
mod inverse;
mod known;
mod lag_pair;
mod masked;
mod member_noise;
mod mismatch_bias;
mod model;
mod normal;
mod number;
mod observations;
mod plant;
mod policy;
mod prediction;
mod prepare;
mod range_end;
mod records;
mod residual;
mod rows;
mod selection;
mod settings;
mod spectrum;
mod spline;
mod summary;
mod trace;
mod track;
mod weighting;
mod whitening;

pub use between::{Between, BetweenRecords, Contradicted, OwnValue};
pub use chance::energy_difference_std;
pub use cost::Linearised;
pub use defects::{ChannelNoise, levels, line_channel, lines};
pub use departure::Departure;
pub use deviance::DevianceSurface;
pub use directions::{Install, Part, Parts};
pub use effect::{
    About, Context, Derived, Domain, Effect, Freedom, Identifier, KnownEffect, OfParameters, Parameter, Seat, Shared,
    Twin, candidates, described_by,
};
pub use error::ModelError;
pub use extended::Extended;
pub use fit::{Effort, Fitted};
pub use fitted::{Defect, KnownFit, ModelFit, TimeConstant, Value};
pub use flow::{Flow, FlowKind};
pub use gas::Gas;
pub use held_out::{held_out_energy, held_out_gain};
pub use implied::Evaluation;
pub use instants::Instants;
pub use known::{fit_again_with, fit_with};
pub use model::{KnownTimeConstant, Model};
pub use normal::{Beside, NormalEquations};
pub use num_dual::DualNum;
pub use number::{Curve, Number, TimeFunction};
pub use observations::{Observations, Stretch, evenly_spread};
pub use plant::{Extra, Place, Plant, Reading, Sensor, Separation, SlowPath, TimeConstantChange, ZERO_CELSIUS_K};
pub use policy::Policy;
pub use prediction::Prediction;
pub use prepare::Prepared;
pub use records::{Member, OneRecord};
pub use selection::{Samples, Selection};
pub use settings::{Settings, Watch, report};
pub use spectrum::{Bands, fit_noise, fit_noise_again, noise_log_variances, white_deviance};
pub use spline::Spline;
pub use summary::{covariance, is_unresolved, summarise};
pub use trace::{Line, ResidualPart, Trace};
pub use track::{Change, ChangePoint, RatioTest, Track, track};
pub use twinlag_optimise::Variable;
pub use weighting::Weighting;

/// Models, with their effects, and records may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(Bands, Context, ModelError, Evaluation, Extended, Fitted, Flow, Identifier)>();
    is_send_and_sync::<(KnownEffect, KnownFit, ChannelNoise, Linearised, Model, ModelFit, Observations, Parameter)>();
    is_send_and_sync::<(Plant, Policy, Prepared, Selection, Settings, Spline, Stretch, Track, Weighting)>();
};

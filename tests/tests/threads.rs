//! What a layer hands out may go to any thread, and be read by several: checked as this compiles.

use twinlag::{bias, compensation, cross_relation, diagnosis, estimate, optimise, record, sensor, signal};

const fn may_cross_threads<T: Send + Sync>() {}

const _: () = {
    may_cross_threads::<(sensor::FirstOrder, sensor::SecondOrder, sensor::SlowMode)>();
    may_cross_threads::<(signal::Rig, signal::Simulated, signal::SignalError)>();
    may_cross_threads::<(cross_relation::Readings, cross_relation::Whitened<'static>, cross_relation::CostError)>();
    may_cross_threads::<(bias::NoiseLevel, bias::NoiseMoments, bias::NoiseError)>();
    may_cross_threads::<(optimise::Optimiser, optimise::Fit, optimise::ProblemError)>();
    may_cross_threads::<(compensation::Readings, compensation::Gas, Box<dyn compensation::AnyTracker>)>();
    may_cross_threads::<(diagnosis::Observations, diagnosis::Diagnosis, diagnosis::ModelError)>();
    may_cross_threads::<(record::Record, record::Table, record::RecordError)>();
    may_cross_threads::<(estimate::Estimator, estimate::Outcome, estimate::EstimateError)>();
};

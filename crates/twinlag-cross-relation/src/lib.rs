//! How badly two temperature sensors disagree about the gas that both were in.
//!
//! For anyone who wants the costs alone, to minimise with an optimiser of their own: the published
//! cross-relation cost with gradient and Hessian, and the exactly whitened one, the residual it
//! leaves, and the covariance of what it estimates. The crate knows no optimiser and no files. To
//! take the noise's bias out of the published cost see `twinlag-bias`; for whole records take
//! `twinlag`.
//!
//! ```
//! use twinlag_cross_relation::{CrossRelation, Readings, Whitened};
//! use twinlag_sensor::{Discretisation, FirstOrder};
//!
//! // Two sensors in the same fluctuating gas, 500 samples a second.
//! let gas: Vec<f64> = (0..2000).map(|k| 300.0 + 20.0 * (0.13 * k as f64).sin() + 8.0 * (0.037 * k as f64).cos()).collect();
//! let y1 = FirstOrder::new(0.0238, 0.002)?.respond(&gas);
//! let y2 = FirstOrder::new(0.1168, 0.002)?.respond(&gas);
//! let readings = Readings::even(&y1, &y2, 0.002)?;
//!
//! // Both costs vanish at the true time constants, and nowhere near.
//! let published = CrossRelation::new(&readings, 600)?;
//! assert!(published.evaluate(&[0.0238, 0.1168]).value < 1e-6);
//! assert!(published.evaluate(&[0.03, 0.1]).value > 1e-2);
//!
//! let whitened = Whitened::new(&readings, Discretisation::ZeroOrderHold, [0.1, 0.1])?;
//! assert!(whitened.evaluate(&[0.0238, 0.1168]).value < 1e-12);
//! assert!(whitened.evaluate(&[0.03, 0.1]).value > 1e2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod banded;
mod bands;
mod compressed;
mod difference_equation;
mod error;
mod free_gains;
mod inferred;
mod influences;
mod information;
mod interval_95;
mod inverse;
mod noise_model;
mod parameters;
mod parts;
mod polynomial;
mod published;
mod readings;
mod residual;
mod sandwich;
mod spectral;
mod synthetic;
mod transform;
mod whitened;

pub use difference_equation::{DifferenceEquationEstimator, difference_equation_least_squares};
pub use error::CostError;
pub use free_gains::FreeGains;
pub use inferred::{InferredInputs, inferred_inputs};
pub use influences::Influences;
pub use information::ScoreVariance;
pub use interval_95::{CHI2_95, Z_975, log_normal_interval_95};
pub use parameters::{CostValue, Parameter};
pub use parts::{PartScatter, Scatter};
pub use published::CrossRelation;
pub use readings::{Readings, Segment, Steps};
pub use residual::{ResidualTest, TestName, residual_tests, total_energy_test};
pub use sandwich::sandwich;
pub use synthetic::synthetic_filter;
pub use whitened::{Form, Whitened};

/// Readings and the costs of them may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(CostError, CrossRelation<'static>, DifferenceEquationEstimator, FreeGains<'static>)>();
    is_send_and_sync::<(InferredInputs, PartScatter, Readings, ResidualTest, Scatter, Segment, Whitened<'static>)>();
};

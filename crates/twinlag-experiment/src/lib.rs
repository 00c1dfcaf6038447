//! Monte-Carlo experiments with two-sensor estimators, each described by one file. This crate is
//! for researchers who compare estimators, optimisers and noise levels over many simulated records,
//! and want a table and pictures that anyone can reproduce byte for byte. A [`Plan`] is a TOML
//! file; [`Experiment`] makes a study of it that `twinlag-study` runs on all cores, in shards, with
//! restarts; [`Table`] holds bias, scatter, coverage and success with their own standard errors,
//! beside the Cramér-Rao bound. For a single record take `twinlag`; for a study of something else,
//! `twinlag-study`.
//!
//! ```
//! use std::ops::ControlFlow;
//! use twinlag_experiment::{Experiment, Plan, Table};
//! use twinlag_study::{Options, run};
//!
//! let plan = Plan::from_toml(
//!     r#"
//!     name = "example"
//!     title = "The whitened estimate beside the plain one"
//!     seed = 1
//!     trials = 40
//!     samples = [500]
//!     noise_percent = [10]
//!     [[gases]]
//!     name = "sine"
//!     gas = { kind = "sine", mean_c = 50.5, amplitude_k = 16.5, frequency_hz = 10.0, hold = "zero-order" }
//!     [[methods]]
//!     name = "whitened"
//!     estimator = "whitened"
//!     [[methods]]
//!     name = "plain"
//!     estimator = "cross-relation"
//!     "#,
//! )?;
//! let results = run(&Experiment::new(&plan)?, &Options::default(), |_| ControlFlow::Continue(()))?.into_results()?;
//! let table = Table::new(&plan, &results)?;
//! let bias = |row: usize| table.rows[row]["bias_percent"].as_f64().expect("a number");
//! assert!(bias(0).abs() < 10.0 && bias(2) > 10.0); // the plain cost is dragged to long time constants
//! # Ok::<(), twinlag_experiment::ExperimentError>(())
//! ```

mod error;
mod picture;
mod plan;
mod store;
mod summary;
mod table;
mod trial;

pub use error::ExperimentError;
pub use plan::{
    Bench, Cell, Drawn, Method, NamedGas, NoiseOf, OptimiserChoice, PictureSpec, Plan, Start, SummarySpec, Told,
};
pub use store::write;
pub use table::{Row, Table};
pub use trial::{Experiment, Own, Scratch};

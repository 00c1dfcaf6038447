//! The closed loop: finds the physical effects that a two-sensor model lacks, and measures how much
//! better the model is with them. Two first-order lags are seldom the whole truth of a measured
//! record. [`diagnose()`] examines the disagreement of the two gas temperatures that the sensors
//! imply, finds the effect in [`Identifier::ALL`] that explains it, adds it, repeats, and reports
//! errors before and after on blocks of the record that took no part in choosing or fitting; or it says
//! that nothing is missing, or that something is and no known effect accounts for it. [`fit_with`]
//! puts effects that are known already into the model, and [`fit_again_with`] begins with them.
//!
//! The crate takes readings, not files, and knows no file format: for logger files,
//! characterisations and reports take `twinlag`; for the two-lag model alone, and other costs,
//! `twinlag-cross-relation`; for sensor models `twinlag-sensor`.
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use twinlag_diagnose::{Identifier, Observations, Settings, Stretch, Verdict, diagnose};
//! use twinlag_signal::undeclared::{GasKind, Kind, undeclared};
//!
//! // A random rig in which one channel reads some kelvin off. Nobody says so.
//! let rig = undeclared(&[Kind::Offset], 1.0, Some(GasKind::Turbulence), 1)?;
//! let record = rig.simulate()?;
//! let period_s = record.time_s[1] - record.time_s[0];
//! let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
//! let observations = Observations::new(vec![stretch], Some(period_s))?;
//!
//! let watch = |_: &str, _, _| ControlFlow::Continue(());
//! let answer = diagnose(&observations, &Settings::default(), &watch)?;
//! assert_eq!(answer.verdict, Verdict::Explained);
//! assert_eq!(answer.effects[0].effect, Identifier::CALIBRATION);
//! let error = answer.error.held_out_normalised_rms;
//! assert!(error.after < 1.1 && error.after < error.before);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod accept;
mod alternatives;
mod candidates;
mod conclude;
mod contradiction;
mod diagnose;
mod diagnosis;
mod errors;
mod evidence;
mod excitation;
mod first_state;
mod grade;
mod hidden;
mod if_known;
mod joint;
mod judge;
mod left_over;
mod limits;
mod long;
mod moves;
mod naming;
mod noise;
mod odd_one;
mod other_delays;
mod own_in_each;
mod propagate;
mod rank;
mod rapid;
mod remark;
mod second_opinion;
mod size;
mod ties;
mod transfer;
mod twins;
mod whole_form;

pub use candidates::accepts;
pub use diagnose::diagnose;
pub use diagnosis::{BeforeAfter, Diagnosis, ErrorBudget, Found, Limit, Masked, Unexplained, Verdict};
pub use evidence::Evidence;
pub use excitation::{is_single_tone, is_single_tone_in};
pub use first_state::{FirstState, FirstStateChoice};
pub use grade::{Basis, Covered, Excess, Grade, Judgement, Number, Reason, RecordScatter, excess};
pub use hidden::{energy_across_missing, pieces_of_long, unseen};
pub use if_known::{Held, HeldEffect, IfKnown};
pub use joint::{Disagreement, JointDiagnosis, OfRecord, OwnNumber, diagnose_records};
pub use judge::{Circumstances, Judgements};
pub use limits::NEVER_TESTABLE;
pub use moves::Move;
pub use remark::Remark;
pub use ties::OtherCause;
pub use transfer::{EffectInChannel, LeftOut, Transfer};
pub use twinlag_model::{
    About, Change, ChangePoint, Contradicted, Extended, Identifier, Instants, KnownEffect, KnownFit, KnownTimeConstant,
    Line, ModelError, ModelFit, Observations, OwnValue, Policy, RatioTest, ResidualPart, Settings, Stretch,
    TimeConstant, Trace, Track, Value, Watch, evenly_spread, fit_again_with, fit_with, track,
};
pub use twins::ExactTwin;

/// A diagnosis may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(BeforeAfter<f64>, Diagnosis, ErrorBudget, Evidence, Found, Limit, Move, Remark)>();
    is_send_and_sync::<(Unexplained, Verdict)>();
};

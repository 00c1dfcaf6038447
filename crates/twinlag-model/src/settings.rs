//! What a diagnosis may assume.

use std::ops::ControlFlow;

use crate::effect::Identifier;
use crate::error::DiagnoseError;
use crate::model::KnownTimeConstant;
use crate::policy::Policy;

/// What a diagnosis may assume.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Noise of the channels, K; found from the data if left out.
    pub noise_std_k: Option<[f64; 2]>,
    /// What is known of the time constants.
    pub known: Vec<KnownTimeConstant>,
    /// Effects that may be named.
    pub effects: Vec<Identifier>,
    /// The numbers that decide what a user reads.
    pub policy: Policy,
}

impl Default for Settings {
    fn default() -> Self {
        Self { noise_std_k: None, known: Vec::new(), effects: Identifier::ALL.to_vec(), policy: Policy::default() }
    }
}

/// An effect as it was found in another record.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownEffect {
    /// The effect.
    pub effect: Identifier,
    /// Channel, 0 or 1; `None` if the effect is of both, or relative.
    pub channel: Option<usize>,
    /// Its parameters by name.
    pub parameters: Vec<(String, f64)>,
}

impl KnownEffect {
    /// The value of a parameter, by its name.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|(n, _)| n == name).map(|(_, value)| *value)
    }
}

/// Progress of a run: called with the task, how much of it is done, and of how much.
/// [`ControlFlow::Break`] cancels the run, which then returns [`DiagnoseError::Cancelled`].
pub type Watch<'a> = &'a (dyn Fn(&str, usize, usize) -> ControlFlow<()> + Sync);

/// Reports progress to `watch`.
///
/// # Errors
/// [`DiagnoseError::Cancelled`] if that is its answer.
pub fn report(watch: Watch<'_>, task: &str, done: usize, of: usize) -> Result<(), DiagnoseError> {
    match watch(task, done, of) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(DiagnoseError::Cancelled),
    }
}

//! What a diagnosis may assume.

use std::ops::ControlFlow;

use crate::effect::Identifier;
use crate::error::ModelError;
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

impl Settings {
    /// That noise levels and time constants are positive, the policy means something, and one time constant at least is
    /// left to find.
    ///
    /// # Errors
    /// [`ModelError::Setting`], [`ModelError::Policy`].
    pub fn check(&self) -> Result<(), ModelError> {
        let is_positive = |x: f64| x.is_finite() && x > 0.0;
        let wrong = |what, got| Err(ModelError::Setting { what, got });
        self.policy.check()?;
        if let Some(std_k) = self.noise_std_k.into_iter().flatten().find(|s| !is_positive(*s)) {
            return wrong("a noise level that is positive", std_k);
        }
        for known in &self.known {
            if known.sensor > 1 {
                return wrong("sensor 0 or 1", known.sensor as f64);
            }
            if let Some(value_s) = [known.value_s].into_iter().chain(known.std_s).find(|s| !is_positive(*s)) {
                return wrong("a time constant and a standard deviation that are positive", value_s);
            }
        }
        let is_held = |sensor: usize| self.known.iter().any(|k| k.sensor == sensor && k.std_s.is_none());
        if (0..2).all(is_held) {
            return wrong("at most one time constant that is held", 2.0);
        }
        Ok(())
    }
}

/// Progress of a run: called with the task, how much of it is done, and of how much.
/// [`ControlFlow::Break`] cancels the run, which then returns [`ModelError::Cancelled`] at its next step.
///
/// It is called from several threads at once, often, and while they wait: it should return soon.
pub type Watch<'a> = &'a (dyn Fn(&str, usize, usize) -> ControlFlow<()> + Sync);

/// Reports progress to `watch`.
///
/// ```
/// use std::ops::ControlFlow;
/// use std::sync::atomic::{AtomicUsize, Ordering};
/// use twinlag_model::{ModelError, report};
///
/// // A watch that cancels at its third call.
/// let calls = AtomicUsize::new(0);
/// let watch = |_: &str, _, _| match calls.fetch_add(1, Ordering::Relaxed) {
///     0 | 1 => ControlFlow::Continue(()),
///     _ => ControlFlow::Break(()),
/// };
/// let ends: Vec<_> = (0..3).map(|done| report(&watch, "work", done, 3)).collect();
/// assert_eq!(ends, [Ok(()), Ok(()), Err(ModelError::Cancelled)]);
/// ```
///
/// # Errors
/// [`ModelError::Cancelled`] if that is its answer.
pub fn report(watch: Watch<'_>, task: &str, done: usize, of: usize) -> Result<(), ModelError> {
    match watch(task, done, of) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(ModelError::Cancelled),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_that_mean_nothing_are_refused() {
        let known = |sensor, value_s, std_s| KnownTimeConstant { sensor, value_s, std_s };
        let refused = |settings: Settings| settings.check().is_err();
        assert!(!refused(Settings::default()));
        for std_k in [0.0, -0.1, f64::NAN, f64::INFINITY] {
            assert!(refused(Settings { noise_std_k: Some([0.1, std_k]), ..Settings::default() }), "{std_k}");
        }
        for one in [known(2, 1.0, None), known(0, 0.0, None), known(0, f64::NAN, None), known(1, 1.0, Some(0.0))] {
            assert!(refused(Settings { known: vec![one], ..Settings::default() }), "{one:?}");
        }
        let both = |std_s| vec![known(0, 1.0, None), known(1, 3.0, std_s)];
        assert!(refused(Settings { known: both(None), ..Settings::default() }));
        assert!(!refused(Settings { known: both(Some(0.2)), ..Settings::default() }));
    }
}

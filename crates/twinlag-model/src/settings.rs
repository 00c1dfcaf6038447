//! What a diagnosis may assume.

use crate::effect::Identifier;
use crate::model::KnownTimeConstant;

/// What a diagnosis may assume.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Noise of the channels, K; found from the data if left out.
    pub noise_std_k: Option<[f64; 2]>,
    /// What is known of the time constants.
    pub known: Vec<KnownTimeConstant>,
    /// Effects that may be named.
    pub effects: Vec<Identifier>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { noise_std_k: None, known: Vec::new(), effects: Identifier::ALL.to_vec() }
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

/// Progress callback: `(task, done, total)`.
pub type Watch<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

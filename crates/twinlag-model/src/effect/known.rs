//! An effect that is known beforehand.

use crate::effect::Identifier;

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
    ///
    /// ```
    /// use twinlag_model::{Identifier, KnownEffect};
    ///
    /// let parameters = vec![("gain".to_owned(), 1.02), ("offset".to_owned(), -0.4)];
    /// let known = KnownEffect { effect: Identifier::CALIBRATION, channel: Some(1), parameters };
    /// assert_eq!((known.parameter("offset"), known.parameter("curvature")), (Some(-0.4), None));
    /// ```
    pub fn parameter(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|(n, _)| n == name).map(|(_, value)| *value)
    }
}

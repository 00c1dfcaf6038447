//! Play, as of a bearing with slack: the output stays where it is until the input has moved away
//! from it by half the width, and is dragged along from there, `p ← max(T − w/2, min(T + w/2, p))`.
//! It starts at the input.
//!
//! It acts on the junction's temperature, between the lags and the calibration. The operator
//! depends on the extremes of its input only, and is stepped at every integration step: an extreme
//! between two of them is missed by less than `h² |T″|/8`.

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::not_negative;

/// Play (backlash) in the junction's temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Hysteresis {
    /// How far the temperature can go back without the reading following it, K; 0 is allowed.
    pub width_k: f64,
}

impl Hysteresis {
    /// Play of `width_k`.
    pub fn new(width_k: f64) -> Self {
        Self { width_k }
    }

    pub(crate) fn check(self, within: &str) -> Result<(), SignalError> {
        not_negative(within, "width_k", self.width_k)
    }
}

/// The operator with its memory; without hysteresis it lets everything through.
pub(crate) struct Play {
    half_width_k: Option<f64>,
    output_c: f64,
}

impl Play {
    pub(crate) fn new(hysteresis: Option<Hysteresis>, start_c: f64) -> Self {
        Self { half_width_k: hysteresis.map(|hysteresis| 0.5 * hysteresis.width_k), output_c: start_c }
    }

    /// The output for an input that follows the last one of [`Play::advance`], °C.
    pub(crate) fn output_c(&self, input_c: f64) -> f64 {
        match self.half_width_k {
            // Equations that have diverged must show it; and `clamp` panics there.
            Some(half_k) if input_c.is_finite() => self.output_c.clamp(input_c - half_k, input_c + half_k),
            _ => input_c,
        }
    }

    /// Moves on to the next input, °C.
    pub(crate) fn advance(&mut self, input_c: f64) {
        self.output_c = self.output_c(input_c);
    }
}

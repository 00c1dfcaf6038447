//! Effects that no record distinguishes, whatever the gas and however little noise.
//!
//! Two effects are exact twins where the difference of the inferred gas temperatures under one is, up to a factor, that under the
//! other with other time constants. With `L = 1 + τ s` of each sensor, a gain `g` of channel 2 over channel 1 has
//!
//! ```text
//! L₁ y₁ − L₂ y₂ / g
//! ```
//!
//! and a share `ε` of channel 1 in the reading of channel 2
//!
//! ```text
//! L₁ y₁ − L₂ (y₂ − ε y₁) = (L₁ + ε L₂) y₁ − L₂ y₂ = (1 + ε) [L₁' y₁ − L₂ y₂ / (1 + ε)],   τ₁' = (τ₁ + ε τ₂) / (1 + ε)
//! ```
//!
//! which is the gain `1 + ε` with `τ₁'` in place of `τ₁`; a share in channel 1 likewise. Noise of the readings goes the same ways, the
//! temperature at which a share adds nothing is an offset, and the factors of the discrete model are as linear in `τ`, so that
//! it is exact there too. `tests/twins.rs` goes through all pairs of effects whose numbers are those of a rig, in time constants that
//! are the same along the record: there are no other twins.

use super::Identifier;
use super::crosstalk::MAX_SHARE;

/// What a record would mean if an exact twin were the cause in place of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Twin {
    /// The twin.
    pub effect: Identifier,
    /// Its channel, 0 or 1.
    pub channel: usize,
    /// The name of its parameter: the share of a crosstalk, the gain of a calibration.
    pub parameter: &'static str,
    /// The value of that.
    pub value: f64,
    /// Time constants of both sensors with it, s.
    pub time_constants_s: [f64; 2],
}

impl Twin {
    /// A share of the other channel in the reading of `channel`.
    ///
    /// - `gain`: of channel 2 over channel 1
    /// - `tau_s`: time constants with that gain, s
    pub(crate) fn crosstalk(channel: usize, gain: f64, tau_s: [f64; 2]) -> Self {
        let share = of_channel(channel, gain) - 1.0;
        let mut time_constants_s = tau_s;
        time_constants_s[1 - channel] = (1.0 + share) * tau_s[1 - channel] - share * tau_s[channel];
        Self { effect: Identifier::CROSSTALK, channel, parameter: "share", value: share, time_constants_s }
    }

    /// Whether there can be such a rig: with positive time constants, and a share that is not most of a reading.
    pub(crate) fn is_possible(&self) -> bool {
        let is_small = self.effect != Identifier::CROSSTALK || self.value.abs() <= MAX_SHARE;
        is_small
            && self.value.is_finite()
            && self.time_constants_s.iter().all(|tau_s| tau_s.is_finite() && *tau_s > 0.0)
    }

    /// A gain of channel 2 over channel 1.
    ///
    /// - `share`: of the other channel in the reading of `channel`
    /// - `tau_s`: time constants with that share, s
    pub(crate) fn calibration(channel: usize, share: f64, tau_s: [f64; 2]) -> Self {
        let mut time_constants_s = tau_s;
        time_constants_s[1 - channel] = (tau_s[1 - channel] + share * tau_s[channel]) / (1.0 + share);
        let value = of_channel(channel, 1.0 + share);
        Self { effect: Identifier::CALIBRATION, channel: 1, parameter: "gain", value, time_constants_s }
    }
}

/// The gain of a channel over the other from that of channel 2 over channel 1, and back.
fn of_channel(channel: usize, gain: f64) -> f64 {
    if channel == 1 { gain } else { 1.0 / gain }
}

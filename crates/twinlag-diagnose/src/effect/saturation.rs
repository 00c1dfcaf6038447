//! A reading that stays at an end of its range: those samples say no more than that, and are masked.

use crate::effect::{About, Effect, Identifier, Parameter};
use crate::plant::Plant;

pub(crate) const ABOUT: About = About {
    name: "saturation",
    explanation: "one channel sticks at an end of its range: the amplifier or the converter is at its limit",
    advice: "widen the input range; the readings at the limit are left out of the fit",
    confusable: &[],
    unseen: "what the temperature was beyond the limit, except as the other sensor tells",
};

/// Readings at the limit, left out.
pub(crate) struct Saturation {
    pub(crate) channel: usize,
}

impl Effect for Saturation {
    fn identifier(&self) -> Identifier {
        Identifier::Saturation
    }

    fn channel(&self) -> Option<usize> {
        Some(self.channel)
    }

    fn parameters(&self) -> &[Parameter] {
        &[]
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    fn install(&self, _values: &[f64], _plant: &mut Plant) {}

    fn neutral(&self) -> Vec<(usize, f64)> {
        Vec::new()
    }
}

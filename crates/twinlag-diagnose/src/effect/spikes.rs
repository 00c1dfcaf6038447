//! Isolated wrong readings: found in the residual, and masked.

use crate::effect::{About, Effect, Identifier, Parameter};
use crate::plant::Plant;

pub(crate) const ABOUT: About = About {
    name: "spikes",
    explanation: "single readings of one channel are far off: a loose contact, interference, a transmission error",
    advice: "check contacts and shielding; those readings are left out of the fit",
    confusable: &[],
    unseen: "wrong readings no larger than a few times the noise",
};

/// Single readings, left out.
pub(crate) struct Spikes {
    pub(crate) channel: usize,
}

impl Effect for Spikes {
    fn identifier(&self) -> Identifier {
        Identifier::Spikes
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

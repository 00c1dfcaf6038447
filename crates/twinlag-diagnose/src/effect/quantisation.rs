//! A converter coarser than the noise: its steps are noise of `q/√12`, and the level is at least that.

use crate::effect::{About, Effect, Identifier, Parameter};
use crate::plant::Plant;

pub(crate) const ABOUT: About = About {
    name: "quantisation",
    explanation: "one channel is rounded to steps that are coarse beside its noise",
    advice: "use a finer converter or a smaller range; some noise before the converter helps, and averaging after it",
    confusable: &[],
    unseen: "changes smaller than a step that last shorter than the signal needs to cross one",
};

/// Rounding to coarse steps.
pub(crate) struct Quantisation {
    pub(crate) channel: usize,
}

impl Effect for Quantisation {
    fn identifier(&self) -> Identifier {
        Identifier::Quantisation
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

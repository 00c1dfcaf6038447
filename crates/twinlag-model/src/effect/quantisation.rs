//! A converter coarser than the noise: its steps are noise of `q/√12`, and the level is at least that.

use crate::effect::About;

pub const ABOUT: About = About {
    name: "quantisation",
    explanation: "one channel is rounded to steps that are coarse beside its noise",
    advice: "use a finer converter or a smaller range; some noise before the converter helps, and averaging after it",
    confusable: &[],
    unseen: "changes smaller than a step that last shorter than the signal needs to cross one",
};

//! Isolated wrong readings: found in the residual, and masked.

use crate::effect::About;

pub const ABOUT: About = About {
    name: "spikes",
    explanation: "single readings of one channel are far off: a loose contact, interference, a transmission error",
    advice: "check contacts and shielding; those readings are left out of the fit",
    confusable: &[],
    unseen: "wrong readings no larger than a few times the noise",
};

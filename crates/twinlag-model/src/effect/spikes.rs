//! Isolated wrong readings: found in the residual, and masked.

use crate::effect::About;

pub(crate) static ABOUT: About = About::defect("spikes", 2).in_words(
    "single readings of one channel are far off: a loose contact, interference, a transmission error",
    "check contacts and shielding; those readings are left out of the fit",
    "wrong readings no larger than a few times the noise",
);

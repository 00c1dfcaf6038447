//! A reading that stays at an end of its range: those samples say no more than that, and are masked.

use crate::effect::About;

pub(crate) static ABOUT: About = About::defect("saturation", 0).in_words(
    "one channel sticks at an end of its range: the amplifier or the converter is at its limit",
    "widen the input range; the readings at the limit are left out of the fit",
    "the temperature beyond the limit, except through the other sensor",
);

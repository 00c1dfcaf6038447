//! A converter coarser than the noise: its steps are noise of `q/√12`, and the level is at least that.

use crate::effect::About;

pub(crate) static ABOUT: About = About::defect("quantisation", 1).in_words(
    "one channel is rounded to steps that are coarse compared with its noise",
    "use a finer converter or a smaller range; some noise before the converter and averaging after it \
         also help",
    "changes smaller than a step that last shorter than the signal needs to cross one",
);

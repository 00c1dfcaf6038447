//! Which random stream serves what: one ChaCha stream per trial and purpose.
//!
//! Stream `8 · trial + purpose` of the rig's seed. Purposes: 0 gas, 1 and 2 noise of the first and
//! second channel, 3 the mismatch of the gas, 4 and 5 the contacts of the first and second channel;
//! 6 is kept free, so that a new purpose will move no existing number. 7 is no rig's: random rigs
//! are drawn from it. Trials are counted below 2⁶¹.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const PER_TRIAL: u64 = 8;

#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Gas = 0,
    FirstNoise = 1,
    SecondNoise = 2,
    Mismatch = 3,
    FirstContact = 4,
    SecondContact = 5,
    RandomRig = 7,
}

/// The stream for one purpose in one trial, at its start.
pub(crate) fn stream(seed: u64, trial: u64, purpose: Purpose) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(trial.wrapping_mul(PER_TRIAL) + purpose as u64);
    rng
}

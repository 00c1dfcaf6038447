//! Readings that a logger did not keep.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use twinlag::signal::Simulated;

/// How many readings are missing, and in which manner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Missing {
    /// Share of the readings of a channel that is missing.
    share: f64,
    /// Readings that are missing together, where no other such run begins among them.
    run: usize,
    /// Whether each channel loses readings of its own; otherwise both lack the same rows.
    #[serde(default)]
    each_its_own: bool,
}

impl Missing {
    /// The record without them. Runs begin at random, and the first reading and the last stay.
    pub(super) fn taken_from(&self, simulated: &mut Simulated, seed: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rows = simulated.t1_c.len();
        let mut is_missing = || {
            let mut out = vec![false; rows];
            for first in 1..rows - 1 {
                if rng.random_bool(self.share / self.run as f64) {
                    out[first..(first + self.run).min(rows - 1)].fill(true);
                }
            }
            out
        };
        let one = is_missing();
        let two = if self.each_its_own { is_missing() } else { one.clone() };
        for (values, is_missing) in [(&mut simulated.t1_c, one), (&mut simulated.t2_c, two)] {
            values.iter_mut().zip(is_missing).filter(|(_, is)| *is).for_each(|(y, _)| *y = f64::NAN);
        }
    }
}

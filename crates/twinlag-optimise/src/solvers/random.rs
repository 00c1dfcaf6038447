//! Random numbers for the global solvers: from a seed that is an option, so that the same options
//! give the same bytes.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};

/// The generator that argmin takes: it is of another generation of `rand` than the rest of the
/// workspace.
pub(crate) type Generator = Xoshiro256PlusPlus;

pub(crate) fn generator(seed: u64) -> Generator {
    Generator::seed_from_u64(seed)
}

/// Uniform in `[lower, upper]`.
pub(crate) fn between(lower: f64, upper: f64, generator: &mut Generator) -> f64 {
    // The upper 53 bits, which is what a double holds.
    let share = (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (lower + share * (upper - lower)).clamp(lower, upper)
}

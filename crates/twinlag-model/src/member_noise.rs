//! Noise levels of several records, each with its own where they differ.

use crate::between::BetweenRecords;
use crate::defects::{self, ChannelNoise};
use crate::observations::Observations;
use crate::policy::Policy;

/// The noise of each record's channels over `levels`, those of all, in the order of the records: 1 throughout in a channel whose
/// records agree, and in a record without levels of its own. Levels differ where a chi-square test of their logarithms says so.
pub(crate) fn factors(observations: &Observations, levels: &ChannelNoise, policy: &Policy) -> Vec<[f64; 2]> {
    let members = observations.members();
    let own: Vec<Option<ChannelNoise>> =
        members.iter().map(|member| defects::levels(&observations.of_member(member.number))).collect();
    let of_channel = |i: usize| -> Vec<f64> {
        let logs: Vec<Option<(f64, f64)>> =
            own.iter().map(|own| own.map(|own| (own.std_k[i].ln(), own.log_error[i]))).collect();
        let known: Vec<(f64, f64)> = logs.iter().flatten().copied().filter(|(_, error)| *error > 0.0).collect();
        if !differ(&known, policy.records_rejection_probability) {
            return vec![1.0; logs.len()];
        }
        logs.iter().map(|log| log.map_or(1.0, |(log, _)| log.exp() / levels.std_k[i])).collect()
    };
    let [one, two] = [0, 1].map(of_channel);
    one.into_iter().zip(two).map(|(a, b)| [a, b]).collect()
}

/// Whether values with standard errors differ by more than these explain.
fn differ(values: &[(f64, f64)], probability: f64) -> bool {
    let values: Vec<(usize, f64, f64)> =
        values.iter().enumerate().map(|(i, (value, error))| (i, *value, *error)).collect();
    BetweenRecords::of(&values).is_some_and(|between| between.p_value < probability)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three values with errors of 0.1: a spread of 0.1 is chance, one of 1.0 is 100 in chi-square of two degrees of freedom.
    #[test]
    fn levels_differ_beyond_their_errors() {
        let of = |step: f64| differ(&[(0.0, 0.1), (step, 0.1), (-step, 0.1)], 1e-3);
        assert!(!of(0.1) && of(1.0));
        assert!(!differ(&[(3.0, 0.1)], 1e-3) && !differ(&[], 1e-3));
    }
}

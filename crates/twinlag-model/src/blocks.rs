//! Blocks along a record: which of its samples judge, and which are left out in turn.

use crate::policy::Policy;

/// Whether a sample of `samples` lies in a block that judges: the middle one of every
/// [`Policy::judging_every_blocks`].
pub(crate) fn is_judge(sample: usize, samples: usize, policy: &Policy) -> bool {
    let every = policy.judging_every_blocks;
    (sample * policy.judging_blocks / samples.max(1)) % every == every / 2
}

/// First samples after each block that judges, and after what borders on it.
pub(crate) fn after_judges(samples: usize, policy: &Policy) -> impl Iterator<Item = usize> {
    let (blocks, every) = (policy.judging_blocks, policy.judging_every_blocks);
    let gap = policy.block_gap_most_samples;
    (0..blocks).step_by(every).map(move |block| (block + every / 2 + 1) * samples / blocks + gap)
}

/// The group that a sample is left out with: block `b` together with `b + folds`, `b + 2 folds`, …
pub(crate) fn fold(sample: usize, samples: usize, policy: &Policy) -> usize {
    sample * policy.held_out_blocks / samples.max(1) % policy.held_out_folds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eighth_judges_and_what_follows_does_not() {
        let (samples, policy) = (16_000, Policy::default());
        let judges = |sample| is_judge(sample, samples, &policy);
        assert_eq!((0..samples).filter(|s| judges(*s)).count(), samples / 8);
        let starts: Vec<usize> = after_judges(samples, &policy).collect();
        assert_eq!(starts.len(), 10);
        let gap = policy.block_gap_samples(samples, policy.judging_blocks);
        assert!(starts.iter().all(|s| !judges(*s) && !judges(s - gap) && judges(s - gap - 1)), "{starts:?}");
    }

    #[test]
    fn every_fold_has_as_many() {
        let (samples, policy) = (4000, Policy::default());
        for k in 0..policy.held_out_folds {
            assert_eq!((0..samples).filter(|s| fold(*s, samples, &policy) == k).count(), samples / 5);
        }
    }
}

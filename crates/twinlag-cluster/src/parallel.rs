//! GNU parallel, on this machine or on those of its option `--sshloginfile`.

use twinlag_study::ranges;

/// The commands that run these shards, and the merge behind them. What `parallel` is given it hands to a shell once more, unless it is
/// to quote it.
///
/// - `shard`, `merge`: the scripts, as a shell takes them
pub(crate) fn commands(shard: &str, merge: &str, shards: &[u64]) -> Vec<String> {
    let ranges = ranges(shards);
    let numbers = ranges.split(',').map(|range| match range.split_once('-') {
        Some((first, last)) => format!("seq {first} {last}"),
        None => format!("echo {range}"),
    });
    let numbers = numbers.collect::<Vec<_>>().join("; ");
    vec![format!("{{ {numbers}; }} | parallel --jobs 1 --quote sh {shard}; sh {merge}")]
}

//! GNU parallel, on this machine or on those of its option `--sshloginfile`.

use twinlag_study::ranges;

use crate::error::ClusterError;
use crate::script;
use crate::work::Resources;

/// The line that runs these shards, and the merge behind them. As many run at once as a machine has processors for. What `parallel` is
/// given it hands to a shell once more, unless it is to quote it.
///
/// - `shard`, `merge`: the scripts, as a shell takes them
pub(crate) fn command(
    resources: &Resources,
    shards: &[u64],
    [shard, merge]: [&str; 2],
) -> Result<String, ClusterError> {
    if shards.is_empty() {
        return Ok(format!("sh {merge}"));
    }
    let Resources { time_min, cpus, options, .. } = resources;
    let ranges = ranges(shards);
    let numbers = ranges.split(',').map(|range| match range.split_once('-') {
        Some((first, last)) => format!("seq {first} {last}"),
        None => format!("echo {range}"),
    });
    let numbers = numbers.collect::<Vec<_>>().join("; ");
    let own = [format!("--jobs={}%", (100 / *cpus).max(1)), format!("--timeout={}", 60 * u64::from(time_min.get()))];
    let options = script::command(&own.into_iter().chain(options.iter().cloned()).collect::<Vec<_>>())?;
    Ok(format!("{{ {numbers}; }} | parallel {options} --quote sh {shard}; sh {merge}"))
}

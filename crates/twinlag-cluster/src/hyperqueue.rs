//! `HyperQueue`: each shard a task, and the merge a task behind all of them.
//!
//! Its server is asked through its package for Python, which needs no other program. The server has to be running, with workers.

use twinlag_study::ranges;

use crate::error::ClusterError;
use crate::submission::answer;
use crate::work::{Resources, Work};

/// The name of the script.
pub(crate) const FILE: &str = "submit.py";

/// The script that submits.
pub(crate) const SCRIPT: &str = include_str!("submit.py");

/// The command that submits shards.
pub(crate) fn command(script: &str, work: &Work, resources: &Resources, shards: &[u64]) -> Vec<String> {
    let Resources { time_min, cpus, options, .. } = resources;
    let own = [
        "python3".to_owned(),
        script.to_owned(),
        format!("--name={}", work.name),
        format!("--shards={}", ranges(shards)),
        format!("--cpus={cpus}"),
        format!("--time={time_min}"),
    ];
    own.into_iter().chain(options.iter().cloned()).collect()
}

/// Submits shards; the number of the job.
pub(crate) fn submit(script: &str, work: &Work, resources: &Resources, shards: &[u64]) -> Result<String, ClusterError> {
    answer("python3", &command(script, work, resources, shards)[1..]).map_err(|error| match error {
        // Before that stand the steps that led there.
        ClusterError::Refused { program, said } => {
            ClusterError::Refused { program, said: said.lines().last().unwrap_or_default().to_owned() }
        }
        other => other,
    })
}

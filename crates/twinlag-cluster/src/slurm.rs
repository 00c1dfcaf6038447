//! Slurm: the shards as an array of jobs, and the merge as a job behind it.
//!
//! The merge depends on the end of the array (`afterany`), not on its success: `afterok` is never met once a task has failed and was
//! requeued, though it succeeded then. What is missing the merge says itself.

use std::collections::BTreeMap;

use twinlag_study::ranges;

use crate::engine::State;
use crate::error::ClusterError;
use crate::submission::{Job, answer};
use crate::work::{Resources, Work};

const SBATCH: &str = "sbatch";

/// What the merge may take, min; chosen, far above what writing a table takes.
const MERGE_TIME_MIN: u32 = 60;

fn lines(options: impl IntoIterator<Item = String>) -> Vec<String> {
    options.into_iter().map(|option| format!("#SBATCH {option}")).collect()
}

/// The lines of the script of a shard. What it says goes into the logs of the script itself.
pub(crate) fn directives(work: &Work, resources: &Resources) -> Vec<String> {
    let Resources { time_min, cpus, memory, options } = resources;
    let own = [
        format!("--job-name={}", name(work)),
        "--requeue".to_owned(),
        format!("--time={time_min}"),
        format!("--cpus-per-task={cpus}"),
        "--output=/dev/null".to_owned(),
    ];
    let memory = memory.iter().map(|memory| format!("--mem={memory}"));
    lines(own.into_iter().chain(memory).chain(options.iter().cloned()))
}

/// The lines of the script that joins the parts.
pub(crate) fn merge_directives(work: &Work, resources: &Resources) -> Vec<String> {
    let own = [
        format!("--job-name={}-merge", name(work)),
        "--no-requeue".to_owned(),
        format!("--time={MERGE_TIME_MIN}"),
        "--cpus-per-task=1".to_owned(),
        "--output=/dev/null".to_owned(),
    ];
    let memory = resources.memory.iter().map(|memory| format!("--mem={memory}"));
    lines(own.into_iter().chain(memory).chain(resources.options.iter().cloned()))
}

/// The name of the work, in characters that need no quotes.
fn name(work: &Work) -> String {
    work.name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}

/// The command that submits an array of shards.
pub(crate) fn array(shards: &[u64], script: &str) -> Vec<String> {
    submitting(["--array".to_owned(), ranges(shards), script.to_owned()])
}

/// The command that submits the merge behind the job of the shards.
pub(crate) fn behind(job: &str, script: &str) -> Vec<String> {
    submitting([format!("--dependency=afterany:{job}"), script.to_owned()])
}

/// The command that submits, and prints the number of the job alone.
fn submitting(arguments: impl IntoIterator<Item = String>) -> Vec<String> {
    [SBATCH, "--parsable"].map(str::to_owned).into_iter().chain(arguments).collect()
}

/// Submits shards; the number of their job.
pub(crate) fn submit_shards(shards: &[u64], script: &str) -> Result<String, ClusterError> {
    submit(&array(shards, script))
}

/// Submits the merge behind the job of the shards; the number of its own.
pub(crate) fn submit_merge(script: &str, job: &str) -> Result<String, ClusterError> {
    submit(&behind(job, script))
}

/// The number of a job, which is on the last line; in a federation the name of the cluster stands behind it.
fn submit(command: &[String]) -> Result<String, ClusterError> {
    let said = answer(SBATCH, &command[1..])?;
    let number = said.lines().last().unwrap_or_default().split(';').next().unwrap_or_default().trim();
    let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    if is_number { Ok(number.to_owned()) } else { Err(ClusterError::Refused { program: SBATCH, said }) }
}

/// The shards of these jobs that are in the queue.
pub(crate) fn states(jobs: &[Job]) -> Result<BTreeMap<u64, State>, ClusterError> {
    let arguments = ["--noheader", "--array", "--me", "--format=%F %K %T"].map(str::to_owned);
    Ok(states_in(&answer("squeue", &arguments)?, jobs))
}

/// - `listed`: a line for each task: number of the job, of the task, state
fn states_in(listed: &str, jobs: &[Job]) -> BTreeMap<u64, State> {
    let of_line = |line: &str| {
        let mut words = line.split_whitespace();
        let (id, shard, state) = (words.next()?, words.next()?.parse().ok()?, words.next()?);
        let state = match state {
            "RUNNING" | "COMPLETING" | "STAGE_OUT" | "SIGNALING" => State::Running,
            "PENDING" | "CONFIGURING" | "REQUEUED" | "REQUEUE_FED" | "REQUEUE_HOLD" | "SPECIAL_EXIT" | "SUSPENDED"
            | "STOPPED" | "RESV_DEL_HOLD" | "RESIZING" => State::Waiting,
            _ => return None,
        };
        jobs.iter().any(|job| job.id == id).then_some((shard, state))
    };
    let mut states = BTreeMap::new();
    for (shard, state) in listed.lines().filter_map(of_line) {
        let known = states.entry(shard).or_insert(state);
        *known = state.max(*known);
    }
    states
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As Slurm 22.05 prints it, of two arrays of ours, a merge, and a job of somebody else's.
    #[test]
    fn shards_in_the_queue_are_told_from_other_jobs() {
        let listed = "12 3 PENDING\n12 0 RUNNING\n12 1 COMPLETED\n13 N/A PENDING\n14 3 RUNNING\n99 5 RUNNING\n";
        let job = |id: &str| Job { id: id.to_owned(), merge_id: None, shards: String::new() };
        let states = states_in(listed, &[job("12"), job("14")]);
        assert_eq!(states, BTreeMap::from([(0, State::Running), (3, State::Running)]));
    }
}

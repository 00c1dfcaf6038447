//! Slurm: the shards as an array of jobs, and the merge as a job behind it.
//!
//! The merge depends on the end of the array (`afterany`), not on its success: `afterok` is never met once a task has failed and was
//! requeued, though it succeeded then. What is missing the merge says itself.

use std::collections::BTreeSet;

use twinlag_study::ranges;

use crate::engine::{Queue, State};
use crate::error::ClusterError;
use crate::script;
use crate::submission::{Job, answer};
use crate::work::{Resources, Work};

const SBATCH: &str = "sbatch";

/// What the merge may take, min; chosen, far above what writing a table takes.
const MERGE_TIME_MIN: u32 = 60;

fn lines<const N: usize>(options: [String; N]) -> Vec<String> {
    options.into_iter().map(|option| format!("#SBATCH {option}")).collect()
}

/// The lines of the script of a shard. What it says goes into the logs of the script itself.
pub(crate) fn directives(work: &Work, resources: &Resources) -> Vec<String> {
    let Resources { time_min, cpus, .. } = resources;
    lines([
        format!("--job-name={}", name(work)),
        "--requeue".to_owned(),
        format!("--time={time_min}"),
        format!("--cpus-per-task={cpus}"),
        "--output=/dev/null".to_owned(),
    ])
}

/// The lines of the script that joins the parts.
pub(crate) fn merge_directives(work: &Work) -> Vec<String> {
    lines([
        format!("--job-name={}-merge", name(work)),
        "--no-requeue".to_owned(),
        format!("--time={MERGE_TIME_MIN}"),
        "--cpus-per-task=1".to_owned(),
        "--output=/dev/null".to_owned(),
    ])
}

/// The name of the work, in characters that need no quotes.
fn name(work: &Work) -> String {
    work.name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}

/// The command that submits a script, and prints the number of the job alone. What the user has chosen is among its arguments: there it
/// needs no quotes of Slurm's own, and goes before what is in the script.
fn sbatch(resources: &Resources, own: impl IntoIterator<Item = String>, script: &str) -> Vec<String> {
    let memory = resources.memory.iter().map(|memory| format!("--mem={memory}"));
    let first = [SBATCH, "--parsable"].map(str::to_owned);
    first
        .into_iter()
        .chain(memory)
        .chain(resources.options.iter().cloned())
        .chain(own)
        .chain([script.to_owned()])
        .collect()
}

fn array(resources: &Resources, shards: &[u64], script: &str) -> Vec<String> {
    sbatch(resources, [format!("--array={}", ranges(shards))], script)
}

/// The commands that submit shards and the merge behind them, as one line of a shell.
///
/// - `shard`, `join`: the scripts
pub(crate) fn command(resources: &Resources, shards: &[u64], [shard, join]: [&str; 2]) -> Result<String, ClusterError> {
    if shards.is_empty() {
        return script::command(&sbatch(resources, [], join));
    }
    let array = script::command(&array(resources, shards, shard))?;
    let [first, rest @ ..] = &sbatch(resources, [], join)[..] else { unreachable!("it has a first word") };
    Ok(format!("job=$({array}) && {first} \"--dependency=afterany:${{job%%;*}}\" {}", script::command(rest)?))
}

/// Submits shards.
pub(crate) fn submit_shards(resources: &Resources, shards: &[u64], script: &str) -> Result<Taken, ClusterError> {
    Taken::by(&array(resources, shards, script))
}

/// Submits the merge.
///
/// - `behind`: the jobs that it waits for
/// - `cluster`: where they are, whichever of several clusters has taken them
pub(crate) fn submit_merge(
    resources: &Resources,
    behind: &[String],
    cluster: Option<&str>,
    script: &str,
) -> Result<Taken, ClusterError> {
    let dependency = (!behind.is_empty()).then(|| format!("--dependency=afterany:{}", behind.join(":")));
    let cluster = cluster.map(|cluster| format!("--clusters={cluster}"));
    Taken::by(&sbatch(resources, dependency.into_iter().chain(cluster), script))
}

/// What Slurm has taken.
pub(crate) struct Taken {
    pub(crate) id: String,
    /// The cluster of a federation.
    pub(crate) cluster: Option<String>,
}

impl Taken {
    fn by(command: &[String]) -> Result<Self, ClusterError> {
        let said = answer(SBATCH, &command[1..])?;
        Self::of(&said).ok_or(ClusterError::Refused { program: SBATCH, said })
    }

    /// The number of a job, which is on the last line; the name of the cluster may stand behind it.
    fn of(said: &str) -> Option<Self> {
        let last = said.lines().last()?.trim();
        let (id, cluster) = last.split_once(';').map_or((last, None), |(id, cluster)| (id, Some(cluster.to_owned())));
        let is_number = !id.is_empty() && id.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then(|| Self { id: id.to_owned(), cluster })
    }
}

/// What of these jobs is in the queue.
pub(crate) fn queue(jobs: &[Job]) -> Result<Queue, ClusterError> {
    let clusters: BTreeSet<Option<&String>> = jobs.iter().map(|job| job.cluster.as_ref()).collect();
    let mut listed = String::new();
    for cluster in clusters {
        let mut arguments = ["--noheader", "--array", "--me", "--format=%F %K %T"].map(str::to_owned).to_vec();
        arguments.extend(cluster.map(|cluster| format!("--clusters={cluster}")));
        listed += &(answer("squeue", &arguments)? + "\n");
    }
    Ok(queue_in(&listed, jobs))
}

/// - `listed`: a line for each task: number of the job, of the task, state
fn queue_in(listed: &str, jobs: &[Job]) -> Queue {
    let mut queue = Queue::default();
    for line in listed.lines() {
        let mut words = line.split_whitespace();
        let (Some(id), Some(task), Some(state)) = (words.next(), words.next(), words.next().and_then(state)) else {
            continue;
        };
        let is = |other: &Option<String>| other.as_deref() == Some(id);
        if let (true, Ok(shard)) = (jobs.iter().any(|job| is(&job.id)), task.parse()) {
            let known = queue.shards.entry(shard).or_insert(state);
            *known = state.max(*known);
            queue.jobs.insert(id.to_owned());
        } else if jobs.iter().any(|job| is(&job.merge_id)) {
            queue.merge = queue.merge.max(Some(state));
        }
    }
    queue
}

/// What Slurm calls a state; `None` of what has ended.
fn state(name: &str) -> Option<State> {
    match name {
        "RUNNING" | "COMPLETING" | "STAGE_OUT" | "SIGNALING" => Some(State::Running),
        "PENDING" | "CONFIGURING" | "REQUEUED" | "REQUEUE_FED" | "REQUEUE_HOLD" | "SPECIAL_EXIT" | "SUSPENDED"
        | "STOPPED" | "RESV_DEL_HOLD" | "RESIZING" => Some(State::Waiting),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// As Slurm 22.05 prints it, of two arrays of ours, a merge, and a job of somebody else's.
    #[test]
    fn shards_in_the_queue_are_told_from_other_jobs() {
        let listed = "12 3 PENDING\n12 0 RUNNING\n12 1 COMPLETED\n13 N/A PENDING\n14 3 RUNNING\n99 5 RUNNING\n";
        let job =
            |id: &str, merge: &str| Job { id: Some(id.to_owned()), merge_id: Some(merge.to_owned()), ..Job::default() };
        let queue = queue_in(listed, &[job("12", "13"), job("14", "15")]);
        assert_eq!(queue.shards, BTreeMap::from([(0, State::Running), (3, State::Running)]));
        assert_eq!(queue.merge, Some(State::Waiting));
        assert_eq!(queue.jobs.into_iter().collect::<Vec<_>>(), ["12", "14"]);
    }

    #[test]
    fn the_cluster_of_a_federation_stands_behind_the_number() {
        let taken = Taken::of("sbatch: a note\n12;far").expect("a number");
        assert_eq!((taken.id.as_str(), taken.cluster.as_deref()), ("12", Some("far")));
        assert!(Taken::of("Submitted batch job 12").is_none() && Taken::of("").is_none());
    }
}

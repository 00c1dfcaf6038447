//! The scripts of a shard and of the merge, for a shell of POSIX.

use std::path::Path;

use crate::error::ClusterError;
use crate::work::Work;

/// The name of the script of a shard.
pub(crate) const SHARD: &str = "shard.sh";
/// The name of the script that joins the parts.
pub(crate) const MERGE: &str = "merge.sh";
/// The folder of what the commands say.
pub(crate) const LOGS: &str = "logs";
/// The exit code of what is to be tried again.
const AGAIN: u8 = 75;

/// A word as a shell takes it.
pub(crate) fn quoted(word: &str) -> Result<String, ClusterError> {
    let quoted = shlex::try_quote(word).map_err(|_| ClusterError::NoText { text: word.to_owned() })?;
    Ok(quoted.into_owned())
}

/// Words as a shell takes them.
pub(crate) fn command(words: &[String]) -> Result<String, ClusterError> {
    Ok(words.iter().map(|word| quoted(word)).collect::<Result<Vec<_>, _>>()?.join(" "))
}

/// A path as text.
pub(crate) fn text(path: &Path) -> Result<&str, ClusterError> {
    path.to_str().ok_or_else(|| ClusterError::NoText { text: path.to_string_lossy().into_owned() })
}

/// What runs the program with arguments that a shell takes.
fn program(arguments: &str) -> String {
    format!("\"${{TWINLAG:-$program}}\" {arguments}")
}

/// The name of the log of a shard.
pub(crate) fn log_of(shard: impl std::fmt::Display) -> String {
    format!("shard-{shard}.log")
}

/// The beginning of each script.
///
/// - `about`: what the script does
/// - `directives`: lines for the engine
/// - `first`: commands before all others
/// - `logs`, `log`: a folder, and the file in it of what the commands say
fn head(
    work: &Work,
    about: &str,
    directives: &[String],
    first: &str,
    [logs, log]: [&str; 2],
) -> Result<String, ClusterError> {
    let directives: String = directives.iter().flat_map(|line| [line, "\n"]).collect();
    let (program, folder, logs) = (quoted(text(&work.program)?)?, quoted(text(&work.folder)?)?, quoted(logs)?);
    Ok(format!(
        "#!/bin/sh\n{directives}# {about}\n{first}set -eu\nprogram={program}\nlogs={logs}\nexec >> \"$logs/{log}\" 2>&1\ncd {folder}\n"
    ))
}

/// The script of a shard: of that which is its first argument, or the task of an array.
pub(crate) fn shard(work: &Work, directives: &[String], logs: &str) -> Result<String, ClusterError> {
    let shards = work.shards;
    let about = format!("One shard of {shards}, counted from 0: the first argument, or the task of an array.");
    let first = "shard=\"${1:-${SLURM_ARRAY_TASK_ID:-${JOB_COMPLETION_INDEX:?expected the number of a shard}}}\"\n";
    let head = head(work, &about, directives, first, [logs, &log_of("$shard")])?;
    Ok(format!("{head}exec {}\n", program(&arguments_of(work, "$shard")?)))
}

/// The arguments of a shard, as a shell takes them.
///
/// - `shard`: what a shell takes for its index
fn arguments_of(work: &Work, shard: &str) -> Result<String, ClusterError> {
    let place = work.shard.iter().position(|word| word == Work::SHARD).ok_or(ClusterError::NoShard)?;
    let (before, behind) = (&work.shard[..place], &work.shard[place + 1..]);
    let words = [command(before)?, format!("\"{shard}/{}\"", work.shards), command(behind)?];
    Ok(words.into_iter().filter(|words| !words.is_empty()).collect::<Vec<_>>().join(" "))
}

/// The line that runs a shard whose index is in the variable of an indexed job.
pub(crate) fn line_of_shard(work: &Work) -> Result<String, ClusterError> {
    Ok(format!("exec \"${{TWINLAG:-twinlag}}\" {}", arguments_of(work, "$JOB_COMPLETION_INDEX")?))
}

/// The script that joins the parts. Where one is missing it ends with 1, not with [`AGAIN`]: waiting does not bring the part.
pub(crate) fn merge(work: &Work, directives: &[String], logs: &str) -> Result<String, ClusterError> {
    let head = head(work, "Joins the parts of all shards.", directives, "", [logs, "merge.log"])?;
    let command = program(&command(&work.merge)?);
    Ok(format!("{head}{command} || {{ code=$?; [ $code -ne {AGAIN} ] || code=1; exit $code; }}\n"))
}

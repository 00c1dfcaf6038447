//! Kubernetes: an indexed job, whose image, and volume or secret, are to be filled in.

use sha2::{Digest as _, Sha256};

use crate::error::ClusterError;
use crate::script;
use crate::work::{Resources, Work};

/// The name of the file.
pub(crate) const FILE: &str = "job.yaml";

/// Most characters of the name of a job: the index of a shard stands behind it, and both have to fit into 63.
const MAX_NAME: usize = 48;
/// Digits by which jobs of one name differ.
const HASH_DIGITS: usize = 8;
/// What is to be filled in.
const IMAGE: &str = "image: IMAGE ";
/// The line that gives a container the variables of the object store.
const SECRET: &str =
    "          envFrom: [{secretRef: {name: SECRET}}] # to be filled in: one with the variables of the object store\n";
/// The volume that all pods share.
const VOLUMES: &str = "      volumes:
        - name: shared
          persistentVolumeClaim: {claimName: CLAIM} # to be filled in: one that has the folder and all records, and that many pods may write to
";
/// What stands before the limit of time.
const LIMIT: &str = "activeDeadlineSeconds: ";

/// The name of the job: a letter, then letters, digits and hyphens. It ends with digits of the folder of its scripts, so that studies of
/// one name have different jobs.
fn name(work: &Work, script: &str) -> String {
    let name = work.name.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
    let name: String = format!("twinlag-{name}").chars().take(MAX_NAME - HASH_DIGITS - 1).collect();
    let hash = base16ct::lower::encode_string(&Sha256::digest(script));
    format!("{}-{}", name.trim_end_matches('-'), &hash[..HASH_DIGITS])
}

/// Whether somebody has filled in what is to be filled in.
pub(crate) fn is_filled_in(job: &str) -> bool {
    !job.contains(IMAGE)
}

fn seconds(resources: &Resources) -> u64 {
    60 * u64::from(resources.time_min.get())
}

/// A job with another limit of time, and everything else as it is.
pub(crate) fn with_limit(job: &str, resources: &Resources) -> String {
    let line = |line: &str| match line.split_once(LIMIT) {
        Some((indent, _)) => format!("{indent}{LIMIT}{}\n", seconds(resources)),
        None => format!("{line}\n"),
    };
    job.lines().map(line).collect()
}

/// Text in quotes: what JSON takes, YAML takes.
fn in_quotes(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// The job. All shards are in it: those that are done end at once.
///
/// - `shard`: the script of a shard, whole path
pub(crate) fn job(work: &Work, resources: &Resources, shard: &str) -> Result<String, ClusterError> {
    let (shards, seconds) = (work.shards, seconds(resources));
    let memory = resources.memory.as_ref().map_or(String::new(), |memory| format!(", memory: {}", in_quotes(memory)));
    let each = format!("{{cpu: \"{}\"{memory}}}", resources.cpus);
    let name = in_quotes(&name(work, shard));
    let secret = if work.storage.has_objects() { SECRET } else { "" };
    let (command, mounts, volumes) = if work.storage.has_folders() {
        let folder = in_quotes(script::text(&work.folder)?);
        let mounts = format!("          volumeMounts: [{{name: shared, mountPath: {folder}}}]\n");
        (format!("[sh, {}]", in_quotes(shard)), mounts, VOLUMES)
    } else {
        (format!("[sh, -c, {}]", in_quotes(&script::line_of_shard(work)?)), String::new(), "")
    };
    Ok(format!(
        "apiVersion: batch/v1
kind: Job
metadata:
  name: {name}
spec:
  completionMode: Indexed
  completions: {shards}
  parallelism: {shards} # at once, at most
  backoffLimitPerIndex: 5
  maxFailedIndexes: {shards}
  podReplacementPolicy: Failed
  template:
    spec:
      restartPolicy: Never
      {LIMIT}{seconds}
      containers:
        - name: shard
          {IMAGE}# to be filled in: one that has the program, at the place that TWINLAG names
          env: [{{name: TWINLAG, value: twinlag}}]
{secret}          command: {command}
          resources: {{requests: {each}, limits: {each}}}
{mounts}{volumes}"
    ))
}

/// The line that starts it, in place of an earlier one, and the merge behind it.
///
/// - `file`, `merge`: as a shell takes them
pub(crate) fn command(shards: &[u64], [file, merge]: [&str; 2]) -> String {
    if shards.is_empty() {
        return format!("sh {merge}");
    }
    // A job that has ended is complete, or failed if a shard is: whichever it is, the merge says what is missing.
    let ended = |how: &str| format!("kubectl wait --for=condition={how} --timeout=10s --filename {file}");
    format!(
        "kubectl delete --ignore-not-found --filename {file} && kubectl apply --filename {file} && \
         until {} || {}; do :; done; sh {merge}",
        ended("complete"),
        ended("failed")
    )
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU64;

    use super::*;
    use crate::work::Storage;

    fn work(name: &str) -> Work {
        let (shard, merge) = (vec!["a b".to_owned(), Work::SHARD.to_owned()], Vec::new());
        let (program, folder) = ("/bin/true".into(), "/a \"b\"".into());
        Work {
            name: name.to_owned(),
            folder,
            storage: Storage::Folders,
            program,
            shard,
            merge,
            shards: NonZeroU64::MIN,
        }
    }

    #[test]
    fn names_are_of_one_submission() {
        let long = "A long, long name of a study - with signs in it, and longer than all that fits";
        for text in ["", "ü", long] {
            let name = name(&work(text), "/a/shard.sh");
            assert!(name.len() <= MAX_NAME && name.starts_with("twinlag-"), "{name}");
            assert!(
                name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-'),
                "{name}"
            );
        }
        assert_ne!(name(&work("bias"), "/a/shard.sh"), name(&work("bias"), "/b/shard.sh"));
    }

    #[test]
    fn a_job_has_what_its_shards_read_and_write() {
        let job = |storage| {
            let work = Work { storage, ..work("bias") };
            job(&work, &Resources::of_minutes(5), "/a/shard.sh").expect("text")
        };
        let has = |job: &str| ["volume", "secretRef"].map(|text| job.contains(text));
        assert_eq!(has(&job(Storage::Folders)), [true, false]);
        assert_eq!(has(&job(Storage::FoldersAndObjects)), [true, true]);
        let objects = job(Storage::Objects);
        assert_eq!(has(&objects), [false, true]);
        let command = r#"[sh, -c, "exec \"${TWINLAG:-twinlag}\" 'a b' \"$JOB_COMPLETION_INDEX/1\""]"#;
        assert!(objects.contains(command), "{objects}");
    }

    #[test]
    fn what_was_filled_in_stays() {
        let job = job(&work("bias"), &Resources::of_minutes(5), "/a/shard.sh").expect("text");
        assert!(!is_filled_in(&job) && job.contains(r#"mountPath: "/a \"b\"""#), "{job}");
        let filled = job.replace("IMAGE", "registry/ours:1");
        assert!(is_filled_in(&filled));
        let later = with_limit(&filled, &Resources::of_minutes(7));
        assert_eq!(later, filled.replace("activeDeadlineSeconds: 300", "activeDeadlineSeconds: 420"));
    }
}

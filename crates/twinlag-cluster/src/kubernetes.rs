//! Kubernetes: an indexed job, whose image and volume are to be filled in.

use crate::error::ClusterError;
use crate::script;
use crate::work::{Resources, Work};

/// The name of the file.
pub(crate) const FILE: &str = "job.yaml";

/// Most characters of the name of a job: the index of a shard stands behind it, and both have to fit into 63.
const MAX_NAME: usize = 48;

/// The name of the job: a letter, then letters, digits and hyphens.
fn name(work: &Work) -> String {
    let name = work.name.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
    let name: String = format!("twinlag-{name}").chars().take(MAX_NAME).collect();
    name.trim_end_matches('-').to_owned()
}

/// Text in quotes: what JSON takes, YAML takes.
fn in_quotes(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// The job. All shards are in it: those that are done end at once.
///
/// - `script`: the script of a shard, whole path
pub(crate) fn job(work: &Work, resources: &Resources, shard: &str) -> Result<String, ClusterError> {
    let (shards, seconds) = (work.shards, 60 * u64::from(resources.time_min.get()));
    let memory = resources.memory.as_ref().map_or(String::new(), |memory| format!(", memory: {}", in_quotes(memory)));
    let each = format!("{{cpu: \"{}\"{memory}}}", resources.cpus);
    let [name, shard, folder] = [&name(work), shard, script::text(&work.folder)?].map(in_quotes);
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
      activeDeadlineSeconds: {seconds}
      containers:
        - name: shard
          image: IMAGE # to be filled in: one that has the program, at the place that TWINLAG names
          env: [{{name: TWINLAG, value: twinlag}}]
          command: [sh, {shard}]
          resources: {{requests: {each}, limits: {each}}}
          volumeMounts: [{{name: shared, mountPath: {folder}}}]
      volumes:
        - name: shared
          persistentVolumeClaim: {{claimName: CLAIM}} # to be filled in: one that has the folder, and that many pods may write to
"
    ))
}

/// The line that starts it, in place of an earlier one, and the merge behind it.
///
/// - `file`, `merge`: as a shell takes them
pub(crate) fn command(shards: &[u64], [file, merge]: [&str; 2]) -> String {
    if shards.is_empty() {
        return format!("sh {merge}");
    }
    format!(
        "kubectl delete --ignore-not-found --filename {file} && kubectl apply --filename {file} && \
         kubectl wait --for=condition=complete --timeout=-1s --filename {file}; sh {merge}"
    )
}

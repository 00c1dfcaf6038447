//! Kubernetes: an indexed job, whose image and volume are to be filled in.

use crate::work::{Resources, Work};

/// The name of the file.
pub(crate) const FILE: &str = "job.yaml";

/// The job. All shards are in it: those that are done end at once.
///
/// - `script`: the script of a shard, whole path
pub(crate) fn job(work: &Work, resources: &Resources, script: &str) -> String {
    let name: String =
        work.name.to_lowercase().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let name = name.trim_matches('-');
    let (shards, cpus, seconds) = (work.shards, resources.cpus, 60 * u64::from(resources.time_min.get()));
    let memory = resources.memory.as_ref().map_or(String::new(), |memory| format!(", memory: {memory:?}"));
    let folder = work.folder.to_string_lossy();
    format!(
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
          command: [sh, {script:?}]
          resources: {{requests: {{cpu: \"{cpus}\"{memory}}}, limits: {{cpu: \"{cpus}\"{memory}}}}}
          volumeMounts: [{{name: shared, mountPath: {folder:?}}}]
      volumes:
        - name: shared
          persistentVolumeClaim: {{claimName: CLAIM}} # to be filled in: one that has the folder, and that many pods may write to
"
    )
}

/// The commands that start it.
///
/// - `file`: as a shell takes it
pub(crate) fn commands(file: &str) -> Vec<String> {
    vec![format!("kubectl apply --filename {file}")]
}

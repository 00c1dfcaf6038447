//! Studies and batches on real engines on this machine: the same bytes as one process, with nodes and workers killed.
//!
//! Slurm with one and with three virtual nodes, `HyperQueue`, GNU parallel, and an object store; what is not installed is named, with how to
//! install it.

mod objects;

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use crate::{fleet, root};

/// A study of small records by one estimator: what is tested is the engine.
const PLAN: &str = r#"
name = "cluster"
title = "The same bytes on every engine"
seed = 1
trials = TRIALS
block = 100
samples = [SAMPLES]
noise_percent = [5]
[[gases]]
name = "sine"
gas = { kind = "sine", mean_c = 50.5, amplitude_k = 16.5, frequency_hz = 10.0, hold = "zero-order" }
[[methods]]
name = "ESTIMATOR"
estimator = "ESTIMATOR"
"#;

/// The longest wait for a result, s: far beyond what the quick study takes, with a node that is lost and a task that is requeued.
const PATIENCE_S: u64 = 1800;
/// Between two looks at a state, ms.
const LOOK_MS: u64 = 500;

/// What the quick run has of each; chosen, for a few minutes in all.
const TRIALS: u64 = 10_000;
const SAMPLES: u64 = 300;
const SHARDS: u64 = 8;
const FILES: usize = 60;
/// The estimator of the quick run.
const ESTIMATOR: &str = "whitened";

#[derive(Args)]
pub(crate) struct Cluster {
    /// Trials of the study.
    #[arg(long, default_value_t = TRIALS)]
    trials: u64,
    /// Samples of each trial.
    #[arg(long, default_value_t = SAMPLES)]
    samples: u64,
    /// Estimator of the study.
    #[arg(long, default_value = ESTIMATOR)]
    estimator: String,
    /// Shards of the study.
    #[arg(long, default_value_t = SHARDS)]
    shards: u64,
    /// Files of the fleet, of which one in ten is damaged, ten to a rig.
    #[arg(long, default_value_t = FILES)]
    files: usize,
    /// The program to run; by default that of the last build in debug, and for object stores one with the feature `s3`.
    #[arg(long)]
    program: Option<PathBuf>,
    /// Only this engine, or only object stores.
    #[arg(long, value_parser = ["slurm", "hyperqueue", "parallel", "objects"])]
    only: Option<String>,
}

impl Default for Cluster {
    fn default() -> Self {
        let estimator = ESTIMATOR.to_owned();
        Self { trials: TRIALS, samples: SAMPLES, estimator, shards: SHARDS, files: FILES, program: None, only: None }
    }
}

/// Where all of it happens.
struct Site {
    program: PathBuf,
    folder: PathBuf,
    tools: PathBuf,
    shards: String,
    /// Variables that lead to the engine.
    variables: Vec<(&'static str, PathBuf)>,
}

pub(crate) fn run(cluster: &Cluster) -> Result<()> {
    let root = root()?;
    let folder = root.join("target/cluster");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let program = cluster.program.clone().unwrap_or_else(|| root.join("target/debug/twinlag")).canonicalize()?;
    let tools = root.join("xtask/cluster");
    let mut site = Site { program, folder, tools, shards: cluster.shards.to_string(), variables: Vec::new() };
    let plan = [("TRIALS", cluster.trials.to_string()), ("SAMPLES", cluster.samples.to_string())];
    let plan = plan
        .iter()
        .fold(PLAN.replace("ESTIMATOR", &cluster.estimator), |plan, (name, value)| plan.replace(name, value));
    fs::write(site.folder.join("plan.toml"), plan)?;

    let alone_s = site.timed(&["study", "run", "plan.toml", "--out", "whole", "--threads", "2", "--quiet"])?;
    println!("study: {alone_s:.1} s in one process with two threads");
    let one_thread_s = site.timed(&["study", "run", "plan.toml", "--out", "one", "--threads", "1", "--quiet"])?;
    println!("study: {one_thread_s:.1} s in one process with one thread");
    site.expect_same("one")?;
    let wants = |engine: &str| cluster.only.as_deref().is_none_or(|only| only == engine);
    if wants("slurm") {
        if is_installed("slurmctld") && is_installed("munged") {
            site.slurm([one_thread_s, alone_s], cluster.files)?;
        } else {
            println!("SKIPPED: slurm; `apt-get install --no-install-recommends slurm-wlm munge` installs it");
        }
    }
    if wants("hyperqueue") {
        if Command::new("python3")
            .args(["-c", "import hyperqueue"])
            .output()
            .is_ok_and(|output| output.status.success())
        {
            site.hyperqueue()?;
        } else {
            println!("SKIPPED: hyperqueue; `pip install hyperqueue` installs it");
        }
    }
    if wants("parallel") {
        if is_installed("parallel") {
            site.parallel()?;
        } else {
            println!("SKIPPED: parallel; `apt-get install parallel` installs it");
        }
    }
    if wants("objects") {
        if cluster.program.is_none() {
            site.program = objects::program()?;
        }
        site.objects(cluster.files)?;
    }
    Ok(())
}

fn is_installed(program: &str) -> bool {
    Command::new("sh").args(["-c", "command -v \"$0\"", program]).output().is_ok_and(|output| output.status.success())
}

/// A process that ends when this does.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Site {
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        command.args(arguments).current_dir(&self.folder).envs(self.variables.iter().cloned());
        command
    }

    /// How long the program takes, s.
    fn timed(&self, arguments: &[&str]) -> Result<f64> {
        let start = Instant::now();
        let status = self.command(arguments).stdout(Stdio::null()).status()?;
        ensure!(status.success(), "twinlag {} ended with {status}", arguments.join(" "));
        Ok(start.elapsed().as_secs_f64())
    }

    fn expect_same(&self, out: &str) -> Result<()> {
        let read = |out: &str| fs::read(self.folder.join(out).join("results.json"));
        ensure!(read("whole")? == read(out)?, "{out}: other bytes than those of one process");
        println!("study: the bytes of one process in {out}");
        Ok(())
    }

    fn submit(&self, out: &str, engine: &str) -> Result<()> {
        let submit = ["study", "submit", "plan.toml", "--out", out, "--engine", engine, "--shards", &self.shards];
        self.timed(&[&submit[..], &["--time-limit", "600"]].concat())?;
        Ok(())
    }

    /// Waits until the state fits.
    fn wait(&self, question: &[&str], fits: impl Fn(&serde_json::Value) -> bool) -> Result<()> {
        let start = Instant::now();
        loop {
            let output = self.command(&[question, &["--json"]].concat()).output()?;
            let state = serde_json::from_slice(&output.stdout);
            if state.as_ref().is_ok_and(&fits) {
                return Ok(());
            }
            if start.elapsed() > Duration::from_secs(PATIENCE_S) {
                bail!("{question:?} after {PATIENCE_S} s: {state:?}");
            }
            sleep(Duration::from_millis(LOOK_MS));
        }
    }

    /// Waits for a result.
    fn wait_for(&self, question: &[&str]) -> Result<()> {
        self.wait(question, |state| state["merged"] == true)
    }

    /// Waits until a good part of the units is done, and another is not.
    fn wait_until_midway(&self, question: &[&str]) -> Result<()> {
        let share = std::cell::Cell::new(0.0);
        self.wait(question, |state| {
            share.set(state["done"].as_f64().unwrap_or(0.0) / state["total"].as_f64().unwrap_or(1.0));
            share.get() >= 0.2
        })?;
        ensure!(share.get() < 0.8, "{question:?}: was nearly done when it was first seen: choose more --trials");
        Ok(())
    }

    fn tool(&self, action: &[&str]) -> Result<()> {
        let status = Command::new(self.tools.join("slurm.sh")).args(action).stdin(Stdio::null()).status()?;
        ensure!(status.success(), "slurm.sh {} ended with {status}", action.join(" "));
        Ok(())
    }

    fn slurm(&mut self, alone_s: [f64; 2], files: usize) -> Result<()> {
        // A socket's path is short.
        let place = tempfile::tempdir()?;
        let dir = |nodes: &str| place.path().join(nodes).display().to_string();
        for nodes in ["1", "3"] {
            let dir = dir(nodes);
            self.variables = vec![("SLURM_CONF", Path::new(&dir).join("slurm.conf"))];
            let started = self.tool(&["start", &dir, nodes]);
            let done = started.and_then(|()| self.on_slurm(nodes, &dir, alone_s, files));
            // What went wrong first is what is said.
            done.and(self.tool(&["stop", &dir]))?;
        }
        self.variables.clear();
        Ok(())
    }

    fn on_slurm(&self, nodes: &str, dir: &str, [one_thread_s, two_threads_s]: [f64; 2], files: usize) -> Result<()> {
        let out = format!("slurm-{nodes}");
        let status = ["study", "status", &out];
        let start = Instant::now();
        self.submit(&out, "slurm")?;
        if nodes != "1" {
            self.wait_until_midway(&status)?;
            self.tool(&["kill", dir, "n2"])?;
            println!("slurm: node n2 of {nodes} killed");
        }
        self.wait_for(&status)?;
        let seconds = start.elapsed().as_secs_f64();
        // One node has one processor; three nodes share those of this machine.
        let alone_s = if nodes == "1" { one_thread_s } else { two_threads_s };
        println!(
            "slurm: {seconds:.1} s on {nodes} nodes of one processor, {:.2} times as long as in one process",
            seconds / alone_s
        );
        self.expect_same(&out)?;
        if nodes == "1" { Ok(()) } else { self.fleet_on_slurm(files) }
    }

    /// Joint diagnoses of the rigs of a fleet, some of whose files are damaged.
    fn fleet_on_slurm(&self, files: usize) -> Result<()> {
        let records = self.folder.join("fleet");
        fleet::make(&records, files, 2000)?;
        let batch = ["batch", "fleet", "--verb", "diagnose", "--group-by", "folder"];
        self.timed(&[&batch[..], &["--out", "fleet-whole.csv", "--quiet"]].concat())?;
        let engine = ["--engine", "slurm", "--shards", "6", "--time-limit", "600"];
        self.timed(&[&batch[..], &["--out", "fleet-slurm.csv"], &engine].concat())?;
        self.wait_for(&["batch", "--status", "--out", "fleet-slurm.csv"])?;
        let read = |table: &str| fs::read(self.folder.join(table));
        ensure!(read("fleet-whole.csv")? == read("fleet-slurm.csv")?, "the fleet has another table on Slurm");
        println!("batch: the bytes of one process, of {files} files");
        Ok(())
    }

    fn hyperqueue(&mut self) -> Result<()> {
        let place = tempfile::tempdir()?;
        self.variables = vec![("HQ_SERVER_DIR", place.path().join("server"))];
        let status = ["study", "status", "hyperqueue"];
        {
            let _server = self.start_hyperqueue()?;
            self.submit("hyperqueue", "hyperqueue")?;
            self.wait_until_midway(&status)?;
        }
        println!("hyperqueue: server and both workers killed");
        let _server = self.start_hyperqueue()?;
        self.timed(&["study", "resubmit", "hyperqueue"])?;
        self.wait_for(&status)?;
        self.variables.clear();
        self.expect_same("hyperqueue")
    }

    fn start_hyperqueue(&self) -> Result<Running> {
        let server = &self.variables[0].1;
        let mut child = Command::new("python3")
            .arg(self.tools.join("hq-local.py"))
            .args([server.as_os_str(), "2".as_ref()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let said = BufReader::new(child.stdout.take().context("it was piped")?);
        let running = Running(child);
        ensure!(said.lines().map_while(Result::ok).any(|line| line == "ready"), "the server did not start");
        Ok(running)
    }

    fn parallel(&self) -> Result<()> {
        let submit =
            ["study", "submit", "plan.toml", "--out", "parallel", "--engine", "parallel", "--shards", &self.shards];
        let output = self.command(&[&submit[..], &["--time-limit", "600"]].concat()).output()?;
        ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let line = String::from_utf8(output.stdout)?;
        let status = Command::new("sh").args(["-c", &line]).current_dir(&self.folder).status()?;
        ensure!(status.success(), "{line} ended with {status}");
        self.expect_same("parallel")
    }
}

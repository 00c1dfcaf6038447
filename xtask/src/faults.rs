//! The program killed at moments all over its runs, outputs that have no room, and kept parts that are damaged: nothing lost, nothing
//! half written, and the same bytes by going on.

mod damage;
mod full;

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Args;

use crate::report::target_dir;
use crate::{fleet, root};

/// Fractional part of the golden ratio: its multiples spread evenly over [0, 1), whatever their number.
const GOLDEN_SHARE: f64 = 0.618_033_988_749_895;
/// What [`std::process::Child::kill`] sends.
const SIGKILL: i32 = 9;
/// The latest kill, in durations of a whole run: the last sixth of the runs end before they are killed, so that each series gets on.
const LATEST_KILL: f64 = 1.2;
/// Rows of the record that is compensated and tracked; chosen, for runs of about a second.
const ROWS: usize = 4000;
/// Files of the batch; chosen likewise.
const FILES: usize = 20;

/// The study; chosen likewise.
const PLAN: &str = r#"
name = "faults"
title = "The same bytes after kills"
seed = 1
trials = 1000
block = 20
samples = [200]
noise_percent = [5]
[[gases]]
name = "sine"
gas = { kind = "sine", mean_c = 50.5, amplitude_k = 16.5, frequency_hz = 10.0, hold = "zero-order" }
[[methods]]
name = "whitened"
estimator = "whitened"
"#;

#[derive(Args)]
pub(crate) struct Faults {
    /// Kills of each kind of run, and damaged parts of each kind.
    #[arg(long, default_value_t = 200)]
    kills: usize,
    /// The program to run; by default that of the last build in debug.
    #[arg(long)]
    program: Option<PathBuf>,
}

pub(crate) fn run(faults: &Faults) -> Result<()> {
    let folder = root()?.join("target/faults");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let program =
        faults.program.clone().map_or_else(|| Ok(target_dir()?.join("debug/twinlag")), anyhow::Ok)?.canonicalize()?;
    fs::write(folder.join("plan.toml"), PLAN)?;
    fleet::make(&folder.join("fleet"), FILES, ROWS / 4)?;
    fleet::make(&folder.join("one"), 1, ROWS)?;
    fs::copy(folder.join("one/rig-0000/run-00.csv"), folder.join("record.csv"))?;
    let site = Site { program, folder, kills: faults.kills };
    site.compensation()?;
    let to = |run: &[&str], out: &str| run.iter().copied().chain([out]).map(str::to_owned).collect();
    site.resumed(["study", "/results.json"], |out| to(&["study", "run", "plan.toml", "--resume", "--out"], out))?;
    site.resumed(["batch.csv", ""], |out| to(&["batch", "fleet", "--resume", "--out"], out))?;
    site.resumed(["live.csv", ""], |out| {
        let state = format!("{out}.json");
        to(&["track", "record.csv", "--live", "1000", "--state", &state, "--out"], out)
    })?;
    site.live()?;
    damage::run(&site)?;
    full::run(&site)
}

/// Where all of it happens.
struct Site {
    program: PathBuf,
    folder: PathBuf,
    kills: usize,
}

impl Site {
    fn command(&self, arguments: &[impl AsRef<str>]) -> Command {
        let mut command = Command::new(&self.program);
        command
            .args(arguments.iter().map(AsRef::as_ref))
            .arg("--quiet")
            .current_dir(&self.folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        command
    }

    /// Runs to the end; returns how long it took.
    fn whole(&self, arguments: &[impl AsRef<str>]) -> Result<Duration> {
        let start = Instant::now();
        let status = self.command(arguments).status()?;
        ensure!(status.success(), "twinlag {} ended with {status}", in_words(arguments));
        Ok(start.elapsed())
    }

    /// What a run says that is let come to its end.
    fn said(&self, arguments: &[&str]) -> Result<Output> {
        Ok(self.command(arguments).stderr(Stdio::piped()).output()?)
    }

    /// Runs, and kills after so long what has not ended; returns whether it was killed.
    fn killed(&self, arguments: &[impl AsRef<str>], after: Duration) -> Result<bool> {
        let mut child = self.command(arguments).stderr(Stdio::piped()).spawn()?;
        sleep(after);
        child.kill()?;
        let ended = child.wait_with_output()?;
        let is_killed = ended.status.signal() == Some(SIGKILL);
        let said = String::from_utf8_lossy(&ended.stderr);
        ensure!(is_killed || ended.status.success(), "twinlag {}: {}: {said}", in_words(arguments), ended.status);
        Ok(is_killed)
    }

    fn read(&self, name: &str) -> Option<Vec<u8>> {
        fs::read(self.folder.join(name)).ok()
    }

    /// Each output of a compensation that is killed is as it was before, or whole.
    fn compensation(&self) -> Result<()> {
        let (old, outputs) = (b"what was there before".as_slice(), ["gas.csv", "gas.svg", "model.json"]);
        let run =
            ["compensate", "record.csv", "--out", outputs[0], "--picture", outputs[1], "--save", outputs[2], "--force"];
        let whole = self.whole(&run)?;
        let new = outputs.map(|name| self.read(name));
        let (mut killed, mut left_new, mut moment) = (0, 0, Moments::over(whole));
        while killed < self.kills {
            for name in outputs {
                fs::write(self.folder.join(name), old)?;
            }
            killed += usize::from(self.killed(&run, moment.next())?);
            for (name, new) in outputs.iter().zip(&new) {
                let found = self.read(name);
                left_new += usize::from(found == *new);
                ensure!(found == *new || found.as_deref() == Some(old), "{name}: half written");
            }
        }
        ensure!(left_new > 0, "compensate: no run that was to be killed came to its end");
        println!("compensate: {killed} kills; each output as it was before, or whole (that {left_new} times)");
        self.sweep()
    }

    /// Runs what can go on, is killed over and over, and has to end with the bytes of one run.
    ///
    /// - `name`, `result`: of the output, behind the number of the series, and the result below that
    /// - `arguments`: those of a run with this output
    fn resumed(&self, [name, result]: [&str; 2], arguments: impl Fn(&str) -> Vec<String>) -> Result<()> {
        let out = |series: usize| format!("{series}-{name}");
        let read = |series: usize| self.read(&(out(series) + result));
        let whole = self.whole(&arguments(&out(0)))?;
        let (mut killed, mut series, mut moment) = (0, 0, Moments::over(whole));
        while killed < self.kills {
            series += 1;
            while self.killed(&arguments(&out(series)), moment.next())? {
                killed += 1;
            }
            ensure!(read(series).is_some() && read(series) == read(0), "{name}: other bytes after kills");
        }
        println!("{name}: {killed} kills; {series} series resumed to the end, with the bytes of one run");
        self.sweep()
    }

    /// What a live run that is killed has written is the beginning of what it would have, in whole lines.
    fn live(&self) -> Result<()> {
        let run = ["track", "record.csv", "--live", "1000", "--out", "live.csv", "--force"];
        let whole = self.whole(&run)?;
        let all = self.read("live.csv").context("live.csv was not written")?;
        let (mut killed, mut midway, mut moment) = (0, 0, Moments::over(whole));
        while killed < self.kills {
            // Of a run that is killed before it writes there is none.
            let _ = fs::remove_file(self.folder.join("live.csv"));
            killed += usize::from(self.killed(&run, moment.next())?);
            let found = self.read("live.csv").unwrap_or_default();
            ensure!(all.starts_with(&found), "live.csv: other rows than those of a whole run");
            ensure!(found.last().is_none_or(|last| *last == b'\n'), "live.csv: ends within a row");
            midway += usize::from(!found.is_empty() && found.len() < all.len());
        }
        ensure!(midway > 0, "track --live: no run was killed while it wrote");
        println!("track --live: {killed} kills; whole rows ({midway} times a part of them), each as of a whole run");
        Ok(())
    }

    /// Removes the parts of outputs that killed runs leave, which are the only thing that they may leave.
    fn sweep(&self) -> Result<()> {
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with('.') {
                ensure!(name.starts_with(".twinlag-") && name.ends_with(".part"), "{name}: left behind");
                fs::remove_file(&path)?;
            }
        }
        Ok(())
    }
}

fn in_words(arguments: &[impl AsRef<str>]) -> String {
    arguments.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(" ")
}

/// Moments spread evenly over a run and a little beyond it.
struct Moments {
    whole: Duration,
    turn: usize,
}

impl Moments {
    fn over(whole: Duration) -> Self {
        Self { whole, turn: 0 }
    }

    fn next(&mut self) -> Duration {
        self.turn += 1;
        self.whole.mul_f64(LATEST_KILL * spread(self.turn))
    }
}

/// Numbers spread evenly over [0, 1), however many turns there are.
fn spread(turn: usize) -> f64 {
    (turn as f64 * GOLDEN_SHARE).fract()
}

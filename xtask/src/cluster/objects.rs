//! Results on an S3 server of this machine, some of whose requests fail: the same bytes as in a folder.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail, ensure};

use super::{LOOK_MS, PATIENCE_S, Running, Site};
use crate::{fleet, root};

/// Of so many requests to the server one fails; chosen: a shard makes about so many.
const FAULTY_EVERY: &str = "7";
/// How URLs begin: the server has what follows in its folder.
const SCHEME: &str = "s3://";
/// Where the study is.
const STUDY: &str = "s3://bucket/all objects/übung";
/// Where the table is, beside the study.
const TABLE: &str = "s3://bucket/all objects/übung#1.csv";
/// The shards of the study, of which each takes longer than the time after which what is done is stored.
const SHARDS: [&str; 2] = ["0/2", "1/2"];

impl Site {
    /// A study and a batch, with a shard that is killed, one that runs twice at once, and a part that is damaged.
    pub(super) fn objects(&mut self, files: usize) -> Result<()> {
        let store = self.folder.join("store");
        fs::create_dir_all(store.join("bucket"))?;
        let (_server, url) = start_server(&store)?;
        let variables = [
            ("AWS_ENDPOINT_URL", url.as_str()),
            ("AWS_ACCESS_KEY_ID", "KEY"),
            ("AWS_SECRET_ACCESS_KEY", "SECRET"),
            ("AWS_ALLOW_HTTP", "true"),
        ];
        self.variables = variables.map(|(name, value)| (name, PathBuf::from(value))).to_vec();
        let [study, table] = [STUDY, TABLE].map(|url| store.join(url.strip_prefix(SCHEME).expect("a URL")));
        self.study_on(&study)?;
        self.fleet_on(&table, files)?;
        self.variables.clear();
        Ok(())
    }

    fn shard(&self, shard: &str) -> Result<Child> {
        let arguments =
            ["study", "run", "plan.toml", "--out", STUDY, "--shard", shard, "--resume", "--threads", "1", "--quiet"];
        Ok(self.command(&arguments).stderr(Stdio::piped()).spawn()?)
    }

    /// - `stored`: where the server has it
    fn study_on(&self, stored: &Path) -> Result<()> {
        let part = stored.join("part-0-of-2.json");
        let submit = ["study", "submit", "plan.toml", "--out", STUDY, "--engine", "parallel", "--shards", "2"];
        self.expect(&[&submit[..], &["--time-limit", "60"]].concat(), 0, "")?;
        let mut killed = Running(self.shard(SHARDS[0])?);
        let start = Instant::now();
        while !part.exists() {
            ensure!(start.elapsed() < Duration::from_secs(PATIENCE_S), "{} does not come", part.display());
            sleep(Duration::from_millis(LOOK_MS));
        }
        ensure!(killed.0.try_wait()?.is_none(), "the shard ended before it could be killed: choose more --trials");
        drop(killed);
        println!("objects: shard {} killed", SHARDS[0]);
        self.expect(&["study", "merge", STUDY], 75, "missing shards 0-1 of 2")?;

        // The second one twice at once: one of them goes on.
        let shards = [SHARDS[0], SHARDS[1], SHARDS[1]].map(|shard| self.shard(shard));
        let ended: Vec<Output> =
            shards.into_iter().map(|shard| Ok(shard?.wait_with_output()?)).collect::<Result<_>>()?;
        let codes: Vec<Option<i32>> = ended.iter().map(|output| output.status.code()).collect();
        if codes[0] != Some(0)
            || codes[1..].iter().any(|code| ![Some(0), Some(75)].contains(code))
            || !codes[1..].contains(&Some(0))
        {
            let said: Vec<_> = ended.iter().map(|output| String::from_utf8_lossy(&output.stderr)).collect();
            bail!("the shards ended with {codes:?}: {said:?}");
        }
        println!("objects: shard {} twice at once, exit codes {:?}", SHARDS[1], &codes[1..]);

        let whole = fs::read(&part)?;
        fs::write(&part, [&whole[..], b"more"].concat())?;
        let is_named = format!("{STUDY}/part-0-of-2.json is not part of a study, or is damaged");
        self.expect(&["study", "merge", STUDY], 3, &is_named)?;
        self.expect(&["study", "resubmit", STUDY], 3, &is_named)?;
        self.expect(&["study", "status", STUDY], 75, &is_named)?;
        fs::write(&part, whole)?;
        self.expect(&["study", "merge", STUDY], 0, "")?;
        self.expect(&["study", "status", STUDY], 0, "the result is there")?;
        for name in ["results.json", "results.csv"] {
            let is_same = fs::read(stored.join(name))? == fs::read(self.folder.join("whole").join(name))?;
            ensure!(is_same, "{name}: other bytes than those of one process");
        }
        println!("objects: the bytes of one process in {STUDY}");
        Ok(())
    }

    /// - `stored`: where the server has its table
    fn fleet_on(&self, stored: &Path, files: usize) -> Result<()> {
        fleet::make(&self.folder.join("records"), files, 2000)?;
        self.expect(&["batch", "records", "--out", "records.csv", "--quiet"], 0, "")?;
        // All at once: one of them makes the manifest.
        let shards: Vec<Child> = ["0/3", "1/3", "2/3"]
            .map(|shard| ["batch", "records", "--out", TABLE, "--threads", "1", "--quiet", "--shard", shard])
            .iter()
            .map(|arguments| Ok(self.command(arguments).spawn()?))
            .collect::<Result<_>>()?;
        for mut shard in shards {
            let status = shard.wait()?;
            ensure!(status.success(), "a shard of the batch ended with {status}");
        }
        // The summary goes to this machine.
        self.expect(&["batch", "--merge", "--out", TABLE, "--report", "records.html"], 0, "")?;
        ensure!(self.folder.join("records.html").exists(), "there is no summary");
        let is_same = fs::read(stored)? == fs::read(self.folder.join("records.csv"))?;
        ensure!(is_same, "the records have another table on the server");
        println!("objects: the bytes of one process, of {files} files");
        Ok(())
    }

    /// Runs the program, which has to end so, and to say so.
    fn expect(&self, arguments: &[&str], code: i32, said: &str) -> Result<()> {
        let output = self.command(arguments).output()?;
        let text = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
        let fits = output.status.code() == Some(code) && text.contains(said);
        ensure!(fits, "{}: expected {code} and {said:?}, got {}: {text}", arguments.join(" "), output.status);
        Ok(())
    }
}

/// Builds the program with the feature `s3`, and returns its path.
pub(super) fn program() -> Result<PathBuf> {
    // Apart: the feature changes those of what everything else is built on.
    built(&["--package", "twinlag-cli", "--features", "s3"], "twinlag")
}

/// What is built of these arguments, in a folder of its own.
fn built(arguments: &[&str], program: &str) -> Result<PathBuf> {
    let target = root()?.join("target/objects");
    let status = Command::new("cargo")
        .args(["build", "--quiet", "--target-dir"])
        .arg(&target)
        .args(arguments)
        .current_dir(root()?)
        .status()?;
    ensure!(status.success(), "{program} cannot be built");
    Ok(target.join("debug").join(program))
}

/// Starts the server, which has buckets in a folder, and returns its URL.
fn start_server(folder: &Path) -> Result<(Running, String)> {
    let server = built(&["--manifest-path", "xtask/objects/Cargo.toml"], "faulty-s3")?;
    let mut child =
        Command::new(server).arg(folder).arg(FAULTY_EVERY).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let said = BufReader::new(child.stdout.take().context("it was piped")?);
    let running = Running(child);
    let url = said.lines().next().context("the server did not start")??;
    Ok((running, url))
}

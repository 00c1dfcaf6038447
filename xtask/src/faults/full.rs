//! Outputs on a disk that is full.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, ensure};

use super::Site;

/// Option of `mount` for the small disk: 16 KiB, less than any of the outputs.
const ROOM: &str = "size=16k";

pub(super) fn run(site: &Site) -> Result<()> {
    let Some(disk) = Disk::mounted(site.folder.join("disk"))? else {
        println!("SKIPPED: a full disk; it takes the right to mount one, as root has");
        return Ok(());
    };
    let record = "record.csv";
    let runs: [&[&str]; 5] = [
        &["compensate", record, "--out", "disk/gas.csv"],
        &["compensate", record, "--out", "gas-2.csv", "--picture", "disk/gas.svg"],
        &["diagnose", record, "--report", "disk/report.html"],
        &["study", "run", "plan.toml", "--out", "disk/study"],
        &["track", record, "--out", "disk/track.csv"],
    ];
    for run in runs {
        let output = site.said(run)?;
        let said = String::from_utf8_lossy(&output.stderr);
        let asked = run.join(" ");
        ensure!(output.status.code() == Some(1), "twinlag {asked}: ended with {}: {said}", output.status);
        ensure!(said.contains("disk/") && said.contains("No space left"), "twinlag {asked}: said {said}");
        // A study goes on from its plan and its parts.
        let is_kept = |path: &PathBuf| ["plan.toml", "part-0-of-1.json"].iter().any(|name| path.ends_with(name));
        let left: Vec<PathBuf> = files(&disk.0)?.into_iter().filter(|path| !is_kept(path)).collect();
        ensure!(left.is_empty(), "twinlag {asked}: left {left:?}");
    }
    println!(
        "full disk: {} runs end with a message that names the file and what is lacking, and leave no output",
        runs.len()
    );
    Ok(())
}

/// All files below a folder.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut out = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { out.extend(files(&path)?) } else { out.push(path) }
    }
    Ok(out)
}

/// A small disk in memory.
struct Disk(PathBuf);

impl Disk {
    /// `None` where nothing can be mounted.
    fn mounted(place: PathBuf) -> Result<Option<Self>> {
        fs::create_dir_all(&place)?;
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", ROOM, "tmpfs"]).arg(&place).output();
        Ok(mount.is_ok_and(|mount| mount.status.success()).then_some(Self(place)))
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // A mount that stays is unmounted by hand: `umount target/faults/disk`.
        let _ = Command::new("umount").arg(&self.0).output();
    }
}

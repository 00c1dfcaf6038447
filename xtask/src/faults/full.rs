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
    let runs: [&[&str]; 4] = [
        &["compensate", record, "--out", "disk/gas.csv"],
        &["compensate", record, "--out", "gas-2.csv", "--picture", "disk/gas.svg"],
        &["diagnose", record, "--report", "disk/report.html"],
        &["track", record, "--out", "disk/track.csv"],
    ];
    for run in runs {
        site.lacks_room(run)?;
        let left = files(&disk.0)?;
        ensure!(left.is_empty(), "twinlag {}: left {left:?}", run.join(" "));
    }
    println!(
        "full disk: {} runs end with a message that names the file and what is lacking, and leave no file",
        runs.len()
    );
    site.study_goes_on_elsewhere(&disk)
}

impl Site {
    /// A run that has to end because a disk is full, and to say so.
    fn lacks_room(&self, run: &[&str]) -> Result<()> {
        let output = self.said(run)?;
        let said = String::from_utf8_lossy(&output.stderr);
        let asked = run.join(" ");
        ensure!(output.status.code() == Some(1), "twinlag {asked}: ended with {}: {said}", output.status);
        ensure!(said.contains("disk/") && said.contains("No space left"), "twinlag {asked}: said {said}");
        Ok(())
    }

    /// A study keeps its plan and what it has computed: moved to where there is room, it goes on to the bytes of one run.
    fn study_goes_on_elsewhere(&self, disk: &Disk) -> Result<()> {
        self.lacks_room(&["study", "run", "plan.toml", "--out", "disk/study"])?;
        let moved = self.folder.join("moved-study");
        fs::create_dir_all(&moved)?;
        for path in files(&disk.0)? {
            fs::copy(&path, moved.join(path.file_name().unwrap_or_default()))?;
        }
        self.whole(&["study", "run", "plan.toml", "--out", "moved-study", "--resume"])?;
        let results = ["0-study", "moved-study"].map(|study| self.read(&format!("{study}/results.json")));
        ensure!(results[0].is_some() && results[0] == results[1], "study: other bytes after a full disk");
        println!("full disk: a study goes on elsewhere from what it has kept, to the bytes of one run");
        Ok(())
    }
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

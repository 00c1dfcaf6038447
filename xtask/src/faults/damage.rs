//! Kept parts of studies and batches of which a bit has changed, or the end is missing.

use std::fs;

use anyhow::{Context, Result, ensure};

use super::{Site, spread};

pub(super) fn run(site: &Site) -> Result<()> {
    let study = ["study", "run", "plan.toml", "--out", "parts"];
    for shard in ["0/2", "1/2"] {
        site.whole(&[&study[..], &["--shard", shard]].concat())?;
    }
    let merge = ["study", "merge", "parts"];
    site.damaged("study", "parts/part-0-of-2.json", "parts/results.json", &merge)?;
    for shard in ["0/2", "1/2"] {
        site.whole(&["batch", "fleet", "--out", "parts.csv", "--shard", shard])?;
    }
    let merge = ["batch", "--merge", "--out", "parts.csv", "--force"];
    site.damaged("batch", "parts.csv.part-0-of-2", "parts.csv", &merge)
}

impl Site {
    /// A part that is damaged is refused by name, or leaves no trace in the result.
    fn damaged(&self, what: &str, part: &str, result: &str, merge: &[&str]) -> Result<()> {
        let path = self.folder.join(part);
        let sound = fs::read(&path)?;
        self.whole(merge)?;
        let want = self.read(result).context("a result")?;
        let mut refused = 0;
        for turn in 0..self.kills {
            let place = (sound.len() as f64 * spread(turn + 1)) as usize;
            let mut bytes = sound.clone();
            if turn % 2 == 0 {
                bytes[place] ^= 1 << (turn / 2 % 8);
            } else {
                bytes.truncate(place);
            }
            fs::write(&path, bytes)?;
            let _ = fs::remove_file(self.folder.join(result));
            let output = self.said(merge)?;
            if output.status.success() {
                ensure!(self.read(result).as_deref() == Some(&want), "{what}: other bytes of a damaged part ({place})");
            } else {
                let said = String::from_utf8_lossy(&output.stderr);
                let is_said = matches!(output.status.code(), Some(1 | 3 | 75));
                ensure!(is_said, "{what}: ended with {}: {said}", output.status);
                ensure!(
                    ["0-of-2", "0 of 2", "0/2"].iter().any(|part| said.contains(part)),
                    "{what}: does not name the part: {said}"
                );
                ensure!(self.read(result).is_none(), "{what}: a result of a damaged part ({place})");
                refused += 1;
            }
        }
        ensure!(refused > 0, "{what}: no damaged part was refused");
        fs::write(&path, sound)?;
        println!(
            "{what}: {} damaged parts, {refused} refused by name, the others without a trace in the result",
            self.kills
        );
        Ok(())
    }
}

//! The output for the rows of the answer.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufWriter, ErrorKind, Read as _, Seek as _, SeekFrom, Write, stdout};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use twinlag::LiveAnswer;
use twinlag::diagnosis::Grade;

use crate::failure::Failure;
use crate::output::{self, cannot_be_written};

const HEADER: &str = "time_s,gas_C,gas_std_K,tau1_s,tau1_low_s,tau1_high_s,tau2_s,tau2_low_s,tau2_high_s";

/// How far a file was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Written {
    pub(super) file: PathBuf,
    bytes: u64,
}

impl Written {
    /// A file that is about to be begun.
    pub(super) fn nothing_to(path: &Path) -> Result<Self, Failure> {
        let folder = output::folder_of(path).canonicalize().map_err(|e| cannot_be_written(path, &e))?;
        Ok(Self { file: folder.join(path.file_name().unwrap_or_default()), bytes: 0 })
    }
}

/// The output for the rows of the answer.
pub(super) struct Out {
    to: Box<dyn Write>,
    name: String,
    /// The grade of the start, where rows show it.
    grade: Option<Grade>,
    /// The file, if it is one, and how far it is written.
    file: Option<(File, Written)>,
}

impl Out {
    /// Begins with the header.
    pub(super) fn open(path: &Path, to_stdout: bool, grade: Option<Grade>) -> Result<Self, Failure> {
        if to_stdout {
            let to = Box::new(BufWriter::new(stdout()));
            return Self { to, name: "standard output".into(), grade, file: None }.begun();
        }
        let file = Self::locked(path, File::options().create(true).truncate(false))?;
        // Whatever the file was before, --force gives it up.
        let emptied = if file.metadata().is_ok_and(|file| file.is_file()) { file.set_len(0) } else { Ok(()) };
        emptied.map_err(|e| cannot_be_written(path, &e))?;
        Self::to_file(path, file, 0, grade)?.begun()
    }

    /// Goes on behind the rows that were written before.
    ///
    /// - `cut`: whether what was written behind them is to be written again; otherwise its whole lines stay
    pub(super) fn behind(written: &Written, cut: bool, grade: Option<Grade>) -> Result<Self, Failure> {
        let path = written.file.as_path();
        let mut file = Self::locked(path, File::options().read(true))?;
        let failed = |e: std::io::Error| cannot_be_written(path, &e);
        let is = file.metadata().map_err(failed)?.len();
        if is < written.bytes {
            return Err(Failure::Other(format!(
                "{}: expected {} bytes or more, which were written with the state, got {is}: name another file for --out",
                path.display(),
                written.bytes
            )));
        }
        let bytes = if cut { written.bytes } else { end_of_whole_lines(&mut file, written.bytes).map_err(failed)? };
        file.set_len(bytes).map_err(failed)?;
        file.seek(SeekFrom::Start(bytes)).map_err(failed)?;
        Self::to_file(path, file, bytes, grade)
    }

    /// The file, in which no other run writes meanwhile. Where there are no locks that is not known.
    fn locked(path: &Path, options: &mut OpenOptions) -> Result<File, Failure> {
        let file = options.write(true).open(path).map_err(|e| cannot_be_written(path, &e))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let path = path.display();
                Err(Failure::Other(format!(
                    "{path}: another run is writing it: wait for its end, or name another file"
                )))
            }
            Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
        }
    }

    fn to_file(path: &Path, file: File, bytes: u64, grade: Option<Grade>) -> Result<Self, Failure> {
        let name = path.display().to_string();
        let same = file.try_clone().and_then(|same| Ok((same, path.canonicalize()?)));
        let (same, whole) = same.map_err(|e| cannot_be_written(path, &e))?;
        let is_file = file.metadata().is_ok_and(|file| file.is_file());
        let written = is_file.then_some((same, Written { file: whole, bytes }));
        Ok(Self { to: Box::new(BufWriter::new(file)), name, grade, file: written })
    }

    fn begun(mut self) -> Result<Self, Failure> {
        let header = format!("{HEADER}{}", if self.grade.is_some() { ",grade" } else { "" });
        self.line(&header)?;
        Ok(self)
    }

    pub(super) fn grade(&self) -> Option<Grade> {
        self.grade
    }

    /// How far the file is written, where it is one: these bytes are on the disk.
    pub(super) fn written(&mut self) -> Result<Option<Written>, Failure> {
        if !self.flush()? {
            return Ok(None);
        }
        let Some((file, written)) = &self.file else { return Ok(None) };
        file.sync_data().map_err(|e| cannot_be_written(&written.file, &e))?;
        Ok(Some(written.clone()))
    }

    /// Writes one line by one call: `BufWriter` does not split what fits its buffer, so that a run that is killed leaves whole lines.
    /// `false` if the reader has closed the pipe.
    fn line(&mut self, line: &str) -> Result<bool, Failure> {
        let line = format!("{line}\n");
        let written = self.to.write_all(line.as_bytes());
        if let Some((_, so_far)) = &mut self.file {
            so_far.bytes += line.len() as u64;
        }
        self.done(written)
    }

    pub(super) fn flush(&mut self) -> Result<bool, Failure> {
        let flushed = self.to.flush();
        self.done(flushed)
    }

    pub(super) fn answer(&mut self, answer: Option<LiveAnswer>) -> Result<bool, Failure> {
        let Some(now) = answer else { return Ok(true) };
        let gas = [now.time_s, now.gas_c, now.gas_std_k].map(Some);
        let tau = [0, 1].into_iter().flat_map(|i| {
            let [low, high] = now.tau_95_s[i].map_or([None; 2], |band| band.map(Some));
            [now.tau_s[i], low, high]
        });
        let numbers = gas.into_iter().chain(tau).map(|v| v.map_or(String::new(), |v| v.to_string()));
        let cells: Vec<String> = numbers.chain(self.grade.map(|grade| grade.to_string())).collect();
        self.line(&cells.join(","))
    }

    fn done(&self, written: std::io::Result<()>) -> Result<bool, Failure> {
        match written {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
            Err(error) => Err(Failure::Other(format!("{}: {error}", self.name))),
        }
    }
}

/// Where the last whole line ends, behind `from`, which is the end of one.
fn end_of_whole_lines(file: &mut File, from: u64) -> std::io::Result<u64> {
    let mut rest = Vec::new();
    file.seek(SeekFrom::Start(from))?;
    file.read_to_end(&mut rest)?;
    Ok(from + rest.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at as u64 + 1))
}

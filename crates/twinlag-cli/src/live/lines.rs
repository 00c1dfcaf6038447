//! Lines of a file or of standard input, as they arrive.

use std::fs::File;
use std::io::{BufRead, BufReader, Read as _, Seek as _, SeekFrom, stdin};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use twinlag::record::{MAX_LINE_BYTES, RecordError, Table};

use crate::failure::Failure;

/// How far an input was read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Position {
    /// The file; `None` of standard input.
    file: Option<PathBuf>,
    bytes: u64,
    lines: usize,
}

/// Lines of a file or of standard input.
pub(super) struct Lines {
    from: Box<dyn BufRead>,
    name: String,
    position: Position,
    /// Whether a last line without a line break is left for the next run, by which it may be whole.
    whole_only: bool,
}

impl Lines {
    /// - `whole_only`: whether a last line without a line break is left for the next run
    pub(super) fn open(file: &Path, whole_only: bool) -> Result<Self, Failure> {
        if file == Path::new("-") {
            let position = Position { file: None, bytes: 0, lines: 0 };
            return Ok(Self { from: Box::new(stdin().lock()), name: "standard input".into(), position, whole_only });
        }
        let name = file.display().to_string();
        let (opened, path) = File::open(file)
            .and_then(|opened| Ok((opened, file.canonicalize()?)))
            .map_err(|e| RecordError::CannotRead { file: name.clone(), reason: e.to_string() })?;
        let position = Position { file: Some(path), bytes: 0, lines: 0 };
        Ok(Self { from: Box::new(BufReader::new(opened)), name, position, whole_only })
    }

    /// The lines behind those that were read before, where this is the same file and has become no shorter; otherwise all of them.
    /// Of standard input all are new.
    pub(super) fn behind(mut self, before: &Position) -> Result<Self, Failure> {
        let Some(path) = self.position.file.as_ref().filter(|_| self.position.file == before.file) else {
            return Ok(self);
        };
        let unreadable = |e: std::io::Error| RecordError::CannotRead { file: self.name.clone(), reason: e.to_string() };
        let mut file = File::open(path).map_err(unreadable)?;
        if file.metadata().map_err(unreadable)?.len() >= before.bytes {
            file.seek(SeekFrom::Start(before.bytes)).map_err(unreadable)?;
            (self.from, self.position) = (Box::new(BufReader::new(file)), before.clone());
        }
        Ok(self)
    }

    /// Whether rows go on behind those of another run: those that it read after `before` come again.
    pub(super) fn goes_on_from(&self, before: &Position) -> bool {
        self.position == *before && self.position.file.is_some()
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn position(&self) -> &Position {
        &self.position
    }

    fn bytes(&mut self, to: &mut Vec<u8>) -> Result<bool, Failure> {
        let before = to.len();
        let read = (&mut self.from).take(MAX_LINE_BYTES as u64 + 1).read_until(b'\n', to);
        let read = read.map_err(|e| RecordError::CannotRead { file: self.name.clone(), reason: e.to_string() })?;
        if read > MAX_LINE_BYTES {
            let (file, line) = (self.name.clone(), self.position.lines + 1);
            return Err(RecordError::LongLine { file, line, most: MAX_LINE_BYTES }.into());
        }
        if read == 0 || (self.whole_only && to.last() != Some(&b'\n')) {
            to.truncate(before);
            return Ok(false);
        }
        self.position.lines += 1;
        self.position.bytes += read as u64;
        Ok(true)
    }

    /// Reads lines until `rows` of them hold data.
    pub(super) fn start(&mut self, rows: usize) -> Result<Table, Failure> {
        let mut text = Vec::new();
        let mut wanted = rows;
        loop {
            let mut goes_on = true;
            for _ in 0..wanted {
                goes_on = self.bytes(&mut text)?;
            }
            let table = Table::read(&text, &self.name)?;
            if table.rows() >= rows {
                return Ok(table);
            }
            if !goes_on {
                let (name, got) = (&self.name, table.rows());
                return Err(Failure::File(format!(
                    "{name}: --live needs {rows} rows to start, but there are only {got}: ask for fewer, or leave out --live"
                )));
            }
            wanted = rows - table.rows();
        }
    }

    /// The next line with its number, from 1.
    pub(super) fn next(&mut self) -> Result<Option<(usize, String)>, Failure> {
        let mut line = Vec::new();
        let is_one = self.bytes(&mut line)?;
        Ok(is_one.then(|| (self.position.lines, String::from_utf8_lossy(&line).into_owned())))
    }
}

//! A file in parts of whole lines, decoded: of the bytes no more is kept than the part.

use std::io::Read;

use encoding_rs::{UTF_8, WINDOWS_1252};

use crate::RecordError;
use crate::encoding;

/// Bytes that are looked at before the rest is read: some ten thousand rows of any logger.
const LOOK_BYTES: usize = 4 << 20;
/// Bytes that are read at a time afterwards.
const PART_BYTES: usize = 1 << 20;

/// The parts of a file.
pub(crate) struct Parts<'a, R> {
    reader: R,
    source: &'a str,
    /// What was read and not handed out: of the end of the last line the beginning.
    bytes: Vec<u8>,
    /// Bytes that were handed out.
    before: usize,
    is_at_end: bool,
    is_open: bool,
    /// Whether every byte so far is in both encodings the same.
    is_ascii: bool,
    encoding: &'static str,
}

impl<'a, R: Read> Parts<'a, R> {
    pub(crate) fn new(reader: R, source: &'a str) -> Self {
        Self {
            reader,
            source,
            bytes: Vec::new(),
            before: 0,
            is_at_end: false,
            is_open: false,
            is_ascii: true,
            encoding: UTF_8.name(),
        }
    }

    /// The lines to look at; `None` where the whole file has to be read at once: it is short, has no lines that end as lines of
    /// long files do, or is in UTF-16.
    pub(crate) fn first(&mut self) -> Result<Option<String>, RecordError> {
        self.read(LOOK_BYTES)?;
        let is_utf_16 = self.bytes.starts_with(&[0xFF, 0xFE]) || self.bytes.starts_with(&[0xFE, 0xFF]);
        let Some(end) = memchr::memrchr(b'\n', &self.bytes).filter(|_| !self.is_at_end && !is_utf_16) else {
            return Ok(None);
        };
        let (text, encoding) = encoding::decode(&self.bytes[..=end], self.source)?;
        let text = text.into_owned();
        (self.encoding, self.is_ascii) = (encoding, text.is_ascii());
        self.hand_out(end + 1);
        Ok(Some(text))
    }

    /// All bytes, where [`Self::first`] gave none.
    pub(crate) fn all(mut self) -> Result<Vec<u8>, RecordError> {
        self.reader.read_to_end(&mut self.bytes).map_err(|error| cannot_read(self.source, &error))?;
        Ok(self.bytes)
    }

    /// The next lines; `None` after the last.
    ///
    /// - `seen`: lines that were handed out, for messages
    pub(crate) fn next(&mut self, seen: usize) -> Result<Option<String>, RecordError> {
        let mut end = None;
        while end.is_none() && !self.is_at_end {
            let kept = self.bytes.len();
            self.read(kept + PART_BYTES)?;
            end = memchr::memrchr(b'\n', &self.bytes[kept..]).map(|end| kept + end + 1);
        }
        let end = if self.is_at_end { self.bytes.len() } else { end.unwrap_or(self.bytes.len()) };
        if end == 0 {
            return Ok(None);
        }
        if let Some(offset) = memchr::memchr(0, &self.bytes[..end]) {
            return Err(RecordError::Binary { file: self.source.to_owned(), offset: self.before + offset });
        }
        self.is_open = self.bytes[end - 1] != b'\n';
        let text = self.decode(end, seen)?;
        self.is_ascii &= text.is_ascii();
        self.hand_out(end);
        Ok(Some(text))
    }

    fn decode(&mut self, end: usize, seen: usize) -> Result<String, RecordError> {
        let bytes = &self.bytes[..end];
        if self.encoding == UTF_8.name() {
            match std::str::from_utf8(bytes) {
                Ok(text) => return Ok(text.to_owned()),
                Err(error) if !self.is_ascii => {
                    let lines = memchr::memchr_iter(b'\n', &bytes[..error.valid_up_to()]).count();
                    return Err(RecordError::EncodingChanges { file: self.source.to_owned(), line: seen + lines + 1 });
                }
                Err(_) => self.encoding = WINDOWS_1252.name(),
            }
        }
        Ok(WINDOWS_1252.decode_without_bom_handling(bytes).0.into_owned())
    }

    /// Whether no line break follows the last line.
    pub(crate) fn is_open(&self) -> bool {
        self.is_open
    }

    /// The name of the encoding.
    pub(crate) fn encoding(&self) -> &'static str {
        self.encoding
    }

    /// Reads until there are so many bytes, or no more.
    fn read(&mut self, wanted: usize) -> Result<(), RecordError> {
        let missing = wanted.saturating_sub(self.bytes.len());
        let read = self.reader.by_ref().take(missing as u64).read_to_end(&mut self.bytes);
        self.is_at_end |= read.map_err(|error| cannot_read(self.source, &error))? < missing;
        Ok(())
    }

    fn hand_out(&mut self, bytes: usize) {
        self.bytes.drain(..bytes);
        self.before += bytes;
    }
}

fn cannot_read(source: &str, error: &std::io::Error) -> RecordError {
    RecordError::CannotRead { file: source.to_owned(), reason: error.to_string() }
}

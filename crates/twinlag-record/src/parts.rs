//! A file in parts of whole lines, decoded: of the bytes no more is kept than the part.

use std::io::Read;

use encoding_rs::{Encoding, UTF_8};

use crate::RecordError;
use crate::table::MAX_LINE_BYTES;
use crate::{encoding, gzip};

/// Bytes that are looked at before the rest is read: some ten thousand rows of any logger.
const LOOK_BYTES: usize = 4 << 20;
/// Bytes that are read at a time afterwards.
const PART_BYTES: usize = 1 << 20;

/// The parts of a file.
pub(crate) struct Parts<'a, R> {
    reader: R,
    look_bytes: usize,
    part_bytes: usize,
    source: &'a str,
    /// What was read and not handed out: of the end of the last line the beginning.
    bytes: Vec<u8>,
    /// Bytes that were handed out.
    before: usize,
    is_at_end: bool,
    is_open: bool,
    /// Whether every byte so far is in both encodings the same.
    is_ascii: bool,
    encoding: &'static Encoding,
}

impl<'a, R: Read> Parts<'a, R> {
    pub(crate) fn new(reader: R, source: &'a str) -> Self {
        Self::with_limits(reader, source, LOOK_BYTES, PART_BYTES)
    }

    /// - `look_bytes`: that are looked at before the rest is read
    /// - `part_bytes`: that are read at a time afterwards
    pub(crate) fn with_limits(reader: R, source: &'a str, look_bytes: usize, part_bytes: usize) -> Self {
        Self {
            reader,
            look_bytes,
            part_bytes,
            source,
            bytes: Vec::new(),
            before: 0,
            is_at_end: false,
            is_open: false,
            is_ascii: true,
            encoding: UTF_8,
        }
    }

    /// The lines to look at; `None` where the whole file has to be read at once: it is short, has no lines that end as lines of
    /// long files do, or is in UTF-16.
    pub(crate) fn first(&mut self) -> Result<Option<String>, RecordError> {
        self.read(self.look_bytes)?;
        let is_utf_16 = self.bytes.starts_with(&[0xFF, 0xFE]) || self.bytes.starts_with(&[0xFE, 0xFF]);
        let Some(end) = memchr::memrchr(b'\n', &self.bytes).filter(|_| !self.is_at_end && !is_utf_16) else {
            return Ok(None);
        };
        if self.bytes.len() - end > MAX_LINE_BYTES {
            let line = memchr::memchr_iter(b'\n', &self.bytes).count() + 1;
            return Err(RecordError::LongLine { file: self.source.to_owned(), line, most: MAX_LINE_BYTES });
        }
        let (text, encoding) = encoding::decode(&self.bytes[..=end], self.source)?;
        let text = text.into_owned();
        (self.encoding, self.is_ascii) = (encoding, text.is_ascii());
        self.hand_out(end + 1);
        Ok(Some(text))
    }

    /// All bytes, where [`Self::first`] gave none.
    pub(crate) fn all(mut self) -> Result<Vec<u8>, RecordError> {
        self.reader.read_to_end(&mut self.bytes).map_err(|error| gzip::failure(self.source, &error))?;
        Ok(self.bytes)
    }

    /// The next lines; `None` after the last.
    ///
    /// - `seen`: lines that were handed out, for messages
    pub(crate) fn next(&mut self, seen: usize) -> Result<Option<String>, RecordError> {
        let mut end = None;
        while end.is_none() && !self.is_at_end {
            let kept = self.bytes.len();
            self.read(kept + self.part_bytes)?;
            end = memchr::memrchr(b'\n', &self.bytes[kept..]).map(|end| kept + end + 1);
            if end.is_none() && self.bytes.len() > MAX_LINE_BYTES {
                return Err(RecordError::LongLine {
                    file: self.source.to_owned(),
                    line: seen + 1,
                    most: MAX_LINE_BYTES,
                });
            }
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
        if self.encoding == UTF_8 {
            match std::str::from_utf8(bytes) {
                Ok(text) => return Ok(text.to_owned()),
                Err(error) if !self.is_ascii => {
                    let lines = memchr::memchr_iter(b'\n', &bytes[..error.valid_up_to()]).count();
                    return Err(RecordError::EncodingChanges { file: self.source.to_owned(), line: seen + lines + 1 });
                }
                Err(_) => self.encoding = encoding::of_letters(bytes),
            }
        }
        Ok(self.encoding.decode_without_bom_handling(bytes).0.into_owned())
    }

    /// Whether no line break follows the last line.
    pub(crate) fn is_open(&self) -> bool {
        self.is_open
    }

    /// The encoding so far.
    pub(crate) fn encoding(&self) -> &'static Encoding {
        self.encoding
    }

    /// Reads until there are so many bytes, or no more.
    fn read(&mut self, wanted: usize) -> Result<(), RecordError> {
        let missing = wanted.saturating_sub(self.bytes.len());
        let read = self.reader.by_ref().take(missing as u64).read_to_end(&mut self.bytes);
        self.is_at_end |= read.map_err(|error| gzip::failure(self.source, &error))? < missing;
        Ok(())
    }

    fn hand_out(&mut self, bytes: usize) {
        self.bytes.drain(..bytes);
        self.before += bytes;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a few bytes at a time, as a pipe does.
    struct Trickle<'a>(&'a [u8]);

    impl Read for Trickle<'_> {
        fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
            let count = out.len().min(7).min(self.0.len());
            out[..count].copy_from_slice(&self.0[..count]);
            self.0 = &self.0[count..];
            Ok(count)
        }
    }

    /// All parts of `bytes` one after the other, the first one apart.
    fn parts(
        bytes: &[u8],
        look_bytes: usize,
        part_bytes: usize,
    ) -> Result<(Option<String>, String, bool), RecordError> {
        let mut parts = Parts::with_limits(Trickle(bytes), "a pipe", look_bytes, part_bytes);
        let first = parts.first()?;
        let (mut rest, mut lines) = (String::new(), first.as_ref().map_or(0, |text| text.lines().count()));
        while let Some(part) = parts.next(lines)? {
            assert!(part.ends_with('\n') || parts.is_open(), "whole lines: '{part}'");
            lines += part.lines().count();
            rest += &part;
        }
        Ok((first, rest, parts.is_open()))
    }

    #[test]
    fn parts_are_whole_lines_and_make_up_the_text() {
        let text = (0..50).map(|k| format!("{k},{},21.5\n", 20 + k % 3)).collect::<Vec<_>>().concat();
        for (text, is_open) in [(text.clone(), false), (text + "50,20,2", true)] {
            for (look_bytes, part_bytes) in [(40, 1), (40, 3), (100, 64), (13, 500)] {
                let (first, rest, open) = parts(text.as_bytes(), look_bytes, part_bytes).expect("plain text");
                let first = first.expect("a line in the look");
                assert!(first.ends_with('\n') && first.len() <= look_bytes, "'{first}'");
                assert_eq!((first + &rest, open), (text.clone(), is_open), "{look_bytes} and {part_bytes} bytes");
            }
            assert_eq!(parts(text.as_bytes(), 10_000, 64).expect("plain text").0, None, "all of it is in the look");
        }
    }

    /// What the look showed is not so further on: a byte that no text has, another encoding than that of a letter before, with
    /// the place where it is. Letters that come first decide.
    #[test]
    fn what_differs_from_the_look_is_refused_with_its_place() {
        let line = "1,20.5,21\n";
        let with = |first: &[u8], place: usize, wrong: &[u8]| {
            let mut bytes = first.to_vec();
            (0..place).for_each(|_| bytes.extend_from_slice(line.as_bytes()));
            bytes.extend_from_slice(wrong);
            bytes.extend_from_slice(line.as_bytes());
            bytes
        };
        let binary = parts(&with(b"", 20, b"1,\0,21\n"), 40, 64).expect_err("a byte of zero");
        assert_eq!(binary, RecordError::Binary { file: "a pipe".into(), offset: 202 });
        let changes = parts(&with("t,°C,K\n".as_bytes(), 20, b"1,\xB0,21\n"), 40, 64).expect_err("not UTF-8");
        assert_eq!(changes, RecordError::EncodingChanges { file: "a pipe".into(), line: 22 });
        let (_, rest, _) = parts(&with(b"", 20, b"1,\xB0,21\n"), 40, 64).expect("the first letter that is not ASCII");
        assert!(rest.contains("1,°,21\n"), "{rest}");
    }
}

//! Where the bytes of a file are: on disk or in memory.

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::PathBuf;

use twinlag_record::gzip;

/// Most bytes from which the format is recognised: the entries of an archive and the attributes of
/// a root group stand among them.
const HEAD_BYTES: u64 = 64 * 1024;

/// The first bytes, enough to recognise the format.
fn head_of(plain: impl Read) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    plain.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(head)
}

/// The first bytes of a file in memory, of what gzip has compressed those within.
pub(crate) fn head_of_bytes(bytes: &[u8]) -> io::Result<Vec<u8>> {
    head_of(gzip::decompressed(bytes)?.0)
}

/// A file, or what was read of one.
#[derive(Debug)]
pub(crate) enum Input {
    Path(PathBuf),
    Bytes(Vec<u8>),
}

impl Input {
    /// Number of bytes.
    pub(crate) fn bytes(&self) -> io::Result<u64> {
        match self {
            Self::Path(path) => Ok(path.metadata()?.len()),
            Self::Bytes(bytes) => Ok(bytes.len() as u64),
        }
    }

    /// Its bytes in order, decompressed where gzip has compressed them, and whether it has.
    fn plain(&self) -> io::Result<(Box<dyn Read + '_>, bool)> {
        match self {
            Self::Path(path) => gzip::decompressed(File::open(path)?),
            Self::Bytes(bytes) => gzip::decompressed(bytes.as_slice()),
        }
    }

    /// The first bytes, enough to recognise the format; of what gzip has compressed those within.
    pub(crate) fn head(&self) -> io::Result<Vec<u8>> {
        head_of(self.plain()?.0)
    }

    /// What gzip has compressed, decompressed in memory; `None` of anything else.
    pub(crate) fn decompressed(&self) -> io::Result<Option<Self>> {
        let (mut plain, is_compressed) = self.plain()?;
        if !is_compressed {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        plain.read_to_end(&mut bytes)?;
        Ok(Some(Self::Bytes(bytes)))
    }

    /// A reader that can seek.
    pub(crate) fn stream(self) -> io::Result<Stream> {
        Ok(match self {
            Self::Path(path) => Stream::File(BufReader::new(File::open(path)?)),
            Self::Bytes(bytes) => Stream::Memory(Cursor::new(bytes)),
        })
    }
}

/// The bytes of a file in order or at any place.
#[derive(Debug)]
pub(crate) enum Stream {
    File(BufReader<File>),
    Memory(Cursor<Vec<u8>>),
}

impl Read for Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.read(buffer),
            Self::Memory(memory) => memory.read(buffer),
        }
    }
}

impl io::BufRead for Stream {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        match self {
            Self::File(file) => file.fill_buf(),
            Self::Memory(memory) => memory.fill_buf(),
        }
    }

    fn consume(&mut self, amount: usize) {
        match self {
            Self::File(file) => file.consume(amount),
            Self::Memory(memory) => memory.consume(amount),
        }
    }
}

impl Seek for Stream {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::File(file) => file.seek(to),
            Self::Memory(memory) => memory.seek(to),
        }
    }
}

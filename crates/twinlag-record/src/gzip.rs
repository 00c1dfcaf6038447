//! Files that are compressed by gzip, known by their first two bytes, not by their name.

use std::io::{self, BufReader, Cursor, ErrorKind, Read};

use flate2::bufread::MultiGzDecoder;

use crate::RecordError;

const FIRST_BYTES: [u8; 2] = [0x1F, 0x8B];

/// What `reader` gives, decompressed where it is compressed, and whether it was.
///
/// ```
/// use std::io::Read;
///
/// let (mut text, is_compressed) = twinlag_record::gzip::decompressed(&b"0,20,21"[..])?;
/// let mut all = String::new();
/// text.read_to_string(&mut all)?;
/// assert_eq!((all.as_str(), is_compressed), ("0,20,21", false));
/// # Ok::<(), std::io::Error>(())
/// ```
///
/// # Errors
/// Those of `reader`, of the first bytes; of the others when they are read.
pub fn decompressed<'a>(mut reader: impl Read + 'a) -> io::Result<(Box<dyn Read + 'a>, bool)> {
    let mut first = Vec::with_capacity(FIRST_BYTES.len());
    reader.by_ref().take(FIRST_BYTES.len() as u64).read_to_end(&mut first)?;
    let is_compressed = first == FIRST_BYTES;
    let whole = Cursor::new(first).chain(reader);
    Ok(if is_compressed {
        (Box::new(MultiGzDecoder::new(BufReader::new(whole))), true)
    } else {
        (Box::new(whole), false)
    })
}

/// Why nothing more can be read: kinds of errors that decompression alone has are those of a damaged file.
///
/// - `file`: its name in the message
pub fn failure(file: &str, error: &io::Error) -> RecordError {
    let (file, reason) = (file.to_owned(), error.to_string());
    match error.kind() {
        ErrorKind::UnexpectedEof => RecordError::CutGzip { file },
        ErrorKind::InvalidInput | ErrorKind::InvalidData => RecordError::DamagedGzip { file, reason },
        _ => RecordError::CannotRead { file, reason },
    }
}

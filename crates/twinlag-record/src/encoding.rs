//! From bytes to text: UTF-8 and UTF-16 by their byte-order marks, else UTF-8 if valid, else
//! Windows-1252, which every byte sequence is. Zero bytes outside UTF-16 are in no text file, so
//! that they mark a binary one.

use std::borrow::Cow;

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

use crate::RecordError;

/// The text of a file without its byte-order mark, and the name of its encoding.
///
/// # Errors
/// [`RecordError::Binary`].
pub(crate) fn decode<'a>(bytes: &'a [u8], file: &str) -> Result<(Cow<'a, str>, &'static str), RecordError> {
    if let Some((encoding, _)) = Encoding::for_bom(bytes)
        && (encoding == UTF_16LE || encoding == UTF_16BE)
    {
        return Ok((encoding.decode_with_bom_removal(bytes).0, encoding.name()));
    }
    if let Some(offset) = bytes.iter().position(|&byte| byte == 0) {
        return Err(RecordError::Binary { file: file.to_owned(), offset });
    }
    let body = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    Ok(match std::str::from_utf8(body) {
        Ok(text) => (Cow::Borrowed(text), UTF_8.name()),
        Err(_) => (WINDOWS_1252.decode_without_bom_handling(body).0, WINDOWS_1252.name()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes are spelt out from the code pages: `°` is U+00B0, C2 B0 in UTF-8, B0 in
    /// Windows-1252.
    #[test]
    fn each_encoding_gives_the_degree_sign() {
        let cases: [(&[u8], &str); 5] = [
            (b"\xC2\xB0C", "UTF-8"),
            (b"\xEF\xBB\xBF\xC2\xB0C", "UTF-8"),
            (b"\xB0C", "windows-1252"),
            (b"\xFF\xFE\xB0\x00C\x00", "UTF-16LE"),
            (b"\xFE\xFF\x00\xB0\x00C", "UTF-16BE"),
        ];
        for (bytes, name) in cases {
            let (text, encoding) = decode(bytes, "x").expect("text");
            assert_eq!((text.as_ref(), encoding), ("°C", name));
        }
    }

    #[test]
    fn zero_bytes_are_refused_with_their_place() {
        let got = decode(b"PK\x03\x04\x00", "x.xlsx").expect_err("binary");
        assert_eq!(got, RecordError::Binary { file: "x.xlsx".to_owned(), offset: 4 });
        assert!(got.to_string().contains("export"), "{got}");
    }
}

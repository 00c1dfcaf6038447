//! From bytes to text: UTF-8 and UTF-16 by their byte-order marks, else UTF-8 if valid, else Shift_JIS if the letters are likely in
//! it, else Windows-1252, which every byte sequence is. Zero bytes outside UTF-16 are in no text file, so that they mark a binary
//! one.

use std::borrow::Cow;

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::{Encoding, SHIFT_JIS, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

use crate::{RecordError, sea_bird};

/// The text of a file without its byte-order mark, and its encoding.
///
/// # Errors
/// [`RecordError::Binary`].
pub(crate) fn decode<'a>(bytes: &'a [u8], file: &str) -> Result<(Cow<'a, str>, &'static Encoding), RecordError> {
    if let Some((encoding, _)) = Encoding::for_bom(bytes)
        && (encoding == UTF_16LE || encoding == UTF_16BE)
    {
        return Ok((encoding.decode_with_bom_removal(bytes).0, encoding));
    }
    if let Some(offset) = bytes.iter().position(|&byte| byte == 0) {
        return Err(sea_bird::binary(&bytes[..offset], file)
            .unwrap_or_else(|| RecordError::Binary { file: file.to_owned(), offset }));
    }
    let body = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if let Ok(text) = std::str::from_utf8(body) {
        return Ok((Cow::Borrowed(text), UTF_8));
    }
    let encoding = of_letters(body);
    Ok((encoding.decode_without_bom_handling(body).0, encoding))
}

/// The encoding of bytes that are no UTF-8. Other encodings than these two are not guessed: the few letters of a header do not
/// distinguish them (the same bytes are Chinese in GBK and Japanese in EUC-JP), and a wrong guess would lose the `°` of a unit.
pub(crate) fn of_letters(bytes: &[u8]) -> &'static Encoding {
    let mut detector = EncodingDetector::new(Iso2022JpDetection::Deny);
    detector.feed(bytes, true);
    let guess = detector.guess(None, Utf8Detection::Deny);
    if guess == SHIFT_JIS { SHIFT_JIS } else { WINDOWS_1252 }
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
            assert_eq!((text.as_ref(), encoding.name()), ("°C", name));
        }
    }

    /// The bytes are those of Python's encoder.
    #[test]
    fn japanese_letters_are_told_from_western_ones() {
        let japanese = b"\x8e\x9e\x8d\x8f,\x89\xb7\x93x1(\x81\x8e),\x89\xb7\x93x2(\x81\x8e)\r\n0,20.1,21.3\r\n";
        let (text, encoding) = decode(japanese, "x").expect("text");
        assert_eq!((encoding.name(), text.lines().next()), ("Shift_JIS", Some("時刻,温度1(℃),温度2(℃)")));
    }

    #[test]
    fn signs_and_letters_of_the_west_stay_those_of_the_west() {
        for header in [
            "t;T1 [°C];T2 [°C]",
            "Zeit (µs);Fühler fein (°C);Fühler grob (°C)",
            "Ø 0,5 mm [°C]",
            "température (°C)",
            "°F",
            "25 °C ± 0,5",
        ] {
            let bytes = WINDOWS_1252.encode(header).0;
            let rows = [bytes.as_ref(), b"\r\n0;20,1;21,3\r\n"].concat();
            let (text, encoding) = decode(&rows, "x").expect("text");
            assert_eq!((encoding.name(), text.lines().next()), ("windows-1252", Some(header)));
        }
    }

    #[test]
    fn zero_bytes_are_refused_with_their_place() {
        let got = decode(b"PK\x03\x04\x00", "x.xlsx").expect_err("binary");
        assert_eq!(got, RecordError::Binary { file: "x.xlsx".to_owned(), offset: 4 });
        assert!(got.to_string().contains("export"), "{got}");
    }
}

//! Unpacks LZMA in a browser, which itself unpacks gzip alone.
//!
//! For the page of `cargo xtask web`, whose WebAssembly is packed by LZMA, a third smaller than by gzip. A program in Rust takes
//! `lzma-rust2`.
//!
//! ```
//! use std::io::Write;
//! use lzma_rust2::{LzmaOptions, LzmaWriter};
//!
//! let text = b"0.02 0.02 0.02 0.02";
//! let length = text.len() as u64;
//! let mut writer = LzmaWriter::new_use_header(Vec::new(), &LzmaOptions::with_preset(9), Some(length))?;
//! writer.write_all(text)?;
//! assert_eq!(twinlag_unpack::unpacked(&writer.finish()?)?, text);
//! # Ok::<(), std::io::Error>(())
//! ```

use std::io::{self, Read};

use lzma_rust2::LzmaReader;
use wasm_bindgen::JsError;
use wasm_bindgen::prelude::wasm_bindgen;

/// What was packed.
///
/// - `packed`: LZMA with the header of `.lzma` files, in which the unpacked length stands
///
/// # Errors
/// Bytes that are no LZMA, or are cut off.
pub fn unpacked(packed: &[u8]) -> io::Result<Vec<u8>> {
    let mut plain = Vec::new();
    LzmaReader::new_mem_limit(packed, u32::MAX, None)?.read_to_end(&mut plain)?;
    Ok(plain)
}

/// [`unpacked`] for JavaScript, where an error is thrown.
///
/// # Errors
/// As [`unpacked`].
#[wasm_bindgen]
pub fn unpack(packed: &[u8]) -> Result<Vec<u8>, JsError> {
    unpacked(packed).map_err(|error| JsError::new(&error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::unpacked;

    #[test]
    fn what_is_no_lzma_or_is_cut_off_is_refused() {
        for damaged in [&b""[..], b"<html>", &[0x5d, 0, 0, 128, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 24]] {
            assert!(unpacked(damaged).is_err(), "{damaged:?}");
        }
    }
}

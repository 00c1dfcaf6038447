//! Numbers and texts of a segment's metadata.

use crate::fault::Fault;

/// Bytes that are taken from the front.
#[derive(Debug)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    /// Where in the file the next byte stands.
    position: u64,
    is_big_endian: bool,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], position: u64, is_big_endian: bool) -> Self {
        Self { bytes, position, is_big_endian }
    }

    pub(super) fn position(&self) -> u64 {
        self.position
    }

    pub(super) fn is_big_endian(&self) -> bool {
        self.is_big_endian
    }

    pub(super) fn take(&mut self, count: u64) -> Result<&'a [u8], Fault> {
        let split = usize::try_from(count).ok().and_then(|count| self.bytes.split_at_checked(count));
        let Some((taken, rest)) = split else {
            let expected = format!("{count} bytes of metadata");
            return Err(Fault::damaged_at(self.position, expected, format!("{} in the segment", self.bytes.len())));
        };
        self.bytes = rest;
        self.position += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64)?);
        Ok(array)
    }

    pub(super) fn u32(&mut self) -> Result<u32, Fault> {
        let bytes = self.array()?;
        Ok(if self.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    pub(super) fn u64(&mut self) -> Result<u64, Fault> {
        let bytes = self.array()?;
        Ok(if self.is_big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) })
    }

    pub(super) fn text(&mut self) -> Result<String, Fault> {
        let length = self.u32()?;
        // Text is UTF-8; units of old files are in Windows' code page, of which `°` is met.
        Ok(String::from_utf8_lossy(self.take(length.into())?).into_owned())
    }
}

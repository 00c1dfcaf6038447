//! SHA-256.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use base16ct::lower::encode_string;
use sha2::{Digest as _, Sha256};

/// Bytes that are read at once; chosen, so that a file of any length takes little memory.
const READ_BYTES: usize = 1 << 16;

/// Bytes of a SHA-256.
const DIGEST_BYTES: usize = 32;

/// A SHA-256, which stands for what is too long to be kept of every unit.
pub(crate) type Digest = [u8; DIGEST_BYTES];

/// The SHA-256 of bytes.
pub(crate) fn digest(bytes: &[u8]) -> Digest {
    Sha256::digest(bytes).into()
}

/// The SHA-256 of bytes, in hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    encode_string(&digest(bytes))
}

/// The SHA-256 of a file, in hexadecimal digits.
///
/// # Errors
/// Those of reading; a pipe or a device, which may have no end, is refused.
pub fn sha256_of_file(path: &Path) -> io::Result<String> {
    if !path.metadata()?.is_file() {
        return Err(io::ErrorKind::Unsupported.into());
    }
    let (mut file, mut hasher, mut bytes) = (File::open(path)?, Sha256::new(), vec![0; READ_BYTES]);
    loop {
        match file.read(&mut bytes) {
            Ok(0) => return Ok(encode_string(&hasher.finalize())),
            Ok(read) => hasher.update(&bytes[..read]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::sha256_of_file;

    /// The example of FIPS 180-4: the three letters abc.
    #[test]
    fn the_hash_is_that_of_the_standard() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("abc");
        std::fs::write(&path, "abc").expect("can be written");
        let want = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_of_file(&path).expect("can be read"), want);
        assert!(sha256_of_file(folder.path()).is_err());
    }
}

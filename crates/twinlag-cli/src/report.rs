//! What a report says of its own making.

use std::fmt::Write as _;
use std::fs::File;
use std::io;
use std::path::Path;

use jiff::Timestamp;
use sha2::{Digest, Sha256};
use twinlag_pages::Making;

use crate::output::command_line;

/// The command, the instant, and the hash of each file; a pipe has none.
///
/// - `is_static`: whether the page is to have no script
pub(crate) fn making(files: &[impl AsRef<Path>], is_static: bool) -> Making {
    let hashed = files.iter().filter_map(|file| {
        let file = file.as_ref();
        Some((file.file_name()?.to_string_lossy().into_owned(), hash(file).ok()?))
    });
    Making {
        command: command_line(),
        made_at: Timestamp::now().strftime("%Y-%m-%d %H:%M UTC").to_string(),
        files: hashed.collect(),
        is_static,
    }
}

/// SHA-256 of a file, in hexadecimal digits.
fn hash(path: &Path) -> io::Result<String> {
    if !path.metadata()?.is_file() {
        return Err(io::ErrorKind::Unsupported.into());
    }
    let mut hasher = Sha256::new();
    io::copy(&mut File::open(path)?, &mut HashWriter(&mut hasher))?;
    let hexadecimal = |mut text: String, byte: &u8| {
        let _ = write!(text, "{byte:02x}");
        text
    };
    Ok(hasher.finalize().iter().fold(String::new(), hexadecimal))
}

struct HashWriter<'a>(&'a mut Sha256);

impl io::Write for HashWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::hash;

    /// The example of FIPS 180-4: the three letters abc.
    #[test]
    fn the_hash_is_that_of_the_standard() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("abc");
        std::fs::write(&path, "abc").expect("can be written");
        let want = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hash(&path).expect("can be read"), want);
        assert!(hash(folder.path()).is_err());
    }
}

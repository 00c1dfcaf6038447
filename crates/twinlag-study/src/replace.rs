//! Files that are there whole or not at all.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;

use tempfile::Builder;

/// Writes a file, in place of an older one if there is one. At every moment there is the old file or the new one, whoever else writes it;
/// the new one has the permissions of any new file.
///
/// A process that is killed here leaves a file `<path>.tmp-*` behind, which can be deleted.
///
/// # Errors
/// Those of writing.
pub fn replace_file(path: &Path, content: &[u8]) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut prefix = path.file_name().unwrap_or_default().to_owned();
    prefix.push(".tmp-");
    let new = |path: &Path| File::options().write(true).create_new(true).open(path);
    let mut file = Builder::new().prefix(&prefix).make_in(folder, new)?;
    file.write_all(content)?;
    // Else a power failure could leave the new name with no content.
    file.as_file().sync_all()?;
    file.persist(path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        for content in ["a longer text", "short"] {
            replace_file(&path, content.as_bytes()).expect("can be written");
            assert_eq!(std::fs::read(&path).expect("is there"), content.as_bytes());
        }
        assert_eq!(std::fs::read_dir(folder.path()).expect("is there").count(), 1);
        assert!(replace_file(&folder.path().join("no/file"), b"").is_err());
    }
}

//! A lock: one process at a time writes a part.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use crate::error::StudyError;

/// Most times that a file is locked which another process has just removed; chosen: more than ever happens.
const MAX_TRIES: u32 = 100;

/// The right to write a part, as long as this lives.
///
/// A part is replaced, so that a lock on the file itself would be lost with the first checkpoint: the lock is on a file beside it,
/// `<part>.lock`, which is removed at the end. On a file system without locks, each process has the right.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
    path: PathBuf,
}

impl Lock {
    /// Takes the right to write a part.
    ///
    /// # Errors
    /// [`StudyError::Busy`] if another process has it; [`StudyError::Write`].
    pub(crate) fn of(part: &Path) -> Result<Self, StudyError> {
        let mut path = part.as_os_str().to_owned();
        path.push(".lock");
        let path = PathBuf::from(path);
        let unwritable = |cause| StudyError::Write { path: path.clone(), cause };
        for _ in 0..MAX_TRIES {
            let file = File::options().write(true).create(true).truncate(false).open(&path).map_err(unwritable)?;
            match file.try_lock() {
                Ok(()) | Err(TryLockError::Error(_)) => {}
                Err(TryLockError::WouldBlock) => return Err(StudyError::Busy { path: part.to_owned() }),
            }
            // Another process may have had it, and have removed the file between the opening and the lock.
            let is_there = same_file::Handle::from_path(&path)
                .and_then(|there| Ok(there == same_file::Handle::from_file(file.try_clone()?)?));
            match is_there {
                Ok(true) => return Ok(Self { file, path }),
                Ok(false) => {}
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
                Err(cause) => return Err(unwritable(cause)),
            }
        }
        Err(StudyError::Busy { path: part.to_owned() })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Removed while it is locked, so that nobody holds a file of that name. What is left behind does no harm.
        let _ = fs::remove_file(&self.path);
        let _ = self.file.unlock();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_process_has_the_right_at_a_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let part = folder.path().join("part-0-of-1.json");
        let lock = Lock::of(&part).expect("free");
        assert!(matches!(Lock::of(&part), Err(StudyError::Busy { path }) if path == part));
        drop(lock);
        assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 0);
        drop(Lock::of(&part).expect("free again"));
    }

    /// Many at once: never two of them have it.
    #[test]
    fn the_right_is_handed_over_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let part = folder.path().join("part-0-of-1.json");
        let holders = std::sync::atomic::AtomicU32::new(0);
        let had = std::sync::atomic::AtomicU32::new(0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        let Ok(lock) = Lock::of(&part) else { continue };
                        assert_eq!(holders.fetch_add(1, std::sync::atomic::Ordering::SeqCst), 0);
                        had.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
                        std::thread::yield_now();
                        holders.fetch_sub(1, std::sync::atomic::Ordering::SeqCst);
                        drop(lock);
                    }
                });
            }
        });
        assert!(had.into_inner() > 0);
    }
}

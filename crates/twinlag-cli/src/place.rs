//! Where results are kept: a folder that this machine sees, or a prefix of an object store.
//!
//! What is stored elsewhere is worked on in a folder of this machine, and is stored again when it is done, and every some seconds. The rest of
//! the program sees paths of that folder; messages and answers name what the user has named.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use twinlag_objects::{ObjectsError, Store, WorkingCopy};

use crate::failure::Failure;
use crate::output::folder_of;

/// How long what is done may be on this machine alone while there is more to do; chosen: no more is lost if the machine is, and stores
/// charge for each time.
const STORED_EVERY: Duration = Duration::from_secs(10);
/// How many times as long as it took to store is waited before the next time, at least; chosen: storing takes one part in twenty.
const WAIT_FACTOR: u32 = 20;

/// A place of results.
#[derive(Debug)]
pub(crate) struct Place {
    /// As the user named it.
    given: PathBuf,
    /// Of what is in an object store.
    copy: Option<WorkingCopy>,
    /// When what is done is to be stored again.
    next: Instant,
}

/// Whether a path is a URL.
pub(crate) fn is_url(path: &Path) -> bool {
    path.to_str().is_some_and(Store::is_url)
}

/// Works in a place. What it says of files names them as the user would.
pub(crate) fn at(given: &Path, work: impl FnOnce(&mut Place) -> Result<u8, Failure>) -> Result<u8, Failure> {
    let mut place = Place::open(given)?;
    work(&mut place).map_err(|failure| place.said(failure))
}

impl Place {
    /// A place as the user has named it.
    pub(crate) fn open(given: &Path) -> Result<Self, Failure> {
        let url = given.to_str().filter(|_| is_url(given));
        let copy = url.map(|url| WorkingCopy::open(&Store::of_url(url)?)).transpose()?;
        Ok(Self { given: given.to_owned(), copy, next: Instant::now() + STORED_EVERY })
    }

    /// Whether it is in an object store.
    pub(crate) fn is_stored(&self) -> bool {
        self.copy.is_some()
    }

    /// The folder to work in.
    pub(crate) fn folder(&self) -> &Path {
        self.copy.as_ref().map_or(&self.given, WorkingCopy::folder)
    }

    /// The names of all that is there, fetched or not; of no folder there are none.
    pub(crate) fn names(&self) -> std::io::Result<Vec<String>> {
        if let Some(copy) = &self.copy {
            return Ok(copy.names().map(str::to_owned).collect());
        }
        let entries = match self.given.read_dir() {
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                return Ok(Vec::new());
            }
            entries => entries?,
        };
        let name = |entry: std::io::Result<std::fs::DirEntry>| Ok(entry?.file_name().into_string().ok());
        entries.filter_map(|entry| name(entry).transpose()).collect()
    }

    /// Brings what is stored into the folder.
    pub(crate) fn fetch(&mut self, is_wanted: impl Fn(&str) -> bool) -> Result<(), Failure> {
        Ok(self.copy.as_mut().map_or(Ok(()), |copy| copy.fetch(is_wanted))?)
    }

    /// Stores a file of the folder. What cannot be stored is kept on this machine.
    pub(crate) fn store(&mut self, path: &Path) -> Result<(), Failure> {
        let (Some(copy), Some(name)) = (&mut self.copy, name_in(path)) else { return Ok(()) };
        match copy.store(name) {
            Err(error @ ObjectsError::Write { .. }) => {
                let kept = self.copy.take().map(WorkingCopy::keep).unwrap_or_default();
                Err(Failure::Other(format!("{error}; it is kept in {}: copy it from there", kept.display())))
            }
            stored => Ok(stored?),
        }
    }

    /// Stores a file of which there is more to come, if it is time. A store that cannot be reached gets it another time.
    ///
    /// # Errors
    /// If another process writes the same.
    pub(crate) fn store_so_far(&mut self, path: &Path) -> Result<(), Failure> {
        let (Some(copy), Some(name)) = (&mut self.copy, name_in(path)) else { return Ok(()) };
        let start = Instant::now();
        if start < self.next || !path.exists() {
            return Ok(());
        }
        let stored = copy.store(name);
        self.next = Instant::now() + STORED_EVERY.max(start.elapsed() * WAIT_FACTOR);
        match stored {
            Err(error @ ObjectsError::Changed { .. }) => Err(error.into()),
            _ => Ok(()),
        }
    }

    /// Stores a file that whoever comes first makes: if another process was first, what that has made takes its place.
    pub(crate) fn store_first(&mut self, path: &Path) -> Result<(), Failure> {
        let (Some(copy), Some(name)) = (&mut self.copy, name_in(path)) else { return Ok(()) };
        match copy.store(name) {
            Err(ObjectsError::Changed { .. }) => {
                let mut theirs = WorkingCopy::open(copy.place())?;
                theirs.fetch(|is| is == name)?;
                std::fs::copy(theirs.folder().join(name), path)
                    .map_err(|error| Failure::Other(format!("{}: cannot be written: {error}", path.display())))?;
                Ok(())
            }
            stored => Ok(stored?),
        }
    }

    /// What the user would call a file of the folder, or the folder.
    pub(crate) fn named(&self, path: &Path) -> PathBuf {
        match path.strip_prefix(self.folder()) {
            Ok(name) if name.as_os_str().is_empty() => self.given.clone(),
            Ok(name) => self.given.join(name),
            Err(_) => path.to_owned(),
        }
    }

    /// A failure, as the user would call its files.
    pub(crate) fn said(&self, failure: Failure) -> Failure {
        let (Some(copy), Some(given)) = (&self.copy, self.given.to_str()) else { return failure };
        let given = given.trim_end_matches('/');
        match copy.folder().to_str() {
            Some(folder) => failure.reworded(|text| text.replace(folder, given)),
            None => failure,
        }
    }
}

fn name_in(path: &Path) -> Option<&str> {
    path.file_name()?.to_str()
}

/// A file of this machine, or one that is fetched: its place, and its path in that.
pub(crate) fn file(path: &Path) -> Result<(Place, PathBuf), Failure> {
    let (folder, name) = (folder_of(path), path.file_name().map(OsString::from).unwrap_or_default());
    let mut place = Place::open(folder)?;
    place.fetch(|is| *is == *name)?;
    let path = if place.is_stored() { place.folder().join(name) } else { path.to_owned() };
    Ok((place, path))
}

/// What says where a store is.
const VARIABLES: &str =
    "variables AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION, AWS_ALLOW_HTTP";

/// What is elsewhere cannot be used, or is in the hands of another process.
impl From<ObjectsError> for Failure {
    fn from(error: ObjectsError) -> Self {
        let text = error.to_string();
        match error {
            ObjectsError::NoUrl { .. } | ObjectsError::NotBuilt { .. } => Self::Usage(text),
            ObjectsError::Changed { .. } => Self::NotYet(text),
            ObjectsError::Read { .. } => Self::File(format!("{text} ({VARIABLES})")),
            _ => Self::Other(text),
        }
    }
}

//! Where results are kept: a folder that this machine sees, or a prefix of an object store.
//!
//! Results in a store are worked on in a temporary folder, and are stored while the work goes on and at its end. The rest of the program
//! sees paths of that folder; messages and answers name what the user has named.

use std::io::ErrorKind;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use twinlag_objects::{ObjectsError, Prefix, WorkingCopy};

use crate::console::Console;
use crate::failure::Failure;
use crate::output::{folder_of, with_ending};

/// The time between two uploads of a growing file; chosen: a lost machine loses no more, and stores charge for each.
const STORED_EVERY: Duration = Duration::from_secs(10);
/// How many times as long as an upload has taken is waited before the next, at least; chosen: uploads take one part in twenty of the time.
const WAIT_FACTOR: u32 = 20;
/// The longest that an upload may keep others waiting while the work goes on; chosen: half of the time between two of them.
const UPLOAD_LIMIT: Duration = Duration::from_secs(5);
/// How the folder of what was submitted to a cluster ends on this machine, of results that are in a store.
const SUBMISSION_ENDING: &str = ".submission";
/// How a text begins that is meant as a URL of S3, even with slashes missing or in capitals.
const S3_START: &str = "s3:";
/// What says where a store is and who asks.
const VARIABLES: [&str; 5] =
    ["AWS_ENDPOINT_URL", "AWS_REGION", "AWS_ALLOW_HTTP", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"];

/// A place of results.
#[derive(Debug)]
pub(crate) struct Place {
    /// As the user named it.
    given: PathBuf,
    /// Of what is in an object store.
    copy: Option<WorkingCopy>,
    /// When a growing file is to be stored again.
    next: Instant,
    /// Whether the user knows that it could not be stored.
    is_noted: bool,
    /// Why nothing more can be stored.
    failed: Option<Failure>,
}

/// Whether a path is meant as a URL.
pub(crate) fn is_url(path: &Path) -> bool {
    let is_nearly = |text: &str| text.get(..S3_START.len()).is_some_and(|start| start.eq_ignore_ascii_case(S3_START));
    path.to_str().is_some_and(|text| Prefix::is_url(text) || is_nearly(text))
}

/// Refuses a URL where only a file of this machine can be.
pub(crate) fn expect_file(path: &Path) -> Result<(), Failure> {
    if is_url(path) {
        let path = path.display();
        return Err(Failure::Usage(format!(
            "{path}: expected a path of this machine; results of studies and batches alone may be in an object store"
        )));
    }
    Ok(())
}

/// The folder or the prefix of a file, and its name.
pub(crate) fn split(path: &Path) -> (PathBuf, String) {
    let of_url = path.to_str().filter(|_| is_url(path)).and_then(|url| url.rsplit_once('/'));
    match of_url {
        Some((prefix, name)) => (prefix.into(), name.to_owned()),
        None => (folder_of(path).to_owned(), path.file_name().unwrap_or_default().to_string_lossy().into_owned()),
    }
}

/// The text of a file of this machine, or of an object.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    let name = path.display();
    if !is_url(path) {
        return std::fs::read_to_string(path).map_err(|e| Failure::File(format!("{name}: cannot be read: {e}")));
    }
    let (prefix, object) = split(path);
    let content = Prefix::of_url(&prefix.to_string_lossy())?.read(&object)?;
    let content = content.ok_or_else(|| Failure::File(format!("{name}: there is no such object")))?;
    String::from_utf8(content).map_err(|_| Failure::File(format!("{name}: is no text")))
}

/// Opens a place and works in it; failures name files as the user did.
pub(crate) fn at(given: &Path, work: impl FnOnce(&mut Place) -> Result<u8, Failure>) -> Result<u8, Failure> {
    let mut place = Place::open(given)?;
    work(&mut place).map_err(|failure| place.said(failure))
}

impl Place {
    /// A place as the user has named it.
    fn open(given: &Path) -> Result<Self, Failure> {
        let url = given.to_str().filter(|_| is_url(given));
        let copy = url.map(|url| WorkingCopy::open(&Prefix::of_url(url)?)).transpose()?;
        Ok(Self { given: given.to_owned(), copy, next: Instant::now() + STORED_EVERY, is_noted: false, failed: None })
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
    pub(crate) fn names(&self) -> Result<Vec<String>, Failure> {
        if let Some(copy) = &self.copy {
            return Ok(copy.names().map(str::to_owned).collect());
        }
        let unreadable =
            |error: std::io::Error| Failure::File(format!("{}: cannot be read: {error}", self.given.display()));
        let entries = match self.given.read_dir() {
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                return Ok(Vec::new());
            }
            entries => entries.map_err(unreadable)?,
        };
        let name =
            |entry: std::io::Result<std::fs::DirEntry>| Ok(entry.map_err(unreadable)?.file_name().into_string().ok());
        entries.filter_map(|entry| name(entry).transpose()).collect()
    }

    /// Brings what is stored into the folder.
    pub(crate) fn fetch(&mut self, is_wanted: impl Fn(&str) -> bool) -> Result<(), Failure> {
        Ok(self.copy.as_mut().map_or(Ok(()), |copy| copy.fetch(is_wanted))?)
    }

    /// The copy, and the name in it of a file that belongs into the store.
    fn stored<'a>(&mut self, path: &'a Path) -> Option<(&mut WorkingCopy, &'a str)> {
        let copy = self.copy.as_mut()?;
        let name = path.strip_prefix(copy.folder()).ok()?.to_str()?;
        Some((copy, name))
    }

    /// Stores a file of the folder; one elsewhere on this machine stays where it is.
    ///
    /// # Errors
    /// Why the file could not be stored, now or at the last [`Self::store_so_far`].
    pub(crate) fn store(&mut self, path: &Path) -> Result<(), Failure> {
        if let Some(failure) = self.failed.take() {
            return Err(failure);
        }
        let Some((copy, name)) = self.stored(path) else { return Ok(()) };
        let stored = copy.store(name);
        stored.map_err(|error| self.kept(error))
    }

    /// Stores a growing file, if it is time. If the store cannot be reached, a later call tries again; any other failure breaks, and
    /// [`Self::store`] returns it.
    pub(crate) fn store_so_far(&mut self, path: &Path, console: Console) -> ControlFlow<()> {
        let start = Instant::now();
        if start >= self.next
            && path.exists()
            && let Some((copy, name)) = self.stored(path)
        {
            let stored = copy.store_at_once(name, UPLOAD_LIMIT);
            let end = Instant::now();
            self.next = end + STORED_EVERY;
            match stored {
                Ok(()) => self.next = end + STORED_EVERY.max((end - start) * WAIT_FACTOR),
                Err(error @ ObjectsError::Away { .. }) => {
                    if !std::mem::replace(&mut self.is_noted, true) {
                        console.note(|| format!("not stored yet: {error}"));
                    }
                }
                Err(error) => self.failed = Some(self.kept(error)),
            }
        }
        if self.failed.is_none() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    /// The failure of what could not be stored; what only this machine has is kept.
    fn kept(&mut self, error: ObjectsError) -> Failure {
        let is_lost =
            matches!(error, ObjectsError::Write { .. } | ObjectsError::Away { .. } | ObjectsError::Removed { .. });
        let failure = Failure::from(error);
        match self.copy.take_if(|_| is_lost) {
            None => failure,
            Some(copy) => {
                let kept = copy.keep();
                failure.reworded(|text| format!("{text}; what could not be stored is kept in {}", kept.display()))
            }
        }
    }

    /// Stores a file that whoever comes first makes: if another process was first, what that has made takes its place.
    pub(crate) fn store_first(&mut self, path: &Path) -> Result<(), Failure> {
        let Some((copy, name)) = self.stored(path) else { return Ok(()) };
        Ok(copy.store_first(name)?)
    }

    /// What the user would call a file of the folder, or the folder.
    pub(crate) fn named(&self, path: &Path) -> PathBuf {
        let within = self.copy.as_ref().and_then(|copy| Some((copy, path.strip_prefix(copy.folder()).ok()?.to_str()?)));
        match within {
            None => path.to_owned(),
            Some((_, "")) => self.given.clone(),
            Some((copy, name)) => copy.prefix().url_of(name).into(),
        }
    }

    /// A failure whose message names files as the user would.
    pub(crate) fn said(&self, failure: Failure) -> Failure {
        let (Some(copy), Some(given)) = (&self.copy, self.given.to_str()) else { return failure };
        let given = given.trim_end_matches('/');
        match copy.folder().to_str() {
            Some(folder) => failure.reworded(|text| text.replace(folder, given)),
            None => failure,
        }
    }

    /// The folder of what is submitted to a cluster; of results in a store it is in the folder in which the program runs, with bucket and
    /// prefix in its name.
    ///
    /// - `results`: the folder of the results, or their table
    /// - `beside`: where it is otherwise
    pub(crate) fn scripts(&self, results: &Path, beside: PathBuf) -> PathBuf {
        if !self.is_stored() {
            return beside;
        }
        let named = self.named(results).to_string_lossy().into_owned();
        let (_, name) = named.split_once("://").unwrap_or(("", &named));
        with_ending(Path::new(&name.trim_end_matches('/').replace('/', "+")), SUBMISSION_ENDING)
    }
}

/// What a store cannot give or take is a matter of the file, of the call, or of the time.
impl From<ObjectsError> for Failure {
    fn from(error: ObjectsError) -> Self {
        let text = error.to_string();
        match error {
            ObjectsError::BadUrl { .. } | ObjectsError::NotBuilt { .. } => Self::Usage(text),
            ObjectsError::Changed { .. } => Self::NotYet(text),
            ObjectsError::Away { .. } => Self::NotYet(text + &variables()),
            ObjectsError::Read { .. } | ObjectsError::Unusable { .. } => Self::File(text + &variables()),
            ObjectsError::Unconditional { .. } => Self::File(text),
            ObjectsError::Write { .. } => Self::Other(text + &variables()),
            _ => Self::Other(text),
        }
    }
}

/// Which variables say where a store is, and which of them are missing.
fn variables() -> String {
    let missing: Vec<&str> = VARIABLES.into_iter().filter(|name| std::env::var_os(name).is_none()).collect();
    let missing = if missing.is_empty() { String::new() } else { format!("; not set: {}", missing.join(", ")) };
    format!(" (the variables {} say where the store is and who asks{missing})", VARIABLES.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A place in memory, as if the user had named the URL.
    fn place(prefix: &Prefix) -> Place {
        let copy = Some(WorkingCopy::open(prefix).expect("can be listed"));
        Place { given: "s3://lab/bias".into(), copy, next: Instant::now(), is_noted: false, failed: None }
    }

    const QUIET: Console = Console { json: false, quiet: true };

    #[test]
    fn what_is_nearly_a_url_is_no_path() {
        for url in ["s3://lab/a", "s3:/lab/a", "S3:lab", "gs://lab/a"] {
            assert!(is_url(Path::new(url)) && expect_file(Path::new(url)).is_err(), "{url}");
            assert!(Place::open(Path::new(url)).is_err(), "{url}");
        }
        assert!(expect_file(Path::new("runs/s3:/a")).is_ok());
        assert_eq!(split(Path::new("s3://lab/a/t.csv")), ("s3://lab/a".into(), "t.csv".to_owned()));
        assert_eq!(split(Path::new("t.csv")), (".".into(), "t.csv".to_owned()));
    }

    #[test]
    fn files_have_the_names_that_the_user_knows() {
        let place = place(&Prefix::in_memory("s3://lab/bias"));
        let part = place.folder().join("part-0-of-2.json");
        assert_eq!(place.named(&part), Path::new("s3://lab/bias/part-0-of-2.json"));
        assert_eq!(place.named(place.folder()), Path::new("s3://lab/bias"));
        assert_eq!(place.named(Path::new("report.html")), Path::new("report.html"));
        let failure = place.said(Failure::File(format!("{}: is damaged", part.display())));
        assert_eq!(failure.to_string(), "s3://lab/bias/part-0-of-2.json: is damaged");
        let scripts = place.scripts(place.folder(), "elsewhere".into());
        assert_eq!(scripts, Path::new("lab+bias.submission"));
    }

    #[test]
    fn outputs_elsewhere_stay_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let report = folder.path().join("report.html");
        std::fs::write(&report, "a page").expect("can be written");
        let mut place = place(&Prefix::in_memory("s3://lab/bias"));
        place.store(&report).expect("nothing to do");
        assert_eq!(place.names().expect("listed"), Vec::<String>::new());
    }

    /// Failed: it was taken for an empty one, and shards of two divisions ran beside each other.
    #[cfg(unix)]
    #[test]
    fn a_folder_that_cannot_be_read_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&link, &link).expect("a link to itself");
        let failure = Place::open(&link).expect("no URL").names().expect_err("nothing is there");
        let expected = format!("{}: cannot be read", link.display());
        assert!(failure.to_string().starts_with(&expected), "{failure}");
    }

    #[test]
    fn a_part_is_stored_while_it_grows_unless_another_process_has_it() {
        let prefix = Prefix::in_memory("s3://lab/bias");
        let (mut one, mut other) = (place(&prefix), place(&prefix));
        for (place, content) in [(&mut one, "one"), (&mut other, "other")] {
            std::fs::write(place.folder().join("part"), content).expect("can be written");
        }
        assert!(one.store_so_far(&one.folder().join("part"), QUIET).is_continue());
        assert!(one.next > Instant::now());
        let part = other.folder().join("part");
        assert!(other.store_so_far(&part, QUIET).is_break());
        // The failure of that upload, and not that of a second one, which would find no file.
        std::fs::remove_file(&part).expect("there");
        assert_eq!(other.store(&part).map_err(|failure| failure.exit_code()), Err(75));
        std::fs::write(&part, "other").expect("can be written");
        assert_eq!(prefix.read("part").expect("there").as_deref(), Some(&b"one"[..]));
        other.store_first(&part).expect("theirs");
        assert_eq!(std::fs::read(&part).expect("there"), b"one");
    }
}

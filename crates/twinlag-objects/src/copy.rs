//! The working copy.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use bytes::Bytes;
use futures_util::{StreamExt as _, TryStreamExt as _, stream};
use object_store::{Error, ObjectMeta, ObjectStore as _, ObjectStoreExt as _, PutMode, UpdateVersion};
use sha2::{Digest as _, Sha256};
use tempfile::TempDir;
use tokio::runtime::{Builder, Runtime};

use crate::error::ObjectsError;
use crate::store::Store;

/// How many objects are fetched at once; chosen: a store answers in some ten milliseconds, whatever it is asked.
const FETCHED_AT_ONCE: usize = 32;
/// How often a request is made in all that fails for another reason than what it asks; chosen, each with what the client repeats itself.
const MAX_TRIES: u32 = 4;
/// The wait before the second try, which doubles from one to the next; chosen.
const FIRST_WAIT: Duration = Duration::from_millis(200);

/// A folder on this machine with some of the files that are stored under a prefix.
///
/// It is removed with this value, and so is what has not been stored: see [`Self::keep`].
#[derive(Debug)]
pub struct WorkingCopy {
    store: Store,
    folder: TempDir,
    runtime: Runtime,
    /// What is stored, as this copy has last seen it.
    seen: BTreeMap<String, Seen>,
}

#[derive(Clone, Debug)]
struct Seen {
    version: UpdateVersion,
    /// Of its content, if this copy has had it.
    sha256: Option<[u8; 32]>,
}

impl Seen {
    fn of(content: &[u8], version: UpdateVersion) -> Self {
        Self { version, sha256: Some(sha256(content)) }
    }
}

impl WorkingCopy {
    /// Lists what is stored, and makes an empty folder for it. What is deeper than the prefix is no part of it.
    ///
    /// # Errors
    /// [`ObjectsError::Read`]; [`ObjectsError::File`] if there is no place for the folder.
    pub fn open(store: &Store) -> Result<Self, ObjectsError> {
        let no_place = |error| of_file(&std::env::temp_dir(), &error);
        let folder = tempfile::Builder::new().prefix("twinlag-").tempdir().map_err(no_place)?;
        let runtime = Builder::new_current_thread().enable_all().build().map_err(no_place)?;
        let unreadable = |error: Error| ObjectsError::Read { url: store.url.clone(), reason: error.to_string() };
        let listed = runtime.block_on(repeated(async || store.objects.list_with_delimiter(Some(&store.prefix)).await));
        let objects = listed.map_err(unreadable)?.objects;
        let seen = objects.into_iter().filter_map(|object| {
            let name = object.location.filename()?.to_owned();
            Some((name, Seen { version: version_of(&object), sha256: None }))
        });
        Ok(Self { store: store.clone(), folder, seen: seen.collect(), runtime })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Where the objects are.
    pub fn place(&self) -> &Store {
        &self.store
    }

    /// The names of what is stored, in their order, whether it has been fetched or not.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.seen.keys().map(String::as_str)
    }

    /// Brings the objects of some names, each with the time at which it was stored. One that is there already is brought again.
    ///
    /// # Errors
    /// [`ObjectsError::Read`], [`ObjectsError::File`]. An object that has been removed since the listing is left out.
    pub fn fetch(&mut self, is_wanted: impl Fn(&str) -> bool) -> Result<(), ObjectsError> {
        let wanted: Vec<String> = self.names().filter(|name| is_wanted(name)).map(str::to_owned).collect();
        let (store, folder) = (&self.store, self.folder.path());
        let one = async |name: String| {
            let Some((content, meta)) = repeated(async || whole(store, &name).await)
                .await
                .map_err(|error| ObjectsError::Read { url: store.url_of(&name), reason: error.to_string() })?
            else {
                return Ok((name, None));
            };
            let path = folder.join(&name);
            written(&path, &content, meta.last_modified.into()).map_err(|error| of_file(&path, &error))?;
            Ok((name, Some(Seen::of(&content, version_of(&meta)))))
        };
        let all = stream::iter(wanted.into_iter().map(one)).buffer_unordered(FETCHED_AT_ONCE);
        let fetched: Vec<(String, Option<Seen>)> = self.runtime.block_on(all.try_collect())?;
        for (name, seen) in fetched {
            match seen {
                Some(seen) => self.seen.insert(name, seen),
                None => self.seen.remove(&name),
            };
        }
        Ok(())
    }

    /// Stores a file of the folder, unless it is stored as it is. An object that this copy has listed, fetched or stored is replaced; one
    /// that it knows nothing of, or that another process has written since, is not.
    ///
    /// # Errors
    /// [`ObjectsError::Changed`]; [`ObjectsError::Write`]; [`ObjectsError::File`] if there is no such file.
    pub fn store(&mut self, name: &str) -> Result<(), ObjectsError> {
        let path = self.folder.path().join(name);
        let content = Bytes::from(fs::read(&path).map_err(|error| of_file(&path, &error))?);
        let before = self.seen.get(name);
        if before.is_some_and(|seen| seen.sha256 == Some(sha256(&content))) {
            return Ok(());
        }
        let version = before.map(|seen| seen.version.clone());
        let stored = self.runtime.block_on(put(&self.store, name, &content, version))?;
        self.seen.insert(name.to_owned(), Seen::of(&content, stored));
        Ok(())
    }

    /// Leaves the folder where it is, for whoever could not store it, and returns its path.
    pub fn keep(self) -> PathBuf {
        self.folder.keep()
    }
}

/// Stores an object, in place of the version that was seen of it, and returns its version.
async fn put(
    store: &Store,
    name: &str,
    content: &Bytes,
    before: Option<UpdateVersion>,
) -> Result<UpdateVersion, ObjectsError> {
    let location = store.prefix.clone().join(name);
    let mode = before.clone().map_or(PutMode::Create, PutMode::Update);
    let mut wait = FIRST_WAIT;
    for tries in 1.. {
        let error = match store.objects.put_opts(&location, content.clone().into(), mode.clone().into()).await {
            Ok(stored) => return Ok(stored.into()),
            Err(error) => error,
        };
        // The store may have done it, and the answer was lost: then it holds what was sent.
        if let Ok(there) = whole(store, name).await {
            match there {
                Some((there, meta)) if there == *content => return Ok(version_of(&meta)),
                there => {
                    let is_before = there.map(|(_, meta)| meta.e_tag) == before.as_ref().map(|seen| seen.e_tag.clone());
                    if !is_before {
                        return Err(ObjectsError::Changed { url: store.url_of(name) });
                    }
                }
            }
        }
        if tries == MAX_TRIES || is_final(&error) {
            return Err(ObjectsError::Write { url: store.url_of(name), reason: error.to_string() });
        }
        tokio::time::sleep(wait).await;
        wait *= 2;
    }
    unreachable!("the last try returns")
}

/// The content of an object; `None` if there is none.
async fn whole(store: &Store, name: &str) -> Result<Option<(Bytes, ObjectMeta)>, Error> {
    let location = store.prefix.clone().join(name);
    match store.objects.get(&location).await {
        Err(Error::NotFound { .. }) => Ok(None),
        Err(error) => Err(error),
        Ok(found) => {
            let meta = found.meta.clone();
            Ok(Some((found.bytes().await?, meta)))
        }
    }
}

/// Makes a request that changes nothing until it is answered.
async fn repeated<T>(request: impl AsyncFn() -> Result<T, Error>) -> Result<T, Error> {
    let mut wait = FIRST_WAIT;
    for _ in 1..MAX_TRIES {
        match request().await {
            Err(error) if !is_final(&error) => {}
            answered => return answered,
        }
        tokio::time::sleep(wait).await;
        wait *= 2;
    }
    request().await
}

/// Whether an error would be the same at the next try.
fn is_final(error: &Error) -> bool {
    !matches!(error, Error::Generic { .. } | Error::Precondition { .. } | Error::AlreadyExists { .. })
}

fn version_of(object: &ObjectMeta) -> UpdateVersion {
    UpdateVersion { e_tag: object.e_tag.clone(), version: object.version.clone() }
}

fn sha256(content: &[u8]) -> [u8; 32] {
    Sha256::digest(content).into()
}

fn of_file(path: &Path, error: &io::Error) -> ObjectsError {
    ObjectsError::File { path: path.to_owned(), reason: error.to_string() }
}

fn written(path: &Path, content: &[u8], modified: SystemTime) -> io::Result<()> {
    fs::write(path, content)?;
    File::options().write(true).open(path)?.set_modified(modified)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::{Fault, Faulty};

    const URL: &str = "s3://bucket/study";
    const NAME: &str = "part-0-of-1.json";

    fn open(store: &Store) -> WorkingCopy {
        WorkingCopy::open(store).expect("can be listed")
    }

    fn write(copy: &WorkingCopy, content: &str) {
        fs::write(copy.folder().join(NAME), content).expect("can be written");
    }

    fn stored(store: &Store) -> String {
        let mut copy = open(store);
        copy.fetch(|_| true).expect("can be read");
        fs::read_to_string(copy.folder().join(NAME)).expect("is there")
    }

    #[test]
    fn what_is_stored_comes_back_with_its_time() {
        let store = Store::in_memory(URL);
        let mut copy = open(&store);
        write(&copy, "a part");
        let before = SystemTime::now();
        copy.store(NAME).expect("new");
        assert_eq!(copy.names().collect::<Vec<_>>(), [NAME]);

        let mut other = open(&store);
        other.fetch(|name| name != NAME).expect("nothing to fetch");
        assert!(!other.folder().join(NAME).exists());
        other.fetch(|_| true).expect("there");
        let path = other.folder().join(NAME);
        assert_eq!(fs::read_to_string(&path).expect("there"), "a part");
        let modified = path.metadata().and_then(|file| file.modified()).expect("has a time");
        // The time of the store is kept to a microsecond at least.
        assert!(modified + Duration::from_micros(1) >= before && modified <= SystemTime::now());
    }

    #[test]
    fn prefixes_beside_and_below_are_no_part_of_it() {
        let store = Store::in_memory(URL);
        for url in ["s3://bucket/study2", "s3://bucket/study/below", "s3://bucket"] {
            let mut copy = open(&Store::on(store.objects.clone(), url));
            write(&copy, url);
            copy.store(NAME).expect("new");
        }
        assert_eq!(open(&store).names().count(), 0);
        assert_eq!(stored(&Store::on(store.objects, "s3://bucket/")), "s3://bucket");
    }

    #[test]
    fn of_two_processes_one_goes_on() {
        let store = Store::in_memory(URL);
        let (mut one, mut other) = (open(&store), open(&store));
        write(&one, "one");
        write(&other, "other");
        one.store(NAME).expect("new");
        assert!(
            matches!(other.store(NAME), Err(ObjectsError::Changed { url }) if url == "s3://bucket/study/part-0-of-1.json")
        );
        write(&one, "one goes on");
        one.store(NAME).expect("its own");

        // A third goes on where it stopped; the first, which was taken for dead, does no harm.
        let mut third = open(&store);
        third.fetch(|_| true).expect("there");
        write(&third, "the third goes on");
        third.store(NAME).expect("as it was seen");
        write(&one, "one goes on and on");
        assert!(matches!(one.store(NAME), Err(ObjectsError::Changed { .. })));
        assert_eq!(stored(&store), "the third goes on");
    }

    #[test]
    fn the_same_from_two_processes_is_no_conflict() {
        let store = Store::in_memory(URL);
        let (mut one, mut other) = (open(&store), open(&store));
        for copy in [&mut one, &mut other] {
            write(copy, "the result");
            copy.store(NAME).expect("the same");
        }
    }

    /// A request that fails may have been carried out or not, and its answer may be lost.
    #[test]
    fn faults_of_the_store_leave_no_trace() {
        for fault in [Fault::Refused, Fault::AnswerLost] {
            for place in 0..6 {
                let store = Store::on(Faulty::new(place, fault), URL);
                let mut copy = open(&store);
                for content in ["first", "second"] {
                    write(&copy, content);
                    copy.store(NAME).expect("in the end");
                    assert_eq!(stored(&store), content, "{fault:?} {place}");
                }
            }
        }
    }

    #[test]
    fn a_store_that_stays_away_is_an_error_and_the_folder_can_be_kept() {
        let store = Store::on(Faulty::new(1, Fault::Gone), URL);
        let mut copy = open(&store);
        write(&copy, "the result");
        assert!(matches!(copy.store(NAME), Err(ObjectsError::Write { url, .. }) if url == store.url_of(NAME)));
        let kept = copy.keep();
        assert_eq!(fs::read_to_string(kept.join(NAME)).expect("kept"), "the result");
        fs::remove_dir_all(kept).expect("there");
        assert!(matches!(WorkingCopy::open(&store), Err(ObjectsError::Read { .. })));
    }

    #[test]
    fn a_file_that_is_missing_is_named() {
        let mut copy = open(&Store::in_memory(URL));
        assert!(matches!(copy.store(NAME), Err(ObjectsError::File { path, .. }) if path.ends_with(NAME)));
    }
}

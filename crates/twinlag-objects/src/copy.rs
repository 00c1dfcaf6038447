//! The working copy.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use bytes::Bytes;
use futures_util::{StreamExt as _, TryStreamExt as _, stream};
use object_store::path::Path as Location;
use object_store::{Error, ObjectMeta, ObjectStore, ObjectStoreExt as _, PutMode, UpdateVersion};
use sha2::{Digest as _, Sha256};
use tempfile::TempDir;
use tokio::runtime::{Builder, Runtime};
use tokio::time::{sleep, timeout};

use crate::error::ObjectsError;
use crate::fault;
use crate::prefix::Prefix;

/// How many objects are fetched at once; chosen: a store answers in some ten milliseconds, whatever it is asked.
const FETCHED_AT_ONCE: usize = 32;
/// The wait before the second try, which doubles from one to the next; chosen.
const FIRST_WAIT: Duration = Duration::from_millis(200);
/// The longest wait between two tries; chosen: a store that comes back is seen soon.
const LONGEST_WAIT: Duration = Duration::from_secs(3);

type Hash = [u8; 32];

/// A folder on this machine with some of the files that are stored under a prefix.
///
/// The folder is removed when this value is dropped, with what has not been stored: see [`Self::keep`].
#[derive(Debug)]
pub struct WorkingCopy {
    prefix: Prefix,
    folder: TempDir,
    runtime: Runtime,
    client: Arc<dyn ObjectStore>,
    /// What is known of each object.
    objects: BTreeMap<String, Known>,
}

/// What is known of an object.
#[derive(Clone, Debug, Default)]
struct Known {
    /// As it was last seen; `None` if there was none.
    version: Option<UpdateVersion>,
    /// Of its content, if that has been here.
    sha256: Option<Hash>,
    /// What has been sent since: the store may have it.
    sent: Vec<Hash>,
}

impl Known {
    /// An object of this version, whose content has this hash.
    fn of(hash: Hash, version: UpdateVersion) -> Self {
        Self { version: Some(version), sha256: Some(hash), sent: Vec::new() }
    }

    /// Whether an object is as it was last seen. Some stores quote the tag in one answer and not in another.
    fn is(&self, object: &ObjectMeta) -> bool {
        let bare =
            |tag: &Option<String>| tag.as_ref().map(|tag| tag.trim_start_matches("W/").trim_matches('"').to_owned());
        self.version.as_ref().is_some_and(|version| bare(&version.e_tag) == bare(&object.e_tag))
    }
}

impl WorkingCopy {
    /// Lists what is stored, and makes an empty folder for it. What is deeper than the prefix is no part of it.
    ///
    /// # Errors
    /// [`ObjectsError::Read`], [`ObjectsError::Away`], [`ObjectsError::Unusable`]; [`ObjectsError::File`] if there is no place for the
    /// folder.
    pub fn open(prefix: &Prefix) -> Result<Self, ObjectsError> {
        let no_place = |error| of_file(&std::env::temp_dir(), &error);
        let folder = tempfile::Builder::new().prefix("twinlag-").tempdir().map_err(no_place)?;
        let (runtime, client) = (runtime()?, prefix.client()?);
        let request = async || client.list_with_delimiter(Some(prefix.path())).await;
        let listed = runtime.block_on(repeated(prefix.patience, request));
        let listed = listed.map_err(|error| unreadable(prefix.url.clone(), &error))?;
        let objects = listed.objects.into_iter().filter_map(|object| {
            // A marker of the folder itself has no name in it.
            let names: Vec<_> = object.location.prefix_match(prefix.path())?.collect();
            let [name] = &names[..] else { return None };
            // Nor has what is no name of a file on this system.
            Path::new(name.as_ref()).file_name().filter(|file| *file == name.as_ref())?;
            Some((name.as_ref().to_owned(), Known { version: Some(version_of(&object)), ..Known::default() }))
        });
        let objects = objects.collect();
        Ok(Self { prefix: prefix.clone(), folder, runtime, client, objects })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Where the objects are.
    pub fn prefix(&self) -> &Prefix {
        &self.prefix
    }

    /// The names of what is stored, in their order, whether it has been fetched or not.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.objects.iter().filter(|(_, known)| known.version.is_some()).map(|(name, _)| name.as_str())
    }

    /// Brings the objects of some names, each with the time at which it was stored; those that are here are left as they are.
    ///
    /// # Errors
    /// [`ObjectsError::Read`], [`ObjectsError::Away`], [`ObjectsError::File`]. An object that has been removed since the listing is left out.
    pub fn fetch(&mut self, is_wanted: impl Fn(&str) -> bool) -> Result<(), ObjectsError> {
        let is_here = |name: &str| self.objects.get(name).is_some_and(|known| known.sha256.is_some());
        let wanted = self.names().filter(|name| is_wanted(name) && !is_here(name)).map(str::to_owned).collect();
        self.fetch_all(wanted)
    }

    fn fetch_all(&mut self, names: Vec<String>) -> Result<(), ObjectsError> {
        let (prefix, folder, client) = (&self.prefix, self.folder.path(), &self.client);
        let one = async |name: String| {
            let Some((content, meta)) = read(prefix, client, &name).await? else {
                return Ok((name, Known::default()));
            };
            let path = folder.join(&name);
            written(&path, &content, meta.last_modified.into()).map_err(|error| of_file(&path, &error))?;
            Ok((name, Known::of(sha256(&content), version_of(&meta))))
        };
        let all = stream::iter(names.into_iter().map(one)).buffer_unordered(FETCHED_AT_ONCE);
        let fetched: Vec<(String, Known)> = self.runtime.block_on(all.try_collect())?;
        self.objects.extend(fetched);
        Ok(())
    }

    /// Stores a file of the folder; does nothing if the object already has its content. Replaces an object that this copy has listed,
    /// fetched or stored, unless another process has written it since.
    ///
    /// # Errors
    /// [`ObjectsError::Changed`], [`ObjectsError::Removed`]; [`ObjectsError::Write`], [`ObjectsError::Away`]; [`ObjectsError::File`] if there
    /// is no such file.
    pub fn store(&mut self, name: &str) -> Result<(), ObjectsError> {
        self.store_within(name, None)
    }

    /// Stores a file of the folder as [`Self::store`] does, but gives up after some time.
    ///
    /// # Errors
    /// Those of [`Self::store`].
    pub fn store_at_once(&mut self, name: &str, limit: Duration) -> Result<(), ObjectsError> {
        self.store_within(name, Some(limit))
    }

    fn store_within(&mut self, name: &str, limit: Option<Duration>) -> Result<(), ObjectsError> {
        let path = self.folder.path().join(name);
        let content = Bytes::from(fs::read(&path).map_err(|error| of_file(&path, &error))?);
        let known = self.objects.entry(name.to_owned()).or_default();
        let hash = sha256(&content);
        if known.sha256 == Some(hash) {
            return Ok(());
        }
        let (prefix, client) = (&self.prefix, &self.client);
        self.runtime.block_on(async {
            let stored = put(prefix, client, name, (&content, hash), known);
            match limit {
                None => stored.await,
                Some(limit) => timeout(limit, stored).await.unwrap_or_else(|_| {
                    let reason = format!("no answer in {} s", limit.as_secs_f64());
                    Err(ObjectsError::Away { url: prefix.url_of(name), reason })
                }),
            }
        })
    }

    /// Stores a file of the folder that whoever comes first makes: if another process was first, what that has made is fetched in its
    /// place. Whoever is first also tries to make it once more, which the store has to refuse.
    ///
    /// # Errors
    /// Those of [`Self::store`] and [`Self::fetch`], but for [`ObjectsError::Changed`]; [`ObjectsError::Unconditional`].
    pub fn store_first(&mut self, name: &str) -> Result<(), ObjectsError> {
        match self.store(name) {
            Err(ObjectsError::Changed { .. }) => self.fetch_all(vec![name.to_owned()]),
            Ok(()) => self.expect_refusal(name),
            stored => stored,
        }
    }

    /// Refuses a store that replaces an object though it is asked not to.
    fn expect_refusal(&self, name: &str) -> Result<(), ObjectsError> {
        let path = self.folder.path().join(name);
        let content = Bytes::from(fs::read(&path).map_err(|error| of_file(&path, &error))?);
        let location = self.prefix.location(name)?;
        // An error of any other kind says nothing.
        let put = self.client.put_opts(&location, content.into(), PutMode::Create.into());
        match self.runtime.block_on(put) {
            Ok(_) => Err(ObjectsError::Unconditional { url: self.prefix.url_of(name) }),
            Err(_) => Ok(()),
        }
    }

    /// Leaves the folder where it is, for whoever could not store it, and returns its path.
    pub fn keep(self) -> PathBuf {
        self.folder.keep()
    }
}

impl Prefix {
    /// The content of an object; `None` if there is no such object.
    ///
    /// # Errors
    /// [`ObjectsError::Read`], [`ObjectsError::Away`], [`ObjectsError::Unusable`]; [`ObjectsError::BadUrl`] of what is no name.
    pub fn read(&self, name: &str) -> Result<Option<Vec<u8>>, ObjectsError> {
        let client = self.client()?;
        Ok(runtime()?.block_on(read(self, &client, name))?.map(|(content, _)| content.into()))
    }
}

fn runtime() -> Result<Runtime, ObjectsError> {
    Builder::new_current_thread().enable_all().build().map_err(|error| of_file(&std::env::temp_dir(), &error))
}

/// Stores an object in place of the version that is known of it.
///
/// - `content`: with its hash
async fn put(
    prefix: &Prefix,
    client: &Arc<dyn ObjectStore>,
    name: &str,
    (content, hash): (&Bytes, Hash),
    known: &mut Known,
) -> Result<(), ObjectsError> {
    let (location, url) = (prefix.location(name)?, || prefix.url_of(name));
    let (start, mut wait) = (Instant::now(), FIRST_WAIT);
    known.sent.push(hash);
    loop {
        let mode = known.version.clone().map_or(PutMode::Create, PutMode::Update);
        let error = match client.put_opts(&location, content.clone().into(), mode.into()).await {
            Ok(stored) => {
                *known = Known::of(hash, stored.into());
                return Ok(());
            }
            Err(error) => error,
        };
        // The store may have done it, this time or an earlier one, and the answer was lost: then it holds what was sent.
        match whole(client, &location).await {
            Ok(Some((there, meta))) if there == *content => {
                *known = Known::of(hash, version_of(&meta));
                return Ok(());
            }
            Ok(Some((_, meta))) if known.is(&meta) => {}
            Ok(Some((there, meta))) if known.sent.contains(&sha256(&there)) => known.version = Some(version_of(&meta)),
            Ok(Some(_)) => return Err(ObjectsError::Changed { url: url() }),
            Ok(None) if known.version.is_some() => return Err(ObjectsError::Removed { url: url() }),
            Ok(None) | Err(_) => {}
        }
        if fault::is_final(&error) {
            return Err(ObjectsError::Write { url: url(), reason: fault::reason(&error) });
        }
        if is_over(start, prefix.patience, wait) {
            return Err(ObjectsError::Away { url: url(), reason: fault::reason(&error) });
        }
        wait = waited(wait).await;
    }
}

/// The content of an object, asked for again if the request fails; `None` if there is none.
async fn read(
    prefix: &Prefix,
    client: &Arc<dyn ObjectStore>,
    name: &str,
) -> Result<Option<(Bytes, ObjectMeta)>, ObjectsError> {
    let location = prefix.location(name)?;
    let found = repeated(prefix.patience, async || whole(client, &location).await).await;
    found.map_err(|error| unreadable(prefix.url_of(name), &error))
}

/// The content of an object, asked for once; `None` if there is none.
async fn whole(client: &Arc<dyn ObjectStore>, location: &Location) -> Result<Option<(Bytes, ObjectMeta)>, Error> {
    match client.get(location).await {
        Err(Error::NotFound { .. }) => Ok(None),
        Err(error) => Err(error),
        Ok(found) => {
            let meta = found.meta.clone();
            Ok(Some((found.bytes().await?, meta)))
        }
    }
}

/// Makes a request that only reads, again if it fails.
async fn repeated<T>(patience: Duration, request: impl AsyncFn() -> Result<T, Error>) -> Result<T, Error> {
    let (start, mut wait) = (Instant::now(), FIRST_WAIT);
    loop {
        match request().await {
            Err(error) if !fault::is_final(&error) && !is_over(start, patience, wait) => {}
            answered => return answered,
        }
        wait = waited(wait).await;
    }
}

/// Whether a request has been made often enough: for so long, or twice where there is no time to wait.
fn is_over(start: Instant, patience: Duration, wait: Duration) -> bool {
    start.elapsed() >= patience && (wait > FIRST_WAIT || patience > Duration::ZERO)
}

/// Waits, and returns how long to wait the next time.
async fn waited(wait: Duration) -> Duration {
    sleep(wait).await;
    (2 * wait).min(LONGEST_WAIT)
}

fn unreadable(url: String, error: &Error) -> ObjectsError {
    let reason = fault::reason(error);
    if fault::is_final(error) { ObjectsError::Read { url, reason } } else { ObjectsError::Away { url, reason } }
}

fn version_of(object: &ObjectMeta) -> UpdateVersion {
    UpdateVersion { e_tag: object.e_tag.clone(), version: object.version.clone() }
}

fn sha256(content: &[u8]) -> Hash {
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
    use crate::faulty::{Fault, Faulty};

    const URL: &str = "s3://bucket/study";
    const NAME: &str = "part-0-of-1.json";

    fn open(store: &Prefix) -> WorkingCopy {
        WorkingCopy::open(store).expect("can be listed")
    }

    fn write(copy: &WorkingCopy, content: &str) {
        fs::write(copy.folder().join(NAME), content).expect("can be written");
    }

    fn stored(store: &Prefix) -> String {
        let mut copy = open(store);
        copy.fetch(|_| true).expect("can be read");
        fs::read_to_string(copy.folder().join(NAME)).expect("is there")
    }

    #[test]
    fn what_is_stored_comes_back_with_its_time() {
        let store = Prefix::in_memory(URL);
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
        let store = Prefix::in_memory(URL);
        for url in ["s3://bucket/study2", "s3://bucket/study/below", "s3://bucket"] {
            let mut copy = open(&Prefix::on(store.client().expect("in memory"), url));
            write(&copy, url);
            copy.store(NAME).expect("new");
        }
        assert_eq!(open(&store).names().count(), 0);
        assert_eq!(stored(&Prefix::on(store.client().expect("in memory"), "s3://bucket/")), "s3://bucket");
    }

    #[test]
    fn of_two_processes_one_goes_on() {
        let store = Prefix::in_memory(URL);
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
        let store = Prefix::in_memory(URL);
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
                let store = Prefix::on(Faulty::new(place, fault), URL);
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
        let store = Prefix::on(Faulty::new(1, Fault::Gone), URL);
        let mut copy = open(&store);
        write(&copy, "the result");
        assert!(matches!(copy.store(NAME), Err(ObjectsError::Away { url, .. }) if url == store.url_of(NAME)));
        let kept = copy.keep();
        assert_eq!(fs::read_to_string(kept.join(NAME)).expect("kept"), "the result");
        fs::remove_dir_all(kept).expect("there");
        assert!(matches!(WorkingCopy::open(&store), Err(ObjectsError::Away { .. })));
    }

    #[test]
    fn an_object_that_was_removed_is_not_stored_again() {
        let store = Prefix::in_memory(URL);
        let mut copy = open(&store);
        write(&copy, "first");
        copy.store(NAME).expect("new");
        let location = store.location(NAME).expect("a name");
        copy.runtime.block_on(copy.client.delete(&location)).expect("there");
        write(&copy, "second");
        assert!(matches!(copy.store(NAME), Err(ObjectsError::Removed { url }) if url == store.url_of(NAME)));
    }

    /// What was sent and not confirmed is known when it is seen later.
    #[test]
    fn an_answer_that_is_lost_at_last_is_no_other_process() {
        // The listing, then each request to store and to look: the store takes the first and confirms nothing, and then comes back.
        let store = Prefix::on(Faulty::new(1, Fault::Silent), URL);
        let mut copy = open(&store);
        write(&copy, "first");
        assert!(matches!(copy.store(NAME), Err(ObjectsError::Away { .. })));
        write(&copy, "second");
        copy.store(NAME).expect("its own");
        assert_eq!(stored(&store), "second");
    }

    #[test]
    fn names_may_have_any_signs() {
        let store = Prefix::in_memory(URL);
        for name in ["Übung #1 100%.csv", "~a[b]{c}*?^|<>\"\\", " "] {
            let mut copy = open(&store);
            fs::write(copy.folder().join(name), name).expect("can be written");
            copy.store(name).expect("new");
            let mut other = open(&store);
            assert!(other.names().any(|is| is == name), "{name:?}");
            other.fetch(|_| true).expect("there");
            assert_eq!(fs::read_to_string(other.folder().join(name)).expect("there"), name);
            assert_eq!(store.read(name).expect("can be read").as_deref(), Some(name.as_bytes()));
        }
        assert_eq!(store.read("nothing").expect("can be read"), None);
    }

    #[test]
    fn whoever_comes_first_makes_it() {
        let store = Prefix::in_memory(URL);
        let (mut one, mut other) = (open(&store), open(&store));
        write(&one, "one");
        write(&other, "other");
        one.store_first(NAME).expect("new");
        other.store_first(NAME).expect("theirs");
        assert_eq!(fs::read_to_string(other.folder().join(NAME)).expect("there"), "one");
        write(&other, "goes on");
        other.store(NAME).expect("as it was seen");
    }

    #[test]
    fn a_store_that_heeds_no_conditions_is_refused() {
        let store = Prefix::on(Faulty::new(0, Fault::Unconditional), URL);
        let mut copy = open(&store);
        write(&copy, "a plan");
        assert!(
            matches!(copy.store_first(NAME), Err(ObjectsError::Unconditional { url }) if url == store.url_of(NAME))
        );
    }

    #[test]
    fn a_file_that_is_missing_is_named() {
        let mut copy = open(&Prefix::in_memory(URL));
        assert!(matches!(copy.store(NAME), Err(ObjectsError::File { path, .. }) if path.ends_with(NAME)));
    }
}

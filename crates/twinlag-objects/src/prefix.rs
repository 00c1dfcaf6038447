//! Where objects are: a store, and a prefix within.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use object_store::ObjectStore;
use object_store::memory::InMemory;
use object_store::path::Path;

use crate::error::ObjectsError;

/// What stands between the scheme of a URL and the rest.
const SCHEME_END: &str = "://";
/// The scheme of what is understood.
const S3: &str = "s3://";
/// How long requests are repeated that fail for another reason than what they ask; chosen: a store that is restarted is back by then, and
/// who mistyped its name waits no longer.
const PATIENCE: Duration = Duration::from_secs(30);

/// A prefix of an object store.
#[derive(Clone)]
pub struct Prefix {
    /// As it was given, without a slash at its end.
    pub(crate) url: String,
    /// Within the bucket.
    path: Path,
    objects: Objects,
    /// How long requests are repeated.
    pub(crate) patience: Duration,
}

/// What has the objects.
#[derive(Clone)]
enum Objects {
    /// A bucket of a server.
    Bucket(String),
    /// What clones of a prefix share.
    Here(Arc<dyn ObjectStore>),
}

impl fmt::Debug for Prefix {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Prefix").field(&self.url).finish()
    }
}

impl Prefix {
    /// Whether a text is meant as the URL of a store, rather than as a path of this machine.
    pub fn is_url(text: &str) -> bool {
        text.split_once(SCHEME_END).is_some_and(|(scheme, _)| {
            scheme.len() > 1 && scheme.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte))
        })
    }

    /// The prefix that a URL such as `s3://bucket/study` names. The environment says where the store is and with which credentials:
    /// `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, `AWS_ENDPOINT_URL`, `AWS_ALLOW_HTTP` and the others that
    /// [`object_store`](https://docs.rs/object_store) knows.
    ///
    /// # Errors
    /// [`ObjectsError::BadUrl`]; [`ObjectsError::NotBuilt`] without the feature `s3`.
    pub fn of_url(url: &str) -> Result<Self, ObjectsError> {
        let (bucket, path) = parsed(url)?;
        if cfg!(not(feature = "s3")) {
            return Err(ObjectsError::NotBuilt { url: url.to_owned() });
        }
        Ok(Self { url: without_slash(url), path, objects: Objects::Bucket(bucket.to_owned()), patience: PATIENCE })
    }

    /// A prefix of a store in memory, which clones share; for tests.
    ///
    /// # Panics
    /// If the URL names no bucket.
    pub fn in_memory(url: &str) -> Self {
        Self::on(Arc::new(InMemory::new()), url)
    }

    /// - `url`: of the prefix, and for messages
    pub(crate) fn on(objects: Arc<dyn ObjectStore>, url: &str) -> Self {
        let (_, path) = parsed(url).expect("a bucket and a prefix");
        // What is in memory does not come back.
        Self { url: without_slash(url), path, objects: Objects::Here(objects), patience: Duration::ZERO }
    }

    /// The URL of an object.
    pub fn url_of(&self, name: &str) -> String {
        format!("{}/{name}", self.url)
    }

    /// The prefix within the bucket.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Where an object is within the bucket.
    pub(crate) fn location(&self, name: &str) -> Result<Path, ObjectsError> {
        let bad = || ObjectsError::BadUrl { url: self.url_of(name) };
        if name.is_empty() || name.contains('/') {
            return Err(bad());
        }
        let text = if self.path.is_root() { name.to_owned() } else { format!("{}/{name}", self.path) };
        Path::parse(text).map_err(|_| bad())
    }

    /// What makes requests. Its connections are of the runtime in which they are made: each runtime takes one of its own.
    pub(crate) fn client(&self) -> Result<Arc<dyn ObjectStore>, ObjectsError> {
        match &self.objects {
            Objects::Here(objects) => Ok(objects.clone()),
            Objects::Bucket(bucket) => client(&self.url, bucket),
        }
    }
}

fn without_slash(url: &str) -> String {
    url.trim_end_matches('/').to_owned()
}

/// Bucket and prefix.
fn parsed(url: &str) -> Result<(&str, Path), ObjectsError> {
    let bad = || ObjectsError::BadUrl { url: url.to_owned() };
    let rest = url.strip_prefix(S3).ok_or_else(bad)?;
    let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
    let prefix = Path::parse(prefix.trim_end_matches('/')).map_err(|_| bad())?;
    if bucket.is_empty() { Err(bad()) } else { Ok((bucket, prefix)) }
}

#[cfg(feature = "s3")]
fn client(url: &str, bucket: &str) -> Result<Arc<dyn ObjectStore>, ObjectsError> {
    use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
    use object_store::{ClientConfigKey, RetryConfig};

    /// How long an answer may take to go on, in the form of the client; chosen: twice the patience, and a file of some hundred megabytes is
    /// stored by then. There is no limit for all of an answer.
    const READ_TIMEOUT: &str = "60 s";
    /// No limit, in the form of the client.
    const NO_TIMEOUT: &str = "1 day";

    let unusable = |reason: String| ObjectsError::Unusable { url: url.to_owned(), reason };
    // Requests are repeated here, where it is known what they do.
    let retry = RetryConfig { max_retries: 0, ..RetryConfig::default() };
    let builder = AmazonS3Builder::from_env()
        .with_bucket_name(bucket)
        .with_retry(retry)
        .with_config(AmazonS3ConfigKey::Client(ClientConfigKey::Timeout), NO_TIMEOUT)
        .with_config(AmazonS3ConfigKey::Client(ClientConfigKey::ReadTimeout), READ_TIMEOUT);
    if let Some(endpoint) = builder.get_config_value(&AmazonS3ConfigKey::Endpoint) {
        let scheme = url::Url::parse(&endpoint).map(|url| url.scheme().to_owned()).unwrap_or_default();
        let may_be_http = builder.get_config_value(&AmazonS3ConfigKey::Client(ClientConfigKey::AllowHttp));
        match (&*scheme, may_be_http.as_deref()) {
            ("https", _) | ("http", Some("true")) => {}
            ("http", _) => return Err(unusable(format!("its endpoint is {endpoint}: set AWS_ALLOW_HTTP=true"))),
            // The client panics on whatever else there is.
            _ => {
                return Err(unusable(format!("its endpoint is {endpoint:?}: expected http:// or https:// and a name")));
            }
        }
    }
    Ok(Arc::new(builder.build().map_err(|error| unusable(error.to_string()))?))
}

#[cfg(not(feature = "s3"))]
fn client(url: &str, _bucket: &str) -> Result<Arc<dyn ObjectStore>, ObjectsError> {
    Err(ObjectsError::NotBuilt { url: url.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_are_no_paths() {
        for url in ["s3://bucket/a", "s3://bucket", "gs://bucket/a", "https://host/a"] {
            assert!(Prefix::is_url(url), "{url}");
        }
        for path in ["runs/a.csv", "C://runs", "C:/runs", "/a://b/c", "a b://c", ""] {
            assert!(!Prefix::is_url(path), "{path}");
        }
    }

    #[test]
    fn a_url_has_a_bucket_and_a_prefix() {
        let parts = |url| parsed(url).map(|(bucket, prefix)| (bucket, prefix.to_string()));
        assert_eq!(parts("s3://bucket/a/b/").expect("whole"), ("bucket", "a/b".to_owned()));
        assert_eq!(parts("s3://bucket").expect("whole"), ("bucket", String::new()));
        for url in ["s3://", "s3:///a", "gs://bucket/a", "s3://bucket/a//b"] {
            assert!(matches!(parts(url), Err(ObjectsError::BadUrl { .. })), "{url}");
        }
    }

    #[test]
    fn an_object_has_a_name_without_a_folder() {
        let prefix = Prefix::in_memory("s3://bucket/a");
        assert_eq!(prefix.location("b").expect("a name").as_ref(), "a/b");
        assert_eq!(Prefix::in_memory("s3://bucket").location("b").expect("a name").as_ref(), "b");
        for name in ["", "..", "b/c", "."] {
            assert!(prefix.location(name).is_err(), "{name:?}");
        }
    }
}

//! Where objects are: a store, and a prefix within.

use std::sync::Arc;

use object_store::ObjectStore;
use object_store::memory::InMemory;
use object_store::path::Path;

use crate::error::ObjectsError;

/// What stands between the scheme of a URL and the rest.
const SCHEME_END: &str = "://";
/// The scheme of what is understood.
const S3: &str = "s3://";

/// A prefix of an object store.
#[derive(Clone, Debug)]
pub struct Store {
    pub(crate) objects: Arc<dyn ObjectStore>,
    pub(crate) prefix: Path,
    /// As it was given, without a slash at its end.
    pub(crate) url: String,
}

impl Store {
    /// Whether a text is meant as the URL of a store, rather than as a path of this machine.
    pub fn is_url(text: &str) -> bool {
        text.split_once(SCHEME_END).is_some_and(|(scheme, _)| {
            scheme.len() > 1 && scheme.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte))
        })
    }

    /// The store that a URL such as `s3://bucket/study` names. Where it is and who asks says the environment: `AWS_ACCESS_KEY_ID`,
    /// `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, `AWS_ENDPOINT_URL`, `AWS_ALLOW_HTTP` and the others that
    /// [`object_store`](https://docs.rs/object_store) knows.
    ///
    /// # Errors
    /// [`ObjectsError::NoUrl`]; [`ObjectsError::NotBuilt`] without the feature `s3`; [`ObjectsError::Unusable`].
    pub fn of_url(url: &str) -> Result<Self, ObjectsError> {
        let (bucket, prefix) = parsed(url)?;
        let objects = client(url, bucket)?;
        Ok(Self { objects, prefix, url: without_slash(url) })
    }

    /// A store in memory, which clones share; for tests.
    ///
    /// # Panics
    /// If the URL names no bucket.
    pub fn in_memory(url: &str) -> Self {
        Self::on(Arc::new(InMemory::new()), url)
    }

    /// - `url`: of the prefix, and for messages
    pub(crate) fn on(objects: Arc<dyn ObjectStore>, url: &str) -> Self {
        let (_, prefix) = parsed(url).expect("a bucket and a prefix");
        Self { objects, prefix, url: without_slash(url) }
    }

    /// The URL of an object.
    pub fn url_of(&self, name: &str) -> String {
        format!("{}/{name}", self.url)
    }
}

fn without_slash(url: &str) -> String {
    url.trim_end_matches('/').to_owned()
}

/// Bucket and prefix.
fn parsed(url: &str) -> Result<(&str, Path), ObjectsError> {
    let no_url = || ObjectsError::NoUrl { url: url.to_owned() };
    let rest = url.strip_prefix(S3).ok_or_else(no_url)?;
    let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
    let prefix = Path::parse(prefix.trim_end_matches('/')).map_err(|_| no_url())?;
    if bucket.is_empty() { Err(no_url()) } else { Ok((bucket, prefix)) }
}

#[cfg(feature = "s3")]
fn client(url: &str, bucket: &str) -> Result<Arc<dyn ObjectStore>, ObjectsError> {
    use std::time::Duration;

    use object_store::RetryConfig;
    use object_store::aws::AmazonS3Builder;

    /// How long a request is repeated; chosen: a store that is restarted is back by then, and who mistyped a name still waits.
    const PATIENCE: Duration = Duration::from_secs(30);

    let retry = RetryConfig { retry_timeout: PATIENCE, ..RetryConfig::default() };
    let built = AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retry).build();
    let unusable =
        |error: object_store::Error| ObjectsError::Unusable { url: url.to_owned(), reason: error.to_string() };
    Ok(Arc::new(built.map_err(unusable)?))
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
            assert!(Store::is_url(url), "{url}");
        }
        for path in ["runs/a.csv", "C://runs", "C:/runs", "/a://b/c", "a b://c", ""] {
            assert!(!Store::is_url(path), "{path}");
        }
    }

    #[test]
    fn a_url_has_a_bucket_and_a_prefix() {
        let parts = |url| parsed(url).map(|(bucket, prefix)| (bucket, prefix.to_string()));
        assert_eq!(parts("s3://bucket/a/b/").expect("whole"), ("bucket", "a/b".to_owned()));
        assert_eq!(parts("s3://bucket").expect("whole"), ("bucket", String::new()));
        for url in ["s3://", "s3:///a", "gs://bucket/a", "s3://bucket/a//b"] {
            assert!(matches!(parts(url), Err(ObjectsError::NoUrl { .. })), "{url}");
        }
    }
}

//! A store in memory some of whose requests fail.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use async_trait::async_trait;
use bytes::Bytes;
use futures_util::stream::BoxStream;
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{
    CopyOptions, Error, GetOptions, GetResult, ListResult, MultipartUpload, ObjectMeta, ObjectStore, PutMode,
    PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};

/// How a request fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Nothing is done.
    Refused,
    /// All is done, and the answer is an error.
    AnswerLost,
    /// Nothing is done, from then on.
    Gone,
    /// Nothing fails, and whatever is to be stored replaces what is there.
    Unconditional,
    /// All is done, and the answers of [`SILENT`] requests are errors.
    Silent,
}

/// How many requests a store that is silent leaves without an answer: two tries to store, each with a look.
const SILENT: u32 = 4;

/// A store of which a request fails, by its number from 0.
#[derive(Debug)]
pub(crate) struct Faulty {
    store: InMemory,
    fails_at: u32,
    fault: Fault,
    asked: AtomicU32,
}

impl Faulty {
    pub(crate) fn new(fails_at: u32, fault: Fault) -> Arc<Self> {
        Arc::new(Self { store: InMemory::new(), fails_at, fault, asked: AtomicU32::new(0) })
    }

    /// The fault of the next request.
    fn next(&self) -> Option<Fault> {
        let number = self.asked.fetch_add(1, Ordering::SeqCst);
        let last = match self.fault {
            Fault::Refused | Fault::AnswerLost => self.fails_at,
            Fault::Unconditional => return None,
            Fault::Silent => self.fails_at + SILENT - 1,
            Fault::Gone => u32::MAX,
        };
        (self.fails_at..=last).contains(&number).then_some(self.fault)
    }

    /// The answer of a request, unless it fails.
    async fn answer<T>(&self, request: impl Future<Output = Result<T>>) -> Result<T> {
        let failed = || Error::Generic { store: "faulty", source: "a fault that was injected".into() };
        match self.next() {
            None => request.await,
            Some(Fault::AnswerLost | Fault::Silent) => request.await.and(Err(failed())),
            Some(_) => Err(failed()),
        }
    }
}

impl fmt::Display for Faulty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("faulty")
    }
}

#[async_trait]
impl ObjectStore for Faulty {
    async fn put_opts(&self, location: &Path, payload: PutPayload, options: PutOptions) -> Result<PutResult> {
        let mode = if self.fault == Fault::Unconditional { PutMode::Overwrite } else { options.mode.clone() };
        self.answer(self.store.put_opts(location, payload, PutOptions { mode, ..options })).await
    }

    async fn put_multipart_opts(
        &self,
        location: &Path,
        options: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        self.answer(self.store.put_multipart_opts(location, options)).await
    }

    async fn get_opts(&self, location: &Path, options: GetOptions) -> Result<GetResult> {
        self.answer(self.store.get_opts(location, options)).await
    }

    async fn get_ranges(&self, location: &Path, ranges: &[Range<u64>]) -> Result<Vec<Bytes>> {
        self.answer(self.store.get_ranges(location, ranges)).await
    }

    fn delete_stream(&self, locations: BoxStream<'static, Result<Path>>) -> BoxStream<'static, Result<Path>> {
        self.store.delete_stream(locations)
    }

    fn list(&self, prefix: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.store.list(prefix)
    }

    async fn list_with_delimiter(&self, prefix: Option<&Path>) -> Result<ListResult> {
        self.answer(self.store.list_with_delimiter(prefix)).await
    }

    async fn copy_opts(&self, from: &Path, to: &Path, options: CopyOptions) -> Result<()> {
        self.answer(self.store.copy_opts(from, to, options)).await
    }
}

//! How the program was called: shards on a cluster call it again, and pages say how they were made.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

static INVOCATION: OnceLock<Invocation> = OnceLock::new();

/// A call of the program.
#[derive(Debug)]
pub(crate) struct Invocation {
    /// What is to be started to call it again; `None` where nobody knows.
    pub(crate) program: Option<PathBuf>,
    /// The arguments, the first of which is the name of the program.
    pub(crate) arguments: Vec<OsString>,
}

impl Invocation {
    /// Keeps the call of this process, which is the first one.
    pub(crate) fn begin(self) -> &'static Self {
        INVOCATION.get_or_init(|| self)
    }

    /// The call of this process; of one that has called nothing, that of the process itself.
    pub(crate) fn of_process() -> &'static Self {
        INVOCATION
            .get_or_init(|| Self { program: std::env::current_exe().ok(), arguments: std::env::args_os().collect() })
    }
}

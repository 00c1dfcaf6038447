//! twinlag in a browser: what the page of `cargo xtask web` calls, compiled to WebAssembly.
//!
//! For the page alone. It reads files that a person has dropped on it, says what is in them, diagnoses their records and reconstructs the gas
//! temperature, with the numbers of the program and the report of the program. A file never leaves the machine: the page may open no
//! connection. A program in Rust takes `twinlag`.
//!
//! ```
//! use twinlag_web::Session;
//!
//! let log = "time_s,fine_C,coarse_C\n0,20,20\n1,21,20.5\n2,22,21\n3,23,21.5\n";
//! let mut session = Session::default();
//! let found = session.add("run.csv", log.as_bytes().to_vec(), "{}", None, false)?;
//! assert!(found.contains("\"taken_as\":\"T1\""));
//! # Ok::<(), twinlag_web::SessionError>(())
//! ```

mod exports;
mod session;

pub use session::{Session, SessionError};

//! A folder of files that is kept in an object store, with a working copy on this machine.
//!
//! For a program that keeps its work in files, on machines that share no file system. [`WorkingCopy::open`] lists what is stored under a
//! prefix, [`WorkingCopy::fetch`] brings what is needed, and [`WorkingCopy::store`] takes back what the program has written since.
//! An object is replaced only if it is what this copy has last seen of it: of two processes that write the same, one goes on, and the
//! other gets [`ObjectsError::Changed`], so that no lock is needed. What the files hold is the caller's business. A program that has
//! folders that all its machines see needs none of this.
//!
//! Requests that fail are repeated for half a minute. A store may have done what it answers with an error: after each error the object is
//! read and compared. All of it holds for stores that heed `If-Match` and `If-None-Match` of what they are to store, as Amazon S3 does.
//!
//! ```
//! use twinlag_objects::{Prefix, WorkingCopy};
//!
//! let prefix = Prefix::in_memory("s3://bucket/study");
//! let mut copy = WorkingCopy::open(&prefix)?;
//! std::fs::write(copy.folder().join("part-0-of-2.json"), "half of it")?;
//! copy.store("part-0-of-2.json")?;
//!
//! let mut elsewhere = WorkingCopy::open(&prefix)?;
//! elsewhere.fetch(|name| name.starts_with("part-"))?;
//! assert_eq!(std::fs::read_to_string(elsewhere.folder().join("part-0-of-2.json"))?, "half of it");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod copy;
mod error;
mod fault;
#[cfg(test)]
mod faulty;
mod prefix;

pub use copy::WorkingCopy;
pub use error::ObjectsError;
pub use prefix::Prefix;

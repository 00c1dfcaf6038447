//! What a report says of its own making.

use std::path::Path;

use jiff::Timestamp;
use twinlag_batch::sha256_of_file;
use twinlag_pages::Making;

use crate::output::command_line;

/// The command, the instant, and the hash of each file; a pipe has none.
///
/// - `is_static`: whether the page is to have no script
pub(crate) fn making(files: &[impl AsRef<Path>], is_static: bool) -> Making {
    let hashed = files.iter().filter_map(|file| {
        let file = file.as_ref();
        Some((file.file_name()?.to_string_lossy().into_owned(), sha256_of_file(file).ok()?))
    });
    Making {
        command: command_line(),
        made_at: Timestamp::now().strftime("%Y-%m-%d %H:%M UTC").to_string(),
        files: hashed.collect(),
        is_static,
        is_first_screen: false,
    }
}

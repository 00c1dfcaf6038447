//! How memory that is not needed any more goes back to the system.

/// Bytes from which on a vector has a mapping of its own, which goes back to the system when the vector is dropped.
///
/// The GNU C library raises this threshold to the size of the largest vector that was ever dropped, up to 32 MiB, and keeps
/// dropped ones below it for later: of a record of 1e6 rows, whose vectors have 8 MB, half as much again as is in use. A fixed
/// threshold stays where it is. A vector of fewer than 131 072 numbers is kept, so that short records, which are done thousands
/// of times a second, are as fast as before. The page on long records has the figures (`cargo xtask bench --scale`).
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const OWN_MAPPING_BYTES: libc::c_int = 1 << 20;

/// Has the allocator give large vectors back when they are dropped. To be called before there are any; does nothing with an
/// allocator other than that of the GNU C library.
pub(crate) fn give_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: `mallopt` sets one number of the allocator, under its lock; it takes any value, and refuses what it does not know.
    #[expect(unsafe_code, reason = "no safe way to set it; the environment is read before the program starts")]
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, OWN_MAPPING_BYTES);
    }
}

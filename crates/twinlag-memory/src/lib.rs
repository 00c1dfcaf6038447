//! How memory that is not needed any more goes back to the system.
//!
//! For programs that work on long records, with one large vector after the other, as `twinlag` and the benches of this repository.
//! It is a setting of the whole process, so a library leaves it to its program; whoever needs an allocator of
//! another kind takes that instead. The one crate of the workspace with `unsafe` in it.
//!
//! ```
//! twinlag_memory::give_back_large();
//! let record = vec![0.5; 1_000_000];
//! assert_eq!(record.iter().sum::<f64>(), 500_000.0);
//! // From here on its 8 MB are not this process's any more.
//! drop(record);
//! ```

/// Bytes from which on a vector has a mapping of its own, which goes back to the system when the vector is dropped.
///
/// The GNU C library raises this threshold to the size of the largest vector that was ever dropped, up to 32 MiB, and keeps
/// dropped ones below it for later: with a record of 1e6 rows, whose vectors have 8 MB, half as much again as is in use. A fixed
/// threshold stays where it is. A vector of fewer than 131 072 numbers is kept, so that short records, of which there may be thousands a
/// second, are as fast as before.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const OWN_MAPPING_BYTES: libc::c_int = 1 << 20;

/// Has the allocator give large vectors back when they are dropped. To be called before there are any; does nothing with an
/// allocator other than that of the GNU C library.
pub fn give_back_large() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: `mallopt` sets one number of the allocator, under its lock; it takes any value, and refuses what it does not know.
    #[expect(unsafe_code, reason = "no safe way to set it: the environment is read before a program starts")]
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, OWN_MAPPING_BYTES);
    }
}

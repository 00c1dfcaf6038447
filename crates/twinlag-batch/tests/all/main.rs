//! All tests of `twinlag-batch` in one program: linked once, and run side by side.

mod shards;
mod table;

//! What goes to the console besides the answer, and in what form the answer goes there.

/// How the program prints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Console {
    /// One JSON object on standard output instead of text.
    pub(crate) json: bool,
    /// No notes and no progress on standard error.
    pub(crate) quiet: bool,
}

impl Console {
    /// Prints a line on standard error, unless the program is to be quiet.
    pub(crate) fn note(self, text: impl FnOnce() -> String) {
        if !self.quiet {
            anstream::eprintln!("{}", text());
        }
    }
}

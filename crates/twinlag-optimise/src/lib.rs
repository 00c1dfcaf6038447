//! The minimum of any smooth cost within bounds, with a report of how it was found.

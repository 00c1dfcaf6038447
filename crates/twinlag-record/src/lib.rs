//! Reading and writing what temperature loggers write.

//! How badly two sensors disagree about the gas temperature both were in.

//! How a temperature sensor maps gas temperature to its reading, and back.

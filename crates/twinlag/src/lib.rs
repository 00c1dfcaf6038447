//! Two temperature sensors' time constants, and the gas temperature, from their readings alone.

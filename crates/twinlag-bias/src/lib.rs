//! What measurement noise adds to a two-sensor cost, and how to take it off.

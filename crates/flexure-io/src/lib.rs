//! Reads and writes records, models and arms.

//! Reads and writes records, models and arms.

pub mod arm;

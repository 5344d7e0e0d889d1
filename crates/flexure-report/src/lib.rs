//! One self-contained offline HTML page that shows an identification.

pub mod data;

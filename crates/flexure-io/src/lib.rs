//! Reads and writes records, models and arms.
//!
//! | to | call |
//! |---|---|
//! | read a record (CSV, whitespace-separated columns, Parquet, MAT, HDF5, ROS 2 bags) | [`read_record`] |
//! | write a record (CSV, Parquet) | [`write_record`], [`write_record_with_units`] |
//! | read, write or run an arm | [`arm`] |
//! | read a text file, such as an arm's | [`read_text`] |
//! | read a chain of links from URDF | [`urdf`] |
//! | read or write a model | [`read_model`], [`write_model`]; its text [`parse_model`], [`model_text`] |
//! | know before long work that its result can be written | [`check_writable`], [`check_record_writable`] |
//! | know before long work that there is memory for its record | [`check_computed`] |
//! | end by a signal and leave no temporary file | [`remove_temporaries`] |
//! | know which file a link means | [`destination`] |
//! | make a folder | [`make_folder`] |
//! | write any other file whole or not at all | [`write_atomically`] |

pub mod arm;
pub mod error;
pub mod model;
pub mod options;
pub mod record_file;
pub mod urdf;

mod atomic;
mod bag;
mod clocks;
mod formats;
mod hdf5;
mod mat;
mod memory;
mod parquet_file;
mod read;
mod table;
mod temporary;
mod text;
mod time;
mod topic;
mod units;
mod write;

pub use atomic::{check_writable, destination, make_folder, together, write_atomically};
pub use error::{Error, LineProblem, NoMemory, Result};
pub use formats::{FORMATS, Format};
pub use memory::{check_computed, usual_memory};
pub use model::{
    BlockLabel, ColumnChecksum, ModelFile, ModelPath, RecordMark, model_text, parse_model, read_model, write_model,
};
pub use options::{Decimal, ReadOptions};
pub use parquet_file::{ParquetParts, TakeRows};
pub use read::read_record;
pub use record_file::{RecordFile, UnsettledDates};
pub use table::{Row, write_table};
pub use temporary::{TemporaryFolder, remove_temporaries};
pub use text::read_text;
pub use time::{Instants, TimeColumn};
pub use topic::Topic;
pub use units::unit_at_end;
pub use write::{check_record_writable, write_record, write_record_with_units};

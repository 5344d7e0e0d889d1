//! Options that say how to read a record where the file itself leaves it open.

/// How a record is read; the default takes everything from the file, and refuses a file that can be read in two ways.
///
/// ```
/// # fn main() -> flexure_io::Result<()> {
/// # let path = std::env::temp_dir().join(format!("flexure-options-{}.csv", std::process::id()));
/// # std::fs::write(&path, "u;y\n1,250;2,125\n1,500;2,250\n").unwrap();
/// use flexure_io::{Decimal, ReadOptions};
///
/// // Is 1,250 one and a quarter, or one thousand two hundred and fifty?
/// let error = ReadOptions::default().read(&path).unwrap_err();
/// assert!(error.to_string().contains("--decimal comma"));
/// let options = ReadOptions { decimal: Some(Decimal::Comma), ..ReadOptions::default() };
/// assert_eq!(options.read(&path)?.column("u")?, [1.25, 1.5]);
/// # std::fs::remove_file(&path).unwrap();
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadOptions {
    /// The character between two fields.
    pub separator: Option<char>,
    /// The decimal sign of the numbers.
    pub decimal: Option<Decimal>,
    /// Whether the first line has the columns' names.
    pub header: Option<bool>,
    /// Lines at the beginning of the file that do not belong to the table.
    pub skip: u64,
    /// The format of time stamps that are not ISO 8601, such as `%d.%m.%Y %H:%M:%S%.f`.
    pub time_format: Option<String>,
    /// Texts that stand for a missing sample, such as `Bad`, in addition to those that programs and spreadsheets have for it.
    pub missing_texts: Vec<String>,
    /// The topic of a bag; not needed if only one topic can be read, or has the joint. For an HDF5 file it is a group.
    pub topic: Option<String>,
    /// The joint of a topic of `sensor_msgs/JointState`, whose columns are `position`, `velocity` and `effort`; by default all joints.
    pub joint: Option<String>,
    /// The most memory that the record may take, bytes; by default 4 GiB, or a twentieth of the free memory where that is less.
    pub memory: Option<u64>,
}

/// The decimal sign of a file's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decimal {
    /// 1.5; a comma may group thousands.
    Point,
    /// 1,5; a point may group thousands.
    Comma,
}

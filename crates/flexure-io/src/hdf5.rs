//! Records as HDF5, which MATLAB's `-v7.3` files are too: every vector of real numbers is a signal, every single number a constant.
//!
//! Vectors in groups are called by their paths, `group/name`. Nothing outside of the file is read: links to other files are not
//! followed.

use std::panic::AssertUnwindSafe;
use std::path::Path;

use flexure::{Interrupt, Record};
use hdf5_reader::error::Error as Fault;
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, Hdf5File, OpenOptions};

use crate::error::{Error, Result};
use crate::memory::Budget;
use crate::parquet_file::{exact, quietly};
use crate::record_file::{Other, RecordFile};
use crate::text::left_out;

/// Whether a file with this start is an HDF5 file. Its signature may follow a block of 512, 1024, 2048, ... bytes.
pub(crate) fn is_begun(start: &[u8]) -> bool {
    let places = [0].into_iter().chain((9..).map(|power| 1 << power));
    let mut found = places.map_while(|place| start.get(place..));
    found.any(|rest| rest.starts_with(SIGNATURE))
}

/// The first eight bytes of an HDF5 file, or those after a block for the user.
const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// The deepest groups that are read, against groups that hold themselves: convention.
const DEEPEST: usize = 16;
/// The most variables that are looked at: convention.
const MOST_VARIABLES: usize = 10_000;
/// The largest piece that a vector is stored in, bytes.
const LARGEST_PIECE: usize = 1 << 30;

/// The length of the head that all types have in common, bytes.
const TYPE_HEAD: usize = 8;

/// Where the bytes come from.
pub(crate) enum Source {
    File(std::fs::File),
    Bytes(Vec<u8>),
}

/// Reads the vectors of an HDF5 file, or those of one of its groups.
pub(crate) fn read(budget: &Budget, path: &Path, source: Source, group: Option<&str>) -> Result<RecordFile> {
    let contradictory = "its parts contradict each other; save it again";
    // The reader checks its input; this catches what it may miss.
    quietly(AssertUnwindSafe(|| read_checked(budget, path, source, group)))
        .unwrap_or_else(|_| Err(damaged(path, contradictory.to_owned())))
}

fn read_checked(budget: &Budget, path: &Path, source: Source, group: Option<&str>) -> Result<RecordFile> {
    let most = usize::try_from(budget.left()).unwrap_or(usize::MAX);
    let options = OpenOptions::default()
        .with_max_read_bytes(most)
        .with_max_chunk_bytes(most.min(LARGEST_PIECE));
    let fail = |fault| content(budget, path, fault);
    let file = match source {
        Source::File(file) => {
            let storage = hdf5_reader::FileStorage::from_file(file).map_err(fail)?;
            Hdf5File::from_storage_with_options(std::sync::Arc::new(storage), options)
        }
        Source::Bytes(bytes) => Hdf5File::from_vec_with_options(bytes, options),
    };
    let alone = group == Some("/");
    let root = file.and_then(|file| match group {
        Some(group) if !alone => file.group(group),
        _ => file.root_group(),
    });
    let mut reader = Reader {
        budget,
        path,
        signals: Vec::new(),
        units: Vec::new(),
        constants: Vec::new(),
        others: Vec::new(),
        seen: 0,
    };
    reader.group(&root.map_err(fail)?, "", 0, alone)?;
    reader.finish()
}

/// What was read so far.
struct Reader<'a> {
    budget: &'a Budget<'a>,
    path: &'a Path,
    signals: Vec<(String, Vec<f64>)>,
    units: Vec<Option<String>>,
    constants: Vec<(String, f64)>,
    others: Vec<Other>,
    seen: usize,
}

/// How numbers are stored.
#[derive(Clone, Copy)]
enum Numbers {
    Integers { size: u8, signed: bool },
    Floats { size: u8 },
}

impl Reader<'_> {
    fn group(&mut self, group: &Group, prefix: &str, depth: usize, alone: bool) -> Result<()> {
        let (mut groups, datasets) = group
            .members()
            .map_err(|fault| content(self.budget, self.path, fault))?;
        if alone {
            groups.clear();
        }
        self.seen += groups.len() + datasets.len();
        if depth > DEEPEST || self.seen > MOST_VARIABLES {
            let detail = format!("it has more than {MOST_VARIABLES} variables, or groups within groups without end");
            return Err(damaged(self.path, detail));
        }
        for (i, dataset) in datasets.iter().enumerate() {
            Interrupt::report(i as u64, datasets.len() as u64);
            let name = format!("{prefix}{}", dataset.name().rsplit('/').next().unwrap_or_default());
            self.dataset(dataset, name)?;
        }
        for group in groups {
            let name = group.name().rsplit('/').next().unwrap_or_default();
            // MATLAB keeps the parts of cells and objects in these groups.
            if !name.starts_with('#') {
                self.group(&group, &format!("{prefix}{name}/"), depth + 1, false)?;
            }
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: &Dataset, name: String) -> Result<()> {
        let shape = dataset.shape();
        let size = shape.iter().map(u64::to_string).collect::<Vec<_>>().join("x");
        let text = |attribute: &str| dataset.attribute(attribute).and_then(|found| found.read_string()).ok();
        let class = text("MATLAB_class").unwrap_or_default();
        let is_empty = shape.contains(&0) || dataset.attribute("MATLAB_empty").is_ok();
        let stored = dataset.raw_datatype().unwrap_or_default();
        let numbers = match (numbers(dataset.dtype(), &stored), class.as_str()) {
            (_, "char") => Err(format!("text ({size})")),
            (_, "cell") => Err(format!("a cell array ({size})")),
            (Ok(_), _) if is_empty => Err(format!("empty ({size})")),
            (Ok(_), _) if shape.iter().filter(|&&d| d != 1).count() > 1 => {
                Err(format!("a matrix ({size}); save each signal as a vector of its own"))
            }
            (Err(what), _) => Err(format!("{what} ({size})")),
            (Ok(numbers), _) => Ok(numbers),
        };
        let numbers = match numbers {
            Ok(numbers) => numbers,
            Err(what) => {
                self.others.push(Other::new(name, what));
                return Ok(());
            }
        };
        let fail = |fault: Fault| content(self.budget, self.path, fault);
        let bytes = dataset.raw_byte_len().map_err(fail)? as u64;
        let what = format!("the vector '{name}'");
        self.budget.take(bytes, &what)?;
        let stored = dataset.read_native_bytes().map_err(fail)?;
        self.budget.numbers(
            usize::try_from(dataset.num_elements().map_err(fail)?).unwrap_or(usize::MAX),
            &what,
        )?;
        let values = values(numbers, &stored);
        drop(stored);
        self.budget.give_back(bytes);
        match values {
            None => {
                let what = "a vector of integers beyond 2^53, which cannot be represented exactly";
                self.others.push(Other::new(name, what.to_owned()));
            }
            Some(values) => match values[..] {
                [] => self.others.push(Other::new(name, "empty".to_owned())),
                [value] => self.constants.push((name, value)),
                _ => {
                    self.signals.push((name, values));
                    self.units
                        .push(text("units").or_else(|| text("unit")).filter(|unit| !unit.is_empty()));
                }
            },
        }
        Ok(())
    }

    fn finish(mut self) -> Result<RecordFile> {
        if self.signals.is_empty() {
            let mut found: Vec<String> = self.others.iter().map(Other::to_string).collect();
            found.extend(
                self.constants
                    .iter()
                    .map(|(name, _)| format!("'{name}' is a single number")),
            );
            if found.is_empty() {
                found.push("it holds no variable".to_owned());
            }
            let detail = format!("it holds no vector of real numbers: {}", found.join("; "));
            return Err(damaged(self.path, detail));
        }
        let length = self.signals[0].1.len();
        if let Some((name, samples)) = self.signals.iter().find(|(_, samples)| samples.len() != length) {
            let detail = format!(
                "'{name}' has {} samples, but '{}' has {length}; a record's vectors are equally long: choose a group by --topic ('/' for what is in no group), or save them apart",
                samples.len(),
                self.signals[0].0
            );
            return Err(damaged(self.path, detail));
        }
        let record = Record::new(self.signals).map_err(|error| Error::data(self.path, error))?;
        let scalar = |(name, value): &(String, f64)| {
            Other::new(name.clone(), format!("a single number, {value}; a signal is a vector"))
        };
        let notes = left_out(&self.others, &[]).into_iter().collect();
        self.others.extend(self.constants.iter().map(scalar));
        Ok(RecordFile {
            notes,
            units: self.units,
            constants: self.constants,
            others: self.others,
            ..RecordFile::new(record, self.path)
        })
    }
}

/// How the numbers of a type are stored, or what the type is instead; `message` is the type as it stands in the file.
fn numbers(kind: &Datatype, message: &[u8]) -> std::result::Result<Numbers, &'static str> {
    match kind {
        Datatype::FixedPoint {
            size: 1 | 2 | 4 | 8, ..
        }
        | Datatype::FloatingPoint { size: 4 | 8, .. }
            if !fills_its_bytes(message) =>
        {
            Err("numbers with an unusual layout of bits; save them as int32 or float64")
        }
        Datatype::FixedPoint {
            size: size @ (1 | 2 | 4 | 8),
            signed,
            ..
        } => Ok(Numbers::Integers {
            size: *size,
            signed: *signed,
        }),
        Datatype::FloatingPoint {
            size: size @ (4 | 8), ..
        } => Ok(Numbers::Floats { size: *size }),
        // h5py's truth values.
        Datatype::Enum { base, members }
            if members.len() == 2 && members.iter().all(|m| ["FALSE", "TRUE"].contains(&m.name.as_str())) =>
        {
            numbers(base, message.get(TYPE_HEAD..).unwrap_or_default())
        }
        Datatype::FixedPoint { .. } | Datatype::FloatingPoint { .. } => {
            Err("numbers of a size other than 32 or 64 bits; save them as float32")
        }
        Datatype::String { .. } | Datatype::VarLen { .. } => Err("text or a list of lists"),
        Datatype::Compound { fields, .. } if fields.iter().any(|f| f.name.starts_with('i')) && fields.len() == 2 => {
            Err("complex; save its real and imaginary parts apart")
        }
        Datatype::Compound { .. } => Err("a table; save its columns as vectors"),
        Datatype::Enum { .. } => Err("an enumeration"),
        Datatype::Reference { .. } => Err("references to other variables"),
        _ => Err("no numbers"),
    }
}

/// Whether numbers of this type have the layout that processors use. The library misreads all others.
///
/// Source: "HDF5 File Format Specification" 3.0, section IV.A.2.d: a head with class, flags and size, then bit offset and precision; for
/// floating point also the positions and sizes of exponent and mantissa, and the exponent's bias.
fn fills_its_bytes(message: &[u8]) -> bool {
    let Some(&[class, flags, sign, _, size, 0, 0, 0, 0, 0, precision, 0]) = message.first_chunk::<12>() else {
        return false;
    };
    if u32::from(precision) != 8 * u32::from(size) {
        return false;
    }
    // The bits 4 and 5 of a floating-point type: the mantissa's first bit is 1 and not stored. Bit 6 is for byte orders of the VAX.
    let layout = || (flags & 0b0111_0000, sign, message.get(12..20));
    match (class & 0x0f, size) {
        (0, _) => true,
        (1, 4) => layout() == (0b0010_0000, 31, Some(&[23, 8, 0, 23, 127, 0, 0, 0])),
        (1, 8) => layout() == (0b0010_0000, 63, Some(&[52, 11, 0, 52, 0xff, 0x03, 0, 0])),
        _ => false,
    }
}

/// Numbers in the machine's byte order; `None` if one is an integer that f64 cannot hold.
fn values(numbers: Numbers, bytes: &[u8]) -> Option<Vec<f64>> {
    macro_rules! decode {
        ($type:ty, $convert:expr) => {{
            let (values, _) = bytes.as_chunks::<{ size_of::<$type>() }>();
            values.iter().map(|b| $convert(<$type>::from_ne_bytes(*b))).collect()
        }};
    }
    match numbers {
        Numbers::Integers { size: 1, signed: true } => decode!(i8, |v| Some(f64::from(v))),
        Numbers::Integers { size: 1, .. } => decode!(u8, |v| Some(f64::from(v))),
        Numbers::Integers { size: 2, signed: true } => decode!(i16, |v| Some(f64::from(v))),
        Numbers::Integers { size: 2, .. } => decode!(u16, |v| Some(f64::from(v))),
        Numbers::Integers { size: 4, signed: true } => decode!(i32, |v| Some(f64::from(v))),
        Numbers::Integers { size: 4, .. } => decode!(u32, |v| Some(f64::from(v))),
        Numbers::Integers { signed: true, .. } => decode!(i64, |v| exact(i128::from(v))),
        Numbers::Integers { .. } => decode!(u64, |v| exact(i128::from(v))),
        Numbers::Floats { size: 4 } => decode!(f32, |v| Some(f64::from(v))),
        Numbers::Floats { .. } => decode!(f64, Some),
    }
}

fn damaged(path: &Path, detail: String) -> Error {
    Error::content(path, "HDF5", detail)
}

/// The error for a fault that the reader found.
fn content(budget: &Budget, path: &Path, fault: Fault) -> Error {
    match fault {
        Fault::Io(cause) => Error::read(path, cause),
        Fault::UnexpectedEof { offset, .. } => Error::Truncated {
            path: path.to_owned(),
            detail: format!("what should stand at byte {offset} is not there"),
        },
        Fault::ResourceLimit { .. } => budget.too_large("a vector"),
        Fault::GroupNotFound(name) => damaged(path, format!("it has no group '{name}'")),
        other => damaged(path, format!("{other}; save it again, uncompressed or with deflate")),
    }
}

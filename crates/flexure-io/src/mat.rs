//! Records as MATLAB's MAT-file of level 5, plain (`-v6`) or compressed (`-v7`).
//!
//! The fields of a structure are read as variables are: many scripts keep a log as one structure.
//!
//! Source: MathWorks, "MAT-File Format", chapter 1, level 5. Every length is checked before it is
//! used: a damaged file is an error, never a panic and never a shorter record.

mod structures;

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;
use flexure::Record;

use crate::error::{Error, Result};
use crate::memory::Budget;
use crate::parquet_file::exact;
use crate::record_file::{Other, RecordFile};
use crate::text::left_out;

/// The bytes before the first variable: text, version, byte order.
const HEADER: usize = 128;
/// Data types of elements.
const MI_INT32: u32 = 5;
const MI_UINT32: u32 = 6;
const MI_MATRIX: u32 = 14;
const MI_COMPRESSED: u32 = 15;
/// Flag bit of complex arrays.
const COMPLEX: u32 = 0x0800;

/// What can go wrong within the bytes of a file.
enum Fault {
    /// The bytes end before the element does.
    Truncated,
    /// They declare more than there is memory for.
    TooLarge(&'static str),
    /// The bytes contradict the format.
    Corrupt(&'static str),
}

type Parsed<T> = std::result::Result<T, Fault>;

/// A variable of the file.
struct Variable {
    name: String,
    content: Content,
}

enum Content {
    Scalar(f64),
    Vector(Vec<f64>),
    /// The fields of one structure.
    Structure(Vec<Variable>),
    /// Not a vector of real numbers: what it is instead.
    Other(String),
}

/// Reads the MAT v5 record `file`.
pub(crate) fn read(budget: &Budget, path: &Path, file: impl Read) -> Result<RecordFile> {
    let bytes = budget.all(file)?;
    let big_endian = byte_order(path, &bytes)?;
    let mut variables = Vec::new();
    let mut cursor = Cursor {
        bytes: &bytes[HEADER..],
        big_endian,
        budget,
    };
    while !cursor.bytes.is_empty() {
        let offset = bytes.len() - cursor.bytes.len();
        let variable = top_level(&mut cursor).map_err(|fault| match fault {
            Fault::Truncated => Error::Truncated {
                path: path.to_owned(),
                detail: format!(
                    "it ends after {} bytes, within the variable that begins at byte {offset}",
                    bytes.len()
                ),
            },
            Fault::TooLarge(what) => budget.too_large(&format!("{what} at byte {offset}")),
            Fault::Corrupt(what) => damaged(
                path,
                format!("{what} in the variable at byte {offset}; save it again with -v7"),
            ),
        })?;
        // A variable without a name is MATLAB's workspace of function handles.
        variables.extend(variable.filter(|v| !v.name.is_empty()));
    }
    let (variables, structures) = structures::opened(variables);
    let (mut signals, mut constants, mut others) = (Vec::new(), Vec::new(), Vec::new());
    for Variable { name, content } in variables {
        match content {
            Content::Scalar(value) => constants.push((name, value)),
            Content::Other(what) => others.push(Other::new(name, what)),
            Content::Vector(samples) => signals.push((name, samples)),
            Content::Structure(_) => {}
        }
    }
    let record = Record::new(signals).map_err(|error| Error::data(path, error))?;
    if record.names().is_empty() {
        let mut found: Vec<String> = others.iter().map(Other::to_string).collect();
        found.extend(constants.iter().map(|(name, _)| format!("'{name}' is a scalar")));
        if found.is_empty() {
            found.push("it holds no variable".to_owned());
        }
        let found = found.join("; ");
        return Err(damaged(path, format!("it holds no vector of real numbers: {found}")));
    }
    let scalar = |(name, value): &(String, f64)| {
        let what = format!("a single number, {value}; a signal is a vector");
        Other::new(name.clone(), what)
    };
    let notes = structures.into_iter().chain(left_out(&others, &[])).collect();
    others.extend(constants.iter().map(scalar));
    Ok(RecordFile {
        notes,
        constants,
        others,
        ..RecordFile::new(record, path)
    })
}

fn damaged(path: &Path, detail: String) -> Error {
    Error::content(path, "MAT v5", detail)
}

/// Whether the file is big-endian; refuses other versions.
fn byte_order(path: &Path, bytes: &[u8]) -> Result<bool> {
    if bytes.len() < HEADER {
        return Err(Error::Truncated {
            path: path.to_owned(),
            detail: format!(
                "it ends after {} of the {HEADER} bytes of a MAT file's header",
                bytes.len()
            ),
        });
    }
    match &bytes[124..128] {
        [0x00, 0x01, b'I', b'M'] => Ok(false),
        [0x01, 0x00, b'M', b'I'] => Ok(true),
        _ => Err(damaged(
            path,
            "its header is not that of MAT v5; save it with -v7".to_owned(),
        )),
    }
}

/// Bytes still to be read.
struct Cursor<'a> {
    bytes: &'a [u8],
    big_endian: bool,
    budget: &'a Budget<'a>,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Parsed<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(count).ok_or(Fault::Truncated)?;
        self.bytes = rest;
        Ok(taken)
    }

    fn u32(&mut self) -> Parsed<u32> {
        let bytes = self.take_array()?;
        Ok(self.u32_of(bytes))
    }

    fn take_array<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        self.take(N)?.try_into().map_err(|_| Fault::Truncated)
    }

    fn u32_of(&self, bytes: [u8; 4]) -> u32 {
        if self.big_endian {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        }
    }

    /// The next element's type and data, its padding to 8 bytes skipped.
    fn element(&mut self) -> Parsed<(u32, &'a [u8])> {
        let tag = self.u32()?;
        if tag >> 16 != 0 {
            // The small format: length and type share a word, the data the next four bytes.
            let length = (tag >> 16) as usize;
            let data = self.take(4)?;
            let data = data
                .get(..length)
                .ok_or(Fault::Corrupt("a small element longer than 4 bytes"))?;
            return Ok((tag & 0xffff, data));
        }
        let length = self.u32()? as usize;
        let data = self.take(length)?;
        let padding = length.next_multiple_of(8) - length;
        self.bytes = self.bytes.get(padding..).unwrap_or(&[]);
        Ok((tag, data))
    }
}

/// The next variable, if the element is one.
fn top_level(cursor: &mut Cursor<'_>) -> Parsed<Option<Variable>> {
    let (big_endian, budget) = (cursor.big_endian, cursor.budget);
    let kind = cursor.u32()?;
    let length = cursor.u32()? as usize;
    let data = cursor.take(length)?;
    let inflated;
    let bytes = match kind {
        MI_MATRIX => data,
        MI_COMPRESSED => {
            inflated = inflate(data, cursor)?;
            &inflated
        }
        _ => return Err(Fault::Corrupt("an element that is no array")),
    };
    let array = Cursor {
        bytes,
        big_endian,
        budget,
    };
    let variable = matrix(array, false).map(Some).map_err(within);
    // The unpacked bytes are freed here.
    budget.give_back(if kind == MI_COMPRESSED { bytes.len() as u64 } else { 0 });
    variable
}

/// Inside a complete element, an early end is a contradiction, not a truncation.
fn within(fault: Fault) -> Fault {
    match fault {
        Fault::Truncated => Fault::Corrupt("lengths that do not fit together"),
        other => other,
    }
}

/// The content of the one array in a compressed element; the checksum is verified.
fn inflate(data: &[u8], order: &Cursor<'_>) -> Parsed<Vec<u8>> {
    const DAMAGED: Fault = Fault::Corrupt("damaged compressed data");
    let mut decoder = ZlibDecoder::new(data);
    let mut tag = [0; 8];
    decoder.read_exact(&mut tag).map_err(|_| DAMAGED)?;
    let [k0, k1, k2, k3, l0, l1, l2, l3] = tag;
    if order.u32_of([k0, k1, k2, k3]) != MI_MATRIX {
        return Err(Fault::Corrupt("a compressed element that is no array"));
    }
    let length = order.u32_of([l0, l1, l2, l3]) as usize;
    let too_large = Fault::TooLarge("the variable that is unpacked");
    let mut inflated = Vec::new();
    if order.budget.take(length as u64, "").is_err() || inflated.try_reserve_exact(length).is_err() {
        return Err(too_large);
    }
    // The length is not trusted: one more byte is read, which shows whether it is too small.
    decoder
        .by_ref()
        .take(length as u64 + 1)
        .read_to_end(&mut inflated)
        .map_err(|_| DAMAGED)?;
    if inflated.len() != length {
        return Err(DAMAGED);
    }
    Ok(inflated)
}

/// An array: flags, dimensions, name, and for numbers the real and imaginary parts; `is_field` says that a structure has it.
fn matrix(mut cursor: Cursor<'_>, is_field: bool) -> Parsed<Variable> {
    let (kind, flags) = cursor.element()?;
    let (MI_UINT32, &[f0, f1, f2, f3, ..]) = (kind, flags) else {
        return Err(Fault::Corrupt("array flags of a wrong kind"));
    };
    let flags = cursor.u32_of([f0, f1, f2, f3]);
    let class = flags & 0xff;
    if class == 17 {
        // Opaque objects have no dimensions.
        let name = name(&mut cursor)?;
        return Ok(Variable {
            name,
            content: Content::Other("an object of a class of MATLAB's".to_owned()),
        });
    }
    let dimensions = dimensions(&mut cursor)?;
    let count = dimensions
        .iter()
        .try_fold(1_usize, |product, &d| product.checked_mul(d));
    let count = count.ok_or(Fault::Corrupt("impossible dimensions"))?;
    let name = name(&mut cursor)?;
    if class == 2 && count == 1 && !is_field {
        let content = Content::Structure(structures::fields(&mut cursor)?);
        return Ok(Variable { name, content });
    }
    if let Some(what) = unusable(class, flags & COMPLEX != 0, &dimensions, is_field)? {
        return Ok(Variable {
            name,
            content: Content::Other(what),
        });
    }
    let (kind, data) = cursor.element()?;
    // All values must be present, so that the declared number is not trusted without proof.
    if cursor.budget.numbers(count.min(data.len()), "").is_err() {
        return Err(Fault::TooLarge("the vector"));
    }
    let content = match numbers(kind, data, count, cursor.big_endian)? {
        None => Content::Other("a vector of integers beyond 2^53, which cannot be represented exactly".to_owned()),
        Some(values) if count == 1 => Content::Scalar(values[0]),
        Some(values) => Content::Vector(values),
    };
    if !cursor.bytes.is_empty() {
        return Err(Fault::Corrupt("bytes after the end of an array"));
    }
    Ok(Variable { name, content })
}

fn dimensions(cursor: &mut Cursor<'_>) -> Parsed<Vec<usize>> {
    let (kind, bytes) = cursor.element()?;
    if kind != MI_INT32 || bytes.len() < 8 || !bytes.len().is_multiple_of(4) {
        return Err(Fault::Corrupt("dimensions of a wrong kind"));
    }
    let sizes = bytes.as_chunks::<4>().0.iter();
    Ok(sizes.map(|bytes| cursor.u32_of(*bytes) as usize).collect())
}

/// What an array of this class is, if it is neither a vector nor a scalar of real numbers.
fn unusable(class: u32, is_complex: bool, dimensions: &[usize], is_field: bool) -> Parsed<Option<String>> {
    let size = dimensions.iter().map(usize::to_string).collect::<Vec<_>>().join("x");
    let is_matrix = dimensions.iter().filter(|&&d| d != 1).count() > 1;
    Ok(Some(match class {
        1 => format!("a cell array ({size})"),
        2 if is_field => format!("a structure within a structure ({size}); save its fields as variables"),
        2 => format!("a structure ({size}); save its fields as variables"),
        3 | 16 => "an object or a function".to_owned(),
        4 => format!("text ({size})"),
        5 => format!("a sparse matrix ({size}); save its vectors as full variables"),
        6..=15 if is_complex => format!("complex ({size}); save its real and imaginary parts apart"),
        6..=15 if dimensions.contains(&0) => format!("empty ({size})"),
        6..=15 if is_matrix => format!("a matrix ({size}); save each signal as a vector of its own"),
        6..=15 => return Ok(None),
        _ => return Err(Fault::Corrupt("an array of an unknown class")),
    }))
}

fn name(cursor: &mut Cursor<'_>) -> Parsed<String> {
    let (_, bytes) = cursor.element()?;
    String::from_utf8(bytes.to_vec()).map_err(|_| Fault::Corrupt("a name that is not text"))
}

/// `count` numbers stored as type `kind`; `None` if one is an integer that f64 cannot hold.
fn numbers(kind: u32, data: &[u8], count: usize, big_endian: bool) -> Parsed<Option<Vec<f64>>> {
    /// Decodes numbers of one type; all must be present.
    macro_rules! decode {
        ($type:ty, $convert:expr) => {{
            let (values, rest) = data.as_chunks::<{ size_of::<$type>() }>();
            if values.len() != count || !rest.is_empty() {
                return Err(Fault::Corrupt("a number of values that does not match the dimensions"));
            }
            let number = |b: &[u8; size_of::<$type>()]| {
                if big_endian {
                    <$type>::from_be_bytes(*b)
                } else {
                    <$type>::from_le_bytes(*b)
                }
            };
            values.iter().map(|b| $convert(number(b))).collect()
        }};
    }
    Ok(match kind {
        1 => decode!(i8, |v| Some(f64::from(v))),
        2 => decode!(u8, |v| Some(f64::from(v))),
        3 => decode!(i16, |v| Some(f64::from(v))),
        4 => decode!(u16, |v| Some(f64::from(v))),
        5 => decode!(i32, |v| Some(f64::from(v))),
        6 => decode!(u32, |v| Some(f64::from(v))),
        7 => decode!(f32, |v| Some(f64::from(v))),
        9 => decode!(f64, Some),
        12 => decode!(i64, |v| exact(i128::from(v))),
        13 => decode!(u64, |v| exact(i128::from(v))),
        _ => return Err(Fault::Corrupt("numbers of an unknown type")),
    })
}

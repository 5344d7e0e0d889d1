//! Tables of results: columns of numbers, text and truth values in which values may be missing.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use serde_json::Value;

use crate::atomic::write_atomically;
use crate::error::{Error, Result};

/// A row: values by the names of their columns, in their order. Numbers, text, truth values and null.
pub type Row = Vec<(String, Value)>;

/// The kind of a column's values.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Numbers,
    Truth,
    Text,
}

/// The columns of all rows, in the order of their first occurrence.
fn columns(rows: &[Row]) -> Vec<(&str, Kind)> {
    let mut columns: Vec<(&str, Option<Kind>)> = Vec::new();
    for (name, value) in rows.iter().flatten() {
        let kind = match value {
            Value::Null => None,
            Value::Number(_) => Some(Kind::Numbers),
            Value::Bool(_) => Some(Kind::Truth),
            _ => Some(Kind::Text),
        };
        match columns.iter_mut().find(|(other, _)| other == name) {
            None => columns.push((name, kind)),
            // If the rows' kinds differ, text can hold them all.
            Some((_, own)) => {
                *own = match (*own, kind) {
                    (Some(own), Some(kind)) if own != kind => Some(Kind::Text),
                    (own, kind) => own.or(kind),
                }
            }
        }
    }
    let known = |(name, kind): (_, Option<Kind>)| (name, kind.unwrap_or(Kind::Numbers));
    columns.into_iter().map(known).collect()
}

/// The value of a column, if the row has it.
fn value<'a>(row: &'a Row, name: &str) -> Option<&'a Value> {
    let found = row.iter().find(|(own, _)| own == name);
    found.map(|(_, value)| value).filter(|value| !value.is_null())
}

fn text(value: &Value) -> Option<String> {
    match value {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}

/// Writes rows as a table; the extension, `.parquet` or `.csv`, decides the format. Missing values are null, in CSV empty.
///
/// # Errors
/// [`Error::UnknownExtension`]; [`Error::Write`].
pub fn write_table(path: &Path, rows: &[Row]) -> Result<()> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match extension.as_deref() {
        Some("csv") => write_atomically(path, |out| csv(out, rows)),
        Some("parquet") => write_atomically(path, |out| parquet(out, rows)),
        _ => Err(Error::UnknownExtension { path: path.to_owned() }),
    }
}

fn csv(out: &mut impl Write, rows: &[Row]) -> io::Result<()> {
    let columns = columns(rows);
    let quoted = |text: &str| match text.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    };
    let header: Vec<String> = columns.iter().map(|(name, _)| quoted(name)).collect();
    writeln!(out, "{}", header.join(","))?;
    for row in rows {
        let cell = |(name, _): &(&str, Kind)| {
            value(row, name)
                .and_then(text)
                .map_or(String::new(), |text| quoted(&text))
        };
        let cells: Vec<String> = columns.iter().map(cell).collect();
        writeln!(out, "{}", cells.join(","))?;
    }
    Ok(())
}

fn parquet(out: &mut (impl Write + Send), rows: &[Row]) -> io::Result<()> {
    let columns = columns(rows);
    let field = |(name, kind): &(&str, Kind)| {
        let (physical, logical) = match kind {
            Kind::Numbers => (Physical::DOUBLE, None),
            Kind::Truth => (Physical::BOOLEAN, None),
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical);
        Ok(Arc::new(field.build()?))
    };
    let fields = columns.iter().map(field).collect::<parquet::errors::Result<Vec<_>>>()?;
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (name, kind) in &columns {
        let values = rows.iter().map(|row| value(row, name));
        match kind {
            Kind::Numbers => write::<DoubleType, _>(&mut group, values.map(|v| v?.as_f64()))?,
            Kind::Truth => write::<BoolType, _>(&mut group, values.map(|v| v?.as_bool()))?,
            Kind::Text => write::<ByteArrayType, _>(
                &mut group,
                values.map(|v| Some(ByteArray::from(text(v?)?.into_bytes()))),
            )?,
        }
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

/// Writes a column; values may be missing.
fn write<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: impl Iterator<Item = Option<T::T>>,
) -> io::Result<()> {
    let values: Vec<Option<T::T>> = values.collect();
    let there: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let present: Vec<T::T> = values.into_iter().flatten().collect();
    let Some(mut column) = group.next_column()? else {
        return Err(io::Error::other("the row group has too few columns"));
    };
    column.typed::<T>().write_batch(&present, Some(&there), None)?;
    column.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;
    use serde_json::json;

    use super::*;

    #[test]
    fn values_come_back_and_missing_ones_stay_missing() {
        let rows = [
            json!({ "key": "a,\"b\"", "fit": 97.5, "holds": true }),
            json!({ "key": "c", "error": "line 2\nis bad", "fit": null, "mixed": 1 }),
            json!({ "key": "d", "mixed": "text" }),
        ];
        let pairs = |row: &Value| row.as_object().unwrap().clone().into_iter().collect();
        let rows: Vec<Row> = rows.iter().map(pairs).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        write_table(&path, &rows).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let found: Vec<Vec<(String, Field)>> = (reader.get_row_iter(None).unwrap())
            .map(|row| row.unwrap().into_columns())
            .collect();
        let value = |row: usize, name: &str| found[row].iter().find(|(n, _)| n == name).unwrap().1.clone();
        assert_eq!(value(0, "key"), Field::Str("a,\"b\"".to_owned()));
        assert_eq!(value(0, "fit"), Field::Double(97.5));
        assert_eq!(value(0, "holds"), Field::Bool(true));
        assert_eq!(value(1, "fit"), Field::Null);
        assert_eq!(value(1, "mixed"), Field::Str("1".to_owned()));
        assert_eq!(value(2, "holds"), Field::Null);

        let path = folder.path().join("t.csv");
        write_table(&path, &rows).unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        assert!(
            text.starts_with("fit,holds,key,error,mixed\n97.5,true,\"a,\"\"b\"\"\",,\n,,c,\"line 2\nis bad\",1\n"),
            "{text}"
        );
        assert!(write_table(&folder.path().join("t.xls"), &rows).is_err());
    }
}

//! What can be exported, and the names of the formats.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Result, bail};
use flexure::Block;
use flexure::nonlinearity::{Curve, Outside};
use flexure_export::{Fmi, Format};
use flexure_io::{ModelFile, read_model, read_record};

use crate::named::{Named, NamedValue};

impl Named for Format {
    const ALL: &'static [NamedValue<Format>] = &[
        NamedValue::new(
            Format::C,
            "c",
            "C99: a source file and a header, without heap and dependencies",
        ),
        NamedValue::new(Format::Fmu, "fmu", "A co-simulation FMU with its C source"),
        NamedValue::new(Format::Onnx, "onnx", "A graph in float64 that takes a whole sequence"),
        NamedValue::new(Format::Python, "python", "A Python module without dependencies"),
        NamedValue::new(Format::Matlab, "matlab", "A function file for MATLAB and Octave"),
    ];
}

impl Named for Fmi {
    const ALL: &'static [NamedValue<Fmi>] = &[
        NamedValue::new(Fmi::Two, "2", "FMI 2.0"),
        NamedValue::new(Fmi::Three, "3", "FMI 3.0"),
    ];
}

/// The model of a file: a model file, or a table (.csv, .parquet) such as `flexure joint --friction` and `flexure regress -o` write, whose second
/// column is a function of the first. Beyond its rows the function has the value of the nearest.
///
/// # Errors
/// Those of [`read_model`] and [`read_record`]; for a table whose first two columns are no curve.
pub fn exportable(path: &Path) -> Result<ModelFile> {
    if !path.extension().is_some_and(|e| e == "csv" || e == "parquet") {
        return Ok(read_model(path)?);
    }
    let file = read_record(path)?;
    let names = file.record.names();
    // What follows is the band.
    let ([input, output], true) = (
        names.split_at(names.len().min(2)).0,
        names.get(2).is_none_or(|third| third == "lower"),
    ) else {
        bail!(
            "{}: a curve has two columns, x and y, or its band's columns lower and upper beside them",
            path.display()
        );
    };
    let (x, y) = (file.finite(input)?.to_vec(), file.finite(output)?.to_vec());
    let curve = Curve::new(x, y, Outside::Nearest).map_err(|error| {
        let why = "the first column must increase from row to row";
        anyhow::anyhow!("{}: no curve ({error}); {why}", path.display())
    })?;
    Ok(ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: "curve".to_owned(),
        method: String::new(),
        inputs: vec![input.clone()],
        output: output.clone(),
        sample_time: None,
        delay: 0,
        order: 0,
        block: Block::Static(curve),
        paths: Vec::new(),
        is_sum: false,
        settling: None,
        noise_model: None,
        estimated: None,
        reading: BTreeMap::new(),
        missing: false,
        records: Vec::new(),
        identification: serde_json::Value::Null,
    })
}

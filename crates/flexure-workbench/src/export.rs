//! What can be exported, and the names of the formats.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, Result, bail};
use flexure::Block;
use flexure::nonlinearity::{Curve, Outside, Surface, SurfaceAxis};
use flexure::text::shown_path;
use flexure_export::{Fmi, Format};
use flexure_io::{ModelFile, RecordFile, read_model, read_record};

use crate::labels::Labels;
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

/// How far points of a grid may be from even spacing, relative to its range: the effect of rounding to nine digits.
const UNEVEN: f64 = 1e-8;
/// The columns after x in the output of `flexure regress -o`.
const BEHIND: [&str; 3] = ["y", "lower", "upper"];

/// The model of a file: a model file, or a table (.csv, .parquet) as written by `flexure joint --friction` and `flexure regress -o`. In a
/// table of one x, the second column is a function of the first; in a table of several, y is a function on their grid. Beyond the rows the
/// function has the value of the nearest row.
///
/// # Errors
/// Those of [`read_model`] and [`read_record`]; for a table that is neither a curve nor a surface.
pub fn exportable(path: &Path) -> Result<ModelFile> {
    if !path.extension().is_some_and(|e| e == "csv" || e == "parquet") {
        return Ok(read_model(path)?);
    }
    let file = read_record(path)?;
    let names = file.record.names();
    let (x, behind) = names.split_at(names.len().saturating_sub(BEHIND.len()));
    if x.len() > 1 && behind == BEHIND {
        let surface = surface(&file, x)?;
        return Ok(memoryless(&file, "surface", x, &behind[0], Block::Surface(surface)));
    }
    // The other columns are the band.
    let ([input, output], true) = (
        names.split_at(names.len().min(2)).0,
        names.get(2).is_none_or(|third| third == "lower"),
    ) else {
        bail!(
            "{}: a curve has two columns, x and y, or its band's columns lower and upper beside them; a surface has its columns of x, then \
             y, lower and upper",
            shown_path(path)
        );
    };
    let (x, y) = (file.finite(input)?.to_vec(), file.finite(output)?.to_vec());
    let curve = Curve::new(x, y, Outside::Nearest).map_err(|error| {
        let why = "the first column must increase from row to row";
        anyhow::anyhow!("{}: no curve ({error}); {why}", shown_path(path))
    })?;
    Ok(memoryless(
        &file,
        "curve",
        std::slice::from_ref(input),
        output,
        Block::Static(curve),
    ))
}

/// The surface through y on the grid of the columns of x.
fn surface(file: &RecordFile, names: &[String]) -> Result<Surface> {
    let y = file
        .finite(BEHIND[0])
        .context("a surface needs a value at every point of its grid; regress on fewer columns, or on more rows")?;
    let (mut axes, mut index) = (Vec::new(), vec![0_usize; y.len()]);
    for name in names {
        let x = file.finite(name)?;
        let mut points = x.to_vec();
        points.sort_unstable_by(f64::total_cmp);
        points.dedup();
        let (low, high, pieces) = (points[0], points[points.len() - 1], points.len() - 1);
        let even =
            |(i, p): (usize, &f64)| (p - low - (high - low) * i as f64 / pieces as f64).abs() <= UNEVEN * (high - low);
        if pieces < 3 || !points.iter().enumerate().all(even) {
            bail!(
                "{}: a surface needs a grid of four evenly spaced values or more of '{name}', as flexure regress writes without --at",
                shown_path(&file.path)
            );
        }
        for (index, x) in index.iter_mut().zip(x) {
            *index = index
                .wrapping_mul(points.len())
                .wrapping_add(points.partition_point(|p| p < x));
        }
        axes.push(SurfaceAxis { low, high, pieces });
    }
    let mut order: Vec<usize> = (0..y.len()).collect();
    order.sort_unstable_by_key(|&row| index[row]);
    let points = |axis: &SurfaceAxis| axis.pieces + 1;
    let whole = axes.iter().map(points).fold(1, usize::saturating_mul) == y.len();
    if !(whole && order.iter().enumerate().all(|(i, &row)| index[row] == i)) {
        bail!(
            "{}: a surface needs every point of its grid, each once",
            shown_path(&file.path)
        );
    }
    let values: Vec<f64> = order.into_iter().map(|row| y[row]).collect();
    Surface::through(axes, &values).map_err(|error| anyhow::anyhow!("{}: no surface: {error}", shown_path(&file.path)))
}

/// A model of one static block.
fn memoryless(file: &RecordFile, structure: &str, inputs: &[String], output: &String, block: Block) -> ModelFile {
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: structure.to_owned(),
        method: String::new(),
        inputs: inputs.to_vec(),
        output: output.clone(),
        units: Labels::new(file).units(inputs.iter().chain([output])),
        sample_time: None,
        delay: 0,
        order: 0,
        block,
        paths: Vec::new(),
        is_sum: false,
        settling: None,
        noise_model: None,
        estimated: None,
        reading: BTreeMap::new(),
        missing: false,
        robust: false,
        records: Vec::new(),
        identification: serde_json::Value::Null,
    }
}

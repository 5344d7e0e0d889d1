//! The names of the formats of an export.

use flexure_export::{Fmi, Format};

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

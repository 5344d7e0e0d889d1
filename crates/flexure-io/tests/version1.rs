//! Model files of version 1 of every structure, as Flexure 0.1 wrote them, and its predictions with them. Their tables are thinned out,
//! which does not change the format.

use std::path::{Path, PathBuf};

use flexure::Block;
use flexure_io::{ModelFile, parse_model, read_model, read_record, write_model};

/// The roles of the blocks of one path.
type Roles = &'static [&'static str];

/// Every file, its inputs, and the roles of the blocks path by path.
const FILES: [(&str, Roles, &[Roles]); 11] = [
    ("linear", &["u"], &[&["linear"]]),
    ("hammerstein-refined", &["u"], &[&["nonlinearity", "linear"]]),
    ("hammerstein-plain", &["u"], &[&["nonlinearity", "linear"]]),
    ("wiener", &["u"], &[&["linear", "nonlinearity"]]),
    ("wiener-hammerstein", &["u"], &[&["front", "nonlinearity", "back"]]),
    (
        "hammerstein-wiener",
        &["u"],
        &[&["nonlinearity", "linear", "output_nonlinearity"]],
    ),
    (
        "parallel",
        &["u"],
        &[&["nonlinearity", "linear"], &["nonlinearity", "linear"]],
    ),
    (
        "multiple-inputs",
        &["u", "q"],
        &[&["nonlinearity", "linear"], &["nonlinearity", "linear"]],
    ),
    ("joint-inputs", &["u", "q"], &[&["nonlinearity", "linear"]]),
    ("narx", &["u"], &[&["narx"]]),
    ("volterra", &["u"], &[&["volterra"]]),
];

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/version1").join(name)
}

fn read(name: &str) -> ModelFile {
    read_model(path(&format!("{name}.json"))).unwrap()
}

#[test]
fn files_of_version_1_predict_what_they_did() {
    let record = read_record(path("record.csv")).unwrap().record;
    for (name, inputs, _) in FILES {
        let model = read(name);
        assert_eq!(model.inputs, inputs, "{name}");
        let columns: Vec<&[f64]> = inputs.iter().map(|i| record.column(i).unwrap()).collect();
        let now = model.block.simulate_inputs(&columns).unwrap();
        let text = std::fs::read_to_string(path(&format!("{name}.predicted.json"))).unwrap();
        let then: serde_json::Value = serde_json::from_str(&text).unwrap();
        let then: Vec<f64> = serde_json::from_value(then["predicted"].clone()).unwrap();
        assert_eq!(now.len(), then.len(), "{name}");
        for (now, then) in now.iter().zip(&then) {
            assert!((now - then).abs() < 1e-12 * then.abs().max(1.0), "{name}: {now} {then}");
        }
    }
}

#[test]
fn their_blocks_get_names_and_their_offsets_become_blocks() {
    for (name, inputs, expected) in FILES {
        let model = read(name);
        let roles: Vec<Vec<&str>> = (model.paths.iter())
            .map(|path| path.blocks.iter().map(|b| b.role.as_str()).collect())
            .collect();
        assert_eq!(roles, expected, "{name}");
        let entering: Vec<&[String]> = model.paths.iter().map(|path| path.inputs.as_slice()).collect();
        match name {
            "multiple-inputs" => assert_eq!(entering, [["u"], ["q"]]),
            _ => assert!(entering.iter().all(|path| *path == inputs), "{name}"),
        }
        assert_eq!(model.is_sum, ["parallel", "multiple-inputs"].contains(&name), "{name}");
    }
    for name in ["linear", "joint-inputs", "multiple-inputs"] {
        let Block::Series(blocks) = read(name).block else {
            panic!("{name} is in series");
        };
        assert!(matches!(blocks.last(), Some(Block::Offset(_))), "{name}");
    }
    let label = |name: &str, block: usize| read(name).paths.remove(0).blocks.remove(block);
    assert!(label("hammerstein-refined", 1).b_errors.is_some_and(|e| e.len() > 1));
    assert!(label("wiener", 1).breakpoints.len() > 1);
    assert!(label("hammerstein-wiener", 2).breakpoints.len() > 1);
    assert!(read("multiple-inputs").paths[1].blocks[0].breakpoints.len() > 1);
}

#[test]
fn they_are_written_as_version_2() {
    let folder = std::env::temp_dir().join(format!("flexure-version1-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (name, ..) in FILES {
        let model = read(name);
        let path = folder.join(format!("{name}.json"));
        write_model(&path, &model).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let object: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
        assert_eq!(object["version"], 2);
        assert_eq!(parse_model(&bytes, &path).unwrap(), model, "{name}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

//! Python, ONNX, FMU and MATLAB, run by their runtimes, against the model's own free run. What is not installed is skipped.
//!
//! `FLEXURE_PYTHON` names the interpreter (python3) whose packages are used: onnx needs numpy and onnxruntime, fmu needs fmpy.

mod common;
mod runtime;

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::{FORMS, difference, file, inputs, models, predicted};
use flexure::Block;
use flexure_export::{Fmi, Format, Options, export};
use flexure_io::ModelFile;
use runtime::{MISSING, python, skipped};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/agreement.py");

fn write(model: &ModelFile, format: Format, path: &Path, fmi: Fmi) {
    let options = Options {
        format,
        name: None,
        fmi,
        compile: format == Format::Fmu,
    };
    for artefact in export(model, path, options).unwrap() {
        std::fs::write(artefact.path, artefact.bytes).unwrap();
    }
}

fn numbers(path: &Path, values: impl Iterator<Item = f64>) {
    let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    std::fs::write(path, bytes).unwrap();
}

/// A folder for every model, with its input and what is expected.
fn folders(place: &Path, samples: usize, write: impl Fn(&ModelFile, &Path)) -> Vec<(&'static str, PathBuf)> {
    let each = models().into_iter().enumerate();
    each.map(|(k, (structure, model))| {
        let folder = place.join(k.to_string());
        std::fs::create_dir(&folder).unwrap();
        let mut u = inputs(&model, samples, 200 + k as u64);
        // Near the end, as it can stay in the output.
        u[0][samples - 10] = [f64::NAN, f64::INFINITY][(k + k / FORMS) % 2];
        numbers(
            &folder.join("u.bin"),
            (0..samples).flat_map(|n| u.iter().map(move |u| u[n])),
        );
        numbers(&folder.join("y.bin"), predicted(&model, &u).into_iter());
        write(&model, &folder);
        (structure, folder)
    })
    .collect()
}

/// Runs all models by one runtime of the script; skips where it is missing.
fn agree(runtime: &str, format: Format, file: &str, fmi: Fmi, most: f64) {
    let place = tempfile::tempdir().unwrap();
    let folders = folders(place.path(), 10_000, |model, folder| {
        write(model, format, &folder.join(file), fmi)
    });
    let done = Command::new(python())
        .arg(SCRIPT)
        .arg(runtime)
        .args(folders.iter().map(|f| &f.1))
        .output();
    let Ok(Output { status, stdout, stderr }) = done else {
        return skipped("there is no Python");
    };
    let text = String::from_utf8_lossy(&stdout);
    if status.code() == Some(MISSING) {
        return skipped(&text);
    }
    let complaints = String::from_utf8_lossy(&stderr);
    assert!(status.success(), "{text}{complaints}");
    assert!(!complaints.contains("not used by any node"), "{complaints}");
    // Only the numbers count, not the words around them.
    let found: Vec<f64> = text.lines().filter_map(|line| line.parse().ok()).collect();
    assert_eq!(found.len(), folders.len(), "{text}");
    for ((structure, folder), apart) in folders.iter().zip(found) {
        println!("{runtime} {structure}: {apart:.1e}");
        assert!(apart <= most, "{runtime} {structure} {}: {apart}", folder.display());
    }
}

#[test]
fn python_computes_what_the_model_does() {
    agree("python", Format::Python, "model.py", Fmi::Two, 1e-12);
}

#[test]
fn onnx_computes_what_the_model_does() {
    agree("onnx", Format::Onnx, "model.onnx", Fmi::Two, 1e-9);
}

#[test]
fn fmi_2_computes_what_the_model_does() {
    if Command::new("cc").arg("--version").output().is_err() {
        return skipped("there is no C compiler");
    }
    agree("fmu2", Format::Fmu, "model2.fmu", Fmi::Two, 1e-12);
}

#[test]
fn fmi_3_computes_what_the_model_does() {
    if Command::new("cc").arg("--version").output().is_err() {
        return skipped("there is no C compiler");
    }
    agree("fmu3", Format::Fmu, "model3.fmu", Fmi::Three, 1e-12);
}

#[test]
fn matlab_computes_what_the_model_does_in_octave() {
    let place = tempfile::tempdir().unwrap();
    let samples = 1000;
    let folders = folders(place.path(), samples, |model, folder| {
        write(model, Format::Matlab, &folder.join("model.m"), Fmi::Two);
    });
    let read = |name: &str| format!("fopen('{name}'); x = fread(f, Inf, 'double'); fclose(f);");
    for (structure, folder) in folders {
        let code = format!(
            "f = {} u = reshape(x, [], {samples}).'; y = model(u); f = fopen('found.bin', 'w'); fwrite(f, y, 'double'); fclose(f);",
            read("u.bin")
        );
        let Ok(done) = Command::new("octave")
            .args(["--no-gui", "--eval", &code])
            .current_dir(&folder)
            .output()
        else {
            return eprintln!("skipped: there is no octave");
        };
        assert!(
            done.status.success(),
            "{structure}: {}",
            String::from_utf8_lossy(&done.stderr)
        );
        let values = |name: &str| -> Vec<f64> {
            let bytes = std::fs::read(folder.join(name)).unwrap();
            bytes
                .chunks_exact(8)
                .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
                .collect()
        };
        let apart = difference(&values("found.bin"), &values("y.bin"));
        println!("matlab {structure}: {apart:.1e}");
        assert!(apart <= 1e-12, "{structure}: {apart}");
    }
}

/// A model whose names would end comments, strings and attributes.
fn hostile() -> ModelFile {
    let mut model = file("'''\n\"\"\"\nraise SystemExit(3)\n%}{{ 7*7 }}", Block::Offset(1.0));
    model.inputs = vec!["\"/><evil a=\"]]>\u{1}\u{ffff}&\n%{\nexit(3)".to_owned()];
    model.output = "time".to_owned();
    model.units = [("time".to_owned(), "\"/><evil\u{1}".to_owned())].into();
    model
}

#[test]
fn names_of_a_hostile_model_do_no_harm() {
    let place = tempfile::tempdir().unwrap();
    let model = hostile();
    for (fmi, variable) in [(Fmi::Two, "ScalarVariable"), (Fmi::Three, "Float64")] {
        let path = place.path().join("model.fmu");
        let options = Options {
            format: Format::Fmu,
            name: None,
            fmi,
            compile: false,
        };
        let artefacts = export(&model, &path, options).unwrap();
        let mut archive = zip::ZipArchive::new(std::io::Cursor::new(&artefacts[0].bytes)).unwrap();
        let mut text = String::new();
        archive
            .by_name("modelDescription.xml")
            .unwrap()
            .read_to_string(&mut text)
            .unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let variables = document.descendants().filter(|n| n.has_tag_name(variable));
        let names: Vec<&str> = variables.filter_map(|n| n.attribute("name")).collect();
        assert_eq!(names[..2], ["\"/><evil a=\"]]>__&_%{_exit(3)", "time_2"]);
        assert!(!document.descendants().any(|n| n.has_tag_name("evil")));
    }
    write(&model, Format::Python, &place.path().join("model.py"), Fmi::Two);
    let code = "from model import model; assert model().step(2.0) == 3.0";
    match Command::new("python3")
        .args(["-c", code])
        .current_dir(place.path())
        .output()
    {
        Ok(done) => assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr)),
        Err(_) => eprintln!("skipped: there is no python3"),
    }
    write(&model, Format::Matlab, &place.path().join("model.m"), Fmi::Two);
    let text = std::fs::read_to_string(place.path().join("model.m")).unwrap();
    let named: Vec<&str> = text
        .lines()
        .filter(|line| line.contains("evil") || line.contains("SystemExit"))
        .collect();
    assert!(
        named.len() == 3 && named.iter().all(|line| line.starts_with("% ")),
        "{named:?}"
    );
}

#[test]
fn the_same_model_gives_the_same_files() {
    let (_, model) = &models()[6];
    for format in [Format::C, Format::Fmu, Format::Onnx, Format::Python, Format::Matlab] {
        let options = Options {
            format,
            name: None,
            fmi: Fmi::Three,
            compile: false,
        };
        let path = Path::new("model").with_extension(format.extension());
        assert_eq!(
            export(model, &path, options).unwrap(),
            export(model, &path, options).unwrap()
        );
    }
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let model = file("linear", Block::Offset(1.0));
    let refused = |model: &ModelFile, path: &str, name: Option<&str>| {
        let options = Options {
            format: Format::C,
            name,
            fmi: Fmi::default(),
            compile: false,
        };
        export(model, Path::new(path), options).unwrap_err().to_string()
    };
    assert!(refused(&model, "model.txt", None).contains("must end in .c"));
    assert!(refused(&model, "a\"b.c", None).contains("may have only letters"));
    assert!(refused(&model, "model.c", Some("a;b")).contains("give another name"));
    assert!(refused(&file("linear", Block::Offset(f64::NAN)), "model.c", None).contains("must be finite"));
    assert!(refused(&file("linear", Block::Series(vec![])), "model.c", None).contains("is empty"));
}

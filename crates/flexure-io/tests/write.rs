//! Writing: bit-exact round trips, whole files or none, and model files.

mod common;

use std::io::Write;

use common::{directory, message};
use flexure::Record;
use flexure::identify::{NarxModel, NarxTerm, VolterraModel};
use flexure::linear::TransferFunction;
use flexure::nonlinearity::{Curve, Outside, Surface, SurfaceAxis};
use flexure::validation::Estimated;
use flexure::{Block, record};
use flexure_io::{
    BlockLabel, ModelFile, ModelPath, RecordMark, read_model, read_record, write_atomically, write_model, write_record,
};

/// Doubles of every magnitude, and those that are hard to print.
fn awkward() -> Vec<f64> {
    let mut values = vec![
        0.0,
        -0.0,
        0.1,
        1.0 / 3.0,
        f64::MAX,
        f64::MIN_POSITIVE,
        5e-324,
        -1e300,
        f64::NAN,
        f64::INFINITY,
    ];
    let mut state = 7_u64;
    values.extend((0..2000).map(|_| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        f64::from_bits(state ^ (state >> 29))
    }));
    values
}

fn bits(samples: &[f64]) -> Vec<u64> {
    samples
        .iter()
        .map(|v| if v.is_nan() { f64::NAN.to_bits() } else { v.to_bits() })
        .collect()
}

#[test]
fn records_come_back_bit_for_bit() {
    let dir = directory("round_trip");
    let values = awkward();
    let reversed: Vec<f64> = values.iter().rev().copied().collect();
    let names = ["u", "a, \"b\"; c"];
    let record = Record::new(names.into_iter().zip([values, reversed])).unwrap();
    for name in ["a.csv", "a.parquet"] {
        write_record(dir.join(name), &record).unwrap();
        let back = read_record(dir.join(name)).unwrap().record;
        assert_eq!(back.names(), record.names());
        for name in names {
            assert_eq!(bits(back.column(name).unwrap()), bits(record.column(name).unwrap()));
        }
    }
}

#[test]
fn what_cannot_be_written_is_said_and_leaves_nothing() {
    let dir = directory("unwritable");
    let record = Record::new([("u", vec![1.0])]).unwrap();
    std::fs::create_dir(dir.join("d.csv")).unwrap();
    let text = |name: &str, record: &record::Record| message(&write_record(dir.join(name), record).unwrap_err(), &dir);
    assert_eq!(
        text("a.txt", &record),
        "cannot write a.txt: a record's file name must end in .csv or .parquet"
    );
    assert_eq!(
        text("d.csv", &record),
        "cannot write d.csv: it is a directory, not a file"
    );
    assert_eq!(
        text("no/a.csv", &record),
        "cannot write no/a.csv: there is no such file or directory"
    );
    assert_eq!(
        text("a.csv", &Record::default()),
        "cannot write a.csv: the record has no samples"
    );
    let broken = Record::new([("u\nv", vec![1.0])]).unwrap();
    assert_eq!(
        text("a.csv", &broken),
        "cannot write a.csv: the column name \"u\\nv\" is empty or contains a line break; rename it"
    );
    assert_eq!(std::fs::read_dir(&dir).unwrap().count(), 1);
}

#[test]
fn a_failure_leaves_the_old_file_and_no_other() {
    let dir = directory("atomic");
    let path = dir.join("report.html");
    write_atomically(&path, |out| out.write_all(b"old")).unwrap();
    let error = write_atomically(&path, |out| {
        out.write_all(b"half of the new")?;
        Err(std::io::Error::other("the disk is full"))
    });
    assert_eq!(
        message(&error.unwrap_err(), &dir),
        "cannot write report.html: the disk is full"
    );
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(&dir).unwrap().count(), 1);
    write_atomically(&path, |out| out.write_all(b"new")).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"new");
}

fn model() -> ModelFile {
    let curve = Curve::new(vec![-1.0, 0.1, 1.0 / 3.0], vec![5e-324, -1e300, 0.3], Outside::Linear).unwrap();
    let system = TransferFunction::new(vec![0.0, 0.1], vec![1.0, -0.7]).unwrap();
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: "hammerstein".to_owned(),
        method: "plain".to_owned(),
        inputs: vec!["u".to_owned()],
        output: "y".to_owned(),
        units: [("u".to_owned(), "N m".to_owned())].into(),
        sample_time: Some(1.0 / 51200.0),
        delay: 1,
        order: 1,
        block: Block::Series(vec![Block::Static(curve), Block::Linear(system), Block::Offset(0.7)]),
        paths: vec![ModelPath {
            inputs: vec!["u".to_owned()],
            blocks: vec![
                BlockLabel {
                    role: "nonlinearity".to_owned(),
                    kinks: vec![0.2],
                    ..BlockLabel::default()
                },
                BlockLabel {
                    role: "linear".to_owned(),
                    title: "Linear part".to_owned(),
                    b_errors: Some(vec![0.0, 0.01]),
                    ..BlockLabel::default()
                },
            ],
        }],
        is_sum: false,
        settling: Some(40),
        noise_model: Some(vec![1.0, -0.3]),
        estimated: Some(Estimated {
            parameters: 5,
            samples: 900,
        }),
        reading: [("skip-lines".to_owned(), "3".to_owned())].into(),
        missing: true,
        robust: true,
        records: vec![RecordMark {
            name: "r.csv".to_owned(),
            samples: 1200,
            crc32: u32::MAX,
        }],
        identification: serde_json::json!({"bandwidth": 0.1}),
    }
}

#[test]
fn models_come_back_exactly() {
    let path = directory("model").join("model.json");
    for sample_time in [Some(1.0 / 51200.0), None] {
        let model = ModelFile { sample_time, ..model() };
        write_model(&path, &model).unwrap();
        assert_eq!(read_model(&path).unwrap(), model);
    }
}

#[test]
fn bad_models_are_refused_with_the_place() {
    let dir = directory("bad_model");
    let path = dir.join("m.json");
    write_model(&path, &model()).unwrap();
    let good = std::fs::read_to_string(&path).unwrap();
    let text = |content: String| {
        std::fs::write(&path, content).unwrap();
        message(&read_model(&path).unwrap_err(), &dir)
    };
    let current = ModelFile::CURRENT;
    assert_eq!(
        text(good.replace("\"version\": 2,", "\"version\": 3,")),
        format!(
            "m.json: the model's format version is 3, but Flexure {current} reads versions 1 to 2; identify the model again or update Flexure"
        )
    );
    assert_eq!(
        text("{}".to_owned()),
        "m.json: not a model file: its \"format\" is null, not \"flexure-model\"; models are written by `flexure identify -o`"
    );
    assert_eq!(
        text("u,y\n".to_owned()),
        "m.json: not a model file; a command takes the model first, then the record"
    );
    assert!(text(good.replace("\"delay\": 1,", "")).contains("missing field `delay`; models"));
    assert_eq!(
        text(good.replace("\"delay\": 1,", "\"delay\": NaN,")),
        "m.json, line 15, column 12: the text is not JSON (expected value); models are written by `flexure identify -o`"
    );
    assert!(text(good.replace("-0.7", "1e999")).contains("(number out of range); models"));
    assert!(text(good.replace("-0.7", "null")).contains(": invalid type: null, expected f64; models"));
    assert!(text(good.replace("\"sample_time\": 0.00001953125", "\"sample_time\": -1")).starts_with("m.json"));
    let negative = ModelFile {
        sample_time: Some(-1.0),
        ..model()
    };
    assert_eq!(
        message(&write_model(&path, &negative).unwrap_err(), &dir),
        "m.json: sample_time is -1, but must be positive and finite, or null"
    );
    assert_eq!(
        text(
            good.replace("-0.3", "-0.3, 0.1")
                .replacen("1.0,\n    -0.3", "2.0,\n    -0.3", 1)
        ),
        "m.json: noise_model is [2.0, -0.3, 0.1], but must start with 1, or be null"
    );
    for length in 0..good.trim_end().len() {
        std::fs::write(&path, &good[..length]).unwrap();
        assert!(message(&read_model(&path).unwrap_err(), &dir).starts_with("m.json, line "));
    }
}

#[test]
fn models_without_a_chain_of_blocks_come_back_exactly_or_are_refused() {
    let path = directory("other_models").join("model.json");
    let axis = SurfaceAxis {
        low: -1.0,
        high: 0.1 + 0.2,
        pieces: 1,
    };
    let surface = Surface::new(vec![axis; 2], (0..16).map(|k| f64::from(k) / 7.0).collect()).unwrap();
    let narx = NarxModel {
        outputs: 1,
        inputs: 1,
        delay: 2,
        constant: 0.1,
        terms: vec![NarxTerm {
            factors: vec![0, 1],
            coefficient: 1.0 / 3.0,
        }],
        scales: [(0.0, 1.0), (2.0, 0.5)],
        held: (-3.0, 3.0),
    };
    let volterra = VolterraModel {
        delay: 1,
        input_level: 0.2,
        constant: 1.0,
        first: vec![1.0, 0.5, 0.1],
        second: vec![0.1, 0.2, 0.2, 0.3],
        second_memory: 2,
    };
    for block in [
        Block::Inputs(vec![Block::Surface(surface), Block::Narx(narx.clone())]),
        Block::Volterra(volterra.clone()),
    ] {
        let inputs = (0..block.inputs()).map(|i| format!("u{i}")).collect();
        let model = ModelFile {
            block,
            inputs,
            ..model()
        };
        write_model(&path, &model).unwrap();
        assert_eq!(read_model(&path).unwrap(), model);
    }
    let problem = |block: Block| {
        write_model(&path, &ModelFile { block, ..model() })
            .unwrap_err()
            .to_string()
    };
    let with = |change: &dyn Fn(&mut NarxModel)| {
        let mut wrong = narx.clone();
        change(&mut wrong);
        problem(Block::Narx(wrong))
    };
    for (error, printed) in [
        (
            with(&|n| n.terms[0].factors.push(2)),
            "factor 2, but there are only 2 variables",
        ),
        (with(&|n| n.delay = usize::MAX), "a lag is"),
        (with(&|n| n.held = (1.0, 0.0)), "held between 1 and 0"),
        (with(&|n| n.scales[1].1 = 0.0), "the output's spread is 0"),
        (
            problem(Block::Volterra(VolterraModel {
                second_memory: 3,
                ..volterra.clone()
            })),
            "4 values, but 3 lags squared are needed",
        ),
        (problem(Block::Inputs(Vec::new())), "it contains no block"),
    ] {
        assert!(error.contains(printed), "{printed}: {error}");
    }
}

//! A loop that is stable on one record and runs away on another.

mod common;

use common::Folder;

/// `y[k+1] = 0.9 y[k] + 0.1 u[k] + f(y[k])`, where f is zero from -1 to 1 and rises with the slope 0.5 beyond: there the loop is not stable.
const LOOP: &str = r#"{"format": "flexure-model", "version": 2, "flexure": "0.1.0", "structure": "feedback",
    "method": "prediction-error", "inputs": ["u"], "output": "y", "sample_time": 0.01, "delay": 0, "order": 1,
    "block": {"feedback": {"state": [[0.9]], "input_to_state": [0.1], "nonlinearity_to_state": [1.0], "state_to_output": [1.0],
        "state_to_nonlinearity": [1.0], "input_to_output": 0.0, "nonlinearity_to_output": 0.0, "input_to_nonlinearity": 0.0,
        "levels": {"input": 0.0, "nonlinearity": 0.0, "output": 0.0, "entering": 0.0},
        "nonlinearity": {"x": [-3.0, -1.0, 1.0, 3.0], "y": [-1.0, 0.0, 0.0, 1.0], "outside": "linear"}}},
    "paths": [{"inputs": ["u"], "blocks": [{"role": "nonlinearity", "title": "Nonlinearity in the loop"}]}]}"#;

/// Samples of a system without the unstable part, with noise; the input jumps up to `level` at sample 600.
fn log(level: f64) -> String {
    let mut y = 0.0;
    let rows = (0..1000_u64).map(|k| {
        let bits = (k * 7919 + k * k * 104_729) % 1000;
        let u = 0.002 * bits as f64 - 1.0 + if k >= 600 { level } else { 0.0 };
        let noise = 0.01 * ((k * 31 + k * k * 17) % 19) as f64 / 19.0;
        let row = format!("{},{u},{}\n", 0.01 * k as f64, y + noise);
        y = 0.9 * y + 0.1 * u;
        row
    });
    format!("t,u,y\n{}", rows.collect::<String>())
}

#[test]
fn a_model_that_runs_away_on_a_record_does_not_hold_there() {
    let folder = Folder::new();
    folder.write("model.json", LOOP);
    folder.write("tame.csv", log(0.0));
    folder.write("wild.csv", log(3.0));
    let tame = folder.json("validate model.json tame.csv");
    assert!(
        tame["runs_away_from"].is_null() && tame["fit_percent"].as_f64() > Some(50.0),
        "{tame}"
    );
    let wild = folder.json("validate model.json wild.csv");
    let from = wild["runs_away_from"].as_u64().unwrap();
    assert!(wild["holds"] == false && (600..660).contains(&from), "{wild}");
    let said = folder.said("validate model.json wild.csv --report page.html");
    let head =
        format!("On this record, the model does not hold: its simulated output runs away from sample {from} (t = ");
    assert!(said.starts_with(&head), "{said}");
    assert!(
        said.contains("Its loop is not stable under this input: identify it from a record with such inputs"),
        "{said}"
    );
    assert!(
        said.contains("next: flexure identify wild.csv --input u --output y --structure auto"),
        "{said}"
    );
    assert!(folder.read("page.html").contains("its simulated output runs away"));
    let compared = folder.said("compare model.json wild.csv");
    assert!(
        compared.contains("below 0 %") && compared.contains("does not hold"),
        "{compared}"
    );
    // It runs away before the other samples tell anything: still a verdict, on the samples that were asked for.
    let late = log(3.0)
        .lines()
        .enumerate()
        .fold(String::new(), |text, (i, row)| match i {
            1..500 => format!("{text}{:.2},4,0\n", 0.01 * (i - 1) as f64),
            _ => format!("{text}{row}\n"),
        });
    folder.write("late.csv", late);
    let late = folder.json("validate model.json late.csv --skip 100");
    assert!(
        late["holds"] == false && late["skipped"] == 100 && late["misfit"].is_null(),
        "{late}"
    );
    assert!(
        late["runs_away_from"].as_u64() < Some(100) && late["samples"] == 900,
        "{late}"
    );
    // A prediction has no verdict.
    let refused = folder.run("predict model.json wild.csv -o out.csv");
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(
        refused.stderr.contains("its loop is not stable under this input"),
        "{refused:?}"
    );
    assert!(!refused.stderr.contains("unit"), "{refused:?}");
}

//! What the tests of the command line share: a folder, a run of `flexure` in it, records.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

use flexure::Record;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
use flexure_io::{read_record, write_record};
use serde_json::Value;
use tempfile::TempDir;

/// A fresh folder, in which `flexure` runs, so that messages name files without their folder.
pub struct Folder(TempDir);

/// What a run of `flexure` left.
#[derive(Debug)]
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Folder {
    pub fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// A column of a record in the folder.
    pub fn column(&self, file: &str, name: &str) -> Vec<f64> {
        let record = read_record(self.path(file)).unwrap().record;
        record.column(name).unwrap().to_vec()
    }

    /// Writes a record of a known Hammerstein system with the columns u, y and y0.
    pub fn known(&self, name: &str, samples: usize, seed: u64) -> Record {
        let record = known(samples, seed);
        write_record(self.path(name), &record).unwrap();
        record
    }

    /// Every file below the folder with its content; folders end in `/`.
    pub fn content(&self) -> BTreeMap<String, Vec<u8>> {
        let mut found = BTreeMap::new();
        let mut folders = vec![self.0.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let name = path.strip_prefix(self.0.path()).unwrap().display().to_string();
                if path.is_dir() {
                    found.insert(format!("{name}/"), Vec::new());
                    folders.push(path);
                } else {
                    found.insert(name, std::fs::read(path).unwrap());
                }
            }
        }
        found
    }

    /// Runs `flexure` with the words of `arguments`, separated by blanks.
    pub fn run(&self, arguments: &str) -> Outcome {
        self.run_with(arguments, &[])
    }

    /// Runs `flexure` with further environment variables.
    pub fn run_with(&self, arguments: &str, environment: &[(&str, &str)]) -> Outcome {
        outcome(self.command(arguments).envs(environment.iter().copied()))
    }

    /// Runs `flexure` in a shell behind `first`, such as a limit of the system.
    #[cfg(unix)]
    pub fn run_under(&self, first: &str, arguments: &str) -> Outcome {
        let program = self.command(arguments);
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("{first} && exec \"$0\" \"$@\"")]);
        shell.arg(program.get_program()).args(program.get_args());
        outcome(shell.current_dir(self.0.path()))
    }

    /// `flexure` with the words of `arguments`, to be run in the folder.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexure"));
        command.args(arguments.split_whitespace()).current_dir(self.0.path());
        command
    }

    /// Runs a command that must succeed without a word on the error stream; returns what it printed.
    pub fn done(&self, arguments: &str) -> String {
        let outcome = self.run(arguments);
        assert_eq!(outcome.code, Some(0), "{arguments}: {outcome:?}");
        assert_eq!(outcome.stderr, "", "{arguments}");
        outcome.stdout
    }

    /// As [`done`](Self::done), with a single blank in place of every line break and indent: where a line is wrapped does not matter.
    pub fn said(&self, arguments: &str) -> String {
        let printed = self.done(arguments);
        printed.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Runs a command that must print one JSON object on one line, and nothing else.
    pub fn json(&self, arguments: &str) -> Value {
        let text = self.done(&format!("{arguments} --json"));
        assert!(text.ends_with('\n') && text.lines().count() == 1, "{text}");
        let value: Value = serde_json::from_str(&text).unwrap();
        assert!(value.is_object(), "{text}");
        value
    }

    /// Runs a command that must fail with only this message and leave every file unchanged.
    pub fn refused(&self, arguments: &str, code: i32, message: &str) {
        let before = self.content();
        let outcome = self.run(arguments);
        assert_eq!(outcome.stderr.trim_end(), format!("error: {message}"), "{arguments}");
        assert_eq!(outcome.code, Some(code), "{arguments}");
        assert_eq!(outcome.stdout, "", "{arguments}");
        let after = self.content();
        assert!(
            before == after,
            "{arguments}: {:?} became {:?}",
            before.keys(),
            after.keys()
        );
    }

    /// A command that must fail because of the data.
    pub fn failed(&self, arguments: &str, message: &str) {
        self.refused(arguments, 1, message);
    }

    /// A command that must fail because of its options, with the hint where help is.
    pub fn misused(&self, arguments: &str, message: &str) {
        self.refused(
            arguments,
            2,
            &format!("{message}\n\nFor more information, try '--help'."),
        );
    }
}

/// Runs a command to its end. The error stream is without the lines that the work goes on, which only a slow machine prints.
pub fn outcome(command: &mut Command) -> Outcome {
    let output = command.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    let goes_on = |line: &str| line.starts_with("still ") && line.ends_with(" s)\n");
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: said.split_inclusive('\n').filter(|line| !goes_on(line)).collect(),
    }
}

/// A well damped Hammerstein system with a dead zone, at 20 dB.
pub fn known(samples: usize, seed: u64) -> Record {
    let [damped, _] = known_linear_parts();
    KnownHammerstein::usual(KnownNonlinearity::DeadZone, damped).simulate(samples, seed)
}

/// Linear interpolation, held at its end values: NumPy's `interp`.
pub fn interpolate(x: &[f64], y: &[f64], at: f64) -> f64 {
    let last = x.len() - 1;
    if at <= x[0] {
        return y[0];
    }
    if at >= x[last] {
        return y[last];
    }
    let i = (0..last).rfind(|&i| x[i] <= at).unwrap();
    y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i])
}

/// The difference equation a(z) y = b(z) w, with w at `before` for ever before its first sample and the
/// output settled: SciPy's `lfilter` with `zi = lfilter_zi(b, a) * before`.
pub fn filter(b: &[f64], a: &[f64], w: &[f64], before: f64) -> Vec<f64> {
    let settled = before * b.iter().sum::<f64>() / a.iter().sum::<f64>();
    let mut y: Vec<f64> = Vec::new();
    for n in 0..w.len() {
        let input = |i: usize| if n >= i { w[n - i] } else { before };
        let output = |i: usize| if n >= i { y[n - i] } else { settled };
        let forward: f64 = b.iter().enumerate().map(|(i, b)| b * input(i)).sum();
        let back: f64 = a.iter().enumerate().skip(1).map(|(i, a)| a * output(i)).sum();
        y.push((forward - back) / a[0]);
    }
    y
}

/// The numbers of a JSON array.
pub fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap_or_else(|| panic!("{value} is no array"));
    list.iter().map(|v| v.as_f64().unwrap()).collect()
}

/// A MAT v5 file of column vectors of doubles.
pub fn mat(vectors: &[(&str, &[f64])]) -> Vec<u8> {
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend(0x0100_u16.to_le_bytes());
    file.extend(b"IM");
    for (name, samples) in vectors {
        let (double_class, char8, int32, uint32, double, matrix) = (6_u32, 1, 5, 6, 9, 14);
        let mut content = Vec::new();
        element(&mut content, uint32, &[double_class.to_le_bytes(), [0; 4]].concat());
        let rows = u32::try_from(samples.len()).unwrap();
        element(&mut content, int32, &[rows.to_le_bytes(), 1_u32.to_le_bytes()].concat());
        element(&mut content, char8, name.as_bytes());
        let data: Vec<u8> = samples.iter().flat_map(|v| v.to_le_bytes()).collect();
        element(&mut content, double, &data);
        element(&mut file, matrix, &content);
    }
    file
}

/// Appends a data element: type, length, content, padding to eight bytes.
fn element(to: &mut Vec<u8>, kind: u32, content: &[u8]) {
    to.extend(kind.to_le_bytes());
    to.extend(u32::try_from(content.len()).unwrap().to_le_bytes());
    to.extend(content);
    to.resize(to.len().next_multiple_of(8), 0);
}

/// An axis with friction that a controller moves back and forth: instants, force in units of the motor, position.
pub fn axis(samples: usize) -> [Vec<f64>; 3] {
    let (dt, constant) = (0.002, 35.0);
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    let (mut t, mut force, mut position) = (Vec::new(), Vec::new(), Vec::new());
    for n in 0..samples {
        let time = dt * n as f64;
        let target = 0.1 * (1.3 * time).sin() + 0.08 * (3.1 * time).sin() + 0.02 * (9.7 * time).sin();
        let u = (2000.0 * (10.0 * (target - q) - v)).clamp(-300.0, 300.0);
        v += dt * (u - 200.0 * v - 20.0 * (v / 1e-3).tanh()) / 95.0;
        q += dt * v;
        t.push(time);
        force.push(u / constant);
        position.push((q * 1e6).round() / 1e6);
    }
    [t, force, position]
}

/// The line with the command to type next, without the text before it.
pub fn next(text: &str) -> &str {
    let line = text.lines().last().unwrap();
    line.strip_prefix("next: ").unwrap_or_else(|| panic!("{text}"))
}

/// Runs a printed command line by a shell, in the folder.
pub fn typed(folder: &Folder, line: &str) -> Outcome {
    let rest = line.strip_prefix("flexure ").unwrap();
    let mut shell = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_flexure");
    shell
        .args(["-c", &format!("'{program}' {rest}")])
        .current_dir(folder.path(""));
    outcome(&mut shell)
}

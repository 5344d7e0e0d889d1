//! The program with options and with records that are made to do harm.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use anyhow::{Context as _, Result, ensure};
use flexure_io::read_model;
use rand::RngExt;
use rand_pcg::Pcg64;
use tempfile::TempDir;

use crate::Target;
use crate::mutation::{changed, one};

/// Columns: a name, and the sample k of n.
type Column = (&'static str, fn(f64, &mut Pcg64) -> f64);

const COLUMNS: [Column; 14] = [
    ("zero", |_, _| 0.0),
    ("constant", |_, _| 3.25),
    ("white", |_, r| r.random_range(-1.0..1.0)),
    ("sine", |k, _| (0.1 * k).sin()),
    ("ramp", |k, _| k),
    ("huge", |k, r| 1e300 * (0.3 * k).sin() * r.random_range(0.5..1.0)),
    ("tiny", |k, r| 1e-300 * (0.3 * k).sin() * r.random_range(0.5..1.0)),
    ("denormal", |k, _| 5e-324 * (k % 7.0)),
    (
        "outlier",
        |k, r| if k == 50.0 { 2.1e91 } else { r.random_range(-1.0..1.0) },
    ),
    ("levels", |k, _| ((0.2 * k).sin() * 2.0).round()),
    ("offset", |k, r| 1e15 + (0.1 * k).sin() + r.random_range(-0.1..0.1)),
    ("missing", |k, r| {
        if k % 40.0 == 7.0 {
            f64::NAN
        } else {
            r.random_range(-1.0..1.0)
        }
    }),
    ("pulse", |k, _| f64::from(k == 30.0)),
    ("late", |k, r| if k < 150.0 { 0.0 } else { r.random_range(-1.0..1.0) }),
];

/// Commands on a record `r.csv` with three of these columns, a, b and c.
const COMMANDS: [&str; 14] = [
    "look r.csv --json",
    "identify r.csv --input a --output b -o model.json --json",
    "identify r.csv --input a --output b --structure linear -o model.json --json",
    "identify r.csv --input a --output b --method plain -o model.json --json",
    "identify r.csv --input a --output b --structure static -o model.json --json",
    "identify r.csv --input a --output b --structure narx -o model.json --json",
    "identify r.csv --input a,c --output b --structure joint-inputs -o model.json --json",
    "regress r.csv --x a --y b --json",
    "regress r.csv --x a --y b --estimator spline --json",
    "regress r.csv --x a,c --y b --estimator neighbours --band-method none --json",
    "joint r.csv --position a --torque b --json",
    "joint r.csv --motor a --link c --torque b --arm arm.toml --json",
    "joint r.csv --motor a --link b --torque c --json",
    "prepare r.csv --outliers all --resample 0.02 --fill 10 -o model.csv --json",
];

/// Arguments that are changed.
const ARGUMENTS: [&str; 8] = [
    "look r.csv --separator comma --skip-lines 0 --memory 1GiB",
    "regress r.csv --x a --y b --grid 50 --estimator kernel --bandwidth 0.3 --band 0.9 --seed 3",
    "identify r.csv --input a --output b --order 2 --delay 1 --fresh 0.3 --structure linear",
    "prepare r.csv --cut 0.1:1.5 --resample 0.02 --low-pass 5 --order 2 -o out.csv",
    "study rates --lengths 50,100 --runs 20 --seed 1",
    "simulate --preset motor-log --write-arm arm.toml",
    "excite --preset space-arm --max-torque 10,5 --duration 0.5 --levels 5 --kind multilevel --hold 0.1 -o e.csv",
    "joint r.csv --position a --torque b --gear-ratio 2 --sample-time 0.01 --torque-constant 1 --band 0.9",
];

/// The program, run in a folder of its own.
struct Program {
    path: PathBuf,
    folder: TempDir,
}

impl Program {
    fn new(path: &Path) -> Result<Program> {
        Ok(Program {
            path: path.to_owned(),
            folder: tempfile::tempdir()?,
        })
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes the record with these columns.
    fn record(&self, columns: &[&Column], random: &mut Pcg64) -> Result<()> {
        let mut text = "t,a,b,c\n".to_owned();
        for k in 0..300 {
            let k = f64::from(k);
            text += &format!("{:?}", 0.01 * k);
            columns
                .iter()
                .for_each(|(_, of)| text += &format!(",{:?}", of(k, random)));
            text.push('\n');
        }
        Ok(std::fs::write(self.file("r.csv"), text)?)
    }

    /// Runs it; it must end by itself with 0, 1 or 2.
    fn run(&self, arguments: &[&str]) -> Result<Output> {
        let mut command = Command::new(&self.path);
        let output = command.args(arguments).current_dir(self.folder.path()).output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(
            matches!(output.status.code(), Some(0..=2)) && !said.contains("panicked"),
            "{arguments:?} ended with {}: {said}",
            output.status
        );
        ensure!(said.len() < 100_000, "{arguments:?}: the message is long");
        Ok(output)
    }
}

/// Nasty numbers. An input is a command's number, those of three columns, and a seed.
struct Numbers(Program);

impl Target for Numbers {
    fn name(&self) -> &'static str {
        "numbers"
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        let column = COLUMNS.len() as u8;
        vec![
            random.random_range(0..COMMANDS.len() as u8),
            random.random_range(0..column),
            random.random_range(0..column),
            random.random_range(0..column),
            random.random(),
        ]
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let &[command, a, b, c, seed] = input else {
            return Ok(());
        };
        let mut random = rand::SeedableRng::seed_from_u64(u64::from(seed));
        let columns = [a, b, c].map(|i| &COLUMNS[usize::from(i) % COLUMNS.len()]);
        self.0.record(&columns, &mut random)?;
        let arguments: Vec<&str> = COMMANDS[usize::from(command) % COMMANDS.len()].split(' ').collect();
        let model = self.0.file("model.json");
        std::fs::write(&model, "old")?;
        let output = self
            .0
            .run(&arguments)
            .with_context(|| columns.map(|c| c.0).join(", "))?;
        let is_old = std::fs::read(&model)? == b"old";
        ensure!(
            is_old || read_model(&model).is_ok(),
            "{arguments:?}: the model does not read back"
        );
        if output.status.success() {
            serde_json::from_slice::<serde_json::Value>(&output.stdout).with_context(|| format!("{arguments:?}"))?;
        } else {
            ensure!(is_old, "{arguments:?}: it failed and has written");
        }
        Ok(())
    }
}

/// Options with changed values. An input is the arguments, separated by blanks.
struct Options {
    program: Program,
    seeds: Vec<Vec<u8>>,
}

impl Target for Options {
    fn name(&self) -> &'static str {
        "options"
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        // The command itself stays, so that its options are tried.
        let seed = one(random, &self.seeds);
        let command = seed.iter().position(|b| *b == b' ').unwrap_or(0);
        let rest = changed(random, &[seed[command..].to_vec()]);
        [&seed[..command], b" ", &rest].concat()
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let text = String::from_utf8_lossy(input).replace('\0', "");
        let arguments: Vec<&str> = text.split(' ').filter(|word| !word.is_empty()).collect();
        // What would be written outside of the folder, or be the full study, is left out.
        if arguments
            .iter()
            .any(|word| word.contains('/') || word.contains("--full"))
        {
            return Ok(());
        }
        self.program.run(&arguments).map(drop)
    }
}

/// Both.
pub fn all() -> Result<Vec<Box<dyn Target>>> {
    let beside = std::env::current_exe()?.with_file_name(format!("flexure{}", std::env::consts::EXE_SUFFIX));
    let path = std::env::var_os("FLEXURE_BINARY").map_or(beside, PathBuf::from);
    ensure!(
        path.is_file(),
        "no program at {}; build it, or name it by FLEXURE_BINARY",
        path.display()
    );
    let options = Program::new(&path)?;
    let mut random = rand::SeedableRng::seed_from_u64(1);
    options.record(&[&COLUMNS[2], &COLUMNS[3], &COLUMNS[9]], &mut random)?;
    Ok(vec![
        Box::new(Options {
            program: options,
            seeds: ARGUMENTS.iter().map(|text| text.as_bytes().to_vec()).collect(),
        }),
        Box::new(Numbers(Program::new(&path)?)),
    ])
}

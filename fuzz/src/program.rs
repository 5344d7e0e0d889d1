//! The program with options, records and files that are made to do harm.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::time::Duration;

use anyhow::{Context as _, Result, ensure};
use flexure_io::arm::preset_text;
use flexure_io::{read_model, read_record};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use tempfile::TempDir;

use crate::Target;
use crate::commands::{ARGUMENTS, COLUMNS, COMMANDS, Column, ON_FILES, OUTPUTS, SCENARIOS};
use crate::mutation::{changed, one};
use crate::readers::model_seeds;

/// How long a run may take before it is interrupted: some inputs ask for much work, and the run then reports its progress.
const PATIENCE: Duration = Duration::from_secs(60);
/// The variable that asks for progress in lines, the start of such a line, and the fewest lines of a run that makes progress.
const PROGRESS: &str = "FLEXURE_PROGRESS";
const MARK: &str = "progress: ";
const FEWEST_LINES: usize = 3;
/// How long it may then take to end.
const LAST: Duration = Duration::from_secs(5);

/// The runs of the program, and those that were interrupted.
pub static RUNS: [AtomicUsize; 2] = [AtomicUsize::new(0), AtomicUsize::new(0)];

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

    /// Writes a good file of every kind.
    fn seed(&self) -> Result<()> {
        let mut random = Pcg64::seed_from_u64(1);
        self.record(&[&COLUMNS[2], &COLUMNS[3], &COLUMNS[9]], &mut random)?;
        let mut text = "t,k,u0,u1,u2,y\n".to_owned();
        let mut y = 0.0;
        for k in 0..80 {
            let u: [f64; 3] = [(); 3].map(|()| random.random_range(-1.0..1.0));
            text += &format!(
                "{:.2},{},{:.4},{:.4},{:.4},{y:.4}\n",
                0.01 * f64::from(k),
                k % 2,
                u[0],
                u[1],
                u[2]
            );
            y = 0.7 * y + (2.0 * u[0]).tanh();
        }
        std::fs::create_dir(self.file("fleet"))?;
        let models = model_seeds()?;
        let arm = preset_text("space-arm")?.replace("duration = 10.0", "duration = 0.1");
        let torques: String = (0..6).map(|k| format!("{k}.0e-2,{k},0.5\n")).collect();
        for (name, content) in [
            ("s.csv", text.as_bytes()),
            ("fleet/a.csv", text.as_bytes()),
            ("fleet/b.csv", text.as_bytes()),
            ("model.json", &models[1]),
            ("good.json", &models[2]),
            ("curve.csv", b"q,tau\n-1,-0.5\n0,0\n2,1.5\n"),
            ("arm.toml", arm.as_bytes()),
            ("chain.toml", include_bytes!("chain.toml")),
            ("robot.urdf", include_bytes!("robot.urdf")),
            ("torques.csv", format!("t,tau_shoulder,tau_elbow\n{torques}").as_bytes()),
            ("plant.toml", arm.as_bytes()),
        ]
        .into_iter()
        .chain(SCENARIOS.map(|(name, text)| (name, text.as_bytes())))
        {
            std::fs::write(self.file(name), content)?;
        }
        for made in [
            "prepare s.csv -o s.parquet",
            "fleet fleet --by plant --input u0 --output y --structure linear -o results",
        ] {
            let output = self.run(&made.split(' ').collect::<Vec<_>>())?;
            ensure!(
                output.status.success(),
                "{made}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
        Ok(())
    }

    /// Runs it; it must end by itself with 0, 1 or 2, or soon when it is told to.
    fn run(&self, arguments: &[&str]) -> Result<Output> {
        let mut command = Command::new(&self.path);
        let command = command
            .args(arguments)
            .current_dir(self.folder.path())
            .env(PROGRESS, "1");
        let [runs, interruptions] = &RUNS;
        runs.fetch_add(1, Ordering::Relaxed);
        let child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let process = child.id().to_string();
        let (ended, waiting) = channel::<()>();
        let interrupted = std::thread::spawn(move || {
            let signal = |name: &str| drop(Command::new("kill").args([name, &process]).status());
            if waiting.recv_timeout(PATIENCE).is_ok() {
                return (false, false);
            }
            // Not SIGINT: shells make background processes ignore it.
            signal("-TERM");
            let late = waiting.recv_timeout(LAST).is_err();
            if late {
                signal("-KILL");
            }
            (true, late)
        });
        let output = child.wait_with_output()?;
        let _ = ended.send(());
        let (was_interrupted, was_late) = interrupted.join().unwrap_or_default();
        let all = String::from_utf8_lossy(&output.stderr);
        let (progress, said): (Vec<&str>, Vec<&str>) = all.lines().partition(|line| line.starts_with(MARK));
        let said = said.join("\n");
        ensure!(!was_late, "{arguments:?} goes on after a signal");
        if was_interrupted {
            ensure!(
                progress.len() >= FEWEST_LINES,
                "{arguments:?} did not end within {} s, and did not say how far it was: {progress:?}",
                PATIENCE.as_secs()
            );
            interruptions.fetch_add(1, Ordering::Relaxed);
            println!("interrupted after {} s: {arguments:?}", PATIENCE.as_secs());
        }
        ensure!(
            (was_interrupted || matches!(output.status.code(), Some(0..=2))) && !said.contains("panicked"),
            "{arguments:?} ended with {}: {said}",
            output.status
        );
        ensure!(said.len() < 100_000, "{arguments:?}: the message is long");
        ensure!(
            !has_temporary(self.folder.path())?,
            "{arguments:?}: a temporary file is left"
        );
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
        let _ = std::fs::remove_dir_all(self.0.file("results"));
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
            // A written arm file can be simulated.
            if arguments.contains(&"--arm") {
                let moved = self.0.run(&["simulate", "arm.toml", "-o", "moved.csv"])?;
                ensure!(moved.status.success(), "{arguments:?}: the arm cannot be simulated");
            }
        } else {
            ensure!(is_old, "{arguments:?}: it failed and has written");
        }
        Ok(())
    }
}

/// Changed files. An input is the number of one of [`ON_FILES`], and what its file has.
struct Files {
    program: Program,
    seeds: Vec<(String, Vec<u8>)>,
    models: Vec<Vec<u8>>,
}

impl Files {
    fn new(path: &Path) -> Result<Files> {
        let program = Program::new(path)?;
        program.seed()?;
        let names = ON_FILES.iter().map(|(name, _)| *name);
        let others = ["good.json", "r.csv", "fleet/b.csv", "results/rows/b.json"];
        let seeds = names
            .chain(others)
            .map(|name| Ok((name.to_owned(), std::fs::read(program.file(name))?)));
        Ok(Files {
            seeds: seeds.collect::<Result<_>>()?,
            models: model_seeds()?,
            program,
        })
    }
}

impl Target for Files {
    fn name(&self) -> &'static str {
        "files"
    }

    fn input(&self, random: &mut Pcg64) -> Vec<u8> {
        let command = random.random_range(0..ON_FILES.len());
        let (name, _) = ON_FILES[command];
        let content = match random.random_range(0..10) {
            // The file of another command.
            0 => one(random, &self.seeds).1.clone(),
            _ if name == "model.json" => changed(random, &self.models),
            _ => changed(random, &[self.seeds[command].1.clone()]),
        };
        [vec![command as u8], content].concat()
    }

    fn check(&self, input: &[u8]) -> Result<()> {
        let Some((command, content)) = input.split_first() else {
            return Ok(());
        };
        let (name, arguments) = ON_FILES[usize::from(*command) % ON_FILES.len()];
        let file = |name: &str| self.program.file(name);
        let _ = std::fs::remove_dir_all(file("fresh"));
        for (name, content) in &self.seeds {
            std::fs::write(file(name), content)?;
        }
        for name in OUTPUTS {
            std::fs::write(file(name), "old")?;
        }
        std::fs::write(file(name), content)?;
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let output = self.program.run(&arguments)?;
        let written = OUTPUTS
            .into_iter()
            .filter(|name| std::fs::read(file(name)).is_ok_and(|now| now != b"old"));
        for name in written {
            ensure!(
                output.status.success(),
                "{arguments:?}: it failed and has written {name}"
            );
            let place = file(name);
            match name {
                "out.json" => drop(read_model(&place)?),
                "out.csv" | "out.parquet" => drop(read_record(&place)?),
                _ => ensure!(
                    std::fs::metadata(&place)?.len() > 100,
                    "{arguments:?}: {name} is not whole"
                ),
            }
        }
        if output.status.success() && arguments.contains(&"--json") {
            serde_json::from_slice::<serde_json::Value>(&output.stdout).with_context(|| format!("{arguments:?}"))?;
        }
        Ok(())
    }
}

/// Whether a temporary file is in a folder or below.
fn has_temporary(folder: &Path) -> Result<bool> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "tmp") || path.is_dir() && has_temporary(&path)? {
            return Ok(true);
        }
    }
    Ok(false)
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
        // Arguments that write outside the folder or start the full study are left out.
        if arguments
            .iter()
            .any(|word| word.contains('/') || word.contains("--full"))
        {
            return Ok(());
        }
        self.program.run(&arguments).map(drop)
    }
}

/// All of them.
pub fn all() -> Result<Vec<Box<dyn Target>>> {
    let beside = std::env::current_exe()?.with_file_name(format!("flexure{}", std::env::consts::EXE_SUFFIX));
    let path = std::env::var_os("FLEXURE_BINARY").map_or(beside, PathBuf::from);
    ensure!(
        path.is_file(),
        "no program at {}; build it, or name it by FLEXURE_BINARY",
        path.display()
    );
    let options = Program::new(&path)?;
    options.seed()?;
    Ok(vec![
        Box::new(Options {
            program: options,
            seeds: ARGUMENTS.iter().map(|text| text.as_bytes().to_vec()).collect(),
        }),
        Box::new(Numbers(Program::new(&path)?)),
        Box::new(Files::new(&path)?),
    ])
}

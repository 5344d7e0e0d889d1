//! Thousands of harmful inputs: `fuzz/run`.
//!
//! | target | what is changed | what must hold |
//! |---|---|---|
//! | `text`, `mat`, `parquet`, `hdf5`, `mcap`, `db3` | records | the reader returns, and columns have equal lengths |
//! | `arm`, `model` | arm and model files | the reader returns; what it took can be written and read again |
//! | `urdf`, `chain` | descriptions of chains | the reader returns; what it took moves finitely |
//! | `scenario` | control scenarios | the reader returns, and says what is wrong in few words |
//! | `export` | model files and curves | refused, or a program of finite numbers in every format |
//! | `options` | arguments of the program | exit code 0, 1 or 2 |
//! | `numbers` | nasty columns for `identify`, `regress`, `joint`, `look`, `fleet` | exit code 0, 1 or 2; JSON; a model that reads back; else the old file |
//! | `files` | a file of any command, changed or swapped with another's | exit code 0, 1 or 2; JSON; whole outputs or the old ones; nothing left over |
//!
//! A run of the program that takes long is interrupted, and must end at once. It is counted.
//!
//! Inputs follow from the seed. One that fails is kept in `target/fuzz`, made smaller by hand, and put into `fuzz/corpus`, which every
//! run goes through first. Its binary files are made by `fuzz/corpus/make.py`.

mod commands;
#[expect(dead_code, reason = "the tests of the exports use more of it")]
#[path = "../../crates/flexure-export/tests/common/mod.rs"]
mod models;
mod mutation;
mod program;
mod readers;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// The longest time for one input of a reader: many times that of the slowest. The program has its own limit.
const LONGEST: Duration = Duration::from_secs(60);

/// The targets that run the program.
const PROGRAM: [&str; 3] = ["options", "numbers", "files"];

/// One input: its target, its bytes, and its start.
static CURRENT: Mutex<Option<(String, Vec<u8>, Instant)>> = Mutex::new(None);

/// A target: inputs from a seed, and the checks on them.
pub trait Target {
    /// Its name, which is that of its folder in the corpus.
    fn name(&self) -> &'static str;
    /// The next input.
    fn input(&self, random: &mut Pcg64) -> Vec<u8>;
    /// Fails if something does not hold; a panic is a failure too.
    fn check(&self, input: &[u8]) -> Result<()>;
}

fn main() -> Result<()> {
    let mut inputs = 3000;
    let mut minutes = None;
    let mut seed = 1;
    let mut only = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(option) = arguments.next() {
        let value = arguments.next().with_context(|| format!("{option} needs a value"))?;
        match option.as_str() {
            "--inputs" => inputs = value.parse()?,
            "--minutes" => minutes = Some(value.parse::<f64>()?),
            "--seed" => seed = value.parse()?,
            "--target" => only = Some(value),
            _ => bail!("--inputs N, --minutes N, --seed N and --target NAME are known"),
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut targets: Vec<Box<dyn Target>> = readers::all(&root.join("../crates/flexure-io/tests/data"))?;
    targets.extend(program::all()?);
    targets.retain(|target| only.as_ref().is_none_or(|name| name == target.name()));
    std::thread::spawn(watch);
    let mut failed = 0;
    let mut read = 0;
    let share = |k: usize| minutes.map(|m| Duration::from_secs_f64(60.0 * m * (k + 1) as f64 / targets.len() as f64));
    let started = Instant::now();
    for (k, target) in targets.iter().enumerate() {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut count = 0;
        let mut wrong = 0;
        for input in corpus(&root.join("corpus").join(target.name()))? {
            count += 1;
            wrong += usize::from(!holds(&**target, &input));
        }
        // The program takes longer than a reader.
        let is_program = PROGRAM.contains(&target.name());
        let most = inputs / if is_program { 6 } else { 1 };
        let mut made = 0;
        while share(k).map_or(made < most, |end| started.elapsed() < end) {
            let input = target.input(&mut random);
            wrong += usize::from(!holds(&**target, &input));
            made += 1;
        }
        println!("{:<8} {} inputs, {wrong} failed", target.name(), count + made);
        failed += wrong;
        read += if is_program { 0 } else { count + made };
    }
    let [runs, interrupted] = program::RUNS.each_ref().map(|count| count.load(Ordering::Relaxed));
    println!(
        "{read} inputs of readers, {runs} runs of the program, of which {interrupted} were interrupted; {failed} failed"
    );
    match failed {
        0 => Ok(()),
        _ => bail!("{failed} inputs failed; they are in target/fuzz"),
    }
}

fn corpus(folder: &Path) -> Result<Vec<Vec<u8>>> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Ok(Vec::new());
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths.iter().map(|path| Ok(std::fs::read(path)?)).collect()
}

/// Whether the checks of an input pass; otherwise the input is kept.
fn holds(target: &dyn Target, input: &[u8]) -> bool {
    let begin = (target.name().to_owned(), input.to_vec(), Instant::now());
    if let Ok(mut current) = CURRENT.lock() {
        *current = Some(begin);
    }
    let result = catch_unwind(AssertUnwindSafe(|| target.check(input)));
    let problem = match result {
        Ok(Ok(())) => return true,
        Ok(Err(error)) => format!("{error:#}"),
        Err(_) => "it panics".to_owned(),
    };
    report(target.name(), input, &problem);
    false
}

fn report(name: &str, input: &[u8], problem: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/fuzz");
    let place = folder.join(format!(
        "{name}-{:08x}",
        Pcg64::seed_from_u64(sum(input)).random::<u32>()
    ));
    let kept = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&place, input));
    println!(
        "{name}: {problem} ({}{})",
        place.display(),
        if kept.is_ok() { "" } else { ", not kept" }
    );
}

fn sum(input: &[u8]) -> u64 {
    input
        .iter()
        .fold(0, |sum: u64, b| sum.wrapping_mul(31).wrapping_add(u64::from(*b)))
}

/// Ends the process if one input takes too long.
fn watch() {
    loop {
        std::thread::sleep(Duration::from_millis(500));
        let Ok(current) = CURRENT.lock() else { continue };
        if let Some((name, input, begin)) = &*current
            && !PROGRAM.contains(&name.as_str())
            && begin.elapsed() > LONGEST
        {
            report(name, input, "it takes too long");
            std::process::exit(1);
        }
    }
}

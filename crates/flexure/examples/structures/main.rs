//! The structure of random systems from input and output alone: `cargo run --release -p flexure --example structures`.
//!
//! Ten random systems of each of seven structures (see `draw.rs` for the rule), then ten of each of five kinds outside these structures;
//! 5000 samples, white output noise of 40 dB. Prints a line for each (the fits on fresh data, a star where something refutes the
//! candidate) and the confusion matrix.
//!
//! `structures samples=20000 db=20 systems=25 kind=wiener seed=1012` changes each of these; with a seed the reasons are printed.

mod draw;

use std::time::Instant;

use draw::{Kind, draw};
use flexure::identify::{AUTO, StructureComparison};
use flexure::record::Record;

/// Seeds below this one were for development.
const FIRST_SEED: u64 = 1001;
const KINDS: [(Kind, &str); 12] = [
    (Kind::Linear, "linear"),
    (Kind::Hammerstein, "hammerstein"),
    (Kind::Wiener, "wiener"),
    (Kind::WienerHammerstein, "wiener-hammerstein"),
    (Kind::HammersteinWiener, "hammerstein-wiener"),
    (Kind::Feedback, "feedback"),
    (Kind::Parallel, "parallel"),
    (Kind::Hysteresis, "hysteresis"),
    (Kind::Drift, "drift"),
    (Kind::Regimes, "regimes"),
    (Kind::TwoLoops, "two-loops"),
    (Kind::Disturbed, "disturbed"),
];
/// The first of these kinds are structures; `auto` names them by these keys.
const STRUCTURES: usize = 7;

fn main() -> flexure::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('='));
    let number = |name: &str, default: u64| value(name).and_then(|v| v.parse().ok()).unwrap_or(default);
    let (samples, systems) = (number("samples", 5000) as usize, number("systems", 10));
    let noise = 10_f64.powf(-(number("db", 40) as f64) / 20.0);
    let seed: Option<u64> = value("seed").and_then(|s| s.parse().ok());
    let (mut right, mut named, mut supported, mut outside) = (0, 0, 0, 0);
    let (mut seconds, mut longest) = (0.0, 0.0_f64);
    let mut matrix = Vec::new();
    for (i, (kind, name)) in KINDS.into_iter().enumerate() {
        if value("kind").is_some_and(|k| k != name) {
            continue;
        }
        let mut row = [0; STRUCTURES + 1];
        for seed in seed.map_or(FIRST_SEED..FIRST_SEED + systems, |s| s..s + 1) {
            let drawn = draw(kind, seed, samples, noise)?;
            let record = Record::new([("u", drawn.u), ("y", drawn.y)])?;
            let start = Instant::now();
            let result = AUTO.identify(&record, &["u"], "y")?;
            let Some(result) = result.comparison else { continue };
            let took = start.elapsed().as_secs_f64();
            line(name, seed, &drawn.description, &result, took);
            if arguments.iter().any(|a| a.starts_with("seed")) {
                result.reasons.iter().for_each(|r| println!("    {r}"));
            }
            let column = result.supported.and_then(|s| position(s.key)).unwrap_or(STRUCTURES);
            row[column] += 1;
            match i < STRUCTURES {
                true => (named, right) = (named + 1, right + usize::from(column == i)),
                false => (outside, supported) = (outside + 1, supported + usize::from(column < STRUCTURES)),
            }
            (seconds, longest) = (seconds + took, longest.max(took));
        }
        matrix.push((name, row));
    }
    let short = KINDS[..STRUCTURES]
        .iter()
        .map(|(_, name)| format!("{:>6}", &name[..name.len().min(5)]));
    println!("\n{:<19}{}  none", "true", short.collect::<String>());
    for (name, row) in matrix {
        println!("{name:<19}{}", row.map(|n| format!("{n:>6}")).concat());
    }
    println!("{right} of {named} named rightly; of {outside} that are none of these, {supported} supported");
    println!("{seconds:.0} s in all, {longest:.1} s at most");
    Ok(())
}

fn position(key: &str) -> Option<usize> {
    KINDS[..STRUCTURES].iter().position(|(_, name)| *name == key)
}

fn line(kind: &str, seed: u64, description: &str, result: &StructureComparison, seconds: f64) {
    let fits = result.candidates.iter().map(|c| {
        let initials: String = c.structure.key.split('-').filter_map(|w| w.chars().next()).collect();
        let star = if c.refuted_by.is_empty() { "" } else { "*" };
        format!("{} {:.2}{star}", initials.to_uppercase(), c.fit_percent)
    });
    let like = result
        .looks_like
        .iter()
        .map(|(kind, share)| format!(" {} {share:.2}", kind.key()));
    println!(
        "{kind:<18} {seed:>4} {description:<44} -> {:<18} {}; not noise {:.3};{} {seconds:.1} s",
        result.supported.map_or("none", |s| s.key),
        fits.collect::<Vec<String>>().join(" "),
        result.not_noise,
        like.collect::<String>(),
    );
}

//! The structure of random systems from input and output alone: `cargo run --release -p flexure --example structures`.
//!
//! 25 random systems of each of four structures (see `draw.rs` for the rule), 10,000 samples, white output noise of 30 dB; then
//! ten Duffing oscillators, which are none of the four. Prints a line for each (the fits on fresh data, a star where something
//! refutes the candidate) and the confusion matrix.
//!
//! `structures wiener` runs the systems of one kind, `structures wiener 1012` one of them, with the reasons.

mod draw;

use std::time::Instant;

use draw::{Drawn, Kind, draw};
use flexure::identify::{AUTO, StructureComparison};
use flexure::record::Record;

/// The structures that are compared, with a short name for each.
const STRUCTURES: [(&str, &str); 4] = [
    ("linear", "L"),
    ("hammerstein", "H"),
    ("wiener", "W"),
    ("wiener-hammerstein", "WH"),
];
const SAMPLES: usize = 10_000;
/// Seeds below this one were for development.
const FIRST_SEED: u64 = 1001;
/// 30 dB.
const NOISE: f64 = 0.031_622_776_601_683_79;
const KINDS: [(Kind, &str, u64); 5] = [
    (Kind::Linear, "linear", 25),
    (Kind::Hammerstein, "hammerstein", 25),
    (Kind::Wiener, "wiener", 25),
    (Kind::WienerHammerstein, "wiener-hammerstein", 25),
    (Kind::Duffing, "duffing", 10),
];

fn main() -> flexure::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seeds: Vec<u64> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    let mut matrix = Vec::new();
    let (mut right, mut all, mut seconds) = (0, 0, 0.0);
    for (kind, name, count) in KINDS {
        if arguments.first().is_some_and(|a| a != name) {
            continue;
        }
        let mut row = [0; 5];
        let seeds_here = match seeds.is_empty() {
            true => (FIRST_SEED..FIRST_SEED + count).collect(),
            false => seeds.clone(),
        };
        for seed in seeds_here {
            let drawn = draw(kind, seed, SAMPLES, NOISE)?;
            let record = Record::new([("u", drawn.u.clone()), ("y", drawn.y.clone())])?;
            let start = Instant::now();
            let result = AUTO.identify(&record, &["u"], "y")?;
            let Some(result) = result.comparison else { continue };
            let took = start.elapsed().as_secs_f64();
            line(name, seed, &drawn, &result, took);
            if !seeds.is_empty() {
                result.reasons.iter().for_each(|r| println!("    {r}"));
            }
            let named = result
                .supported
                .and_then(|s| STRUCTURES.iter().position(|(key, _)| *key == s.key));
            row[named.unwrap_or(4)] += 1;
            right += usize::from(result.supported.map(|s| s.key) == truth(kind));
            all += 1;
            seconds += took;
        }
        matrix.push((name, row));
    }
    println!(
        "\n{:<12} {:>8} {:>12} {:>8} {:>18} {:>6}",
        "true", "linear", "Hammerstein", "Wiener", "Wiener-Hammerstein", "none"
    );
    for (name, [a, b, c, d, e]) in matrix {
        println!("{name:<12} {a:>8} {b:>12} {c:>8} {d:>18} {e:>6}");
    }
    println!("{right} of {all} named rightly, {seconds:.0} s in all");
    Ok(())
}

fn truth(kind: Kind) -> Option<&'static str> {
    match kind {
        Kind::Linear => Some("linear"),
        Kind::Hammerstein => Some("hammerstein"),
        Kind::Wiener => Some("wiener"),
        Kind::WienerHammerstein => Some("wiener-hammerstein"),
        Kind::Duffing => None,
    }
}

fn line(kind: &str, seed: u64, drawn: &Drawn, result: &StructureComparison, seconds: f64) {
    let fits = result.candidates.iter().map(|c| {
        let short = STRUCTURES.iter().find(|(key, _)| *key == c.structure.key);
        let short = short.map_or("?", |(_, short)| short);
        let star = if c.refuted_by.is_empty() { "" } else { "*" };
        format!("{short} {:.2}{star}", c.fit_percent)
    });
    println!(
        "{kind:<11} {seed:>4} {:<44} -> {:<18} {}; not noise {:.3}; {seconds:.1} s",
        drawn.words,
        result.supported.map_or("none", |s| s.title),
        fits.collect::<Vec<String>>().join(" "),
        result.not_noise,
    );
}

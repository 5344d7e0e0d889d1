//! The structure of random systems from input and output alone: `cargo run --release -p flexure --example structures`.
//!
//! 25 random systems of each of four structures (see `draw.rs` for the rule), 10,000 samples, white output noise of 30 dB; then
//! ten Duffing oscillators, which are none of the four. Prints a line for each and the confusion matrix.
//!
//! `structures wiener 12` shows one system and the reasons given.

mod draw;

use std::time::Instant;

use draw::{Drawn, Kind, draw};
use flexure::identify::{Auto, AutoIdentification, Structure};
use flexure::record::Record;

const SAMPLES: usize = 10_000;
/// 30 dB.
const NOISE: f64 = 0.031_622_776_601_683_79;
const KINDS: [(Kind, &str, u64); 5] = [
    (Kind::Linear, "linear", 25),
    (Kind::Hammerstein, "hammerstein", 25),
    (Kind::Wiener, "wiener", 25),
    (Kind::Sandwich, "sandwich", 25),
    (Kind::Duffing, "duffing", 10),
];

fn main() -> flexure::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some(kind) = arguments.first() {
        let seeds: Vec<u64> = arguments[1..].iter().filter_map(|a| a.parse().ok()).collect();
        for (kind, name, count) in KINDS.iter().filter(|k| k.1 == kind) {
            for seed in (1..=*count).filter(|s| seeds.is_empty() || seeds.contains(s)) {
                let (drawn, result, seconds) = one(*kind, seed)?;
                line(name, seed, &drawn, &result, seconds);
                if !seeds.is_empty() {
                    let record = Record::new([("u", drawn.u.clone()), ("y", drawn.y.clone())])?;
                    let r = flexure::identify::WienerHammerstein::default().identify(&record, "u", "y")?;
                    let dump: String = (0..10_000)
                        .map(|t| format!("{} {} {} {}\n", drawn.u[t], drawn.y[t], drawn.y0[t], r.predicted[t]))
                        .collect();
                    std::fs::write("/tmp/wt-wiener-dump.txt", dump).unwrap();
                    let w = flexure::Block::Linear(r.front.clone()).simulate(&drawn.u);
                    let z = flexure::Block::Static(r.nonlinearity.clone()).simulate(&w);
                    println!(
                        "{:?} {:?} {:?}\n {:?}",
                        r.front, r.back, r.breakpoints, r.verdict.measures
                    );
                    let mm = |v: &[f64]| {
                        (
                            v.iter().copied().fold(f64::INFINITY, f64::min),
                            v.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                        )
                    };
                    println!(
                        "w {:?} {:?} z {:?} {:?} y {:?} {:?} off {}",
                        mm(&w[..7500]),
                        mm(&w[7500..]),
                        mm(&z[..7500]),
                        mm(&z[7500..]),
                        mm(&r.predicted[..7500]),
                        mm(&r.predicted[7500..]),
                        r.output_offset
                    );
                    let x = r.nonlinearity.x();
                    let n = x.len();
                    println!("{:?} {:?}", &x[n - 3..], &r.nonlinearity.y()[n - 3..]);
                    println!("{:?} {:?}", &x[..3], &r.nonlinearity.y()[..3]);
                    result.reasons.iter().for_each(|r| println!("    {r}"));
                    result.candidates.iter().for_each(|c| {
                        println!(
                            "    {}: {:.4} % {} {}",
                            c.structure, c.fit_percent, c.parameters, c.verdict
                        )
                    });
                }
            }
        }
        return Ok(());
    }
    let mut matrix = Vec::new();
    let mut right = 0;
    let start = Instant::now();
    for (kind, name, count) in KINDS {
        let mut row = [0; 5];
        for seed in 1..=count {
            let (drawn, result, seconds) = one(kind, seed)?;
            line(name, seed, &drawn, &result, seconds);
            let named = result
                .supported
                .and_then(|s| Structure::ALL.iter().position(|t| *t == s));
            row[named.unwrap_or(4)] += 1;
            right += usize::from(result.supported.is_some() && result.supported == truth(kind));
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
    println!(
        "{right} of 100 named rightly, {:.1} s in all",
        start.elapsed().as_secs_f64()
    );
    Ok(())
}

fn truth(kind: Kind) -> Option<Structure> {
    match kind {
        Kind::Linear => Some(Structure::Linear),
        Kind::Hammerstein => Some(Structure::Hammerstein),
        Kind::Wiener => Some(Structure::Wiener),
        Kind::Sandwich => Some(Structure::WienerHammerstein),
        Kind::Duffing => None,
    }
}

fn one(kind: Kind, seed: u64) -> flexure::Result<(Drawn, AutoIdentification, f64)> {
    let drawn = draw(kind, seed, SAMPLES, NOISE)?;
    let record = Record::new([("u", drawn.u.clone()), ("y", drawn.y.clone())])?;
    let start = Instant::now();
    let result = Auto::default().identify(&record, "u", "y")?;
    Ok((drawn, result, start.elapsed().as_secs_f64()))
}

fn line(kind: &str, seed: u64, drawn: &Drawn, result: &AutoIdentification, seconds: f64) {
    let fits: Vec<String> = result
        .candidates
        .iter()
        .map(|c| {
            format!(
                "{} {:.2}{}",
                &c.structure.name()[..1],
                c.fit_percent,
                if c.refuted_by.is_empty() { "" } else { "*" }
            )
        })
        .collect();
    println!(
        "{kind:<11} {seed:>2} {:<38} -> {:<18} {}  tie {} not noise {:.3} {seconds:.1} s",
        drawn.words,
        result.supported.map_or("none", Structure::name),
        fits.join(" "),
        result.as_good.len(),
        result.not_noise,
    );
}

//! How often the true curve and coefficients lie within the bands of 95 %, for structures whose blocks the search fits together.
//!
//! `cargo run --release -p flexure --example bands -- RUNS` prints, for every structure, curve and noise, the share of the points of the
//! curve (over the middle 90 % of its range) that the band covers, and of the coefficients within 1.96 standard errors. The cubic is one
//! piece of a spline: only chance can miss it. For tanh the spline is an approximation; a dead zone's corners may be found as kinks or not.

use flexure::identify::{Structure, result::BlockKind};
use flexure::linear::TransferFunction;
use flexure::record::Record;
use flexure::simulation::batch;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// A curve by its name.
type Known = (&'static str, fn(f64) -> f64);

const CURVES: [Known; 3] = [
    ("cubic", |x| x + 0.3 * x * x - 0.1 * x * x * x),
    ("tanh", |x| f64::tanh(1.5 * x)),
    ("dead zone", |x| x - x.clamp(-0.5, 0.5)),
];
const SAMPLES: usize = 4000;

/// Points and coefficients: how many of them were covered, and how many there are.
#[derive(Default, Clone, Copy)]
struct Covered {
    points: [usize; 2],
    coefficients: [usize; 2],
}

fn normal(n: usize, random: &mut rand_pcg::Pcg64) -> Vec<f64> {
    (0..n).map(|_| StandardNormal.sample(random)).collect()
}

/// One run: whether the true curve and the true linear parts lie within the bands.
fn run(structure: &str, curve: Known, coloured: bool, seed: u64) -> flexure::Result<Covered> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let [front, back] = [[0.3, -0.7], [0.2, -0.8]].map(|[b, a]| TransferFunction::new(vec![b], vec![1.0, a]));
    let (front, back) = (front?, back?);
    let shaped = TransferFunction::new(vec![1.0], vec![1.0, -0.5])?;
    let u = shaped.simulate(&normal(SAMPLES, &mut random));
    let f = |x: &[f64]| -> Vec<f64> { x.iter().map(|x| curve.1(*x)).collect() };
    // With several inputs, the curves' levels are not determined: their mean over the fitted samples is zero.
    let fitted = &u[..SAMPLES * 3 / 4];
    let level = match structure {
        "multiple-inputs" => f(fitted).iter().sum::<f64>() / fitted.len() as f64,
        _ => 0.0,
    };
    let clean = match structure {
        "wiener" => f(&front.simulate(&u)),
        "wiener-hammerstein" => back.simulate(&f(&front.simulate(&u))),
        _ => back.simulate(&f(&u)),
    };
    let mean = clean.iter().sum::<f64>() / SAMPLES as f64;
    let spread = (clean.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / SAMPLES as f64).sqrt();
    let white = normal(SAMPLES, &mut random);
    let noise = match coloured {
        true => TransferFunction::new(vec![0.6], vec![1.0, -0.8])?.simulate(&white),
        false => white,
    };
    let y = clean.iter().zip(&noise).map(|(y, e)| y + 0.1 * spread * e).collect();
    let record = Record::new([("u", u), ("y", y)])?;
    let structure =
        Structure::by_name(structure).ok_or_else(|| flexure::Error::parameter("structure", 0.0, "known"))?;
    let found = structure.identify(&record, &["u"], "y")?;
    let mut covered = Covered::default();
    for block in &found.paths[0].blocks {
        match &block.kind {
            BlockKind::Static(block) => {
                let x = block.curve.x();
                let (low, high) = (x[0], x[x.len() - 1]);
                let inner = low + 0.05 * (high - low)..high - 0.05 * (high - low);
                for ((x, y), half) in x.iter().zip(block.curve.y()).zip(&block.band) {
                    if inner.contains(x) {
                        covered.points[0] += usize::from((y + level - curve.1(*x)).abs() <= *half);
                        covered.points[1] += 1;
                    }
                }
            }
            BlockKind::Linear(block) => {
                let truth = match block.system.a() {
                    [_, a] if (a + 0.7).abs() < 0.05 => [0.3, -0.7],
                    _ => [0.2, -0.8],
                };
                if let ([b], [_, a], Some(errors)) = (block.system.b(), block.system.a(), &block.errors) {
                    for (value, truth, error) in [(b, truth[0], errors.b[0]), (a, truth[1], errors.a[1])] {
                        covered.coefficients[0] += usize::from((value - truth).abs() <= 1.96 * error);
                        covered.coefficients[1] += 1;
                    }
                }
            }
            _ => (),
        }
    }
    Ok(covered)
}

fn main() -> flexure::Result<()> {
    let runs: u64 = std::env::args()
        .nth(1)
        .and_then(|runs| runs.parse().ok())
        .unwrap_or(100);
    println!(
        "{:20} {:10} {:9}  {:>9}  {:>12}  coefficients found",
        "structure", "curve", "noise", "curve", "coefficients"
    );
    for structure in ["wiener", "wiener-hammerstein", "multiple-inputs", "parallel"] {
        for curve in CURVES {
            for coloured in [false, true] {
                let seeds: Vec<u64> = (1..=runs).collect();
                let mut sum = Covered::default();
                for covered in batch(&seeds, |seed| run(structure, curve, coloured, *seed)) {
                    let covered = covered?;
                    for i in 0..2 {
                        sum.points[i] += covered.points[i];
                        sum.coefficients[i] += covered.coefficients[i];
                    }
                }
                let share = |[covered, all]: [usize; 2]| 100.0 * covered as f64 / all as f64;
                println!(
                    "{structure:20} {:10} {:9}  {:7.1} %  {:10.1} %  {}",
                    curve.0,
                    if coloured { "coloured" } else { "white" },
                    share(sum.points),
                    share(sum.coefficients),
                    sum.coefficients[1]
                );
            }
        }
    }
    Ok(())
}

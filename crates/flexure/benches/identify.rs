//! The plain identification on the common job: `cargo bench -p flexure --bench identify`.
//!
//! U uniform on [-2, 2], a dead zone, (z^-1 + 0.5 z^-2) / (1 - 1.5 z^-1 + 0.7 z^-2), 20 dB output noise. Prints the least time of
//! three runs, the nonlinearity's relative L2 error after affine alignment, and the fit on 10,000 fresh samples without noise.

use std::time::Instant;

use flexure::identify::PlainHammerstein;
use flexure::linear::TransferFunction;
use flexure::systems::{KnownHammerstein, KnownNonlinearity};
use flexure::validation::FitMeasures;

/// The start of the fresh record, in which the state still settles.
const SKIP: usize = 100;

fn main() -> flexure::Result<()> {
    let linear = TransferFunction::new(vec![0.0, 1.0, 0.5], vec![1.0, -1.5, 0.7])?;
    let mut system = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear);
    system.process_noise = 0.0;
    let fresh = system.simulate(10_000, 999);
    let grid: Vec<f64> = (0..=400).map(|i| -2.0 + 0.01 * f64::from(i)).collect();
    println!("{:>9} {:>10} {:>8} {:>8}", "samples", "ms", "NL", "fit %");
    for n in [10_000, 100_000, 1_000_000] {
        let record = system.simulate(n, 1);
        let mut least = f64::INFINITY;
        let mut result = None;
        for _ in 0..3 {
            let start = Instant::now();
            result = Some(PlainHammerstein::default().identify(&record, "u", "y")?);
            least = least.min(start.elapsed().as_secs_f64());
        }
        let Some(result) = result else { continue };
        let error = system.nonlinearity_error(&grid, |x| {
            result.curve("nonlinearity").map_or(f64::NAN, |phi| phi.value(x))
        });
        let predicted = result.model.simulate(fresh.column("u")?);
        let fit = FitMeasures::new(&fresh.column("y0")?[SKIP..], &predicted[SKIP..])?.fit_percent;
        println!("{n:>9} {:>10.1} {error:>8.4} {fit:>8.2}", least * 1e3);
    }
    Ok(())
}

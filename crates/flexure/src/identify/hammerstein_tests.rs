//! The paper's algorithm on systems whose truth is known.

use super::*;
use crate::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

fn grid() -> Vec<f64> {
    (0..=200).map(|i| -1.9 + 3.8 * i as f64 / 200.0).collect()
}

fn identify(system: &KnownHammerstein, n: usize, seed: u64, options: PlainHammerstein) -> Identification {
    options.identify(&system.simulate(n, seed), "u", "y").unwrap()
}

#[test]
fn explore() {
    for linear in known_linear_parts() {
        for phi in KnownNonlinearity::ALL {
            let system = KnownHammerstein::usual(phi, linear.clone());
            for lag in [RegressionLag::Delay, RegressionLag::Strongest] {
                let t = std::time::Instant::now();
                let r = identify(
                    &system,
                    20_000,
                    1,
                    PlainHammerstein {
                        regression_lag: lag,
                        ..Default::default()
                    },
                );
                println!(
                    "{phi:?} {lag:?}: error {:.4} delay {} lag {} order {} fit {:.1} psi {:?} holds {} h {:.3} a {:.3?} b {:.3?} {:?} {} ms",
                    system.nonlinearity_error(&grid(), |x| r.nonlinearity.value(x)),
                    r.delay,
                    r.regression_lag,
                    r.order.order,
                    r.verdict.measures.fit_percent,
                    r.psi,
                    r.verdict.holds(),
                    r.bandwidth,
                    r.linear.a(),
                    r.linear.b(),
                    r.warnings,
                    t.elapsed().as_millis()
                );
            }
        }
    }
}

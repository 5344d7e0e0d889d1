//! Prints the convergence studies: measured exponents beside those of theory.
//!
//! ```text
//! cargo run --release -p flexure --example rates                      # the plain estimator, Theorems 1 and 2
//! cargo run --release -p flexure --example rates -- --full            # up to a million samples
//! cargo run --release -p flexure --example rates -- estimators        # every static estimator
//! cargo run --release -p flexure --example rates -- estimators --full # some minutes
//! ```

use std::fmt::Display;
use std::io::Write;
use std::ops::ControlFlow;

use flexure::study::{EstimatorStudy, RateStudy};

fn main() -> flexure::Result<()> {
    let given = |word: &str| std::env::args().skip(1).any(|a| a.trim_start_matches('-') == word);
    match (given("estimators"), given("full")) {
        (false, false) => report(|p| RateStudy::quick().run(p).map(|t| (t.agrees(), t))),
        (false, true) => report(|p| RateStudy::full().run(p).map(|t| (t.agrees(), t))),
        (true, full) => {
            let (all, network) = if full {
                (EstimatorStudy::full(), EstimatorStudy::full_network())
            } else {
                (EstimatorStudy::quick(), EstimatorStudy::quick_network())
            };
            report(|p| all.run(p).map(|t| (t.agrees(), t)))?;
            report(|p| network.run(p).map(|t| (t.agrees(), t)))
        }
    }
}

/// Runs a study that gives its verdict and its table, and prints both.
fn report<T: Display>(
    run: impl FnOnce(&mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> flexure::Result<(bool, T)>,
) -> flexure::Result<()> {
    let mut shown = usize::MAX;
    let (agrees, table) = run(&mut |done, total| {
        let percent = 100 * done / total.max(1);
        if percent != shown {
            shown = percent;
            eprint!("\r{percent:3} %");
            let _ = std::io::stderr().flush();
        }
        ControlFlow::Continue(())
    })?;
    eprintln!();
    print!("{table}");
    println!(
        "{}",
        if agrees {
            "All settings agree with theory (jointly, at 95 %)."
        } else {
            "Some settings differ from theory."
        }
    );
    Ok(())
}

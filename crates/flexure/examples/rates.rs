//! Prints the convergence study: the measured exponents of the plain estimator beside those of
//! Theorems 1 and 2.
//!
//! ```text
//! cargo run --release -p flexure --example rates            # under a minute
//! cargo run --release -p flexure --example rates -- --full  # up to a million samples
//! ```

use std::io::Write;
use std::ops::ControlFlow;

use flexure::study::RateStudy;

fn main() -> flexure::Result<()> {
    let study = if std::env::args().any(|a| a == "--full") {
        RateStudy::full()
    } else {
        RateStudy::quick()
    };
    let mut shown = usize::MAX;
    let table = study.run(&mut |done, total| {
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
        if table.agrees() {
            "All settings agree with theory (jointly, at 95 %)."
        } else {
            "Some settings differ from theory."
        }
    );
    Ok(())
}

//! x
mod draw;
use std::time::Instant;

use draw::{Kind, draw};
use flexure::identify::Wiener;
use flexure::record::Record;
use flexure::validation::FitMeasures;

fn main() -> flexure::Result<()> {
    for seed in 1..=24 {
        let d = draw(Kind::Wiener, seed, 10_000, 0.01)?;
        let start = Instant::now();
        let r = Wiener::default().identify(&Record::new([("u", d.u), ("y", d.y)])?, "u", "y")?;
        let fit = FitMeasures::new(&d.y0[7500..], &r.predicted[7500..])?.fit_percent;
        println!(
            "{seed:>2} {:<35} {fit:>7.3} order {} {:?} {} pieces {:.2} s {}",
            d.words,
            r.order,
            r.start,
            r.breakpoints.len() - 1,
            start.elapsed().as_secs_f64(),
            r.verdict.holds()
        );
    }
    Ok(())
}

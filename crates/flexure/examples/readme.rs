//! The README's example.

use flexure::identify::PlainHammerstein;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

fn main() -> flexure::Result<()> {
    let [linear, _] = known_linear_parts();
    let record = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear).simulate(20_000, 1); // columns u, y
    let result = PlainHammerstein::default().identify(&record, "u", "y")?;
    println!("{}", result.verdict.text());
    if let (Some(phi), Some(linear)) = (result.curve("nonlinearity"), result.linear("linear")) {
        println!("phi(1.5) = {:.3}", phi.value(1.5));
        println!("a = {:?}", linear.a());
    }
    Ok(())
}

//! The counts of an encoder a turn, from a position and a speed in rpm in the same log.

use flexure::text::{number, short};
use flexure_io::RecordFile;
use flexure_workbench::preparation::conversion;

use crate::output::print_note;

/// Seconds in a minute.
const MINUTE: f64 = 60.0;
/// The samples over which a position's steps are compared with the turns: single steps are rounded to counts.
const WINDOW: usize = 10;
/// The position follows the speed if it shares this part of its steps' power. Convention.
const FOLLOWS: f64 = 0.9;
/// A position is in rad if it moves by so nearly one turn a turn.
const SAME: f64 = 0.02;

/// Says of positions without a known unit how far they move a turn, where the log also has a speed in rpm.
pub fn note_of_counts<'a>(file: &RecordFile, positions: impl Iterator<Item = &'a String>, sample_time: f64) {
    let speed = file.record.names().iter().find(|name| file.unit(name) == Some("rpm"));
    let Some(speed) = speed else { return };
    for position in positions {
        let unit = file.unit(file.meant(position));
        let is_angle = unit.is_some_and(|unit| conversion(unit, "rad").is_ok());
        let columns = [file.finite(position).ok(), file.finite(speed).ok()];
        let [Some(position_samples), Some(rpm)] = columns else {
            continue;
        };
        let found = (!is_angle).then(|| units_a_turn(position_samples, rpm, sample_time));
        if let Some(count) = found.flatten().filter(|count| is_no_angle(*count)) {
            print_note(&format!(
                "note: {}: '{position}' moves by {} a turn of '{speed}' (rpm), as counts of an encoder do; divide it by {} for rad",
                file.name(),
                short(count),
                number(count.abs() / std::f64::consts::TAU)
            ));
        }
    }
}

fn is_no_angle(count: f64) -> bool {
    (count.abs() / std::f64::consts::TAU - 1.0).abs() > SAME
}

/// How far the position moves while the speed makes one turn; `None` if the position does not follow the speed.
fn units_a_turn(position: &[f64], rpm: &[f64], sample_time: f64) -> Option<f64> {
    let step = |i: usize| position[i + WINDOW] - position[i];
    // By the trapezoidal rule.
    let turns = |i: usize| {
        let inner: f64 = rpm[i + 1..i + WINDOW].iter().sum();
        (inner + (rpm[i] + rpm[i + WINDOW]) / 2.0) * sample_time / MINUTE
    };
    let (mut both, mut steps, mut all) = (0.0, 0.0, 0.0);
    for i in (0..position.len().saturating_sub(WINDOW)).step_by(WINDOW) {
        let (moved, turned) = (step(i), turns(i));
        both += moved * turned;
        steps += moved * moved;
        all += turned * turned;
    }
    let shared = both * both / (steps * all);
    (shared > FOLLOWS).then_some(both / all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_tells_its_counts_and_noise_tells_nothing() {
        let step = 0.01;
        let rpm: Vec<f64> = (0..2000).map(|i| 300.0 * (0.02 * i as f64).sin()).collect();
        let mut turns = 0.0;
        let counts: Vec<f64> = (0..2000)
            .map(|i| {
                let now = (4096.0_f64 * turns).round();
                let next = rpm[(i + 1).min(1999)];
                turns += (rpm[i] + next) / 2.0 * step / MINUTE;
                now
            })
            .collect();
        let found = units_a_turn(&counts, &rpm, step).unwrap();
        assert!((found / 4096.0 - 1.0).abs() < 1e-3, "{found}");
        let other: Vec<f64> = (0..2000).map(|i| (0.5 * i as f64).cos()).collect();
        assert_eq!(units_a_turn(&other, &rpm, step), None);
        assert!(is_no_angle(found) && !is_no_angle(std::f64::consts::TAU));
    }
}

//! Prints the results for simulated joints with friction at the motor, late samples, damping, hysteresis, presliding and gravity: how often
//! the truth lies within 95 % errors and bands, and which effects are named.
//!
//! ```text
//! cargo run --release -p flexure --example joint_families                 # 20 runs of every family and noise
//! cargo run --release -p flexure --example joint_families -- 200 motor    # runs, families whose name contains this
//! ```
//!
//! Each run is another motion of 60 s at 500 Hz in a position loop, with other noise. "Jm", "M" are the shares of runs whose inertia lies
//! within 1.96 standard errors, with the root mean square of their relative errors; "stiffness", "friction" and "motor" the share of the
//! range over which the band contains the truth, averaged over the runs, with the relative L2 distance. "named" is the share of runs in which
//! all effects that the joint has are given as facts, "open" is the share in which effects compete, "false" the share in which a fact is an
//! effect that the joint does not have.

mod simulated;

use flexure::bands::Band;
use flexure::identify::robot_joint::{Effect, Estimated, FlexibleAxis, FlexibleJoint, IdentifiedJoint};
use simulated::{FAMILIES, Family, NOISES, Noise, recording};

/// Sums over runs: of covered values, and of squared relative errors.
#[derive(Default)]
struct Sums {
    runs: f64,
    within: f64,
    off: f64,
}

impl Sums {
    fn inertia(&mut self, found: Estimated, truth: f64) {
        self.runs += 1.0;
        self.within += f64::from(u8::from((found.value - truth).abs() < 1.96 * found.standard_error));
        self.off += (found.value / truth - 1.0).powi(2);
    }

    /// Counted at the points of the band, each with the stretch of the range that is nearest to it: between the points the truth is no
    /// straight line.
    fn curve(&mut self, band: &Band, truth: impl Fn(f64) -> f64) {
        let x = &band.x[0];
        let last = x.len() - 1;
        let (mut covered, mut off, mut size) = (0.0, 0.0, 0.0);
        for i in 0..=last {
            let stretch = x[(i + 1).min(last)] - x[i.saturating_sub(1)];
            let y = truth(x[i]);
            if (band.lower[i]..=band.upper[i]).contains(&y) {
                covered += stretch;
            }
            off += stretch * (band.estimate[i] - y).powi(2);
            size += stretch * y * y;
        }
        self.runs += 1.0;
        self.within += 0.5 * covered / (x[last] - x[0]);
        self.off += off / size;
    }

    fn text(&self) -> String {
        match self.runs > 0.0 {
            true => format!(
                "{:5.1} % ({:6.3} %)",
                100.0 * self.within / self.runs,
                100.0 * (self.off / self.runs).sqrt()
            ),
            false => "       -         ".to_owned(),
        }
    }
}

fn identified(family: &Family, noise: &Noise, seed: u64) -> flexure::Result<IdentifiedJoint> {
    let log = family.joint.log(&recording(noise), seed)?;
    FlexibleJoint {
        motor: &log.motor,
        link: &log.link,
        torque: &log.torque,
        load: None,
        sample_time: log.sample_time,
        motor_inertia: None,
        level: 0.95,
    }
    .identify()
}

/// The effects that are given as facts.
fn facts(axis: &FlexibleAxis) -> Vec<Effect> {
    let facts = axis.effects.iter().filter(|effect| !axis.competing.contains(effect));
    facts.copied().collect()
}

fn main() -> flexure::Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let runs: u64 = given.first().and_then(|runs| runs.parse().ok()).unwrap_or(20);
    let wanted = given.get(1).map_or("", String::as_str);
    println!(
        "{:<26} {:<7} {:<18} {:<18} {:<18} {:<18} {:<18} named  open  false",
        "family", "noise", "Jm", "M", "stiffness", "friction", "motor"
    );
    for family in FAMILIES.iter().filter(|family| family.name.contains(wanted)) {
        for noise in &NOISES {
            let mut sums: [Sums; 5] = Default::default();
            let [mut named, mut open, mut wrong, mut rigid] = [0.0; 4];
            let joint = &family.joint;
            for seed in 0..runs {
                let axis = match identified(family, noise, seed)? {
                    IdentifiedJoint::Flexible(axis) => axis,
                    IdentifiedJoint::Rigid(_) => {
                        rigid += 1.0;
                        continue;
                    }
                };
                let [motor, link, stiffness, friction, at_motor] = &mut sums;
                motor.inertia(axis.motor_inertia, joint.motor_inertia);
                link.inertia(axis.link.inertia, joint.link_inertia);
                stiffness.curve(&axis.stiffness.band, |d| joint.stiffness.torque(d));
                friction.curve(&axis.link.friction.band, |v| joint.steady_friction(v));
                if let Some(curve) = &axis.motor_friction {
                    at_motor.curve(&curve.band, |v| joint.motor_friction.torque(v));
                }
                let facts = facts(&axis);
                named += f64::from(u8::from(family.effects.iter().all(|effect| facts.contains(effect))));
                wrong += f64::from(u8::from(facts.iter().any(|effect| !family.effects.contains(effect))));
                open += f64::from(u8::from(!axis.competing.is_empty()));
            }
            let share = |count: f64| 100.0 * count / (runs as f64 - rigid);
            let sums: Vec<String> = sums.iter().map(Sums::text).collect();
            println!(
                "{:<26} {:<7} {} {:4.0} % {:4.0} % {:4.0} %{}",
                family.name,
                noise.name,
                sums.join("  "),
                share(named),
                share(open),
                share(wrong),
                if rigid > 0.0 {
                    format!("  ({rigid} taken as rigid)")
                } else {
                    String::new()
                }
            );
        }
    }
    Ok(())
}

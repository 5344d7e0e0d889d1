//! Joints whose links stick: friction that turns at once, and friction that turns over a distance after a reversal.

use super::*;

const MOTOR: f64 = 0.4;
const LINK: f64 = 1.0;
const STIFFNESS: f64 = 1200.0;
/// Coulomb and viscous friction of motor and link.
const FRICTION: [[f64; 2]; 2] = [[0.6, 0.4], [1.0, 0.6]];
const SAMPLE: f64 = 0.004;

/// Motor and link angle and torque for 16 s. A controller of the motor follows slow sines, and holds its torque. The link's Coulomb friction turns over this
/// distance (Dahl 1968), or at once.
fn sticking(seed: u64, distance: Option<f64>) -> [Vec<f64>; 3] {
    const STEPS: usize = 100;
    let h = SAMPLE / STEPS as f64;
    let mut rng = Pcg64::seed_from_u64(seed);
    let phases: Vec<f64> = (0..4).map(|_| rng.random_range(0.0..std::f64::consts::TAU)).collect();
    let reference = |t: f64| -> f64 {
        let lines = [0.1, 0.23, 0.41, 0.7].into_iter().zip(&phases).enumerate();
        lines
            .map(|(i, (f, phase))| 0.4 / (1.0 + i as f64) * (std::f64::consts::TAU * f * t + phase).sin())
            .sum()
    };
    let start = reference(0.0);
    let (mut q, mut v, mut turned) = ([start; 2], [0.0_f64; 2], 0.0_f64);
    let mut log = [Vec::new(), Vec::new(), Vec::new()];
    for i in 0..4000 {
        let torque = 30.0 * (15.0 * (reference(SAMPLE * i as f64) - q[0]) - v[0]);
        let signals = [(q[0], 5e-6), (q[1], 5e-6), (torque, 0.02)];
        for (column, (value, sd)) in log.iter_mut().zip(signals) {
            let noise: f64 = StandardNormal.sample(&mut rng);
            column.push(value + sd * noise);
        }
        for _ in 0..STEPS {
            let spring = STIFFNESS * (q[0] - q[1]);
            let body = |k: usize, force: f64, coulomb: f64, inertia: f64| {
                let free = v[k] + h * (force - FRICTION[k][1] * v[k]) / inertia;
                let held = coulomb * h / inertia;
                if free.abs() <= held {
                    0.0
                } else {
                    free - held.copysign(free)
                }
            };
            let (at_once, slowly) = match distance {
                None => (FRICTION[1][0], 0.0),
                Some(distance) => {
                    turned += h * (v[1] - v[1].abs() * turned / distance);
                    (0.0, FRICTION[1][0] * turned / distance)
                }
            };
            let next = [
                body(0, torque - spring, FRICTION[0][0], MOTOR),
                body(1, spring - slowly, at_once, LINK),
            ];
            for k in 0..2 {
                q[k] += 0.5 * h * (v[k] + next[k]);
            }
            v = next;
        }
    }
    log
}

/// Whether friction with memory is a fact in such a log.
fn has_memory(distance: Option<f64>) -> bool {
    let log = sticking(0, distance);
    let axis = found(FlexibleJoint {
        sample_time: SAMPLE,
        ..flexible(&log)
    });
    let memory = |finding: &Finding| {
        let effect = Effect::Presliding;
        matches!(finding, Finding::Memory { effect: found, .. } if *found == effect)
    };
    axis.link.findings.iter().any(memory)
}

/// The equations of motion alone take the sticking link for friction with memory.
#[test]
fn friction_of_a_link_that_sticks_has_no_memory() {
    assert!(!has_memory(None));
}

#[test]
fn friction_that_turns_over_a_distance_has_a_memory() {
    assert!(has_memory(Some(3e-3)));
}

//! A two-link arm with linear flexible joints, integrated by the classical Runge-Kutta method: good enough for a picture.

use flexure_report::data::{ArmMotion, Axis};

const LENGTHS: [f64; 2] = [4.5, 4.5];
const MASS: f64 = 1.5075;
const INERTIA: f64 = 2.544;
const ROTOR: f64 = 1.0;
const STIFFNESS: f64 = 500.0;
const DAMPING: f64 = 1.2;
const VISCOUS: f64 = 2.2;

/// Link angles, motor angles, and their rates.
type State = [f64; 8];

/// The motion under slowly varying torques, `n` samples at `h` seconds.
pub fn motion(n: usize, h: f64) -> ArmMotion {
    const SUBSTEPS: usize = 10;
    let mut state: State = [0.35, -0.9, 0.35, -0.9, 0.0, 0.0, 0.0, 0.0];
    let mut columns: [Vec<f64>; 6] = Default::default();
    for i in 0..n {
        let tau = torque(i as f64 * h, &state);
        for (column, v) in columns
            .iter_mut()
            .zip([state[0], state[1], state[2], state[3], tau[0], tau[1]])
        {
            column.push(v);
        }
        for _ in 0..SUBSTEPS {
            state = step(&state, &tau, h / SUBSTEPS as f64);
        }
    }
    let [q1, q2, qm1, qm2, tau1, tau2] = columns;
    ArmMotion {
        lengths: LENGTHS,
        time: Axis {
            name: "time".into(),
            unit: "s".into(),
            start: 0.0,
            step: h,
        },
        q: [q1, q2],
        qm: [qm1, qm2],
        tau: [tau1, tau2],
    }
}

/// A proportional-derivative controller on the motors that goes through postures, one every five seconds.
fn torque(t: f64, s: &State) -> [f64; 2] {
    const POSTURES: [[f64; 2]; 4] = [[0.9, -1.5], [1.9, -0.6], [2.3, 1.1], [0.7, 1.4]];
    let [p1, p2] = POSTURES[(t / 5.0) as usize % POSTURES.len()];
    let drive = |want: f64, angle: f64, rate: f64| (38.0 * (want - angle) - 55.0 * rate).clamp(-28.0, 28.0);
    [drive(p1, s[2], s[6]), drive(p2, s[3], s[7])]
}

fn derivative(s: &State, tau: &[f64; 2]) -> State {
    let [q1, q2, m1, m2, w1, w2, r1, r2] = *s;
    let (l, c) = (LENGTHS[0], LENGTHS[0] / 2.0);
    let m11 = MASS * c * c + MASS * (l * l + c * c + 2.0 * l * c * q2.cos()) + 2.0 * INERTIA;
    let m12 = MASS * (c * c + l * c * q2.cos()) + INERTIA;
    let m22 = MASS * c * c + INERTIA;
    let h = MASS * l * c * q2.sin();
    let joint = [
        STIFFNESS * (m1 - q1) + DAMPING * (r1 - w1),
        STIFFNESS * (m2 - q2) + DAMPING * (r2 - w2),
    ];
    let f1 = joint[0] + h * (w2 * w1 + (w1 + w2) * w2);
    let f2 = joint[1] - h * w1 * w1;
    let determinant = m11 * m22 - m12 * m12;
    [
        w1,
        w2,
        r1,
        r2,
        (m22 * f1 - m12 * f2) / determinant,
        (m11 * f2 - m12 * f1) / determinant,
        (tau[0] - joint[0] - VISCOUS * r1) / ROTOR,
        (tau[1] - joint[1] - VISCOUS * r2) / ROTOR,
    ]
}

fn step(s: &State, tau: &[f64; 2], h: f64) -> State {
    let along = |d: &State, part: f64| -> State { std::array::from_fn(|i| s[i] + part * h * d[i]) };
    let k1 = derivative(s, tau);
    let k2 = derivative(&along(&k1, 0.5), tau);
    let k3 = derivative(&along(&k2, 0.5), tau);
    let k4 = derivative(&along(&k3, 1.0), tau);
    std::array::from_fn(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

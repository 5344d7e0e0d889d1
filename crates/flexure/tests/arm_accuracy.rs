//! The arm's motion against SciPy's, and against what mechanics says of energy, limits and modes.
//!
//! The reference states are written by scripts/reference/arm.py.

use flexure::error::{ArmError, SimulationError, Stopped};
use std::ops::ControlFlow;

use flexure::manipulator::{
    Arm, ArmParameters, Drive, Friction, JointKind, Parts, SimulationOptions, State, simulate, simulate_watched,
    space_arm,
};
use flexure::simulation::{Tolerances, batch};
use flexure::{Error, Record};

const MODELS: [(&str, JointKind); 3] = [
    ("rigid", JointKind::Rigid),
    ("linear", JointKind::Linear),
    ("nonlinear", JointKind::Nonlinear),
];

/// The numbers of the reference rows that begin with these two words.
fn reference(model: &str, kind: &str) -> Vec<Vec<f64>> {
    include_str!("data/arm_reference.csv")
        .lines()
        .filter_map(|line| line.strip_prefix(&format!("{model},{kind},")))
        .map(|row| row.split(',').map(|v| v.parse().unwrap()).collect())
        .collect()
}

fn chirp(t: f64) -> [f64; 2] {
    let phase = std::f64::consts::TAU * (0.1 * t + 0.095 * t * t);
    [20.0 * phase.sin(), 5.0 * (0.7 * phase).cos()]
}

/// The held torques of the script, from its generator.
fn held(rows: usize) -> [Vec<f64>; 2] {
    let mut state = 12345_u64;
    let mut torque = [Vec::new(), Vec::new()];
    for _ in 0..rows {
        for (column, size) in torque.iter_mut().zip([40.0, 10.0]) {
            state = state * 1_103_515_245 % (1 << 31);
            column.push(size * (state as f64 / (1_u64 << 31) as f64 - 0.5));
        }
    }
    torque
}

fn arm(model: JointKind) -> Arm {
    Arm::new(space_arm(model)).unwrap()
}

fn bent(duration: f64, sample_time: f64) -> SimulationOptions {
    let mut options = SimulationOptions::new(duration, sample_time).unwrap();
    options.initial = State {
        q: [0.0, 0.5],
        qm: [0.0, 0.5],
        ..State::default()
    };
    options
}

/// The state of row `k`: the record's columns after the torques.
fn row(record: &Record, k: usize) -> Vec<f64> {
    record.columns().skip(3).map(|(_, c)| c[k]).collect()
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

#[test]
fn all_models_follow_the_reference_under_time_dependent_torque() {
    for (name, model) in MODELS {
        // Steps that end at a hundred instants, and only at the end.
        for sample_time in [0.1, 10.0] {
            let options = bent(10.0, sample_time);
            let record = simulate(&arm(model), &Drive::Torque(&chirp), &options).unwrap();
            let error = difference(&row(&record, record.len() - 1), &reference(name, "chirp")[0]);
            println!("{name}, chirp, every {sample_time} s: error {error:.1e}");
            assert!(error < 1e-7, "{name}: {error}");
        }
    }
}

#[test]
fn all_models_follow_the_reference_under_held_random_torque() {
    for (name, model) in MODELS {
        let [a, b] = held(101);
        // A start that differs by a rounding takes other steps through the friction: the nonlinear arm's error at the usual tolerance of 1e-9
        // is 0.5e-7 to 1.8e-7.
        for (rtol, most) in [(1e-9, 2e-7), (1e-10, 1e-7)] {
            let mut options = bent(10.0, 0.1);
            options.tolerances.rtol = rtol;
            let record = simulate(&arm(model), &Drive::Held([&a, &b]), &options).unwrap();
            let error = difference(&row(&record, 100), &reference(name, "held")[0]);
            println!("{name}, held, tolerance {rtol:e}: error {error:.1e}");
            assert!(error < most, "{name}: {error}");
            assert_eq!(record.column("tau1").unwrap(), a);
        }
    }
}

fn frictionless(model: JointKind) -> ArmParameters {
    let mut parameters = space_arm(model);
    parameters.parts.friction = false;
    parameters
}

fn wound_up(duration: f64, sample_time: f64, rtol: f64) -> SimulationOptions {
    SimulationOptions {
        initial: State {
            q: [0.0, 0.5],
            qm: [0.1, 0.45],
            dq: [0.0, 0.3],
            dqm: [0.0, 0.3],
        },
        tolerances: Tolerances {
            rtol,
            atol: 1e-3 * rtol,
            ..Tolerances::default()
        },
        ..SimulationOptions::new(duration, sample_time).unwrap()
    }
}

fn energies(arm: &Arm, record: &Record) -> Vec<f64> {
    let rigid = arm.model() == JointKind::Rigid;
    (0..record.len())
        .map(|k| {
            let x = row(record, k);
            arm.energy(&if rigid {
                State {
                    q: [x[0], x[1]],
                    dq: [x[2], x[3]],
                    ..State::default()
                }
            } else {
                State::from_array(x.try_into().unwrap())
            })
        })
        .collect()
}

#[test]
fn energy_is_kept_without_friction_for_a_thousand_seconds() {
    let zeros = vec![0.0; 1001];
    for (name, model) in MODELS {
        for (rtol, limit) in [(1e-12, 1e-8), (1e-9, 1e-5)] {
            let mut parameters = frictionless(model);
            for rotor in [false, true] {
                parameters.parts.rotor_in_link_inertia = rotor;
                let arm = Arm::new(parameters).unwrap();
                let record = simulate(&arm, &Drive::Held([&zeros, &zeros]), &wound_up(1000.0, 1.0, rtol)).unwrap();
                let e = energies(&arm, &record);
                let drift = e.iter().fold(0.0_f64, |m, v| m.max((v / e[0] - 1.0).abs()));
                println!("{name}, rtol {rtol}, rotor in M11 {rotor}: relative energy drift {drift:.1e}");
                assert!(drift < limit, "{name} {rtol}: {drift}");
            }
        }
    }
}

#[test]
fn friction_never_lets_the_energy_grow() {
    let zeros = vec![0.0; 2001];
    let mut at_motors = frictionless(JointKind::Nonlinear);
    at_motors.parts.friction = true;
    for joint in &mut at_motors.joints {
        (joint.friction, joint.motor_friction) = (None, Some(Friction([0.0, 0.0, 0.0, 2.0, 60.0, 1.5])));
    }
    let mut damped = frictionless(JointKind::Nonlinear);
    damped.joints.iter_mut().for_each(|joint| joint.damping = 5.0);
    // A damping stops only the deflections.
    for (arm, remains) in [(space_arm(JointKind::Nonlinear), 0.2), (at_motors, 0.2), (damped, 0.6)] {
        let arm = Arm::new(arm).unwrap();
        let record = simulate(&arm, &Drive::Held([&zeros, &zeros]), &wound_up(20.0, 0.01, 1e-10)).unwrap();
        let e = energies(&arm, &record);
        assert!(e.windows(2).all(|w| w[1] <= w[0] + 1e-10 * e[0]));
        assert!(e[2000] < remains * e[0], "{} of {}", e[2000], e[0]);
    }
}

#[test]
fn a_nonlinear_joint_without_its_nonlinear_parts_is_the_linear_joint() {
    let mut parameters = space_arm(JointKind::Nonlinear);
    parameters.parts = Parts::of(JointKind::Linear);
    let run = |arm: &Arm| simulate(arm, &Drive::Torque(&chirp), &bent(5.0, 0.01)).unwrap();
    assert_eq!(run(&Arm::new(parameters).unwrap()), run(&arm(JointKind::Linear)));
    // Zero values are the same as switched-off parts.
    let mut zeroed = space_arm(JointKind::Nonlinear);
    zeroed.parts.coupling = false;
    for joint in &mut zeroed.joints {
        (joint.cubic, joint.windup, joint.friction) = (0.0, 0.0, Some(Friction([0.0; 6])));
    }
    assert_eq!(run(&Arm::new(zeroed).unwrap()), run(&arm(JointKind::Linear)));
}

#[test]
fn a_stiffer_and_stiffer_arm_tends_to_the_rigid_one_with_its_rotors() {
    let torque = |t: f64| [(1.3 * t).sin().powi(2), -0.5 * (0.9 * t).sin().powi(2)];
    let mut rigid = space_arm(JointKind::Rigid);
    let at_motor = Some(Friction([0.0, 0.0, 0.0, 1.0, 20.0, 0.3]));
    rigid
        .joints
        .iter_mut()
        .for_each(|joint| joint.motor_friction = at_motor);
    rigid.parts.rotors = true;
    rigid.parts.coupling = true;
    rigid.parts.friction = true;
    let run = |p: ArmParameters| simulate(&Arm::new(p).unwrap(), &Drive::Torque(&torque), &bent(3.0, 3.0)).unwrap();
    let limit = run(rigid);
    let mut errors = Vec::new();
    for k in [1e4, 1e5, 1e6] {
        let mut flexible = space_arm(JointKind::Nonlinear);
        for joint in &mut flexible.joints {
            (joint.linear, joint.cubic, joint.windup) = (k, 0.0, 0.0);
            joint.motor_friction = at_motor;
        }
        let record = run(flexible);
        let q = ["q1", "q2"].map(|n| (record.column(n).unwrap()[1] - limit.column(n).unwrap()[1]).abs());
        errors.push(q[0].max(q[1]));
    }
    println!("distance to the rigid arm at k = 1e4, 1e5, 1e6: {errors:?}");
    assert!(errors[2] < 1e-5 && errors[1] < 0.3 * errors[0] && errors[2] < 0.3 * errors[1]);
}

#[test]
fn modal_frequencies_are_those_of_the_eigenproblem() {
    for (name, model) in &MODELS[1..] {
        for row in reference(name, "modes") {
            let omega = arm(*model).modal_frequencies(row[0], [0.0; 2]);
            assert!(
                difference(&omega, &row[1..]) < 1e-10 * row[2],
                "{name}: {omega:?} {row:?}"
            );
        }
    }
    assert!(arm(JointKind::Rigid).modal_frequencies(0.0, [0.0; 2]).is_empty());
}

/// The circular frequency of the zero crossings of `signal`, interpolated linearly.
fn crossing_frequency(signal: &[f64], sample_time: f64) -> f64 {
    let crossings: Vec<f64> = signal
        .windows(2)
        .enumerate()
        .filter(|(_, w)| w[0] < 0.0 && w[1] >= 0.0)
        .map(|(k, w)| (k as f64 - w[0] / (w[1] - w[0])) * sample_time)
        .collect();
    let periods = (crossings.len() - 1) as f64;
    std::f64::consts::TAU * periods / (crossings[crossings.len() - 1] - crossings[0])
}

#[test]
fn small_vibrations_have_the_modal_frequencies() {
    // One joint locked: a single mode, seen in the deflection of the other.
    for free in [0, 1] {
        let mut parameters = frictionless(JointKind::Nonlinear);
        parameters.joints[1 - free].locked = true;
        let arm = Arm::new(parameters).unwrap();
        let mut options = SimulationOptions::new(20.0, 0.001).unwrap();
        options.initial.q = [0.0, 0.7];
        options.initial.qm = [0.0, 0.7];
        options.initial.qm[free] += 1e-6;
        let zeros = vec![0.0; options.sampling.rows()];
        let record = simulate(&arm, &Drive::Held([&zeros, &zeros]), &options).unwrap();
        let names = [["q1", "qm1"], ["q2", "qm2"]][free];
        let [q, qm] = names.map(|n| record.column(n).unwrap());
        let d: Vec<f64> = q.iter().zip(qm).map(|(a, b)| b - a).collect();
        let (simulated, linear) = (crossing_frequency(&d, 0.001), arm.modal_frequencies(0.7, [0.0; 2]));
        assert_eq!(linear.len(), 1);
        assert!((simulated / linear[0] - 1.0).abs() < 1e-4, "{simulated} {linear:?}");
        let other = record.column(["q2", "q1"][free]).unwrap();
        assert!(other.iter().all(|v| *v == other[0]), "the locked joint moves");
    }
    // Both free: d satisfies the fourth-order recursion whose roots are the two frequencies.
    let arm = Arm::new(frictionless(JointKind::Nonlinear)).unwrap();
    let step = 0.01;
    let mut options = SimulationOptions::new(5.0, step).unwrap();
    options.initial.q = [0.0, 0.7];
    options.initial.qm = [1e-5, 0.7 - 2e-5];
    options.tolerances.atol = 1e-15;
    let zeros = vec![0.0; options.sampling.rows()];
    let record = simulate(&arm, &Drive::Held([&zeros, &zeros]), &options).unwrap();
    let [q, qm] = ["q1", "qm1"].map(|n| record.column(n).unwrap());
    let d: Vec<f64> = q.iter().zip(qm).map(|(a, b)| b - a).collect();
    let [a, b] = [0, 1].map(|i| 2.0 * (arm.modal_frequencies(0.7, [0.0; 2])[i] * step).cos());
    for w in d.windows(5) {
        let residual = w[0] + w[4] - (a + b) * (w[1] + w[3]) + (2.0 + a * b) * w[2];
        assert!(residual.abs() < 1e-8 * 1e-5 * 1e2, "{residual:e}");
    }
}

#[test]
fn commanded_deflections_make_an_exact_hammerstein_system() {
    let (g6, step) = (0.5, 0.05);
    let mut parameters = space_arm(JointKind::Nonlinear);
    for joint in &mut parameters.joints {
        joint.friction = Some(Friction([0.0, 0.0, 0.0, 0.0, 0.0, g6]));
    }
    for free in [0, 1] {
        let mut parameters = parameters;
        parameters.joints[1 - free].locked = true;
        let arm = Arm::new(parameters).unwrap();
        let mut options = SimulationOptions::new(20.0, step).unwrap();
        options.initial.q = [0.3, 0.7];
        options.initial.qm = options.initial.q;
        let d = flexure::signal::white_uniform(options.sampling.rows(), 0.1, 4).unwrap();
        let record = simulate(&arm, &Drive::Deflection([&d, &d]), &options).unwrap();
        let mass = arm.link_dynamics().inertia(0.7)[free][free];
        let pole = (-g6 * step / mass).exp();
        let v = record.column(["dq1", "dq2"][free]).unwrap();
        let tau = record.column(["tau1", "tau2"][free]).unwrap();
        let [q, qm] = [["q1", "qm1"], ["q2", "qm2"]][free].map(|n| record.column(n).unwrap());
        let mut exact = 0.0;
        for k in 0..v.len() {
            assert!((v[k] - exact).abs() < 1e-9, "sample {k}: {} {exact}", v[k]);
            let kappa = arm.stiffness()[free].torque(d[k]);
            let acceleration = (kappa - g6 * v[k]) / mass;
            assert!((tau[k] - (acceleration + kappa)).abs() < 1e-9); // Jm = 1
            assert!((qm[k] - q[k] - d[k]).abs() < 1e-15);
            exact = pole * exact + (1.0 - pole) / g6 * kappa;
        }
    }
}

#[test]
fn commanded_deflections_agree_with_the_torques_they_need() {
    // A constant deflection: driving by the torque it needs, as a function of time, keeps it.
    let mut parameters = space_arm(JointKind::Nonlinear);
    parameters.joints[0].motor_friction = Some(Friction([0.0, 0.0, 0.0, 1.0, 20.0, 0.3]));
    let arm = Arm::new(parameters).unwrap();
    let mut options = SimulationOptions::new(2.0, 0.001).unwrap();
    options.initial = State {
        q: [0.0, 0.5],
        qm: [0.01, 0.49],
        ..State::default()
    };
    let d = [0.01, -0.01].map(|v| vec![v; options.sampling.rows()]);
    let commanded = simulate(&arm, &Drive::Deflection([&d[0], &d[1]]), &options).unwrap();
    let tau = ["tau1", "tau2"].map(|n| commanded.column(n).unwrap().to_vec());
    let interpolate = |t: f64| {
        let k = ((t / 0.001) as usize).min(tau[0].len() - 2);
        let share = t / 0.001 - k as f64;
        [0, 1].map(|i| tau[i][k] + share * (tau[i][k + 1] - tau[i][k]))
    };
    options.tolerances.rtol = 1e-7;
    options.tolerances.atol = 1e-9;
    let driven = simulate(&arm, &Drive::Torque(&interpolate), &options).unwrap();
    let last = options.sampling.rows() - 1;
    let error = difference(&row(&commanded, last), &row(&driven, last));
    assert!(error < 1e-4, "{error}");
}

#[test]
fn a_batch_is_the_same_for_any_number_of_threads() {
    let seeds: Vec<u64> = (0..12).collect();
    let arm = arm(JointKind::Nonlinear);
    let options = bent(1.0, 0.01);
    let job = |seed: &u64| {
        let u = flexure::signal::white_uniform(options.sampling.rows(), 30.0, *seed).unwrap();
        simulate(&arm, &Drive::Held([&u, &u]), &options).unwrap()
    };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| batch(&seeds, job))
    };
    assert_eq!(with(1), with(2));
    assert_eq!(with(1), seeds.iter().map(job).collect::<Vec<_>>());
}

#[test]
fn failures_say_when_and_why_and_nothing_hangs() {
    let mut options = bent(10.0, 1.0);
    let zeros = vec![0.0; 11];
    let still = Drive::Held([&zeros, &zeros]);

    // Viscous friction so great that the equations are stiff.
    let mut steep = space_arm(JointKind::Nonlinear);
    steep.joints[0].friction = Some(Friction([0.0, 0.0, 0.0, 0.0, 0.0, 1e7]));
    options.tolerances.max_steps = 20_000;
    let message = simulate(&Arm::new(steep).unwrap(), &Drive::Torque(&chirp), &options)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("20000 steps were not enough (the equations are stiff"),
        "{message}"
    );

    // A torque that is not finite from some time on.
    let broken = |t: f64| [if t < 0.35 { 1.0 } else { f64::NAN }, 0.0];
    match simulate(&arm(JointKind::Linear), &Drive::Torque(&broken), &options).unwrap_err() {
        Error::Simulation(SimulationError { time, .. }) => assert!(time > 0.2 && time < 0.36, "{time}"),
        other => panic!("{other}"),
    }

    // Stopped from outside.
    let mut calls = 0;
    let result = simulate_watched(&arm(JointKind::Linear), &still, &options, &mut |t| {
        calls += 1;
        if t >= 2.0 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    assert_eq!(result.unwrap_err(), Error::Stopped(Stopped::Simulating { time: 2.0 }));
    assert_eq!(calls, 2);

    // Samples that do not fit.
    let few = simulate(&arm(JointKind::Linear), &Drive::Held([&zeros, &zeros[1..]]), &options).unwrap_err();
    assert!(few.to_string().contains("'tau2' has 10 samples where 11"), "{few}");
    let mut holed = zeros.clone();
    holed[3] = f64::NAN;
    let nan = simulate(&arm(JointKind::Linear), &Drive::Held([&holed, &zeros]), &options).unwrap_err();
    assert!(nan.to_string().contains("'tau1' is NaN at sample 3"), "{nan}");

    // What makes no sense to simulate.
    let rigid = simulate(&arm(JointKind::Rigid), &Drive::Deflection([&zeros, &zeros]), &options).unwrap_err();
    assert_eq!(rigid, Error::Arm(ArmError::RigidDeflection));
    let mut locked = space_arm(JointKind::Linear);
    locked.joints[1].locked = true;
    options.initial.dqm[1] = 1.0;
    let moving = simulate(&Arm::new(locked).unwrap(), &still, &options).unwrap_err();
    assert!(
        moving.to_string().contains("initial dqm2 is 1, but must be 0"),
        "{moving}"
    );
    options.initial.dqm[1] = 0.0;
    options.tolerances.rtol = 0.0;
    let tolerance = simulate(&arm(JointKind::Linear), &still, &options).unwrap_err();
    assert!(tolerance.to_string().contains("rtol is 0"), "{tolerance}");
}

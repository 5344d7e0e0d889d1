use super::*;
use crate::control::{Controller, Exact, JointMoves, LoopOptions, Measured, Trajectory, run_loop};
use crate::manipulator::{Arm, ArmParameters, Friction, JointKind, State, space_arm};

/// Calls a function at every instant.
struct Watched<C, F>(C, F);

impl<C: Controller, F: FnMut(&C, &Measured, [f64; 2]) + Send> Controller for Watched<C, F> {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let torque = self.0.torque(measured);
        (self.1)(&self.0, measured, torque);
        torque
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

/// On the rigid arm that the law is made for, `1/2 s' M s + 1/2 |parameter error|^2 / rate` never grows (Slotine & Li 1987), except for the
/// effect of sampling: along a run at 1 kHz, at no sample by more than a thousandth of its start.
#[test]
fn the_lyapunov_function_of_the_composite_law_falls() {
    let mut parameters: ArmParameters = space_arm(JointKind::Rigid);
    parameters.parts.friction = true;
    parameters.parts.rotors = true;
    for joint in &mut parameters.joints {
        joint.friction = Some(Friction([0.0, 0.0, 0.0, 2.0, 100.0, 0.5]));
    }
    let plant = Arm::new(parameters).unwrap();
    let mut wrong = parameters;
    wrong.links[1].mass *= 0.7;
    let gains = CompositeGains {
        prediction: 0.0,
        damping: 0.0,
        tracking: [100.0; 3],
        feedback: [350.0, 60.0],
        ..CompositeGains::space_arm()
    };
    let links = plant.link_dynamics();
    let truth = [links.shoulder, links.elbow, links.coupling, 2.0, 0.5, 2.0, 0.5];
    let mut values = Vec::new();
    let lyapunov = |law: &Composite, measured: &Measured, _: [f64; 2]| {
        let state = &measured.state;
        let s = [0, 1].map(|i| {
            let e = state.q[i] - measured.reference[i].value();
            state.dq[i] - measured.reference[i].derivative(1) + gains.surface * e
        });
        let m = links.inertia(state.q[1]);
        let energy = (m[0][0] + 1.0) * s[0] * s[0] + 2.0 * m[0][1] * s[0] * s[1] + (m[1][1] + 1.0) * s[1] * s[1];
        let error: f64 = law.estimate().iter().zip(truth).map(|(p, t)| (p - t).powi(2)).sum();
        values.push(0.5 * energy + 0.5 * error / gains.tracking[0]);
    };
    let law = Composite::new(&Arm::new(wrong).unwrap(), gains).unwrap();
    let moves = JointMoves::new(&[[0.0, 0.5], [1.0, 1.5], [0.2, 1.0]], 3.0, 0.0).unwrap();
    let options = LoopOptions::new(8.0, 0.001).unwrap();
    run_loop(&plant, &mut Watched(law, lyapunov), &mut Exact, &moves, &options).unwrap();
    let worst = values.windows(2).map(|v| v[1] - v[0]).fold(0.0, f64::max);
    assert!(worst < 1e-3 * values[0], "{worst} of {}", values[0]);
    assert!(values[values.len() - 1] < values[0]);
}

/// The adaptation of the reference's gains stores the energy that the error supplies, except for the squares of its steps. The stability of
/// the direct law follows from this passivity.
#[test]
fn the_adaptation_of_the_direct_law_is_passive() {
    let arm = Arm::new(space_arm(JointKind::Nonlinear)).unwrap();
    let gains = AdaptiveGains {
        leakage: 0.0,
        ..AdaptiveGains::space_arm()
    };
    let step = 0.01;
    let (mut supplied, mut squares, mut stored) = (0.0, 0.0, 0.0);
    let mut held = [[0.0; 3]; 2];
    let supply = |law: &DirectAdaptive, measured: &Measured, _: [f64; 2]| {
        for (i, (_, k)) in law.adapted().into_iter().enumerate() {
            let (wanted, state) = (measured.reference[i], &measured.state);
            let surface = wanted.derivative(1) - state.dq[i] + gains.surface * (wanted.value() - state.q[i]);
            let model = [
                wanted.derivative(2),
                wanted.derivative(1),
                (wanted.shifted(gains.lead).derivative(1) / 0.01).tanh(),
            ];
            supplied += step * surface * held[i].iter().zip(model).map(|(k, x)| k * x).sum::<f64>();
            let rate = gains.reference_rates[i];
            squares += k.iter().zip(held[i]).map(|(k, l)| 0.5 * (k - l).powi(2)).sum::<f64>() / rate;
            held[i] = k;
        }
        let energy = |k: &[f64; 3], rate: f64| 0.5 * k.iter().map(|k| k * k).sum::<f64>() / rate;
        stored = held
            .iter()
            .zip(gains.reference_rates)
            .map(|(k, rate)| energy(k, rate))
            .sum();
    };
    let moves = JointMoves::new(&[[0.0, 0.5], [1.0, 1.5], [0.2, 1.0]], 4.0, 0.0).unwrap();
    let options = LoopOptions::new(9.0, step).unwrap();
    let law = DirectAdaptive::new(&arm, gains).unwrap();
    run_loop(&arm, &mut Watched(law, supply), &mut Exact, &moves, &options).unwrap();
    assert!(
        (stored - supplied - squares).abs() < 1e-9 * stored,
        "{stored} {supplied} {squares}"
    );
    assert!(squares < 0.1 * stored, "{squares} of {stored}");
}

#[test]
fn lqg_brings_the_arm_to_the_reference_from_the_motors_encoders() {
    let arm = Arm::new(space_arm(JointKind::Nonlinear)).unwrap();
    let moves = JointMoves::new(&[[0.0, 0.5], [1.0, 1.5]], 4.0, 0.0).unwrap();
    let options = LoopOptions {
        initial_spread: [0.01, 0.0],
        ..LoopOptions::new(10.0, 0.01).unwrap()
    };
    let mut law = Lqg::new(arm, Weights::default(), 0.01).unwrap();
    let run = run_loop(&arm, &mut law, &mut Exact, &moves, &options).unwrap();
    let error = |k: usize| {
        (0..2)
            .map(|i| (run.truth[k].q[i] - run.reference[k][i]).abs())
            .fold(0.0, f64::max)
    };
    assert!(
        error(0) > 2e-3 && error(1000) < 0.1 * error(0),
        "{} {}",
        error(0),
        error(1000)
    );
}

/// PD as a linear system is PD.
#[test]
fn a_linear_system_of_gains_alone_is_a_servo() {
    let arm = Arm::new(space_arm(JointKind::Nonlinear)).unwrap();
    let gains = [400.0, 0.0, 30.0, 0.0, 0.0, 300.0, 0.0, 20.0];
    let mut system = LinearSystem::new(Some(arm), &[], &[], &[], &gains).unwrap();
    let mut servo = Feedforward::new(arm, Gains::new([400.0, 300.0], [30.0, 20.0]).unwrap());
    let measured = Measured {
        t: 0.1,
        sample_time: 0.01,
        state: State {
            q: [0.1, 0.2],
            qm: [0.12, 0.25],
            dq: [0.3, 0.0],
            dqm: [0.1, -0.2],
        },
        encoders: Default::default(),
        reference: JointMoves::new(&[[0.0, 0.5], [1.0, 1.5]], 4.0, 0.0).unwrap().at(0.1),
    };
    let [a, b] = [system.torque(&measured), servo.torque(&measured)];
    assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
    assert!(LinearSystem::new(None, &[1.0], &[1.0], &[1.0, 2.0], &[1.0; 4]).is_err());
}

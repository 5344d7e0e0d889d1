//! Chains with motors against the two-link arm, their limits, and what no motion may change.

use proptest::prelude::*;

use super::tests::{Draw, close, planar, tree};
use super::*;
use crate::linalg;
use crate::manipulator::{Arm, ArmParameters, Friction, JointKind, JointParameters, Parts, space_arm};

const COUPLINGS: [RotorCoupling; 3] = [RotorCoupling::None, RotorCoupling::Inertial, RotorCoupling::Complete];

/// A chain of the arm's links, in a plane.
pub(super) fn of_arm(arm: &ArmParameters, coupling: RotorCoupling) -> DrivenChain {
    let drives = arm.joints.map(|joint| ChainDrive {
        kind: arm.model,
        joint,
        gear_ratio: 1.0,
        passive: false,
    });
    DrivenChain::new(Chain::new(&planar(&arm.links)).unwrap(), &drives, coupling).unwrap()
}

#[test]
fn two_planar_links_are_the_two_link_arm_in_every_kind() {
    for kind in [JointKind::Rigid, JointKind::Linear, JointKind::Nonlinear] {
        for coupling in COUPLINGS {
            let mut parameters = space_arm(kind);
            parameters.joints[0].motor_friction = Some(Friction([0.3, 90.0, 20.0, 0.4, 70.0, 0.2]));
            parameters.joints[1].damping = 3.0;
            parameters.parts = Parts {
                friction: true,
                coupling: coupling != RotorCoupling::None,
                rotor_in_link_inertia: coupling == RotorCoupling::Complete,
                rotors: true,
                ..parameters.parts
            };
            let arm = Arm::new(parameters).unwrap();
            let chain = of_arm(&parameters, coupling);
            let (mut data, draw) = (chain.data(), &mut Draw(1));
            for _ in 0..200 {
                let (q, v, tau) = (draw.vector(2), draw.vector(2), draw.vector(2));
                let (qm, vm) = ([q[0] + 0.05 * draw.next(), q[1] - 0.05 * draw.next()], draw.vector(2));
                let want = match kind {
                    JointKind::Rigid => arm
                        .rigid_derivative(&[q[0], q[1], v[0], v[1]], [tau[0], tau[1]])
                        .to_vec(),
                    _ => arm
                        .derivative(&[q[0], q[1], qm[0], qm[1], v[0], v[1], vm[0], vm[1]], [tau[0], tau[1]])
                        .to_vec(),
                };
                let x = match kind {
                    JointKind::Rigid => [&q[..], &v].concat(),
                    _ => [&q[..], &qm, &v, &vm].concat(),
                };
                let mut got = vec![0.0; x.len()];
                chain.derivative(&mut data, &x, &tau, &mut got).unwrap();
                assert!(close(&got, &want, 1e-12), "{kind:?} {coupling:?}: {got:?} {want:?}");
                if kind != JointKind::Rigid {
                    let state = crate::manipulator::State::from_array(std::array::from_fn(|i| x[i]));
                    let energy = chain.energy(&mut data, &chain.state(&x).unwrap()).unwrap();
                    let (got, want) = (energy.kinetic + energy.potential, arm.energy(&state));
                    assert!((got - want).abs() < 1e-12 * want.abs(), "{got} {want}");
                }
            }
        }
    }
}

/// Drives of all kinds, one a joint.
pub(super) fn random_drives(draw: &mut Draw, joints: usize, with_friction: bool) -> Vec<ChainDrive> {
    let kinds = [JointKind::Rigid, JointKind::Linear, JointKind::Nonlinear];
    (0..joints)
        .map(|i| {
            let mut positive = || 0.1 + draw.next().abs();
            let friction = with_friction.then(|| Friction([positive(), 9.0, 2.0, positive(), 5.0, positive()]));
            ChainDrive {
                kind: kinds[(i + (10.0 * positive()) as usize) % 3],
                joint: JointParameters {
                    motor_inertia: 0.02 * positive(),
                    stiffness: 20.0 * positive(),
                    cubic: 9.0 * positive(),
                    linear: 20.0 * positive() + 2.0,
                    windup: positive(),
                    windup_sharpness: 4.0 * positive(),
                    damping: if with_friction { positive() } else { 0.0 },
                    friction,
                    motor_friction: friction,
                    locked: false,
                },
                gear_ratio: 0.5 + 3.0 * positive(),
                passive: false,
            }
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn the_energy_changes_by_the_power_of_the_motors_and_a_free_base_keeps_its_momentum(
        seed: u64, links in 1usize..6, free: bool, which in 0usize..3, with_friction: bool,
    ) {
        let parameters = ChainParameters {
            gravity: if free { [0.0; 3] } else { [0.0, 2.0, -9.0] },
            ..tree(seed, links, if free { Base::Free } else { Base::Fixed })
        };
        let draw = &mut Draw(seed ^ 9);
        let chain = Chain::new(&parameters).unwrap();
        let drives = random_drives(draw, chain.joints().len(), with_friction);
        let chain = DrivenChain::new(chain, &drives, COUPLINGS[which]).unwrap();
        let (mut data, n, first) = (chain.data(), chain.chain().velocities(), chain.chain().first());
        let x = draw.vector(chain.dimension());
        let mut tau = draw.vector(n);
        tau[..first].fill(0.0);
        let mut rate = x.clone();
        chain.derivative(&mut data, &x, &tau, &mut rate).unwrap();

        let h = 1e-5;
        let mut at = |h: f64| {
            let moved: Vec<f64> = x.iter().zip(&rate).map(|(x, r)| x + h * r).collect();
            let state = chain.state(&moved).unwrap();
            let energy = chain.energy(&mut data, &state).unwrap();
            let momentum = chain.centroidal_momentum(&mut data, &state).unwrap();
            ([momentum.linear, momentum.angular].concat(), energy.kinetic + energy.potential)
        };
        let ((before, less), (after, more)) = (at(-h), at(h));
        let state = chain.state(&x).unwrap();
        let (mut motors, mut power) = (state.motor_v.iter(), 0.0);
        for (i, drive) in drives.iter().enumerate() {
            let v = state.v[first + i];
            let vm = if drive.kind == JointKind::Rigid { v } else { *motors.next().unwrap() };
            let torque = |f: Option<Friction>, v: f64| f.map_or(0.0, |f| f.torque(v));
            power += tau[first + i] * vm - torque(drive.joint.friction, v) * v - torque(drive.joint.motor_friction, vm) * vm;
            if drive.kind != JointKind::Rigid {
                power -= drive.joint.damping * (vm - v).powi(2);
            }
        }
        let got = (more - less) / (2.0 * h);
        let scale = rate.iter().fold(1.0f64, |m, r| m.max(r.abs())).powi(2);
        prop_assert!((got - power).abs() < 1e-7 * scale, "{got} {power}");
        if free {
            let largest = before.iter().fold(1.0f64, |m, b| m.max(b.abs()));
            let drift = before.iter().zip(&after).map(|(a, b)| (b - a).abs() / (2.0 * h));
            prop_assert!(drift.fold(0.0, f64::max) < 1e-7 * scale * largest, "{before:?} {after:?}");
        }
    }

    /// Where springs are so deflected that the motors follow the links, links move as with rigid joints, however stiff the springs are.
    #[test]
    fn joints_that_do_not_give_are_rigid(seed: u64, links in 1usize..6, free: bool, which in 0usize..3, exponent in 0i32..9) {
        let base = if free { Base::Free } else { Base::Fixed };
        let chain = Chain::new(&tree(seed, links, base)).unwrap();
        let draw = &mut Draw(seed ^ 9);
        let (n, first, joints) = (chain.velocities(), chain.first(), chain.joints().len());
        let stiffness = 10f64.powi(exponent);
        let of = |kind, draws: &[ChainDrive]| {
            let drives: Vec<_> = draws.iter().map(|d| ChainDrive {
                kind,
                joint: JointParameters { stiffness, damping: 0.0, ..d.joint },
                ..*d
            }).collect();
            DrivenChain::new(chain.clone(), &drives, COUPLINGS[which]).unwrap()
        };
        let drives = random_drives(draw, joints, true);
        let (rigid, flexible) = (of(JointKind::Rigid, &drives), of(JointKind::Linear, &drives));
        let (q, v, tau) = (draw.vector(chain.positions()), draw.vector(n), draw.vector(n));
        let (mut data, mut want) = (rigid.data(), vec![0.0; n]);
        let state = DrivenState { q: &q, v: &v, motor_q: &[], motor_v: &[] };
        rigid.accelerations(&mut data, &state, &tau, &mut want, &mut []).unwrap();

        let links_q = &q[chain.positions() - joints..];
        let mut flexed = |torque: &[f64]| {
            let motor_q: Vec<f64> = links_q.iter().zip(torque).map(|(q, t)| q + t / stiffness).collect();
            let state = DrivenState { q: &q, v: &v, motor_q: &motor_q, motor_v: &v[first..] };
            let (mut a, mut am) = (vec![0.0; n], vec![0.0; joints]);
            flexible.accelerations(&mut data, &state, &tau, &mut a, &mut am).unwrap();
            (a, am)
        };
        // Accelerations are affine in the springs' torques: those with which motors and links accelerate alike.
        let lag = |(a, am): (Vec<f64>, Vec<f64>)| -> Vec<f64> { am.iter().zip(&a[first..]).map(|(m, a)| m - a).collect() };
        let at_zero = lag(flexed(&vec![0.0; joints]));
        let mut columns = vec![0.0; joints * joints];
        for k in 0..joints {
            let mut unit = vec![0.0; joints];
            unit[k] = 1.0;
            for (i, value) in lag(flexed(&unit)).into_iter().enumerate() {
                columns[i * joints + k] = at_zero[i] - value;
            }
        }
        let torque = linalg::least_squares(&columns, joints, &at_zero).unwrap();
        let (a, _) = flexed(&torque);
        // Deflections are differences of positions of size one, and the equations for the torques multiply their rounding.
        let largest = |values: &[f64]| values.iter().fold(0.0f64, |m, c| m.max(c.abs()));
        let inverse = (0..joints).map(|k| {
            let unit: Vec<f64> = (0..joints).map(|i| f64::from(u8::from(i == k))).collect();
            largest(&linalg::least_squares(&columns, joints, &unit).unwrap())
        });
        let condition = joints as f64 * largest(&columns) * inverse.fold(0.0, f64::max);
        let rounding = 1e-15 * stiffness * largest(&columns).max(1.0) + 1e-9;
        prop_assert!(close(&a, &want, condition.max(100.0) * rounding), "{a:?} {want:?}");
    }
}

#[test]
fn bad_drives_are_refused_by_the_joint() {
    type Change = fn(&mut ChainDrive);
    let cases: [(Change, &str); 7] = [
        (|d| d.joint.motor_inertia = 0.0, "motor_inertia of joint 2 is 0 kg m^2"),
        (|d| d.joint.linear = -1.0, "linear of joint 2 is -1 N m/rad"),
        (|d| d.joint.windup = 600.0, "windup of joint 2 is 600 N m/rad"),
        (|d| d.joint.damping = f64::NAN, "damping of joint 2 is NaN"),
        (|d| d.gear_ratio = 0.0, "gear_ratio of joint 2 is 0"),
        (
            |d| d.joint.friction = Some(Friction([-1.0; 6])),
            "friction g1 of joint 2 is -1 N m",
        ),
        (|d| d.joint.locked = true, "locked of joint 2"),
    ];
    let arm = space_arm(JointKind::Nonlinear);
    let chain = Chain::new(&planar(&arm.links)).unwrap();
    for (change, want) in cases {
        let mut drives = arm.joints.map(|joint| ChainDrive {
            kind: arm.model,
            joint,
            gear_ratio: 1.0,
            passive: false,
        });
        change(&mut drives[1]);
        let message = DrivenChain::new(chain.clone(), &drives, RotorCoupling::None)
            .unwrap_err()
            .to_string();
        assert!(message.starts_with(want), "{message}");
        assert!(DrivenChain::new(chain.clone(), &drives[..1], RotorCoupling::None).is_err());
    }
}

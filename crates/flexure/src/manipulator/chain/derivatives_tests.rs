//! Derivatives against differences of what they are derivatives of, and modes against the two-link arm's.

use proptest::prelude::*;

use super::drives_tests::{of_arm, random_drives};
use super::tests::{Draw, close, tree};
use super::*;
use crate::manipulator::{Arm, JointKind, Parts, space_arm};

/// The step of central differences, about the cube root of the rounding error.
const STEP: f64 = 1e-5;

/// The position after a small motion along the direction `k` of the velocity.
fn moved(chain: &Chain, q: &[f64], k: usize, h: f64) -> Vec<f64> {
    let mut q = q.to_vec();
    let Some(k) = (match chain.base() {
        Base::Fixed => Some(k),
        Base::Free => k.checked_sub(6).map(|joint| joint + 7),
    }) else {
        let mut data = chain.data();
        chain.place(&mut data, &q).unwrap();
        let mut unit = [0.0; 6];
        unit[k] = 1.0;
        let way = data.base.placement.rotation * super::vector::Vec3::from_slice(&unit);
        for (value, step) in q.iter_mut().zip(way.to_array()) {
            *value += h * step;
        }
        let [x, y, z, w] = [q[3], q[4], q[5], q[6]];
        let [a, b, c] = [0.5 * h * unit[3], 0.5 * h * unit[4], 0.5 * h * unit[5]];
        q[3] += w * a + y * c - z * b;
        q[4] += w * b + z * a - x * c;
        q[5] += w * c + x * b - y * a;
        q[6] += -x * a - y * b - z * c;
        return q;
    };
    q[k] += h;
    q
}

/// By rows, the central differences of a function of the change along the direction k.
fn differences(n: usize, mut of: impl FnMut(usize, f64) -> Vec<f64>) -> Vec<f64> {
    let mut rows = vec![0.0; n * n];
    for k in 0..n {
        let (ahead, behind) = (of(k, STEP), of(k, -STEP));
        for i in 0..n {
            rows[i * n + k] = (ahead[i] - behind[i]) / (2.0 * STEP);
        }
    }
    rows
}

/// Whether derivatives are these central differences of values of this size, up to a relative tolerance and to the differences' rounding.
fn near(found: &[f64], differences: &[f64], tolerance: f64, values: &[f64]) -> bool {
    let size = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // The sums behind a value have more terms than one, and these may be larger than the value.
    let rounding = 10.0 * f64::EPSILON * size(values).max(1.0) / STEP;
    let allowed = tolerance * size(differences) + rounding;
    found.len() == differences.len() && found.iter().zip(differences).all(|(a, b)| (a - b).abs() <= allowed)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn derivatives_are_the_limits_of_differences(seed: u64, links in 1usize..8, free: bool) {
        let chain = Chain::new(&tree(seed, links, if free { Base::Free } else { Base::Fixed })).unwrap();
        let (mut data, n) = (chain.data(), chain.velocities());
        let draw = &mut Draw(seed ^ 99);
        let (q, v, a) = (draw.vector(chain.positions()), draw.vector(n), draw.vector(n));
        let (mut by_q, mut by_v) = (vec![0.0; n * n], vec![0.0; n * n]);
        chain.inverse_dynamics_derivatives(&mut data, &q, &v, &a, &mut by_q, &mut by_v).unwrap();
        let mut torques = |q: &[f64], v: &[f64]| {
            let mut tau = vec![0.0; n];
            chain.inverse_dynamics(&mut data, q, v, &a, &mut tau).unwrap();
            tau
        };
        let along = |k: usize, h: f64| {
            let mut changed = v.clone();
            changed[k] += h;
            changed
        };
        let tau = torques(&q, &v);
        let want = differences(n, |k, h| torques(&moved(&chain, &q, k, h), &v));
        prop_assert!(near(&by_q, &want, 1e-7, &tau), "{by_q:?} {want:?}");
        let want = differences(n, |k, h| torques(&q, &along(k, h)));
        prop_assert!(near(&by_v, &want, 1e-7, &tau), "{by_v:?} {want:?}");

        let found = chain.forward_dynamics_derivatives(&mut data, &q, &v, &tau).unwrap();
        let mut accelerations = |q: &[f64], v: &[f64], tau: &[f64]| {
            let mut a = vec![0.0; n];
            chain.forward_dynamics(&mut data, q, v, tau, &mut a).unwrap();
            a
        };
        let want = differences(n, |k, h| accelerations(&moved(&chain, &q, k, h), &v, &tau));
        prop_assert!(close(&found.by_position, &want, 1e-6), "{found:?} {want:?}");
        let want = differences(n, |k, h| accelerations(&q, &along(k, h), &tau));
        prop_assert!(close(&found.by_velocity, &want, 1e-6), "{found:?} {want:?}");
        let want = differences(n, |k, h| {
            let mut changed = tau.clone();
            changed[k] += h;
            accelerations(&q, &v, &changed)
        });
        prop_assert!(close(&found.by_torque, &want, 1e-6), "{found:?} {want:?}");
    }

    /// M and K of the linearised chain give the accelerations of the equations of motion near rest.
    #[test]
    fn near_rest_a_chain_moves_as_its_equations_say(seed: u64, links in 1usize..6, free: bool, kind in 0usize..3) {
        let coupling = [RotorCoupling::None, RotorCoupling::Inertial, RotorCoupling::Complete][kind];
        let base = if free { Base::Free } else { Base::Fixed };
        let gravity = if free { [0.0; 3] } else { [0.3, -0.5, -9.81] };
        let chain = Chain::new(&ChainParameters { gravity, ..tree(seed, links, base) }).unwrap();
        let draw = &mut Draw(seed ^ 3);
        let drives = random_drives(draw, chain.joints().len(), false);
        let chain = DrivenChain::new(chain, &drives, coupling).unwrap();
        let q = draw.vector(chain.chain().positions());
        let mut data = chain.data();
        let near = chain.linearised(&mut data, &q).unwrap();
        // Where the springs hold the links against gravity, the motors against the springs.
        let (n, first) = (chain.chain().velocities(), chain.chain().velocities() - drives.len());
        let rest = vec![0.0; n];
        let mut hold = rest.clone();
        chain.chain().inverse_dynamics(&mut data.chain, &q, &rest, &rest, &mut hold).unwrap();
        let flexible = chain.flexible();
        let motors: Vec<usize> = (0..drives.len()).filter(|i| flexible[*i]).collect();
        let joints = &q[q.len() - drives.len()..];
        let motor_q: Vec<f64> = motors
            .iter()
            .map(|&i| {
                let stiffness = match drives[i].kind {
                    JointKind::Linear => hold[first + i] / drives[i].joint.stiffness,
                    _ => drives[i].joint.nonlinear_stiffness().deflection(hold[first + i]).unwrap(),
                };
                joints[i] + stiffness
            })
            .collect();
        let change = |k: usize, h: f64| {
            let (mut q, mut motor_q) = (q.clone(), motor_q.clone());
            match k.checked_sub(n) {
                Some(motor) => motor_q[motor] += h,
                None => q = moved(chain.chain(), &q, k, h),
            }
            let state = DrivenState { q: &q, v: &rest, motor_q: &motor_q, motor_v: &vec![0.0; motor_q.len()] };
            let (mut a, mut am) = (vec![0.0; n], vec![0.0; motor_q.len()]);
            chain.accelerations(&mut chain.data(), &state, &hold, &mut a, &mut am).unwrap();
            [a, am].concat()
        };
        let all = near.dimension;
        let still = change(0, 0.0);
        prop_assert!(still.iter().all(|a| a.abs() < 1e-8), "{still:?}");
        let slopes = differences(all, change);
        let through: Vec<f64> = (0..all * all)
            .map(|at| (0..all).map(|k| near.mass[at / all * all + k] * slopes[k * all + at % all]).sum::<f64>())
            .collect();
        let want: Vec<f64> = near.stiffness.iter().map(|k| -k).collect();
        prop_assert!(close(&through, &want, 1e-5), "{through:?} {want:?}");
    }
}

#[test]
fn two_links_vibrate_as_the_two_link_arm() {
    for coupling in [RotorCoupling::None, RotorCoupling::Inertial] {
        let mut parameters = space_arm(JointKind::Nonlinear);
        parameters.joints[1].damping = 3.0;
        parameters.parts = Parts {
            friction: true,
            coupling: coupling != RotorCoupling::None,
            rotor_in_link_inertia: false,
            rotors: true,
            ..parameters.parts
        };
        let (arm, chain) = (Arm::new(parameters).unwrap(), of_arm(&parameters, coupling));
        for elbow in [0.2, 1.3, 2.9] {
            let near = chain.linearised(&mut chain.data(), &[0.4, elbow]).unwrap();
            let modes = near.modes(Motors::Free).unwrap();
            let found: Vec<f64> = modes.iter().map(|mode| mode.square.sqrt()).collect();
            let want = [vec![0.0; 2], arm.modal_frequencies(elbow, [0.0; 2])].concat();
            assert!(close(&found, &want, 1e-9), "{found:?} {want:?}");
            assert!(modes[0].frequency().is_none() && modes[0].damping_ratio == 0.0);
            assert!(modes[3].damping_ratio > 0.0);
            // With brakes on, the links vibrate on their springs alone.
            let held = near.modes(Motors::Held).unwrap();
            let inertia = arm.link_dynamics().inertia(elbow);
            let k = [0, 1].map(|i| arm.stiffness()[i].tangent(0.0));
            let determinant = inertia[0][0] * inertia[1][1] - inertia[0][1] * inertia[1][0];
            let (sum, product) = (held[0].square + held[1].square, held[0].square * held[1].square);
            let want = (k[0] * inertia[1][1] + k[1] * inertia[0][0]) / determinant;
            assert!((sum / want - 1.0).abs() < 1e-12 && (product * determinant / (k[0] * k[1]) - 1.0).abs() < 1e-12);
            assert_eq!(held[0].shape[2..], [0.0; 2]);
        }
    }
}

#[test]
fn a_pendulum_swings_below_and_falls_above() {
    let mut parameters = ChainPreset::SixJointArm.parameters();
    parameters.links.truncate(2);
    let chain = DrivenChain::new(Chain::new(&parameters).unwrap(), &[], RotorCoupling::None).unwrap();
    let modes = |elbow: f64| {
        let near = chain.linearised(&mut chain.data(), &[0.0, elbow]).unwrap();
        near.modes(Motors::Free).unwrap()
    };
    let squares: Vec<Vec<f64>> = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        .map(|elbow| modes(elbow).iter().map(|mode| mode.square).collect())
        .to_vec();
    let lowest = squares.iter().map(|s| s[0]).fold(f64::INFINITY, f64::min);
    let highest = squares.iter().map(|s| s[1]).fold(0.0, f64::max);
    assert!(lowest < -1.0 && highest > 1.0, "{squares:?}");
    let free = Chain::new(&tree(1, 3, Base::Free)).unwrap();
    let falling = DrivenChain::new(free, &[], RotorCoupling::None).unwrap();
    let refused = falling.linearised(&mut falling.data(), &falling.chain().neutral());
    assert!(refused.unwrap_err().to_string().contains("the base falls"));
}

//! Flexible arms: against rigid chains, and what no motion may change.

use super::*;
use crate::linalg;
use crate::manipulator::chain::{ChainPreset, ChainSimulation, DrivenChain, chain_columns, simulate_chain};
use crate::manipulator::{JointKind, JointParameters, space_arm};

pub(super) const BEAM: Beam = Beam {
    length: 2.0,
    stiffness: 300.0,
    density: 0.7,
    damping: 0.0,
};
/// The two-link space arm, its links massless but for beams and what the closure adds.
pub(super) fn two_links(base: Base, change: impl Fn(&mut ChainParameters)) -> ChainParameters {
    let mut arm = ChainPreset::FreeSpaceArm.parameters();
    for (i, link) in arm.links.iter_mut().enumerate() {
        link.inertia = None;
        link.translation = [if i == 0 { 0.6 } else { BEAM.length }, 0.0, 0.0];
    }
    arm.base = base;
    change(&mut arm);
    arm
}

/// A fixed joint and one link.
fn clamped(arm: &mut ChainParameters) {
    arm.links.truncate(1);
    arm.links[0].motion = JointMotion::Fixed;
}

/// A body that a beam carries at its tip.
pub(super) fn load(arm: &mut ChainParameters, mass: f64, inertia: f64) {
    let carrier = arm.links.len() - 1;
    arm.links.push(ChainLink {
        name: "load".to_owned(),
        joint: "load".to_owned(),
        parent: Some(carrier),
        motion: JointMotion::Fixed,
        translation: [BEAM.length, 0.0, 0.0],
        inertia: Some(LinkInertia {
            mass,
            com: [0.0; 3],
            matrix: [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { inertia } else { 0.0 })),
        }),
        ..arm.links[carrier].clone()
    });
}

pub(super) fn beam(link: usize, functions: ShapeFunctions) -> FlexibleBeam {
    FlexibleBeam {
        link,
        beam: BEAM,
        along: [1.0, 0.0, 0.0],
        axial_stiffness: None,
        functions,
    }
}

fn nonlinear() -> [ChainDrive; 2] {
    space_arm(JointKind::Nonlinear).joints.map(|joint| ChainDrive {
        kind: JointKind::Nonlinear,
        joint: JointParameters {
            friction: None,
            motor_friction: None,
            ..joint
        },
        ..ChainDrive::default()
    })
}

/// A bent state that moves.
fn state(arm: &FlexibleArm) -> Vec<f64> {
    let half = arm.dimension() / 2;
    let elastic = arm.first() + 2..arm.coordinates();
    let value = |k: usize| {
        let size = if elastic.contains(&(k % half)) { 0.02 } else { 0.7 };
        size * (1.0 + 1.7 * k as f64).sin()
    };
    (0..arm.dimension()).map(value).collect()
}

/// Two beams with loads and hubs on a base, with and without a stretch.
fn full(base: Base, functions: ShapeFunctions, stretch: bool, drives: &[ChainDrive]) -> FlexibleArm {
    let parameters = two_links(base, |arm| {
        arm.links[1].inertia = Some(LinkInertia {
            mass: 1.5,
            com: [0.05, -0.02, 0.0],
            matrix: [[0.02, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.03]],
        });
        arm.links[1].translation[1] = 0.1;
        load(arm, 2.0, 0.05);
        if let Some(base) = &mut arm.base_inertia {
            base.com = [0.1, 0.2, 0.0];
        }
    });
    let beams = [0, 1].map(|link| FlexibleBeam {
        axial_stiffness: stretch.then_some(4e4),
        ..beam(link, functions)
    });
    FlexibleArm::new(&parameters, drives, &beams).unwrap()
}

#[test]
fn energy_changes_by_the_power_of_torques_and_dampers_and_a_free_base_keeps_its_momentum() {
    for (functions, stretch) in [
        (ShapeFunctions::Elements(3), false),
        (ShapeFunctions::Modes(3), false),
        (ShapeFunctions::Elements(2), true),
    ] {
        let arm = full(Base::Free, functions, stretch, &nonlinear());
        let x = state(&arm);
        let torques = [3.0, -2.0];
        let mut rates = vec![0.0; x.len()];
        arm.derivative(&x, &torques, &mut rates).unwrap();
        let h = 1e-5;
        let at = |h: f64| {
            let moved: Vec<f64> = x.iter().zip(&rates).map(|(x, r)| x + h * r).collect();
            let state = arm.state(&moved).unwrap();
            let energy = arm.energy(&state).unwrap();
            (energy.kinetic + energy.potential, arm.momentum(&state).unwrap())
        };
        let ((less, before), (more, after)) = (at(-h), at(h));
        let now = arm.state(&x).unwrap();
        let power: f64 = torques.iter().zip(now.motor_v).map(|(t, v)| t * v).sum();
        let change = (more - less) / (2.0 * h);
        assert!(
            (change - power).abs() < 1e-5 * (1.0 + more),
            "{functions:?}: {change} {power}"
        );
        for (a, b) in before
            .linear
            .iter()
            .zip(after.linear)
            .chain([(&before.angular, after.angular)])
        {
            assert!(
                (a - b).abs() < 2e-8 * (1.0 + a.abs()),
                "{functions:?}: {before:?} {after:?}"
            );
        }
    }
}

#[test]
fn the_two_link_arm_on_a_free_base_keeps_energy_and_momentum_in_time() {
    for functions in [ShapeFunctions::Elements(2), ShapeFunctions::Modes(2)] {
        let arm = full(Base::Free, functions, false, &nonlinear());
        let mut options = ChainSimulation::from_state(state(&arm), 1.0, 0.25).unwrap();
        options.tolerances.rtol = 1e-12;
        let record = simulate_flexible_arm(&arm, &[], &options).unwrap();
        let names: Vec<&String> = record.names()[3..].iter().take(arm.dimension()).collect();
        let kept = |k: usize| {
            let x: Vec<f64> = names.iter().map(|name| record.column(name).unwrap()[k]).collect();
            let state = arm.state(&x).unwrap();
            let (energy, momentum) = (arm.energy(&state).unwrap(), arm.momentum(&state).unwrap());
            [
                energy.kinetic + energy.potential,
                momentum.linear[0],
                momentum.linear[1],
                momentum.angular,
            ]
        };
        let first = kept(0);
        let size = first.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for k in 1..record.len() {
            for (now, then) in kept(k).iter().zip(first) {
                assert!((now - then).abs() < 1e-9 * size, "{functions:?}, {k}: {now} {then}");
            }
        }
        let tip = record.column("tip_link1").unwrap();
        assert!(tip.iter().any(|w| w.abs() > 0.01), "{tip:?}");
    }
}

/// Without beams, a chain in its plane.
#[test]
fn rigid_links_with_nonlinear_joints_move_as_those_of_a_chain() {
    for base in [Base::Free, Base::Fixed] {
        let parameters = ChainParameters {
            base,
            gravity: if base == Base::Free { [0.0; 3] } else { [1.0, -3.0, 7.0] },
            ..ChainPreset::FreeSpaceArm.parameters()
        };
        let mut drives = nonlinear();
        drives[1].joint.friction = space_arm(JointKind::Nonlinear).joints[1].friction;
        let arm = FlexibleArm::new(&parameters, &drives, &[]).unwrap();
        let chain = Chain::new(&parameters).unwrap();
        let chain = DrivenChain::new(chain, &drives, RotorCoupling::None).unwrap();
        let torque = [vec![4.0; 21], vec![-1.0; 21]];
        let torques = [&torque[0][..], &torque[1][..]];
        let options = ChainSimulation::new(&chain, 2.0, 0.1).unwrap();
        let want = simulate_chain(&chain, &torques, &options).unwrap();
        let options = ChainSimulation::from_state(vec![0.0; arm.dimension()], 2.0, 0.1).unwrap();
        let found = simulate_flexible_arm(&arm, &torques, &options).unwrap();
        assert!(chain_columns(&chain).contains(&"qm_joint2".to_owned()));
        for name in ["q_joint1", "q_joint2", "qm_joint1", "dqm_joint2", "dq_joint2"] {
            let both = found.column(name).unwrap().iter().zip(want.column(name).unwrap());
            let off = both.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(off < 1e-8, "{base:?} {name}: {off:e}");
        }
        assert!(want.column("q_joint1").unwrap()[20].abs() > 1e-3);
    }
}

#[test]
fn gravitys_stiffness_is_the_derivative_of_its_forces() {
    let mut arm = full(Base::Fixed, ShapeFunctions::Elements(2), true, &[]);
    arm.gravity = [2.0, -9.0];
    let n = arm.coordinates();
    let q = &state(&arm)[..n];
    let still = |q: &[f64], gravity: [f64; 2]| arm.assemble(q, &vec![0.0; n], gravity).bias;
    let with = arm.linearised(q).unwrap();
    let mut weightless = arm.clone();
    weightless.gravity = [0.0; 2];
    let without = weightless.linearised(q).unwrap();
    let h = 1e-5;
    for j in 0..n {
        let moved = |h: f64| {
            let mut q = q.to_vec();
            q[j] += h;
            still(&q, arm.gravity)
        };
        for (i, (a, b)) in moved(h).iter().zip(moved(-h)).enumerate() {
            let (slope, at) = ((a - b) / (2.0 * h), i * n + j);
            let found = with.stiffness[at] - without.stiffness[at];
            assert!((slope - found).abs() < 1e-5, "{i} {j}: {slope} {found}");
        }
    }
}

/// A beam keeps its length: the shortening takes as much from x as the slopes add to the arc.
#[test]
fn the_outline_of_a_bent_beam_is_as_long_as_the_straight_one() {
    let parameters = two_links(Base::Fixed, |arm| arm.links.truncate(1));
    for functions in [ShapeFunctions::Elements(3), ShapeFunctions::Modes(3)] {
        let arm = FlexibleArm::new(&parameters, &[], &[beam(0, functions)]).unwrap();
        let mut q = vec![0.0; arm.coordinates()];
        q[0] = 0.4;
        let last = q.len() - 1;
        (q[last - 1], q[last]) = (0.1, 0.03);
        let line = arm.outline(&q, 0, 2001).unwrap();
        let arc: f64 = line
            .windows(2)
            .map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]))
            .sum();
        assert!((arc / BEAM.length - 1.0).abs() < 2e-3, "{arc}");
        let [across, along] = arm.deflections(&q).unwrap()[0].1;
        let tip = turned(0.4, [BEAM.length + along, across]);
        assert!((line[2000][0] - 0.6 - tip[0]).abs() < 1e-12 && (line[2000][1] - tip[1]).abs() < 1e-12);
        assert!(along < -1e-3 && across > 0.05, "{along} {across}");
    }
}

#[test]
fn what_does_not_move_in_the_plane_is_refused_by_the_link() {
    type Change = fn(&mut ChainParameters, &mut FlexibleBeam);
    let cases: [(Change, &str); 9] = [
        (
            |p, _| p.links[1].axis = [0.0, 1.0, 0.0],
            "link 'link2': elements and modes bend in the plane",
        ),
        (
            |p, _| p.links[1].axis = [0.0, 0.0, -1.0],
            "the axis of its joint is not that of z",
        ),
        (
            |p, _| p.links[1].motion = JointMotion::Prismatic,
            "its joint slides; make its beams of segments",
        ),
        (
            |p, _| p.links[1].rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
            "link 'link2': elements and modes bend in the plane of x and y, in which it does not move: its frame is turned",
        ),
        (
            |_, b| b.along = [1.0, 0.0, 0.2],
            "link 'link2': its beam needs a direction",
        ),
        (
            |_, b| b.beam.density = 0.0,
            "link 'link2': the density of its beam, kg/m, is 0",
        ),
        (
            |_, b| b.axial_stiffness = Some(-1.0),
            "link 'link2': the axial stiffness of its beam, N, is -1",
        ),
        (
            |_, b| b.functions = ShapeFunctions::Modes(11),
            "link 'link2': the number of its beam's elements or modes is 11, but must be 1 to 10",
        ),
        (
            |_, b| b.functions = ShapeFunctions::Elements(0),
            "is 0, but must be 1 to 20",
        ),
    ];
    for (change, want) in cases {
        let mut parameters = two_links(Base::Fixed, |_| ());
        let mut beams = [0, 1].map(|link| beam(link, ShapeFunctions::default()));
        change(&mut parameters, &mut beams[1]);
        let message = FlexibleArm::new(&parameters, &[], &beams).unwrap_err().to_string();
        assert!(message.contains(want), "{message}");
    }
    let parameters = two_links(Base::Fixed, |_| ());
    let arm = FlexibleArm::new(&parameters, &[], &[beam(0, ShapeFunctions::default())]);
    // The second link has neither a beam nor a mass.
    assert!(arm.unwrap_err().to_string().contains("link 'link2': it moves, but"));
    let parameters = two_links(Base::Fixed, clamped);
    let arm = FlexibleArm::new(&parameters, &[], &[beam(0, ShapeFunctions::default())]).unwrap();
    assert!(arm.state(&[0.0; 3]).is_err() && arm.mass_matrix(&[0.0; 2]).is_err());
    assert!(arm.momentum(&arm.state(&vec![0.0; arm.dimension()]).unwrap()).is_err());
    assert!(
        linalg::symmetric_eigen(&arm.mass_matrix(&[0.0; 10]).unwrap(), 10)
            .unwrap()
            .values
            .iter()
            .all(|v| *v > 0.0)
    );
}

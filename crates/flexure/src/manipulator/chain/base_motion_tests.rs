//! Bases that are moved: against floating bases that move so, extra joints, a changed gravity, and a conserved quantity.

use proptest::prelude::*;

use super::tests::{Draw, close, tree};
use super::*;
use crate::manipulator::{JointKind, JointParameters};
use crate::simulation::Integrator;

const STEP: f64 = 0.01;

fn motion(rows: usize, pose: impl Fn(f64) -> [f64; 7]) -> BaseMotion {
    let poses: Vec<[f64; 7]> = (0..rows).map(|k| pose(k as f64 * STEP)).collect();
    BaseMotion::new(&poses, STEP).unwrap()
}

/// A flexible drive for every joint, with rotors that act on their carriers.
fn driven(parameters: &ChainParameters, rigid: usize) -> DrivenChain {
    let chain = Chain::new(parameters).unwrap();
    let flexible = ChainDrive {
        kind: JointKind::Linear,
        joint: JointParameters {
            motor_inertia: 0.3,
            stiffness: 200.0,
            ..JointParameters::default()
        },
        gear_ratio: 3.0,
        passive: false,
    };
    let drive = |i: usize| if i < rigid { ChainDrive::default() } else { flexible };
    let drives: Vec<ChainDrive> = (0..chain.joints().len()).map(drive).collect();
    DrivenChain::new(chain, &drives, RotorCoupling::Complete).unwrap()
}

#[test]
fn polynomials_to_the_degree_five_are_kept_with_their_derivatives() {
    let factors = [0.3, -0.7, 1.1, 0.4, -0.9, 0.6];
    // Of 4, 7 and more poses: the degree is below their number.
    for (rows, degree) in [(2, 1), (4, 3), (7, 5), (30, 5)] {
        let at = |t: f64, order: i32| {
            let terms = factors[..=degree].iter().enumerate().filter_map(|(power, factor)| {
                let falling: f64 = (0..order).map(|k| power as f64 - f64::from(k)).product();
                (power as i32 >= order).then(|| factor * falling * t.powi(power as i32 - order))
            });
            terms.sum::<f64>()
        };
        let poses: Vec<[f64; 7]> = (0..rows)
            .map(|k| [0.0, at(0.1 * k as f64, 0), 0.0, 0.0, 0.0, 0.0, -2.0])
            .collect();
        let motion = BaseMotion::new(&poses, 0.1).unwrap();
        for k in 0..=50 {
            let t = 0.1 * (rows - 1) as f64 * f64::from(k) / 50.0;
            let state = motion.at(t);
            let found = [state.pose[1], state.velocity[1], state.acceleration[1]];
            assert!(
                close(&found, &[at(t, 0), at(t, 1), at(t, 2)], 1e-9),
                "{rows} {t}: {found:?}"
            );
        }
    }
}

/// The error that the documentation of the theory states, and that it is not much smaller.
#[test]
fn a_sine_has_the_acceleration_that_its_sampling_allows() {
    for w in [20.0, 40.0, 60.0] {
        let motion = motion(101, |t| [(w * t).sin(), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let errors = (0..800).map(|k| {
            let t = 0.1 + 0.001 * f64::from(k);
            (motion.at(t).acceleration[0] + w * w * (w * t).sin()).abs() / (w * w)
        });
        let (most, x) = (errors.fold(0.0, f64::max), w * STEP);
        let stated = x.powi(4) / 1920.0 + x.powi(5) / 24.0;
        assert!(most < 1.02 * stated && most > 0.3 * stated, "{w}: {most:e} {stated:e}");
    }
}

/// The base's velocity and acceleration are the derivatives of its pose, at any place between the instants.
#[test]
fn a_turning_base_has_the_velocity_and_the_acceleration_of_its_poses() {
    let pose = |t: f64| {
        let (a, b) = (0.9 * (2.0 * t).sin(), 0.4 * (3.0 * t).cos());
        let ((s, c), (u, w)) = ((0.5 * a).sin_cos(), (0.5 * b).sin_cos());
        // About x by a, then about the new z by b; the length and the sign do not matter.
        let sign = if (t / STEP).round() as i64 % 2 == 0 { 3.0 } else { -0.2 };
        [
            t.sin(),
            0.2 * t,
            t * t,
            sign * s * w,
            -sign * s * u,
            sign * c * u,
            sign * c * w,
        ]
    };
    let motion = motion(101, pose);
    for k in 0..90 {
        let t = 0.05 + 0.0097 * f64::from(k);
        let (a_rate, b_rate) = (1.8 * (2.0 * t).cos(), -1.2 * (3.0 * t).sin());
        let (a_bend, b_bend) = (-3.6 * (2.0 * t).sin(), -3.6 * (3.0 * t).cos());
        let (a, (s, c)) = (0.9 * (2.0 * t).sin(), (0.4 * (3.0 * t).cos()).sin_cos());
        let state = motion.at(t);
        let want = [c * a_rate, -s * a_rate, b_rate];
        assert!(close(&state.velocity[3..], &want, 1e-8), "{t}: {state:?} {want:?}");
        let want = [
            c * a_bend - s * b_rate * a_rate,
            -s * a_bend - c * b_rate * a_rate,
            b_bend,
        ];
        assert!(close(&state.acceleration[3..], &want, 1e-6), "{t}: {state:?} {want:?}");
        // R^T v, with R = Rx(a) Rz(b), and its derivative.
        let (sa, ca) = a.sin_cos();
        let own = |v: [f64; 3]| {
            let (y, z) = (ca * v[1] + sa * v[2], ca * v[2] - sa * v[1]);
            [c * v[0] + s * y, c * y - s * v[0], z]
        };
        let linear = own([t.cos(), 0.2, 2.0 * t]);
        assert!(close(&state.velocity[..3], &linear, 1e-8), "{t}: {state:?} {linear:?}");
        let (w, bend) = (&state.velocity[3..], own([-t.sin(), 0.0, 2.0]));
        let want: Vec<f64> = (0..3)
            .map(|i| bend[i] - (w[(i + 1) % 3] * linear[(i + 2) % 3] - w[(i + 2) % 3] * linear[(i + 1) % 3]))
            .collect();
        assert!(close(&state.acceleration[..3], &want, 1e-6), "{t}: {state:?} {want:?}");
    }
}

#[test]
fn accelerations_are_continuous_where_poses_have_noise() {
    let mut draw = Draw(3);
    let poses: Vec<[f64; 7]> = (0..20)
        .map(|_| std::array::from_fn(|i| 0.1 * draw.next() + f64::from(i == 6)))
        .collect();
    let motion = BaseMotion::new(&poses, 0.1).unwrap();
    for k in 1..19 {
        let (before, after) = (
            motion.at(0.1 * f64::from(k) - 1e-9),
            motion.at(0.1 * f64::from(k) + 1e-9),
        );
        assert!(
            close(&before.acceleration, &after.acceleration, 1e-5),
            "{before:?} {after:?}"
        );
        assert!(close(&before.velocity, &after.velocity, 1e-5));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Newton and Euler's recursion on a floating base that moves so needs the same torques.
    #[test]
    fn links_accelerate_as_on_a_floating_base_that_moves_so(seed: u64, links in 1usize..9) {
        let parameters = tree(seed, links, Base::Fixed);
        let chain = driven(&parameters, links);
        let free = Chain::new(&ChainParameters { base: Base::Free, ..parameters }).unwrap();
        let (draw, n) = (&mut Draw(seed ^ 9), chain.chain().velocities());
        let (x, tau) = (draw.vector(2 * n), draw.vector(n));
        let poses: Vec<[f64; 7]> = (0..9).map(|_| std::array::from_fn(|i| 0.1 * draw.next() + 0.5 * f64::from(i > 4))).collect();
        let base = BaseMotion::new(&poses, 0.5).unwrap().at(2.0 + draw.next());
        let (mut data, mut rate) = (chain.data(), vec![0.0; 2 * n]);
        base.carry(&mut data.chain).unwrap();
        chain.derivative(&mut data, &x, &tau, &mut rate).unwrap();
        let (mut work, mut needed) = (free.data(), vec![0.0; n + 6]);
        let (q, v) = ([&base.pose, &x[..n]].concat(), [&base.velocity, &x[n..]].concat());
        free.inverse_dynamics(&mut work, &q, &v, &[&base.acceleration, &rate[n..]].concat(), &mut needed).unwrap();
        // The accelerations of light links may be large.
        prop_assert!(close(&needed[6..], &tau, 1e-9 * (1.0 + rate.iter().fold(0.0, |m, a| a.abs().max(m)))), "{needed:?} {tau:?}");
    }

    /// A joint between the base and the tree that is driven to move so, with flexible joints and rotors behind it.
    #[test]
    fn links_and_motors_accelerate_as_behind_a_joint_that_moves_so(seed: u64, links in 1usize..6, slides: bool) {
        let parameters = tree(seed, links, Base::Fixed);
        let joint = ChainLink {
            name: "table".to_owned(),
            joint: "moved".to_owned(),
            parent: None,
            motion: if slides { JointMotion::Prismatic } else { JointMotion::Revolute },
            axis: [0.0, 0.0, 1.0],
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [0.0; 3],
            inertia: parameters.base_inertia,
            limits: [f64::NEG_INFINITY, f64::INFINITY],
        };
        let behind = parameters.links.iter().cloned().map(|link| ChainLink { parent: Some(link.parent.map_or(0, |p| p + 1)), ..link });
        let behind = ChainParameters { links: std::iter::once(joint).chain(behind).collect(), ..parameters.clone() };
        let (chain, whole) = (driven(&parameters, 0), driven(&behind, 1));
        let (draw, n) = (&mut Draw(seed ^ 4), chain.motors());
        let (x, tau) = (draw.vector(4 * n), draw.vector(n));
        // The base moves by 0.3 t + 0.2 t^2 along or about z.
        let t = 0.15;
        let base = motion(40, |t| {
            let way = 0.3 * t + 0.2 * t * t;
            if slides { [0.0, 0.0, way, 0.0, 0.0, 0.0, 1.0] } else { [0.0, 0.0, 0.0, 0.0, 0.0, (0.5 * way).sin(), (0.5 * way).cos()] }
        });
        let (mut data, mut rate) = (chain.data(), vec![0.0; 4 * n]);
        base.at(t).carry(&mut data.chain).unwrap();
        chain.derivative(&mut data, &x, &tau, &mut rate).unwrap();
        // The acceleration of the joint is linear in its force.
        let x = [&[0.3 * t + 0.2 * t * t][..], &x[..2 * n], &[0.3 + 0.4 * t], &x[2 * n..]].concat();
        let (mut data, mut by_joint) = (whole.data(), vec![0.0; 4 * n + 2]);
        let mut with = |force: f64| {
            whole.derivative(&mut data, &x, &[&[force], &tau[..]].concat(), &mut by_joint).unwrap();
            by_joint.clone()
        };
        let [none, one] = [0.0, 1.0].map(|force| with(force)[2 * n + 1]);
        let found = with((0.4 - none) / (one - none));
        prop_assert!(close(&found[2 * n + 2..], &rate[2 * n..], 1e-6), "{found:?} {rate:?}");
    }
}

/// Runs of a chain of the presets, whose joints have no motors, by all three methods.
fn moved_arm(base: Option<BaseMotion>, gravity: [f64; 3], integrator: Integrator) -> crate::Record {
    let parameters = ChainPreset::SixJointArm.parameters();
    let chain = Chain::new(&ChainParameters { gravity, ..parameters }).unwrap();
    let chain = DrivenChain::new(chain, &[], RotorCoupling::None).unwrap();
    let mut options = ChainSimulation::new(&chain, 0.5, STEP).unwrap();
    (options.base_motion, options.integrator) = (base, integrator);
    options.tolerances.rtol = 1e-11;
    simulate_chain(&chain, &[], &options).unwrap()
}

#[test]
fn a_base_that_accelerates_evenly_changes_gravity() {
    let falling = moved_arm(None, [1.0, -2.0, -9.81], Integrator::Dop853);
    for integrator in [Integrator::Automatic, Integrator::Dop853, Integrator::Radau] {
        // Turned by 90 degrees about z, whose x is the world's y.
        let (s, c) = std::f64::consts::FRAC_PI_4.sin_cos();
        let base = motion(51, |t| [1.0 - t * t, 3.0 * t - 0.5 * t * t, 7.0, 0.0, 0.0, s, c]);
        let moved = moved_arm(Some(base), [0.0, 0.0, -9.81], integrator);
        assert_eq!(
            moved.names()[7..14],
            ["base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw"]
        );
        for name in falling.names() {
            let (a, b) = (falling.column(name).unwrap(), moved.column(name).unwrap());
            assert!(close(a, b, 1e-8), "{integrator:?} {name}");
        }
        assert!((moved.column("base_vx").unwrap()[50] - (3.0 - 0.5)).abs() < 1e-9);
        assert!((moved.column("base_vy").unwrap()[50] - 1.0).abs() < 1e-9);
    }
}

/// Jacobi's integral, what the drive of a table that turns evenly puts in being its rate times the moment: E - w L.
#[test]
fn on_a_table_that_turns_evenly_jacobis_integral_stays() {
    let rate = 2.0;
    for integrator in [Integrator::Dop853, Integrator::Radau] {
        let base = motion(51, |t| {
            [0.0, 0.0, 0.0, 0.0, 0.0, (0.5 * rate * t).sin(), (0.5 * rate * t).cos()]
        });
        let record = moved_arm(Some(base), [0.0, 0.0, -9.81], integrator);
        let parameters = ChainPreset::SixJointArm.parameters();
        let inertia = parameters.links[0].inertia;
        let free = ChainParameters {
            base: Base::Free,
            base_inertia: inertia,
            ..parameters
        };
        let free = Chain::new(&free).unwrap();
        let integral = |k: usize| {
            let state: Vec<f64> = record.names()[7..]
                .iter()
                .map(|name| record.column(name).unwrap()[k])
                .collect();
            let (q, v) = state.split_at(13);
            let energy = free.energy(&mut free.data(), q, v).unwrap();
            let momentum = free.centroidal_momentum(&mut free.data(), q, v).unwrap();
            let ([x, y, _], [px, py, _]) = (momentum.com, momentum.linear);
            (
                energy.kinetic,
                energy.kinetic + energy.potential - rate * (momentum.angular[2] + x * py - y * px),
            )
        };
        let (first, last) = (integral(0), integral(50));
        assert!((last.0 - first.0).abs() > 1.0, "{first:?} {last:?}");
        assert!((last.1 - first.1).abs() < 1e-7, "{integrator:?}: {first:?} {last:?}");
    }
}

#[test]
fn motions_that_do_not_fit_are_refused() {
    let rest = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let refused = |poses: &[[f64; 7]], step: f64| BaseMotion::new(poses, step).unwrap_err().to_string();
    let mut bad = [rest; 4];
    bad[2][1] = f64::NAN;
    assert!(refused(&bad, 0.1).contains("base_y"));
    bad[2] = [0.0; 7];
    assert!(refused(&bad, 0.1).contains("row 3"));
    bad[2] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.9];
    assert!(refused(&bad, 0.1).contains("from row 2 to row 3"));
    assert!(refused(&[rest], 0.1).contains("number of poses"));
    assert!(refused(&[rest; 2], f64::NAN).contains("sample_time"));

    let message = |preset: ChainPreset, base: &[[f64; 7]], step: f64| {
        let chain = Chain::new(&preset.parameters()).unwrap();
        let chain = DrivenChain::new(chain, &[], RotorCoupling::None).unwrap();
        let mut options = ChainSimulation::new(&chain, 1.0, 0.1).unwrap();
        options.base_motion = Some(BaseMotion::new(base, step).unwrap());
        simulate_chain(&chain, &[], &options).unwrap_err().to_string()
    };
    let said = message(ChainPreset::SixJointArm, &[rest; 4], 0.1);
    assert!(said.contains('4') && said.contains("11"), "{said}");
    assert!(message(ChainPreset::SixJointArm, &[rest; 11], 0.2).contains("sample time"));
    assert!(message(ChainPreset::SpaceManipulator, &[rest; 11], 0.1).contains("make it fixed"));
}

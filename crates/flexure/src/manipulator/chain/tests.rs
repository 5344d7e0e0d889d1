//! Properties that tie the algorithms together, on random trees, and the checks of a description.

use proptest::prelude::*;

use super::*;
use crate::manipulator::{JointKind, Link, LinkDynamics, space_arm};

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A source of numbers in -1..1 that repeats (a linear congruential generator).
pub(super) struct Draw(pub u64);

impl Draw {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }

    fn triple(&mut self) -> [f64; 3] {
        [self.next(), self.next(), self.next()]
    }
}

/// A body of a few kilograms: three rods' worth of mass about its centre.
fn body(draw: &mut Draw) -> LinkInertia {
    let mut matrix = [[0.0; 3]; 3];
    for _ in 0..4 {
        let r = draw.triple();
        let square: f64 = r.iter().map(|x| x * x).sum();
        for i in 0..3 {
            for j in 0..3 {
                matrix[i][j] += if i == j { square } else { 0.0 } - r[i] * r[j];
            }
        }
    }
    LinkInertia {
        mass: 2.0 + draw.next(),
        com: draw.triple(),
        matrix,
    }
}

/// The rotation of a unit quaternion, by rows.
fn rotation(draw: &mut Draw) -> [[f64; 3]; 3] {
    let [a, b] = [draw.next() * 3.0, draw.next() * 3.0];
    let ((s, c), (t, d)) = (a.sin_cos(), b.sin_cos());
    // About z by a, then about x by b.
    [[c, -s * d, s * t], [s, c * d, -c * t], [0.0, t, d]]
}

pub(super) fn tree(seed: u64, links: usize, base: Base) -> ChainParameters {
    let draw = &mut Draw(seed);
    let links = (0..links).map(|i| {
        let motion = match draw.next() {
            x if i > 0 && x < -0.6 => JointMotion::Fixed,
            x if x < -0.2 => JointMotion::Prismatic,
            _ => JointMotion::Revolute,
        };
        let parent = ((draw.next() + 1.0) * 0.5 * (i + 1) as f64) as usize;
        ChainLink {
            name: format!("link{i}"),
            joint: format!("joint{i}"),
            parent: parent.checked_sub(1),
            motion,
            axis: draw.triple(),
            rotation: rotation(draw),
            translation: draw.triple(),
            inertia: Some(body(draw)),
            limits: [f64::NEG_INFINITY, f64::INFINITY],
        }
    });
    let links = links.collect();
    ChainParameters {
        base_name: "base".to_owned(),
        base,
        base_inertia: Some(body(draw)),
        links,
        gravity: [0.3, -0.5, -9.81],
    }
}

pub(super) fn close(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    let largest = a.iter().chain(b).fold(1e-3f64, |m, x| m.max(x.abs()));
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance * largest)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn the_algorithms_agree_with_each_other(seed: u64, links in 1usize..9, free: bool) {
        let chain = Chain::new(&tree(seed, links, if free { Base::Free } else { Base::Fixed })).unwrap();
        let (mut data, n) = (chain.data(), chain.velocities());
        let draw = &mut Draw(seed ^ 77);
        let (q, v, a) = (draw.vector(chain.positions()), draw.vector(n), draw.vector(n));
        let zero = vec![0.0; n];
        let (mut tau, mut back, mut m) = (zero.clone(), zero.clone(), vec![0.0; n * n]);

        chain.inverse_dynamics(&mut data, &q, &v, &a, &mut tau).unwrap();
        chain.forward_dynamics(&mut data, &q, &v, &tau, &mut back).unwrap();
        prop_assert!(close(&a, &back, 1e-9), "{a:?} {back:?}");

        // The regressor times the parameters.
        let parameters = chain.inertial_parameters();
        let mut regressor = vec![0.0; n * parameters.len()];
        chain.regressor(&mut data, &q, &v, &a, &mut regressor).unwrap();
        let rows = regressor.chunks(parameters.len());
        let linear: Vec<f64> = rows.map(|row| row.iter().zip(&parameters).map(|(y, p)| y * p).sum()).collect();
        prop_assert!(close(&linear, &tau, 1e-12), "{linear:?} {tau:?}");

        // M e_k is what the acceleration e_k adds to the torques.
        chain.mass_matrix(&mut data, &q, &mut m).unwrap();
        let (mut rest, mut column) = (zero.clone(), zero.clone());
        chain.inverse_dynamics(&mut data, &q, &zero, &zero, &mut rest).unwrap();
        for k in 0..n {
            let mut unit = zero.clone();
            unit[k] = 1.0;
            chain.inverse_dynamics(&mut data, &q, &zero, &unit, &mut column).unwrap();
            let want: Vec<f64> = column.iter().zip(&rest).map(|(c, r)| c - r).collect();
            let of_rows: Vec<f64> = m[k * n..(k + 1) * n].to_vec();
            let of_columns: Vec<f64> = (0..n).map(|i| m[i * n + k]).collect();
            // Gravity's torques, which are subtracted, may be larger than a column.
            let scale = rest.iter().fold(1.0f64, |s, r| s.max(r.abs()));
            prop_assert!(want.iter().zip(&of_rows).all(|(a, b)| (a - b).abs() < 1e-12 * scale.max(a.abs())));
            prop_assert!(close(&of_rows, &of_columns, 1e-14));
        }

        let energy = chain.energy(&mut data, &q, &v).unwrap();
        let form: f64 = (0..n * n).map(|k| 0.5 * v[k / n] * m[k] * v[k % n]).sum();
        prop_assert!(form > 0.0 && (form - energy.kinetic).abs() < 1e-12 * form);
    }

    #[test]
    fn without_torque_the_energy_stays_and_a_free_base_keeps_its_momentum(seed: u64, links in 1usize..6) {
        let parameters = ChainParameters { gravity: [0.0; 3], ..tree(seed, links, Base::Free) };
        let chain = Chain::new(&parameters).unwrap();
        let (mut data, n) = (chain.data(), chain.velocities());
        let draw = &mut Draw(seed ^ 5);
        let (q, v) = (draw.vector(chain.positions()), draw.vector(n));
        let (zero, mut a) = (vec![0.0; n], vec![0.0; n]);
        chain.forward_dynamics(&mut data, &q, &v, &zero, &mut a).unwrap();
        // Central differences along the motion.
        let h = 1e-4;
        let mut at = |h: f64| {
            let moved: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + h * a).collect();
            let place = step(&q, &v, &a, h);
            let momentum = chain.centroidal_momentum(&mut data, &place, &moved).unwrap();
            let energy = chain.energy(&mut data, &place, &moved).unwrap().kinetic;
            ([momentum.linear, momentum.angular].concat(), energy)
        };
        let ((before, less), (after, more)) = (at(-h), at(h));
        prop_assert!(close(&before, &after, 1e-5), "{before:?} {after:?}");
        prop_assert!((more - less).abs() < 1e-5 * (1.0 + more));
    }
}

/// The position a short time h later, to second order.
fn step(q: &[f64], v: &[f64], a: &[f64], h: f64) -> Vec<f64> {
    let norm = q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z, w] = [q[3] / norm, q[4] / norm, q[5] / norm, q[6] / norm];
    let turn = |p: [f64; 3]| {
        let u = [
            y * p[2] - z * p[1] + w * p[0],
            z * p[0] - x * p[2] + w * p[1],
            x * p[1] - y * p[0] + w * p[2],
        ];
        [
            p[0] + 2.0 * (y * u[2] - z * u[1]),
            p[1] + 2.0 * (z * u[0] - x * u[2]),
            p[2] + 2.0 * (x * u[1] - y * u[0]),
        ]
    };
    let half = |i: usize| 0.5 * h * (v[3 + i] + 0.5 * h * a[3 + i]);
    let (rx, ry, rz) = (half(0), half(1), half(2));
    let cross = |i: usize, j: usize| v[3 + i] * v[j] - v[3 + j] * v[i];
    let curved = [a[0] + cross(1, 2), a[1] + cross(2, 0), a[2] + cross(0, 1)];
    let way = turn([0, 1, 2].map(|i| h * v[i] + 0.5 * h * h * curved[i]));
    let mut next: Vec<f64> = (0..3).map(|i| q[i] + way[i]).collect();
    next.extend([
        x + w * rx + y * rz - z * ry,
        y + w * ry + z * rx - x * rz,
        z + w * rz + x * ry - y * rx,
        w - x * rx - y * ry - z * rz,
    ]);
    next.extend((7..q.len()).map(|i| q[i] + h * v[i - 1] + 0.5 * h * h * a[i - 1]));
    next
}

/// Two links in a plane are the two-link arm.
#[test]
fn two_planar_links_have_the_inertia_of_the_two_link_arm() {
    let links = [(1.5, 1.2, 0.5, 0.2), (0.8, 0.9, 0.4, 0.1)].map(|(mass, length, com, inertia)| Link {
        mass,
        length,
        com,
        inertia,
    });
    let chain = Chain::new(&planar(&links)).unwrap();
    let dynamics = LinkDynamics::new(&links);
    let mut data = chain.data();
    for i in 0..50 {
        let (q, dq) = (
            [0.3 * i as f64, -0.7 * i as f64],
            [(i as f64).sin(), (1.7 * i as f64).cos()],
        );
        let (mut m, mut bias) = ([0.0; 4], [0.0; 2]);
        chain.mass_matrix(&mut data, &q, &mut m).unwrap();
        chain
            .inverse_dynamics(&mut data, &q, &dq, &[0.0; 2], &mut bias)
            .unwrap();
        assert!(close(&m, dynamics.inertia(q[1]).as_flattened(), 1e-14));
        let c = dynamics.coriolis(q[1], dq);
        let want = [0, 1].map(|k| c[k][0] * dq[0] + c[k][1] * dq[1]);
        assert!(close(&bias, &want, 1e-13), "{bias:?} {want:?}");
    }
}

#[test]
fn the_presets_are_chains_and_the_space_arm_is_that_of_two_links() {
    for preset in ChainPreset::ALL {
        let chain = Chain::new(&preset.parameters()).unwrap();
        let (mut data, n) = (chain.data(), chain.velocities());
        let draw = &mut Draw(3);
        let (q, v, a) = (draw.vector(chain.positions()), draw.vector(n), draw.vector(n));
        let (mut tau, mut back) = (vec![0.0; n], vec![0.0; n]);
        chain.inverse_dynamics(&mut data, &q, &v, &a, &mut tau).unwrap();
        chain.forward_dynamics(&mut data, &q, &v, &tau, &mut back).unwrap();
        assert!(close(&a, &back, 1e-10), "{}: {a:?} {back:?}", preset.name());
    }
    let held = ChainParameters {
        base: Base::Fixed,
        base_inertia: None,
        ..ChainPreset::FreeSpaceArm.parameters()
    };
    let (chain, mut m) = (Chain::new(&held).unwrap(), [0.0; 4]);
    chain.mass_matrix(&mut chain.data(), &[0.2, 0.7], &mut m).unwrap();
    let want = LinkDynamics::new(&space_arm(JointKind::Rigid).links).inertia(0.7);
    assert!(close(&m, want.as_flattened(), 1e-14));
}

pub(super) fn planar(links: &[Link; 2]) -> ChainParameters {
    let link = |i: usize| ChainLink {
        name: format!("link{i}"),
        joint: format!("joint{i}"),
        parent: i.checked_sub(1),
        motion: JointMotion::Revolute,
        axis: [0.0, 0.0, 1.0],
        rotation: IDENTITY,
        translation: [if i == 0 { 0.0 } else { links[0].length }, 0.0, 0.0],
        inertia: Some(LinkInertia {
            mass: links[i].mass,
            com: [links[i].com, 0.0, 0.0],
            matrix: [[0.0; 3], [0.0, links[i].inertia, 0.0], [0.0, 0.0, links[i].inertia]],
        }),
        limits: [-3.0, 3.0],
    };
    ChainParameters {
        base_name: "base".to_owned(),
        base: Base::Fixed,
        base_inertia: None,
        links: vec![link(0), link(1)],
        gravity: [0.0; 3],
    }
}

#[test]
fn bad_chains_are_refused_by_the_link() {
    type Change = fn(&mut ChainParameters);
    let cases: [(Change, &str); 14] = [
        (
            |p| p.links[1].name = "link0".into(),
            "link 'link0': its name is used twice",
        ),
        (
            |p| p.links[1].joint = "joint0".into(),
            "link 'link1': its name is used twice",
        ),
        (
            |p| p.links[1].name = "base".into(),
            "link 'base': its name is used twice",
        ),
        (|p| p.links[0].parent = Some(1), "link 'link0': its parent is number 1"),
        (|p| p.links[1].axis = [0.0; 3], "link 'link1': its joint's axis is zero"),
        (
            |p| p.links[1].rotation[2][2] = -1.0,
            "link 'link1': its placement is not a rotation",
        ),
        (
            |p| p.links[1].translation[0] = f64::NAN,
            "link 'link1': a coordinate of its origin, m, is NaN",
        ),
        (
            |p| p.links[1].limits = [1.0, 0.0],
            "link 'link1': its lower limit 1 lies above",
        ),
        (|p| p.links[1].inertia = None, "link 'link1': it moves, but"),
        (|p| change(p).mass = 0.0, "link 'link1': its mass, kg, is 0"),
        (
            |p| change(p).matrix[2][2] = 5.0,
            "link 'link1': its moments of inertia belong to no body",
        ),
        (
            |p| change(p).matrix[0][1] = 0.1,
            "link 'link1': its inertia matrix is not symmetric",
        ),
        (|p| p.base = Base::Free, "link 'base': it moves, but"),
        (|p| p.links.clear(), "link 'base': the chain has no joint"),
    ];
    for (change, want) in cases {
        let mut parameters = planar(
            &[Link {
                mass: 1.0,
                length: 1.0,
                com: 0.5,
                inertia: 0.1,
            }; 2],
        );
        change(&mut parameters);
        let message = Chain::new(&parameters).unwrap_err().to_string();
        assert!(message.starts_with(want), "{message}");
    }
}

fn change(p: &mut ChainParameters) -> &mut LinkInertia {
    p.links[1].inertia.as_mut().unwrap()
}

//! The time of a chain's algorithms, one state a call and many states a call, on one core: `cargo bench -p flexure --bench chain`.
//!
//! With `-- FOLDER` it writes the chains to this folder as URDF, for the peers of `bench/chains/run`.

use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

use flexure::manipulator::chain::{
    Base, Chain, ChainDrive, ChainParameters, ChainPreset, DrivenChain, DrivenState, LinkInertia, RotorCoupling,
};
use flexure::manipulator::{JointKind, space_arm};

/// The least time of a call over several runs, microseconds.
fn microseconds(mut call: impl FnMut(usize)) -> f64 {
    const CALLS: usize = 50_000;
    let run = |_| {
        let start = Instant::now();
        (0..CALLS).for_each(&mut call);
        start.elapsed().as_secs_f64() / CALLS as f64 * 1e6
    };
    (0..15).map(run).fold(f64::INFINITY, f64::min)
}

/// A preset chain as URDF; the frames of all its links have the axes of the base.
fn urdf(chain: &ChainParameters) -> Result<String, std::fmt::Error> {
    let triple = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
    let mut text = String::from("<robot name=\"chain\">");
    let link = |text: &mut String, name: &str, inertia: Option<LinkInertia>| {
        write!(text, "<link name=\"{name}\">")?;
        if let Some(LinkInertia { mass, com, matrix: m }) = inertia {
            let com = triple(com);
            write!(text, "<inertial><origin xyz=\"{com}\"/><mass value=\"{mass}\"/>")?;
            write!(
                text,
                "<inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\"",
                m[0][0], m[0][1], m[0][2]
            )?;
            write!(
                text,
                " iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial>",
                m[1][1], m[1][2], m[2][2]
            )?;
        }
        write!(text, "</link>")
    };
    link(&mut text, &chain.base_name, chain.base_inertia)?;
    for l in &chain.links {
        link(&mut text, &l.name, l.inertia)?;
        let parent = l.parent.map_or(&chain.base_name, |p| &chain.links[p].name);
        write!(
            text,
            "<joint name=\"{}\" type=\"revolute\"><parent link=\"{parent}\"/>",
            l.joint
        )?;
        let (origin, axis) = (triple(l.translation), triple(l.axis));
        write!(
            text,
            "<child link=\"{}\"/><origin xyz=\"{origin}\"/><axis xyz=\"{axis}\"/>\
             <limit lower=\"-9\" upper=\"9\" effort=\"1\" velocity=\"1\"/></joint>",
            l.name
        )?;
    }
    text.push_str("</robot>\n");
    Ok(text)
}

/// States that a call takes in turn, or together.
const STATES: usize = 64;

/// Positions, velocities and torques, state by state.
fn states(chain: &Chain) -> Vec<[Vec<f64>; 3]> {
    let wave = |n: usize, k: usize, phase: f64| (0..n).map(|i| (phase + k as f64 + 1.7 * i as f64).sin()).collect();
    let (positions, n) = (chain.positions(), chain.velocities());
    let state = |k| [wave(positions, k, 0.1), wave(n, k, 1.1), wave(n, k, 2.1)];
    (0..STATES).map(state).collect()
}

/// The times of forward and inverse dynamics and of the inertia matrix, one state a call.
fn one_by_one(chain: &Chain, states: &[[Vec<f64>; 3]]) -> [f64; 3] {
    let (mut data, n) = (chain.data(), chain.velocities());
    let (mut result, mut matrix) = (vec![0.0; n], vec![0.0; n * n]);
    let forward = microseconds(|k| {
        let [q, v, tau] = &states[k % STATES];
        let _ = black_box(chain.forward_dynamics(&mut data, q, v, tau, black_box(&mut result)));
    });
    let inverse = microseconds(|k| {
        let [q, v, a] = &states[k % STATES];
        let _ = black_box(chain.inverse_dynamics(&mut data, q, v, a, black_box(&mut result)));
    });
    let inertia = microseconds(|k| {
        let _ = black_box(chain.mass_matrix(&mut data, &states[k % STATES][0], black_box(&mut matrix)));
    });
    [forward, inverse, inertia]
}

/// The same for each of all states in one call.
fn together(chain: &Chain, states: &[[Vec<f64>; 3]]) -> [f64; 3] {
    let n = chain.velocities();
    let [q, v, tau] = [0, 1, 2].map(|k| states.iter().flat_map(|state| state[k].clone()).collect::<Vec<f64>>());
    let (mut results, mut matrices) = (vec![0.0; v.len()], vec![0.0; n * v.len()]);
    let each = |call: &mut dyn FnMut() -> flexure::Result<()>| {
        microseconds(|k| {
            if k % STATES == 0 {
                let _ = black_box(call());
            }
        })
    };
    [
        each(&mut || chain.forward_dynamics_batch(&q, &v, &tau, black_box(&mut results))),
        each(&mut || chain.inverse_dynamics_batch(&q, &v, &tau, black_box(&mut results))),
        each(&mut || chain.mass_matrix_batch(&q, black_box(&mut matrices))),
    ]
}

/// The time of forward dynamics with the nonlinear flexible joints and the friction of the space arm, one state a call.
fn driven(chain: &Chain, states: &[[Vec<f64>; 3]]) -> flexure::Result<f64> {
    let drive = ChainDrive {
        kind: JointKind::Nonlinear,
        joint: space_arm(JointKind::Nonlinear).joints[0],
        ..ChainDrive::default()
    };
    let joints = chain.joints().len();
    let driven = DrivenChain::new(chain.clone(), &vec![drive; joints], RotorCoupling::default())?;
    let mut data = driven.data();
    let (mut acceleration, mut of_motors) = (vec![0.0; chain.velocities()], vec![0.0; joints]);
    // The springs are wound up by some hundredths of a radian.
    let wound = |[q, _, tau]: &[Vec<f64>; 3]| -> Vec<f64> {
        let joints = q[q.len() - joints..].iter().zip(&tau[tau.len() - joints..]);
        joints.map(|(q, tau)| q + 0.03 * tau).collect()
    };
    let motors: Vec<Vec<f64>> = states.iter().map(wound).collect();
    Ok(microseconds(|k| {
        let [q, v, tau] = &states[k % STATES];
        let state = DrivenState {
            q,
            v,
            motor_q: &motors[k % STATES],
            motor_v: &tau[tau.len() - joints..],
        };
        let done = driven.accelerations(&mut data, &state, tau, black_box(&mut acceleration), &mut of_motors);
        let _ = black_box(done);
    }))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).filter(|a| !a.starts_with('-'));
    println!(
        "microseconds            forward  inverse  inertia matrix  the same of many states, each   forward with flexible joints"
    );
    let [space_arm, _, six, seven] = ChainPreset::ALL.map(ChainPreset::parameters);
    let mut two = space_arm;
    (two.base, two.base_inertia) = (Base::Fixed, None);
    let mut free = seven.clone();
    (free.base, free.base_inertia) = (Base::Free, seven.links[0].inertia);
    for (name, parameters) in [
        ("two links", two),
        ("six joints", six),
        ("seven joints", seven),
        ("free base + 7", free),
    ] {
        if let Some(folder) = &folder {
            std::fs::write(format!("{folder}/{name}.urdf"), urdf(&parameters)?)?;
        }
        let chain = Chain::new(&parameters)?;
        let states = states(&chain);
        let [forward, inverse, inertia] = one_by_one(&chain, &states);
        let [forwards, inverses, inertias] = together(&chain, &states);
        let flexible = driven(&chain, &states)?;
        println!(
            "{name:<20} {forward:>10.3} {inverse:>8.3} {inertia:>8.3} {forwards:>12.3} {inverses:>8.3} {inertias:>8.3} {flexible:>12.3}"
        );
    }
    Ok(())
}

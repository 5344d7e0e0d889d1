//! Stiff chains in time: the implicit method against the explicit one, and how many evaluations each takes.

use super::*;
use crate::Result;
use crate::manipulator::flexible_arm::{FlexibleArm, FlexibleBeam, ShapeFunctions};
use crate::manipulator::{Friction, JointKind, JointParameters};
use crate::record::Record;
use crate::simulation::{Advance, Integration, Integrator, Sampling, Statistics, Tolerances, run_held};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::time::Instant;

/// The components of a state.
type StateOfChain = Box<[f64]>;

/// A flexible joint with a damping ratio of the motor on its spring.
fn joint(stiffness: f64, motor_inertia: f64, ratio: f64, friction: Option<Friction>) -> ChainDrive {
    ChainDrive {
        kind: JointKind::Linear,
        joint: JointParameters {
            stiffness,
            motor_inertia,
            damping: 2.0 * ratio * (stiffness * motor_inertia).sqrt(),
            friction,
            motor_friction: friction,
            ..JointParameters::default()
        },
        ..ChainDrive::default()
    }
}

fn chain(preset: ChainPreset, drive: ChainDrive) -> DrivenChain {
    let chain = Chain::new(&preset.parameters()).unwrap();
    let drives = vec![drive; chain.joints().len()];
    DrivenChain::new(chain, &drives, RotorCoupling::None).unwrap()
}

fn torques(count: usize, sampling: &Sampling, size: f64) -> Vec<Vec<f64>> {
    let of = |i: usize, k: usize| size * (sampling.instant(k) * (3.0 + i as f64)).sin();
    (0..count)
        .map(|i| (0..sampling.rows()).map(|k| of(i, k)).collect())
        .collect()
}

fn simulated(chain: &DrivenChain, duration: f64, size: f64, rtol: f64, integrator: Integrator) -> Record {
    let mut options = ChainSimulation::new(chain, duration, 0.01).unwrap();
    (options.tolerances.rtol, options.tolerances.atol, options.integrator) = (rtol, 1e-3 * rtol, integrator);
    let tau = torques(chain.driven().len(), &options.sampling, size);
    simulate_chain(chain, &tau.iter().map(|tau| &tau[..]).collect::<Vec<_>>(), &options).unwrap()
}

/// The largest difference of two records' positions and velocities, the latter in units of 10/s.
fn apart(a: &Record, b: &Record) -> f64 {
    let mut most = 0.0_f64;
    for name in a.names() {
        let unit = if name.contains("dq") { 0.1 } else { 1.0 };
        let both = a.column(name).unwrap().iter().zip(b.column(name).unwrap());
        most = both.fold(most, |m, (a, b)| m.max(unit * (a - b).abs()));
    }
    most
}

#[test]
fn the_implicit_method_agrees_with_the_explicit_one() {
    let steep = Friction([0.3, 300.0, 100.0, 0.5, 1000.0, 0.2]);
    for preset in [ChainPreset::SixJointArm, ChainPreset::SpaceManipulator] {
        let (stiffness, inertia, size) = match preset {
            ChainPreset::SixJointArm => (1e5, 1e-2, 5.0),
            _ => (1e6, 1.0, 50.0),
        };
        let chain = chain(preset, joint(stiffness, inertia, 0.5, Some(steep)));
        let want = simulated(&chain, 0.2, size, 1e-12, Integrator::Dop853);
        for (rtol, limit) in [(1e-6, 1e-5), (1e-9, 1e-8), (1e-11, 1e-9)] {
            let off = apart(&want, &simulated(&chain, 0.2, size, rtol, Integrator::Radau));
            println!("{preset:?} {rtol:e}: {off:e}");
            assert!(off < limit, "{preset:?} {rtol:e}: {off:e}");
        }
    }
}

#[test]
fn without_stiffness_an_arm_takes_the_steps_of_the_explicit_method() {
    let chain = chain(ChainPreset::FreeSpaceArm, joint(1e3, 1.0, 0.0, None));
    let [automatic, explicit] =
        [Integrator::Automatic, Integrator::Dop853].map(|of| simulated(&chain, 0.5, 5.0, 1e-9, of));
    assert!(automatic == explicit, "{:e}", apart(&automatic, &explicit));
}

#[test]
fn a_stiff_arm_that_swings_loses_energy_by_its_dampers_alone() {
    let chain = chain(ChainPreset::SevenJointArm, joint(1e6, 1e-4, 1.0, None));
    let record = simulated(&chain, 0.5, 0.0, 1e-9, Integrator::Automatic);
    let states = &record.names()[1 + chain.driven().len()..];
    let mut data = chain.data();
    let mut energy = |k: usize| {
        let x: Vec<f64> = states.iter().map(|name| record.column(name).unwrap()[k]).collect();
        let energy = chain.energy(&mut data, &chain.state(&x).unwrap()).unwrap();
        (energy.kinetic, energy.kinetic + energy.potential)
    };
    let all: Vec<(f64, f64)> = (0..record.len()).map(&mut energy).collect();
    for (before, after) in all.iter().zip(&all[1..]) {
        assert!(after.1 < before.1 * (1.0 + 1e-9), "{before:?} {after:?}");
    }
    // Springs of 1e6 N m/rad hold almost all of it.
    let last = all.last().unwrap();
    assert!(
        last.0 > 1.0 && all[1].1 - last.1 < 1e-3 * last.0,
        "{:?} {last:?}",
        all[0]
    );
}

/// What a run costs: the count, the time, and the state at the end. The torques are the inputs of the derivative.
struct Run {
    cost: Statistics,
    seconds: f64,
    end: StateOfChain,
}

fn run(
    initial: &[f64],
    positions: usize,
    tau: &[Vec<f64>],
    sampling: &Sampling,
    integrator: Integrator,
    derivative: impl FnMut(&[f64], &[f64], &mut [f64]) -> Result<()>,
) -> Run {
    let start = Instant::now();
    let derivative = RefCell::new(derivative);
    let plant = |x: &StateOfChain, tau: &Vec<f64>| {
        let mut rates = vec![0.0; x.len()].into_boxed_slice();
        if (derivative.borrow_mut())(x, tau, &mut rates).is_err() {
            rates.fill(f64::NAN);
        }
        rates
    };
    let solver = Integration::new(0.0, initial.into(), Tolerances::default(), integrator).unwrap();
    let mut solver = solver.with_speeds_from(positions);
    let input = |k: usize, _: &StateOfChain| tau.iter().map(|tau| tau[k]).collect();
    run_held(&mut solver, plant, input, sampling, &mut |_, _, _| (), &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    Run {
        cost: solver.statistics(),
        seconds: start.elapsed().as_secs_f64(),
        end: solver.x().clone(),
    }
}

/// Prints a row of the table in `docs/theory/chains.md`, and returns how many times fewer evaluations and steps the choice takes.
fn compared(name: &str, times: f64, of: impl Fn(Integrator) -> Run) -> f64 {
    let (explicit, chosen) = (of(Integrator::Dop853), of(Integrator::Automatic));
    let steps = |run: &Run| run.cost.accepted + run.cost.rejected;
    let off = explicit
        .end
        .iter()
        .zip(&chosen.end)
        .map(|(a, b)| (a - b).abs() / (1.0 + a.abs()));
    println!(
        "| {name} | {} | {} | {} | {} | {:.0} | {:.0} | {:.0e} |",
        steps(&explicit),
        explicit.cost.evaluations,
        steps(&chosen),
        chosen.cost.evaluations,
        1e3 * explicit.seconds,
        1e3 * chosen.seconds,
        off.fold(0.0, f64::max)
    );
    let ratio = explicit.cost.evaluations as f64 / chosen.cost.evaluations as f64;
    assert!(ratio > times, "{name}: {ratio}");
    ratio
}

fn of_chain(chain: &DrivenChain, duration: f64, size: f64) -> impl Fn(Integrator) -> Run {
    let sampling = Sampling::new(duration, 0.01).unwrap();
    let passive = chain.passive();
    let driven: Vec<usize> = (0..passive.len())
        .filter(|&i| !passive[i])
        .map(|i| chain.chain().first() + i)
        .collect();
    let tau = torques(driven.len(), &sampling, size);
    let initial = ChainSimulation::new(chain, duration, 0.01).unwrap().initial;
    let positions = chain.chain().positions() + chain.motors();
    move |integrator| {
        let (mut data, mut all) = (chain.data(), vec![0.0; chain.chain().velocities()]);
        run(&initial, positions, &tau, &sampling, integrator, |x, tau, rates| {
            driven.iter().zip(tau).for_each(|(&at, tau)| all[at] = *tau);
            chain.derivative(&mut data, x, &all, rates)
        })
    }
}

const BEAM: Beam = Beam {
    length: 2.0,
    stiffness: 300.0,
    density: 0.7,
    damping: 0.05,
};

/// `cargo test --workspace --lib stiff_chains -- --nocapture` prints the table.
#[test]
fn stiff_chains_take_a_small_part_of_the_evaluations() {
    for (name, stiffness, inertia, duration, times) in [
        ("1e5 N m/rad, 1e-5 kg m^2", 1e5, 1e-5, 0.1, 3.0),
        ("1e6 N m/rad, 1e-5 kg m^2", 1e6, 1e-5, 0.1, 10.0),
        ("1e7 N m/rad, 1e-5 kg m^2", 1e7, 1e-5, 0.05, 20.0),
    ] {
        let arm = chain(ChainPreset::SevenJointArm, joint(stiffness, inertia, 1.0, None));
        compared(&format!("seven joints, {name}"), times, of_chain(&arm, duration, 5.0));
    }
    let steep = Friction([0.0, 0.0, 0.0, 1.0, 1e2, 0.5]);
    let arm = chain(ChainPreset::SevenJointArm, joint(1e5, 1e-5, 1.0, Some(steep)));
    compared(
        "the first with friction of 1 N m within 0.01 rad/s",
        30.0,
        of_chain(&arm, 0.02, 5.0),
    );

    let mut parameters = ChainPreset::FreeSpaceArm.parameters();
    parameters.links[1].inertia = None;
    let beam = SegmentedBeam {
        link: 1,
        beam: BEAM,
        along: [1.0, 0.0, 0.0],
        segments: 20,
        springs: SpringPlacement::Middle,
        axes: vec![[0.0, 0.0, 1.0]],
    };
    let (parameters, drives) = segmented(&parameters, &[ChainDrive::default(); 2], &[beam]).unwrap();
    let arm = DrivenChain::new(Chain::new(&parameters).unwrap(), &drives, RotorCoupling::None).unwrap();
    compared("two links in space, one of 20 segments", 3.0, of_chain(&arm, 0.1, 1.0));

    let beam = FlexibleBeam {
        link: 1,
        beam: BEAM,
        along: [1.0, 0.0, 0.0],
        functions: ShapeFunctions::Elements(10),
        axial_stiffness: Some(1e6),
    };
    let mut parameters = ChainPreset::FreeSpaceArm.parameters();
    parameters.links[1].inertia = None;
    let arm = FlexibleArm::new(&parameters, &[ChainDrive::default(); 2], &[beam]).unwrap();
    let sampling = Sampling::new(0.01, 0.005).unwrap();
    let (tau, rest) = (torques(2, &sampling, 1.0), vec![0.0; arm.dimension()]);
    compared("the same of 10 elements with an axial stiffness", 10.0, |integrator| {
        let of = |x: &[f64], tau: &[f64], rates: &mut [f64]| arm.derivative(x, tau, rates);
        run(&rest, arm.dimension() / 2, &tau, &sampling, integrator, of)
    });
}

//! Chains with flexible joints move in time as SciPy's integrator says with Pinocchio's dynamics (see `scripts/reference/chain_runs.py`).

use std::path::Path;

use flexure::manipulator::chain::{Base, ChainDrive, ChainSimulation, DrivenChain, RotorCoupling, simulate_chain};
use flexure::manipulator::{Friction, JointKind, JointParameters};
use flexure::simulation::Tolerances;
use flexure_io::urdf::{UrdfOptions, parse_urdf};

#[derive(serde::Deserialize)]
struct Chain {
    urdf: String,
}

#[derive(serde::Deserialize)]
struct Run {
    chain: usize,
    base: String,
    drives: Vec<Drive>,
    torques: Vec<Vec<f64>>,
    last: Vec<f64>,
}

#[derive(serde::Deserialize)]
struct Drive {
    motor_inertia: f64,
    linear: f64,
    cubic: f64,
    windup: f64,
    windup_sharpness: f64,
    damping: f64,
    friction: [f64; 6],
    motor_friction: [f64; 6],
}

impl Drive {
    fn flexible(&self) -> ChainDrive {
        ChainDrive {
            kind: JointKind::Nonlinear,
            joint: JointParameters {
                motor_inertia: self.motor_inertia,
                linear: self.linear,
                cubic: self.cubic,
                windup: self.windup,
                windup_sharpness: self.windup_sharpness,
                damping: self.damping,
                friction: Some(Friction(self.friction)),
                motor_friction: Some(Friction(self.motor_friction)),
                ..JointParameters::default()
            },
            gear_ratio: 1.0,
            passive: false,
        }
    }
}

#[test]
fn ten_seconds_are_those_of_scipy() {
    let chains: Vec<Chain> = serde_json::from_str(include_str!("data/chains.json")).unwrap();
    let runs: Vec<Run> = serde_json::from_str(include_str!("data/chain_runs.json")).unwrap();
    assert_eq!(runs.len(), 4);
    for run in runs {
        let free = run.base == "free";
        let options = UrdfOptions {
            base: if free { Base::Free } else { Base::Fixed },
            gravity: [0.0, 0.0, if free { 0.0 } else { -9.81 }],
        };
        let chain = parse_urdf(&chains[run.chain].urdf, Path::new("chain.urdf"), &options).unwrap();
        let drives: Vec<ChainDrive> = run.drives.iter().map(Drive::flexible).collect();
        let chain = DrivenChain::new(chain, &drives, RotorCoupling::None).unwrap();
        let options = ChainSimulation {
            tolerances: Tolerances {
                rtol: 1e-11,
                ..Tolerances::default()
            },
            ..ChainSimulation::new(&chain, 10.0, 0.1).unwrap()
        };
        let torques: Vec<&[f64]> = run.torques.iter().map(Vec::as_slice).collect();
        let record = simulate_chain(&chain, &torques, &options).unwrap();
        let joints = chain.chain().joints().len();
        let found: Vec<f64> = record.names()[1 + joints..]
            .iter()
            .map(|name| *record.column(name).unwrap().last().unwrap())
            .collect();
        let largest = run.last.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let off = found
            .iter()
            .zip(&run.last)
            .map(|(f, w)| (f - w).abs())
            .fold(0.0, f64::max);
        println!("chain {} {}: {off:.1e} of {largest:.1}", run.chain, run.base);
        assert!(off < 1e-7 * largest.max(1.0), "{found:?}");
    }
}

//! Chains from URDF move as Pinocchio says (see `scripts/reference/chains.py`).

use std::path::Path;

use flexure::manipulator::chain::Base;
use flexure_io::urdf::{UrdfOptions, parse_urdf};

#[derive(serde::Deserialize)]
struct Reference {
    base: String,
    urdf: String,
    joints: Vec<String>,
    states: Vec<State>,
}

#[derive(serde::Deserialize)]
struct State {
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    tau: Vec<f64>,
    drive: Vec<f64>,
    acceleration: Vec<f64>,
    /// The upper triangle by rows.
    mass: Vec<f64>,
    /// The regressor times numbers from -1 to 1.
    regressed: Vec<f64>,
    energy: [f64; 2],
    momentum: Option<[f64; 6]>,
    com: Option<[f64; 3]>,
    torque_by_position: Vec<f64>,
    torque_by_velocity: Vec<f64>,
    acceleration_by_position: Vec<f64>,
    acceleration_by_velocity: Vec<f64>,
    acceleration_by_torque: Vec<f64>,
}

/// The largest difference, relative to the largest value.
fn off(found: &[f64], want: &[f64]) -> f64 {
    assert_eq!(found.len(), want.len());
    let scale = want.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let differences = found.iter().zip(want).map(|(f, w)| (f - w).abs());
    differences.fold(0.0, f64::max) / scale
}

#[test]
fn chains_move_as_by_pinocchio() {
    let text = include_str!("data/chains.json");
    let references: Vec<Reference> = serde_json::from_str(text).unwrap();
    assert_eq!(references.len(), 20);
    for reference in references {
        let free = reference.base == "free";
        let options = UrdfOptions {
            base: if free { Base::Free } else { Base::Fixed },
            ..UrdfOptions::default()
        };
        let chain = parse_urdf(&reference.urdf, Path::new("chain.urdf"), &options).unwrap();
        assert_eq!(chain.joints(), reference.joints);
        let (mut data, n) = (chain.data(), chain.velocities());
        for state in &reference.states {
            let (q, v) = (&state.q, &state.v);
            let mut found = vec![0.0; n];
            chain.inverse_dynamics(&mut data, q, v, &state.a, &mut found).unwrap();
            assert!(off(&found, &state.tau) < 1e-12, "{found:?}");
            chain
                .forward_dynamics(&mut data, q, v, &state.drive, &mut found)
                .unwrap();
            assert!(off(&found, &state.acceleration) < 1e-12, "{found:?}");
            let mut mass = vec![0.0; n * n];
            chain.mass_matrix(&mut data, q, &mut mass).unwrap();
            let upper: Vec<f64> = (0..n).flat_map(|i| mass[i * n + i..(i + 1) * n].to_vec()).collect();
            assert!(off(&upper, &state.mass) < 1e-12);
            let columns = chain.inertial_parameters().len();
            let mut regressor = vec![0.0; n * columns];
            chain.regressor(&mut data, q, v, &state.a, &mut regressor).unwrap();
            let number = |k: usize| 2.0 * k as f64 / (columns - 1) as f64 - 1.0;
            let rows = regressor.chunks(columns).map(|row| row.iter().enumerate());
            let regressed: Vec<f64> = rows.map(|row| row.map(|(k, y)| y * number(k)).sum()).collect();
            assert!(off(&regressed, &state.regressed) < 1e-12, "{regressed:?}");
            let along = |matrix: &[f64]| -> Vec<f64> {
                let number = |k: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
                let rows = matrix.chunks(n).map(|row| row.iter().enumerate());
                rows.map(|row| row.map(|(k, y)| y * number(k)).sum()).collect()
            };
            let (mut by_q, mut by_v) = (vec![0.0; n * n], vec![0.0; n * n]);
            chain
                .inverse_dynamics_derivatives(&mut data, q, v, &state.a, &mut by_q, &mut by_v)
                .unwrap();
            assert!(off(&along(&by_q), &state.torque_by_position) < 1e-12);
            assert!(off(&along(&by_v), &state.torque_by_velocity) < 1e-12);
            let found = chain
                .forward_dynamics_derivatives(&mut data, q, v, &state.drive)
                .unwrap();
            assert!(off(&along(&found.by_position), &state.acceleration_by_position) < 1e-12);
            assert!(off(&along(&found.by_velocity), &state.acceleration_by_velocity) < 1e-12);
            assert!(off(&along(&found.by_torque), &state.acceleration_by_torque) < 1e-12);
            let energy = chain.energy(&mut data, q, v).unwrap();
            assert!(off(&[energy.kinetic], &state.energy[..1]) < 1e-12);
            let Some(want) = state.momentum else { continue };
            // Only of a free base does the energy contain the base's.
            assert!(off(&[energy.potential], &state.energy[1..]) < 1e-12, "{energy:?}");
            let momentum = chain.centroidal_momentum(&mut data, q, v).unwrap();
            assert!(
                off(&[momentum.linear, momentum.angular].concat(), &want) < 1e-12,
                "{momentum:?}"
            );
            assert!(off(&momentum.com, &state.com.unwrap()) < 1e-12, "{momentum:?}");
        }
    }
}

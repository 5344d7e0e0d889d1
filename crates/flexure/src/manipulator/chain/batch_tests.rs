//! States in lanes against one state after the other.

use super::*;
use crate::manipulator::chain::{Base, ChainParameters, ChainPreset, JointMotion};

/// Chains of all kinds: on a fixed and a free base, with a joint that slides.
fn chains() -> Vec<Chain> {
    let mut all: Vec<ChainParameters> = ChainPreset::ALL.map(ChainPreset::parameters).into();
    let mut free = all[3].clone();
    (free.base, free.base_inertia) = (Base::Free, free.links[0].inertia);
    free.links[2].motion = JointMotion::Prismatic;
    all.push(free);
    all.iter().map(|parameters| Chain::new(parameters).unwrap()).collect()
}

/// So many states: q, v and torques or accelerations.
fn states(chain: &Chain, count: usize) -> [Vec<f64>; 3] {
    let wave = |length: usize, phase: f64| (0..length).map(move |i| (phase + 1.7 * i as f64).sin()).collect();
    let n = count * chain.velocities();
    [wave(count * chain.positions(), 0.1), wave(n, 1.1), wave(n, 2.1)]
}

#[test]
fn states_in_lanes_have_the_bits_of_single_states() {
    for chain in chains() {
        for (count, dynamics) in [0, 1, 7, 8, 9, 40]
            .into_iter()
            .flat_map(|c| [Dynamics::Forward, Dynamics::Inverse, Dynamics::Inertia].map(|d| (c, d)))
        {
            let [q, v, given] = states(&chain, count);
            let run = |wide| {
                let mut result = vec![f64::NAN; count * chain.widths(dynamics).2];
                let states = States {
                    q: &q,
                    v: &v,
                    given: &given,
                };
                chain.on(wide, dynamics, states, &mut result).unwrap();
                result.into_iter().map(f64::to_bits).collect::<Vec<_>>()
            };
            let alone = run(None);
            assert!(alone.iter().all(|bits| f64::from_bits(*bits).is_finite()));
            Wide::all().for_each(|wide| assert_eq!(run(Some(wide)), alone, "{count} {dynamics:?}"));
        }
    }
}

#[test]
fn a_state_without_an_orientation_is_refused_among_others() {
    let chain = chains().pop().unwrap();
    let [mut q, v, tau] = states(&chain, 20);
    q[11 * chain.positions() + 3..][..4].fill(0.0);
    let mut found = vec![0.0; v.len()];
    let message = chain
        .forward_dynamics_batch(&q, &v, &tau, &mut found)
        .unwrap_err()
        .to_string();
    assert!(message.contains("quaternion") && message.contains("is 0"), "{message}");
    assert!(
        found[8 * chain.velocities()..11 * chain.velocities()]
            .iter()
            .all(|a| *a != 0.0)
    );
    assert!(chain.inverse_dynamics_batch(&q, &v, &tau, &mut found).is_err());
    let mut matrices = vec![0.0; 20 * chain.velocities() * chain.velocities()];
    assert!(chain.mass_matrix_batch(&q, &mut matrices).is_err());
    assert!(chain.mass_matrix_batch(&q, &mut found).is_err());
    assert!(chain.forward_dynamics_batch(&q, &v[1..], &tau, &mut found).is_err());
    assert!(chain.forward_dynamics_batch(&q[1..], &v, &tau, &mut found).is_err());
}

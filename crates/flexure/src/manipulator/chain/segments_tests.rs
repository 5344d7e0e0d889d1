//! Segmented beams: against the frequencies of clamped beams, other models of segments, and what no motion may change.

use super::tests::{close, planar};
use super::*;
use crate::manipulator::Link;

/// `(beta L)^2` of the first two modes of a clamped-free beam: roots of `cos b cosh b = -1`.
const CLAMPED: [f64; 2] = [3.516_015_268_5, 22.034_491_564_7];
const BEAM: Beam = Beam {
    length: 2.0,
    stiffness: 300.0,
    density: 0.7,
    damping: 0.0,
};
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// A beam that is fixed to the base.
fn clamped(segments: usize, springs: SpringPlacement, axes: &[[f64; 3]]) -> DrivenChain {
    let mut parameters = planar(&[LINK; 2]);
    parameters.links.truncate(1);
    parameters.links[0].motion = JointMotion::Fixed;
    parameters.links[0].inertia = None;
    let beam = SegmentedBeam {
        segments,
        springs,
        axes: axes.to_vec(),
        ..beam(0)
    };
    driven(&parameters, &[beam])
}

const LINK: Link = Link {
    mass: 1.0,
    length: 2.0,
    com: 1.0,
    inertia: 0.4,
};

fn beam(link: usize) -> SegmentedBeam {
    SegmentedBeam {
        link,
        beam: BEAM,
        along: [1.0, 0.0, 0.0],
        axes: vec![Z],
        segments: 3,
        springs: SpringPlacement::Root,
    }
}

fn driven(parameters: &ChainParameters, beams: &[SegmentedBeam]) -> DrivenChain {
    let (parameters, drives) = segmented(parameters, &[], beams).unwrap();
    DrivenChain::new(Chain::new(&parameters).unwrap(), &drives, RotorCoupling::None).unwrap()
}

/// The errors of the circular frequencies against those of the clamped beam, percent.
fn errors(chain: &DrivenChain) -> Vec<f64> {
    let rest = chain.chain().neutral();
    let modes = chain.linearised(&mut chain.data(), &rest).unwrap().modes(Motors::Held);
    let scale = (BEAM.stiffness / BEAM.density).sqrt() / BEAM.length.powi(2);
    let modes = modes.unwrap().into_iter().take(2);
    modes
        .zip(CLAMPED)
        .map(|(mode, square)| 100.0 * (mode.square.sqrt() / (square * scale) - 1.0))
        .collect()
}

#[test]
fn the_frequencies_of_a_clamped_beam_have_the_errors_of_the_table() {
    for (segments, springs, want) in [
        (3, SpringPlacement::Root, [-4.844_455, -14.289_31]),
        (10, SpringPlacement::Root, [-0.456_728, -1.564_427]),
        (3, SpringPlacement::Middle, [2.610_739, 9.709_728]),
        (10, SpringPlacement::Middle, [0.229_89, 0.801_672]),
    ] {
        let found = errors(&clamped(segments, springs, &[Z]));
        assert!(close(&found, &want, 1e-5), "{segments} {springs:?}: {found:?}");
    }
}

#[test]
fn the_errors_fall_with_the_square_of_the_number_of_segments() {
    for springs in [SpringPlacement::Root, SpringPlacement::Middle] {
        let (coarse, fine) = (errors(&clamped(20, springs, &[Z])), errors(&clamped(40, springs, &[Z])));
        for (coarse, fine) in coarse.iter().zip(&fine) {
            let rate = (coarse / fine).log2();
            assert!((rate - 2.0).abs() < 0.02, "{springs:?}: {rate}");
        }
    }
}

#[test]
fn a_beam_that_bends_about_two_axes_has_each_frequency_twice() {
    let plane = clamped(4, SpringPlacement::Middle, &[Z]);
    let space = clamped(4, SpringPlacement::Middle, &[Y, Z]);
    let squares = |chain: &DrivenChain| -> Vec<f64> {
        let rest = chain.chain().neutral();
        let near = chain.linearised(&mut chain.data(), &rest).unwrap();
        near.modes(Motors::Held).unwrap().iter().map(|m| m.square).collect()
    };
    let (plane, space) = (squares(&plane), squares(&space));
    let twice: Vec<f64> = plane.iter().flat_map(|&w| [w, w]).collect();
    assert!(close(&space, &twice, 1e-9), "{space:?} {twice:?}");
}

/// The damping ratio of the clamped beam's first mode.
#[test]
fn the_first_mode_of_many_segments_has_the_beams_damping() {
    let mut parameters = planar(&[LINK; 2]);
    parameters.links.truncate(1);
    parameters.links[0].motion = JointMotion::Fixed;
    parameters.links[0].inertia = None;
    let mut given = beam(0);
    (given.segments, given.springs, given.beam.damping) = (20, SpringPlacement::Middle, 0.03);
    let chain = driven(&parameters, &[given]);
    let near = chain.linearised(&mut chain.data(), &chain.chain().neutral()).unwrap();
    let modes = near.modes(Motors::Held).unwrap();
    assert!(
        (modes[0].damping_ratio - 0.03).abs() < 1e-4,
        "{}",
        modes[0].damping_ratio
    );
    assert!((modes[1].damping_ratio - 0.03 * CLAMPED[1] / CLAMPED[0]).abs() < 1e-3);
}

/// Two beams with hubs, and a load at the tip.
fn two_beams(base: Base, springs: SpringPlacement, axes: &[[f64; 3]]) -> (ChainParameters, Vec<SegmentedBeam>) {
    let mut parameters = planar(&[LINK; 2]);
    for link in &mut parameters.links {
        link.inertia = Some(LinkInertia {
            mass: 0.5,
            com: [0.0; 3],
            matrix: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]],
        });
    }
    let load = ChainLink {
        name: "load".to_owned(),
        joint: "load".to_owned(),
        parent: Some(1),
        motion: JointMotion::Fixed,
        translation: [2.0, 0.0, 0.0],
        ..parameters.links[0].clone()
    };
    parameters.links.push(load);
    parameters.base = base;
    parameters.base_inertia = parameters.links[0]
        .inertia
        .map(|inertia| LinkInertia { mass: 20.0, ..inertia });
    let beams = [0, 1].map(|link| SegmentedBeam {
        springs,
        axes: axes.to_vec(),
        ..beam(link)
    });
    (parameters, beams.to_vec())
}

/// The straight arm has the inertia of rods, hubs and load.
#[test]
fn a_straight_arm_of_beams_has_the_inertia_of_rods_with_hubs_and_a_load() {
    for springs in [SpringPlacement::Root, SpringPlacement::Middle] {
        let (parameters, beams) = two_beams(Base::Fixed, springs, &[Y, Z]);
        let chain = driven(&parameters, &beams);
        let n = chain.chain().velocities();
        let mut m = vec![0.0; n * n];
        let mut data = chain.chain().data();
        chain.chain().mass_matrix(&mut data, &vec![0.0; n], &mut m).unwrap();
        let elbow = chain.chain().joints().iter().position(|j| j == "joint1").unwrap();
        let (rod, l) = (BEAM.density * BEAM.length, BEAM.length);
        let about_elbow = 0.01 + rod * l * l / 3.0 + 0.01 + 0.5 * l * l;
        let about_shoulder = 0.03 + rod * 4.0 * l * l * 2.0 / 3.0 + 0.5 * (l * l + 4.0 * l * l);
        assert!((m[elbow * n + elbow] - about_elbow).abs() < 1e-12 * about_elbow);
        assert!(
            (m[0] - about_shoulder).abs() < 1e-12 * about_shoulder,
            "{} {about_shoulder}",
            m[0]
        );
    }
}

#[test]
fn bending_far_in_space_a_free_arm_of_beams_keeps_energy_and_momentum() {
    let (parameters, beams) = two_beams(Base::Free, SpringPlacement::Root, &[Y, Z]);
    let chain = driven(&parameters, &beams);
    let mut options = ChainSimulation::new(&chain, 2.0, 0.25).unwrap();
    options.tolerances.rtol = 1e-12;
    let positions = chain.chain().positions();
    for (i, q) in options.initial[7..positions].iter_mut().enumerate() {
        *q = 0.4 * (1.0 + 2.0 * i as f64).sin();
    }
    let record = simulate_chain(&chain, &[], &options).unwrap();
    assert!(record.column("tau_joint1").is_ok() && record.column("tau_link0_bend1a").is_err());
    let states = &record.names()[3..];
    let mut data = chain.data();
    let mut kept = |k: usize| {
        let x: Vec<f64> = states.iter().map(|name| record.column(name).unwrap()[k]).collect();
        let state = chain.state(&x).unwrap();
        let energy = chain.energy(&mut data, &state).unwrap();
        let momentum = chain.centroidal_momentum(&mut data, &state).unwrap();
        (
            energy.kinetic + energy.potential,
            [momentum.linear, momentum.angular].concat(),
        )
    };
    let (energy, _) = kept(0);
    for k in 1..record.len() {
        let (now, momentum) = kept(k);
        assert!((now - energy).abs() < 1e-9 * energy, "{k}: {now} {energy}");
        assert!(momentum.iter().all(|p| p.abs() < 1e-8), "{k}: {momentum:?}");
    }
    let bent = record.column("q_link1_bend3b").unwrap();
    assert!(bent.iter().any(|q| q.abs() > 0.3) && bent.iter().any(|q| *q < 0.0) && bent.iter().any(|q| *q > 0.0));
}

/// A tip moment M bends a beam to a circle: EI turn / L = M, in every spring the same.
#[test]
fn under_a_moment_at_its_tip_the_beam_is_an_arc_however_large() {
    let chain = clamped(8, SpringPlacement::Middle, &[Z]);
    let moment = 1.5 * BEAM.stiffness / BEAM.length;
    let n = chain.chain().velocities();
    let q = vec![moment * BEAM.length / 8.0 / BEAM.stiffness; n];
    let zero = vec![0.0; n];
    let state = DrivenState {
        q: &q,
        v: &zero,
        motor_q: &[],
        motor_v: &[],
    };
    let mut a = vec![1.0; n];
    // A couple on the last segment acts on every joint about the same axis.
    let tau = vec![moment; n];
    chain
        .accelerations(&mut chain.data(), &state, &tau, &mut a, &mut [])
        .unwrap();
    assert!(a.iter().all(|a| a.abs() < 1e-7), "{a:?}");
    assert!((q.iter().sum::<f64>() - 1.5).abs() < 1e-12);
}

#[test]
fn beams_that_cannot_be_are_refused_by_the_link() {
    type Change = fn(&mut SegmentedBeam);
    let cases: [(Change, &str); 9] = [
        (|b| b.beam.length = 0.0, "the length of its beam, m, is 0"),
        (
            |b| b.beam.stiffness = f64::NAN,
            "the stiffness of its beam, N m^2, is NaN",
        ),
        (|b| b.beam.density = -1.0, "the density of its beam, kg/m, is -1"),
        (|b| b.beam.damping = -0.1, "the damping of its beam is -0.1"),
        (|b| b.segments = 0, "the number of its beam's segments is 0"),
        (|b| b.along = [0.0; 3], "its beam needs a direction"),
        (|b| b.axes = vec![[1.0, 0.0, 0.1]], "its beam needs a direction"),
        (|b| b.axes.clear(), "its beam needs a direction"),
        (|b| b.axes = vec![Y, Y], "its beam needs a direction"),
    ];
    let (mut parameters, beams) = two_beams(Base::Fixed, SpringPlacement::Root, &[Z]);
    let message = |parameters: &ChainParameters, beam: &SegmentedBeam| {
        let refused = segmented(parameters, &[], std::slice::from_ref(beam));
        refused.unwrap_err().to_string()
    };
    for (change, want) in cases {
        let mut beam = beams[1].clone();
        change(&mut beam);
        let message = message(&parameters, &beam);
        assert!(message.starts_with(&format!("link 'link1': {want}")), "{message}");
    }
    parameters.links[1].inertia = None;
    assert!(message(&parameters, &beams[1]).contains("link 'link1': its joint moves nothing but the spring"));
    let middle = SegmentedBeam {
        springs: SpringPlacement::Middle,
        ..beams[1].clone()
    };
    let (parameters, drives) = segmented(&parameters, &[], &[middle]).unwrap();
    let chain = Chain::new(&parameters).unwrap();
    assert!(DrivenChain::new(chain, &drives, RotorCoupling::None).is_ok());
}

/// A part without mass turns only where what it carries turns across it.
#[test]
fn a_crosspiece_needs_no_mass_and_a_part_that_turns_alone_does() {
    let mut parameters = planar(&[LINK; 2]);
    parameters.links[0].inertia = None;
    let message = Chain::new(&parameters).unwrap_err().to_string();
    assert!(message.starts_with("link 'link0': it moves, but"), "{message}");
    parameters.links[1].axis = Y;
    let chain = Chain::new(&parameters).unwrap();
    let (mut data, mut a) = (chain.data(), [0.0; 2]);
    let tau = [0.3, -0.2];
    chain
        .forward_dynamics(&mut data, &[0.4, 0.3], &[0.5, 0.7], &tau, &mut a)
        .unwrap();
    let mut back = [0.0; 2];
    chain
        .inverse_dynamics(&mut data, &[0.4, 0.3], &[0.5, 0.7], &a, &mut back)
        .unwrap();
    assert!(close(&back, &tau, 1e-12), "{back:?}");
}

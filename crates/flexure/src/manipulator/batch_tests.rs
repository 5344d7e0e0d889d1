//! Arms in lanes against the same arms one after the other.

use super::*;
use crate::error::{Error, SimulationError};
use crate::manipulator::{ArmParameters, Friction, JointKind, State, space_arm};

fn go_on(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Noise from -1 to 1.
fn noise(seed: usize, rows: usize) -> Vec<f64> {
    (0..rows)
        .map(|k| (((seed + 1) * (k + 7)) as f64 * 78.233).sin())
        .collect()
}

/// What a run needs, owned.
struct Job {
    arm: Arm,
    kind: usize,
    samples: [Vec<f64>; 2],
    options: SimulationOptions,
}

impl Job {
    fn new(i: usize, parameters: ArmParameters, kind: usize, torque: f64) -> Self {
        let rows = 40 + 7 * (i % 5);
        let mut options = SimulationOptions::new((rows - 1) as f64 * 0.01, 0.01).unwrap();
        let q = [0.1 * i as f64, 0.5 - 0.2 * i as f64];
        options.initial = State {
            q,
            qm: q.map(|q| q + 1e-3 * i as f64),
            ..State::default()
        };
        let samples = [noise(i, rows), noise(i + 100, rows)].map(|v| v.into_iter().map(|v| torque * v).collect());
        let arm = Arm::new(parameters).unwrap();
        Job {
            arm,
            kind,
            samples,
            options,
        }
    }

    fn run(&self) -> ArmRun<'_> {
        let samples = [self.samples[0].as_slice(), self.samples[1].as_slice()];
        let drive = match self.kind {
            0 => Drive::Held(samples),
            1 => Drive::Deflection(samples),
            2 => Drive::Servo {
                reference: samples,
                gains: [[300.0, 20.0], [200.0, 10.0]],
            },
            _ => Drive::Torque(&|t| [t.sin(), 0.2]),
        };
        ArmRun {
            arm: &self.arm,
            drive,
            options: self.options,
        }
    }
}

/// An arm of other values for every `i`.
fn parameters(i: usize, kind: JointKind) -> ArmParameters {
    let mut p = space_arm(kind);
    p.links[1].mass *= 1.0 + 0.05 * i as f64;
    p.joints[0].stiffness += 10.0 * i as f64;
    p.joints[1].cubic += 20.0 * i as f64;
    p.joints[0].damping = 0.1 * (i % 2) as f64;
    p
}

/// Arms of all kinds under all drives: full groups and others, and some that fail.
fn jobs() -> Vec<Job> {
    let mut jobs = Vec::new();
    for i in 0..19 {
        jobs.push(Job::new(i, parameters(i, JointKind::Nonlinear), 0, 20.0));
    }
    // One that runs away, one that overflows, and one that is refused, among others.
    jobs[3].samples[0][20] = 1e12;
    jobs[9].samples[1][5] = 1e308;
    jobs[11].samples[0][3] = f64::NAN;
    for i in 0..11 {
        let kind = [JointKind::Rigid, JointKind::Linear][i % 2];
        jobs.push(Job::new(i, parameters(i, kind), 0, 10.0));
        jobs.push(Job::new(i, parameters(i, JointKind::Nonlinear), 1, 0.05));
        jobs.push(Job::new(i, parameters(i, JointKind::Nonlinear), 2, 0.3));
    }
    for i in 0..5 {
        let mut locked = parameters(i, JointKind::Nonlinear);
        locked.joints[i % 2].locked = true;
        locked.joints[0].motor_friction = Some(Friction([0.1, 20.0, 10.0, 0.3, 30.0, 0.1]));
        jobs.push(Job::new(i, locked, 0, 5.0));
        jobs.push(Job::new(i, parameters(i, JointKind::Nonlinear), 3, 0.0));
        let mut few = Job::new(i, parameters(i, JointKind::Nonlinear), 0, 20.0);
        few.options.tolerances.max_steps = 80 + 20 * i as u64;
        jobs.push(few);
    }
    for i in 0..6 {
        // Steps and instants are few; one arm needs more steps than its neighbours.
        let mut tight = Job::new(
            0,
            parameters(i, JointKind::Nonlinear),
            0,
            if i == 2 { 3e4 } else { 1.0 },
        );
        tight.options.tolerances.max_steps = 150;
        jobs.push(tight);
    }
    jobs
}

fn assert_same(found: &[Result<Record>], expected: &[Result<Record>]) {
    assert_eq!(found.len(), expected.len());
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        match (found, expected) {
            (Ok(found), Ok(expected)) => {
                assert!(found.columns().count() > 0 && found.columns().count() == expected.columns().count());
                for ((name, a), (expected_name, b)) in found.columns().zip(expected.columns()) {
                    assert_eq!(name, expected_name);
                    let bits = |v: &[f64]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                    assert_eq!(bits(a), bits(b), "run {i}, {name}");
                }
            }
            (Err(found), Err(expected)) => assert_eq!(found.to_string(), expected.to_string(), "run {i}"),
            other => panic!("run {i}: {other:?}"),
        }
    }
}

#[test]
fn arms_in_lanes_move_as_they_do_alone_to_the_last_bit() {
    let jobs = jobs();
    let runs: Vec<ArmRun> = jobs.iter().map(Job::run).collect();
    let alone = on(None, &runs, &go_on);
    let errors: Vec<String> = alone
        .iter()
        .flat_map(|run| run.as_ref().err())
        .map(Error::to_string)
        .collect();
    for reason in ["rad/s", "too long", "NaN", "max_steps"] {
        assert!(
            errors.iter().any(|error| error.contains(reason)),
            "{reason}: {errors:#?}"
        );
    }
    assert!(alone.iter().filter(|record| record.is_ok()).count() > 40);
    for wide in Wide::all() {
        for threads in [1, 2, 40] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_same(&pool.install(|| on(Some(wide), &runs, &go_on)), &alone);
        }
        // Other neighbours.
        let backwards: Vec<ArmRun> = runs.iter().rev().copied().collect();
        let mut found = on(Some(wide), &backwards, &go_on);
        found.reverse();
        assert_same(&found, &alone);
    }
}

#[test]
fn the_lanes_stop_where_their_watcher_says() {
    let jobs = jobs();
    let runs: Vec<ArmRun> = jobs[..8].iter().map(Job::run).collect();
    let until = |t: f64| {
        if t < 0.2 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    };
    let alone = on(None, &runs, &until);
    assert!(matches!(alone[0], Err(Error::Stopped(_))));
    assert!(matches!(
        alone[3],
        Err(Error::Stopped(_) | Error::Simulation(SimulationError { .. }))
    ));
    Wide::all().for_each(|wide| assert_same(&on(Some(wide), &runs, &until), &alone));
}

#[test]
fn no_arm_is_no_work() {
    assert!(simulate_batch(&[], &go_on).is_empty());
}

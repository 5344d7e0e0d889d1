//! Every long method ends wherever it is interrupted, without a panic, and says so.

use crate::error::Stopped;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::identify::robot_joint::{FlexibleJoint, RigidJoint, TwoLinkLog};
use crate::identify::{
    AUTO, HAMMERSTEIN_WIENER, JOINT_INPUTS, MULTIPLE_INPUTS, NARX, Options, PARALLEL, PlainHammerstein,
    RefinedHammerstein, Request, VOLTERRA, WIENER, WIENER_HAMMERSTEIN,
};
use crate::manipulator::{Arm, Drive, JointKind, SimulationOptions, add_noise, simulate, space_arm};
use crate::nonlinearity::{EstimatorName, NamedEstimator, Rule, Tuning};
use crate::parallel::map;
use crate::record::Record;
use crate::signal::{Phases, multisine};

/// Asked so often, a method has been asked often enough to stop soon.
const OFTEN: u64 = 6;
/// Places at which a method is interrupted.
const PLACES: u64 = 6;

/// Interrupts the work at places spread over its whole course. `work` returns its result or its error.
fn stops(name: &str, work: impl Fn() -> Result<()>) {
    let all = u64::MAX;
    let whole = Interrupt::after(all);
    whole
        .watch(&work)
        .unwrap()
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    let asked = all - whole.left();
    assert!(asked >= OFTEN, "{name} is asked {asked} times");
    for place in 0..PLACES {
        // At the very beginning, then later and later.
        let interrupt = Interrupt::after(place * (asked - 1) / (PLACES - 1));
        let outcome = interrupt.watch(&work).map(|_| ());
        // Parallel parts are asked in no fixed order, and their number may differ by a few.
        let late = place + 1 == PLACES;
        assert!(
            outcome == Err(Error::Stopped(Stopped::Interrupted)) || late,
            "{name} at {place}: {outcome:?}"
        );
    }
}

/// Inputs p and q, and outputs: a Hammerstein system's, a cascade's with two linear parts, and one of both inputs.
fn record(n: usize) -> Record {
    let mut random = Pcg64::seed_from_u64(7);
    let mut white = || (0..n).map(|_| random.random_range(-2.0..2.0)).collect::<Vec<f64>>();
    let (p, q, noise) = (white(), white(), white());
    let filtered = |x: &[f64], a: f64| -> Vec<f64> {
        let mut last = 0.0;
        let each = x.iter().map(|x| {
            last = a * last + (1.0 - a) * x;
            last
        });
        each.collect()
    };
    let noisy = |x: Vec<f64>| -> Vec<f64> { x.iter().zip(&noise).map(|(x, e)| x + 0.01 * e).collect() };
    let bent = |x: &[f64]| -> Vec<f64> { x.iter().map(|x| (2.0 * x).tanh()).collect() };
    let hammerstein = filtered(&bent(&p), 0.6);
    let wiener_hammerstein = filtered(&bent(&filtered(&p, 0.5)), 0.6);
    let products: Vec<f64> = p.iter().zip(&q).map(|(p, q)| p * q + p.tanh()).collect();
    let both = filtered(&products, 0.6);
    Record::new([
        ("h", noisy(hammerstein)),
        ("s", noisy(wiener_hammerstein)),
        ("b", noisy(both)),
        ("p", p),
        ("q", q),
    ])
    .unwrap()
}

#[test]
fn a_watch_ends_with_its_work() {
    let (outer, inner) = (Interrupt::default(), Interrupt::default());
    inner.stop();
    assert!(!requested() && check().is_ok());
    let found = outer.watch(|| {
        assert_eq!(inner.watch(requested), Err(Error::Stopped(Stopped::Interrupted)));
        assert!(!requested());
        assert_eq!(
            inner.watch(|| current().is_requested()),
            Err(Error::Stopped(Stopped::Interrupted))
        );
        outer.stop();
        assert!(requested() && check() == Err(Error::Stopped(Stopped::Interrupted)));
    });
    assert_eq!(found, Err(Error::Stopped(Stopped::Interrupted)));
    assert!(!requested());
    let panicked = catch_unwind(AssertUnwindSafe(|| outer.watch(|| panic!("as any work may"))));
    assert!(panicked.is_err() && !requested());
}

/// Jobs of a parallel loop ask by themselves and in what they call, and the loop ends without their results.
#[test]
fn a_parallel_loop_ends_between_its_jobs_and_within_them() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    for nested in [false, true] {
        let interrupt = Interrupt::default();
        let done = AtomicUsize::new(0);
        let outcome = interrupt.watch(|| {
            crate::parallel::map(1000, |i| {
                if i == 500 {
                    interrupt.stop();
                }
                if nested {
                    crate::parallel::map(3, |_| leave());
                    leave();
                }
                done.fetch_add(1, Ordering::Relaxed);
            })
        });
        assert_eq!(outcome, Err(Error::Stopped(Stopped::Interrupted)));
        assert!(done.into_inner() < 1000);
    }
    // Where nothing watches, nothing ends.
    assert_eq!(crate::parallel::map(10, |i| i).len(), 10);
}

/// What a thread of rayon's pool does meanwhile for another computation must not stop with this one.
#[test]
fn threads_of_the_pool_ask_only_what_they_were_given() {
    let interrupt = Interrupt::default();
    interrupt.stop();
    let outcome = interrupt.watch(|| {
        let given = current();
        rayon::join(
            || assert!(!requested() && given.is_requested()),
            || assert!(!current().is_requested()),
        );
    });
    assert_eq!(outcome, Err(Error::Stopped(Stopped::Interrupted)));
}

/// A pool that does nothing else is asked as a thread is; one that may do other work is not.
#[test]
fn alone_in_a_pool_the_work_stops() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let record = record(1500);
    let refined = RefinedHammerstein::default();
    let identify = || refined.identify(&record, "p", "h").map(drop);
    let [alone, shared] = [true, false].map(|alone| {
        let interrupt = Interrupt::after(OFTEN);
        let mut outcome = None;
        let _ = pool.install(|| interrupt.watch_as(alone, || outcome = Some(identify())));
        outcome
    });
    assert!(matches!(alone, None | Some(Err(Error::Stopped(Stopped::Interrupted)))));
    assert_eq!(shared, Some(Ok(())));
    assert!(!pool.install(requested));
}

#[test]
fn hammerstein_systems_stop() {
    let record = record(1500);
    let white = PlainHammerstein::default();
    stops("plain", || white.identify(&record, "p", "h").map(drop));
    let refined = RefinedHammerstein::default();
    stops("refined", || refined.identify(&record, "p", "h").map(drop));
}

#[test]
fn cascades_stop() {
    let record = record(1200);
    let (u, y) = ("p", "s");
    stops("Wiener", || WIENER.identify(&record, &[u], y).map(drop));
    stops("wiener-hammerstein", || {
        WIENER_HAMMERSTEIN.identify(&record, &[u], y).map(drop)
    });
    stops("both ends", || HAMMERSTEIN_WIENER.identify(&record, &[u], y).map(drop));
    stops("auto", || AUTO.identify(&record, &[u], y).map(drop));
}

#[test]
fn sums_and_references_stop() {
    let record = record(1000);
    let (u, y) = ("p", "h");
    stops("parallel", || {
        let options = Options {
            branches: Some(1),
            ..Options::default()
        };
        let (records, inputs) = ([&record], [u]);
        let request = &Request::new(&records, &inputs, y, options);
        PARALLEL
            .identify_with(request, &mut |_| ControlFlow::Continue(()))
            .map(drop)
    });
    stops("NARX", || NARX.identify(&record, &[u], y).map(drop));
    stops("Volterra", || VOLTERRA.identify(&record, &[u], y).map(drop));
    let (inputs, y) = (["p", "q"], "b");
    stops("several inputs", || {
        MULTIPLE_INPUTS.identify(&record, &inputs, y).map(drop)
    });
    stops("joint inputs", || JOINT_INPUTS.identify(&record, &inputs, y).map(drop));
}

#[test]
fn joints_stop() {
    let (rows, step) = (10_001, 2e-3);
    let torque = |amplitude, seed| multisine(rows, step, amplitude, 0.05, 3.0, Phases::Random { seed }).unwrap();
    let (first, second) = (torque(40.0, 1), torque(20.0, 2));
    let options = SimulationOptions::new((rows - 1) as f64 * step, step).unwrap();
    let run = |locked: bool, model| {
        let mut parameters = space_arm(model);
        parameters.joints[0].locked = locked;
        let arm = Arm::new(parameters).unwrap();
        let record = simulate(&arm, &Drive::Held([&first, &second]), &options).unwrap();
        let angles = ["q1", "q2", "qm1", "qm2"]
            .into_iter()
            .filter(|name| record.column(name).is_ok());
        let noise = angles.map(|name| (name, 1e-5)).chain([("tau1", 0.4), ("tau2", 0.2)]);
        add_noise(&record, 5, &noise.collect::<Vec<_>>()).unwrap()
    };
    let columns = |record: &Record, names: [&str; 2]| names.map(|name| record.column(name).unwrap().to_vec());
    let (axis, joint, arm) = (
        run(true, JointKind::Rigid),
        run(true, JointKind::Nonlinear),
        run(false, JointKind::Nonlinear),
    );
    stops("rigid axis", || {
        let joint = RigidJoint {
            position: axis.column("q2")?,
            torque: axis.column("tau2")?,
            velocity: None,
            load: None,
            sample_time: step,
            extras: &[],
            level: 0.95,
        };
        joint.identify().map(drop)
    });
    stops("flexible joint", || {
        let joint = FlexibleJoint {
            motor: joint.column("qm2")?,
            link: joint.column("q2")?,
            torque: joint.column("tau2")?,
            load: None,
            sample_time: step,
            motor_inertia: None,
            level: 0.95,
        };
        joint.identify().map(drop)
    });
    let (motor, link, torque) = (
        columns(&arm, ["qm1", "qm2"]),
        columns(&arm, ["q1", "q2"]),
        columns(&arm, ["tau1", "tau2"]),
    );
    stops("two links", || {
        let log = TwoLinkLog {
            motor: [&motor[0], &motor[1]],
            link: [&link[0], &link[1]],
            torque: [&torque[0], &torque[1]],
            sample_time: step,
            level: 0.95,
        };
        log.identify().map(drop)
    });
}

#[test]
fn regressions_stop() {
    let mut random = Pcg64::seed_from_u64(9);
    let n = 3000;
    let columns: Vec<Vec<f64>> = (0..3)
        .map(|_| (0..n).map(|_| random.random_range(-1.0..1.0)).collect())
        .collect();
    let (x, y) = ([&columns[0][..], &columns[1][..]], &columns[2][..]);
    use EstimatorName::{Kernel, LocalBandwidth, LocalLinear, Neighbours, Network, Spline};
    for (name, d, rule) in [
        (Kernel, 1, Rule::LeaveOneOut),
        (Kernel, 1, Rule::Block),
        (Kernel, 2, Rule::LeaveOneOut),
        (LocalLinear, 1, Rule::LeaveOneOut),
        (LocalLinear, 2, Rule::LeaveOneOut),
        (LocalBandwidth, 1, Rule::LeaveOneOut),
        (Neighbours, 2, Rule::LeaveOneOut),
        (Spline, 1, Rule::Block),
        (Network, 1, Rule::LeaveOneOut),
    ] {
        let method = NamedEstimator {
            name,
            tuning: Tuning::FromData(rule),
            ..NamedEstimator::default()
        };
        stops(&format!("{} in {d} columns by {}", name.name(), rule.name()), || {
            method.fit(&x[..d], y, None).map(drop)
        });
    }
}

/// The jobs of a loop are counted, those of loops within them are not, and none where nothing watches.
#[test]
fn the_outermost_loop_says_how_far_it_is() {
    let interrupt = Interrupt::default();
    assert_eq!(interrupt.progress(), None);
    let seen = interrupt.watch(|| {
        let inner = |i: usize| map(3, |k| k).len() + i;
        let sums = map(5, inner);
        assert_eq!(sums, [3, 4, 5, 6, 7]);
        let after_first = interrupt.progress();
        map(2, |i| i);
        (after_first, interrupt.progress())
    });
    assert_eq!(seen, Ok((Some((5, 5)), Some((2, 2)))));
    let seen = interrupt.watch(|| {
        let during: Vec<_> = rounds(4)
            .take(3)
            .map(|round| (map(5, |i| i).len() + round, interrupt.progress()))
            .collect();
        let after = interrupt.progress();
        map(2, |i| i);
        (during, after)
    });
    let of_four = |done| Some((done, 4));
    assert_eq!(
        seen,
        Ok((vec![(5, of_four(0)), (6, of_four(1)), (7, of_four(2))], None))
    );
    map(7, |i| i);
    Interrupt::report(1, 9);
    assert_eq!(interrupt.progress(), Some((2, 2)));
    interrupt.watch(|| Interrupt::report(4, 9)).unwrap();
    assert_eq!(interrupt.progress(), Some((4, 9)));
}

//! The implicit method and the choice of the method, against problems with known solutions.

use super::*;
use crate::error::{Error, IntegrationFailure, SimulationError, Stopped};
use crate::linalg::Complex;
use crate::simulation::{Sampling, run_held};

fn go_on(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn tolerances(rtol: f64, atol: f64) -> Tolerances {
    Tolerances {
        rtol,
        atol,
        ..Tolerances::default()
    }
}

fn start<X: StateVector>(x: X, tolerances: Tolerances, integrator: Integrator) -> Integration<X> {
    Integration::new(0.0, x, tolerances, integrator).unwrap()
}

/// One implicit step of size 1.
fn one_step(x: f64, f: impl Fn(f64, &[f64; 1]) -> [f64; 1]) -> f64 {
    let mut run = start([x], tolerances(0.1, 1e6), Integrator::Radau);
    run.run.control.step = Some(1.0);
    run.advance(&f, 1.0, &mut go_on).unwrap();
    assert_eq!(run.statistics().accepted, 1);
    run.x()[0]
}

#[test]
fn a_step_is_exact_for_polynomials_up_to_degree_12() {
    for degree in 0..=13 {
        let off = one_step(0.0, |t, _| [t.powi(degree)]) - 1.0 / f64::from(degree + 1);
        assert_eq!(off.abs() < 1e-14, degree <= 12, "degree {degree}: {off:e}");
    }
}

/// The stability function of the method is the quotient of polynomials of degrees 6 and 7 that is closest to the exponential at 0.
#[test]
fn a_step_multiplies_a_decay_by_its_pade_approximation() {
    for z in [-0.5_f64, -3.0, -20.0, -1e3] {
        let (mut numerator, mut denominator) = ((1.0, 1.0), (1.0, 1.0));
        for k in 0..7 {
            let k = f64::from(k);
            denominator.1 *= -z * (7.0 - k) / ((k + 1.0) * (13.0 - k));
            denominator.0 += denominator.1;
            numerator.1 *= z * (6.0 - k) / ((k + 1.0) * (13.0 - k));
            numerator.0 += numerator.1;
        }
        let (found, want) = (one_step(1.0, |_, x| [z * x[0]]), numerator.0 / denominator.0);
        assert!((found - want).abs() < 1e-6, "{z}: {found} {want}");
    }
}

#[test]
fn errors_follow_the_tolerance_and_steps_its_eighth_root() {
    let pair = |t: f64, x: &[f64; 2]| {
        [
            x[1] + (3.0 * t).cos(),
            -x[0] * (1.0 + 0.5 * (2.0 * t).sin()) - x[1].sin(),
        ]
    };
    let run = |rtol: f64, integrator| {
        let mut run = start([1.0, 0.3], tolerances(rtol, rtol), integrator);
        run.advance(&pair, 20.0, &mut go_on).unwrap();
        (*run.x(), run.statistics().accepted as f64)
    };
    let (exact, _) = run(1e-13, Integrator::Dop853);
    let steps = [1e-4, 1e-6, 1e-8, 1e-10].map(|rtol| {
        let (x, steps) = run(rtol, Integrator::Radau);
        let off = (x[0] - exact[0]).hypot(x[1] - exact[1]);
        assert!(off < 10.0 * rtol, "{rtol}: {off:e}");
        steps
    });
    let order = 6.0 * 10.0_f64.ln() / (steps[3] / steps[0]).ln();
    println!("steps {steps:?}: the error of a step falls with the power {order:.1}");
    assert!((6.5..11.0).contains(&order), "{order}");
}

/// Masses of 1 kg between walls with springs k and dampers beta k: a force on the first that is held, and the sum of the modes.
#[test]
fn a_stiff_chain_of_masses_moves_as_its_modes() {
    const N: usize = 5;
    let (k, beta, period) = (1e10, 1e-4, 0.02);
    let force = |row: usize| 1e6 * (1.3 * row as f64).sin();
    let plant = |x: &[f64; 2 * N], u: &f64| {
        let mut rates = [0.0; 2 * N];
        for i in 0..N {
            rates[i] = x[N + i];
            let of = |j: usize| x[j] + beta * x[N + j];
            let sides = [i.checked_sub(1), Some(i + 1).filter(|j| *j < N)].into_iter().flatten();
            rates[N + i] = k * (sides.map(of).sum::<f64>() - 2.0 * of(i)) + if i == 0 { *u } else { 0.0 };
        }
        rates
    };
    let sampling = Sampling::new(0.2, period).unwrap();
    let mut modes = [[Complex::new(0.0, 0.0); 2]; N];
    let mut exact = Vec::new();
    for row in 0..sampling.rows() {
        let mut x = [0.0; 2 * N];
        for (m, state) in modes.iter_mut().enumerate() {
            let angle = std::f64::consts::PI * (m + 1) as f64 / (N + 1) as f64;
            let shape = |i: usize| (2.0 / (N + 1) as f64).sqrt() * (angle * (i + 1) as f64).sin();
            for i in 0..N {
                x[i] += shape(i) * state[0].re;
                x[N + i] += shape(i) * state[1].re;
            }
            let square = 4.0 * k * (0.5 * angle).sin().powi(2);
            let half = Complex::new(-0.5 * beta * square, 0.0);
            let root = (half * half - square).sqrt();
            let (fast, slow) = (half - root, square / (half - root));
            let rest = Complex::new(force(row) * shape(0) / square, 0.0);
            let a = (state[1] - slow * (state[0] - rest)) / (fast - slow);
            let b = state[0] - rest - a;
            let (a, b) = (a * (fast * period).exp(), b * (slow * period).exp());
            *state = [rest + a + b, fast * a + slow * b];
        }
        exact.push(x);
    }
    let count = |integrator| {
        let mut run = start([0.0; 2 * N], Tolerances::default(), integrator);
        let mut worst = [0.0_f64; 2];
        let row = &mut |row: usize, x: &[f64; 2 * N], _: &f64| {
            for i in 0..2 * N {
                worst[i / N] = worst[i / N].max((x[i] - exact[row][i]).abs());
            }
        };
        run_held(&mut run, plant, |row, _| force(row), &sampling, row, &mut go_on).unwrap();
        println!("{integrator:?}: {:?}, off by {worst:?}", run.statistics());
        // Positions are some 1e-4 m.
        assert!(worst[0] < 1e-12 && worst[1] < 1e-9, "{integrator:?}: {worst:?}");
        run.statistics().evaluations
    };
    let (explicit, automatic) = (count(Integrator::Dop853), count(Integrator::Automatic));
    assert!(20 * automatic < explicit && 20 * count(Integrator::Radau) < explicit);
}

fn van_der_pol(_: f64, x: &[f64; 2]) -> [f64; 2] {
    [x[1], 1e6 * ((1.0 - x[0] * x[0]) * x[1] - x[0])]
}

fn robertson(_: f64, x: &[f64; 3]) -> [f64; 3] {
    let (slow, back, fast) = (0.04 * x[0], 1e4 * x[1] * x[2], 3e7 * x[1] * x[1]);
    [back - slow, slow - back - fast, fast]
}

/// The values are those of SciPy's Radau with rtol = 1e-12 and atol = 1e-15; `scripts/reference/radau.py` makes them.
#[test]
fn stiff_problems_end_where_they_do_by_scipy() {
    for integrator in [Integrator::Automatic, Integrator::Radau] {
        let mut run = start([2.0, 0.0], tolerances(1e-10, 1e-13), integrator);
        run.advance(&van_der_pol, 1.0, &mut go_on).unwrap();
        let want: [f64; 2] = [-1.8636462548081032, 0.7535430865435665];
        let near =
            |limit: f64, want: &[f64], x: &[f64]| want.iter().zip(x).all(|(a, b)| (a - b).abs() < limit * a.abs());
        assert!(near(1e-8, &want, run.x()), "{:?}", run.x());
        assert!(run.statistics().evaluations < 20_000, "{:?}", run.statistics());

        let mut run = start([1.0, 0.0, 0.0], tolerances(1e-10, 1e-14), integrator);
        run.advance(&robertson, 100.0, &mut go_on).unwrap();
        let want = [0.6172348823963034, 6.1535912746442145e-06, 0.38275896401242315];
        assert!(near(1e-9, &want, run.x()), "{:?}", run.x());
        assert!(run.statistics().evaluations < 5000, "{:?}", run.statistics());
    }
}

#[test]
fn what_is_not_stiff_takes_the_steps_of_the_explicit_method() {
    // A fast oscillation without damping beside a slow one.
    let oscillators = |_: f64, x: &[f64; 4]| [x[1], -x[0], x[3], -1e4 * x[2]];
    for rtol in [1e-3, 1e-6, 1e-9, 1e-12] {
        let [automatic, explicit] = [Integrator::Automatic, Integrator::Dop853].map(|integrator| {
            let mut run = start([1.0, 0.0, 0.3, 0.0], tolerances(rtol, 1e-3 * rtol), integrator);
            run.advance(&oscillators, 30.0, &mut go_on).unwrap();
            (run.x().map(f64::to_bits), run.statistics())
        });
        assert_eq!(automatic, explicit, "{rtol}");
    }
}

/// What is stiff for a while: steep friction of a wheel that a torque turns now and then.
#[test]
fn the_method_changes_and_every_run_takes_the_same_steps() {
    let wheel = |t: f64, x: &[f64; 2]| [x[1], 20.0 * (2.0 * t).sin() - 10.0 * (1e5 * x[1]).tanh()];
    let run = |integrator| {
        let mut run = start([0.0, 0.0], Tolerances::default(), integrator);
        run.advance(&wheel, 3.0, &mut go_on).unwrap();
        (run.x().map(f64::to_bits), run.statistics())
    };
    let (first, again, explicit) = (
        run(Integrator::Automatic),
        run(Integrator::Automatic),
        run(Integrator::Dop853),
    );
    assert_eq!(first, again);
    println!("{:?}, explicit {:?}", first.1, explicit.1);
    assert!(10 * first.1.evaluations < explicit.1.evaluations);
    let off = first
        .0
        .into_iter()
        .zip(explicit.0)
        .map(|(a, b)| (f64::from_bits(a) - f64::from_bits(b)).abs());
    assert!(off.fold(0.0, f64::max) < 1e-7);
}

/// The error of an implicit run to 1 s.
fn failure(x: [f64; 2], limit: u64, f: impl Fn(f64, &[f64; 2]) -> [f64; 2]) -> (f64, IntegrationFailure) {
    let tolerances = Tolerances {
        max_steps: limit,
        ..Tolerances::default()
    };
    let mut run = start(x, tolerances, Integrator::Radau).with_speeds_from(1);
    match run.advance(&f, 1.0, &mut go_on) {
        Err(Error::Simulation(SimulationError { time, reason })) => (time, reason),
        other => panic!("{other:?}"),
    }
}

#[test]
fn failures_are_those_of_the_explicit_method() {
    let (time, reason) = failure([0.0, 0.0], 1000, |_, _| [f64::NAN, 0.0]);
    assert!(
        time == 0.0 && matches!(reason, IntegrationFailure::NotFinite),
        "{reason}"
    );
    let (time, reason) = failure([0.0, 1.0], 1000, |t, x| [x[1], if t > 0.5 { f64::NAN } else { -x[1] }]);
    assert!(
        time <= 0.5 && matches!(reason, IntegrationFailure::StepTooSmall { .. }),
        "{reason}"
    );
    let (time, _) = failure([2.0, 0.0], 1000, |_, x| [x[0] * x[0], 0.0]);
    assert!((time - 0.5).abs() < 1e-3, "{time}");
    let (_, reason) = failure([0.0, 0.0], 1000, |_, x| [x[1], 1e16 - (1e4 * x[1]).tanh()]);
    assert!(matches!(reason, IntegrationFailure::TooFast { .. }), "{reason}");
    let (_, reason) = failure([2.0, 0.0], 5, van_der_pol);
    assert!(
        matches!(reason, IntegrationFailure::TooManySteps { limit: 5, .. }),
        "{reason}"
    );
    // J = REAL / h is a singular matrix for the first step; a smaller one has another.
    let growth = crate::simulation::radau_tableau::REAL / 0.25;
    let mut run = start([1.0], tolerances(0.1, 1e9), Integrator::Radau);
    run.run.control.step = Some(0.25);
    run.advance(&|_, x: &[f64; 1]| [growth * x[0]], 0.25, &mut go_on)
        .unwrap();
    assert!(run.statistics().accepted > 1, "{:?}", run.statistics());
}

#[test]
fn watching_stops_an_implicit_run() {
    let mut run = start([2.0, 0.0], Tolerances::default(), Integrator::Radau);
    let stopped = run.advance(&van_der_pol, 1.0, &mut |_| ControlFlow::Break(()));
    assert!(
        matches!(stopped, Err(Error::Stopped(Stopped::Simulating { .. }))),
        "{stopped:?}"
    );
    assert_eq!(run.statistics().accepted, IMPLICIT_STEPS_PER_CALL);
}

//! The condensed minimum is that of the equations.

use super::*;
use crate::identify::robot_joint::division::FRICTION;
use crate::identify::robot_joint::form_fit::FormEquations;
use crate::identify::robot_joint::forms::FormName;
use crate::identify::robot_joint::system::CurveKind;
use crate::linalg::Complex;

/// A curve of the velocity and an inertia, with a known answer: the condensed minimum is that of the equations themselves.
#[test]
fn the_minimum_is_that_of_the_equations() {
    let n = 6000;
    let step = 0.01;
    let at = |i: usize| step * i as f64;
    let v: Vec<f64> = (0..n)
        .map(|i| (0.7 * at(i)).sin() + 0.5 * (1.9 * at(i)).cos())
        .collect();
    let a: Vec<f64> = (0..n)
        .map(|i| 0.7 * (0.7 * at(i)).cos() - 0.95 * (1.9 * at(i)).sin())
        .collect();
    let tau: Vec<f64> = v
        .iter()
        .zip(&a)
        .map(|(v, a)| 3.0 * a + 2.0 * (8.0 * v).tanh() + 0.5 * v)
        .collect();
    let modulation = Modulation::new(n, step, 10.0);
    let lines = |x: &[f64]| -> Vec<Complex<f64>> { modulation.of(x) };
    let noise = vec![1e-4; modulation.len()];
    let curve = Curve {
        kind: CurveKind::Friction,
        x: &v,
        signs: vec![1.0],
        noise: Vec::new(),
        resolution: 0.0,
        division: &FRICTION,
        after: 0,
        passages: &[],
    };
    let beside: Splines = curve.splines(&modulation, 5);
    let forms = FormEquations {
        fixed: Equations {
            columns: vec![vec![Some(lines(&a))]],
            right: vec![lines(&tau)],
            noise: vec![&noise],
            noisy: Vec::new(),
            given: Vec::new(),
        },
        curves: vec![FormedCurve {
            terms: FormName::SmoothCoulomb.terms(false),
            curve: &curve,
            beside: Some(&beside),
        }],
        modulation: &modulation,
    };
    assert_eq!(forms.curves[0].terms, vec![Term::Tanh, Term::Linear]);
    let condensed = forms.condensed().unwrap();
    let near = |got: f64, want: f64, share: f64| assert!((got - want).abs() < share * want, "{got}, not {want}");
    for start in [1.0_f64, 40.0] {
        let lowest = condensed.minimum(&forms.curves, &[start.ln()], None).unwrap();
        near(lowest.logs[0].exp(), 8.0, 0.01);
        near(lowest.factors[0], 2.0, 0.01);
        near(lowest.factors[1], 0.5, 0.05);
    }
    // A step in the equations themselves ends at the truth, except for the errors of the sums at the velocity's sign changes.
    let fit = forms.fit(&condensed, &[vec![20.0_f64.ln()]]).unwrap();
    near(fit.curves[0].logs[0].exp(), 8.0, 1e-3);
    near(fit.solution.x[0], 3.0, 1e-3);
    for interval in &fit.intervals[1..] {
        assert!(interval[0] < interval[1], "{interval:?}");
    }
    // What is held stays, and everything else makes up for it: no lower than the minimum.
    let free = condensed.minimum(&forms.curves, &[2.0], None).unwrap();
    let (factor, log) = (FormParameter::Factor, FormParameter::Log);
    for (parameter, value) in [(factor(0), 1.5), (factor(1), 0.0), (log(0), 2.5)] {
        let held = Held { parameter, value };
        let found = condensed.minimum(&forms.curves, &[2.0], Some(held)).unwrap();
        assert_eq!(found.value(parameter), value);
        assert!(found.objective > free.objective);
    }
}

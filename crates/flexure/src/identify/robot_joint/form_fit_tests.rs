//! Frictions (12) that no arm has, and what takes their place.

use super::*;
use crate::identify::robot_joint::division::FRICTION;
use crate::identify::robot_joint::forms::FormName;
use crate::identify::robot_joint::system::{Curve, CurveKind};

/// A friction over the velocities v.
fn friction_over(v: &[f64]) -> Curve<'_> {
    Curve {
        kind: CurveKind::Friction,
        x: v,
        signs: vec![1.0],
        noise: Vec::new(),
        resolution: 0.0,
        division: &FRICTION,
        after: 0,
        passages: &[],
    }
}

/// Splines without their transformed columns.
fn untransformed(v: &[f64]) -> Splines {
    Splines {
        basis: crate::identify::robot_joint::basis::Basis::friction(v, 5),
        lines: Vec::new(),
    }
}

/// Equations of nothing but a friction (12), without their right-hand side.
fn friction_alone<'a>(curve: &'a Curve<'a>, beside: &'a Splines, modulation: &'a Modulation) -> FormEquations<'a> {
    FormEquations {
        fixed: Equations {
            columns: Vec::new(),
            right: Vec::new(),
            noise: Vec::new(),
            noisy: Vec::new(),
            given: Vec::new(),
        },
        curves: vec![FormedCurve {
            terms: FormName::SmoothStribeck.terms(false),
            curve,
            beside: Some(beside),
        }],
        modulation,
    }
}

/// (12) is the same with g1 of the other sign and g2 and g3 exchanged; only the one with a positive g1 is a friction.
#[test]
fn a_difference_of_two_alike_has_a_positive_factor() {
    let v: Vec<f64> = (0..400).map(|i| (0.05 * f64::from(i)).sin()).collect();
    let (curve, beside) = (friction_over(&v), untransformed(&v));
    let modulation = Modulation::new(v.len(), 0.01, 10.0);
    let forms = friction_alone(&curve, &beside, &modulation);
    let lowest = |g1: f64, logs: [f64; 3]| Minimum {
        objective: 1.0,
        factors: vec![g1, 2.0, 0.3],
        logs: logs.to_vec(),
    };
    let value = |lowest: &Minimum, v: f64| {
        let fitted = ParametricCurve {
            terms: forms.curves[0].terms.clone(),
            factors: lowest.factors.clone(),
            logs: lowest.logs.clone(),
            width: 0.0,
        };
        fitted.value(v)
    };
    for (g1, logs) in [(-0.7, [1.0, 3.0, 2.0]), (0.7, [3.0, 1.0, 2.0])] {
        let given = lowest(g1, logs);
        let found = forms.in_order(given.clone());
        assert_eq!((found.factors[0], &found.logs[..]), (0.7, &[3.0, 1.0, 2.0][..]));
        for v in [-0.4, 0.01, 0.2] {
            assert!((value(&found, v) - value(&given, v)).abs() < 1e-15);
        }
    }
}

/// Terms that can be traded for each other have their lowest sum now and then at ones that no friction has; what an arm can have
/// fits as well there, as the truth does.
#[test]
fn a_friction_that_no_arm_has_gives_way_to_one_that_fits_as_well() {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    let (n, step, sd) = (6000, 0.01, 0.5);
    let at = |i: usize| step * i as f64;
    let v: Vec<f64> = (0..n)
        .map(|i| 0.1 * (0.7 * at(i)).sin() + 0.05 * (1.9 * at(i)).cos())
        .collect();
    let friction = |v: f64| 0.5 * ((150.0 * v).tanh() - (50.0 * v).tanh()) + 2.0 * (100.0 * v).tanh() + 0.5 * v;
    let modulation = Modulation::new(n, step, 20.0);
    let noise = vec![sd * sd; modulation.len()];
    let (curve, beside) = (friction_over(&v), untransformed(&v));
    let starts: Vec<Vec<f64>> = [[300.0_f64, 30.0, 100.0], [100.0, 30.0, 30.0], [300.0, 100.0, 200.0]]
        .map(|slopes| slopes.map(f64::ln).to_vec())
        .to_vec();
    let (mut impossible, mut possible) = (0, 0);
    for seed in 0..16 {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let tau: Vec<f64> = curve.means_of(friction).iter().map(|f| f + sd * normal()).collect();
        let mut forms = friction_alone(&curve, &beside, &modulation);
        forms.fixed.right = vec![modulation.of(&tau)];
        forms.fixed.noise = vec![&noise];
        let condensed = forms.condensed().unwrap();
        let minima: Vec<Minimum> = (starts.iter())
            .map(|start| forms.in_order(condensed.minimum(&forms.curves, start, None).unwrap()))
            .collect();
        let lowest = minima
            .iter()
            .min_by(|a, b| a.objective.total_cmp(&b.objective))
            .unwrap();
        if forms.possible(&lowest.factors, &lowest.logs) {
            continue;
        }
        impossible += 1;
        let Some(instead) = forms.possible_instead(&condensed, lowest, &minima) else {
            continue;
        };
        possible += 1;
        assert!(forms.possible(&instead.factors, &instead.logs) && instead.objective >= lowest.objective);
        let fitted = ParametricCurve {
            terms: forms.curves[0].terms.clone(),
            factors: instead.factors,
            logs: instead.logs,
            width: 0.0,
        };
        for v in [-0.1, -0.01, 0.004, 0.02, 0.12] {
            assert!((fitted.value(v) - friction(v)).abs() < 0.2, "seed {seed}, {v}");
        }
    }
    assert!(
        impossible > 2 && possible >= impossible - 1,
        "{possible} of {impossible}"
    );
}

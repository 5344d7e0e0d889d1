//! From the solution of an arm's equations to what is told of it.

use super::super::basis::Basis;
use super::super::equations::Solution;
use super::super::judge::Left;
use super::super::outcome::{Estimated, Fitted, FlexibleAxis, torque_band};
use super::super::rigid::{RESOLVED, band, widened};
use super::super::smooth::Reflected;
use super::forms::Free;
use super::{CONSTANTS, TwoLinkArm, Whole};
use crate::bands::Band;

impl Whole<'_> {
    /// Everything that is told of the arm; `None` if its equations do not determine it.
    pub fn outcome(&self, level: f64) -> Option<TwoLinkArm> {
        let equations = self.equations();
        let solution = equations.solve()?;
        let covariance = equations.robust(&solution).covariance;
        let [k1, k2, f1, f2] = &self.finer[..] else { return None };
        let told = Told {
            whole: self,
            solution: &solution,
            covariance: &covariance,
            finer: self.equations_with([k1, k2, f1, f2]).solve()?,
            level,
        };
        let step = self.motions[0].step;
        let curves = [0, 1].map(|joint| self.curves(&solution, joint));
        let resolutions = [0, 1].map(|joint| RESOLVED * self.motions[joint].link_noise.velocity_sd(step));
        let free = Free {
            left: Left::by(&equations, &solution),
            curves: &curves,
            resolutions,
        };
        let forms = [0, 1].map(|joint| self.forms(joint, &free));
        let model = self.model(&forms, &free)?;
        let inertial = told.inertial_torques();
        let [first, second] = forms;
        let [one, two] = model.joints;
        let joints = [(0, first, one), (1, second, two)].map(|(joint, [stiffness_forms, friction_forms], model)| {
            let [stiff, rub] = self.places(joint);
            let (pair, motion) = (&self.pairs[joint], &self.motions[joint]);
            let secant = told.band(&self.stiffness[joint].0, stiff, joint);
            let kappa = &curves[joint][0];
            let (rotor, links) = (&inertial[joint], &inertial[2 + joint]);
            let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
            let best = |forms: &[Fitted]| (0..forms.len()).min_by(|&a, &b| forms[a].bic.total_cmp(&forms[b].bic));
            Some(FlexibleAxis {
                motor_inertia: {
                    let carried = told.sum(&[(2 + joint, 1.0)]).value;
                    let inertia = told.sum(&[(joint, 1.0)]);
                    let confused = inertia.value * pair.confusion;
                    inertia.or_off_by(carried * pair.attenuation).or_off_by(confused)
                },
                link_inertia: match joint {
                    0 => told.sum(&[(2, 1.0), (4, 2.0)]),
                    _ => told.sum(&[(3, 1.0)]),
                },
                stiffness: torque_band(&secant),
                secant,
                friction: told.band(&self.free.friction[joint].0, rub, 2 + joint),
                best_stiffness: best(&stiffness_forms)?,
                best_friction: best(&friction_forms)?,
                stiffness_forms,
                friction_forms,
                model,
                skew: Estimated {
                    value: self.alignments[joint].skew.0,
                    standard_error: self.alignments[joint].skew.1,
                },
                cut_off: motion.link_noise.cut_off(),
                highest: self.modulation.omega[self.modulation.len() - 1] / (2.0 * std::f64::consts::PI),
                sample_time: step,
                partial_stiffness: less(motion.torque, rotor),
                partial_friction: less(kappa, links),
                reconstructed: kappa.iter().zip(rotor).map(|(k, r)| k + r).collect(),
                deflection: pair.d.clone(),
                velocity: pair.v.clone(),
                findings: motion.findings(&self.alignments[joint], &pair.v, resolutions[joint]),
            })
        });
        let joints = joints.map(|axis: Option<FlexibleAxis>| axis.map(FlexibleAxis::distrusted));
        let [first, second] = joints;
        Some(TwoLinkArm {
            shoulder: told.sum(&[(2, 1.0)]),
            elbow: told.sum(&[(3, 1.0)]),
            coupling: told.sum(&[(4, 1.0)]),
            model: model.constants,
            model_motors: model.motors,
            joints: [first?, second?],
        })
    }
}

/// A solution with free curves, to be read off.
struct Told<'a> {
    whole: &'a Whole<'a>,
    solution: &'a Solution,
    covariance: &'a [f64],
    /// The solution with finer curves.
    finer: Solution,
    level: f64,
}

impl Told<'_> {
    /// A sum of unknowns times factors.
    fn sum(&self, parts: &[(usize, f64)]) -> Estimated {
        let n = self.solution.x.len();
        let variance: f64 = parts
            .iter()
            .flat_map(|a| parts.iter().map(move |b| (a, b)))
            .map(|((i, a), (j, b))| a * b * self.covariance[i * n + j])
            .sum();
        Estimated {
            value: parts.iter().map(|(i, a)| a * self.solution.x[*i]).sum(),
            standard_error: variance.max(0.0).sqrt(),
        }
    }

    /// The curve of this number, whose splines' coefficients begin at unknown `from`.
    fn band(&self, basis: &Basis, from: usize, curve: usize) -> Band {
        let n = self.solution.x.len();
        let coefficients = &self.solution.x[from..from + basis.len()];
        let band = band(basis, coefficients, self.level, |i, j| {
            self.covariance[(from + i) * n + from + j]
        });
        let before = self.whole.finer[..curve].iter().map(|s| s.0.len()).sum::<usize>();
        let coefficients = &self.finer.x[2 + CONSTANTS + before..];
        widened(band, &|x| self.whole.finer[curve].0.value(coefficients, x))
    }

    /// What the inertias take of the torques of motor 1 and 2 and of the elastic torques on link 1 and 2, at every sample.
    fn inertial_torques(&self) -> [Vec<f64>; 4] {
        let Whole { motions, pairs, q, .. } = self.whole;
        let step = motions[0].step;
        let acceleration = |angle: &[f64], cut_off: f64| {
            let v = Reflected::new(angle, step).velocity(cut_off);
            Reflected::new(&v, step).velocity(cut_off)
        };
        let [first, second] = [0, 1].map(|i| acceleration(&q[i], motions[i].link_noise.cut_off()));
        let motor = [0, 1].map(|i| acceleration(motions[i].motor, motions[i].motor_noise.cut_off()));
        let [motor_1, motor_2, shoulder, elbow, coupling] = [0, 1, 2, 3, 4].map(|i| self.solution.x[i]);
        let along = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..first.len()).map(f).collect() };
        let (cos, sin) = (along(&|i| q[1][i].cos()), along(&|i| q[1][i].sin()));
        let (v, w) = (&pairs[0].v, &pairs[1].v);
        [
            along(&|i| motor_1 * motor[0][i]),
            along(&|i| motor_2 * (motor[1][i] + first[i])),
            along(&|i| {
                let swing = cos[i] * (2.0 * first[i] + second[i]) - sin[i] * w[i] * (2.0 * v[i] + w[i]);
                shoulder * first[i] + elbow * second[i] + coupling * swing + motor_2 * motor[1][i]
            }),
            along(&|i| elbow * (first[i] + second[i]) + coupling * (cos[i] * first[i] + sin[i] * v[i] * v[i])),
        ]
    }
}

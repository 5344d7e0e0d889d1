//! The physical forms of an arm's curves: each against its free curve in its own equations, then all together.

use super::super::condensed::Condensed;
use super::super::equations::Solution;
use super::super::forms::FormName;
use super::super::judge::{Against, Left, fitted};
use super::super::outcome::{Estimated, Fitted, JointModel};
use super::super::pair::combine;
use super::super::parametric::{
    RESOLVED_DEFLECTION, friction_of_an_arm, friction_starts, of_an_arm, possible_friction, shape,
};
use super::super::shaping::Shaping;
use super::{CONSTANTS, Whole};
use crate::linalg::Complex;

/// The forms of one joint's curves: stiffness and friction.
pub(super) type Forms = [Vec<Fitted>; 2];

/// The arm in forms that an arm can have.
pub(super) struct Model {
    pub motors: [Estimated; 2],
    pub constants: [Estimated; CONSTANTS],
    pub joints: [JointModel; 2],
}

impl Whole<'_> {
    /// The forms of a joint's curves, each by itself; the other joint's curves are as the free solution has them.
    pub fn forms(
        &self,
        solution: &Solution,
        joint: usize,
        [kappa, rub]: [&[f64]; 2],
        resolution: f64,
    ) -> Option<Forms> {
        let stiffness = self.pairs[joint].stiffness_forms(&self.stiffness[joint].1, &self.motor_noise[joint], kappa)?;
        let part = |joint: usize, which: usize| {
            let columns = [&self.stiffness[joint].1, &self.free.friction[joint].1][which];
            combine(columns, &solution.x[self.places(joint)[which]..])
        };
        let elastic = [part(0, 0), part(1, 0)];
        let mut right = self.links.right([&elastic[0], &elastic[1]], solution.x[1]);
        let other = 1 - joint;
        let known: Vec<Complex<f64>> = part(other, 1);
        right[other].iter_mut().zip(&known).for_each(|(r, f)| *r -= f);
        let weights = [self.free.noise[0].as_slice(), self.free.noise[1].as_slice()];
        let mut curves: [&[Vec<Complex<f64>>]; 2] = [&[], &[]];
        curves[joint] = &self.free.friction[joint].1;
        let own = self.links.equations(right.clone(), curves, weights);
        let v = &self.pairs[joint].v;
        let against = Against {
            free: Left::by(&own, &own.solve()?),
            curve: rub,
            x: v,
            resolution,
        };
        let fastest = v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let mut signs = vec![0.0; 2];
        signs[joint] = -1.0;
        let mut shaping = Shaping {
            fixed: self.links.constants.to_vec(),
            right,
            noise: weights.to_vec(),
            noisy: self.links.noisy(0, 0),
            shapes: vec![shape(FormName::SmoothDry, v, signs, resolution)],
            modulation: self.modulation,
        };
        let condensed = Condensed::new(&shaping);
        let friction = friction_starts(fastest).into_iter().filter_map(|(form, starts)| {
            shaping.shapes[0].terms = form.terms(false);
            let fit = shaping.fit(&condensed, &starts)?;
            Some(fitted(form, false, &fit, (0, CONSTANTS, None), &against))
        });
        Some([stiffness, friction.collect()])
    }

    /// All four curves in the forms that an arm can have, in all equations.
    pub fn model(
        &self,
        solution: &Solution,
        forms: &[Forms; 2],
        curves: &[[Vec<f64>; 2]; 2],
        resolutions: [f64; 2],
    ) -> Option<Model> {
        let with = |simple: [bool; 2]| self.model_of(solution, forms, curves, resolutions, simple);
        let simple = match with([false; 2]) {
            None => [true; 2],
            Some(model) => {
                let impossible = [0, 1].map(|joint| !possible_friction(&model.joints[joint].friction));
                if impossible == [false; 2] {
                    return Some(model);
                }
                impossible
            }
        };
        with(simple)
    }

    fn model_of(
        &self,
        solution: &Solution,
        forms: &[Forms; 2],
        curves: &[[Vec<f64>; 2]; 2],
        resolutions: [f64; 2],
        simple: [bool; 2],
    ) -> Option<Model> {
        let mut shapes = Vec::new();
        let (mut stiff_logs, mut rub_logs) = (Vec::new(), Vec::new());
        let mut names = Vec::new();
        for (joint, [stiffness, _]) in forms.iter().enumerate() {
            let form = of_an_arm(stiffness)?;
            let mut signs = vec![0.0; 4];
            (signs[joint], signs[2 + joint]) = (1.0, 1.0);
            shapes.push(shape(form.form, &self.pairs[joint].d, signs, 0.0));
            stiff_logs.extend_from_slice(&form.shaped.logs);
            names.push(form.form);
        }
        for (joint, [_, friction]) in forms.iter().enumerate() {
            let form = friction_of_an_arm(friction, simple[joint])?;
            let mut signs = vec![0.0; 4];
            signs[2 + joint] = -1.0;
            shapes.push(shape(form.form, &self.pairs[joint].v, signs, resolutions[joint]));
            rub_logs.extend_from_slice(&form.shaped.logs);
            names.push(form.form);
        }
        let shaping = Shaping {
            fixed: self.inertias(),
            right: self.right(),
            noise: self.noise(),
            noisy: self.noisy(),
            shapes,
            modulation: self.modulation,
        };
        let fit = shaping.fit(&Condensed::new(&shaping), &[[stiff_logs, rub_logs].concat()])?;
        let n = fit.solution.x.len();
        let estimated = |i: usize| Estimated {
            value: fit.solution.x[i],
            standard_error: fit.covariance[i * n + i].max(0.0).sqrt(),
        };
        let count = 2 + CONSTANTS;
        let free = Left::by(&self.equations(), solution);
        let joints = [0, 1].map(|joint| {
            let against = |which: usize, x, resolution| Against {
                free,
                curve: &curves[joint][which],
                x,
                resolution,
            };
            let pair = &self.pairs[joint];
            let stiffness = against(0, &pair.d, RESOLVED_DEFLECTION * pair.largest_deflection());
            let friction = against(1, &pair.v, resolutions[joint]);
            JointModel {
                stiffness: fitted(names[joint], false, &fit, (joint, count, Some(joint)), &stiffness),
                friction: fitted(names[2 + joint], false, &fit, (2 + joint, count, None), &friction),
            }
        });
        Some(Model {
            motors: [0, 1].map(estimated),
            constants: [2, 3, 4].map(estimated),
            joints,
        })
    }
}

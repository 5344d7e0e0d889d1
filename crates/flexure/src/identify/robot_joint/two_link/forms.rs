//! The physical forms of an arm's curves: each beside the other curves as they are free, then all together.

use super::super::condensed::Condensed;
use super::super::judge::{Against, Left, fitted, retest};
use super::super::outcome::{Estimated, Fitted, JointModel};
use super::super::parametric::{
    RESOLVED_DEFLECTION, forms_of, friction_of_an_arm, friction_starts, no_surer, of_an_arm, possible_friction, shape,
    stiffness_starts,
};
use super::super::shaping::{Shape, Shaping};
use super::{CONSTANTS, Whole, on_equations};

/// The forms of one joint's curves: stiffness and friction.
pub(super) type Forms = [Vec<Fitted>; 2];

/// The arm in forms that an arm can have.
pub(super) struct Model {
    pub motors: [Estimated; 2],
    pub constants: [Estimated; CONSTANTS],
    pub joints: [JointModel; 2],
}

/// What all forms of an arm are held against: what the free curves leave, the torques of the curves of each joint at the data, and the
/// velocities that the data resolve.
pub(super) struct Free<'a> {
    pub left: Left,
    pub curves: &'a [[Vec<f64>; 2]; 2],
    pub resolutions: [f64; 2],
}

impl Whole<'_> {
    /// The curve of this number as the splines of one are, whose form is still to be said.
    fn shape(&self, curve: usize, free: &Free) -> Shape<'_> {
        let joint = curve % 2;
        let pair = &self.pairs[joint];
        let beside = &self.tested[joint][curve / 2];
        let mut signs = vec![0.0; 4];
        if curve < 2 {
            (signs[joint], signs[2 + joint]) = (1.0, 1.0);
            Shape {
                abscissa: self.abscissa(joint),
                ..shape(&pair.d, signs, 0.0, beside)
            }
        } else {
            signs[2 + joint] = -1.0;
            shape(&pair.v, signs, free.resolutions[joint], beside)
        }
    }

    /// Some curves in physical forms, the others free.
    fn shaping<'b>(&'b self, shapes: Vec<Shape<'b>>, others: &[usize]) -> Shaping<'b> {
        let splines = [
            &self.stiffness[0],
            &self.stiffness[1],
            &self.free.friction[0],
            &self.free.friction[1],
        ];
        let (mut fixed, mut noisy) = (self.inertias(), self.noisy());
        for &curve in others {
            if curve < 2 {
                noisy.extend(self.noisy_curves(&[(curve, splines[curve], fixed.len())]));
            }
            fixed.extend(on_equations(curve, splines[curve]));
        }
        Shaping {
            fixed,
            right: self.right(),
            noise: self.noise(),
            noisy,
            shapes,
            modulation: self.modulation,
        }
    }

    fn against<'b>(&'b self, curve: usize, free: &'b Free) -> Against<'b> {
        let joint = curve % 2;
        let pair = &self.pairs[joint];
        let own = &free.curves[joint][curve / 2];
        let (x, resolution) = match curve < 2 {
            true => (&pair.d, RESOLVED_DEFLECTION * pair.largest_deflection()),
            false => (&pair.v, free.resolutions[joint]),
        };
        Against {
            free: free.left,
            curve: own,
            x,
            resolution,
        }
    }

    /// The forms of a joint's curves, each with all other curves free.
    pub fn forms(&self, joint: usize, free: &Free) -> Forms {
        let pair = &self.pairs[joint];
        [joint, 2 + joint].map(|curve| {
            let others: Vec<usize> = (0..4).filter(|&other| other != curve).collect();
            let starts = match curve < 2 {
                true => stiffness_starts(pair.largest_deflection()),
                false => friction_starts(pair.fastest()),
            };
            let shaping = self.shaping(vec![self.shape(curve, free)], &others);
            forms_of(shaping, starts, (false, None), &self.against(curve, free))
        })
    }

    /// All four curves in the forms that an arm can have, in all equations.
    pub fn model(&self, forms: &[Forms; 2], free: &Free) -> Option<Model> {
        let with = |simple: [bool; 2]| self.model_of(forms, free, simple);
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

    fn model_of(&self, forms: &[Forms; 2], free: &Free, simple: [bool; 2]) -> Option<Model> {
        let [first, second] = forms;
        let chosen = [
            of_an_arm(&first[0])?,
            of_an_arm(&second[0])?,
            friction_of_an_arm(&first[1], simple[0])?,
            friction_of_an_arm(&second[1], simple[1])?,
        ];
        let shapes = |curves: &[usize]| -> Vec<Shape> {
            let of = |&curve: &usize| self.shape(curve, free).with(chosen[curve].form);
            curves.iter().map(of).collect()
        };
        let logs = |curves: &[usize]| -> Vec<f64> {
            let of = |&curve: &usize| chosen[curve].shaped.logs.iter().copied();
            curves.iter().flat_map(of).collect()
        };
        let all = [0, 1, 2, 3];
        let shaping = self.shaping(shapes(&all), &[]);
        let fit = shaping.fit(&Condensed::new(&shaping), &[logs(&all)])?;
        let n = fit.solution.x.len();
        let estimated = |i: usize| Estimated {
            value: fit.solution.x[i],
            standard_error: fit.covariance[i * n + i].max(0.0).sqrt(),
        };
        let count = 2 + CONSTANTS;
        let joint = |joint: usize| {
            let told = |curve: usize, inertia| {
                let of = (curve, count, inertia);
                fitted(chosen[curve].form, false, &fit, of, &self.against(curve, free))
            };
            let mut model = JointModel {
                stiffness: told(joint, Some(joint)),
                friction: told(2 + joint, None),
            };
            no_surer(&mut model.stiffness, &forms[joint][0]);
            // This joint's own test: the other one's curves are free.
            let (own, others) = ([joint, 2 + joint], [1 - joint, 3 - joint]);
            let alone = self.shaping(shapes(&own), &others).near(&logs(&own))?;
            retest(&mut model.stiffness, &alone);
            retest(&mut model.friction, &alone);
            Some(model)
        };
        Some(Model {
            motors: [0, 1].map(estimated),
            constants: [2, 3, 4].map(estimated),
            joints: [joint(0)?, joint(1)?],
        })
    }
}

//! Curves of equations of motion in physical forms: first each one with the other curves free, then all together.

use super::candidates::{
    FormStart, candidates, friction_of_an_arm, no_more_certain, possible_friction, stiffness_of_an_arm,
};
use super::condensed::FormedCurve;
use super::equations::Equations;
use super::form_fit::{FormEquations, FormFit};
use super::forms::Term;
use super::free_outcome::FreeOutcome;
use super::outcome::{Estimated, Fitted, JointModel};
use super::parameters::{Place, estimated, fitted, retest};
use super::system::System;
use crate::parallel;

/// A curve with the terms of its form.
struct Formed {
    curve: usize,
    terms: Vec<Term>,
    /// Whether the form is tested.
    tested: bool,
}

impl Formed {
    fn new(curve: usize, terms: Vec<Term>) -> Self {
        let tested = true;
        Formed { curve, terms, tested }
    }
}

/// The place of a flexible joint in equations of motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointPlace {
    /// The numbers of its curves.
    pub stiffness: usize,
    pub friction: usize,
    pub motor_friction: Option<usize>,
    /// The numbers of the factors that are reported with the forms of stiffness and friction.
    pub motor: Option<usize>,
    pub link: Option<usize>,
}

/// A free curve that gets forms.
pub(super) struct FreeCurve {
    /// Its number.
    pub curve: usize,
    /// Whether forms without a constant get one.
    pub offset: bool,
    /// The factor that is reported with the forms.
    pub inertia: Option<usize>,
}

/// The forms of a joint's curves.
pub(super) struct JointForms {
    pub stiffness: Vec<Fitted>,
    pub friction: Vec<Fitted>,
    /// Empty without friction at the motor.
    pub motor_friction: Vec<Fitted>,
}

/// Equations of motion with all curves in forms that an arm can have.
pub(super) struct ArmModel {
    pub factors: Vec<Estimated>,
    pub joints: Vec<JointModel>,
}

/// Forms are fitted together with the other free curves, and compared with the free curve that they replace.
impl<'a> FreeOutcome<'a> {
    /// The equations with some curves in forms, the others free.
    fn equations(&self, formed: Vec<Formed>) -> FormEquations<'a> {
        let System { modulation, curves, .. } = self.system;
        let mut fixed = Equations {
            columns: self.system.factors.clone(),
            right: self.system.right.clone(),
            noise: self.curves.noise.iter().map(Vec::as_slice).collect(),
            noisy: self.system.noisy.clone(),
            given: self.system.given.clone(),
        };
        for (number, (curve, splines)) in curves.iter().zip(&self.curves.splines).enumerate() {
            if formed.iter().all(|f| f.curve != number) {
                let first = fixed.columns.len();
                let noisy = curve.noisy(|| splines.basis.slopes(modulation, curve.x), |k| first + k, None);
                fixed.noisy.extend(noisy);
                fixed
                    .columns
                    .extend(splines.lines.iter().map(|lines| curve.column(lines, 1.0)));
            }
        }
        let formed = formed.into_iter().map(|Formed { curve, terms, tested }| FormedCurve {
            terms,
            curve: &curves[curve],
            beside: tested.then(|| &self.curves.tested[curve]),
        });
        FormEquations {
            fixed,
            curves: formed.collect(),
            modulation,
        }
    }

    /// All forms of these curves, each curve with all others free.
    pub fn forms(&self, curves: &[FreeCurve]) -> Vec<Vec<Fitted>> {
        let condensed = parallel::batch(curves, |free| {
            self.equations(vec![Formed::new(free.curve, Vec::new())]).condensed()
        });
        let jobs: Vec<(usize, FormStart)> = (0..curves.len())
            .flat_map(|i| {
                candidates(&self.system.curves[curves[i].curve])
                    .into_iter()
                    .map(move |form| (i, form))
            })
            .collect();
        let fits = parallel::batch(&jobs, |(i, candidate)| {
            let free = &curves[*i];
            let terms = candidate.form.terms(free.offset);
            let equations = self.equations(vec![Formed::new(free.curve, terms)]);
            let fit = equations.fit(condensed[*i].as_ref()?, &candidate.starts)?;
            let place = Place {
                in_fit: 0,
                curve: free.curve,
                inertia: free.inertia,
            };
            Some((*i, fitted(candidate.form, &fit, place, self)))
        });
        let mut forms: Vec<Vec<Fitted>> = curves.iter().map(|_| Vec::new()).collect();
        fits.into_iter().flatten().for_each(|(i, form)| forms[i].push(form));
        forms
    }

    /// The forms of the joints' curves, each with all other curves free; those of a stiffness beside frictions in forms where that is better.
    pub fn forms_of<const N: usize>(&self, joints: &[JointPlace; N]) -> [JointForms; N] {
        let free = |curve, inertia| FreeCurve {
            curve,
            offset: false,
            inertia,
        };
        let of_joint = |joint: &JointPlace| {
            let motor = joint.motor_friction.map(|curve| free(curve, None));
            [free(joint.stiffness, None), free(joint.friction, joint.link)]
                .into_iter()
                .chain(motor)
        };
        let curves: Vec<FreeCurve> = joints.iter().flat_map(of_joint).collect();
        let mut forms = self.forms(&curves).into_iter();
        let mut next = || forms.next().unwrap_or_default();
        joints.each_ref().map(|joint| {
            let mut forms = JointForms {
                stiffness: next(),
                friction: next(),
                motor_friction: joint.motor_friction.map_or_else(Vec::new, |_| next()),
            };
            if let Some(stiffness) = self.stiffness_beside_frictions(joint, &forms) {
                forms.stiffness = stiffness;
            }
            forms
        })
    }

    /// The forms of the stiffness beside frictions in forms, if free frictions leave a wind-up or refute all forms, forms of the frictions
    /// make the smallest BIC smaller, and no form that stands would be lost; otherwise `None`.
    ///
    /// A free friction curve is wrong where the friction changes its sign within the noise of the velocity. While the link hardly moves,
    /// friction and spring balance. The error then looks like a spring that is weaker at small deflections.
    fn stiffness_beside_frictions(&self, joint: &JointPlace, forms: &JointForms) -> Option<Vec<Fitted>> {
        let alone = stiffness_of_an_arm(&forms.stiffness)?;
        if alone.stands() && !alone.form.has_windup() {
            return None;
        }
        let mut frictions = vec![(joint.friction, friction_of_an_arm(&forms.friction, false)?)];
        if let Some(curve) = joint.motor_friction {
            frictions.push((curve, friction_of_an_arm(&forms.motor_friction, false)?));
        }
        let beside = |terms: Vec<Term>| {
            let of_frictions = frictions.iter().map(|(curve, friction)| Formed {
                curve: *curve,
                terms: friction.form.terms(false),
                tested: false,
            });
            let stiffness = Formed::new(joint.stiffness, terms);
            self.equations([stiffness].into_iter().chain(of_frictions).collect())
        };
        let condensed = beside(Vec::new()).condensed()?;
        let logs: Vec<f64> = frictions
            .iter()
            .flat_map(|(_, f)| f.curve.logs.iter().copied())
            .collect();
        let place = Place {
            in_fit: 0,
            curve: joint.stiffness,
            inertia: None,
        };
        let candidates = candidates(&self.system.curves[joint.stiffness]);
        let fits = parallel::batch(&candidates, |candidate| {
            let starts = candidate.starts.iter().map(|start| [&start[..], &logs].concat());
            let fit = beside(candidate.form.terms(false)).fit(&condensed, &starts.collect::<Vec<_>>())?;
            Some(fitted(candidate.form, &fit, place, self))
        });
        let beside: Vec<Fitted> = fits.into_iter().flatten().collect();
        let stands = |form: &&Fitted| form.stands() || !alone.stands();
        let better = (stiffness_of_an_arm(&beside).filter(stands)).is_some_and(|form| form.bic < alone.bic);
        better.then_some(beside)
    }

    /// All curves in the forms that an arm can have, in all equations.
    pub fn model(&self, joints: &[JointPlace], forms: &[JointForms]) -> Option<ArmModel> {
        let Some(model) = self.model_with(joints, forms, &vec![false; joints.len()]) else {
            return self.model_with(joints, forms, &vec![true; joints.len()]);
        };
        let impossible = |joint: &JointModel| {
            let mut frictions = [&joint.friction].into_iter().chain(&joint.motor_friction);
            !frictions.all(possible_friction)
        };
        let simple: Vec<bool> = model.joints.iter().map(impossible).collect();
        match simple.contains(&true) {
            true => self.model_with(joints, forms, &simple),
            false => Some(model),
        }
    }

    /// The same; joints that are `simple` have a friction without a Stribeck part.
    fn model_with(&self, joints: &[JointPlace], forms: &[JointForms], simple: &[bool]) -> Option<ArmModel> {
        let mut chosen: Vec<Option<&Fitted>> = vec![None; self.system.curves.len()];
        for ((place, forms), simple) in joints.iter().zip(forms).zip(simple) {
            chosen[place.stiffness] = Some(stiffness_of_an_arm(&forms.stiffness)?);
            chosen[place.friction] = Some(friction_of_an_arm(&forms.friction, *simple)?);
            if let Some(curve) = place.motor_friction {
                chosen[curve] = Some(friction_of_an_arm(&forms.motor_friction, *simple)?);
            }
        }
        let chosen: Vec<&Fitted> = chosen.into_iter().collect::<Option<_>>()?;
        let formed = |curves: &[usize]| -> Vec<Formed> {
            let of = |&curve: &usize| Formed::new(curve, chosen[curve].form.terms(false));
            curves.iter().map(of).collect()
        };
        let logs = |curves: &[usize]| -> Vec<f64> {
            let of = |&curve: &usize| chosen[curve].curve.logs.iter().copied();
            curves.iter().flat_map(of).collect()
        };
        let all: Vec<usize> = (0..chosen.len()).collect();
        let equations = self.equations(formed(&all));
        let fit = equations.fit(&equations.condensed()?, &[logs(&all)])?;
        let read = |curve: usize, inertia| {
            let place = Place {
                in_fit: curve,
                curve,
                inertia,
            };
            fitted(chosen[curve].form, &fit, place, self)
        };
        let of_joint = |(place, forms): (&JointPlace, &JointForms)| {
            let mut model = JointModel {
                stiffness: read(place.stiffness, place.motor),
                friction: read(place.friction, place.link),
                motor_friction: place.motor_friction.map(|curve| read(curve, None)),
            };
            no_more_certain(&mut model.stiffness, &forms.stiffness);
            if joints.len() > 1 {
                // In each joint's own test, the curves of the other joints are free.
                let own = [place.stiffness, place.friction];
                let alone: FormFit = self.equations(formed(&own)).near(&logs(&own))?;
                retest(&mut model.stiffness, &alone);
                retest(&mut model.friction, &alone);
            }
            Some(model)
        };
        let factors = 0..self.system.factors.len();
        Some(ArmModel {
            factors: factors
                .map(|i| estimated(&fit.solution.x, &fit.covariance, i))
                .collect(),
            joints: joints.iter().zip(forms).map(of_joint).collect::<Option<_>>()?,
        })
    }
}

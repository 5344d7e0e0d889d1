//! The physical forms of a flexible joint's curves: each against its free curve in its own equation, then both together.

use super::condensed::Condensed;
use super::equations::Column;
use super::forms::FormName;
use super::judge::{Against, Left, NORMAL, fitted};
use super::noisy::{Abscissa, Noisy};
use super::outcome::{Fitted, JointModel};
use super::pair::{Free, Pair, Splines};
use super::shaping::{Shape, Shapely, Shaping};
use crate::interrupt;
use crate::linalg::Complex;

/// The smallest distance of deflections that is told apart, as a share of the largest one.
pub(super) const RESOLVED_DEFLECTION: f64 = 1e-3;

/// Slopes of tanh that minima are looked for at, in units of the largest velocity.
const SLOPES: [f64; 4] = [5.0, 20.0, 60.0, 180.0];

/// The largest Stribeck factor g1 of friction as a multiple of the Coulomb friction g4.
pub(super) const LARGEST_STRIBECK: f64 = 5.0;

/// The noise of each block of equations, and the noisy ones of the fixed columns.
type Noises<'a> = (Vec<&'a [f64]>, Vec<Noisy<'a>>);

/// Forms with the starts of their shape parameters' logarithms.
pub(super) type Starts = Vec<(FormName, Vec<Vec<f64>>)>;

/// The forms of the one curve of `shaping`, everything else free; `offset` adds a constant, `inertia` is the unknown told beside them.
pub(super) fn forms_of(
    mut shaping: Shaping,
    starts: Starts,
    (offset, inertia): (bool, Option<usize>),
    against: &Against,
) -> Vec<Fitted> {
    if interrupt::requested() {
        return Vec::new();
    }
    let condensed = Condensed::new(&shaping);
    let count = shaping.fixed.len();
    let forms = starts.into_iter().filter_map(|(form, starts)| {
        shaping.shapes[0].terms = form.terms(offset);
        let fit = shaping.fit(&condensed, &starts)?;
        Some(fitted(form, offset, &fit, (0, count, inertia), against))
    });
    forms.collect()
}

impl Pair<'_> {
    /// The largest deflection, rad.
    pub(super) fn largest_deflection(&self) -> f64 {
        self.d.iter().fold(0.0_f64, |m, d| m.max(d.abs()))
    }

    /// The forms of stiffness and friction, each with the other curve free.
    pub(super) fn forms(
        &self,
        free: &Free,
        left: Left,
        (kappa, curve): (&[f64], &[f64]),
        resolution: f64,
    ) -> (Vec<Fitted>, Vec<Fitted>) {
        let (motor, link) = self.inertias();
        let link_at = usize::from(motor.is_some());
        let inertias: Vec<Column> = motor.into_iter().chain([link]).collect();
        let abscissa = self.abscissa(Some(link_at));
        let elastic = self.noisy_curve(&abscissa, &free.stiffness, inertias.len());
        let shaping = |others: Vec<Column>, noisy, shape| {
            let noise = free.noise.iter().map(Vec::as_slice).collect();
            let own = self.noisy_motor().into_iter().chain([self.noisy_link(link_at, 1)]);
            let fixed = inertias.iter().cloned().chain(others).collect();
            self.shaping(
                fixed,
                self.right(),
                (noise, own.chain::<Vec<Noisy>>(noisy).collect()),
                vec![shape],
            )
        };
        let in_link = free.friction.1.iter().map(|c| vec![None, Some(c.clone())]);
        let in_both = free.stiffness.1.iter().map(|c| vec![Some(c.clone()), Some(c.clone())]);
        let largest = self.largest_deflection();
        let stiffness = forms_of(
            shaping(
                in_link.collect(),
                Vec::new(),
                Shape {
                    abscissa,
                    ..shape(&self.d, vec![1.0, 1.0], 0.0, &free.tested[0])
                },
            ),
            stiffness_starts(largest),
            (false, None),
            &Against {
                free: left,
                curve: kappa,
                x: &self.d,
                resolution: RESOLVED_DEFLECTION * largest,
            },
        );
        let friction = forms_of(
            shaping(
                in_both.collect(),
                elastic,
                shape(&self.v, vec![0.0, -1.0], resolution, &free.tested[1]),
            ),
            friction_starts(self.fastest()),
            (false, Some(link_at)),
            &Against {
                free: left,
                curve,
                x: &self.v,
                resolution,
            },
        );
        (stiffness, friction)
    }

    /// The largest velocity, rad/s.
    pub(super) fn fastest(&self) -> f64 {
        self.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()))
    }

    fn shaping<'b>(
        &'b self,
        fixed: Vec<Column>,
        right: Vec<Vec<Complex<f64>>>,
        (noise, noisy): Noises<'b>,
        shapes: Vec<Shape<'b>>,
    ) -> Shaping<'b> {
        Shaping {
            fixed,
            right,
            noise,
            noisy,
            shapes,
            modulation: self.modulation,
        }
    }

    /// Both curves in the forms that an arm can have, in both equations.
    pub(super) fn model(
        &self,
        free: &Free,
        left: Left,
        [stiffness, friction]: [&[Fitted]; 2],
        curves: [&[f64]; 2],
        resolution: f64,
    ) -> Option<JointModel> {
        let stiff = of_an_arm(stiffness)?;
        let with = |simple: bool| {
            let forms = [stiff, friction_of_an_arm(friction, simple)?];
            let mut model = self.model_of(free, left, forms, curves, resolution)?;
            no_surer(&mut model.stiffness, stiffness);
            Some(model)
        };
        with(false)
            .filter(|model| possible_friction(&model.friction))
            .or_else(|| with(true))
    }

    fn model_of(
        &self,
        free: &Free,
        left: Left,
        [stiff, rub]: [&Fitted; 2],
        [kappa, curve]: [&[f64]; 2],
        resolution: f64,
    ) -> Option<JointModel> {
        let (motor, link) = self.inertias();
        let count = 1 + usize::from(motor.is_some());
        let shapes = vec![
            Shape {
                abscissa: self.abscissa(Some(count - 1)),
                ..shape(&self.d, vec![1.0, 1.0], 0.0, &free.tested[0]).with(stiff.form)
            },
            shape(&self.v, vec![0.0, -1.0], resolution, &free.tested[1]).with(rub.form),
        ];
        let noise = free.noise.iter().map(Vec::as_slice).collect();
        let fixed = motor.into_iter().chain([link]).collect();
        let noisy = self
            .noisy_motor()
            .into_iter()
            .chain([self.noisy_link(count - 1, 1)])
            .collect();
        let shaping = self.shaping(fixed, self.right(), (noise, noisy), shapes);
        let logs = [stiff.shaped.logs.clone(), rub.shaped.logs.clone()].concat();
        let fit: Shapely = shaping.fit(&Condensed::new(&shaping), &[logs])?;
        let against = |curve, x, resolution| Against {
            free: left,
            curve,
            x,
            resolution,
        };
        let stiffness = against(kappa, &self.d, RESOLVED_DEFLECTION * self.largest_deflection());
        let friction = against(curve, &self.v, resolution);
        let motor = self.motor.is_some().then_some(0);
        Some(JointModel {
            stiffness: fitted(stiff.form, false, &fit, (0, count, motor), &stiffness),
            friction: fitted(rub.form, false, &fit, (1, count, Some(count - 1)), &friction),
        })
    }
}

/// A curve whose form is still to be said.
pub(super) fn shape<'a>(x: &'a [f64], signs: Vec<f64>, width: f64, beside: &'a Splines) -> Shape<'a> {
    Shape {
        terms: Vec::new(),
        x,
        signs,
        width,
        beside,
        abscissa: Abscissa::default(),
    }
}

/// A form is refuted where its lack of fit is less probable than this: less than is usual, as errors that come in bursts, where friction is
/// steep, still make small probabilities too frequent on short logs (on ten simulated logs of 20 s three of the 20 tests gave the true
/// friction less than 0.01, none less than 1e-4).
pub const REFUTED: f64 = 1e-4;

/// The form of stiffness that an arm can have, one that the free curve does not refute if there is one.
pub(super) fn of_an_arm(forms: &[Fitted]) -> Option<&Fitted> {
    let possible = |f: &Fitted| {
        let factor = |s: &str| f.parameter(s).map_or(0.0, |p| p.value);
        factor("a2") > 0.0 && factor("a1") >= 0.0 && (0.0..factor("a2")).contains(&factor("ksw"))
    };
    let chosen = best(forms, |f| possible(f) && f.lack_of_fit.p_value > REFUTED)
        .or_else(|| best(forms, possible))
        .or_else(|| forms.first())?;
    // A cubic term that is not told is no reason to be the more sure of a wind-up.
    let full = forms.iter().find(|f| f.form == FormName::Windup);
    full.filter(|f| chosen.form == FormName::LinearWindup && possible(f))
        .or(Some(chosen))
}

/// Where the cubic term had to be left out, the wind-up is no more sure than beside it.
pub(super) fn no_surer(fitted: &mut Fitted, forms: &[Fitted]) {
    let full = forms.iter().find(|f| f.form == FormName::Windup);
    let Some(full) = full.filter(|_| fitted.form == FormName::LinearWindup) else {
        return;
    };
    for parameter in &mut fitted.parameters {
        if let Some(beside) = full.parameter(&parameter.symbol) {
            parameter.standard_error = parameter.standard_error.max(beside.standard_error);
            parameter.range = [
                parameter.range[0].min(parameter.value - NORMAL * parameter.standard_error),
                parameter.range[1].max(parameter.value + NORMAL * parameter.standard_error),
            ];
        }
    }
}

/// Whether an arm can have this friction: (12) or a part of it, with a Stribeck part that is not the difference of two
/// large and nearly equal terms.
pub(super) fn possible_friction(f: &Fitted) -> bool {
    let value = |s: &str| f.parameter(s).map_or(0.0, |p| p.value);
    f.form.is_smooth()
        && ["g1", "g4", "g6"].iter().all(|g| value(g) >= 0.0)
        && value("g1") <= LARGEST_STRIBECK * value("g4")
        && value("g2") >= value("g3")
}

/// The form of friction that an arm can have, a `simple` one without a Stribeck part.
pub(super) fn friction_of_an_arm(forms: &[Fitted], simple: bool) -> Option<&Fitted> {
    best(forms, |f| {
        possible_friction(f) && !(simple && f.form == FormName::SmoothStribeck)
    })
    .or_else(|| forms.iter().find(|f| f.form == FormName::SmoothDry))
}

fn best(forms: &[Fitted], allowed: impl Fn(&Fitted) -> bool) -> Option<&Fitted> {
    let allowed = forms.iter().filter(|f| allowed(f));
    allowed.min_by(|a, b| a.bic.total_cmp(&b.bic))
}

/// The forms of stiffness, for deflections up to the largest one.
pub(super) fn stiffness_starts(largest: f64) -> Starts {
    let windup = [0.02, 0.06, 0.2, 0.5].map(|share| vec![-2.0 * (share * largest).ln()]);
    vec![
        (FormName::LinearStiffness, vec![vec![]]),
        (FormName::CubicStiffness, vec![vec![]]),
        (FormName::LinearWindup, windup.to_vec()),
        (FormName::Windup, windup.to_vec()),
    ]
}

/// The forms of friction, for velocities up to the largest one.
pub(super) fn friction_starts(fastest: f64) -> Starts {
    let logs = |shares: &[f64]| -> Vec<f64> { shares.iter().map(|s| (s / fastest).ln()).collect() };
    let speeds = |shares: &[f64]| -> Vec<f64> { shares.iter().map(|s| (s * fastest).ln()).collect() };
    let slopes = || SLOPES.iter().copied();
    // Minima of (12) lie far from each other: g2 > g3, beside every g5.
    let pairs = slopes().flat_map(|g2| slopes().filter(move |g3| *g3 < g2).map(move |g3| [g2, g3]));
    let triples = pairs.flat_map(|[g2, g3]| slopes().map(move |g5| [g2, g3, 1.4 * g5]));
    vec![
        (FormName::CoulombViscous, vec![vec![]]),
        (FormName::Stribeck, [0.005, 0.03, 0.2].map(|s| speeds(&[s])).to_vec()),
        (FormName::SmoothDry, slopes().map(|s| logs(&[s])).collect()),
        (FormName::SmoothCoulomb, slopes().map(|s| logs(&[s])).collect()),
        (FormName::SmoothStribeck, triples.map(|t| logs(&t)).collect()),
    ]
}

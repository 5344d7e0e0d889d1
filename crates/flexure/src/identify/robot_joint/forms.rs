//! The physical forms of a joint's curves: their terms and names.

use super::limits::LARGEST_STRIBECK;
use crate::linear::correlation::mean_square;

use serde::Serialize;

/// One term of a form: a function of the velocity or deflection x, with an estimated factor and with shape parameters, whose logarithms are
/// estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Term {
    /// 1.
    Constant,
    /// x.
    Linear,
    /// |x|.
    Absolute,
    /// x^3.
    Cubic,
    /// sign x, softened within the velocity's resolution.
    Sign,
    /// tanh(a x).
    Tanh,
    /// tanh(a x) - tanh(b x), of (12).
    TanhDifference,
    /// exp(-(x / a)^2) sign x (Stribeck; Armstrong-Helouvry, Dupont & Canudas de Wit 1994).
    Stribeck,
    /// -x exp(-a x^2), the soft wind-up (11).
    Windup,
}

/// The shape parameters of a term.
pub(super) struct ShapeParameters {
    pub symbols: &'static [&'static str],
    /// The powers of torque and of x in their unit.
    pub unit: [i32; 2],
}

impl Term {
    /// The number of shape parameters.
    pub fn shapes(self) -> usize {
        self.shape().symbols.len()
    }

    /// Its shape parameters.
    pub fn shape(self) -> ShapeParameters {
        let shape = |symbols, power_of_x| ShapeParameters {
            symbols,
            unit: [0, power_of_x],
        };
        match self {
            Term::Constant | Term::Linear | Term::Absolute | Term::Cubic | Term::Sign => shape(&[], 0),
            Term::Tanh => shape(&["g5"], -1),
            Term::TanhDifference => shape(&["g2", "g3"], -1),
            Term::Stribeck => shape(&["vs"], 1),
            Term::Windup => shape(&["asw"], -2),
        }
    }

    /// The powers of torque and of x in the unit of the factor.
    pub fn unit(self) -> [i32; 2] {
        match self {
            Term::Constant | Term::Sign | Term::Tanh | Term::TanhDifference | Term::Stribeck => [1, 0],
            Term::Linear | Term::Absolute | Term::Windup => [1, -1],
            Term::Cubic => [1, -3],
        }
    }

    /// The term at x for the logarithms `t` of its shape parameters; `width` softens signs.
    pub fn value(self, x: f64, t: &[f64], width: f64) -> f64 {
        match self {
            Term::Constant => 1.0,
            Term::Linear => x,
            Term::Absolute => x.abs(),
            Term::Cubic => x * x * x,
            Term::Sign => soft_sign(x, width),
            Term::Tanh => (t[0].exp() * x).tanh(),
            Term::TanhDifference => (t[0].exp() * x).tanh() - (t[1].exp() * x).tanh(),
            Term::Stribeck => (-(x * (-t[0]).exp()).powi(2)).exp() * soft_sign(x, width),
            Term::Windup => -x * (-t[0].exp() * x * x).exp(),
        }
    }

    /// The derivative of [`Term::value`] by the k-th logarithm.
    pub fn by_shape(self, x: f64, t: &[f64], k: usize, width: f64) -> f64 {
        let tanh_slope = |t: f64| {
            let z = t.exp() * x;
            z / z.cosh().powi(2)
        };
        let slope = match self {
            Term::Constant | Term::Linear | Term::Absolute | Term::Cubic | Term::Sign => 0.0,
            Term::Tanh => tanh_slope(t[0]),
            Term::TanhDifference => [1.0, -1.0][k] * tanh_slope(t[k]),
            Term::Stribeck => 2.0 * (x * (-t[0]).exp()).powi(2) * self.value(x, t, width),
            Term::Windup => -t[0].exp() * x * x * self.value(x, t, width),
        };
        if slope.is_finite() { slope } else { 0.0 }
    }
}

fn soft_sign(x: f64, width: f64) -> f64 {
    match width > 0.0 {
        true => (x / width).clamp(-1.0, 1.0),
        false if x == 0.0 => 0.0,
        false => x.signum(),
    }
}

/// A form of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FormName {
    /// Coulomb, viscous and offset: `Fc sign v + Fv v + F0`.
    CoulombViscous,
    /// The same with the Stribeck effect: `(Fc + (Fs - Fc) exp(-(v / vs)^2)) sign v + Fv v + F0`.
    Stribeck,
    /// Coulomb friction, an offset, and viscous friction of each direction: `Fc sign v + Fv v + Fd |v| + F0`.
    DirectedViscous,
    /// The same with the Stribeck effect.
    DirectedStribeck,
    /// `g4 tanh(g5 v)`, (12) without its Stribeck and viscous parts.
    SmoothDry,
    /// `g4 tanh(g5 v) + g6 v`, (12) without its Stribeck part.
    SmoothCoulomb,
    /// (12): `g1 [tanh(g2 v) - tanh(g3 v)] + g4 tanh(g5 v) + g6 v`.
    SmoothStribeck,
    /// `a2 d`.
    LinearStiffness,
    /// `a1 d^3 + a2 d`, (10) without wind-up.
    CubicStiffness,
    /// (10)-(11) without the cubic term: `a2 d - ksw exp(-asw d^2) d`.
    LinearWindup,
    /// (10)-(11): `a1 d^3 + a2 d - ksw exp(-asw d^2) d`.
    Windup,
}

impl FormName {
    /// A title for text and pages.
    pub fn title(self) -> &'static str {
        match self {
            FormName::CoulombViscous => "Coulomb and viscous friction with an offset",
            FormName::Stribeck => "Coulomb, viscous and Stribeck friction with an offset",
            FormName::DirectedViscous => "Coulomb friction with an offset, and viscous friction of each direction",
            FormName::DirectedStribeck => {
                "Coulomb and Stribeck friction with an offset, and viscous friction of each direction"
            }
            FormName::SmoothDry => "smooth Coulomb friction",
            FormName::SmoothCoulomb => "smooth Coulomb and viscous friction",
            FormName::SmoothStribeck => "smooth Coulomb, viscous and Stribeck friction",
            FormName::LinearStiffness => "linear stiffness",
            FormName::CubicStiffness => "cubic stiffness",
            FormName::LinearWindup => "linear stiffness with soft wind-up",
            FormName::Windup => "cubic stiffness with soft wind-up",
        }
    }

    /// Its formula in the symbols of its parameters: v is a velocity, d a deflection.
    pub fn formula(self) -> &'static str {
        match self {
            FormName::CoulombViscous => "Fc sign(v) + Fv v + F0",
            FormName::Stribeck => "(Fc + (Fs - Fc) exp(-(v/vs)^2)) sign(v) + Fv v + F0",
            FormName::DirectedViscous => "Fc sign(v) + Fv v + Fd |v| + F0",
            FormName::DirectedStribeck => "(Fc + (Fs - Fc) exp(-(v/vs)^2)) sign(v) + Fv v + Fd |v| + F0",
            FormName::SmoothDry => "g4 tanh(g5 v)",
            FormName::SmoothCoulomb => "g4 tanh(g5 v) + g6 v",
            FormName::SmoothStribeck => "g1 (tanh(g2 v) - tanh(g3 v)) + g4 tanh(g5 v) + g6 v",
            FormName::LinearStiffness => "a2 d",
            FormName::CubicStiffness => "a1 d^3 + a2 d",
            FormName::LinearWindup => "a2 d - ksw exp(-asw d^2) d",
            FormName::Windup => "a1 d^3 + a2 d - ksw exp(-asw d^2) d",
        }
    }

    /// Whether it is a form of stiffness, not of friction.
    pub fn is_stiffness(self) -> bool {
        matches!(
            self,
            FormName::LinearStiffness | FormName::CubicStiffness | FormName::LinearWindup | FormName::Windup
        )
    }

    /// Whether it is a form of stiffness with a soft wind-up.
    pub fn has_windup(self) -> bool {
        matches!(self, FormName::LinearWindup | FormName::Windup)
    }

    /// Whether it is a form of friction that an arm can have, (12) or a part of it.
    pub(super) fn is_smooth(self) -> bool {
        matches!(
            self,
            FormName::SmoothDry | FormName::SmoothCoulomb | FormName::SmoothStribeck
        )
    }

    /// The terms; `offset` adds a constant to the smooth forms of friction, which have none.
    pub(super) fn terms(self, offset: bool) -> Vec<Term> {
        let mut terms = match self {
            FormName::CoulombViscous => vec![Term::Sign, Term::Linear, Term::Constant],
            FormName::Stribeck => vec![Term::Sign, Term::Linear, Term::Stribeck, Term::Constant],
            FormName::DirectedViscous => vec![Term::Sign, Term::Linear, Term::Absolute, Term::Constant],
            FormName::DirectedStribeck => {
                vec![Term::Sign, Term::Linear, Term::Stribeck, Term::Absolute, Term::Constant]
            }
            FormName::SmoothDry => vec![Term::Tanh],
            FormName::SmoothCoulomb => vec![Term::Tanh, Term::Linear],
            FormName::SmoothStribeck => vec![Term::TanhDifference, Term::Tanh, Term::Linear],
            FormName::LinearStiffness => vec![Term::Linear],
            FormName::CubicStiffness => vec![Term::Linear, Term::Cubic],
            FormName::LinearWindup => vec![Term::Linear, Term::Windup],
            FormName::Windup => vec![Term::Linear, Term::Cubic, Term::Windup],
        };
        if offset && self.is_smooth() {
            terms.push(Term::Constant);
        }
        terms
    }

    /// The symbol of a term's factor.
    pub(super) fn symbol(self, term: Term) -> &'static str {
        match term {
            Term::Constant => "F0",
            Term::Sign => "Fc",
            Term::Stribeck => "Fs-Fc",
            Term::TanhDifference => "g1",
            Term::Tanh => "g4",
            Term::Linear if self.is_stiffness() => "a2",
            Term::Linear if self.is_smooth() => "g6",
            Term::Linear => "Fv",
            Term::Absolute => "Fd",
            Term::Cubic => "a1",
            Term::Windup => "ksw",
        }
    }
}

/// Whether an arm can have a friction (12) with these factors g1, g4 and g6 and these slopes g2 and g3, or their logarithms: no term is
/// negative, and the Stribeck part is not a small difference of large terms.
pub(super) fn is_possible_friction([g1, g4, g6]: [f64; 3], [g2, g3]: [f64; 2]) -> bool {
    [g1, g4, g6].iter().all(|g| *g >= 0.0) && g1 <= LARGEST_STRIBECK * g4 && g2 >= g3
}

/// A form with its terms' factors and the logarithms of its shape parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ParametricCurve {
    pub terms: Vec<Term>,
    pub factors: Vec<f64>,
    pub logs: Vec<f64>,
    /// The width within which signs are softened.
    pub width: f64,
}

/// A term with given shape parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShapedTerm<'a> {
    term: Term,
    /// The logarithms of its own shape parameters.
    pub logs: &'a [f64],
    /// The width within which signs are softened.
    width: f64,
}

impl<'a> ShapedTerm<'a> {
    /// All terms, from the logarithms of all terms.
    pub fn all(terms: &'a [Term], logs: &'a [f64], width: f64) -> impl Iterator<Item = ShapedTerm<'a>> {
        let mut rest = logs;
        terms.iter().map(move |&term| {
            let (logs, after) = rest.split_at(term.shapes());
            rest = after;
            ShapedTerm { term, logs, width }
        })
    }

    pub fn value(self, x: f64) -> f64 {
        self.term.value(x, self.logs, self.width)
    }

    /// The derivative by the k-th logarithm.
    pub fn by_shape(self, x: f64, k: usize) -> f64 {
        self.term.by_shape(x, self.logs, k, self.width)
    }
}

impl ParametricCurve {
    /// The curve at x.
    pub fn value(&self, x: f64) -> f64 {
        let terms = ShapedTerm::all(&self.terms, &self.logs, self.width);
        terms.zip(&self.factors).map(|(term, c)| c * term.value(x)).sum()
    }

    /// The dry friction at the speed |v|, which holds a body at rest, and the other terms at v.
    pub fn dry_and_other(&self, v: f64) -> [f64; 2] {
        let terms = ShapedTerm::all(&self.terms, &self.logs, 0.0);
        let (mut dry, mut other) = (0.0, 0.0);
        for (shaped, c) in terms.zip(&self.factors) {
            match shaped.term {
                Term::Sign => dry += c,
                Term::Stribeck => dry += c * shaped.value(v.abs().max(f64::MIN_POSITIVE)),
                _ => other += c * shaped.value(v),
            }
        }
        [dry, other]
    }

    /// The change of each factor with which its term is as large as this torque over the points x; 0 for the terms that a simulation
    /// hardly shows.
    pub fn factor_sizes(&self, x: &[f64], torque: f64) -> Vec<f64> {
        let size = |shaped: ShapedTerm| match shaped.term {
            Term::Stribeck | Term::TanhDifference | Term::Windup => 0.0,
            _ => {
                let values: Vec<f64> = x.iter().map(|&x| shaped.value(x)).collect();
                torque / mean_square(&values).sqrt().max(f64::MIN_POSITIVE)
            }
        };
        ShapedTerm::all(&self.terms, &self.logs, self.width).map(size).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_by_shape_are_difference_quotients() {
        let h = 1e-6;
        for (term, t) in [
            (Term::Tanh, vec![2.0]),
            (Term::TanhDifference, vec![3.0, 1.0]),
            (Term::Stribeck, vec![-1.0]),
            (Term::Windup, vec![1.5]),
        ] {
            for k in 0..t.len() {
                for x in [-0.7, -0.1, 0.02, 0.4] {
                    let moved = |by: f64| {
                        let mut t = t.clone();
                        t[k] += by;
                        term.value(x, &t, 0.0)
                    };
                    let want = (moved(h) - moved(-h)) / (2.0 * h);
                    let got = term.by_shape(x, &t, k, 0.0);
                    assert!((got - want).abs() < 1e-8, "{term:?} {x}: {got} {want}");
                }
            }
        }
        assert_eq!(Term::Tanh.by_shape(1e6, &[5.0], 0, 0.0), 0.0);
    }
}

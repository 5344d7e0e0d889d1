//! Physical forms of the nonlinearity.

use crate::vectors::dot;

/// A physical form of a nonlinearity; every one also has an offset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhysicalForm {
    /// slope (x - high) above high, slope (x - low) below low, 0 between.
    DeadZone,
    /// slope x, held at its values at low and at high beyond them.
    Saturation,
    /// The dead zone from low to high, held at its values at bottom and at top beyond them: a valve's.
    LimitedDeadZone,
    /// height times the nearest whole number to x / step.
    Quantizer,
    /// The polynomial of this degree, at most 15.
    Polynomial(usize),
    /// A joint's friction, equation (12): g1 (tanh g2 x - tanh g3 x) + g4 tanh g5 x + g6 x.
    Friction,
    /// A joint's stiffness, (10) and (11): a1 x^3 + a2 x - ksw x exp(-asw x^2).
    Stiffness,
}

/// The form's name, for example "dead-zone" or "polynomial:3".
impl std::fmt::Display for PhysicalForm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            PhysicalForm::DeadZone => "dead-zone",
            PhysicalForm::Saturation => "saturation",
            PhysicalForm::LimitedDeadZone => "limited-dead-zone",
            PhysicalForm::Quantizer => "quantizer",
            PhysicalForm::Friction => "friction",
            PhysicalForm::Stiffness => "stiffness",
            PhysicalForm::Polynomial(degree) => return write!(f, "polynomial:{degree}"),
        })
    }
}

impl PhysicalForm {
    /// The names of the parameters; those found by search come first.
    pub(super) fn names(self) -> Vec<String> {
        let fixed: &[&str] = match self {
            PhysicalForm::DeadZone | PhysicalForm::Saturation => &["low", "high", "slope", "offset"],
            PhysicalForm::LimitedDeadZone => &["bottom", "low", "high", "top", "slope", "offset"],
            PhysicalForm::Quantizer => &["step", "height", "offset"],
            PhysicalForm::Friction => &["g2", "g3", "g5", "g1", "g4", "g6", "offset"],
            PhysicalForm::Stiffness => &["asw", "a1", "a2", "ksw", "offset"],
            PhysicalForm::Polynomial(degree) => {
                let powers = (1..=degree).map(|k| format!("x^{k}"));
                return powers.chain(["offset".to_owned()]).collect();
            }
        };
        fixed.iter().map(|n| (*n).to_owned()).collect()
    }

    /// The number of parameters found by search; the form is linear in the others.
    pub(super) fn searched(self) -> usize {
        match self {
            PhysicalForm::DeadZone | PhysicalForm::Saturation => 2,
            PhysicalForm::LimitedDeadZone => 4,
            PhysicalForm::Quantizer | PhysicalForm::Stiffness => 1,
            PhysicalForm::Friction => 3,
            PhysicalForm::Polynomial(_) => 0,
        }
    }

    /// Whether the searched parameters are places where the form breaks.
    pub(super) fn has_places(self) -> bool {
        matches!(
            self,
            PhysicalForm::DeadZone | PhysicalForm::Saturation | PhysicalForm::LimitedDeadZone
        )
    }

    /// The functions at x; their coefficients are the other parameters.
    pub(super) fn functions(self, searched: &[f64], x: f64) -> Vec<f64> {
        match (self, searched) {
            (PhysicalForm::DeadZone, &[low, high]) => vec![dead_zone(x, low, high), 1.0],
            (PhysicalForm::LimitedDeadZone, &[bottom, low, high, top]) => {
                vec![dead_zone(x.max(bottom).min(top), low, high), 1.0]
            }
            (PhysicalForm::Saturation, &[low, high]) => vec![x.max(low).min(high), 1.0],
            (PhysicalForm::Quantizer, &[step]) => vec![(x / step).round(), 1.0],
            (PhysicalForm::Friction, &[g2, g3, g5]) => {
                vec![(g2 * x).tanh() - (g3 * x).tanh(), (g5 * x).tanh(), x, 1.0]
            }
            (PhysicalForm::Stiffness, &[sharpness]) => vec![x * x * x, x, -x * (-sharpness * x * x).exp(), 1.0],
            (PhysicalForm::Polynomial(degree), _) => {
                let powers = (1..=degree as i32).map(|k| x.powi(k));
                powers.chain([1.0]).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The form's value at x for these parameters, in the order of the result; NaN if there are more or fewer than it has.
    pub fn value(self, p: &[f64], x: f64) -> f64 {
        let Some((searched, coefficients)) = p.split_at_checked(self.searched()) else {
            return f64::NAN;
        };
        let functions = self.functions(searched, x);
        if functions.len() != coefficients.len() {
            return f64::NAN;
        }
        dot(&functions, coefficients)
    }

    /// The places of the parameters from which on the form is flat, if it is so at both ends.
    pub(super) fn flat_beyond(self) -> Option<[usize; 2]> {
        match self {
            PhysicalForm::Saturation => Some([0, 1]),
            PhysicalForm::LimitedDeadZone => Some([0, 3]),
            _ => None,
        }
    }

    /// The places of the parameters between which the form has a dead zone.
    pub(super) fn dead_zone(self) -> Option<[usize; 2]> {
        match self {
            PhysicalForm::DeadZone => Some([0, 1]),
            PhysicalForm::LimitedDeadZone => Some([1, 2]),
            _ => None,
        }
    }

    /// The starting values of the searched parameters, for increasing abscissas x.
    pub(super) fn grid(self, x: &[f64]) -> Vec<Vec<f64>> {
        let (low, high) = (x[0], x[x.len() - 1]);
        let size = low.abs().max(high.abs());
        let rates = |counts: &[f64]| -> Vec<f64> { counts.iter().map(|c| c / size).collect() };
        match self {
            PhysicalForm::DeadZone | PhysicalForm::Saturation => {
                let at = |i: usize| x[(2 * i + 1) * (x.len() - 1) / 24];
                let pairs = (0..12).flat_map(|i| (i + 1..12).map(move |j| (i, j)));
                pairs.map(|(i, j)| vec![at(i), at(j)]).collect()
            }
            PhysicalForm::LimitedDeadZone => {
                let at = |i: usize| x[(2 * i + 1) * (x.len() - 1) / 18];
                let starts = (0..9).flat_map(|i| (i + 1..9).map(move |j| [i, j]));
                let ends = |[_, j]: [usize; 2]| (j..9).flat_map(|k| (k + 1..9).map(move |l| [k, l]));
                let all = starts.flat_map(|start| ends(start).map(move |end| [start[0], start[1], end[0], end[1]]));
                all.map(|places| places.map(at).to_vec()).collect()
            }
            PhysicalForm::Quantizer => (0..600).map(|i| vec![(high - low) * 0.99_f64.powi(i)]).collect(),
            PhysicalForm::Friction => {
                let mut grid = Vec::new();
                for g3 in rates(&[1.0, 3.0, 10.0, 30.0]) {
                    for ratio in [1.5, 3.0, 10.0] {
                        for g5 in rates(&[1.0, 3.0, 10.0, 20.0, 40.0, 100.0]) {
                            grid.push(vec![ratio * g3, g3, g5]);
                        }
                    }
                }
                grid
            }
            PhysicalForm::Stiffness => (0..12).map(|i| vec![2.0_f64.powi(i) / (size * size)]).collect(),
            PhysicalForm::Polynomial(_) => vec![Vec::new()],
        }
    }
}

/// 0 between low and high, beyond them the distance to the nearer of them.
fn dead_zone(x: f64, low: f64, high: f64) -> f64 {
    (x - high).max(0.0) + (x - low).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_numbers_of_parameters_have_no_value() {
        for (form, count) in [
            (PhysicalForm::DeadZone, 4),
            (PhysicalForm::Saturation, 4),
            (PhysicalForm::LimitedDeadZone, 6),
            (PhysicalForm::Quantizer, 3),
            (PhysicalForm::Friction, 7),
            (PhysicalForm::Stiffness, 5),
            (PhysicalForm::Polynomial(2), 3),
        ] {
            for n in 0..10 {
                assert_eq!(form.value(&vec![1.0; n], 0.5).is_nan(), n != count, "{form:?} {n}");
            }
        }
    }
}

//! How uncertain the blocks of a fit are: standard errors of coefficients, bands of nonlinearities.
//!
//! The covariance of the parameters is that of nonlinear least squares. For a coloured error it is $\sigma^2 G^{-1} M G^{-1}$: G is the
//! normal matrix of the derivatives, M that of the derivatives with the colour of the error. For generalised least squares it is
//! $\sigma^2 W^{-1}$ with the normal matrix W of the whitened derivatives (Ljung 1999, section 9.4). The reported numbers of the blocks, in
//! the record's units and the conventional scale, are functions of the parameters. Their covariance follows by the delta method, with
//! derivatives by differences.

use super::descent::{Residuals, Whitened};
use super::efficient::{matrix_product, whitening_filter};
use super::limits::{BAND_POINTS, BAND_STEP};
use super::loss::Loss;
use super::signals::Signals;
use super::system::System;
use crate::error::Result;
use crate::identify::result::{BlockKind, CoefficientErrors, LinearBlock, Path};
use crate::linear::least_squares::{NormalEquations, UnitDiagonal, normal_equations};
use crate::linear::levenberg_marquardt::Linearisation;
use crate::parallel;
use crate::quantiles::NORMAL_95;
use crate::vectors::dot;

/// Parameters and their covariance, row by row.
pub(in crate::identify) struct Uncertainty {
    parameters: Vec<f64>,
    covariance: Vec<f64>,
}

impl Uncertainty {
    /// The uncertainty of parameters at the minimum of (generalised) least squares. `None` if the samples do not determine them.
    pub fn new(problem: &impl Residuals, at: Vec<f64>) -> Option<Self> {
        let plain = problem.linearise(&at);
        let equations = |at: &Linearisation, from| normal_equations(&at.residuals, &at.jacobian, from);
        let own = equations(&plain, problem.from());
        let counted = plain.residuals.len() - problem.from();
        let Some(filter) = whitening_filter(problem, &plain.residuals) else {
            return Self::of_independent(at, &own, counted, 1.0);
        };
        let whitened = Whitened {
            problem,
            filter: &filter,
        };
        let white = equations(&whitened.whitened(&plain), whitened.from());
        if relative_decrement(&white)? < relative_decrement(&own)? {
            return Self::of_independent(at, &white, counted, 1.0);
        }
        let n = at.len();
        let coloured = normal_equations(&plain.residuals, &whitened.coloured(&plain.jacobian), problem.from());
        let variance = white.cost / counted.checked_sub(n).filter(|degrees| *degrees > 0)? as f64;
        let inverse = UnitDiagonal::new(&own).inverse()?;
        let sandwich = matrix_product(&matrix_product(&inverse, &coloured.normal, n), &inverse, n);
        Some(Uncertainty {
            parameters: at,
            covariance: sandwich.iter().map(|v| variance * v).collect(),
        })
    }

    /// The uncertainty of parameters at the minimum of a sum of `counted` squares. `dependence` squares together carry as much information
    /// as one independent square.
    pub fn of_independent(
        parameters: Vec<f64>,
        equations: &NormalEquations,
        counted: usize,
        dependence: f64,
    ) -> Option<Self> {
        let inverse = UnitDiagonal::new(equations).inverse()?;
        let degrees = counted.checked_sub(parameters.len()).filter(|degrees| *degrees > 0)?;
        let power = dependence * equations.cost / degrees as f64;
        Some(Uncertainty {
            parameters,
            covariance: inverse.iter().map(|v| power * v).collect(),
        })
    }

    /// Numbers that are functions of the parameters. `None` if they have no derivatives.
    pub fn of(&self, numbers: impl Fn(&[f64]) -> Option<Vec<f64>> + Sync) -> Option<Derived<'_>> {
        let n = self.parameters.len();
        let derivative = |p: usize| {
            let step = BAND_STEP * self.covariance[p * n + p].sqrt();
            let moved = |sign: f64| {
                let mut q = self.parameters.clone();
                q[p] += sign * step;
                numbers(&q)
            };
            let (up, down) = (moved(1.0)?, moved(-1.0)?);
            (up.len() == down.len()).then(|| up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect())
        };
        let derivatives: Vec<Vec<f64>> = parallel::map(n, derivative).into_iter().collect::<Option<_>>()?;
        let finite = derivatives.iter().flatten().all(|d| d.is_finite());
        finite.then_some(Derived {
            derivatives,
            covariance: &self.covariance,
        })
    }
}

/// The share of the sum of squares that a further Gauss-Newton step would remove.
fn relative_decrement(equations: &NormalEquations) -> Option<f64> {
    let step = UnitDiagonal::new(equations).solve(&equations.descent, |d| d)?;
    Some(dot(&step, &equations.descent) / equations.cost)
}

/// Functions of parameters, with their derivatives.
pub(in crate::identify) struct Derived<'a> {
    /// For each parameter, the derivatives of all numbers.
    derivatives: Vec<Vec<f64>>,
    /// The parameters' covariance.
    covariance: &'a [f64],
}

impl Derived<'_> {
    /// The covariance of two of the numbers.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let rows = self.covariance.chunks_exact(self.derivatives.len().max(1));
        let product = |row: &[f64]| row.iter().zip(&self.derivatives).map(|(c, d)| c * d[j]).sum::<f64>();
        rows.zip(&self.derivatives).map(|(row, d)| d[i] * product(row)).sum()
    }

    /// The standard error of a number.
    pub fn standard_error(&self, i: usize) -> f64 {
        self.covariance(i, i).max(0.0).sqrt()
    }
}

/// Half widths of a pointwise band of 95 %, straight between points.
pub(in crate::identify) struct Band {
    x: Vec<f64>,
    width: Vec<f64>,
}

impl Band {
    /// The description of a band from the parameters' covariance.
    pub const LABEL: &str = "95 % pointwise, for this structure and these breakpoints";

    /// The band of a curve at these points; its values are the numbers from `first` on.
    pub fn new(x: Vec<f64>, derived: &Derived<'_>, first: usize) -> Self {
        let width = |i: usize| NORMAL_95 * derived.standard_error(first + i);
        Band {
            width: (0..x.len()).map(width).collect(),
            x,
        }
    }

    /// The half width at a point; beyond the ends, that at the end.
    pub fn at(&self, x: f64) -> f64 {
        let last = self.x.len() - 1;
        let x = x.clamp(self.x[0], self.x[last]);
        let right = self.x.partition_point(|p| *p <= x).clamp(1, last);
        let share = (x - self.x[right - 1]) / (self.x[right] - self.x[right - 1]);
        self.width[right - 1] + share * (self.width[right] - self.width[right - 1])
    }

    /// Evenly spaced points between two.
    pub fn points([low, high]: [f64; 2]) -> Vec<f64> {
        let step = (high - low) / (BAND_POINTS - 1) as f64;
        (0..BAND_POINTS).map(|i| low + step * i as f64).collect()
    }
}

/// Gives the blocks of a system's paths standard errors and bands, if the samples determine them; `paths_of` makes the paths of a system.
pub(in crate::identify) fn add_errors(
    paths: &mut [Path],
    system: &System,
    data: &Signals,
    paths_of: impl Fn(&System) -> Result<Vec<Path>> + Sync,
) {
    let loss = Loss::with_unique_scales(system.clone(), data);
    let Some(uncertainty) = Uncertainty::new(&loss, loss.start()) else {
        return;
    };
    let shapes: Vec<Shape> = kinds(paths).map(Shape::new).collect();
    let numbers = |parameters: &[f64]| -> Option<Vec<f64>> {
        let paths = paths_of(&loss.system(parameters)).ok()?;
        let each = kinds(&paths).zip(&shapes).map(|(kind, shape)| shape.numbers(kind));
        Some(each.collect::<Option<Vec<_>>>()?.concat())
    };
    let Some(derived) = uncertainty.of(numbers) else {
        return;
    };
    let mut first = 0;
    let blocks = paths.iter_mut().flat_map(|path| &mut path.blocks);
    for (block, shape) in blocks.zip(&shapes) {
        shape.add_errors(&mut block.kind, &derived, first);
        first += shape.count();
    }
}

fn kinds(paths: &[Path]) -> impl Iterator<Item = &BlockKind> {
    paths.iter().flat_map(|path| &path.blocks).map(|block| &block.kind)
}

/// The numbers that describe a block and get errors.
enum Shape {
    /// A curve at these points, and the number of its kinks.
    Curve {
        x: Vec<f64>,
        kinks: usize,
    },
    /// `b` coefficients of the numerator after the delay, and `a` of the denominator after its leading 1.
    Linear {
        delay: usize,
        b: usize,
        a: usize,
    },
    Other,
}

impl Shape {
    fn new(kind: &BlockKind) -> Shape {
        match kind {
            BlockKind::Static(block) => {
                let x = block.curve.x();
                Shape::Curve {
                    x: Band::points([x[0], x[x.len() - 1]]),
                    kinks: block.kinks.len(),
                }
            }
            BlockKind::Linear(block) => {
                let (b, delay) = (block.system.b(), block.delay());
                Shape::Linear {
                    delay,
                    b: b.len() - delay,
                    a: block.order(),
                }
            }
            _ => Shape::Other,
        }
    }

    fn count(&self) -> usize {
        match self {
            Shape::Curve { x, kinks } => x.len() + kinks,
            Shape::Linear { b, a, .. } => b + a,
            Shape::Other => 0,
        }
    }

    /// The numbers of a block of this shape.
    fn numbers(&self, kind: &BlockKind) -> Option<Vec<f64>> {
        match (self, kind) {
            (Shape::Curve { x, kinks }, BlockKind::Static(block)) => {
                let values = x.iter().map(|x| block.curve.value(*x));
                (block.kinks.len() == *kinks).then(|| values.chain(block.kinks.iter().copied()).collect())
            }
            (Shape::Linear { delay, b, a }, BlockKind::Linear(block)) => {
                let (own_b, own_a) = (block.system.b(), block.system.a());
                let same = own_b.len() == delay + b && own_a.len() == a + 1;
                same.then(|| [&own_b[*delay..], &own_a[1..]].concat())
            }
            (Shape::Other, _) => Some(Vec::new()),
            _ => None,
        }
    }

    /// Gives a block the errors of its numbers, which begin at `first`.
    fn add_errors(&self, kind: &mut BlockKind, derived: &Derived<'_>, first: usize) {
        match (self, kind) {
            (Shape::Curve { x, kinks }, BlockKind::Static(block)) => {
                let found = Band::new(x.clone(), derived, first);
                block.band = block.curve.x().iter().map(|x| found.at(*x)).collect();
                block.band_label = Band::LABEL;
                let error = |k: usize| derived.standard_error(first + x.len() + k);
                block.set_kink_errors((0..*kinks).map(error).collect());
            }
            (Shape::Linear { delay, b, a }, BlockKind::Linear(LinearBlock { errors, .. })) => {
                let all = first..first + b + a;
                let pairs = all.clone().flat_map(|i| all.clone().map(move |j| (i, j)));
                let covariance = pairs.map(|(i, j)| derived.covariance(i, j)).collect();
                *errors = Some(CoefficientErrors::new(covariance, *delay, *b));
            }
            _ => (),
        }
    }
}

#[cfg(test)]
#[path = "uncertainty_tests.rs"]
mod tests;

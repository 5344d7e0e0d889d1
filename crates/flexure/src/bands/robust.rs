//! Bands for the kernel estimate by robust bias correction (Calonico, Cattaneo & Farrell 2018).
//!
//! The bias of the local constant or local linear estimate at bandwidth h is estimated from a local quadratic at
//! bandwidth b = h/rho and subtracted. Both are linear in the ordinates, and so is the result,
//! $$ \hat m_{bc}(x) = \sum_i l_i(x)\, Y_i , \qquad s^2(x) = \sum_i l_i(x)^2\, \hat\sigma_i^2 , $$
//! so that s includes the variance of the correction. With rho = 1 the corrected estimate is the local quadratic at h. The noise variances
//! are squared residuals of the local quadratic at b, each corrected for its own share of the fit ([`super::residual`]). Quantiles are
//! Student's, with Satterthwaite's degrees of freedom (sum l_i^2)^2 / sum l_i^4, which matter if few points are in reach.

use super::local::{LocalPolynomial, Window, dot};
use super::residual::noise_variances;
use super::supremum::{self, Row};
use super::{Band, BandKind, check_level, student};
use crate::distributions::normal_quantile;
use crate::error::{Error, Result};
use crate::nonlinearity::kernel::Sorted;
use crate::nonlinearity::{Degree, KernelFit};
use crate::parallel;

/// The fewest points: three for the local quadratic, and two for its noise.
const FEWEST: usize = 5;
/// Cells in a bandwidth, within which the points share a multiplier.
const CELLS: f64 = 32.0;

/// A band for [`KernelFit`] by robust bias correction; errors independent, their variance any function of x.
///
/// The bandwidth may be the one that cross-validation chose: the band then uses this bandwidth times n^(-1/20), which improves the error of
/// coverage from n^(-2/5) to its best order (Calonico, Cattaneo and Farrell 2018, section 4). For errors that depend on each other in time
/// (with an x that does too) it is too narrow: see [`super::BootstrapBand`].
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `level` | nominal coverage | above 0, below 1 | 0.95 |
/// | `kind` | pointwise or simultaneous | | pointwise |
/// | `undersmoothing` | e in the band's bandwidth, the estimate's times n^-e | from 0, below 1 | 1/20 |
/// | `rho` | bandwidth over that of the bias estimate | positive, finite | 1, the best for coverage |
/// | `draws` | of the supremum (simultaneous only) | at least 2 / (1 - level) | 2000 |
/// | `seed` | of these draws | | 1 |
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustBand {
    /// The nominal coverage.
    pub level: f64,
    /// Pointwise or simultaneous.
    pub kind: BandKind,
    /// e in the band's bandwidth, the estimate's times n^-e for n points.
    pub undersmoothing: f64,
    /// The band's bandwidth over that of the bias estimate.
    pub rho: f64,
    /// Draws of the process whose supremum widens a simultaneous band.
    pub draws: usize,
    /// The seed of these draws.
    pub seed: u64,
}

impl Default for RobustBand {
    fn default() -> Self {
        RobustBand {
            level: 0.95,
            kind: BandKind::default(),
            undersmoothing: 0.05,
            rho: 1.0,
            draws: 2000,
            seed: 1,
        }
    }
}

/// The corrected estimate at one point.
struct Corrected {
    /// Less the ordinates' mean.
    value: f64,
    variance: f64,
    freedom: f64,
    /// The weights of the cells that count, for a simultaneous band.
    row: Row,
}

impl RobustBand {
    /// The band at the points `at`, in any order.
    ///
    /// NaN where no data are within reach (for the Gaussian kernel: within 9 bandwidths), and for NaN. Where the
    /// points in reach have fewer than three distinct abscissas, there is a bias that cannot be corrected.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter outside its range, [`Error::Data`]: `TooShort` with fewer than 5 points.
    pub fn for_kernel(&self, fit: &KernelFit, at: &[f64]) -> Result<Band> {
        self.check()?;
        let data = fit.data();
        if data.len() < FEWEST {
            return Err(Error::too_short("a confidence band", FEWEST, data.len()));
        }
        let h = fit.method().bandwidth * (data.len() as f64).powf(-self.undersmoothing);
        let narrow = Window {
            data,
            kernel: fit.method().kernel,
            h,
        };
        let wide = Window {
            h: h / self.rho,
            ..narrow
        };
        let smoother = Smoother {
            narrow,
            wide,
            degree: fit.degree(),
            variances: &noise_variances(wide),
        };
        let cells = match self.kind {
            BandKind::Pointwise => Cells::default(),
            BandKind::Simultaneous => Cells::new(data, smoother.variances, h.min(wide.h) / CELLS),
        };
        let corrected: Vec<Option<Corrected>> = parallel::batch(at, |&q| smoother.at(q, &cells));
        let normal_quantile = match self.kind {
            BandKind::Pointwise => normal_quantile(0.5 + 0.5 * self.level),
            BandKind::Simultaneous => {
                let rows: Vec<Row> = corrected.iter().flatten().map(|c| c.row.clone()).collect();
                supremum::quantile(&rows, cells.x.len(), self.level, self.draws, self.seed)
            }
        };
        let of = |f: &dyn Fn(&Corrected) -> f64| -> Vec<f64> {
            corrected.iter().map(|c| c.as_ref().map_or(f64::NAN, f)).collect()
        };
        let band = Band {
            x: vec![at.to_vec()],
            estimate: fit.predict(at),
            centre: of(&|c| data.mean + c.value),
            standard_error: of(&|c| c.variance.sqrt()),
            lower: Vec::new(),
            upper: Vec::new(),
            level: self.level,
            kind: self.kind,
            method: self.description(),
        };
        Ok(band.with_limits(&of(&|c| student(normal_quantile, c.freedom))))
    }

    /// The parameters must be in their ranges.
    fn check(&self) -> Result<()> {
        let draws = match self.kind {
            BandKind::Simultaneous => self.draws,
            BandKind::Pointwise => usize::MAX,
        };
        check_level(self.level, draws, "draws")?;
        if !(0.0..1.0).contains(&self.undersmoothing) {
            return Err(Error::parameter(
                "undersmoothing, an exponent,",
                self.undersmoothing,
                "from 0, below 1",
            ));
        }
        if !(self.rho > 0.0 && self.rho.is_finite()) {
            return Err(Error::parameter(
                "rho, the bandwidth over that of the bias estimate,",
                self.rho,
                "positive and finite",
            ));
        }
        Ok(())
    }

    fn description(&self) -> String {
        let quantile = match self.kind {
            BandKind::Pointwise => "",
            BandKind::Simultaneous => ", the supremum by Gaussian multipliers",
        };
        format!(
            "robust bias correction by a local quadratic, variance from the residuals{quantile}; errors independent"
        )
    }
}

/// The corrected estimate's weights.
struct Smoother<'a> {
    /// The window of the estimate.
    narrow: Window<'a>,
    /// The window of the bias estimate.
    wide: Window<'a>,
    degree: Degree,
    variances: &'a [f64],
}

impl Smoother<'_> {
    /// The corrected estimate at `q`; nothing without data in reach.
    fn at(&self, q: f64, cells: &Cells) -> Option<Corrected> {
        if !q.is_finite() {
            return None;
        }
        let weights = self.weights(q)?;
        let data = self.narrow.data;
        let (mut value, mut variance, mut squares, mut fourths) = (0.0, 0.0, 0.0, 0.0);
        let range = weights.range.clone();
        for (i, l) in range.clone().map(|i| (i, weights.of(i))) {
            let square = l * l;
            value += l * data.y[i];
            variance += square * self.variances[i];
            squares += square;
            fourths += square * square;
        }
        Some(Corrected {
            value,
            variance,
            freedom: squares * squares / fourths,
            row: cells.row(range, &weights),
        })
    }

    fn weights(&self, q: f64) -> Option<Weights<'_>> {
        let mut kernel_weights = Vec::new();
        let wide = LocalPolynomial::new(self.wide, 2, q, &mut kernel_weights)?;
        let at = wide.dual(q);
        if self.wide.h == self.narrow.h {
            return Some(Weights {
                q,
                range: wide.range.clone(),
                narrow: None,
                wide: Part {
                    window: self.wide,
                    polynomial: wide,
                    dual: at,
                },
            });
        }
        let degree = match self.degree {
            Degree::Constant => 0,
            Degree::Linear => 1,
        };
        let narrow = LocalPolynomial::new(self.narrow, degree, q, &mut kernel_weights)?;
        let narrow_at = narrow.dual(q);
        // The bias of the estimate if the truth is the quadratic's p_k: sum_i l_i p_k(X_i) - p_k(q).
        let mut bias = [0.0; 3];
        for (k, &x) in kernel_weights.iter().zip(&self.narrow.data.x[narrow.range.clone()]) {
            let l = k * dot(narrow.basis(x), narrow_at);
            let dual = wide.dual(x);
            (0..3).for_each(|j| bias[j] += l * dual[j]);
        }
        let correction = [0, 1, 2].map(|j| at[j] - bias[j]);
        Some(Weights {
            q,
            range: wide.range.start.min(narrow.range.start)..wide.range.end.max(narrow.range.end),
            narrow: Some(Part {
                window: self.narrow,
                polynomial: narrow,
                dual: narrow_at,
            }),
            wide: Part {
                window: self.wide,
                polynomial: wide,
                dual: correction,
            },
        })
    }
}

/// The weights l_i(q) of the ordinates.
struct Weights<'a> {
    q: f64,
    /// The points that may have a weight.
    range: std::ops::Range<usize>,
    /// The estimate itself, if its bandwidth differs from that of the bias estimate.
    narrow: Option<Part<'a>>,
    wide: Part<'a>,
}

/// The contribution of a local polynomial to the weights.
struct Part<'a> {
    window: Window<'a>,
    polynomial: LocalPolynomial,
    /// The factor of each basis function.
    dual: [f64; 3],
}

impl Part<'_> {
    /// The share of the weight at `q` of an ordinate at `x`.
    #[inline(always)]
    fn at(&self, q: f64, x: f64) -> f64 {
        self.window.kernel.weight((q - x) / self.window.h) * dot(self.polynomial.basis(x), self.dual)
    }
}

impl Weights<'_> {
    /// The weight of an ordinate at `x` of weight 1.
    #[inline(always)]
    fn at(&self, x: f64) -> f64 {
        let of = |part: &Part<'_>| part.at(self.q, x);
        of(&self.wide) + self.narrow.as_ref().map_or(0.0, of)
    }

    /// The weight of ordinate `i`.
    #[inline(always)]
    fn of(&self, i: usize) -> f64 {
        let data = self.wide.window.data;
        data.weight(i) * self.at(data.x[i])
    }
}

/// The points in cells; within a cell, the weights hardly differ.
#[derive(Default)]
struct Cells {
    /// Mean abscissas.
    x: Vec<f64>,
    /// Roots of sum w_i^2 sigma_i^2.
    size: Vec<f64>,
    /// The cell of each point.
    of: Vec<usize>,
}

impl Cells {
    fn new(data: &Sorted, variances: &[f64], width: f64) -> Self {
        let mut cells = Cells::default();
        let mut first = 0;
        while first < data.len() {
            let count = data.x[first..].partition_point(|x| x - data.x[first] <= width).max(1);
            let points = first..first + count;
            let square: f64 = points.clone().map(|i| data.weight(i).powi(2) * variances[i]).sum();
            let offset: f64 = points.clone().map(|i| data.x[i] - data.x[first]).sum();
            cells.of.extend(std::iter::repeat_n(cells.x.len(), count));
            cells.x.push(data.x[first] + offset / count as f64);
            cells.size.push(square.sqrt());
            first = points.end;
        }
        cells
    }

    /// The weights of the cells that hold the points `range`, scaled to unit variance.
    fn row(&self, range: std::ops::Range<usize>, weights: &Weights<'_>) -> Row {
        let (Some(&first), Some(&last)) = (self.of.get(range.start), self.of.get(range.end.wrapping_sub(1))) else {
            return Row {
                first: 0,
                weights: Vec::new(),
            };
        };
        let row = (first..=last).map(|c| self.size[c] * weights.at(self.x[c])).collect();
        Row { first, weights: row }.standardised()
    }
}

#[cfg(test)]
#[path = "robust_tests/mod.rs"]
mod tests;

//! The loop on standardised signals: a state space around a spline, and the freedom to write it in other coordinates.
//!
//! $$ x_{k+1} = A x_k + B_u u_k + B_w w_k, \quad y_k = C_y x_k + D_{yu} u_k + D_{yw} w_k + o, \quad
//!    z_k = C_z x_k + D_{zu} u_k, \quad w_k = f(z_k) $$
//!
//! The same system can be written in many ways. A change of state, the scales of z and w, a slope that moves between f and the linear
//! part and a level that moves between f and the offset do not change its output. `loss` keeps to steps that change the output.

use super::limits::{FARTHEST, NEGLIGIBLE, STATE_RIDGE};
use crate::identify::block::{KinkedSpline, Tangent};
use crate::linalg::{self, Matrix};
use crate::vectors::{add, dot};

/// The loop and the state in which every experiment starts.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Loop {
    /// Row-major.
    pub a: Vec<f64>,
    pub bu: Vec<f64>,
    pub bw: Vec<f64>,
    pub cy: Vec<f64>,
    pub cz: Vec<f64>,
    pub dyu: f64,
    pub dyw: f64,
    pub dzu: f64,
    pub offset: f64,
    pub spline: KinkedSpline,
    /// The gain of the state's correction by the last prediction error while a start is fitted; otherwise zero.
    pub correction: Vec<f64>,
    /// One state an experiment.
    pub initial: Vec<Vec<f64>>,
    pub entering: Entering,
}

/// The input of the nonlinearity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entering {
    /// The output, without its offset.
    Output,
    /// A hidden signal.
    Hidden,
}

/// Experiments one after the other, at zero mean and unit variance.
#[derive(Debug, Clone)]
pub(super) struct Observed {
    pub u: Vec<f64>,
    /// The output; any value where it is missing.
    pub y: Vec<f64>,
    pub missing: Vec<bool>,
    /// The first sample of every experiment.
    pub starts: Vec<usize>,
}

impl Observed {
    /// One experiment without missing samples.
    pub fn of(u: Vec<f64>, y: Vec<f64>) -> Observed {
        Observed {
            missing: vec![false; y.len()],
            u,
            y,
            starts: vec![0],
        }
    }

    /// The first samples.
    pub fn head(&self, samples: usize) -> Observed {
        let n = self.y.len().min(samples);
        Observed {
            u: self.u[..n].to_vec(),
            y: self.y[..n].to_vec(),
            missing: self.missing[..n].to_vec(),
            starts: self.starts.iter().copied().filter(|s| *s < n).collect(),
        }
    }

    /// The second half of the last experiment; only the second half of this counts.
    pub fn restarted(&self) -> Observed {
        let n = self.y.len();
        let first = self.starts.last().copied().unwrap_or(0);
        let (middle, counted) = (first + (n - first) / 2, first + (n - first) / 4 * 3);
        let mut missing = self.missing[middle..].to_vec();
        missing[..counted - middle].fill(true);
        Observed {
            u: self.u[middle..].to_vec(),
            y: self.y[middle..].to_vec(),
            missing,
            starts: vec![0],
        }
    }

    /// The number of outputs that are not missing.
    pub fn counted(&self) -> usize {
        self.missing.iter().filter(|m| !**m).count()
    }

    /// The experiment that starts at a sample.
    pub fn starting_at(&self, sample: usize) -> Option<usize> {
        self.starts.binary_search(&sample).ok()
    }
}

/// The places of the linear part's numbers among all parameters; the spline's follow, then the initial states.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    pub n: usize,
}

impl Layout {
    pub fn a(self, i: usize, j: usize) -> usize {
        i * self.n + j
    }
    pub fn bu(self, i: usize) -> usize {
        self.n * self.n + i
    }
    pub fn bw(self, i: usize) -> usize {
        self.bu(self.n) + i
    }
    pub fn cy(self, i: usize) -> usize {
        self.bw(self.n) + i
    }
    pub fn cz(self, i: usize) -> usize {
        self.cy(self.n) + i
    }
    pub fn dyu(self) -> usize {
        self.cz(self.n)
    }
    pub fn dyw(self) -> usize {
        self.dyu() + 1
    }
    pub fn dzu(self) -> usize {
        self.dyu() + 2
    }
    pub fn offset(self) -> usize {
        self.dyu() + 3
    }
    pub fn spline(self) -> usize {
        self.dyu() + 4
    }
}

/// A sample of a run, before the state moves on.
pub(super) struct Sample<'a> {
    pub k: usize,
    pub x: &'a [f64],
    pub z: f64,
    pub w: f64,
    pub y: f64,
}

impl Loop {
    pub fn layout(&self) -> Layout {
        Layout { n: self.bu.len() }
    }

    pub fn order(&self) -> usize {
        self.bu.len()
    }

    /// All numbers except the initial states, in the order of the [`Layout`].
    pub fn parameters(&self) -> Vec<f64> {
        let parts = [&self.a, &self.bu, &self.bw, &self.cy, &self.cz];
        let mut all: Vec<f64> = parts.into_iter().flatten().copied().collect();
        all.extend([self.dyu, self.dyw, self.dzu, self.offset]);
        all.extend(self.spline.parameters());
        all
    }

    /// The number of [`parameters`](Self::parameters).
    pub fn count(&self) -> usize {
        self.layout().spline() + self.spline.count()
    }

    /// Takes other [`parameters`](Self::parameters).
    pub fn set(&mut self, p: &[f64]) {
        let l = self.layout();
        let n = l.n;
        self.a.copy_from_slice(&p[..n * n]);
        for (at, own) in [
            (l.bu(0), &mut self.bu),
            (l.bw(0), &mut self.bw),
            (l.cy(0), &mut self.cy),
            (l.cz(0), &mut self.cz),
        ] {
            own.copy_from_slice(&p[at..at + n]);
        }
        (self.dyu, self.dyw, self.dzu, self.offset) = (p[l.dyu()], p[l.dyw()], p[l.dzu()], p[l.offset()]);
        self.spline.set(&p[l.spline()..]);
    }

    /// Runs freely from the initial states, with only the correction, and reports every sample; false if the loop runs away.
    #[inline(always)]
    pub fn run(&self, data: &Observed, mut report: impl FnMut(Sample<'_>)) -> bool {
        let n = self.order();
        let (mut x, mut next) = (vec![0.0; n], vec![0.0; n]);
        for (k, &u) in data.u.iter().enumerate() {
            if let Some(experiment) = data.starting_at(k) {
                match self.initial.get(experiment) {
                    Some(state) => x.copy_from_slice(state),
                    None => x.fill(0.0),
                }
            }
            let z = dot(&self.cz, &x) + self.dzu * u;
            if !(z.abs() < FARTHEST * self.spline.span()) {
                return false;
            }
            let w = self.spline.value(z);
            let y = dot(&self.cy, &x) + self.dyu * u + self.dyw * w + self.offset;
            if !(y.abs() < FARTHEST) {
                return false;
            }
            report(Sample { k, x: &x, z, w, y });
            for i in 0..n {
                next[i] = dot(&self.a[i * n..(i + 1) * n], &x) + self.bu[i] * u + self.bw[i] * w;
            }
            if !data.missing[k] {
                let error = data.y[k] - y;
                add(&mut next, error, &self.correction);
            }
            std::mem::swap(&mut x, &mut next);
        }
        true
    }

    /// The same with this share of the correction.
    pub fn corrected(&self, share: f64) -> Loop {
        let mut next = self.clone();
        next.correction.iter_mut().for_each(|c| *c *= share);
        next
    }

    /// The output; `None` if the loop runs away.
    pub fn output(&self, data: &Observed) -> Option<Vec<f64>> {
        let mut output = Vec::with_capacity(data.u.len());
        self.run(data, |s| output.push(s.y)).then_some(output)
    }

    /// The input of the nonlinearity; `None` if the loop runs away.
    pub fn entering(&self, data: &Observed) -> Option<Vec<f64>> {
        let mut entering = Vec::with_capacity(data.u.len());
        self.run(data, |s| entering.push(s.z)).then_some(entering)
    }

    /// The sum of squared simulation errors; infinite if the loop runs away.
    pub fn squares(&self, data: &Observed) -> f64 {
        let mut sum = 0.0;
        let ran = self.run(data, |s| {
            if !data.missing[s.k] {
                sum += (s.y - data.y[s.k]).powi(2);
            }
        });
        if ran { sum } else { f64::INFINITY }
    }

    /// The same system after a slope has moved from the nonlinearity into the linear part.
    pub fn with_slope_moved(mut self, slope: f64) -> Loop {
        let n = self.order();
        for i in 0..n {
            for j in 0..n {
                self.a[i * n + j] += slope * self.bw[i] * self.cz[j];
            }
            self.bu[i] += slope * self.bw[i] * self.dzu;
            self.cy[i] += slope * self.dyw * self.cz[i];
        }
        self.dyu += slope * self.dyw * self.dzu;
        let line = self.spline.line();
        self.spline.c.iter_mut().zip(line).for_each(|(c, x)| *c -= slope * x);
        self
    }

    /// The same system with other scales of the nonlinearity's input and output: both are divided by these factors.
    pub fn with_scales_divided(mut self, z: f64, w: f64) -> Loop {
        self.cz.iter_mut().for_each(|c| *c /= z);
        self.dzu /= z;
        self.bw.iter_mut().for_each(|b| *b *= w);
        self.dyw *= w;
        self.spline = self.spline.rescaled(1.0 / z, 1.0 / w);
        self
    }

    /// The same system with uncorrelated states of unit variance, w without a slope over the data, and z and w of unit variance. Unchanged
    /// if it runs away or a signal does not vary.
    pub fn balanced(&self, data: &Observed) -> Loop {
        let n = self.order();
        let (mut states, mut moments) = (Matrix::zeros(data.u.len(), n), Moments::default());
        let ran = self.run(data, |s| {
            s.x.iter().enumerate().for_each(|(i, x)| states[(s.k, i)] = *x);
            moments.add(s.z, s.w);
        });
        if !ran {
            return self.clone();
        }
        let usable = |v: f64| v > 0.0 && v.is_finite();
        let slope = moments.slope();
        let mut next = self.clone();
        if slope.is_finite() {
            next = next.with_slope_moved(slope);
        }
        let (z, w) = (moments.spread_of_z(), moments.spread_about_the_line());
        next = next.with_scales_divided(
            if usable(z) { z } else { 1.0 },
            if w > NEGLIGIBLE * moments.spread_of_w() && usable(w) {
                w
            } else {
                1.0
            },
        );
        for mut column in states.column_iter_mut() {
            let mean = column.mean();
            column.add_scalar_mut(-mean);
        }
        let covariance = states.tr_mul(&states) / data.u.len().max(1) as f64;
        next.changed(&covariance).unwrap_or(next)
    }

    /// The same system with other states: their covariance, now `covariance`, becomes the unit matrix.
    fn changed(&self, covariance: &Matrix) -> Option<Loop> {
        let n = self.order();
        let largest = (0..n).map(|i| covariance[(i, i)]).fold(0.0, f64::max);
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        let ridged = covariance + Matrix::identity(n, n) * (STATE_RIDGE * largest);
        let factor = ridged.cholesky()?.unpack();
        let inverse = factor.clone().try_inverse()?;
        let product = |m: &Matrix, v: &[f64]| (m * linalg::Vector::from_column_slice(v)).as_slice().to_vec();
        let transposed = factor.transpose();
        let a = &inverse * Matrix::from_row_slice(n, n, &self.a) * &factor;
        Some(Loop {
            a: a.transpose().as_slice().to_vec(),
            bu: product(&inverse, &self.bu),
            bw: product(&inverse, &self.bw),
            cy: product(&transposed, &self.cy),
            cz: product(&transposed, &self.cz),
            correction: product(&inverse, &self.correction),
            initial: self.initial.iter().map(|x| product(&inverse, x)).collect(),
            ..self.clone()
        })
    }

    /// Value and slope of the nonlinearity.
    pub fn tangent(&self, z: f64) -> Tangent {
        self.spline.tangent(z, &self.spline.local(z))
    }
}

/// Sums over z and w.
#[derive(Default)]
struct Moments {
    count: f64,
    z: f64,
    w: f64,
    zz: f64,
    zw: f64,
    ww: f64,
}

impl Moments {
    fn add(&mut self, z: f64, w: f64) {
        self.count += 1.0;
        self.z += z;
        self.w += w;
        self.zz += z * z;
        self.zw += z * w;
        self.ww += w * w;
    }

    fn covariance(&self) -> f64 {
        self.zw / self.count - self.z * self.w / (self.count * self.count)
    }

    fn spread_of_z(&self) -> f64 {
        (self.zz / self.count - (self.z / self.count).powi(2)).max(0.0).sqrt()
    }

    fn spread_of_w(&self) -> f64 {
        (self.ww / self.count - (self.w / self.count).powi(2)).max(0.0).sqrt()
    }

    fn slope(&self) -> f64 {
        self.covariance() / self.spread_of_z().powi(2)
    }

    fn spread_about_the_line(&self) -> f64 {
        (self.spread_of_w().powi(2) - self.slope() * self.covariance())
            .max(0.0)
            .sqrt()
    }
}

//! The squared prediction error and its Gauss-Newton equations, in one pass over the samples.
//!
//! $$ \tilde e_n = R(z)\Big(y_n - o - \frac{B(z)}{A(z)} z^{-s} \sum_i c_i q_i(u_n)\Big) $$
//! with the autoregression R of the output error (1 for none). It is linear in c, o and, for fixed A, in B;
//! the derivatives are the filtered basis and the filtered signals themselves (Ljung 1999, chapter 10).

use std::ops::Range;

use super::pieces::Pieces;

/// The experiments, one after the other.
pub(super) struct Data<'a> {
    pub u: &'a [f64],
    /// The output less its mean; the model's value where it is missing.
    pub y: Vec<f64>,
    /// The experiments' samples.
    pub parts: Vec<Range<usize>>,
    /// Which samples count: not those at the start of an experiment nor the missing ones.
    pub counts: Vec<bool>,
    /// The samples without an output.
    pub missing: Vec<usize>,
}

impl Data<'_> {
    /// The squared error of a prediction of y, less the best offset.
    pub fn squares(&self, simulated: &[f64]) -> f64 {
        let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for ((y, s), _) in self.y.iter().zip(simulated).zip(&self.counts).filter(|(_, c)| **c) {
            n += 1.0;
            sum += y - s;
            squares += (y - s) * (y - s);
        }
        squares - sum * sum / f64::max(n, 1.0)
    }

    /// Puts the model's values in place of what is missing.
    pub fn complete(&mut self, simulated: &[f64], offset: f64) {
        for &i in &self.missing {
            self.y[i] = simulated[i] + offset;
        }
    }
}

/// The linear part and the noise's whitening filter.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dynamics {
    pub b: Vec<f64>,
    /// The first is 1.
    pub a: Vec<f64>,
    pub delay: usize,
}

/// All parameters.
#[derive(Debug, Clone)]
pub(super) struct Model {
    pub basis: Pieces,
    /// Coefficients of the basis' functions from the second on; the first is constant.
    pub c: Vec<f64>,
    pub dynamics: Dynamics,
    pub offset: f64,
}

/// J'J, J'e and e'e. The parameters: c, offset, b, a from a_1 on.
pub(super) struct Normal {
    pub matrix: Vec<f64>,
    pub gradient: Vec<f64>,
    pub squares: f64,
    pub count: usize,
}

/// y_n = sum_i b_i x_{n-delay-i} - sum_i a_i y_{n-i} within each part, from rest.
pub(super) fn filter(d: &Dynamics, parts: &[Range<usize>], x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    let order = d.a.len().max(d.b.len()) - 1;
    let padded = |c: &[f64]| -> Vec<f64> { (0..=order).map(|i| c.get(i).copied().unwrap_or(0.0)).collect() };
    let (b, a) = (padded(&d.b), padded(&d.a));
    for part in parts {
        let mut state = vec![0.0; order + 1];
        let (x, y) = (&x[part.clone()], &mut y[part.clone()]);
        for n in d.delay..y.len() {
            let u = x[n - d.delay];
            let out = b[0] * u + state[0];
            for i in 0..order {
                state[i] = state[i + 1] + b[i + 1] * u - a[i + 1] * out;
            }
            y[n] = out;
        }
    }
    y
}

/// The adjoint of [`filter`]: the same in reversed time.
pub(super) fn filter_back(d: &Dynamics, parts: &[Range<usize>], x: &[f64]) -> Vec<f64> {
    let n = x.len();
    let mut reversed: Vec<f64> = x.to_vec();
    reversed.reverse();
    let parts: Vec<Range<usize>> = parts.iter().map(|p| n - p.end..n - p.start).collect();
    let mut y = filter(d, &parts, &reversed);
    y.reverse();
    y
}

/// The product of two polynomials.
pub(super) fn product(p: &[f64], q: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            out[i + j] += a * b;
        }
    }
    out
}

impl Dynamics {
    /// A filter without poles.
    pub fn moving_average(r: &[f64]) -> Dynamics {
        Dynamics {
            b: r.to_vec(),
            a: vec![1.0],
            delay: 0,
        }
    }
}

impl Model {
    /// phi less its mean, at the samples.
    pub fn signal(&self, u: &[f64]) -> Vec<f64> {
        let phi = self.combined();
        u.iter().map(|u| phi.value(*u)).collect()
    }

    /// phi less its mean.
    pub fn combined(&self) -> Pieces {
        let c: Vec<f64> = std::iter::once(0.0).chain(self.c.iter().copied()).collect();
        self.basis.combined(&c)
    }

    /// The output error, zero at samples that do not count.
    pub fn errors(&self, data: &Data) -> Vec<f64> {
        let simulated = filter(&self.dynamics, &data.parts, &self.signal(data.u));
        residual(data, &simulated, self.offset)
    }

    /// The sum of squared prediction errors and their number.
    pub fn squares(&self, data: &Data, whitening: &[f64]) -> (f64, usize) {
        let mut simulated = filter(&self.dynamics, &data.parts, &self.signal(data.u));
        simulated
            .iter_mut()
            .zip(&data.y)
            .for_each(|(s, y)| *s = y - self.offset - *s);
        let white = filter(&Dynamics::moving_average(whitening), &data.parts, &simulated);
        let mut sum = (0.0, 0);
        for (e, counts) in white.iter().zip(&data.counts) {
            if *counts {
                sum = (sum.0 + e * e, sum.1 + 1);
            }
        }
        sum
    }

    /// The parameters in one row.
    pub fn parameters(&self) -> Vec<f64> {
        let d = &self.dynamics;
        let linear = d.b.iter().chain(&d.a[1..]);
        self.c.iter().chain([&self.offset]).chain(linear).copied().collect()
    }

    /// The same model with other parameters.
    pub fn with(&self, p: &[f64]) -> Model {
        let mut model = self.clone();
        let (c, rest) = p.split_at(self.c.len());
        let (offset, rest) = rest.split_at(1);
        let (b, a) = rest.split_at(self.dynamics.b.len());
        model.c.copy_from_slice(c);
        model.offset = offset[0];
        model.dynamics.b.copy_from_slice(b);
        model.dynamics.a[1..].copy_from_slice(a);
        model
    }

    /// The Gauss-Newton equations.
    pub fn normal(&self, data: &Data, whitening: &[f64]) -> Normal {
        let parameters = self.c.len() + 1 + self.dynamics.b.len() + self.dynamics.a.len() - 1;
        let mut normal = Normal {
            matrix: vec![0.0; parameters * parameters],
            gradient: vec![0.0; parameters],
            squares: 0.0,
            count: 0,
        };
        for part in &data.parts {
            self.add_part(data, part.clone(), whitening, &mut normal);
        }
        for i in 0..parameters {
            for j in 0..i {
                normal.matrix[j * parameters + i] = normal.matrix[i * parameters + j];
            }
        }
        normal
    }

    fn add_part(&self, data: &Data, part: Range<usize>, whitening: &[f64], normal: &mut Normal) {
        let d = &self.dynamics;
        let (k, nb, na) = (self.basis.size(), d.b.len(), d.a.len() - 1);
        let taps = product(&d.b, whitening);
        let (u, y) = (&data.u[part.clone()], &data.y[part.clone()]);
        let counts = &data.counts[part];
        let whole = 0..y.len();
        let white_y = filter(&Dynamics::moving_average(whitening), std::slice::from_ref(&whole), y);
        let gain: f64 = whitening.iter().sum();
        let history = taps.len().max(na + 1).max(nb);
        let rows = history + CHUNK;
        // Rows of the basis at the samples, the filtered basis, and three signals, after `history` older rows.
        let (mut q, mut f) = (vec![0.0; rows * k], vec![0.0; rows * k]);
        let (mut w, mut v, mut x) = (vec![0.0; rows], vec![0.0; rows], vec![0.0; rows]);
        let c: Vec<f64> = std::iter::once(0.0).chain(self.c.iter().copied()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut batch = Batch::new(normal.gradient.len());
        for start in (0..y.len()).step_by(CHUNK) {
            let length = CHUNK.min(y.len() - start);
            for i in 0..length {
                let (n, row) = (start + i, history + i);
                let (old, now) = q.split_at_mut(row * k);
                let now = &mut now[..k];
                if n >= d.delay {
                    self.basis.values(u[n - d.delay], now);
                } else {
                    now.fill(0.0);
                }
                w[row] = dot(&c, now);
                let (before, filtered) = f.split_at_mut(row * k);
                let filtered = &mut filtered[..k];
                filtered.iter_mut().zip(&*now).for_each(|(f, q)| *f = taps[0] * q);
                for (m, tap) in taps.iter().enumerate().skip(1) {
                    let at = &old[(row - m) * k..][..k];
                    filtered.iter_mut().zip(at).for_each(|(f, q)| *f += tap * q);
                }
                for (m, a) in d.a.iter().enumerate().skip(1) {
                    let at = &before[(row - m) * k..][..k];
                    filtered.iter_mut().zip(at).for_each(|(f, q)| *f -= a * q);
                }
                let simulated = dot(&c, filtered);
                let mut by_b: f64 = whitening.iter().enumerate().map(|(m, r)| r * w[row - m]).sum();
                let mut by_a = simulated;
                for (m, a) in d.a.iter().enumerate().skip(1) {
                    by_b -= a * v[row - m];
                    by_a -= a * x[row - m];
                }
                v[row] = by_b;
                x[row] = by_a;
                if !counts[n] {
                    continue;
                }
                let error = white_y[n] - gain * self.offset - simulated;
                let derivatives = batch.next_row(error);
                derivatives[..k - 1].copy_from_slice(&filtered[1..]);
                derivatives[k - 1] = gain;
                for (j, o) in derivatives[k..k + nb].iter_mut().enumerate() {
                    *o = v[row - j];
                }
                for (j, o) in derivatives[k + nb..].iter_mut().enumerate() {
                    *o = -x[row - 1 - j];
                }
                if batch.full() {
                    batch.flush(normal);
                }
            }
            let kept = length..length + history;
            q.copy_within(kept.start * k..kept.end * k, 0);
            f.copy_within(kept.start * k..kept.end * k, 0);
            for s in [&mut w, &mut v, &mut x] {
                s.copy_within(kept.clone(), 0);
            }
        }
        batch.flush(normal);
    }
}

/// Samples that are worked on at a time.
const CHUNK: usize = 256;
/// Rows of the Jacobian that are added at a time.
const ROWS: usize = 4;

/// Rows of the Jacobian and their errors, waiting to be added.
struct Batch {
    rows: Vec<f64>,
    errors: [f64; ROWS],
    used: usize,
    size: usize,
}

impl Batch {
    fn new(size: usize) -> Batch {
        Batch {
            rows: vec![0.0; ROWS * size],
            errors: [0.0; ROWS],
            used: 0,
            size,
        }
    }

    fn next_row(&mut self, error: f64) -> &mut [f64] {
        self.errors[self.used] = error;
        self.used += 1;
        &mut self.rows[(self.used - 1) * self.size..][..self.size]
    }

    fn full(&self) -> bool {
        self.used == ROWS
    }

    fn flush(&mut self, normal: &mut Normal) {
        let n = self.size;
        self.rows[self.used * n..].fill(0.0);
        self.errors[self.used..].fill(0.0);
        let (ab, cd) = self.rows.split_at(2 * n);
        let ((a, b), (c, d)) = (ab.split_at(n), cd.split_at(n));
        let e = self.errors;
        for i in 0..n {
            let (pa, pb, pc, pd) = (a[i], b[i], c[i], d[i]);
            normal.gradient[i] += pa * e[0] + pb * e[1] + pc * e[2] + pd * e[3];
            let row = &mut normal.matrix[i * n..][..=i];
            for ((((m, a), b), c), d) in row.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                *m += pa * a + pb * b + pc * c + pd * d;
            }
        }
        normal.squares += e.iter().map(|e| e * e).sum::<f64>();
        normal.count += self.used;
        self.used = 0;
    }
}

/// y less offset and prediction, zero at samples that do not count.
pub(super) fn residual(data: &Data, simulated: &[f64], offset: f64) -> Vec<f64> {
    data.y
        .iter()
        .zip(simulated)
        .zip(&data.counts)
        .map(|((y, s), counts)| if *counts { y - offset - s } else { 0.0 })
        .collect()
}

#[cfg(test)]
#[path = "loss_tests.rs"]
mod tests;

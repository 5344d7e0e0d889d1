//! The simulation error of a loop and its exact derivatives, by one recursion along with the simulation.
//!
//! With the slope f' at z the derivatives by a parameter p obey
//!
//! ```text
//! dz = Cz dx + (dCz x + dDzu u)         dw = f'(z) dz + (df)(z)
//! dx' = A dx + Bw dw + (dA x + dBu u + dBw w)
//! dy = Cy dx + Dyw dw + (dCy x + dDyu u + dDyw w + do)
//! ```
//! While the state is corrected by K (y_measured - y), dx' has the further term - K dy.
//!
//! A system can be written in many ways (see `system`). Steps are taken in the directions that are orthogonal to all of them
//! (McKelvey, Helmersson & Ribarits 2004, "data driven local coordinates"): the parameters here are coordinates along an orthonormal
//! basis of these directions at the start, and the initial states.

use super::limits::NEGLIGIBLE;
use super::system::{Entering, Layout, Loop, Observed, Sample};
use crate::identify::block::Residuals;
use crate::linalg;
use crate::linear::levenberg_marquardt::Linearisation;
use crate::vectors::{add, dot};
use crate::wide::widest;

/// The simulation error of a loop near its present parameters.
pub(super) struct LoopError<'a> {
    data: &'a Observed,
    at: Loop,
    base: Vec<f64>,
    basis: Basis,
}

/// Directions of all parameters, row by row: a row for every parameter, a column for every direction.
struct Basis {
    rows: Vec<f64>,
    directions: usize,
}

impl Basis {
    fn row(&self, parameter: usize) -> &[f64] {
        &self.rows[parameter * self.directions..(parameter + 1) * self.directions]
    }
}

impl<'a> LoopError<'a> {
    /// The problem near a loop.
    pub fn new(at: Loop, data: &'a Observed) -> Self {
        LoopError {
            basis: identifiable_directions(&at),
            base: at.parameters(),
            at,
            data,
        }
    }

    /// The parameters of the loop itself.
    pub fn start(&self) -> Vec<f64> {
        let mut p = vec![0.0; self.basis.directions];
        p.extend(self.at.initial.iter().flatten());
        p
    }

    /// The number of directions that change the system.
    pub fn directions(&self) -> usize {
        self.basis.directions
    }

    /// The loop with these parameters.
    pub fn with(&self, p: &[f64]) -> Loop {
        let (along, states) = p.split_at(self.basis.directions);
        let all: Vec<f64> = (self.base.iter().enumerate())
            .map(|(i, base)| base + dot(self.basis.row(i), along))
            .collect();
        let mut next = self.at.clone();
        next.set(&all);
        for (own, state) in next.initial.iter_mut().zip(states.chunks_exact(self.at.order().max(1))) {
            own.copy_from_slice(state);
        }
        next
    }
}

/// An orthonormal basis of the directions that change the system: those orthogonal to all redundant ones.
fn identifiable_directions(at: &Loop) -> Basis {
    let count = at.count();
    let mut sum = vec![0.0; count * count];
    for direction in redundant_directions(at) {
        let size = dot(&direction, &direction);
        if size > 0.0 {
            for (i, d) in direction.iter().enumerate().filter(|(_, d)| **d != 0.0) {
                let row = &mut sum[i * count..(i + 1) * count];
                row.iter_mut().zip(&direction).for_each(|(s, e)| *s += d * e / size);
            }
        }
    }
    let Some(eigen) = linalg::symmetric_eigen(&sum, count) else {
        return Basis {
            rows: Vec::new(),
            directions: 0,
        };
    };
    let largest = eigen.values.iter().fold(0.0_f64, |m, v| m.max(*v));
    let vectors = eigen.vectors.chunks_exact(count).zip(&eigen.values);
    let kept: Vec<&[f64]> = vectors
        .filter(|(_, v)| **v <= NEGLIGIBLE * largest)
        .map(|(v, _)| v)
        .collect();
    let entry = |k: usize| kept[k % kept.len()][k / kept.len()];
    Basis {
        rows: (0..count * kept.len()).map(entry).collect(),
        directions: kept.len(),
    }
}

/// Directions that do not change the output to first order, or that a convention forbids: the other ways to write the same system.
fn redundant_directions(at: &Loop) -> Vec<Vec<f64>> {
    let mut all = changes_of_state(at);
    all.extend([scale_of_w(at), moved_slope(at), level(at)]);
    match at.entering {
        Entering::Hidden => all.push(scale_of_z(at)),
        Entering::Output => all.extend(ties_to_the_output(at)),
    }
    all
}

/// Changes of state I + e X: dA = XA - AX, dB = XB, dC = -CX; X has one entry, at (p, q).
fn changes_of_state(at: &Loop) -> Vec<Vec<f64>> {
    let (l, n) = (at.layout(), at.order());
    let change = |p: usize, q: usize| {
        let mut d = vec![0.0; at.count()];
        for j in 0..n {
            d[l.a(p, j)] += at.a[q * n + j];
            d[l.a(j, q)] -= at.a[j * n + p];
        }
        d[l.bu(p)] = at.bu[q];
        d[l.bw(p)] = at.bw[q];
        d[l.cy(q)] = -at.cy[p];
        d[l.cz(q)] = -at.cz[p];
        d
    };
    (0..n)
        .flat_map(|p| (0..n).map(move |q| (p, q)))
        .map(|(p, q)| change(p, q))
        .collect()
}

/// f, and so w, in another unit; the matrices that w enters compensate.
fn scale_of_w(at: &Loop) -> Vec<f64> {
    let (l, mut d) = (at.layout(), vec![0.0; at.count()]);
    (0..at.order()).for_each(|i| d[l.bw(i)] = at.bw[i]);
    d[l.dyw()] = at.dyw;
    at.spline.c.iter().enumerate().for_each(|(j, c)| d[l.spline() + j] = -c);
    for (k, kink) in at.spline.kinks.iter().enumerate() {
        d[l.spline() + at.spline.c.len() + 2 * k + 1] = -kink.bend;
    }
    d
}

/// A slope that moves from f into the linear part.
fn moved_slope(at: &Loop) -> Vec<f64> {
    let (l, n, mut d) = (at.layout(), at.order(), vec![0.0; at.count()]);
    for i in 0..n {
        (0..n).for_each(|j| d[l.a(i, j)] = at.bw[i] * at.cz[j]);
        d[l.bu(i)] = at.bw[i] * at.dzu;
        d[l.cy(i)] = at.dyw * at.cz[i];
    }
    d[l.dyu()] = at.dyw * at.dzu;
    let line = at.spline.line();
    line.iter().enumerate().for_each(|(j, x)| d[l.spline() + j] = -x);
    d
}

/// A constant that moves between f and the offset.
fn level(at: &Loop) -> Vec<f64> {
    let (l, mut d) = (at.layout(), vec![0.0; at.count()]);
    (0..at.spline.c.len()).for_each(|j| d[l.spline() + j] = 1.0);
    d
}

/// The hidden z in another unit.
fn scale_of_z(at: &Loop) -> Vec<f64> {
    let (l, mut d) = (at.layout(), vec![0.0; at.count()]);
    (0..at.order()).for_each(|i| d[l.cz(i)] = at.cz[i]);
    d[l.dzu()] = at.dzu;
    d
}

/// If z is a multiple of y, it stays the same multiple, and y has no direct part of w.
fn ties_to_the_output(at: &Loop) -> Vec<Vec<f64>> {
    let (l, scale) = (at.layout(), at.scale_of_entering());
    let of = |entries: &[(usize, f64)]| {
        let mut d = vec![0.0; at.count()];
        entries.iter().for_each(|&(i, value)| d[i] = value);
        d
    };
    let tie = |z: usize, y: usize| of(&[(z, 1.0), (y, -scale)]);
    let mut all: Vec<_> = (0..at.order()).map(|i| tie(l.cz(i), l.cy(i))).collect();
    all.extend([tie(l.dzu(), l.dyu()), of(&[(l.dyw(), 1.0)])]);
    all
}

impl Loop {
    /// z over y, if z is a multiple of y.
    pub fn scale_of_entering(&self) -> f64 {
        let product = dot(&self.cz, &self.cy) + self.dzu * self.dyu;
        product / (dot(&self.cy, &self.cy) + self.dyu * self.dyu)
    }
}

impl Residuals for LoopError<'_> {
    fn from(&self) -> usize {
        0
    }

    fn residuals(&self, p: &[f64]) -> Option<Vec<f64>> {
        let mut residuals = Vec::with_capacity(self.data.y.len());
        let residual = |k: usize, y: f64| if self.data.missing[k] { 0.0 } else { y - self.data.y[k] };
        let ended = self.with(p).run(self.data, |s| residuals.push(residual(s.k, s.y)));
        ended.then_some(residuals)
    }

    fn linearise(&self, p: &[f64]) -> Linearisation {
        let system = self.with(p);
        let mut derivatives = Derivatives::new(&system, &self.basis);
        let samples = self.data.y.len();
        let mut jacobian = vec![vec![0.0; samples]; derivatives.dy.len()];
        let mut residuals = vec![0.0; samples];
        widest(
            #[inline(always)]
            || {
                system.run(
                    self.data,
                    #[inline(always)]
                    |s: Sample<'_>| {
                        let (k, u) = (s.k, self.data.u[s.k]);
                        if let Some(experiment) = self.data.starting_at(k) {
                            derivatives.start(experiment);
                        }
                        derivatives.set_dz(&s, u);
                        derivatives.set_dw(&s);
                        if !self.data.missing[k] {
                            residuals[k] = s.y - self.data.y[k];
                            derivatives.set_dy(&s, u);
                            jacobian
                                .iter_mut()
                                .zip(&derivatives.dy)
                                .for_each(|(column, y)| column[k] = *y);
                        }
                        derivatives.step(&s, u, !self.data.missing[k]);
                    },
                )
            },
        );
        Linearisation { residuals, jacobian }
    }
}

/// The derivatives by all parameters at one sample: by the directions of the basis, then by the initial states.
struct Derivatives<'a> {
    system: &'a Loop,
    basis: &'a Basis,
    layout: Layout,
    /// The derivatives of the state, one row for each state.
    dx: Vec<f64>,
    /// The derivatives of the next state.
    next: Vec<f64>,
    dz: Vec<f64>,
    dw: Vec<f64>,
    dy: Vec<f64>,
}

impl<'a> Derivatives<'a> {
    fn new(system: &'a Loop, basis: &'a Basis) -> Self {
        let columns = basis.directions + system.order() * system.initial.len();
        let [dx, next] = [(); 2].map(|()| vec![0.0; system.order() * columns]);
        let [dz, dw, dy] = [(); 3].map(|()| vec![0.0; columns]);
        let layout = system.layout();
        Derivatives {
            system,
            basis,
            layout,
            dx,
            next,
            dz,
            dw,
            dy,
        }
    }

    /// Begins an experiment with its initial state.
    fn start(&mut self, experiment: usize) {
        let (n, columns) = (self.system.order(), self.dz.len());
        self.dx.fill(0.0);
        let first = self.basis.directions + experiment * n;
        (0..n).for_each(|i| self.dx[i * columns + first + i] = 1.0);
    }

    /// dz = Cz dx + (dCz x + dDzu u).
    #[inline(always)]
    fn set_dz(&mut self, s: &Sample<'_>, u: f64) {
        let (m, l, columns) = (self.basis.directions, self.layout, self.dz.len());
        self.dz.fill(0.0);
        for (i, x) in s.x.iter().enumerate() {
            add(
                &mut self.dz,
                self.system.cz[i],
                &self.dx[i * columns..(i + 1) * columns],
            );
            add(&mut self.dz[..m], *x, self.basis.row(l.cz(i)));
        }
        add(&mut self.dz[..m], u, self.basis.row(l.dzu()));
    }

    /// dw = f'(z) dz + (df)(z).
    #[inline(always)]
    fn set_dw(&mut self, s: &Sample<'_>) {
        let (m, spline) = (self.basis.directions, &self.system.spline);
        let local = spline.local(s.z);
        let slope = spline.tangent(s.z, &local).slope;
        self.dw.iter_mut().zip(&self.dz).for_each(|(w, z)| *w = slope * z);
        let first = self.layout.spline();
        for (j, value) in local.at.values.iter().enumerate() {
            add(&mut self.dw[..m], *value, self.basis.row(first + local.at.first + j));
        }
        let kinks = first + spline.c.len();
        for (j, kink) in spline.kinks.iter().enumerate().filter(|(_, kink)| s.z > kink.at) {
            add(&mut self.dw[..m], -kink.bend, self.basis.row(kinks + 2 * j));
            add(&mut self.dw[..m], s.z - kink.at, self.basis.row(kinks + 2 * j + 1));
        }
    }

    /// dy = Cy dx + Dyw dw + (dCy x + dDyu u + dDyw w + do).
    #[inline(always)]
    fn set_dy(&mut self, s: &Sample<'_>, u: f64) {
        let (m, l, columns) = (self.basis.directions, self.layout, self.dz.len());
        let direct = self.system.dyw;
        self.dy.iter_mut().zip(&self.dw).for_each(|(y, w)| *y = direct * w);
        for (i, x) in s.x.iter().enumerate() {
            add(
                &mut self.dy,
                self.system.cy[i],
                &self.dx[i * columns..(i + 1) * columns],
            );
            add(&mut self.dy[..m], *x, self.basis.row(l.cy(i)));
        }
        add(&mut self.dy[..m], u, self.basis.row(l.dyu()));
        add(&mut self.dy[..m], s.w, self.basis.row(l.dyw()));
        add(&mut self.dy[..m], 1.0, self.basis.row(l.offset()));
    }

    /// dx' = A dx + Bw dw + (dA x + dBu u + dBw w), less K dy if the output was `measured`.
    #[inline(always)]
    fn step(&mut self, s: &Sample<'_>, u: f64, measured: bool) {
        let (n, m, l, columns) = (s.x.len(), self.basis.directions, self.layout, self.dz.len());
        let system = self.system;
        for i in 0..n {
            let to = &mut self.next[i * columns..(i + 1) * columns];
            to.iter_mut().zip(&self.dw).for_each(|(t, w)| *t = system.bw[i] * w);
            for (j, x) in s.x.iter().enumerate() {
                add(to, system.a[i * n + j], &self.dx[j * columns..(j + 1) * columns]);
                add(&mut to[..m], *x, self.basis.row(l.a(i, j)));
            }
            add(&mut to[..m], u, self.basis.row(l.bu(i)));
            add(&mut to[..m], s.w, self.basis.row(l.bw(i)));
            if measured && system.correction[i] != 0.0 {
                add(to, -system.correction[i], &self.dy);
            }
        }
        std::mem::swap(&mut self.dx, &mut self.next);
    }
}

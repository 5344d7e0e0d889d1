//! The random systems.
//!
//! - A linear block has 1 to 4 poles and as many zeros less one, real or in pairs, of moduli 0.2 to 0.9 (zeros 1.3). It is drawn
//!   again until its memory is visible: at least 20 % of the impulse response's energy outside its largest coefficient.
//! - A nonlinearity acts on a signal of zero mean and unit variance. It is drawn again until it is visible: at least 2 % of its
//!   output's variance is not linear in its input. A Wiener-Hammerstein system has no even nonlinearity: a linear approximation would not
//!   see it.
//! - The input is white Gaussian, white uniform, or Gaussian of autocorrelation 0.6^k, in turn.

use flexure::linear::TransferFunction;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

#[path = "polynomial.rs"]
mod polynomial;
use polynomial::polynomial;

/// Samples for transients to decay.
const BEFORE: usize = 500;
const MEMORY: f64 = 0.2;
const BEND: f64 = 0.02;

/// The kind of a drawn system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Linear,
    Hammerstein,
    Wiener,
    WienerHammerstein,
    /// A mass on a spring of cubic stiffness: nonlinear feedback.
    Feedback,
    HammersteinWiener,
    /// Two Hammerstein branches.
    Parallel,
    /// No such structure: a mass on a spring with hysteresis (Bouc and Wen).
    Hysteresis,
    /// No such structure: a Hammerstein system whose gain doubles.
    Drift,
    /// No such structure: linear dynamics that change when the input's running mean changes its sign.
    Regimes,
    /// No such structure: a hardening spring and dry friction.
    TwoLoops,
    /// No such structure: a hardening spring under a force that is not recorded.
    Disturbed,
}

/// A record of a drawn system.
pub struct Drawn {
    pub u: Vec<f64>,
    /// With noise.
    pub y: Vec<f64>,
    pub description: String,
}

const NONLINEARITIES: [&str; 8] = [
    "limiter",
    "dead zone",
    "cubic",
    "tanh",
    "parabola",
    "one-sided",
    "|x|",
    "x^2",
];

fn nonlinearity(name: &str, x: f64) -> f64 {
    match name {
        "limiter" => x.clamp(-0.7, 1.0),
        "dead zone" => (x - 0.5).max(0.0) + (x + 0.7).min(0.0),
        "cubic" => x + 0.4 * x * x * x,
        "tanh" => (2.0 * x).tanh(),
        "parabola" => x + 0.4 * x * x,
        "one-sided" => x.max(0.0),
        "|x|" => x.abs(),
        _ => x * x,
    }
}

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

fn block(rng: &mut Pcg64) -> flexure::Result<TransferFunction> {
    loop {
        let order = rng.random_range(1..=4);
        let a = polynomial(rng, order, 0.9);
        let g = TransferFunction::new(polynomial(rng, order - 1, 1.3), a)?;
        let energy: Vec<f64> = g.impulse_response(200).iter().map(|k| k * k).collect();
        let largest = energy.iter().fold(0.0_f64, |m, e| m.max(*e));
        if largest <= (1.0 - MEMORY) * energy.iter().sum::<f64>() {
            return Ok(g);
        }
    }
}

/// Mean and standard deviation.
fn moments(v: &[f64]) -> (f64, f64) {
    let n = v.len() as f64;
    let mean = v.iter().sum::<f64>() / n;
    (
        mean,
        (v.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt(),
    )
}

/// The share of the second signal's variance that is not linear in the first.
fn bend(x: &[f64], z: &[f64]) -> f64 {
    let ((mx, sx), (mz, sz)) = (moments(x), moments(z));
    let cross = x.iter().zip(z).map(|(x, z)| (x - mx) * (z - mz)).sum::<f64>() / x.len() as f64;
    1.0 - (cross / (sx * sz)).powi(2)
}

fn input(rng: &mut Pcg64, n: usize, colour: u64) -> (Vec<f64>, &'static str) {
    match colour % 3 {
        0 => ((0..n).map(|_| normal(rng)).collect(), "Gaussian"),
        1 => ((0..n).map(|_| rng.random_range(-1.732..1.732)).collect(), "uniform"),
        _ => {
            let mut last = 0.0;
            let next = |_| {
                last = 0.6 * last + 0.8 * normal(rng);
                last
            };
            ((0..n).map(next).collect(), "coloured")
        }
    }
}

/// A random nonlinearity of the signal, standardised.
fn bent(rng: &mut Pcg64, w: &[f64], even: bool) -> (Vec<f64>, &'static str) {
    let (mean, spread) = moments(w);
    let x: Vec<f64> = w.iter().map(|w| (w - mean) / spread).collect();
    loop {
        let name = NONLINEARITIES[rng.random_range(0..NONLINEARITIES.len() - if even { 0 } else { 2 })];
        let z: Vec<f64> = x.iter().map(|x| nonlinearity(name, *x)).collect();
        if bend(&x, &z) >= BEND {
            return (z, name);
        }
    }
}

/// The n samples of a system of this kind, with white noise of `noise` times the output's standard deviation.
pub fn draw(kind: Kind, seed: u64, n: usize, noise: f64) -> flexure::Result<Drawn> {
    let mut rng = Pcg64::seed_from_u64(1000 * kind as u64 + seed);
    let rng = &mut rng;
    let (u, colour) = input(rng, n + BEFORE, seed);
    let poles = |g: &TransferFunction| g.a().len() - 1;
    let (y0, description) = match kind {
        Kind::Linear => {
            let g = block(rng)?;
            (g.simulate(&u), format!("{} poles", poles(&g)))
        }
        Kind::Hammerstein => {
            let (g, (z, name)) = (block(rng)?, bent(rng, &u, true));
            (g.simulate(&z), format!("{name}, {} poles", poles(&g)))
        }
        Kind::Wiener => {
            let g = block(rng)?;
            let (z, name) = bent(rng, &g.simulate(&u), true);
            (z, format!("{} poles, {name}", poles(&g)))
        }
        Kind::WienerHammerstein => {
            let (g, h) = (block(rng)?, block(rng)?);
            let (z, name) = bent(rng, &g.simulate(&u), false);
            (
                h.simulate(&z),
                format!("{} poles, {name}, {} poles", poles(&g), poles(&h)),
            )
        }
        Kind::Feedback => moved(rng, &u, Force::Spring),
        Kind::HammersteinWiener => {
            let g = block(rng)?;
            let (z, first) = bent(rng, &u, false);
            let (y, second) = bent(rng, &g.simulate(&z), false);
            (y, format!("{first}, {} poles, {second}", poles(&g)))
        }
        Kind::Parallel => {
            let (g, h) = (block(rng)?, block(rng)?);
            let (z, first) = bent(rng, &u, true);
            let (v, second) = bent(rng, &u, true);
            let [p, q] = [g.simulate(&z), h.simulate(&v)].map(|x| standardised(&x));
            let sum = p.iter().zip(&q).map(|(p, q)| p + q).collect();
            (
                sum,
                format!("{first}, {} poles; {second}, {} poles", poles(&g), poles(&h)),
            )
        }
        Kind::Hysteresis => moved(rng, &u, Force::Hysteresis),
        Kind::Drift => {
            let (g, (z, name)) = (block(rng)?, bent(rng, &u, true));
            let last = u.len() as f64;
            let drifting = g
                .simulate(&z)
                .iter()
                .enumerate()
                .map(|(k, y)| (1.0 + k as f64 / last) * y)
                .collect();
            (drifting, format!("{name}, {} poles", poles(&g)))
        }
        Kind::Regimes => {
            let (g, h) = (block(rng)?, block(rng)?);
            let slow = TransferFunction::new(vec![0.05], vec![1.0, -0.95])?.simulate(&u);
            let [p, q] = [g, h].map(|g| standardised(&g.simulate(&u)));
            let each = slow
                .iter()
                .zip(p.iter().zip(&q))
                .map(|(s, (p, q))| if *s > 0.0 { *p } else { *q });
            (each.collect(), "two regimes".to_owned())
        }
        Kind::TwoLoops => moved(rng, &u, Force::SpringAndFriction),
        Kind::Disturbed => {
            let force: Vec<f64> = u.iter().map(|u| u + 0.5 * normal(rng)).collect();
            moved(rng, &force, Force::Spring)
        }
    };
    let (u, y0) = (u[BEFORE..].to_vec(), y0[BEFORE..].to_vec());
    let size = noise * moments(&y0).1;
    let y = y0.iter().map(|y| y + size * normal(rng)).collect();
    Ok(Drawn {
        description: format!("{description}, {colour}"),
        u,
        y,
    })
}

fn standardised(v: &[f64]) -> Vec<f64> {
    let (mean, spread) = moments(v);
    v.iter().map(|x| (x - mean) / spread).collect()
}

/// The force on a mass in addition to the input and a damper.
#[derive(Clone, Copy)]
enum Force {
    Spring,
    SpringAndFriction,
    Hysteresis,
}

/// $\ddot y + 2 \zeta \dot y + F = u$, the input held over intervals of 0.5 to 1, by Runge and Kutta's method. F is y + k y^3, with friction, or
/// y + 2 z with $\dot z = \dot y - |\dot y| |z| z - 0.5 \dot y z^2$ (Bouc and Wen).
fn moved(rng: &mut Pcg64, u: &[f64], force: Force) -> (Vec<f64>, String) {
    let damping: f64 = rng.random_range(0.1..0.4);
    let stiffness: f64 = rng.random_range(0.3..1.0);
    let step: f64 = rng.random_range(0.5..1.0);
    const SUBSTEPS: usize = 20;
    let h = step / SUBSTEPS as f64;
    let rate = |[x, v, z]: [f64; 3], u: f64| {
        let force = match force {
            Force::Spring => x + stiffness * x * x * x,
            Force::SpringAndFriction => x + stiffness * x * x * x + 0.4 * (20.0 * v).tanh(),
            Force::Hysteresis => 0.5 * x + 2.0 * z,
        };
        [
            v,
            u - 2.0 * damping * v - force,
            v - v.abs() * z.abs() * z - 0.5 * v * z * z,
        ]
    };
    let mut x = [0.0; 3];
    let after = |x: [f64; 3], s: f64, k: [f64; 3]| std::array::from_fn(|i| x[i] + s * k[i]);
    let y = u
        .iter()
        .map(|u| {
            let now = x[0];
            for _ in 0..SUBSTEPS {
                let k1 = rate(x, *u);
                let k2 = rate(after(x, 0.5 * h, k1), *u);
                let k3 = rate(after(x, 0.5 * h, k2), *u);
                let k4 = rate(after(x, h, k3), *u);
                x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
            }
            now
        })
        .collect();
    (y, format!("damping {damping:.2}, k {stiffness:.2}, step {step:.2}"))
}

//! A simulated Hammerstein system and what a page shows of it.

use flexure_report::data::{LinearPart, Nonlinearity};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

/// Seconds between samples.
pub const SAMPLE_TIME: f64 = 0.01;
const B: [f64; 3] = [0.0, 0.32, 0.21];
const A: [f64; 3] = [1.0, -1.32, 0.72];

/// A joint's torque before the dynamics: friction eats small torques, the drive saturates at large ones.
fn truth(u: f64) -> f64 {
    let dead = (u.abs() - 0.9).max(0.0) * u.signum();
    3.6 * (dead / 3.6).tanh() + 0.04 * u
}

/// White Gaussian input and the noisy output.
pub fn simulate(n: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let (input, noise) = (gaussian(3.0), gaussian(0.2));
    let u: Vec<f64> = (0..n).map(|_| input.sample(&mut rng)).collect();
    let w: Vec<f64> = u.iter().map(|&v| truth(v)).collect();
    let y = filter(&w).iter().map(|&v| v + noise.sample(&mut rng)).collect();
    (u, y)
}

/// The signal between the blocks as a good method would recover it: with noise.
pub fn intermediate(u: &[f64]) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(3);
    let noise = gaussian(0.25);
    u.iter().map(|&v| truth(v) + noise.sample(&mut rng)).collect()
}

fn gaussian(deviation: f64) -> Normal<f64> {
    Normal::new(0.0, deviation).expect("a positive deviation")
}

pub fn filter(w: &[f64]) -> Vec<f64> {
    let mut y: Vec<f64> = Vec::with_capacity(w.len());
    for i in 0..w.len() {
        let past = |list: &[f64], k: usize| if i >= k { list[i - k] } else { 0.0 };
        y.push(B[1] * past(w, 1) + B[2] * past(w, 2) - A[1] * past(&y, 1) - A[2] * past(&y, 2));
    }
    y
}

fn kernel(t: f64) -> f64 {
    (1.0 - t * t).max(0.0)
}

pub fn leave_one_out(u: &[f64], y: &[f64], h: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for i in 0..u.len() {
        let others = (0..u.len())
            .filter(|&j| j != i)
            .map(|j| (kernel((u[i] - u[j]) / h), y[j]));
        let (weight, moment) = others.fold((0.0, 0.0), |(w, m), (k, v)| (w + k, m + k * v));
        if weight > 0.0 {
            sum += (y[i] - moment / weight).powi(2);
            count += 1.0;
        }
    }
    sum / f64::max(count, 1.0)
}

/// The kernel estimate of `y` over `u` with a pointwise band.
pub fn curve(u: &[f64], y: &[f64], h: f64) -> Nonlinearity {
    let x: Vec<f64> = (0..=180).map(|i| -9.0 + 0.1 * f64::from(i)).collect();
    let (mut m, mut half, mut density) = (Vec::new(), Vec::new(), Vec::new());
    for &at in &x {
        let (mut w, mut w2, mut s, mut s2) = (0.0, 0.0, 0.0, 0.0);
        for (&ui, &yi) in u.iter().zip(y) {
            let k = kernel((at - ui) / h);
            (w, w2, s, s2) = (w + k, w2 + k * k, s + k * yi, s2 + k * yi * yi);
        }
        let mean = s / w;
        m.push(mean);
        half.push(1.96 * ((s2 / w - mean * mean).max(0.0) * w2).sqrt() / w);
        density.push(w / (u.len() as f64 * h * 4.0 / 3.0));
    }
    Nonlinearity {
        x_label: "torque (N m)".into(),
        y_label: "effective torque (N m)".into(),
        lower: m.iter().zip(&half).map(|(m, h)| m - h).collect(),
        upper: m.iter().zip(&half).map(|(m, h)| m + h).collect(),
        truth: x.iter().map(|&v| truth(v)).collect(),
        y: m,
        x,
        band_label: "95 % pointwise".into(),
        density,
        truth_label: "the curve that the simulation used, aligned by two points".into(),
    }
}

pub fn interpolate(n: &Nonlinearity, v: f64) -> f64 {
    let i = n.x.partition_point(|&x| x <= v).clamp(1, n.x.len() - 1);
    let part = ((v - n.x[i - 1]) / (n.x[i] - n.x[i - 1])).clamp(0.0, 1.0);
    let value = n.y[i - 1] + part * (n.y[i] - n.y[i - 1]);
    if value.is_finite() { value } else { truth(v) }
}

pub fn linear_part(u: &[f64], y: &[f64]) -> LinearPart {
    let mut pulse = vec![0.0; 45];
    pulse[0] = 1.0;
    let impulse = filter(&pulse);
    let gain = correlation(&u.iter().map(|&v| truth(v)).collect::<Vec<_>>(), u, 0);
    let spread = |s: &[f64]| (s.iter().map(|v| v * v).sum::<f64>() / s.len() as f64).sqrt();
    let scale = spread(y) / spread(&u.iter().map(|&v| truth(v)).collect::<Vec<_>>()) / gain;
    let frequency: Vec<f64> = (0..240).map(|i| 0.1 * 500.0_f64.powf(f64::from(i) / 239.0)).collect();
    let response: Vec<(f64, f64)> = frequency
        .iter()
        .map(|f| response(2.0 * std::f64::consts::PI * f * SAMPLE_TIME))
        .collect();
    let (re, disc) = (-A[1] / 2.0, (A[2] - A[1] * A[1] / 4.0).sqrt());
    LinearPart {
        title: "Linear part".into(),
        text: String::new(),
        b: B.to_vec(),
        a: A.to_vec(),
        sample_time: Some(SAMPLE_TIME),
        impulse_estimate: (0..45).map(|lag| correlation(y, u, lag) * scale).collect(),
        response_unit: "rad/s per N m".into(),
        impulse_limit: 2.576 / (u.len() as f64).sqrt() * scale,
        impulse,
        frequency: frequency.clone(),
        frequency_unit: "Hz".into(),
        magnitude_db: response.iter().map(|r| r.0).collect(),
        phase_deg: response.iter().map(|r| r.1).collect(),
        magnitude_error: frequency_errors(&frequency, 0.4),
        phase_error: frequency_errors(&frequency, 3.0),
        poles: vec![[re, disc], [re, -disc]],
        pole_covariances: vec![[4e-4, 2e-4, 3e-4], [4e-4, -2e-4, 3e-4]],
        zeros: vec![[-B[2] / B[1], 0.0]],
    }
}

/// Made-up half widths of a band, the larger the higher the frequency.
fn frequency_errors(frequency: &[f64], size: f64) -> Vec<f64> {
    frequency.iter().map(|f| size * (1.0 + f / 20.0)).collect()
}

/// Magnitude in dB and phase in degrees at `w` rad per sample.
fn response(w: f64) -> (f64, f64) {
    let sum = |c: &[f64]| {
        c.iter().enumerate().fold((0.0, 0.0), |(re, im), (k, v)| {
            (re + v * (w * k as f64).cos(), im - v * (w * k as f64).sin())
        })
    };
    let (n, d) = (sum(&B), sum(&A));
    let phase = n.1.atan2(n.0).to_degrees() - d.1.atan2(d.0).to_degrees();
    (
        20.0 * (n.0.hypot(n.1) / d.0.hypot(d.1)).log10(),
        if phase > 10.0 { phase - 360.0 } else { phase },
    )
}

/// Normalised correlation of `a` at `lag` after `b`.
pub fn correlation(a: &[f64], b: &[f64], lag: i32) -> f64 {
    let shift = lag.unsigned_abs() as usize;
    let (late, early) = if lag >= 0 { (&a[shift..], b) } else { (a, &b[shift..]) };
    let sum: f64 = late.iter().zip(early).map(|(x, y)| x * y).sum();
    let power = |s: &[f64]| s.iter().map(|v| v * v).sum::<f64>();
    sum / (power(a) * power(b)).sqrt()
}

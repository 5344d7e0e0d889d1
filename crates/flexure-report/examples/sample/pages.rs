//! Sample pages from a simulated Hammerstein system that really is identified, in the simplest way.

use flexure_report::data::*;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

const SAMPLE_TIME: f64 = 0.01;
const B: [f64; 3] = [0.0, 0.32, 0.21];
const A: [f64; 3] = [1.0, -1.32, 0.72];

/// A page with every part.
pub fn full() -> Page {
    let n = 6_000;
    let fresh = 4_000;
    let (u, y) = simulate(n, 1);
    let (uf, yf) = (&u[..fresh], &y[..fresh]);
    let wf = intermediate(uf);
    let candidates: Vec<f64> = (0..22).map(|i| 0.06 * 1.22_f64.powi(i)).collect();
    let scores: Vec<f64> = candidates
        .iter()
        .map(|&h| leave_one_out(&uf[..1_500], &wf[..1_500], h))
        .collect();
    let best = (0..scores.len())
        .min_by(|&i, &j| scores[i].total_cmp(&scores[j]))
        .unwrap_or(0);
    let nonlinearity = curve(uf, &wf, candidates[best]);
    let predicted = filter(&u.iter().map(|&v| interpolate(&nonlinearity, v)).collect::<Vec<_>>());
    let prediction = prediction(&y[fresh..], &predicted[fresh..], fresh);
    let error: Vec<f64> = y[fresh..].iter().zip(&predicted[fresh..]).map(|(a, b)| a - b).collect();
    let limit = 2.576 / (error.len() as f64).sqrt();
    let linear = linear_part(uf, yf);
    let arm = super::arm::motion(3_000, SAMPLE_TIME);
    Page {
        title: "Elbow joint of the space arm".into(),
        subtitle: "The motor torque’s way to the elbow’s rate, identified as a Hammerstein system from 40\u{a0}s of a \
                   simulated record and checked on the next 20\u{a0}s."
            .into(),
        verdict: Verdict {
            holds: true,
            words: "On 2000 fresh samples the model predicts the elbow’s rate in free run with a fit of ".to_owned()
                + &format!("{:.1} %", prediction.fit_percent)
                + ", and neither residual test found anything that it missed.",
        },
        facts: vec![
            fact(
                "Fit on fresh data",
                &format!("{:.1} %", prediction.fit_percent),
                "100 % would be a perfect free run",
            ),
            fact(
                "RMS error",
                &format!("{:.4} rad/s", prediction.rms),
                "the measurement noise alone has 0.2000 rad/s",
            ),
            fact("Order", "2", "poles of the linear part"),
            fact("Delay", "1 sample", "10 ms"),
            fact("Samples", "4000 + 2000", "for the fit, and fresh"),
        ],
        record: vec![signal("tau2", "N m", u), signal("dq2", "rad/s", y)],
        time: axis("time", "s", 0.0, SAMPLE_TIME),
        fresh_from: fresh,
        nonlinearity,
        linear,
        prediction,
        residuals: Residuals {
            autocorrelation: (0..=40).map(|lag| correlation(&error, &error, lag)).collect(),
            cross_correlation: (-20..=40)
                .map(|lag| correlation(&error, &other_input(fresh, n), lag))
                .collect(),
            cross_lags: (-20..=40).map(f64::from).collect(),
            limit,
            level: "99 %".into(),
            tests: vec![
                test(
                    "Whiteness (Ljung-Box, 25 lags)",
                    24.31,
                    44.31,
                    0.502,
                    true,
                    "nothing in the residual predicts it",
                ),
                test(
                    "Independence of the input",
                    31.07,
                    48.28,
                    0.412,
                    true,
                    "the input explains nothing more",
                ),
                test("Mean of the residual", 0.41, 2.576, 0.682, true, "no offset is left"),
            ],
        },
        choices: vec![
            Choice {
                name: "Bandwidth".into(),
                value: format!("h = {:.3} N m", candidates[best]),
                why: "The smallest leave-one-out prediction error, computed exactly for every candidate.".into(),
                curve: Some(ScoreCurve {
                    x_label: "bandwidth (N m)".into(),
                    y_label: "cross-validation score".into(),
                    log_x: true,
                    chosen: candidates[best],
                    x: candidates,
                    y: scores,
                }),
            },
            Choice {
                name: "Order".into(),
                value: "2".into(),
                why: "The smallest prediction error on a held-out part; higher orders gain nothing.".into(),
                curve: Some(ScoreCurve {
                    x_label: "order".into(),
                    y_label: "held-out error (rad/s)".into(),
                    log_x: false,
                    x: (1..=8).map(f64::from).collect(),
                    y: vec![0.412, 0.0592, 0.0597, 0.0601, 0.0604, 0.0611, 0.0609, 0.0616],
                    chosen: 2.0,
                }),
            },
            plain_choice(
                "Delay",
                "1 sample",
                "The first lag at which the cross-covariance leaves its 99 % limits.",
            ),
            plain_choice(
                "Kernel",
                "Epanechnikov",
                "The default: the smallest asymptotic error of all kernels.",
            ),
            plain_choice(
                "Scale",
                "two points",
                "The curve is known at −3 and 3 N m, which fixes scale and offset.",
            ),
        ],
        warnings: vec!["Only 31 samples have an input beyond ±7.5 N m: the curve is uncertain there.".into()],
        arm: Some(arm),
        command: Some("flexure demo --out flexure-demo --preset space-arm --seed 1".into()),
    }
}

/// A page without anything optional, of a model that does not hold.
pub fn bare() -> Page {
    let mut page = full();
    page.title = "Robot arm record".into();
    page.subtitle = "Reaction torque to acceleration of a flexible robot arm, without a sample time.".into();
    page.verdict = Verdict {
        holds: false,
        words: "The whiteness test refutes it: the residual predicts itself (p < 0.001). A static nonlinearity before \
                linear dynamics is not enough for this record."
            .into(),
    };
    page.warnings = vec![
        "No sample time was given: frequencies are in cycles a sample.".into(),
        "The input is not white, which the correlation method assumes.".into(),
    ];
    page.time = axis("sample", "", 0.0, 1.0);
    page.prediction.time = axis("sample", "", 4_000.0, 1.0);
    for signal in &mut page.record {
        signal.unit.clear();
    }
    let n = &mut page.nonlinearity;
    for list in [&mut n.lower, &mut n.upper, &mut n.density, &mut n.truth] {
        list.clear();
    }
    (n.x_label, n.y_label) = ("u".into(), "intermediate signal".into());
    page.prediction.y_label = "y".into();
    page.linear.impulse_estimate.clear();
    page.linear.impulse_limit = 0.0;
    page.linear.frequency_unit = "cycles/sample".into();
    page.linear.frequency.iter_mut().for_each(|f| *f *= SAMPLE_TIME);
    page.linear.zeros.push([-7.3, 0.0]);
    page.residuals.tests[0] = test(
        "Whiteness (Ljung-Box, 25 lags)",
        1.031e4,
        44.31,
        0.0,
        false,
        "the residual predicts itself",
    );
    let slow = page.residuals.autocorrelation.iter().enumerate();
    page.residuals.autocorrelation = slow
        .map(|(k, r)| r + 0.6 * (-0.15 * k as f64).exp() * (0.5 * k as f64).cos())
        .collect();
    page.residuals.cross_correlation.clear();
    page.residuals.cross_lags.clear();
    page.choices.iter_mut().for_each(|choice| choice.curve = None);
    page.arm = None;
    page.command = None;
    page
}

/// A page of a record of `n` samples.
pub fn long(n: usize) -> Page {
    let mut page = full();
    let fresh = n / 2;
    let (u, y) = simulate(n, 2);
    let predicted = filter(
        &u.iter()
            .map(|&v| interpolate(&page.nonlinearity, v))
            .collect::<Vec<_>>(),
    );
    page.prediction = prediction(&y[fresh..], &predicted[fresh..], fresh);
    page.record = vec![signal("tau2", "N m", u), signal("dq2", "rad/s", y)];
    page.fresh_from = fresh;
    page.arm = Some(super::arm::motion(n.min(60_000), SAMPLE_TIME));
    page
}

/// A joint's torque before the dynamics: friction eats small torques, the drive saturates at large ones.
fn truth(u: f64) -> f64 {
    let dead = (u.abs() - 0.9).max(0.0) * u.signum();
    3.6 * (dead / 3.6).tanh() + 0.04 * u
}

/// White Gaussian input and the noisy output.
fn simulate(n: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let (input, noise) = (gaussian(3.0), gaussian(0.2));
    let u: Vec<f64> = (0..n).map(|_| input.sample(&mut rng)).collect();
    let w: Vec<f64> = u.iter().map(|&v| truth(v)).collect();
    let y = filter(&w).iter().map(|&v| v + noise.sample(&mut rng)).collect();
    (u, y)
}

/// The signal between the blocks as a good method would recover it: with noise.
fn intermediate(u: &[f64]) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(3);
    let noise = gaussian(0.25);
    u.iter().map(|&v| truth(v) + noise.sample(&mut rng)).collect()
}

fn gaussian(deviation: f64) -> Normal<f64> {
    Normal::new(0.0, deviation).expect("a positive deviation")
}

/// Another white signal, standing for the input that the residual is compared with.
fn other_input(from: usize, to: usize) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(7);
    let input = gaussian(1.0);
    (from..to).map(|_| input.sample(&mut rng)).collect()
}

fn filter(w: &[f64]) -> Vec<f64> {
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

fn leave_one_out(u: &[f64], y: &[f64], h: f64) -> f64 {
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
fn curve(u: &[f64], y: &[f64], h: f64) -> Nonlinearity {
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

fn interpolate(n: &Nonlinearity, v: f64) -> f64 {
    let i = n.x.partition_point(|&x| x <= v).clamp(1, n.x.len() - 1);
    let part = ((v - n.x[i - 1]) / (n.x[i] - n.x[i - 1])).clamp(0.0, 1.0);
    let value = n.y[i - 1] + part * (n.y[i] - n.y[i - 1]);
    if value.is_finite() { value } else { truth(v) }
}

fn linear_part(u: &[f64], y: &[f64]) -> LinearPart {
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
        b: B.to_vec(),
        a: A.to_vec(),
        impulse_estimate: (0..45).map(|lag| correlation(y, u, lag) * scale).collect(),
        impulse_limit: 2.576 / (u.len() as f64).sqrt() * scale,
        impulse,
        frequency,
        frequency_unit: "Hz".into(),
        magnitude_db: response.iter().map(|r| r.0).collect(),
        phase_deg: response.iter().map(|r| r.1).collect(),
        poles: vec![[re, disc], [re, -disc]],
        zeros: vec![[-B[2] / B[1], 0.0]],
    }
}

/// Magnitude in dB and phase in degrees at `w` rad a sample.
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

fn prediction(measured: &[f64], predicted: &[f64], from: usize) -> Prediction {
    let n = measured.len() as f64;
    let mean = measured.iter().sum::<f64>() / n;
    let error = measured
        .iter()
        .zip(predicted)
        .map(|(y, yh)| (y - yh).powi(2))
        .sum::<f64>();
    let spread = measured.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
    Prediction {
        y_label: "elbow rate (rad/s)".into(),
        time: axis("time", "s", from as f64 * SAMPLE_TIME, SAMPLE_TIME),
        measured: measured.to_vec(),
        predicted: predicted.to_vec(),
        fit_percent: 100.0 * (1.0 - (error / spread).sqrt()),
        rms: (error / n).sqrt(),
    }
}

/// Normalised correlation of `a` at `lag` after `b`.
fn correlation(a: &[f64], b: &[f64], lag: i32) -> f64 {
    let shift = lag.unsigned_abs() as usize;
    let (late, early) = if lag >= 0 { (&a[shift..], b) } else { (a, &b[shift..]) };
    let sum: f64 = late.iter().zip(early).map(|(x, y)| x * y).sum();
    let power = |s: &[f64]| s.iter().map(|v| v * v).sum::<f64>();
    sum / (power(a) * power(b)).sqrt()
}

fn axis(name: &str, unit: &str, start: f64, step: f64) -> Axis {
    Axis {
        name: name.into(),
        unit: unit.into(),
        start,
        step,
    }
}

fn signal(name: &str, unit: &str, values: Vec<f64>) -> Signal {
    Signal {
        name: name.into(),
        unit: unit.into(),
        values,
    }
}

fn fact(name: &str, value: &str, note: &str) -> Fact {
    Fact {
        name: name.into(),
        value: value.into(),
        note: note.into(),
    }
}

fn test(name: &str, statistic: f64, limit: f64, p_value: f64, passed: bool, words: &str) -> Test {
    Test {
        name: name.into(),
        statistic,
        limit,
        p_value,
        passed,
        words: words.into(),
    }
}

fn plain_choice(name: &str, value: &str, why: &str) -> Choice {
    Choice {
        name: name.into(),
        value: value.into(),
        why: why.into(),
        curve: None,
    }
}

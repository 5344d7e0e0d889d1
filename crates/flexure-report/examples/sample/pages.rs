//! Sample pages of a simulated Hammerstein system. The curve, the correlations and the fit are computed from its data;
//! the statistics of the tests and the scores of the orders are made up.

use flexure_report::data::*;

use super::system::*;

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
    let cross = (-20..=40).map(|lag| correlation(&error, &u[fresh..], lag)).collect();
    let arm = super::arm::motion(3_000, SAMPLE_TIME);
    let diagram = diagram(&nonlinearity);
    Page {
        title: "Elbow joint of the space arm".into(),
        subtitle: "The motor torque’s way to the elbow’s rate, identified as a Hammerstein system from 40\u{a0}s of a \
                   simulated record and checked on the next 20\u{a0}s."
            .into(),
        verdict: Verdict {
            headline: "The model holds on fresh data".into(),
            holds: true,
            text: "On 2000 fresh samples the model predicts the elbow’s rate in free run with a fit of ".to_owned()
                + &format!("{:.1} %", prediction.fit_percent)
                + ", and neither residual test found anything that it missed.",
            details: Vec::new(),
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
        diagram: Some(diagram),
        record: vec![signal("tau2", "N m", u), signal("dq2", "rad/s", y)],
        time: axis("time", "s", 0.0, SAMPLE_TIME),
        fresh_from: fresh,
        nonlinearity,
        surface: None,
        curves: Vec::new(),
        approximation: None,
        linear: vec![linear],
        prediction,
        residuals: Residuals {
            autocorrelation: (0..=40).map(|lag| correlation(&error, &error, lag)).collect(),
            cross_correlation: cross,
            cross_lags: (-20..=40).map(f64::from).collect(),
            limit,
            cross_limit: limit,
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
        candidates: Vec::new(),
        warnings: vec!["Only 31 samples have an input beyond ±7.5 N m: the curve is uncertain there.".into()],
        arm: Some(arm),
        command: Some("flexure demo --out flexure-demo --preset space-arm --seed 1".into()),
        python: Some("import flexure\n\nmodel = flexure.Hammerstein().fit(tau2, dq2, dt=0.01)".into()),
    }
}

/// A page without anything optional, of a model that does not hold.
pub fn bare() -> Page {
    let mut page = full();
    page.title = "Robot arm record".into();
    page.subtitle = "Reaction torque to acceleration of a flexible robot arm, without a sample time.".into();
    page.verdict = Verdict {
        headline: "The model does not hold on fresh data".into(),
        holds: false,
        text: "The whiteness test refutes it: the residual predicts itself (p < 1e-6). A static nonlinearity before \
                linear dynamics is not enough for this record."
            .into(),
        details: Vec::new(),
    };
    page.warnings = vec![
        "No sample time was given: frequencies are in cycles a sample.".into(),
        "The input is not white, which the correlation method assumes.".into(),
    ];
    page.diagram = None;
    page.python = None;
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
    let linear = &mut page.linear[0];
    linear.impulse_estimate.clear();
    linear.impulse_limit = 0.0;
    linear.frequency_unit = "cycles/sample".into();
    linear.frequency.iter_mut().for_each(|f| *f *= SAMPLE_TIME);
    linear.zeros.push([-7.3, 0.0]);
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

fn test(name: &str, statistic: f64, limit: f64, p_value: f64, passed: bool, text: &str) -> Test {
    Test {
        name: name.into(),
        statistic,
        limit,
        p_value,
        outcome: match passed {
            true => TestOutcome::Passed,
            false => TestOutcome::Failed,
        },
        text: text.into(),
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

/// A static nonlinearity before linear dynamics.
fn diagram(nonlinearity: &Nonlinearity) -> Flow {
    let block = |title: &str, note: &str, sketch| {
        Flow::Block(DiagramBlock {
            title: title.into(),
            sketch,
            note: note.into(),
        })
    };
    let curve = Sketch::Curve {
        x: nonlinearity.x.clone(),
        y: nonlinearity.y.clone(),
    };
    let fraction = Sketch::Fraction("B(z)".into(), "A(z)".into());
    Flow::Series(vec![
        Flow::Signal("tau2 (N m)".into()),
        block("Nonlinearity", "", curve),
        block("Linear part", "order 2, delay 1", fraction),
        Flow::Signal("dq2 (rad/s)".into()),
    ])
}

//! Job 1: the stiffness as a static regression, of the joint's torque on its deflection, and on both of its angles.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use flexure::Record;
use flexure::bands::{Band, BandKind, RobustBand};
use flexure::manipulator::{Stiffness, add_noise};
use flexure::nonlinearity::{Degree, Estimator, Kernel, KernelEstimator, KernelRegression, Regression};
use flexure::selection::{BandwidthRule, choose_bandwidth};
use flexure_io::arm::{Amplitude, Excitation, Kind};
use flexure_io::write_record;
use flexure_report::data::{Fact, JointCurve, JointPage, Nonlinearity, Scatter};
use serde_json::json;

use super::{NOISE, View, arm, distance, rms, true_stiffness};
use crate::files::write_text;
use crate::simulate::simulate;
use flexure_workbench::text::number;

/// Noise of an angle, rad.
const ENCODER: f64 = 1e-5;
/// Points of a curve.
const POINTS: usize = 201;
/// Places of the joint at which the estimate from both angles is looked at.
const PLACES: usize = 9;
/// A torque that changes less along the joint's way, relatively, is the deflection's alone.
const ALONE: f64 = 0.02;
/// The share of the samples on either side that is left out where places and deflections are spread over the data.
const TRIMMED: f64 = 0.02;

/// Simulates, estimates and writes the record and the page.
pub fn view([record, report]: &[PathBuf; 2], command: &str) -> Result<View> {
    let arm = arm(
        60.0,
        0.01,
        Excitation {
            kind: Kind::Multisine,
            amplitude: Some(Amplitude::Same(20.0)),
            f_min: Some(0.05),
            f_max: Some(3.0),
            ..Excitation::zero()
        },
    )?;
    let kappa = true_stiffness(&arm);
    let motion = simulate(&arm, Path::new(""))?;
    let (motor, link) = (motion.column("qm2")?, motion.column("q2")?);
    let torque: Vec<f64> = motor.iter().zip(link).map(|(m, q)| kappa.torque(m - q)).collect();
    let size = NOISE * rms(&torque);
    let log = Record::new([
        ("t", motion.column("t")?.to_vec()),
        ("q", link.to_vec()),
        ("qm", motor.to_vec()),
        ("torque", torque),
    ])?;
    let mut log = add_noise(&log, 1, &[("q", ENCODER), ("qm", ENCODER), ("torque", size)])?;
    let (q, qm) = (log.column("q")?, log.column("qm")?);
    let d: Vec<f64> = qm.iter().zip(q).map(|(m, q)| m - q).collect();
    log.push("d", d)?;
    write_record(record, &log)?;
    let y = log.column("torque")?;
    let one = deflection(log.column("d")?, y, &kappa)?;
    let two = both_angles(log.column("q")?, log.column("qm")?, y, &kappa)?;
    let page = page(&log, &one, &two, &kappa, command)?;
    let html = flexure_report::render_joint(&page).context("the report")?;
    write_text(report, &html)?;
    Ok(View {
        name: "stiffness",
        lines: vec![
            "Job 1, static: deflection to joint torque".to_owned(),
            format!(
                "  distance from the true stiffness curve {:.2} %; the band covers {:.0} % of it",
                100.0 * one.error,
                100.0 * one.covered
            ),
            format!(
                "  from both angles (q, qm): distance {:.2} %; at the same deflection the torque changes by {:.2} % along the joint's way: \
                 it is {}",
                100.0 * two.error,
                100.0 * two.change,
                two.dependence()
            ),
        ],
        values: json!({
            "error": one.error,
            "covered": one.covered,
            "bandwidth": one.bandwidth,
            "both_angles": { "error": two.error, "change": two.change, "bandwidths": two.bandwidths },
        }),
    })
}

/// The torque over the deflection.
struct Deflection {
    band: Band,
    bandwidth: f64,
    /// Relative distance from the truth, and the share of it that the band covers.
    error: f64,
    covered: f64,
}

fn deflection(x: &[f64], y: &[f64], kappa: &Stiffness) -> Result<Deflection> {
    let kernel = Kernel::Epanechnikov;
    let bandwidth = choose_bandwidth(BandwidthRule::default(), kernel, Degree::Linear, x, y, None)?.bandwidth();
    let fit = KernelRegression { kernel, bandwidth }
        .fit(x, y)?
        .with_degree(Degree::Linear);
    let (low, high) = (
        x.iter().copied().fold(f64::INFINITY, f64::min),
        x.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    let band = RobustBand {
        kind: BandKind::Simultaneous,
        ..RobustBand::default()
    }
    .for_kernel(&fit, &evenly(low, high, POINTS))?;
    let truth: Vec<f64> = band.x[0].iter().map(|&d| kappa.torque(d)).collect();
    let inside = |i: &usize| (band.lower[*i]..=band.upper[*i]).contains(&truth[*i]);
    Ok(Deflection {
        error: distance(&band.estimate, &truth),
        covered: (0..POINTS).filter(inside).count() as f64 / POINTS as f64,
        band,
        bandwidth,
    })
}

/// The torque over both angles, which may depend on where the joint stands.
struct BothAngles {
    /// Deflections, and over all places the mean of the torque, its least and its largest value.
    d: Vec<f64>,
    mean: Vec<f64>,
    least: Vec<f64>,
    most: Vec<f64>,
    bandwidths: Vec<f64>,
    /// Relative distance from the truth over all deflections and places.
    error: f64,
    /// The root mean square over deflections and places of the torque less its mean over the places, relative.
    change: f64,
}

impl BothAngles {
    /// Whose function the torque is.
    fn dependence(&self) -> &'static str {
        match self.change < ALONE {
            true => "the deflection's alone",
            false => "not the deflection's alone",
        }
    }
}

/// E(torque | q, qm), in the coordinates q + qm over 2 and qm - q: the angles themselves are nearly equal, and all that
/// matters lies across their diagonal.
fn both_angles(q: &[f64], qm: &[f64], y: &[f64], kappa: &Stiffness) -> Result<BothAngles> {
    let place: Vec<f64> = q.iter().zip(qm).map(|(q, m)| 0.5 * (q + m)).collect();
    let d: Vec<f64> = q.iter().zip(qm).map(|(q, m)| m - q).collect();
    let fit = KernelEstimator::default().fit(&[&place, &d], y, None)?;
    let (places, at) = (spread(&place, PLACES), spread(&d, POINTS));
    let (mut mean, mut least, mut most) = (Vec::new(), Vec::new(), Vec::new());
    let (mut off, mut size, mut change) = (0.0, 0.0, 0.0);
    let grid: [Vec<f64>; 2] = [
        at.iter().flat_map(|_| places.iter().copied()).collect(),
        at.iter().flat_map(|d| places.iter().map(move |_| *d)).collect(),
    ];
    let values = fit.predict(&[&grid[0], &grid[1]])?;
    for (&d, values) in at.iter().zip(values.chunks(PLACES)) {
        // Where a place has not been at such a deflection there is no estimate.
        let seen: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let centre = seen.iter().sum::<f64>() / seen.len() as f64;
        let truth = kappa.torque(d);
        for v in &seen {
            off += (v - truth).powi(2);
            change += (v - centre).powi(2);
            size += truth * truth;
        }
        mean.push(centre);
        least.push(seen.iter().copied().fold(f64::NAN, f64::min));
        most.push(seen.iter().copied().fold(f64::NAN, f64::max));
    }
    Ok(BothAngles {
        d: at,
        mean,
        least,
        most,
        bandwidths: fit.bandwidths().to_vec(),
        error: (off / size).sqrt(),
        change: (change / size).sqrt(),
    })
}

fn evenly(low: f64, high: f64, points: usize) -> Vec<f64> {
    (0..points)
        .map(|i| low + (high - low) * i as f64 / (points - 1) as f64)
        .collect()
}

/// Evenly over the range of the samples, without a few at either end.
fn spread(x: &[f64], points: usize) -> Vec<f64> {
    let mut sorted = x.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let trim = (TRIMMED * last as f64) as usize;
    evenly(sorted[trim], sorted[last - trim], points)
}

fn page(log: &Record, one: &Deflection, two: &BothAngles, kappa: &Stiffness, command: &str) -> Result<JointPage> {
    let fact = |name: &str, value: String, note: &str| Fact {
        name: name.to_owned(),
        value,
        note: note.to_owned(),
    };
    let points = Scatter {
        x: log.column("d")?.to_vec(),
        y: log.column("torque")?.to_vec(),
    };
    let curve = |x: &[f64], [y, lower, upper]: [&[f64]; 3], label: &str| Nonlinearity {
        x_label: "deflection (rad)".to_owned(),
        y_label: "torque (N m)".to_owned(),
        x: x.to_vec(),
        y: y.to_vec(),
        lower: lower.to_vec(),
        upper: upper.to_vec(),
        band_label: label.to_owned(),
        density: Vec::new(),
        truth: x.iter().map(|&d| kappa.torque(d)).collect(),
        truth_label: "true stiffness (10)-(11)".to_owned(),
    };
    let band = &one.band;
    Ok(JointPage {
        title: "Job 1: the stiffness as a static regression".to_owned(),
        subtitle: "Joint torque of the space arm's elbow over its deflection, and over both of its angles: local linear kernel \
                   estimates."
            .to_owned(),
        facts: vec![
            fact(
                "Distance from the truth",
                format!("{:.2} %", 100.0 * one.error),
                "relative L2 over all deflections",
            ),
            fact(
                "Band",
                format!("covers {:.0} %", 100.0 * one.covered),
                "of the true curve; 95 % simultaneous",
            ),
            fact("Bandwidth", format!("{} rad", number(one.bandwidth)), "by leave-one-out"),
            fact(
                "From both angles",
                format!("{:.2} %", 100.0 * two.error),
                "relative distance from the truth over deflections and places",
            ),
            fact(
                "Change along the way",
                format!("{:.2} %", 100.0 * two.change),
                &format!("of the torque at the same deflection elsewhere: it is {}", two.dependence()),
            ),
            fact("Samples", log.len().to_string(), "0.01 s apart"),
        ],
        warnings: Vec::new(),
        curves: vec![
            JointCurve {
                heading: "Elastic torque".to_owned(),
                caption:
                    "The measured joint torque over the deflection, with the estimate, its band, and the simulated truth."
                        .to_owned(),
                curve: curve(&band.x[0], [&band.estimate, &band.lower, &band.upper], "95 % simultaneous"),
                points,
            },
            JointCurve {
                heading: "Elastic torque from both angles".to_owned(),
                caption: format!(
                    "E(torque | q, qm), which takes nothing for granted about where the joint stands: at each deflection its mean over {PLACES} \
                     places, with its least and largest value."
                ),
                curve: curve(&two.d, [&two.mean, &two.least, &two.most], "least to largest over the places"),
                points: Scatter::default(),
            },
        ],
        tables: Vec::new(),
        motions: Vec::new(),
        command: Some(command.to_owned()),
    })
}

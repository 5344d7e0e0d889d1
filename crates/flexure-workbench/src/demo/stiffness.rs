//! Job 1: the stiffness as a static regression, of the joint's torque on its deflection, and on both of its angles.

use anyhow::{Context as _, Result};
use flexure::Record;
use flexure::bands::{Band, BandKind, RobustBand};
use flexure::manipulator::{Stiffness, add_noise};
use flexure::nonlinearity::{Degree, Estimator, Kernel, KernelEstimator, KernelRegression, Regression};
use flexure::selection::{BandwidthRule, choose_bandwidth};
use flexure_io::arm::{Amplitude, Excitation, Kind};
use flexure_report::data::{Fact, JointCurve, JointPage, Nonlinearity, Scatter};
use serde_json::json;

use super::views::{NOISE, Steps, View, arm_with, distance, rms, true_stiffness};
use crate::plots::{banded, evenly, extent};
use crate::text::number;

/// Noise of an angle, rad.
const ENCODER: f64 = 1e-5;
/// Points of a curve.
const POINTS: usize = 201;
/// The number of places of the joint at which the estimate from both angles is evaluated.
const PLACES: usize = 9;
/// If the torque changes relatively less than this along the joint's way, it is a function of the deflection alone.
const ALONE: f64 = 0.02;
/// The share of the samples at either end that is left out when places and deflections are spread over the data.
const TRIMMED: f64 = 0.02;

/// Simulates and estimates.
pub fn view(steps: &Steps, command: &str) -> Result<View> {
    let excitation = Excitation {
        kind: Kind::Multisine,
        amplitude: Some(Amplitude::Same(20.0)),
        f_min: Some(0.05),
        f_max: Some(3.0),
        ..Excitation::default()
    };
    let arm = arm_with(60.0, 0.01, excitation)?;
    let kappa = true_stiffness(&arm);
    let log = measured(&(steps.simulate)(&arm)?, &kappa)?;
    let y = log.column("torque")?;
    let one = Deflection::new(log.column("d")?, y, &kappa)?;
    let two = BothAngles::new(log.column("q")?, log.column("qm")?, y, &kappa)?;
    let page = page(&log, &one, &two, &kappa, command)?;
    Ok(View {
        name: "stiffness",
        html: flexure_report::render_joint(&page).context("the report")?,
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
        json: json!({
            "error": one.error,
            "covered": one.covered,
            "bandwidth": one.bandwidth,
            "both_angles": { "error": two.error, "change": two.change, "bandwidths": two.bandwidths },
        }),
        record: log,
    })
}

/// The elbow's angles, torque and deflection with noise.
fn measured(motion: &Record, kappa: &Stiffness) -> flexure::Result<Record> {
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
    let both = log.column("qm")?.iter().zip(log.column("q")?);
    let d: Vec<f64> = both.map(|(m, q)| m - q).collect();
    log.push("d", d)?;
    Ok(log)
}

/// The torque over the deflection.
struct Deflection {
    band: Band,
    bandwidth: f64,
    /// Relative distance from the truth, and the share of the true curve that the band covers.
    error: f64,
    covered: f64,
}

impl Deflection {
    fn new(x: &[f64], y: &[f64], kappa: &Stiffness) -> Result<Self> {
        let kernel = Kernel::Epanechnikov;
        let bandwidth = choose_bandwidth(BandwidthRule::default(), kernel, Degree::Linear, x, y, None)?.bandwidth();
        let fit = KernelRegression { kernel, bandwidth }.fit(x, y)?;
        let simultaneous = RobustBand {
            kind: BandKind::Simultaneous,
            ..RobustBand::default()
        };
        let at = evenly(extent(x.iter().copied()), POINTS);
        let band = simultaneous.for_kernel(&fit.with_degree(Degree::Linear), &at)?;
        let truth: Vec<f64> = at.iter().map(|&d| kappa.torque(d)).collect();
        let inside = |i: &usize| (band.lower[*i]..=band.upper[*i]).contains(&truth[*i]);
        Ok(Deflection {
            error: distance(&band.estimate, &truth),
            covered: (0..POINTS).filter(inside).count() as f64 / POINTS as f64,
            band,
            bandwidth,
        })
    }
}

/// The torque over both angles: it may depend on the joint's place.
struct BothAngles {
    /// Over the deflections: the mean of the torque over all places, with its least and its largest value.
    curve: Nonlinearity,
    bandwidths: Vec<f64>,
    /// Relative distance from the truth over all deflections and places.
    error: f64,
    /// The relative root mean square, over deflections and places, of the torque minus its mean over the places.
    change: f64,
}

impl BothAngles {
    /// E(torque | q, qm), in the coordinates (q + qm)/2 and qm - q: the angles themselves are nearly equal, and the torque changes across
    /// their diagonal.
    fn new(q: &[f64], qm: &[f64], y: &[f64], kappa: &Stiffness) -> Result<Self> {
        let place: Vec<f64> = q.iter().zip(qm).map(|(q, m)| 0.5 * (q + m)).collect();
        let d: Vec<f64> = q.iter().zip(qm).map(|(q, m)| m - q).collect();
        let fit = KernelEstimator::default().fit(&[&place, &d], y, None)?;
        let (places, at) = (spread(&place, PLACES), spread(&d, POINTS));
        let grid: [Vec<f64>; 2] = [
            at.iter().flat_map(|_| places.iter().copied()).collect(),
            at.iter().flat_map(|d| places.iter().map(move |_| *d)).collect(),
        ];
        let values = fit.predict(&[&grid[0], &grid[1]])?;
        let mut curve = Nonlinearity::default();
        let (mut off, mut size, mut change) = (0.0, 0.0, 0.0);
        for (&d, values) in at.iter().zip(values.chunks(PLACES)) {
            // There is no estimate if no data lie near this place and deflection.
            let seen: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
            let centre = seen.iter().sum::<f64>() / seen.len() as f64;
            let truth = kappa.torque(d);
            for v in &seen {
                off += (v - truth).powi(2);
                change += (v - centre).powi(2);
                size += truth * truth;
            }
            curve.y.push(centre);
            curve.lower.push(seen.iter().copied().fold(f64::NAN, f64::min));
            curve.upper.push(seen.iter().copied().fold(f64::NAN, f64::max));
        }
        curve.x = at;
        curve.band_label = "least to largest over the places".to_owned();
        [curve.x_label, curve.y_label] = LABELS.map(str::to_owned);
        Ok(BothAngles {
            curve,
            bandwidths: fit.bandwidths().to_vec(),
            error: (off / size).sqrt(),
            change: (change / size).sqrt(),
        })
    }

    /// The variables that the torque is a function of, for reading.
    fn dependence(&self) -> &'static str {
        match self.change < ALONE {
            true => "the deflection's alone",
            false => "not the deflection's alone",
        }
    }
}

/// Evenly over the range of the samples, without a few at either end.
fn spread(x: &[f64], points: usize) -> Vec<f64> {
    let mut sorted = x.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let trim = (TRIMMED * last as f64) as usize;
    evenly([sorted[trim], sorted[last - trim]], points)
}

/// The axes of the curves.
const LABELS: [&str; 2] = ["deflection (rad)", "torque (N m)"];

fn page(log: &Record, one: &Deflection, two: &BothAngles, kappa: &Stiffness, command: &str) -> Result<JointPage> {
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let with_truth = |curve: Nonlinearity| Nonlinearity {
        truth: curve.x.iter().map(|&d| kappa.torque(d)).collect(),
        truth_label: "stiffness in the simulation".to_owned(),
        ..curve
    };
    let covers = format!("covers {:.0} %", 100.0 * one.covered);
    let elsewhere = format!(
        "of the torque at the same deflection elsewhere: it is {}",
        two.dependence()
    );
    let from_both = format!(
        "E(torque | q, qm), which takes nothing for granted about where the joint stands: at each deflection its mean over {PLACES} \
         places, with its least and largest value."
    );
    let points = Scatter::new(log.column("d")?, log.column("torque")?);
    Ok(JointPage {
        title: "Job 1: the stiffness as a static regression".to_owned(),
        subtitle: "Joint torque of the space arm's elbow over its deflection, and over both of its angles: local linear kernel \
                   estimates."
            .to_owned(),
        facts: vec![
            Fact::new("Distance from the truth", percent(one.error), "relative L2 over all deflections"),
            Fact::new("Band", covers, "of the true curve; 95 % simultaneous"),
            Fact::new("Bandwidth", format!("{} rad", number(one.bandwidth)), "by leave-one-out"),
            Fact::new(
                "From both angles",
                percent(two.error),
                "relative distance from the truth over deflections and places",
            ),
            Fact::new("Change along the way", percent(two.change), elsewhere),
            Fact::new("Samples", log.len().to_string(), "0.01 s apart"),
        ],
        curves: vec![
            JointCurve::new(
                "Elastic torque",
                "The measured joint torque over the deflection, with the estimate, its band, and the simulated truth.",
                with_truth(banded(&one.band, LABELS, "95 % simultaneous".to_owned())),
                points,
            ),
            JointCurve::new(
                "Elastic torque from both angles",
                from_both,
                with_truth(two.curve.clone()),
                Scatter::default(),
            ),
        ],
        command: Some(command.to_owned()),
        ..JointPage::default()
    })
}

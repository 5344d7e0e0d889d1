//! Checks of a joint's log: refusals and warnings.

use super::basis::range;
use super::chain_load::JointLoad;
use super::finding::Finding;
use super::limits::{
    CLIPPED_EXCESS, CLIPPED_NEAR, CLIPPED_RUN, CLIPPED_SHARE, FEWEST_PLATEAUS, FEWEST_REVERSALS, FEWEST_SAMPLES,
    MOST_DIFFERENT, MOST_TURNS, ONE_WAY, PLATEAU_DEPTH, PLATEAU_FLAT, PLATEAU_STILL, PLATEAU_SURE, PLATEAU_TOO_DEEP,
    PLATEAU_WINDOW, STANDS_STILL, STEEP_NOISE, TOGETHER, TURN_WITHIN,
};
use super::smooth::Noise;
use crate::error::{DataError, Error, Result};
use crate::linalg::least_squares;
use crate::linear::correlation::mean;
use crate::quantiles::NORMAL_MAD;
use crate::record::check_values;
use crate::sort;

/// A column of a log with its name.
pub(super) type Named<'a> = (&'a str, &'a [f64]);

/// Refuses a log that cannot be used at all, and a level that no band can have; `samples` is its length.
pub(super) fn log(samples: usize, angles: &[Named], others: &[Named], sample_time: f64, level: f64) -> Result<()> {
    usable(samples, angles, others, sample_time)?;
    if !(level > 0.0 && level < 1.0) {
        let requirement = "strictly between 0 and 1, for example 0.95";
        return Err(Error::parameter("the level of a confidence band", level, requirement));
    }
    Ok(())
}

/// Refuses a log that cannot be used at all; `samples` is its length.
pub(super) fn usable(samples: usize, angles: &[Named], others: &[Named], sample_time: f64) -> Result<()> {
    for (name, column) in angles.iter().chain(others) {
        usable_column(name, column, samples)?;
    }
    positive_step(sample_time)?;
    angles.iter().try_for_each(|(name, angle)| unwrapped(name, angle))
}

fn positive_step(sample_time: f64) -> Result<()> {
    match sample_time > 0.0 && sample_time.is_finite() {
        true => Ok(()),
        false => {
            let requirement = "positive and finite, in s";
            Err(Error::parameter("the sample time", sample_time, requirement))
        }
    }
}

/// Refuses a column that cannot be used at all.
fn usable_column(name: &str, samples: &[f64], length: usize) -> Result<()> {
    known_column(name, samples, length)?;
    if samples.iter().all(|v| *v == samples[0]) {
        return Err(Error::constant(name, samples[0]));
    }
    Ok(())
}

/// Refuses a column that is too short, of another length than the others, or not finite.
fn known_column(name: &str, samples: &[f64], length: usize) -> Result<()> {
    if samples.len() != length {
        return Err(Error::length(name, samples.len(), length));
    }
    if length < FEWEST_SAMPLES {
        return Err(Error::too_short(
            "a joint's friction and inertia",
            FEWEST_SAMPLES,
            length,
        ));
    }
    check_values(name, samples).map(|_| ())
}

/// Refuses a load of another length than the log.
pub(super) fn load(load: Option<&JointLoad>, samples: usize) -> Result<()> {
    load.map_or(Ok(()), |load| known_column("load", &load.torque, samples))
}

/// Refuses the positions of a joint of a chain that cannot be used; it may stay where it is.
pub(super) fn position_in_chain(joint: &str, q: &[f64], length: usize, sample_time: f64) -> Result<()> {
    known_column(joint, q, length)?;
    positive_step(sample_time)?;
    unwrapped(joint, q)
}

/// Refuses an angle that jumps by a turn, in rad or degrees.
fn unwrapped(name: &str, q: &[f64]) -> Result<()> {
    let steps: Vec<f64> = q.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let jump = |turn: f64| Some((turn, steps.iter().position(|s| (s - turn).abs() < TURN_WITHIN * turn)?));
    let jumps: Vec<(f64, usize)> = [2.0 * std::f64::consts::PI, 360.0]
        .into_iter()
        .filter_map(jump)
        .collect();
    let median = sort::median(steps);
    // If the whole motion is this fast, there is no jump.
    match jumps.into_iter().find(|(turn, _)| median < 0.1 * turn) {
        None => Ok(()),
        Some((_, at)) => Err(Error::Data(DataError::WrappedAngle {
            column: name.to_owned(),
            sample: at + 1,
            jump: q[at + 1] - q[at],
        })),
    }
}

/// How many times as far the motor goes as the link, if it goes much farther, much less far, or in the other direction: its angle is then not on
/// the link's side of the gear. `None` if both are alike, or if the motor mostly moves relative to its link.
pub(super) fn different_angles(motor: &[f64], link: &[f64]) -> Option<f64> {
    let (m, q) = (mean(motor), mean(link));
    let both = motor.iter().zip(link);
    let (product, own, square) = both.fold((0.0, 0.0, 0.0), |(p, o, s), (a, b)| {
        (p + (a - m) * (b - q), o + (a - m).powi(2), s + (b - q).powi(2))
    });
    let ratio = product / square.max(f64::MIN_POSITIVE);
    let alike = 1.0 / MOST_DIFFERENT..MOST_DIFFERENT;
    let together = product * product > TOGETHER * own * square;
    (together && !alike.contains(&ratio)).then_some(ratio)
}

/// The ratio of a gear between the encoders of motor and link, if the motor goes much farther than the link: angles in rad, one a sample, and the
/// motor's torque in any unit. Of signals of different lengths, the samples that all have count.
///
/// The joint twists under the torque, which makes the plain ratio of the motions too small. So the motor's angle is regressed on the link's, and on
/// the torque, its cube and the link's rate, which stand for the twist. On four simulated joints of 50:1, whose plain ratios were 49.4 to 49.5, that
/// gave 49.99 to 50.07.
///
/// ```
/// use flexure::identify::robot_joint::gear_ratio;
///
/// let link: Vec<f64> = (0..100).map(|i| (0.1 * i as f64).sin()).collect();
/// let torque: Vec<f64> = (0..100).map(|i| (0.17 * i as f64).cos()).collect();
/// let motor: Vec<f64> = link.iter().zip(&torque).map(|(q, tau)| 50.0 * (q + 0.02 * tau)).collect();
/// assert!((gear_ratio(&motor, &link, &torque).unwrap() - 50.0).abs() < 1e-9);
/// assert_eq!(gear_ratio(&link, &link, &torque), None);
/// ```
pub fn gear_ratio(motor: &[f64], link: &[f64], torque: &[f64]) -> Option<f64> {
    let n = motor.len().min(link.len()).min(torque.len());
    let [motor, link, torque] = [motor, link, torque].map(|signal| &signal[..n]);
    let plain = different_angles(motor, link).filter(|ratio| *ratio > 1.0)?;
    let largest = torque
        .iter()
        .fold(0.0_f64, |m, tau| m.max(tau.abs()))
        .max(f64::MIN_POSITIVE);
    let last = link.len() - 1;
    let rows: Vec<f64> = (link.iter().zip(torque).enumerate())
        .flat_map(|(i, (&q, tau))| {
            let rate = link[(i + 1).min(last)] - link[i.saturating_sub(1)];
            let tau = tau / largest;
            [q, 1.0, tau, tau.powi(3), rate]
        })
        .collect();
    let ratio = least_squares(&rows, 5, motor).map_or(plain, |factors| factors[0]);
    Some(if ratio > 1.0 { ratio } else { plain })
}

/// Whether the torque stays at an extreme.
pub(super) fn clipped(tau: &[f64]) -> Option<Finding> {
    let mut found: Option<Clipped> = None;
    for extreme in range(tau) {
        let (mut all, mut run, mut longest) = (0, 0, 0);
        for &v in tau {
            run = if v == extreme { run + 1 } else { 0 };
            all += usize::from(v == extreme);
            longest = longest.max(run);
        }
        let clipped = longest >= CLIPPED_RUN && all as f64 > CLIPPED_SHARE * tau.len() as f64;
        // A torque with few levels is at its extreme on purpose.
        if clipped && !few_levels(tau) && found.is_none_or(|f| all > f.samples) {
            found = Some(Clipped {
                samples: all,
                value: extreme,
            });
        }
    }
    let Clipped { samples, value } = found.or_else(|| plateau(tau))?;
    Some(Finding::ClippedTorque { samples, value })
}

/// Whether a torque that seems to be clipped did act: where it stands at its extreme, the motion needs no more, and no more in the middle
/// than at the ends. A drive that limits its torque logs what acted; a clipped measurement hides what acted.
pub(super) fn is_limit(finding: &Finding, torque: &[f64], needed: &[f64]) -> bool {
    let Finding::ClippedTorque { value, .. } = *finding else {
        return false;
    };
    let smooth = |x: &[f64]| -> Vec<f64> { x.windows(PLATEAU_WINDOW).map(mean).collect() };
    let (torque, needed) = (smooth(torque), smooth(needed));
    let stands = |torque: f64| (torque - value).abs() < CLIPPED_NEAR * value.abs();
    let (mut start, mut samples, mut excess, mut bulge) = (0, 0.0, 0.0, 0.0);
    for run in torque.chunk_by(|a, b| stands(*a) == stands(*b)) {
        let needed = &needed[start..start + run.len()];
        start += run.len();
        let third = run.len() / 3;
        if stands(run[0]) && third > 0 {
            let length = run.len() as f64;
            samples += length;
            excess += length * (mean(needed) - mean(run));
            let ends = 0.5 * (mean(&needed[..third]) + mean(&needed[run.len() - third..]));
            bulge += length * (mean(&needed[third..run.len() - third]) - ends);
        }
    }
    [excess, bulge].iter().all(|sum| sum / value < CLIPPED_EXCESS * samples)
}

/// The samples at an extreme of the torque, and the extreme.
#[derive(Clone, Copy)]
struct Clipped {
    samples: usize,
    value: f64,
}

/// How long a noisy torque stands still, and at which extreme: it was clipped before it was measured.
fn plateau(tau: &[f64]) -> Option<Clipped> {
    let n = tau.len();
    let bends: Vec<f64> = tau.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    // Second differences of white noise have sqrt(6) times its standard deviation, and a normal variable this median absolute value.
    let noise = sort::median(bends) / (NORMAL_MAD * 6.0_f64.sqrt());
    let unit = noise / (PLATEAU_WINDOW as f64).sqrt();
    let means: Vec<f64> = tau
        .windows(PLATEAU_WINDOW)
        .map(|w| w.iter().sum::<f64>() / PLATEAU_WINDOW as f64)
        .collect();
    let [low, high] = range(&means);
    let pairs = means.iter().zip(&means[PLATEAU_WINDOW..]);
    let still = pairs.filter(|(a, b)| (*a - *b).abs() < PLATEAU_STILL * unit).count();
    if !(unit > 0.0)
        || PLATEAU_DEPTH * unit > PLATEAU_TOO_DEEP * (high - low)
        || still as f64 > STANDS_STILL * means.len() as f64
    {
        return None;
    }
    let mut found: Option<Clipped> = None;
    for sign in [1.0, -1.0] {
        let bottom = if sign > 0.0 { high } else { -low } - PLATEAU_DEPTH * unit;
        let (mut samples, mut runs, mut level) = (0, 0, 0.0);
        // Sums over all runs, weighted by their samples: of the bend, of its variance, and of the bend that peaks would have.
        let (mut bend, mut variance, mut of_peaks) = (0.0, 0.0, 0.0);
        for run in means.chunk_by(|a, b| (sign * a >= bottom) == (sign * b >= bottom)) {
            if sign * run[0] < bottom || run.len() < 3 * PLATEAU_WINDOW {
                continue;
            }
            let whole = run.len() as f64;
            // Without the rise and the fall at its ends.
            let run = &run[PLATEAU_WINDOW / 2..run.len() - PLATEAU_WINDOW / 2];
            let length = run.len() as f64;
            let third = run.len() / 3;
            let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
            let (inner, last) = (&run[third..run.len() - third], &run[run.len() - third..]);
            bend += sign * (mean(inner) - 0.5 * (mean(&run[..third]) + mean(last))) * length;
            // A parabola of this depth over the whole run: its outer thirds lie 4/9 of the depth below the middle one.
            of_peaks += 4.0 / 9.0 * PLATEAU_DEPTH * unit * (length / whole).powi(2) * length;
            // Three means, each over a third and a window; the outer two count half.
            variance += (unit * length).powi(2) * 1.5 * PLATEAU_WINDOW as f64 / (third + PLATEAU_WINDOW) as f64;
            level += run.iter().sum::<f64>();
            samples += run.len();
            runs += 1;
        }
        let count = samples as f64;
        if runs >= FEWEST_PLATEAUS
            && count > CLIPPED_SHARE * n as f64
            && bend < PLATEAU_FLAT * unit * count
            && bend + PLATEAU_SURE * variance.sqrt() < 0.5 * of_peaks
            && found.is_none_or(|f| samples > f.samples)
        {
            let value = level / count;
            found = Some(Clipped { samples, value });
        }
    }
    found
}

/// Whether the samples repeat their predecessor most of the time: steps, not a clipped curve.
fn few_levels(tau: &[f64]) -> bool {
    let held = tau.windows(2).filter(|w| w[0] == w[1]).count();
    2 * held > tau.len()
}

/// Whether an angle spans many turns, so that it may be in degrees or in counts of an encoder.
pub(super) fn many_turns(angles: &[&[f64]]) -> Option<Finding> {
    let span = |q: &[f64]| {
        let [low, high] = range(q);
        high - low
    };
    let widest = angles.iter().copied().max_by(|a, b| span(a).total_cmp(&span(b)))?;
    let finding = Finding::ManyTurns {
        span: span(widest),
        whole: widest.iter().all(|q| q.fract() == 0.0),
    };
    (span(widest) > MOST_TURNS * std::f64::consts::TAU).then_some(finding)
}

/// What is wrong with the motion: in one direction only, or too few reversals; velocities within `resolution` are rest.
pub(super) fn motion(v: &[f64], resolution: f64) -> Option<Finding> {
    let fastest = v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let moving = resolution.max(0.02 * fastest);
    let forward = v.iter().filter(|v| **v > moving).count() as f64;
    let back = v.iter().filter(|v| **v < -moving).count() as f64;
    let share = forward.min(back) / (forward + back).max(1.0);
    if share < ONE_WAY {
        return Some(Finding::NeverReverses { share });
    }
    let directions: Vec<bool> = v.iter().filter(|v| v.abs() > moving).map(|v| *v > 0.0).collect();
    let reversals = directions.windows(2).filter(|w| w[0] != w[1]).count();
    (reversals < FEWEST_REVERSALS).then_some(Finding::FewReversals { reversals })
}

/// Refuses a record if its motion reaches the highest frequencies, so that the noise cannot be seen, or if it is too short to estimate the
/// noise.
pub(super) fn resolved(noises: &[Noise], samples: usize, step: f64) -> Result<()> {
    match noises.iter().find(|n| n.unresolved) {
        // Long enough for equations below the frequency where this begins.
        Some(noise) if noise.fall > STEEP_NOISE || samples < 4 * FEWEST_SAMPLES => {
            Err(Error::Data(DataError::SampledTooSlowly { step, band: noise.band }))
        }
        _ => Ok(()),
    }
}

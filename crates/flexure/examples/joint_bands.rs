//! Prints how near the curves of a two-link arm come to the truth from logs of it, how often their bands cover it, and how often
//! its true forms are refuted.
//!
//! ```text
//! cargo run --release -p flexure --example joint_bands                          # half an hour on two cores
//! cargo run --release -p flexure --example joint_bands -- 4 4 60 0.001 40,20    # motions, draws, s, s, largest torques
//! ```
//!
//! The nonlinear space arm under two multisines of 0.05 to 3 Hz, other ones for each motion, and each motion's log with several
//! draws of the noise: 1e-5 rad of every encoder, 1 % of the largest torque. The errors of one log are correlated along a curve (the mean
//! of the torque's noise is an offset of all of the friction). So the band of a single log covers nearly all of a curve or misses much of
//! it: only the mean over logs shows the bands' level.
//!
//! "covers" is the share of points, evenly over the range of deflections or velocities that was visited, at which the band
//! contains the truth, averaged over the logs; "least" is that of the worst log, "own" counts the band's own points, which are
//! denser at zero. "z" is the mean over the points of the root mean square of the errors in standard errors, 1 if these are
//! right; "bias" is the root mean square over the points of a motion of the mean error of its draws in standard errors of that
//! mean, 1 if there is none. "off" is the relative L2 distance from the truth. "refuted" is the share of logs that refute the true form at
//! the level of the test, then that for a false form: the cubic stiffness without wind-up, the friction without its Stribeck part.

use flexure::bands::Band;
use flexure::identify::robot_joint::{Estimated, Fitted, FormName, REFUTED, TwoLinkArm, TwoLinkLog};
use flexure::manipulator::{Arm, Drive, JointKind, LinkDynamics, SimulationOptions, add_noise, simulate, space_arm};
use flexure::record::Record;
use flexure::signal::{Phases, multisine};

/// Points of the range at which coverage is counted.
const POINTS: usize = 100;

const CURVES: [&str; 4] = ["stiffness 1", "stiffness 2", "friction 1", "friction 2"];
const INERTIAS: [&str; 5] = ["motor 1", "motor 2", "shoulder", "elbow", "coupling"];

struct Setting {
    motions: u64,
    draws: u64,
    seconds: f64,
    step: f64,
    torque: [f64; 2],
}

fn setting() -> Result<Setting, Box<dyn std::error::Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let at = |i: usize, default: &str| given.get(i).cloned().unwrap_or_else(|| default.to_owned());
    let torques = at(4, "40,20");
    let (first, second) = torques.split_once(',').ok_or("two largest torques, as in 40,20")?;
    Ok(Setting {
        motions: at(0, "8").parse()?,
        draws: at(1, "8").parse()?,
        seconds: at(2, "60").parse()?,
        step: at(3, "0.001").parse()?,
        torque: [first.parse()?, second.parse()?],
    })
}

fn motion(setting: &Setting, motion: u64) -> flexure::Result<Record> {
    let arm = Arm::new(space_arm(JointKind::Nonlinear))?;
    let options = SimulationOptions::new(setting.seconds, setting.step)?;
    let rows = options.sampling.rows();
    let torque = |joint: usize| {
        let seed = 2 * motion + joint as u64;
        let phases = Phases::Random { seed };
        multisine(rows, setting.step, setting.torque[joint], 0.05, 3.0, phases)
    };
    let (first, second) = (torque(0)?, torque(1)?);
    simulate(&arm, &Drive::Held([&first, &second]), &options)
}

fn identified(setting: &Setting, motion: &Record, seed: u64) -> flexure::Result<TwoLinkArm> {
    let angles = ["q1", "q2", "qm1", "qm2"].map(|name| (name, 1e-5));
    let [one, two] = setting.torque.map(|t| 0.01 * t);
    let noise: Vec<(&str, f64)> = angles.into_iter().chain([("tau1", one), ("tau2", two)]).collect();
    let log = add_noise(motion, seed, &noise)?;
    let columns =
        |names: [&str; 2]| -> flexure::Result<[&[f64]; 2]> { Ok([log.column(names[0])?, log.column(names[1])?]) };
    TwoLinkLog {
        motor: columns(["qm1", "qm2"])?,
        link: columns(["q1", "q2"])?,
        torque: columns(["tau1", "tau2"])?,
        sample_time: setting.step,
        level: 0.95,
    }
    .identify()
}

/// The result of one log for a curve.
struct Summary {
    motion: u64,
    covers: f64,
    own: f64,
    off: f64,
    /// The errors in standard errors, at each point.
    z: Vec<f64>,
    /// Whether the true form is refuted, and the false one.
    refuted: [bool; 2],
}

fn summary(motion: u64, band: &Band, truth: impl Fn(f64) -> f64, forms: &[Fitted], names: [FormName; 2]) -> Summary {
    let x = &band.x[0];
    let (from, to) = (x[0], x[x.len() - 1]);
    let (mut covered, mut off, mut size, mut z) = (0, 0.0, 0.0, Vec::new());
    for i in 0..POINTS {
        let at = from + (to - from) * (i as f64 + 0.5) / POINTS as f64;
        let k = x.partition_point(|v| *v < at).clamp(1, x.len() - 1);
        let t = (at - x[k - 1]) / (x[k] - x[k - 1]);
        let on = |y: &[f64]| y[k - 1] + t * (y[k] - y[k - 1]);
        let y = truth(at);
        covered += usize::from((on(&band.lower)..=on(&band.upper)).contains(&y));
        off += (on(&band.estimate) - y).powi(2);
        size += y * y;
        z.push((on(&band.estimate) - y) / on(&band.standard_error).max(f64::MIN_POSITIVE));
    }
    let own = (0..x.len()).filter(|&k| (band.lower[k]..=band.upper[k]).contains(&truth(x[k])));
    let refuted = |name| {
        let form = forms.iter().find(|f| f.form == name);
        form.is_some_and(|f| f.lack_of_fit.p_value < REFUTED)
    };
    Summary {
        motion,
        own: own.count() as f64 / x.len() as f64,
        covers: covered as f64 / POINTS as f64,
        off: (off / size).sqrt(),
        z,
        refuted: names.map(refuted),
    }
}

/// The root mean square over the points of the mean over a motion's draws, in standard errors of that mean.
fn bias(all: &[Summary], setting: &Setting) -> f64 {
    let mut sum = 0.0;
    for motion in 0..setting.motions {
        let own: Vec<&Summary> = all.iter().filter(|t| t.motion == motion).collect();
        let n = own.len() as f64;
        for point in 0..POINTS {
            let mean = own.iter().map(|t| t.z[point]).sum::<f64>() / n;
            sum += n * mean * mean / POINTS as f64;
        }
    }
    (sum / setting.motions as f64).sqrt()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let setting = setting()?;
    let parameters = space_arm(JointKind::Nonlinear);
    let links = LinkDynamics::new(&parameters.links);
    let joint = parameters.joints[0];
    let kappa = joint.nonlinear_stiffness();
    let friction = joint.friction.unwrap_or_default();
    let truths = [1.0, 1.0, links.shoulder, links.elbow, links.coupling];
    let mut all: [Vec<Summary>; 4] = Default::default();
    let mut inertias: [Vec<f64>; 5] = Default::default();
    for number in 0..setting.motions {
        let clean = motion(&setting, number)?;
        for draw in 0..setting.draws {
            let arm = identified(&setting, &clean, 1000 + number + 7919 * draw)?;
            print!("motion {number}, draw {draw}: covers");
            for (i, all) in all.iter_mut().enumerate() {
                let axis = &arm.joints[i % 2];
                let forms = [FormName::Windup, FormName::CubicStiffness];
                let rubs = [FormName::SmoothStribeck, FormName::SmoothCoulomb];
                let found = match i {
                    0 | 1 => summary(
                        number,
                        &axis.stiffness.band,
                        |d| kappa.torque(d),
                        &axis.stiffness.forms,
                        forms,
                    ),
                    _ => summary(
                        number,
                        &axis.link.friction.band,
                        |v| friction.torque(v),
                        &axis.link.friction.forms,
                        rubs,
                    ),
                };
                print!(" {:5.1} % ({:.2} % off)", 100.0 * found.covers, 100.0 * found.off);
                all.push(found);
            }
            println!();
            let [one, two] = &arm.joints;
            let found: [Estimated; 5] = [
                one.motor_inertia,
                two.motor_inertia,
                arm.shoulder,
                arm.elbow,
                arm.coupling,
            ];
            for ((all, found), truth) in inertias.iter_mut().zip(found).zip(truths) {
                all.push((found.value - truth) / found.standard_error);
            }
        }
    }
    println!(
        "{:<12}  covers   least     own     off     z  bias  refuted: true, false",
        ""
    );
    for (name, summaries) in CURVES.iter().zip(&all) {
        let mean = |of: &dyn Fn(&Summary) -> f64| summaries.iter().map(of).sum::<f64>() / summaries.len() as f64;
        let share = |i: usize| 100.0 * mean(&|t| f64::from(u8::from(t.refuted[i])));
        let least = summaries.iter().map(|t| t.covers).fold(1.0, f64::min);
        let square = |t: &Summary| t.z.iter().map(|z| z * z).sum::<f64>() / POINTS as f64;
        println!(
            "{name:<12} {:5.1} % {:5.1} % {:5.1} % {:5.2} %  {:4.2}  {:4.2}  {:5.1} % {:5.1} %",
            100.0 * mean(&|t| t.covers),
            100.0 * least,
            100.0 * mean(&|t| t.own),
            100.0 * mean(&|t| t.off),
            mean(&square).sqrt(),
            bias(summaries, &setting),
            share(0),
            share(1)
        );
    }
    for (name, z) in INERTIAS.iter().zip(&inertias) {
        let n = z.len() as f64;
        let mean = z.iter().sum::<f64>() / n;
        let square = z.iter().map(|z| z * z).sum::<f64>() / n;
        println!(
            "{name:<12} {mean:5.2} standard errors off on average, {:.2} root mean square",
            square.sqrt()
        );
    }
    Ok(())
}

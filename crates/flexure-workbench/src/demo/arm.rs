//! Both joints of a simulated space arm, identified from its log and drawn over the truth.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use flexure::Record;
use flexure::bands::Band;
use flexure::identify::robot_joint::Estimated;
use flexure::manipulator::{ArmParameters, JointParameters, LinkDynamics};
use flexure::text::{decimal, number, percent};
use flexure_io::RecordFile;
use flexure_io::arm::{Amplitude, ArmFile, preset};
use flexure_report::data::{Axis, Comparison, JointCurve, ParameterTable, Prediction};
use serde_json::{Value, json};

use super::views::distance;
use crate::joints::{
    self, AxisLog, Constant, Fit, Joint, Log, Place, Settings, Trial, TwoLink, constants, estimate, recorded,
    with_error,
};
use crate::lines::{Lines, Tone};

/// The preset whose log is identified.
pub const LOG_PRESET: &str = "motor-log";
/// The seed and the amplitudes (N m) of the torques that the identified arm has not seen.
const FRESH: (u64, [f64; 2]) = (2, [30.0, 15.0]);
/// The level of the bands.
const LEVEL: f64 = 0.95;
/// The joints.
const NAMES: [&str; 2] = ["Shoulder", "Elbow"];
/// The parameters of a joint's forms that the text names: symbol, name and unit.
const SHOWN: [[&str; 3]; 3] = [
    ["a2", "stiffness", "N m/rad"],
    ["g4", "Coulomb friction", "N m"],
    ["g6", "viscous friction", "N m s/rad"],
];
/// Columns of the log: torque, motor angle and link angle of a joint.
const COLUMNS: [[&str; 3]; 2] = [["tau1", "qm1", "q1"], ["tau2", "qm2", "q2"]];

/// The arm of the preset.
pub fn logged_arm() -> Result<ArmFile> {
    Ok(preset(LOG_PRESET)?)
}

/// The run of an arm under torques that are not those of its log, without noise.
pub fn under_fresh_torques(arm: &ArmFile) -> ArmFile {
    let (seed, amplitudes) = FRESH;
    let mut fresh = arm.clone();
    fresh.excitation.seed = Some(seed);
    fresh.excitation.amplitude = Some(Amplitude::Each(amplitudes));
    fresh.noise = None;
    fresh
}

/// The identified arm and the true one.
pub struct BothJoints {
    joints: TwoLink,
    trial: Trial,
    truth: ArmParameters,
}

impl BothJoints {
    /// Identifies the arm from the record of `logged`'s run in `file`.
    ///
    /// # Errors
    /// Those of the identification.
    pub fn identify(file: &RecordFile, logged: &ArmFile) -> Result<Self> {
        let column = |name: &str| -> Result<Vec<f64>> { Ok(file.finite(name)?.to_vec()) };
        let axis = |[torque, motor, link]: [&str; 3]| -> Result<AxisLog> {
            Ok(AxisLog {
                torque: column(torque)?,
                motor: Some(column(motor)?),
                position: column(link)?,
                velocity: None,
                load: None,
            })
        };
        let [first, second] = COLUMNS;
        let axes = [axis(first)?, axis(second)?];
        let sample_time = logged.run.sample_time;
        let settings = Settings {
            level: LEVEL,
            ..Settings::default()
        };
        let arm = joints::arm(axes.each_ref(), sample_time, &settings).map_err(|error| file.locate(error))?;
        let log = Log {
            name: file.name(),
            sample_time,
            axes: axes.into(),
            columns: BTreeMap::new(),
        };
        let joints = TwoLink { arm, log };
        Ok(BothJoints {
            trial: joints.try_out(None, None)?,
            joints,
            truth: logged.arm,
        })
    }

    /// The identified arm, driven by its log, as the text of an arm file.
    ///
    /// # Errors
    /// If the identified parameters are not those of an arm.
    pub fn arm_file(&self) -> Result<String> {
        let place = Place {
            joint: 0,
            template: None,
            excitation: recorded(&self.joints.log.name),
        };
        self.joints.arm_file(place)
    }

    /// The identified arm under the torques of `fresh`, from the same state.
    ///
    /// # Errors
    /// As [`BothJoints::arm_file`].
    pub fn under(&self, fresh: &ArmFile) -> Result<ArmFile> {
        let identified = ArmFile::from_toml_str(&self.arm_file()?, "the identified arm")?;
        Ok(ArmFile {
            arm: identified.arm,
            ..fresh.clone()
        })
    }
}

/// The true arm and the identified one under the same torques, which neither has seen.
pub struct FreshRun {
    sample_time: f64,
    /// The angle of each link: true, and simulated.
    angles: [[Vec<f64>; 2]; 2],
}

impl FreshRun {
    /// From two records of the same run.
    ///
    /// # Errors
    /// For records without angles.
    pub fn new(measured: &Record, simulated: &Record, sample_time: f64) -> flexure::Result<Self> {
        let angles = |record: &Record| -> flexure::Result<[Vec<f64>; 2]> {
            Ok([record.column("q1")?.to_vec(), record.column("q2")?.to_vec()])
        };
        let ([m1, m2], [s1, s2]) = (angles(measured)?, angles(simulated)?);
        Ok(FreshRun {
            sample_time,
            angles: [[m1, s1], [m2, s2]],
        })
    }

    fn fits(&self) -> [Fit; 2] {
        self.angles
            .each_ref()
            .map(|[measured, simulated]| Fit::new(measured, simulated))
    }

    fn comparison(&self, joint: usize) -> Comparison {
        let [measured, predicted] = self.angles[joint].clone();
        let fit = self.fits()[joint];
        Comparison {
            names: ["true", "identified"],
            heading: format!(
                "{}: the true arm against the identified one, under torques that neither has seen",
                NAMES[joint]
            ),
            prediction: Prediction {
                y_label: "angle (rad)".to_owned(),
                time: Axis::of_samples(Some(self.sample_time), 0),
                measured,
                predicted,
                fit_percent: fit.percent,
                rms: fit.rms,
            },
            remark: String::new(),
        }
    }
}

/// How near a free curve is to the true one.
struct Nearness {
    what: &'static str,
    /// The relative distance in the mean square.
    distance: f64,
    /// The share of the true curve that lies in the band.
    covered: f64,
}

impl Nearness {
    fn new(what: &'static str, band: &Band, truth: impl Fn(f64) -> f64) -> Self {
        let truth: Vec<f64> = band.x[0].iter().map(|&x| truth(x)).collect();
        let inside = |i: &usize| (band.lower[*i]..=band.upper[*i]).contains(&truth[*i]);
        Nearness {
            what,
            distance: distance(&band.estimate, &truth),
            covered: (0..truth.len()).filter(inside).count() as f64 / truth.len() as f64,
        }
    }
}

/// A joint's true value of a parameter of stiffness or friction.
fn true_value(joint: &JointParameters, symbol: &str) -> Option<f64> {
    let [g1, g2, g3, g4, g5, g6] = joint.friction.unwrap_or_default().0;
    let known = [
        ("a1", joint.cubic),
        ("a2", joint.linear),
        ("ksw", joint.windup),
        ("asw", joint.windup_sharpness),
        ("g1", g1),
        ("g2", g2),
        ("g3", g3),
        ("g4", g4),
        ("g5", g5),
        ("g6", g6),
    ];
    known
        .into_iter()
        .find(|(name, _)| *name == symbol)
        .map(|(_, value)| value)
}

fn beside(estimated: Estimated, unit: &str, truth: f64) -> String {
    format!("{} {unit} (true {})", with_error(estimated), number(truth))
}

impl BothJoints {
    /// The constants of the links with their true values.
    fn constants(&self) -> impl Iterator<Item = (Constant, f64)> {
        let LinkDynamics {
            shoulder,
            elbow,
            coupling,
        } = LinkDynamics::new(&self.truth.links);
        constants(&self.joints.arm).into_iter().zip([shoulder, elbow, coupling])
    }

    /// How near a joint's curves are to the true ones.
    fn nearness(&self, joint: usize) -> [Nearness; 2] {
        let (axis, truth) = (&self.joints.arm.joints[joint], &self.truth.joints[joint]);
        let (stiffness, friction) = (truth.nonlinear_stiffness(), truth.friction.unwrap_or_default());
        [
            Nearness::new("elastic torque", &axis.stiffness.band, |d| stiffness.torque(d)),
            Nearness::new("friction curve", &axis.link.friction.band, |v| friction.torque(v)),
        ]
    }

    /// The identified values, compared with the truth.
    pub fn summary(&self, fresh: &FreshRun) -> Lines {
        let log = &self.joints.log;
        let [first, second] = fresh.fits().map(|fit| fit.percent);
        let mut lines = Lines::new();
        lines.headline(
            Tone::Good,
            format!(
                "Both joints of a space arm from its log. On new torques, the identified arm moves like the true one: fit {first:.2} % \
                 (shoulder), {second:.2} % (elbow)"
            ),
        );
        let apart = decimal(log.sample_time);
        lines.item(
            "log",
            format!("{} samples of {}, {apart} s apart", log.samples(), log.name),
        );
        for (constant, truth) in self.constants() {
            lines.item(constant.name, beside(constant.value, "kg m^2", truth));
        }
        for (i, axis) in self.joints.arm.joints.iter().enumerate() {
            let truth = &self.truth.joints[i];
            lines.sentence(NAMES[i]);
            lines.deeper(|lines| {
                lines.item(
                    "motor inertia",
                    beside(axis.motor_inertia, "kg m^2", truth.motor_inertia),
                );
                let forms = [&axis.model.stiffness, &axis.model.friction];
                for [symbol, name, unit] in SHOWN {
                    let parameter = forms.iter().find_map(|form| form.parameter(symbol));
                    if let (Some(found), Some(truth)) = (parameter, true_value(truth, symbol)) {
                        lines.item(name, beside(estimate(found), unit, truth));
                    }
                }
                for Nearness {
                    what,
                    distance,
                    covered,
                } in self.nearness(i)
                {
                    let band = format!("its 95 % band covers {:.0} % of it", 100.0 * covered);
                    lines.item(what, format!("{} from the true one; {band}", percent(distance)));
                }
            });
        }
        lines
    }

    /// The same as JSON, with everything that `flexure joint` says.
    pub fn json(&self, fresh: &FreshRun) -> Value {
        let mut object = self.joints.tried_json(&self.trial);
        object["fresh"] = json!({ "fit_percent": fresh.fits().map(|fit| fit.percent) });
        let near = |joint: usize| -> Value {
            let each = self.nearness(joint).map(|n| {
                let key = n.what.replace(' ', "_");
                (key, json!({ "distance": n.distance, "covered": n.covered }))
            });
            each.into_iter().collect()
        };
        object["truth"] = json!({
            "links": self.constants().map(|(constant, truth)| (constant.name, truth)).collect::<BTreeMap<_, _>>(),
            "curves": [near(0), near(1)],
        });
        object
    }

    /// The page of `flexure joint` with the truth on it, and with the run under fresh torques.
    ///
    /// # Errors
    /// For numbers that cannot be drawn.
    pub fn html(&self, fresh: &FreshRun, command: String) -> Result<String> {
        let mut page = self.joints.page(&self.trial);
        page.title = "Both joints of a space arm, from a minute of its log".to_owned();
        page.command = Some(command);
        for (fact, (_, truth)) in page.facts.iter_mut().zip(self.constants()) {
            fact.note = format!("true {}; {}", number(truth), fact.note);
        }
        let curves = page.curves.len() / NAMES.len();
        for (curves, joint) in page.curves.chunks_mut(curves).zip(&self.truth.joints) {
            lay_over_truth(curves, joint);
        }
        page.others = None;
        let tables = page.tables.len() / NAMES.len();
        let tables = std::mem::take(&mut page.tables)
            .chunks(tables)
            .map(<[_]>::to_vec)
            .collect::<Vec<_>>();
        for (tables, joint) in tables.into_iter().zip(&self.truth.joints) {
            page.tables
                .extend(tables.into_iter().map(|table| with_truth(table, joint)));
        }
        page.motions.splice(0..0, [0, 1].map(|joint| fresh.comparison(joint)));
        flexure_report::render_joint(&page).context("the report")
    }
}

/// Puts the true curves of a joint in place of the forms that were fitted to it.
fn lay_over_truth(curves: &mut [JointCurve], joint: &JointParameters) {
    let (stiffness, friction) = (joint.nonlinear_stiffness(), joint.friction.unwrap_or_default());
    let truths: [(&str, &dyn Fn(f64) -> f64); 3] = [
        ("the true stiffness", &|d| {
            if d == 0.0 { f64::NAN } else { stiffness.torque(d) / d }
        }),
        ("the true elastic torque", &|d| stiffness.torque(d)),
        ("the true friction", &|v| friction.torque(v)),
    ];
    for (JointCurve { curve, dashed, .. }, (label, truth)) in curves.iter_mut().zip(truths) {
        curve.truth = curve.x.iter().map(|&x| truth(x)).collect();
        curve.truth_label = label.to_owned();
        *dashed = "truth";
    }
}

/// The table with the true values.
fn with_truth(mut table: ParameterTable, joint: &JointParameters) -> ParameterTable {
    for [symbols, value] in &mut table.rows {
        let each = symbols.split(", ").filter_map(|symbol| true_value(joint, symbol));
        let truths: Vec<String> = each.map(number).collect();
        if !truths.is_empty() {
            value.push_str(&format!(" (true {})", truths.join(", ")));
        }
    }
    table
}

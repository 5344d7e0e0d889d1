//! How well an identified joint or arm explains its log, and another one: the first line of its text, and the verdict of its page.

use flexure::identify::robot_joint::{Finding, Fitted};
use flexure::text::percent;
use flexure_report::data::Verdict;

use super::later::{Later, Trial};
use super::text::{POOR, RUN_AWAY, is_refuted, lack_text};
use crate::lines::{Lines, Tone};
use crate::text::capitalised;

/// How well an identified joint or arm explains its log.
pub struct Outcome<'a> {
    /// What drove its simulated motions, and how near they are, percent; empty where none could be simulated.
    fits: Vec<(&'static str, f64)>,
    /// The forms of every joint, the friction last; the friction's test is the test of all of them together.
    joints: Vec<Vec<&'a Fitted>>,
    /// Reasons why no result can be trusted yet.
    doubts: Vec<&'static str>,
    /// What it does on another log.
    later: Option<&'a Later>,
}

/// What is wrong with it, the worst first.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    RunsAway,
    NotSimulated,
    PoorMotion,
    Doubtful,
    OtherLog,
    RefutedForm,
}

impl<'a> Outcome<'a> {
    /// From what it does when tried out, the forms of every joint (the friction last), and the other findings.
    pub fn new(
        trial: &'a Trial,
        joints: impl IntoIterator<Item = Vec<&'a Fitted>>,
        findings: impl IntoIterator<Item = &'a Finding>,
    ) -> Self {
        let mut doubts: Vec<&str> = findings.into_iter().filter_map(Finding::doubt).collect();
        doubts.dedup();
        Outcome {
            doubts,
            fits: trial.motions.iter().map(|m| (m.drive, m.fit.percent)).collect(),
            later: trial.later.as_ref(),
            joints: joints.into_iter().collect(),
        }
    }

    fn is_refuted(&self) -> bool {
        self.joints
            .iter()
            .filter_map(|forms| forms.last())
            .any(|form| is_refuted(form))
    }

    fn fault(&self) -> Option<Fault> {
        let below = |limit: f64| self.fits.iter().any(|&(_, fit)| !(fit > limit));
        match self.fits.is_empty() {
            true => Some(Fault::NotSimulated),
            false if below(RUN_AWAY) => Some(Fault::RunsAway),
            false if below(POOR) => Some(Fault::PoorMotion),
            false if !self.doubts.is_empty() => Some(Fault::Doubtful),
            false if self.later.is_some_and(|later| !later.holds()) => Some(Fault::OtherLog),
            false if self.is_refuted() => Some(Fault::RefutedForm),
            false => None,
        }
    }

    /// The same in a word or two, and whether nothing is wrong.
    pub fn word(&self) -> (&'static str, bool) {
        let word = match self.fault() {
            Some(Fault::RunsAway) => "runs away",
            Some(Fault::NotSimulated) => "not simulated",
            Some(Fault::PoorMotion) => "poor motion",
            Some(Fault::Doubtful) => "doubtful",
            Some(Fault::OtherLog) => "not on the other log",
            Some(Fault::RefutedForm) => "form refuted",
            None => "holds",
        };
        (word, self.fault().is_none())
    }

    /// Whether there are forms of stiffness, beside those of friction.
    fn has_stiffness(&self) -> bool {
        self.joints.iter().any(|forms| forms.len() > 1)
    }

    /// The largest distance of a form from its free curve.
    fn distance(&self) -> String {
        let distances = self.joints.iter().flatten().map(|form| form.lack_of_fit.distance);
        percent(distances.fold(0.0, f64::max))
    }

    fn tone(&self) -> Tone {
        match self.fault() {
            Some(Fault::RunsAway | Fault::NotSimulated) => Tone::Bad,
            Some(Fault::PoorMotion | Fault::Doubtful | Fault::OtherLog | Fault::RefutedForm) => Tone::Caution,
            None => Tone::Good,
        }
    }

    /// How near its simulated motions are: one of each joint, or of one joint under several drives.
    fn motion(&self) -> String {
        match self.fault() {
            Some(Fault::NotSimulated) => return "it cannot be simulated with what was found".to_owned(),
            Some(Fault::RunsAway) => return "the simulated motion runs away".to_owned(),
            _ => {}
        }
        let same = self.fits.iter().all(|(drive, _)| *drive == self.fits[0].0);
        let each = self.fits.iter().map(|(drive, fit)| match same {
            true => format!("{fit:.2} %"),
            false => format!("{fit:.2} % {drive}"),
        });
        format!(
            "the simulated motion fits by {}",
            each.collect::<Vec<_>>().join(" and ")
        )
    }

    /// The first line of its text: `what` it is, whether it can be trusted, its `inertia`, and how close its simulated motions are.
    pub fn write_headline(&self, what: &str, inertia: &str, lines: &mut Lines) {
        let doubts = match (&self.doubts[..], self.fault()) {
            ([], Some(Fault::PoorMotion)) => {
                ", doubtful because its simulated motion is far from the measured one".to_owned()
            }
            ([], Some(Fault::RunsAway)) => ", doubtful because its simulated motion runs away".to_owned(),
            ([], _) => String::new(),
            (doubts, _) => format!(", not reliable because {}", doubts.join(", and ")),
        };
        let later = self
            .later
            .map_or(String::new(), |later| format!("; {}", self.on_later(later)));
        let off = match self.fault() {
            Some(Fault::RefutedForm) if self.has_stiffness() => format!(
                "; its best stiffness and friction forms differ from the measured curves by up to {}",
                self.distance()
            ),
            Some(Fault::RefutedForm) => format!(
                "; its best friction form differs from the measured curve by {}",
                self.distance()
            ),
            _ => String::new(),
        };
        lines.headline(
            self.tone(),
            format!("{what}{doubts}: {inertia}; {}{later}{off}", self.motion()),
        );
    }

    /// What it does on another log: of a result that is not reliable, only how far off it is.
    fn on_later(&self, later: &Later) -> String {
        match self.doubts.is_empty() {
            true => later.outcome(),
            false => later.distance(),
        }
    }

    /// The same content, as the verdict of the page.
    pub fn verdict(&self) -> Verdict {
        let fault = self.fault();
        let (forms, are) = match self.has_stiffness() {
            true => ("the forms of stiffness and friction", "are"),
            false => ("the form of the friction", "is"),
        };
        let headline = match fault {
            Some(Fault::RunsAway) => "The simulated motion runs away".to_owned(),
            Some(Fault::NotSimulated) => "No motion can be simulated with what was found".to_owned(),
            Some(Fault::PoorMotion) => "The simulated motion is far from the measured one".to_owned(),
            Some(Fault::Doubtful) => "This result is not reliable".to_owned(),
            Some(Fault::OtherLog) => "What was found does not hold on the other log".to_owned(),
            Some(Fault::RefutedForm) => capitalised(&format!(
                "{forms} {are} {} off the free curve, more than the uncertainty of that curve",
                self.distance()
            )),
            None => format!("Nothing refutes {forms}"),
        };
        let motion = match fault {
            Some(Fault::RunsAway) => {
                "Inertia and friction as they were found do not explain the measured motion".to_owned()
            }
            Some(Fault::NotSimulated) => {
                "Gravity acts, which no simulated arm has, or no arm has such inertias, stiffness and friction"
                    .to_owned()
            }
            _ => capitalised(&self.motion()),
        };
        let usable = matches!(fault, Some(Fault::RefutedForm | Fault::Doubtful | Fault::PoorMotion));
        let advice = (self.is_refuted() && usable)
            .then(|| "Where the difference matters, use the curves instead of the forms".to_owned());
        let of = |(i, forms): (usize, &Vec<&Fitted>)| {
            let joint = match self.joints.len() {
                1 => String::new(),
                _ => format!("Joint {}: ", i + 1),
            };
            let titles: Vec<&str> = forms.iter().map(|form| form.form.title()).collect();
            let lack = forms.last().map_or(String::new(), |form| lack_text(form));
            capitalised(&format!("{joint}{}: {lack}", titles.join("; ")))
        };
        let doubts = self.doubts.iter().map(|doubt| capitalised(doubt));
        let later = self.later.map(|later| capitalised(&self.on_later(later)));
        let sentences = doubts.chain([motion]).chain(later).chain(advice);
        Verdict {
            headline,
            holds: fault.is_none(),
            text: sentences.map(|sentence| sentence + ".").collect::<Vec<_>>().join(" "),
            details: self.joints.iter().enumerate().map(of).collect(),
        }
    }
}

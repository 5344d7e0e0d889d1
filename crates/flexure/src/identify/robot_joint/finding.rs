//! Findings about a log, to know before trusting the result.

use std::fmt;

use super::outcome::{Effect, Estimated, StiffJoint};
use crate::text::{counted, decimal, number, percent, with_error};

/// Something to know before trusting the result; its text names a remedy.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// The torque stays at its largest or smallest value.
    ClippedTorque {
        /// Samples at that value.
        samples: usize,
        /// The value.
        value: f64,
    },
    /// The joint moves in one direction only.
    NeverReverses {
        /// The share of the time in the rarer direction.
        share: f64,
    },
    /// The joint reverses only a few times.
    FewReversals {
        /// How often.
        reversals: usize,
    },
    /// The motion reaches up to the frequencies where only noise should be.
    SampledTooSlowly {
        /// The sample time, s.
        step: f64,
        /// The highest frequency of the motion that was found, Hz.
        band: f64,
    },
    /// The joint's mechanical time constant is hardly longer than a sample.
    FastTimeConstant {
        /// The time constant, s.
        time_constant: f64,
        /// The sample time, s.
        step: f64,
    },
    /// Motor and link do not move relative to each other.
    NoFlexibility {
        /// The root mean square of the deflection that the torque explains; 0 if it may be chance.
        deflection: f64,
        /// The root mean square of the encoders' noise in a sample of the deflection.
        noise: f64,
        /// The stiffness that a spring with this deflection would have; NaN if there is none.
        stiffness: f64,
    },
    /// The difference between motor and link is nearly all an offset of their encoders' clocks.
    StiffJoint(StiffJoint),
    /// The encoders are not sampled at the same instants.
    EncoderClocks {
        /// The time by which the link's samples are late, s.
        offset: f64,
        /// Its standard error, s.
        standard_error: f64,
    },
    /// Several effects explain the log equally well.
    Competing {
        /// Which ones.
        effects: Vec<Effect>,
    },
    /// The spring or the friction has a memory; no curve can describe this.
    Memory {
        /// Which of them.
        effect: Effect,
        /// The root mean square of the torque that a curve misses, as a share of the elastic torque's.
        share: f64,
    },
    /// The motor moves much farther than the link, much less, or in the other direction.
    DifferentAngles {
        /// The ratio of the motions.
        ratio: f64,
    },
    /// The inertia that simulates the motion is another than that of the equations.
    OtherInertia {
        /// That of the equations, kg m^2 (kg).
        equations: f64,
        /// That of the simulation.
        simulation: f64,
    },
    /// The load of the chain fits better if it counts more or less than once.
    LoadFactor {
        /// How many times it counts.
        factor: Estimated,
    },
    /// The inertia contradicts that of the chain's links.
    OtherLinks {
        /// What was found, kg m^2 (kg).
        found: Estimated,
        /// The mean inertia of the links.
        links: f64,
    },
    /// An angle goes through several turns.
    ManyTurns {
        /// The range from its smallest to its largest value.
        span: f64,
        /// Whether all its samples are whole numbers, as counts of an encoder are.
        whole: bool,
    },
    /// The torque's samples are late.
    TorqueDelay {
        /// The time from a torque's sample to its effect, s.
        delay: f64,
        /// Whether that is the half sample of a torque held from sample to sample.
        held: bool,
    },
}

impl Finding {
    /// A few words on why no result can be trusted before this is repaired; `None` if the result allows for it.
    pub fn doubt(&self) -> Option<&'static str> {
        match self {
            Finding::ClippedTorque { .. } => Some("the torque is clipped"),
            Finding::NeverReverses { .. } => Some("the joint moves in one direction only"),
            Finding::FewReversals { .. } => Some("the joint reverses too seldom"),
            Finding::SampledTooSlowly { .. } => Some("the log is sampled too slowly"),
            Finding::FastTimeConstant { .. } => Some("inertia and friction cannot be separated"),
            Finding::DifferentAngles { .. } => Some("motor and link have angles of different scales"),
            Finding::OtherInertia { .. } => Some("the motion is simulated with another inertia"),
            Finding::LoadFactor { .. } | Finding::OtherLinks { .. } => Some("the log contradicts the chain's inertias"),
            Finding::ManyTurns { whole: true, .. } => Some("an angle may be in counts of an encoder"),
            Finding::ManyTurns { .. } => Some("an angle may be in degrees"),
            _ => None,
        }
    }
}

/// A number to one decimal place, or to four digits if it is large.
fn tenths(value: f64) -> String {
    match value.abs() < 1e6 {
        true => format!("{value:.1}"),
        false => number(value),
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Finding::Competing { ref effects } => write_competing(f, effects),
            Finding::Memory { effect, share } => write_memory(f, effect, share),
            Finding::ClippedTorque { samples, value } => write!(
                f,
                "the torque stays at its extreme {} for {samples} samples: it is clipped there, and what really \
                 acted is not in the record; excite less, or widen the torque's range",
                decimal(value)
            ),
            Finding::NeverReverses { share } => write!(
                f,
                "the joint moves in one direction for {:.1} % of the time: Coulomb friction cannot be distinguished from \
                 an offset; record motions in both directions",
                100.0 * (1.0 - share)
            ),
            Finding::FewReversals { reversals } => write!(
                f,
                "the joint reverses only {}: the record is too short to determine friction well; record more \
                 motions in both directions",
                counted(reversals, "time")
            ),
            Finding::SampledTooSlowly { step, band } => write!(
                f,
                "the motion still has power above the noise at {} Hz, near the limit of {} Hz of a sample time \
                 of {} s: what happens between the samples is lost; sample faster, or excite more slowly",
                decimal(band),
                decimal(0.5 / step),
                decimal(step)
            ),
            Finding::FastTimeConstant { time_constant, step } => write!(
                f,
                "friction stops the joint within {time_constant:.3} s, less than five samples of {step} s: inertia and \
                 friction cannot be separated; sample faster"
            ),
            Finding::DifferentAngles { ratio } => write!(
                f,
                "the motor goes {ratio:.4} times as far as the link: both angles must be in rad, with the same sign, and on the same \
                 side of the gear; divide the motor's angle by the gear ratio, and multiply a torque of the motor's side by it"
            ),
            Finding::ManyTurns { span, whole: true } => write!(
                f,
                "an angle goes through {} rad in whole numbers: if these are counts of an encoder, multiply them by 2 pi / (counts in a \
                 revolution), or all inertias and stiffnesses come out too small by this factor",
                tenths(span)
            ),
            Finding::ManyTurns { span, whole: false } => write!(
                f,
                "an angle goes through {} rad, {} turns: if it is logged in degrees, multiply it by pi / 180 = 0.017453, or all \
                 inertias and stiffnesses come out too small by this factor",
                tenths(span),
                tenths(span / std::f64::consts::TAU)
            ),
            Finding::OtherInertia { equations, simulation } => write!(
                f,
                "the equations of motion give the inertia {}, and the simulation of the motion {}: the position's noise hides the \
                 acceleration, or the instants of the samples are wrong. Where only the stamps jitter, do not resample; otherwise use an encoder of higher \
                 resolution, or excite faster motions",
                number(equations),
                number(simulation)
            ),
            Finding::LoadFactor { factor } => write!(
                f,
                "gravity and the other joints fit best with {} times the torque that the chain's inertias give: check the masses of the chain, a load \
                 at its tip that it does not have, the direction of gravity, and the torque's unit and sign",
                with_error(factor.value, factor.standard_error)
            ),
            Finding::OtherLinks { found, links } => write!(
                f,
                "the inertia is {}, but the links of the chain have {} about this joint, on average: check their inertias, and the torque's \
                 unit",
                with_error(found.value, found.standard_error),
                number(links)
            ),
            Finding::NoFlexibility {
                deflection,
                noise,
                stiffness,
            } => write_no_flexibility(f, deflection, noise, stiffness),
            Finding::StiffJoint(ref stiff) => write_stiff(f, stiff),
            Finding::EncoderClocks { offset, standard_error } => write_encoder_clocks(f, offset, standard_error),
            Finding::TorqueDelay { delay, held } => write_torque_delay(f, delay, held),
        }
    }
}

fn write_stiff(f: &mut fmt::Formatter<'_>, stiff: &StiffJoint) -> fmt::Result {
    let StiffJoint {
        clock_offset,
        compliance,
        share_of_clocks,
    } = stiff;
    let side = if clock_offset.value > 0.0 { "later" } else { "earlier" };
    write!(
        f,
        "motor and link move almost as one: the link's samples are {} ms {side} than the motor's, and this time offset explains {} of the \
         difference between their angles (mean square)",
        with_error(1e3 * clock_offset.value.abs(), 1e3 * clock_offset.standard_error),
        percent(*share_of_clocks)
    )?;
    match compliance.is_positive() {
        true => write!(
            f,
            ". In addition, the joint deflects by {} rad per N m of motor torque: a stiffness of at most {:.1e} N m/rad",
            with_error(compliance.value, compliance.standard_error),
            1.0 / compliance.value
        )?,
        false => write!(f, "; no spring is seen in addition to it")?,
    }
    write!(
        f,
        ". Inertia and friction are those of motor and link together, which this log does not tell apart: excite faster motions"
    )
}

fn write_encoder_clocks(f: &mut fmt::Formatter<'_>, offset: f64, standard_error: f64) -> fmt::Result {
    let (late, error) = (milliseconds(offset), milliseconds(standard_error));
    let side = if offset > 0.0 { "later" } else { "earlier" };
    write!(
        f,
        "the link's samples are {late} (standard error {error}) {side} than the motor's; they have been shifted accordingly"
    )
}

fn write_torque_delay(f: &mut fmt::Formatter<'_>, delay: f64, held: bool) -> fmt::Result {
    let (late, side) = (milliseconds(delay), if delay > 0.0 { "after" } else { "before" });
    let hold = if held {
        ", as the mean of a torque that is held from sample to sample does"
    } else {
        ""
    };
    write!(
        f,
        "the torque acts {late} {side} its sample{hold}; it has been shifted accordingly"
    )
}

fn write_competing(f: &mut fmt::Formatter<'_>, effects: &[Effect]) -> fmt::Result {
    let names: Vec<&str> = effects.iter().map(|effect| effect.title()).collect();
    write!(
        f,
        "these explain the log equally well, alone or together: {}; none of them is a fact, and the errors of the result allow for all \
         of them. Excite faster motions, or measure the torque with less noise",
        names.join(", ")
    )
}

fn write_memory(f: &mut fmt::Formatter<'_>, effect: Effect, share: f64) -> fmt::Result {
    let (what, curve) = match effect {
        Effect::HystereticSpring => (
            "the spring has a memory (hysteresis)",
            "the elastic torque in both directions",
        ),
        _ => (
            "the friction has a memory (presliding)",
            "the friction of steady motion",
        ),
    };
    write!(
        f,
        "{what}: {} of the elastic torque, root mean square, is no function of the present state; a sum of Maxwell slip elements stands for \
         it in the equations, so that the inertias do not have to. The curve is {curve}, and a simulation with the curves alone leaves it out",
        percent(share)
    )
}

fn milliseconds(time: f64) -> String {
    format!("{:.3} ms", 1e3 * time.abs())
}

fn write_no_flexibility(f: &mut fmt::Formatter<'_>, deflection: f64, noise: f64, stiffness: f64) -> fmt::Result {
    write!(
        f,
        "no flexibility is seen: of the difference between motor and link the torque explains {} (root mean square), \
         less than three times the encoders' noise of {}, which determines no stiffness curve",
        number(deflection),
        number(noise)
    )?;
    if stiffness.is_finite() {
        write!(f, " (a spring would have about {stiffness:.1e} N m/rad)")?;
    }
    write!(
        f,
        "; the joint is taken as rigid, and its friction is that of motor and link together. Load it more, or use an encoder of higher resolution"
    )
}

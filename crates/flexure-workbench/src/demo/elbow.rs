//! The elbow alone as a chain of blocks, and the tests that refute this model.

use flexure::Record;
use flexure_io::arm::{Amplitude, ArmFile};

use crate::lines::Lines;
use crate::systems::{Decoration, Identified, arm_motion};

/// The input and the output of the elbow's model: its torque and its velocity.
pub const ELBOW_COLUMNS: [&str; 2] = ["tau2", "dq2"];
/// Time between two samples, s: sixteen in a period of the fastest sine, 3 Hz.
const SAMPLE_TIME: f64 = 0.02;
/// Why no chain of blocks holds.
const REASON: &str = "That is as it should be: friction acts on the velocity that it brakes, and the spring on the angle that it turns. Both \
                      are loops, and a chain of blocks can only come near a loop.";

/// The test of the elbow alone: the shoulder's brake holds.
pub fn elbow_alone(arm: &ArmFile) -> ArmFile {
    let mut alone = arm.clone();
    alone.arm.joints[0].locked = true;
    alone.run.sample_time = SAMPLE_TIME;
    if let Some(Amplitude::Each([_, elbow])) = alone.excitation.amplitude {
        alone.excitation.amplitude = Some(Amplitude::Each([0.0, elbow]));
    }
    alone
}

/// What the elbow's page shows in addition to the result.
pub fn elbow_decoration(arm: &ArmFile, record: &Record, identified: &Identified, command: String) -> Decoration {
    let lengths = arm.arm.links.map(|link| link.length);
    let caption = "The elbow's test, seen from above the plane of motion: the shoulder's brake holds.".to_owned();
    Decoration {
        title: Some("The elbow of a space arm as a chain of blocks: from torque to velocity".to_owned()),
        command: Some(command),
        remark: refuted(identified).then(|| REASON.to_owned()),
        arm: arm_motion(record, lengths, Some(arm.run.sample_time), caption),
        ..Decoration::default()
    }
}

/// The model of the elbow alone, and why it does not hold.
pub fn elbow_summary(identified: &Identified) -> Lines {
    let mut lines = identified.summary();
    if refuted(identified) {
        lines.note(REASON);
    }
    lines
}

fn refuted(identified: &Identified) -> bool {
    !identified.result.verdict.holds()
}

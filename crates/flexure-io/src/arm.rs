//! Arm files: an arm, its state at the start, how it is run and excited, in TOML.
//!
//! ```toml
//! [arm]
//! model = "nonlinear"          # rigid | linear | nonlinear
//! # friction, cubic, windup, coupling (S), rotor_in_link_inertia, rotors = true | false:
//! # parts of the equations; left out, they are as the model is stated in the paper.
//! [[arm.link]]                 # two
//! mass = 1.5075                # kg, positive
//! length = 4.5                 # m, positive
//! com = 2.25                   # m from the preceding joint to the centre of mass
//! inertia = 2.544              # kg m^2 about the centre of mass
//! [[arm.joint]]                # two
//! motor_inertia = 1.0          # kg m^2; flexible models
//! stiffness = 500.0            # N m/rad; linear model
//! cubic = 500.0                # a1, N m/rad^3; nonlinear model, default 0
//! linear = 500.0               # a2, N m/rad; nonlinear model
//! windup = 10.0                # ksw, N m/rad, below `linear`; nonlinear model, default 0
//! windup_sharpness = 3000.0    # asw, 1/rad^2; where there is a windup
//! damping = 0.0 # c, N m s/rad, parallel to the spring; flexible models, default 0
//! friction = [0.5, 150.0, 50.0, 2.0, 100.0, 0.5]   # g1 .. g6 at the link; left out: none
//! motor_friction = [0.0, 0.0, 0.0, 2.0, 60.0, 1.5]  # g1 .. g6 at the motor; left out: none
//! locked = false               # true: the joint stays where it starts
//! [initial]                    # all optional, default 0; rad, rad/s
//! q = [0.0, 0.0]
//! qm = [0.0, 0.0]
//! dq = [0.0, 0.0]
//! dqm = [0.0, 0.0]
//! [run]
//! duration = 10.0              # s
//! sample_time = 0.01           # s
//! rtol = 1e-9                  # default 1e-9
//! atol = 1e-12                 # default 1e-12
//! max_steps = 10000000         # integration steps before giving up; this is the default
//! [excitation]                 # see [`Excitation`] for the keys of every kind
//! kind = "white"
//! seed = 1
//! amplitude = 10.0
//! [noise]                      # optional measurement noise, Gaussian
//! seed = 1
//! std = { q1 = 1e-4 }          # standard deviation by column, in the column's unit
//! ```
//!
//! Keys that do not exist are errors. Values that the model does not use are kept but not checked,
//! so that one file serves all three models.

mod beam_table;
mod chain_file;
mod chain_tables;
mod edit;
mod error;
mod excitation;
mod file;
mod presets;
mod record;
mod run;
mod scenario;
mod values;

pub use chain_file::{ChainFile, chain_file_of_toml, chain_of_toml, is_chain};
pub use edit::with_changes;
pub use error::ArmError;
pub use excitation::{Amplitude, Distribution, DriveKind, Excitation, Kind, PhaseChoice, SweepChoice};
pub use file::{ArmFile, Noise, Run};
pub use presets::{PRESETS, preset, preset_text};
pub use record::{Paths, read_arm_record};
pub use run::{run, run_driven, run_driven_batch, run_watched};
pub use scenario::{
    Body, ControllerKind, ControllerTable, EstimatorKind, Motion, SCENARIOS, Scenario, scenario_preset_text,
    unusable_name,
};

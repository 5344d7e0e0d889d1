//! Controllers, estimators and trajectories from their tables.

use flexure::Result;
use flexure::control::controllers::{
    AdaptiveGains, Composite, CompositeGains, DirectAdaptive, Feedforward, Fuzzy, FuzzyScales, Gains, Inference,
    Linearising, Lqg, Weights,
};
use flexure::control::estimation::{KalmanFilter, NoiseModel};
use flexure::control::flexible_link::{FlexibleLink, FlexibleLinkParameters, ModelReference, ModelReferenceGains};
use flexure::control::shaping::{Mode, Shaped};
use flexure::control::{Controller, Differences, Estimator, Exact, Plant, Trajectory};
use flexure::manipulator::Arm;
use flexure_io::arm::{Body, ControllerKind, ControllerTable, EstimatorKind, Motion, Scenario};

use super::ComparedController;

/// The default rate of inverse dynamics, 1/s, and the default cut-off of differences, Hz.
const RATE: f64 = 8.0;
const CUT_OFF: f64 = 10.0;

/// The controller and the estimator of a loop.
pub struct Made {
    pub controller: Box<dyn Controller>,
    pub estimator: MadeEstimator,
    pub trajectory: Box<dyn Trajectory>,
}

/// An estimator; a filter can be asked how consistent it was.
pub enum MadeEstimator {
    Plain(Box<dyn Estimator>),
    Filter(Box<KalmanFilter>),
}

impl MadeEstimator {
    pub fn as_estimator(&mut self) -> &mut dyn Estimator {
        match self {
            MadeEstimator::Plain(estimator) => estimator.as_mut(),
            MadeEstimator::Filter(filter) => filter.as_mut(),
        }
    }

    /// NEES and NIS of the last run.
    pub fn kept(&self) -> Vec<[f64; 2]> {
        match self {
            MadeEstimator::Plain(_) => Vec::new(),
            MadeEstimator::Filter(filter) => filter.kept().to_vec(),
        }
    }
}

/// A boxed trajectory, for an input shaper.
struct Boxed(Box<dyn Trajectory>);

impl Trajectory for Boxed {
    fn at(&self, t: f64) -> [flexure::control::Jet; 2] {
        self.0.at(t)
    }

    fn end(&self) -> f64 {
        self.0.end()
    }
}

/// What moves.
pub fn plant(scenario: &Scenario) -> Result<Box<dyn Plant>> {
    Ok(match &scenario.body {
        Body::Arm { plant, .. } => Box::new(Arm::new(**plant)?),
        Body::Link { plant, .. } => Box::new(FlexibleLink::new(plant)?),
    })
}

/// Makes a controller with its estimator.
pub fn make(scenario: &Scenario, compared: &ComparedController) -> Result<Made> {
    match (compared.table, compared.own, &scenario.body) {
        (Some(table), _, Body::Arm { model, .. }) => {
            let model = Arm::new(**model)?;
            Ok(Made {
                controller: controller(table, model, scenario)?,
                estimator: estimator(table, model, scenario)?,
                trajectory: trajectory(table, model, &scenario.motion)?,
            })
        }
        (Some(table), _, Body::Link { model, .. }) => Ok(Made {
            controller: of_link(table, model)?,
            estimator: MadeEstimator::Plain(plain_estimator(table)?),
            trajectory: scenario.motion.trajectory(),
        }),
        (None, own, _) => Ok(Made {
            controller: own.map_or_else(|| Box::new(Feedforward::none(Gains::default())) as _, |make| make()),
            estimator: MadeEstimator::Plain(Box::new(Exact)),
            trajectory: scenario.motion.trajectory(),
        }),
    }
}

/// A controller of a flexible link.
fn of_link(table: &ControllerTable, model: &FlexibleLinkParameters) -> Result<Box<dyn Controller>> {
    if table.kind != ControllerKind::ModelReference {
        return Ok(Box::new(Feedforward::none(gains(table)?)));
    }
    let adapting = ModelReferenceGains::of(&FlexibleLink::new(model)?);
    let gains = match table.adaptation {
        Some(false) => adapting.fixed(),
        _ => adapting,
    };
    Ok(Box::new(ModelReference::new(gains)?))
}

fn gains(table: &ControllerTable) -> Result<Gains> {
    Gains::new(table.kp.unwrap_or_default(), table.kd.unwrap_or_default())
}

fn controller(table: &ControllerTable, model: Arm, scenario: &Scenario) -> Result<Box<dyn Controller>> {
    let scales = FuzzyScales::space_arm();
    Ok(match table.kind {
        ControllerKind::Pd => Box::new(Feedforward::none(gains(table)?)),
        ControllerKind::PdFeedforward => Box::new(Feedforward::new(model, gains(table)?)),
        ControllerKind::InverseDynamics => Box::new(Linearising::new(model, table.rate.unwrap_or(RATE))?),
        ControllerKind::Lqg => {
            let step = scenario.options.sampling.sample_time();
            Box::new(Lqg::new(model, Weights::default(), step)?.on_estimates())
        }
        ControllerKind::DirectAdaptive => Box::new(DirectAdaptive::new(&model, AdaptiveGains::space_arm())?),
        ControllerKind::CompositeAdaptive => Box::new(Composite::new(&model, CompositeGains::space_arm())?),
        ControllerKind::Mamdani => Box::new(Fuzzy::new(&model, Inference::Mamdani, scales)?),
        ControllerKind::TakagiSugeno => Box::new(Fuzzy::new(&model, Inference::TakagiSugeno, scales)?),
        ControllerKind::ModelReference => return of_link(table, &FlexibleLinkParameters::default()),
    })
}

fn estimator(table: &ControllerTable, model: Arm, scenario: &Scenario) -> Result<MadeEstimator> {
    let options = &scenario.options;
    // Rounding to counts is noise with a variance of a twelfth of their square. A filter needs some noise in any case.
    let counts = options.quantum / 12.0_f64.sqrt();
    let noise = NoiseModel {
        encoder: options.encoder_noise.hypot(counts).max(1e-9),
        torque: table.torque_noise.unwrap_or(options.torque_noise).max(1e-3),
        drift: 0.0,
        start: [options.initial_spread[0].max(1e-6), options.initial_spread[1].max(1e-6)],
    };
    Ok(MadeEstimator::Filter(Box::new(match table.estimator {
        EstimatorKind::Ekf => KalmanFilter::extended(model, noise)?.judged(),
        EstimatorKind::Ukf => KalmanFilter::unscented(model, noise)?.judged(),
        EstimatorKind::FuzzyEkf => KalmanFilter::extended(model, noise)?.adaptive().judged(),
        _ => return Ok(MadeEstimator::Plain(plain_estimator(table)?)),
    })))
}

/// An estimator without a model.
fn plain_estimator(table: &ControllerTable) -> Result<Box<dyn Estimator>> {
    let cut_off = table.cut_off.unwrap_or(CUT_OFF);
    Ok(match table.estimator {
        EstimatorKind::Differences => Box::new(Differences::new(cut_off, false)?),
        EstimatorKind::MotorDifferences => Box::new(Differences::new(cut_off, true)?),
        _ => Box::new(Exact),
    })
}

fn trajectory(table: &ControllerTable, model: Arm, motion: &Motion) -> Result<Box<dyn Trajectory>> {
    let plain = motion.trajectory();
    let Some(shaper) = table.shaper else {
        return Ok(plain);
    };
    let mode = |mode| Mode::Along {
        arm: Box::new(model),
        servo: table.kp.unwrap_or([f64::INFINITY; 2]),
        mode,
    };
    Ok(Box::new(Shaped::new(Boxed(plain), shaper, vec![mode(0), mode(1)])?))
}

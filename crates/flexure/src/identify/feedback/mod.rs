//! A static nonlinearity in a feedback loop (a nonlinear linear-fractional representation; a Lur'e system).
//!
//! $$ x_{k+1} = A x_k + B_u u_k + B_w f(z_k), \quad z_k = C_z x_k + D_{zu} u_k, \quad
//!    Y_k = C_y x_k + D_{yu} u_k + D_{yw} f(z_k) + e_k $$
//! contains every structure with one nonlinearity: friction brakes the velocity that it depends on, a spring acts on the angle that it
//! depends on. The method uses the record alone:
//!
//! | step | file |
//! |---|---|
//! | 1. linear approximations of orders 1 to 6 by the output error | `block` |
//! | 2. starts: guesses of z; f and the linear part by the equation error with B-splines of the guess | `starts` |
//! | 3. the simulation error over all parameters by Levenberg-Marquardt, with exact derivatives along the directions that change the output | `system`, `loss` |
//! | 4. the best of several orders by Schwarz's criterion; then pieces of f, kinks on very strong evidence, and whether z is the output or
//! a hidden signal | `search` |
//! | 5. a last refinement on all samples | `search` |
//! | 6. the record's units, and a unique f among all that give the same output: the input that holds z | `units` |
//!
//! A loop that runs away on any part of the record, fitted or not, is not returned. If a loop's error is far larger after a restart in the
//! middle of the record, the simplest loop without this problem replaces it.

mod limits;
mod loss;
mod search;
mod starts;
mod system;
#[cfg(test)]
mod tests;
mod units;

use super::block::{KinkedSpline, Monitor, Prepared, Scale};
use crate::error::Result;
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{
    BlockKind, Detail, FeedbackBlock, Identification, NamedBlock, Place, StructureName, Values,
};
use crate::identify::run::{Run, approximation_scores, path};
use crate::linear::autoregression::{SAMPLES_PER_COEFFICIENT, whitening};
use crate::model::FeedbackModel;
use crate::text::number;
use limits::{FARTHEST, MOST_SAMPLES};
use search::{LoopCandidate, LoopSearchResult, Search};
use system::{Entering, Loop, Observed};
use units::{Convention, InUnits, Signal};

/// The identification of a nonlinearity in a feedback loop.
///
/// ```
/// use flexure::identify::FEEDBACK;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// // A mass on a hardening spring, with a damper.
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..3000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let mut y: Vec<f64> = vec![0.0; 3000];
/// for n in 2..3000 {
///     let spring = 0.3 * y[n - 1] + 0.2 * y[n - 1].powi(3);
///     y[n] = 1.6 * y[n - 1] - 0.7 * y[n - 2] + 0.4 * (u[n - 1] - spring);
/// }
/// let result = FEEDBACK.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert!(result.fit_percent() > 99.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const FEEDBACK: Structure = Structure {
    name: StructureName {
        key: "feedback",
        title: "feedback",
    },
    description: "linear dynamics with a static nonlinearity in a feedback loop",
    inputs: 1..=1,
    options: &[],
    rank: Some(Rank::General),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a fit with a loop (besides the fresh part)")?;
    let Prepared {
        inputs, output, data, ..
    } = samples.prepared();
    let fitted = Observed::of(data.u.into_iter().next().unwrap_or_default(), data.y);
    let first = samples.fitted.saturating_sub(MOST_SAMPLES);
    let all = inputs[0].standardised(&samples.input()[first..]);
    let whole = Observed::of(all, output.standardised(&samples.y[first..]));
    let monitor = &mut Monitor::new(progress);
    let found = Search {
        data: &fitted,
        whole: &whole,
        monitor,
        tried: Vec::new(),
        seen: Vec::new(),
    }
    .run();
    monitor.finished()?;
    let LoopSearchResult {
        best,
        tried,
        approximations,
        dependence,
    } = found.unwrap_or_else(nothing);
    let in_units = |c: &LoopCandidate, may_continue: bool| {
        InUnits::new(&c.system, &fitted, [inputs[0], output], dependence, may_continue)
    };
    let Stable { best, units } = Stable::new(best, in_units, |model| stays(model, samples.input(), output))?;
    let details = details(&units, &best, &approximations, request.output);
    let block = FeedbackBlock {
        model: units.model,
        nonlinearity: units.nonlinearity,
    };
    let blocks = vec![NamedBlock::new(
        "nonlinearity",
        "Nonlinearity in the loop",
        BlockKind::Feedback(Box::new(block)),
    )];
    let path = path(request, blocks);
    let run = Run::new(&samples, path.model(0.0), vec![path], best.degrees)?;
    let errors = samples
        .y
        .iter()
        .zip(&run.predicted)
        .take(samples.fitted)
        .map(|(y, p)| y - p);
    let noise_model = whitening(&errors.collect::<Vec<_>>(), SAMPLES_PER_COEFFICIENT);
    Ok(Identification {
        order: best.system.order(),
        tried,
        details,
        noise_model: Some(noise_model),
        ..run.identification(&FEEDBACK, request)?
    })
}

/// A loop that does not run away, in the record's units.
struct Stable {
    best: LoopCandidate,
    units: InUnits,
}

impl Stable {
    /// If a loop runs away from its steady state, its nonlinearity is continued straight instead of as a cubic; if that does not help, the
    /// loop is dropped.
    fn new(
        best: LoopCandidate,
        in_units: impl Fn(&LoopCandidate, bool) -> Result<InUnits>,
        stays: impl Fn(&FeedbackModel) -> bool,
    ) -> Result<Stable> {
        for may_continue in [true, false] {
            let units = in_units(&best, may_continue)?;
            if stays(&units.model) || best.origin == NOTHING {
                return Ok(Stable { best, units });
            }
        }
        let best = nothing().best;
        let units = in_units(&best, true)?;
        Ok(Stable { best, units })
    }
}

/// The name of the start if there is no loop.
const NOTHING: &str = "nothing";

/// Whether a free run stays near the output's range.
fn stays(model: &FeedbackModel, input: &[f64], output: Scale) -> bool {
    let near = |y: &f64| (y - output.mean).abs() <= FARTHEST * output.spread;
    model.simulate(input).iter().all(near)
}

/// No loop at all: the mean.
fn nothing() -> LoopSearchResult {
    let system = Loop {
        a: vec![0.0],
        bu: vec![0.0],
        bw: vec![0.0],
        cy: vec![0.0],
        cz: vec![0.0],
        dyu: 0.0,
        dyw: 0.0,
        dzu: 1.0,
        offset: 0.0,
        spline: KinkedSpline::new(&[-1.0, 1.0]),
        correction: vec![0.0],
        initial: vec![vec![0.0]],
        entering: Entering::Hidden,
    };
    LoopSearchResult {
        best: LoopCandidate {
            system,
            squares: 0.0,
            degrees: 1,
            origin: NOTHING,
        },
        tried: Vec::new(),
        approximations: Vec::new(),
        dependence: 1.0,
    }
}

/// The details: the input of the nonlinearity, the convention for f, the range where it was seen, and the order.
fn details(units: &InUnits, best: &LoopCandidate, approximations: &[f64], output: &str) -> Vec<Detail> {
    let (key, entering) = match units.signal {
        Signal::Output => ("output", format!("'{output}', the output fed back")),
        Signal::Difference => ("difference", format!("the change of '{output}' from sample to sample")),
        Signal::Hidden => (
            "hidden",
            "a signal that is not in the record, scaled to unit variance".to_owned(),
        ),
    };
    let (convention, values, meaning) = match units.convention {
        Convention::HoldingInput => (
            "holding-input",
            "in the unit of the input",
            "its value at z is the constant input at which the entering signal rests at z",
        ),
        Convention::NoTangent => (
            "no-tangent",
            "in the unit of the output",
            "the linear part can absorb a straight line of the nonlinearity, so the data do not fix its slope. By convention it has slope 0 at \
             the median of what enters it",
        ),
    };
    let [low, high] = units.seen;
    let beyond = match best.system.spline.pieces() == 1 && best.system.spline.kinks.is_empty() {
        true => "one cubic suffices. Beyond the range it goes on for half of the range, then straight",
        false => "beyond the range it goes on straight",
    };
    let order = best.system.order();
    let orders: Vec<usize> = (1..=approximations.len()).collect();
    let scores = approximation_scores(&orders, approximations.to_vec(), order);
    let range = format!("{} to {}", number(low), number(high));
    vec![
        Detail::new("entering", key).shown(
            Place::ChoiceAndText,
            "What enters the nonlinearity",
            entering,
            "chosen by Schwarz's criterion",
        ),
        Detail::new("convention", convention).shown(
            Place::ChoiceAndText,
            "Values of the nonlinearity",
            values,
            meaning,
        ),
        Detail::new("seen", vec![Values::new([("low", low.into()), ("high", high.into())])]).shown(
            Place::ChoiceAndText,
            "Range of the nonlinearity in the data",
            range,
            beyond,
        ),
        Detail::sentence(
            Place::Choice,
            "Order",
            order.to_string(),
            "smallest value of Schwarz's criterion after refinement",
        )
        .scored(scores),
    ]
}

//! Several inputs that act jointly: one nonlinearity of all of them, then linear dynamics.
//!
//! $$ Y_n = o + G(z) z^{-s} \varphi(U^{(1)}_n, \dots, U^{(d)}_n) + e_n $$
//! the Hammerstein system of Krzyzak & Sasiadek with X of d columns (eq. (21) and theorem 2). From the record alone:
//!
//! 1. two starts. One is the paper's: the regression of $Y_{n+s}$ on $X_n$ by a kernel in d columns, at the lag where the output
//!    depends on the inputs most; it is consistent for white inputs. The other needs no white inputs: least squares over low polynomials of
//!    all inputs with one common denominator, whose numerators are one polynomial times the polynomials' coefficients (Bai 1998).
//! 2. the linear part from the start's $\varphi$ to the output: order and delay as for one input, by Schwarz's criterion on
//!    the output error.
//! 3. $\varphi$ as a tensor product of cubic B-splines with a penalty on second differences along every axis (Eilers & Marx
//!    2003), estimated through the linear part, so that its memory is not treated as noise; both blocks together by Gauss-Newton steps. The
//!    penalties maximise the marginal likelihood (Wood & Fasiolo 2017), the number of pieces minimises generalised
//!    cross-validation.
//! 4. 2 and 3 again from there, then a last fit on all samples.
//!
//! Only the product of the blocks' gains is determined: the linear part has unit static gain (if it hardly passes a constant, its input's
//! standard deviation at its output, as for the [Wiener-Hammerstein system](crate::identify::WIENER_HAMMERSTEIN)), and $\varphi$ zero mean
//! over the fit's inputs; the offset has the rest.

mod equations;
mod fit;
mod limits;
mod start;
#[cfg(test)]
mod tests;

use super::block::{Monitor, Normalised, Prepared};
use crate::error::{Error, Result};
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{
    BlockKind, Detail, Identification, LinearBlock, NamedBlock, Place, Score, StructureName, Values,
};
use crate::identify::run::{Run, path};
use crate::linear::TransferFunction;
use crate::linear::correlation::mean;
use crate::nonlinearity::{Surface, SurfaceAxis};
use crate::sort;
use crate::text::number;
use fit::{Fit, SurfaceSearch};

/// A number of pieces that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SurfaceCandidate {
    /// Pieces along every axis.
    pub pieces: usize,
    /// Their effective number of parameters under the likeliest penalty.
    pub effective_parameters: f64,
    /// RMS of the simulation error, relative to the output's standard deviation.
    pub relative_error: f64,
    /// The square root of generalised cross-validation's score, in the same unit; the smallest is chosen.
    pub score: f64,
}

/// The identification of a Hammerstein system whose nonlinearity has several inputs.
///
/// ```
/// use flexure::identify::JOINT_INPUTS;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let mut input = || -> Vec<f64> { (0..3000).map(|_| random.random_range(-1.0..1.0)).collect() };
/// let (p, q) = (input(), input());
/// let mut y = vec![0.0; 3000];
/// for n in 1..3000 {
///     y[n] = 0.6 * y[n - 1] + p[n] * q[n];
/// }
/// let record = Record::new([("p", p), ("q", q), ("y", y)])?;
/// let result = JOINT_INPUTS.identify(&record, &["p", "q"], "y")?;
/// assert_eq!((result.order, result.delay), (1, 0));
/// assert!(result.fit_percent() > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const JOINT_INPUTS: Structure = Structure {
    name: StructureName {
        key: "joint-inputs",
        title: "joint Hammerstein",
    },
    description: "two to four inputs: one static nonlinearity of all of them, then linear dynamics",
    inputs: 2..=4,
    options: &[],
    rank: Some(Rank::General),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let inputs = request.inputs;
    if !JOINT_INPUTS.inputs.contains(&inputs.len()) {
        return Err(Error::parameter(
            "the number of inputs of a joint nonlinearity",
            inputs.len() as f64,
            "2 to 4",
        ));
    }
    let samples = request.samples_of_inputs("a fit with a joint nonlinearity (besides the fresh part)")?;
    let prepared = samples.prepared();
    let mut monitor = Monitor::new(progress);
    let found = fit::find(&prepared.data, &mut monitor);
    monitor.finished()?;
    let SurfaceSearch { fit, tried } = found.unwrap_or_else(|| SurfaceSearch {
        fit: Fit::nothing(&prepared.data),
        tried: Vec::new(),
    });
    let InUnits {
        surface,
        linear,
        offset,
    } = InUnits::new(&fit, &prepared)?;
    let details = details(&surface, fit.effective, &tried);
    let blocks = vec![
        NamedBlock::new("nonlinearity", "Joint nonlinearity", BlockKind::Surface(surface)),
        NamedBlock::new("linear", "Linear part", LinearBlock::of(linear)),
    ];
    let path = path(request, blocks);
    let parameters = (fit.effective + fit.linear.count() as f64).ceil() as usize;
    let run = Run::new(&samples, path.model(offset), vec![path], parameters)?;
    Ok(Identification {
        output_offset: offset,
        tried: tried.iter().map(Values::from).collect(),
        details,
        ..run.identification(&JOINT_INPUTS, request)?
    })
}

/// The surface's pieces, and their effective number of parameters.
fn details(surface: &Surface, effective: f64, tried: &[SurfaceCandidate]) -> Vec<Detail> {
    let pieces: Vec<String> = surface.axes().iter().map(|a| a.pieces.to_string()).collect();
    let why = "smallest generalised cross-validation score; the penalty on its bending, one for every input, maximises the marginal likelihood";
    let text = format!("{} pieces", pieces.join(" by "));
    let scores = scores(tried, surface.axes()[0].pieces);
    vec![
        Detail::new("effective_parameters", effective).shown(
            Place::Fact,
            "Parameters",
            number(effective),
            "that the nonlinearity is worth under its penalty",
        ),
        Detail::sentence(Place::Choice, "Nonlinearity", text, why).scored(Some(scores)),
    ]
}

impl From<&SurfaceCandidate> for Values {
    fn from(t: &SurfaceCandidate) -> Self {
        Values::new([
            ("pieces", t.pieces.into()),
            ("effective_parameters", t.effective_parameters.into()),
            ("relative_error", t.relative_error.into()),
            ("score", t.score.into()),
        ])
    }
}

/// The scores by the number of pieces, each once.
fn scores(tried: &[SurfaceCandidate], chosen: usize) -> Score {
    let mut tried = tried.to_vec();
    sort::by_key(&mut tried, |t| t.pieces as f64);
    tried.dedup_by_key(|t| t.pieces);
    let (pieces, scores): (Vec<usize>, Vec<f64>) = tried.iter().map(|t| (t.pieces, t.score)).unzip();
    let labels = [
        "pieces along every input",
        "relative error, by generalised cross-validation",
    ];
    Score {
        logarithmic: true,
        ..Score::of_numbers(labels, &pieces, scores, chosen)
    }
}

/// The blocks in the record's units and the conventional scale.
struct InUnits {
    surface: Surface,
    linear: TransferFunction,
    offset: f64,
}

impl InUnits {
    fn new(fit: &Fit, prepared: &Prepared) -> Result<InUnits> {
        let data = &prepared.data;
        let through = fit.inner(data);
        let Normalised { linear, gain } = Normalised::new(&fit.linear, fit.delay, &through, data.from)?;
        let level = mean(&through);
        let scale = prepared.output.spread * gain;
        let axes = fit.surface.axes().iter().zip(&prepared.inputs);
        let axes = axes.map(|(axis, unit)| SurfaceAxis {
            low: unit.back(axis.low),
            high: unit.back(axis.high),
            pieces: axis.pieces,
        });
        let scaled = fit.surface.affine(scale, -scale * level);
        let fixed = linear.static_gain();
        let through = if fixed.is_finite() { fixed * scale * level } else { 0.0 };
        Ok(InUnits {
            surface: Surface::new(axes.collect(), scaled.coefficients().to_vec())?,
            linear,
            offset: prepared.output.back(fit.offset) + through,
        })
    }
}

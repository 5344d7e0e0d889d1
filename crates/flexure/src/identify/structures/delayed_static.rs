//! A static nonlinearity of the delayed input, without dynamics:
//! $$ Y_n = f(U_{n-s}) + e_n $$
//! with f a cubic smoothing spline (Reinsch 1967) whose penalty minimises the leave-one-out error, and s the delay of 0 to 20
//! samples with the smallest score of generalised cross-validation (Craven and Wahba 1979).

use crate::error::{Error, Result};
use crate::identify::request::{Progress, Request, Structure};
use crate::identify::result::{
    BlockKind, Detail, Identification, LinearBlock, NamedBlock, Place, Score, StaticBlock, StructureName,
};
use crate::identify::run::{Run, announce, path};
use crate::linear::TransferFunction;
use crate::nonlinearity::{Estimator, Outside, Regression, SplineFit, SplineRegression, tabulate};

/// The largest delay that is tried, samples.
const LARGEST_DELAY: usize = 20;

/// The identification of a static nonlinearity of the delayed input.
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "static",
        title: "static",
    },
    description: "a static nonlinearity of the delayed input, without dynamics",
    inputs: 1..=1,
    options: &[],
    rank: None,
    identify,
};

/// The fit at one delay.
struct DelayedFit {
    delay: usize,
    spline: SplineFit,
    score: f64,
}

impl DelayedFit {
    fn new(u: &[f64], y: &[f64], delay: usize) -> Result<Self> {
        let (u, y) = (&u[..u.len() - delay], &y[delay..]);
        let spline = SplineRegression::default().fit(&[u], y, None)?;
        let errors = y.iter().zip(spline.predict(&[u])?).map(|(y, p)| (y - p).powi(2));
        let n = y.len() as f64;
        let score = errors.sum::<f64>() / n / (1.0 - spline.degrees_of_freedom() / n).powi(2);
        Ok(DelayedFit { delay, spline, score })
    }
}

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a static fit (besides the fresh part)")?;
    announce("comparing delays", progress)?;
    let (u, y) = (&samples.input()[..samples.fitted], &samples.y[..samples.fitted]);
    let fits = (0..=LARGEST_DELAY).map(|delay| DelayedFit::new(u, y, delay));
    let fits: Vec<DelayedFit> = fits.collect::<Result<_>>()?;
    let best = fits.iter().min_by(|a, b| a.score.total_cmp(&b.score));
    let best = best.ok_or_else(|| Error::too_short("a static fit", 1, 0))?;

    let shift = TransferFunction::new([vec![0.0; best.delay], vec![1.0]].concat(), vec![1.0])?;
    let curve = tabulate(&best.spline, u, Outside::Linear)?.curve;
    let nonlinearity = BlockKind::Static(StaticBlock::new(curve, "smoothing spline"));
    let blocks = vec![
        NamedBlock::new("linear", "Delay", LinearBlock::of(shift)),
        NamedBlock::new("nonlinearity", "Nonlinearity", nonlinearity),
    ];
    let path = path(request, blocks);
    // The delay counts as one parameter.
    let parameters = best.spline.degrees_of_freedom().ceil() as usize + 1;
    let run = Run::new(&samples, path.model(0.0), vec![path], parameters)?;
    Ok(Identification {
        method: "smoothing-spline".into(),
        details: vec![delay_detail(&fits, best.delay)],
        ..run.identification(&ROW, request)?
    })
}

/// The scores by delay, in JSON, in the model file and as a picture on the page.
fn delay_detail(fits: &[DelayedFit], chosen: usize) -> Detail {
    let (delays, scores): (Vec<usize>, Vec<f64>) = fits.iter().map(|f| (f.delay, f.score)).unzip();
    let why = "smallest score of generalised cross-validation";
    let labels = ["delay, samples", "score of generalised cross-validation"];
    Detail::new("delay_scores", scores.clone())
        .shown(Place::Choice, "Delay", format!("{chosen} samples"), why)
        .scored(Some(Score::of_numbers(labels, &delays, scores, chosen)))
}

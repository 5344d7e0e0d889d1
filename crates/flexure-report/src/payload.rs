//! The numbers behind the plots, as the page's scripts read them.

use serde::Serialize;

use crate::data::{
    Approximation, ArmMotion, Axis, Choice, LinearPart, Nonlinearity, Page, Prediction, Residuals, ScoreCurve, Signal,
};
use crate::decimate::{bucket, head, min_max, thin};
use crate::limits;
use crate::regression::{SurfacePlot, surface};

/// Everything that is plotted; a part without data is `None` and has no place on the page.
#[derive(Serialize)]
pub(crate) struct Payload<'a> {
    pub nonlinearity: Option<NonlinearityPlot>,
    pub surface: Option<SurfacePlot<'a>>,
    pub curves: Vec<NonlinearityPlot>,
    pub approximation: Option<Approximation>,
    pub linear: Vec<LinearPart>,
    pub prediction: Option<PredictionPlot<'a>>,
    pub residuals: ResidualPlot<'a>,
    pub scores: Vec<Option<ScoreCurve>>,
    pub record: Option<RecordPlot<'a>>,
    pub arm: Option<ArmMotion>,
}

/// An evenly spaced grid as the plots need it.
#[derive(Serialize)]
pub(crate) struct Grid {
    label: String,
    start: f64,
    step: f64,
    count: usize,
    /// Samples per bucket; 1 if nothing was left out.
    pub bucket: usize,
}

#[derive(Serialize)]
pub(crate) struct NonlinearityPlot {
    #[serde(flatten)]
    curve: Nonlinearity,
    /// Whether the estimate's points are drawn in addition to the line through them.
    pub points: bool,
}

#[derive(Serialize)]
pub(crate) struct PredictionPlot<'a> {
    pub time: Grid,
    /// What the legend calls the measured signal and the computed one.
    pub names: [&'static str; 2],
    y_label: &'a str,
    measured: Vec<f64>,
    predicted: Vec<f64>,
    error: Vec<f64>,
}

#[derive(Serialize)]
pub(crate) struct ResidualPlot<'a> {
    autocorrelation: Vec<f64>,
    cross_correlation: Vec<f64>,
    cross_lags: Vec<f64>,
    limit: f64,
    cross_limit: f64,
    level: &'a str,
}

#[derive(Serialize)]
pub(crate) struct RecordPlot<'a> {
    pub time: Grid,
    /// Time of the first fresh sample, or none if all or none were used.
    fresh_from: Option<f64>,
    signals: Vec<SignalPlot<'a>>,
}

#[derive(Serialize)]
struct SignalPlot<'a> {
    name: &'a str,
    label: String,
    values: Vec<f64>,
}

/// Reduces a checked page to what its plots need.
pub(crate) fn payload(page: &Page) -> Payload<'_> {
    Payload {
        nonlinearity: (!page.nonlinearity.x.is_empty()).then(|| nonlinearity(&page.nonlinearity)),
        surface: page.surface.as_ref().and_then(|titled| surface(&titled.surface)),
        curves: page.curves.iter().map(|c| nonlinearity(&c.curve)).collect(),
        approximation: page
            .approximation
            .as_ref()
            .filter(|a| !a.frequency.is_empty())
            .map(approximation),
        linear: page.linear.iter().map(linear).collect(),
        prediction: (!page.prediction.measured.is_empty()).then(|| prediction(&page.prediction)),
        residuals: residuals(&page.residuals),
        scores: page.choices.iter().map(score).collect(),
        record: record(&page.record, &page.time, page.fresh_from),
        arm: page.arm.as_ref().filter(|arm| arm.q[0].len() > 1).map(arm),
    }
}

/// A name with its unit in parentheses, as axes carry it.
pub(crate) fn label(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_owned()
    } else {
        format!("{name} ({unit})")
    }
}

fn grid(axis: &Axis, bucket: usize, stride: f64, count: usize) -> Grid {
    Grid {
        label: label(&axis.name, &axis.unit),
        start: axis.start,
        step: axis.step * stride,
        count,
        bucket,
    }
}

/// A curve reduced to what is drawn of it.
pub(crate) fn nonlinearity(n: &Nonlinearity) -> NonlinearityPlot {
    let thin = |v: &[f64]| thin(v, limits::CURVE_POINTS);
    let points = n.x.len() <= limits::FEW_POINTS;
    NonlinearityPlot {
        points,
        curve: Nonlinearity {
            x: thin(&n.x),
            y: thin(&n.y),
            lower: thin(&n.lower),
            upper: thin(&n.upper),
            // There are no data between levels; a density curve through the levels would hide this.
            density: if points { Vec::new() } else { thin(&n.density) },
            truth: thin(&n.truth),
            x_label: n.x_label.clone(),
            y_label: n.y_label.clone(),
            band_label: n.band_label.clone(),
            truth_label: n.truth_label.clone(),
        },
    }
}

fn approximation(a: &Approximation) -> Approximation {
    let thin = |v: &[f64]| thin(v, limits::CURVE_POINTS);
    Approximation {
        text: a.text.clone(),
        frequency_unit: a.frequency_unit.clone(),
        frequency: thin(&a.frequency),
        magnitude_db: thin(&a.magnitude_db),
        phase_deg: thin(&a.phase_deg),
        total_db: thin(&a.total_db),
        noise_db: thin(&a.noise_db),
        distortion_db: thin(&a.distortion_db),
    }
}

fn linear(l: &LinearPart) -> LinearPart {
    // A logarithmic frequency axis has no place for 0.
    let positive = l.frequency.partition_point(|&f| f <= 0.0);
    let thin = |v: &[f64]| thin(&v[positive..], limits::CURVE_POINTS);
    let errors = |v: &[f64]| if v.is_empty() { Vec::new() } else { thin(v) };
    let rounded = |v: &[f64]| head(v, limits::LAGS);
    LinearPart {
        title: l.title.clone(),
        text: l.text.clone(),
        b: l.b.clone(),
        a: l.a.clone(),
        sample_time: l.sample_time,
        impulse: rounded(&l.impulse),
        response_unit: l.response_unit.clone(),
        impulse_estimate: rounded(&l.impulse_estimate),
        impulse_limit: l.impulse_limit,
        frequency: thin(&l.frequency),
        frequency_unit: l.frequency_unit.clone(),
        magnitude_db: thin(&l.magnitude_db),
        phase_deg: thin(&l.phase_deg),
        magnitude_error: errors(&l.magnitude_error),
        phase_error: errors(&l.phase_error),
        poles: l.poles.clone(),
        pole_covariances: l.pole_covariances.clone(),
        zeros: l.zeros.clone(),
    }
}

/// A measured signal against a computed one, reduced to what is drawn.
pub(crate) fn prediction(p: &Prediction) -> PredictionPlot<'_> {
    let bucket = bucket(p.measured.len(), limits::PREDICTION_POINTS);
    let error: Vec<f64> = p.measured.iter().zip(&p.predicted).map(|(y, yh)| y - yh).collect();
    let measured = min_max(&p.measured, bucket);
    PredictionPlot {
        names: ["measured", "predicted"],
        time: grid(&p.time, bucket, measured.stride, measured.values.len()),
        y_label: &p.y_label,
        measured: measured.values,
        predicted: min_max(&p.predicted, bucket).values,
        error: min_max(&error, bucket).values,
    }
}

fn residuals(r: &Residuals) -> ResidualPlot<'_> {
    ResidualPlot {
        autocorrelation: head(&r.autocorrelation, limits::LAGS),
        cross_correlation: head(&r.cross_correlation, limits::LAGS),
        cross_lags: head(&r.cross_lags, limits::LAGS),
        limit: r.limit,
        cross_limit: r.cross_limit,
        level: &r.level,
    }
}

/// A score curve reduced to what is drawn of it; none with a single candidate.
pub(crate) fn score(choice: &Choice) -> Option<ScoreCurve> {
    let curve = choice.curve.as_ref().filter(|c| c.x.len() > 1)?;
    Some(ScoreCurve {
        x: thin(&curve.x, limits::CURVE_POINTS),
        y: thin(&curve.y, limits::CURVE_POINTS),
        x_label: curve.x_label.clone(),
        y_label: curve.y_label.clone(),
        ..*curve
    })
}

/// The signals of a record, reduced to what is drawn; those from `fresh_from` on are shaded.
pub(crate) fn record<'a>(signals: &'a [Signal], time: &Axis, fresh_from: usize) -> Option<RecordPlot<'a>> {
    let n = signals.first()?.values.len();
    if n == 0 {
        return None;
    }
    let limit = (limits::RECORD_POINTS / signals.len()).clamp(1_000, limits::SIGNAL_POINTS);
    let bucket = bucket(n, limit);
    let stride = if bucket == 1 { 1.0 } else { bucket as f64 / 2.0 };
    let count = if bucket == 1 { n } else { 2 * n.div_ceil(bucket) };
    Some(RecordPlot {
        time: grid(time, bucket, stride, count),
        fresh_from: (fresh_from > 0 && fresh_from < n).then_some(time.start + fresh_from as f64 * time.step),
        signals: signals
            .iter()
            .map(|signal| SignalPlot {
                name: &signal.name,
                label: label(&signal.name, &signal.unit),
                values: min_max(&signal.values, bucket).values,
            })
            .collect(),
    })
}

/// The beginning of a motion, as much as the page carries.
pub(crate) fn arm(arm: &ArmMotion) -> ArmMotion {
    let cut = |pair: &[Vec<f64>; 2]| [head(&pair[0], limits::ARM_SAMPLES), head(&pair[1], limits::ARM_SAMPLES)];
    ArmMotion {
        caption: arm.caption.clone(),
        lengths: arm.lengths,
        time: arm.time.clone(),
        q: cut(&arm.q),
        qm: cut(&arm.qm),
        tau: cut(&arm.tau),
    }
}

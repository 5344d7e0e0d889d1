//! The blocks of an identification as the page draws them.

use anyhow::Result;
use flexure::Record;
use flexure::identify::VolterraModel;
use flexure::identify::result::{BlockKind, LinearBlock, NamedBlock, Path, ResponseError, StaticBlock};
use flexure::linear::{Complex, TransferFunction};
use flexure::quantiles::NORMAL_95;
use flexure::text::{capitalised, number};
use flexure_report::data::{LinearPart, Nonlinearity, Scatter, Surface, Table, TitledCurve, TitledSurface};

use super::closed_loop;
use super::terms::terms;
use crate::labels::Labels;
use crate::plots::{evenly, median, unwrapped};
use crate::systems::SETTLED;
use crate::systems::json::parts;
use crate::systems::poles::is_determined;
use crate::systems::summary::{determined, linear_text};
use crate::systems::task::Identified;

/// Frequencies of the Bode plot.
const FREQUENCIES: usize = 400;
/// Decades below the highest frequency that the Bode plot covers.
const DECADES: f64 = 3.0;
/// The fewest values of the impulse response that are shown.
const SHORTEST_IMPULSE: usize = 20;
/// The most values that are shown of a response that has not settled and for which no estimate exists.
const LONGEST_IMPULSE: usize = 300;
/// Bins of the histogram of a nonlinearity's input.
const BINS: usize = 50;
/// Points of a surface's picture along either side, and points of a section through it.
const GRID: usize = 81;
const SECTION_POINTS: usize = 201;

/// The parts of a page that show blocks.
#[derive(Default)]
pub(super) struct Drawn {
    pub nonlinearity: Nonlinearity,
    pub curves: Vec<TitledCurve>,
    pub surface: Option<TitledSurface>,
    pub linear: Vec<LinearPart>,
    pub tables: Vec<Table>,
}

/// Draws all blocks; the first nonlinearity has the page's main picture.
pub(super) fn drawn(record: &Record, identified: &Identified) -> Result<Drawn> {
    let result = &identified.result;
    let mut drawing = Drawing {
        identified,
        // The data whose density is drawn behind the curves.
        shown: match identified.is_other_record {
            true => record.len(),
            false => result.fitted,
        },
        drawn: Drawn::default(),
        curves: Vec::new(),
    };
    for (i, path) in result.paths.iter().enumerate() {
        let inputs: Vec<&[f64]> = (path.inputs.iter())
            .map(|input| record.finite(input))
            .collect::<flexure::Result<_>>()?;
        let mut entering: Vec<f64> = inputs.first().map_or_else(Vec::new, |u| u.to_vec());
        for (k, block) in path.blocks.iter().enumerate() {
            let title = match result.is_sum {
                true => format!("{}: {}", capitalised(&result.path_title(i)), block.title.to_lowercase()),
                false => block.title.clone().into_owned(),
            };
            entering = drawing.block(path, k, title, &inputs, entering)?;
        }
    }
    let Drawing { mut drawn, curves, .. } = drawing;
    let mut curves = curves.into_iter();
    drawn.nonlinearity = curves.next().map_or_else(Nonlinearity::default, |first| first.curve);
    drawn.curves.extend(curves);
    Ok(drawn)
}

/// A page's blocks while they are drawn, one after the other.
struct Drawing<'a> {
    identified: &'a Identified,
    /// How many samples are drawn behind the curves.
    shown: usize,
    drawn: Drawn,
    /// The curves of the static blocks.
    curves: Vec<TitledCurve>,
}

impl Drawing<'_> {
    /// Draws block `k` of `path` with its input signal `entering` (a block of several inputs: `inputs`). Returns its output.
    fn block(
        &mut self,
        path: &Path,
        k: usize,
        title: String,
        inputs: &[&[f64]],
        entering: Vec<f64>,
    ) -> Result<Vec<f64>> {
        let identified = self.identified;
        let block = &path.blocks[k];
        Ok(match &block.kind {
            BlockKind::Static(own) => {
                if !block.between_samples {
                    let labels = [behind(&identified.labels, path, k), leaving(identified, path, k)];
                    let curve = curve(own, labels, &entering[..self.shown]);
                    self.curves.push(TitledCurve { title, curve });
                    return Ok(entering.iter().map(|&u| own.curve.value(u)).collect());
                }
                entering
            }
            BlockKind::Feedback(own) => {
                let run = own.model.run(&entering);
                let curve = curve(
                    &own.nonlinearity,
                    closed_loop::labels(identified),
                    &run.entering[..self.shown],
                );
                self.curves.push(TitledCurve { title, curve });
                self.drawn
                    .linear
                    .extend(closed_loop::whole(own, identified.sample_time));
                self.drawn
                    .tables
                    .extend(closed_loop::alone(own, identified.sample_time));
                run.output
            }
            BlockKind::Linear(own) => {
                self.drawn.linear.push(LinearPart {
                    response_unit: response_unit(identified, path, k),
                    ..linear(&title, own, identified.sample_time)
                });
                own.system.simulate_from_mean(&entering)
            }
            BlockKind::Surface(surface) => {
                let fitted: Vec<&[f64]> = inputs.iter().map(|u| &u[..self.shown]).collect();
                let sections = Sections::new(surface, &identified.labels, &path.inputs, &fitted);
                self.drawn.surface = Some(sections.picture(&block.title));
                (self.drawn.curves).extend((0..inputs.len()).map(|along| sections.along(along)));
                surface.values(inputs)
            }
            BlockKind::Narx(model) => {
                self.drawn.tables.push(terms(&identified.result, model));
                entering
            }
            BlockKind::Volterra(model) => {
                (self.drawn.linear).extend(first_kernel(model, identified.sample_time)?);
                self.drawn.surface = second_kernel(identified, model);
                entering
            }
        })
    }
}

/// A static gain within this distance of 1 is 1.
const UNIT_GAIN: f64 = 1e-9;

/// The name of the signal that enters the block of this index.
fn behind(labels: &Labels, path: &Path, index: usize) -> String {
    match index.checked_sub(1).and_then(|i| path.blocks.get(i)) {
        None => labels.of_all(&path.inputs),
        Some(before) => format!("intermediate signal, behind the {}", before.title.to_lowercase()),
    }
}

/// The name of the signal that leaves the block of this index. At a constant input it is the output itself, if only a linear part of
/// static gain 1 follows.
fn leaving(identified: &Identified, path: &Path, index: usize) -> String {
    let result = &identified.result;
    let after: Vec<&NamedBlock> = path.main().skip(index + 1).collect();
    let keeps = |g: &LinearBlock| (g.system.static_gain() - 1.0).abs() < UNIT_GAIN;
    match (result.is_sum || result.output_offset != 0.0, &after[..]) {
        (false, []) => identified.labels.of(&result.output),
        (false, [only]) if only.linear().is_some_and(keeps) => {
            format!("steady {}", identified.labels.of(&result.output))
        }
        _ => "output of the nonlinearity".to_owned(),
    }
}

/// The unit of the response of the linear block of this index: a column without a unit is named, and a signal between two blocks has its
/// own unit.
fn response_unit(identified: &Identified, path: &Path, index: usize) -> String {
    let unit = |column: &str| match identified.labels.unit(column) {
        "" => format!("'{column}'"),
        unit => unit.to_owned(),
    };
    let between = || "intermediate unit".to_owned();
    let is_first = index == 0 || path.blocks[index].between_samples && index == path.main().count();
    let entering = match &path.inputs[..] {
        [input] if is_first => unit(input),
        _ => between(),
    };
    let is_last = index + 1 == path.main().count() || index + 1 == path.blocks.len();
    let leaving = match is_last {
        true => unit(&identified.result.output),
        false => between(),
    };
    format!("{leaving} per {entering}")
}

fn curve(block: &StaticBlock, [x_label, y_label]: [String; 2], entering: &[f64]) -> Nonlinearity {
    let x = block.curve.x().to_vec();
    Nonlinearity {
        x_label,
        y_label,
        y: block.curve.y().to_vec(),
        lower: block.band_edge(-1.0),
        upper: block.band_edge(1.0),
        band_label: block.band_label.to_owned(),
        density: density(entering, &x),
        x,
        ..Nonlinearity::default()
    }
}

/// Histogram density of `u` in bins as wide as a fiftieth of the range, at the points `x`.
fn density(u: &[f64], x: &[f64]) -> Vec<f64> {
    let (low, high) = (x[0], x[x.len() - 1]);
    let width = (high - low) / BINS as f64;
    if !(width > 0.0) {
        return Vec::new();
    }
    let bin = |v: f64| (((v - low) / width).max(0.0) as usize).min(BINS - 1);
    let mut counts = [0.0; BINS];
    u.iter().for_each(|&v| counts[bin(v)] += 1.0);
    x.iter().map(|&v| counts[bin(v)] / (u.len() as f64 * width)).collect()
}

/// A linear part, with its estimated impulse response if there is one.
pub(super) fn linear(title: &str, block: &LinearBlock, sample_time: Option<f64>) -> LinearPart {
    let estimate = block.impulse.as_ref();
    let mut part = linear_part(title, &block.system, estimate.map(|e| e.values.len()), sample_time);
    part.text = format!("{}.", capitalised(&linear_text(block, sample_time)));
    if let Some(estimate) = estimate {
        part.impulse_estimate.clone_from(&estimate.values);
        part.impulse_limit = estimate.limit;
    }
    show_confidence(block, &mut part);
    part
}

/// The bands of the frequency response where the covariance of the coefficients is known, and the regions of the poles that it determines.
fn show_confidence(block: &LinearBlock, part: &mut LinearPart) {
    if block
        .errors
        .as_ref()
        .is_some_and(|errors| !determined(&block.system, errors))
    {
        return;
    }
    let errors = shares().map(|share| block.response_error(std::f64::consts::PI * share));
    let Some(errors) = errors.collect::<Option<Vec<ResponseError>>>() else {
        return;
    };
    let decibels = NORMAL_95 * 20.0 / std::f64::consts::LN_10;
    part.magnitude_error = errors.iter().map(|e| decibels * e.log_magnitude).collect();
    part.phase_error = errors.iter().map(|e| (NORMAL_95 * e.phase).to_degrees()).collect();
    let covariance = |[re, im]: &[f64; 2]| {
        let pole = Complex::new(*re, *im);
        let found = block.pole_covariance(pole).filter(|c| is_determined(pole, c));
        found.map_or([f64::NAN; 3], |c| [c.real, c.both, c.imaginary])
    };
    part.pole_covariances = part.poles.iter().map(covariance).collect();
}

/// The frequencies of the Bode plot as shares of the highest one.
fn shares() -> impl Iterator<Item = f64> {
    (0..FREQUENCIES).map(|i| 10.0_f64.powf(DECADES * (i as f64 / (FREQUENCIES - 1) as f64 - 1.0)))
}

/// A transfer function; the impulse response has at least `shown` values, or as many as it needs to settle.
fn linear_part(title: &str, system: &TransferFunction, shown: Option<usize>, sample_time: Option<f64>) -> LinearPart {
    let (highest, frequency_unit) = match sample_time {
        Some(step) => (0.5 / step, "Hz"),
        None => (0.5, "cycles/sample"),
    };
    // A long delay must not push the response out of the picture.
    let delay = system.b().iter().take_while(|&&b| b == 0.0).count();
    let shown = shown.unwrap_or_else(|| system.settling(SETTLED).min(LONGEST_IMPULSE + delay));
    let response = shares().map(|s| system.frequency_response(std::f64::consts::PI * s));
    let response: Vec<Complex<f64>> = response.collect();
    LinearPart {
        title: title.to_owned(),
        b: system.b().to_vec(),
        a: system.a().to_vec(),
        sample_time,
        impulse: system.impulse_response(shown.max(SHORTEST_IMPULSE + delay)),
        frequency: shares().map(|s| highest * s).collect(),
        frequency_unit: frequency_unit.to_owned(),
        magnitude_db: response.iter().map(|g| 20.0 * g.norm().log10()).collect(),
        phase_deg: unwrapped(response.iter().map(|g| g.arg().to_degrees())),
        poles: parts(system.poles()),
        zeros: parts(system.zeros()),
        ..LinearPart::default()
    }
}

/// A surface and the places of the other inputs in sections through it: their medians.
struct Sections<'a> {
    surface: &'a flexure::nonlinearity::Surface,
    labels: &'a Labels,
    names: &'a [String],
    inputs: &'a [&'a [f64]],
    middle: Vec<f64>,
}

impl<'a> Sections<'a> {
    fn new(
        surface: &'a flexure::nonlinearity::Surface,
        labels: &'a Labels,
        names: &'a [String],
        inputs: &'a [&'a [f64]],
    ) -> Self {
        let middle = inputs.iter().map(|u| median(u.iter().copied())).collect();
        Sections {
            surface,
            labels,
            names,
            inputs,
            middle,
        }
    }

    /// The places of the inputs that are not shown.
    fn others(&self, shown: &[usize]) -> String {
        let kept = (0..self.names.len()).filter(|i| !shown.contains(i));
        let places: Vec<String> = kept
            .map(|i| format!("{} = {}", self.names[i], number(self.middle[i])))
            .collect();
        places.join(", ")
    }

    /// The surface over the first two inputs.
    fn picture(&self, title: &str) -> TitledSurface {
        let axes = self.surface.axes();
        let [x, y] = [axes[0], axes[1]].map(|axis| evenly([axis.low, axis.high], GRID));
        let mut at = self.middle.clone();
        let mut z = Vec::with_capacity(x.len() * y.len());
        for b in &y {
            for a in &x {
                (at[0], at[1]) = (*a, *b);
                z.push(self.surface.value(&at));
            }
        }
        let kept = match self.names.len() {
            2 => String::new(),
            _ => format!(" The other inputs stay at their medians: {}.", self.others(&[0, 1])),
        };
        TitledSurface {
            title: title.to_owned(),
            text: format!(
                "The estimate as colours with contours; the dots are the data: where there are few, trust it less. Beyond their range \
                 the model keeps the value at the edge.{kept}"
            ),
            surface: Surface {
                x_label: self.labels.of(&self.names[0]),
                y_label: self.labels.of(&self.names[1]),
                z_label: "output of the nonlinearity".to_owned(),
                x,
                y,
                z,
                points: Scatter::new(self.inputs[0], self.inputs[1]),
            },
        }
    }

    /// The curve along one input while the others stay at their medians.
    fn along(&self, along: usize) -> TitledCurve {
        let axis = self.surface.axes()[along];
        let x = evenly([axis.low, axis.high], SECTION_POINTS);
        let mut at = self.middle.clone();
        let value = |x: &f64| {
            at[along] = *x;
            self.surface.value(&at)
        };
        TitledCurve {
            title: format!("Along {} at {}", self.names[along], self.others(&[along])),
            curve: Nonlinearity {
                x_label: self.labels.of(&self.names[along]),
                y_label: "output of the nonlinearity".to_owned(),
                y: x.iter().map(value).collect(),
                density: density(self.inputs[along], &x),
                x,
                ..Nonlinearity::default()
            },
        }
    }
}

/// The kernel of first order as an impulse response.
fn first_kernel(model: &VolterraModel, sample_time: Option<f64>) -> Result<Option<LinearPart>> {
    if model.first.is_empty() {
        return Ok(None);
    }
    let delayed = std::iter::repeat_n(0.0, model.delay).chain(model.first.iter().copied());
    let system = TransferFunction::new(delayed.collect(), vec![1.0])?;
    Ok(Some(LinearPart {
        text: "The response to small deviations of the input from its mean.".to_owned(),
        // A formula with one coefficient per lag would be unreadable.
        b: Vec::new(),
        zeros: Vec::new(),
        ..linear_part("First-order kernel", &system, None, sample_time)
    }))
}

/// The kernel of second order over both lags.
fn second_kernel(identified: &Identified, model: &VolterraModel) -> Option<TitledSurface> {
    let lags: Vec<f64> = (0..model.second_memory).map(|i| (model.delay + i) as f64).collect();
    (lags.len() > 1).then(|| TitledSurface {
        title: "Second-order kernel".to_owned(),
        text: "What the product of the input's deviations at two lags adds to the output; symmetric. A Hammerstein system has all of it \
                on the diagonal, a Wiener system has it in proportion to the product of its impulse response at both lags."
            .to_owned(),
        surface: Surface {
            x_label: "first lag (samples)".to_owned(),
            y_label: "second lag (samples)".to_owned(),
            z_label: format!("second-order kernel of {}", identified.labels.of(&identified.result.output)),
            x: lags.clone(),
            y: lags,
            z: model.second.clone(),
            points: Scatter::default(),
        },
    })
}

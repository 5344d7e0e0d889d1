//! From a fitted form to its parameters: which of them the data determine, and how far the form is from the free curve.

use super::form_fit::FormFit;
use super::forms::{FormName, ShapeParameters, Term};
use super::free_outcome::FreeOutcome;
use super::lack_of_fit::Departure;
use super::layout::FormParameter;
use super::limits::{ALIKE, COLLINEAR, FAR, FARTHEST, LARGEST_ERROR};
use super::normal::Covariance;
use super::outcome::{Estimated, Fitted, LackOfFit, Parameter};
use super::system::Curve;
use crate::quantiles::NORMAL_95;

/// The factors that are positive in every joint: of friction, which opposes motion, and of springs, which oppose deflection.
const PASSIVE: [&str; 6] = ["Fc", "Fv", "Fs", "g4", "g6", "a2"];
/// Why a parameter is not identifiable.
const FITS_AS_WELL: &str = "values far from each other fit these data as well";

/// Schwarz's criterion of a form that replaces one of the free curves.
///
/// The errors may differ from the weights. The decrease of the sum of squares by chance then has another mean, and the sum of squares of
/// the form is corrected to the value that it would have with errors that agree with the weights.
fn schwarz(fit: &FormFit, free: &FreeOutcome) -> f64 {
    let (form, taken, free) = (&fit.solution, free.taken, &free.solved.solution);
    let [of_form, of_free] = [form, free].map(|solution| solution.x.len() as f64);
    let observations = 2.0 * form.lines() as f64;
    let extra = (of_free - of_form).max(1.0);
    let remaining = (observations - of_free).max(1.0);
    // At least the value for errors that agree with the weights.
    let mean = (taken - fit.taken).max(extra * free.squares / remaining);
    let statistic = (form.objective - free.objective).max(0.0) / mean;
    let squares = free.squares * (1.0 + statistic * extra / remaining);
    observations * (squares / observations).ln() + of_form * observations.ln()
}

/// Takes the test of a form from a fit in which fewer curves have forms.
pub(super) fn retest(form: &mut Fitted, fit: &FormFit) {
    form.lack_of_fit = lack_of_fit(fit, form.lack_of_fit.distance);
}

fn lack_of_fit(fit: &FormFit, distance: f64) -> LackOfFit {
    let Departure {
        statistic,
        freedom,
        p_value,
    } = fit.departure;
    LackOfFit {
        statistic,
        freedom,
        p_value,
        distance,
    }
}

/// The part of a fit to read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// The number of the curve among those that have a form.
    pub in_fit: usize,
    /// Its number among all curves.
    pub curve: usize,
    /// The number of the factor that is reported with it: an inertia.
    pub inertia: Option<usize>,
}

/// The form of one curve of a fit, with its parameters.
pub(super) fn fitted(form: FormName, fit: &FormFit, place: Place, free: &FreeOutcome) -> Fitted {
    let curve = &fit.curves[place.in_fit];
    let (abscissa, values) = (&free.system.curves[place.curve], &free.values[place.curve]);
    let inertia = place.inertia.map(|i| estimated(&fit.solution.x, &fit.covariance, i));
    Fitted {
        form,
        parameters: parameters(form, fit, place, abscissa, values),
        inertia: inertia.unwrap_or(Estimated {
            value: f64::NAN,
            standard_error: f64::NAN,
        }),
        lack_of_fit: lack_of_fit(fit, free.distance(place.curve, |x| curve.value(x))),
        bic: schwarz(fit, free),
        curve: curve.clone(),
    }
}

/// An unknown with its standard error.
pub(super) fn estimated(x: &[f64], covariance: &Covariance, i: usize) -> Estimated {
    Estimated {
        value: x[i],
        standard_error: covariance.error(i),
    }
}

/// The parameters of one curve of a fit; `free` are the values of the free curve over this abscissa.
fn parameters(form: FormName, fit: &FormFit, place: Place, abscissa: &Curve, free: &[f64]) -> Vec<Parameter> {
    let (curve, numbers) = (&fit.curves[place.in_fit], &fit.layout.curves[place.in_fit]);
    let largest = free.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    let uncertain = |value: f64, parameter: FormParameter| {
        let at = fit.layout.unknown(parameter);
        Uncertain::new(value, fit.covariance.error(at), fit.intervals[at])
    };
    let factors = curve.terms.iter().zip(&curve.factors).zip(numbers.factors.clone());
    let factors = factors.map(|((&term, &value), number)| {
        let size = (term == Term::Constant).then_some(largest);
        let value = uncertain(value, FormParameter::Factor(number));
        factor(form.symbol(term), term.unit(), value, size)
    });
    let symbols = curve.terms.iter().flat_map(|term| {
        let ShapeParameters { symbols, unit } = term.shape();
        symbols.iter().map(move |symbol| (symbol, unit))
    });
    let shapes = symbols.zip(&curve.logs).zip(numbers.logs.clone());
    let shapes = shapes.map(|(((symbol, unit), &log), number)| {
        shape(symbol, unit, uncertain(log, FormParameter::Log(number)), abscissa)
    });
    let mut parameters: Vec<Parameter> = factors.chain(shapes).collect();
    if curve.terms.contains(&Term::Stribeck) {
        breakaway(&mut parameters, fit, place.in_fit);
    }
    if form == FormName::SmoothStribeck {
        collinear(&mut parameters);
    }
    if curve.terms.contains(&Term::Tanh) {
        slope_only(&mut parameters);
    }
    for (factor, shapes) in [
        ("Fs", &["vs"][..]),
        ("g1", &["g2", "g3"]),
        ("g4", &["g5"]),
        ("ksw", &["asw"]),
    ] {
        shapeless(&mut parameters, factor, shapes);
    }
    parameters
}

/// An unknown with its standard error, and the interval of values that fit equally well within chance.
struct Uncertain {
    value: f64,
    error: f64,
    interval: [f64; 2],
}

impl Uncertain {
    /// The less certain of two estimates: from the curvature at the minimum, and from the profile beyond it.
    fn new(value: f64, error: f64, profile: [f64; 2]) -> Uncertain {
        let near = NORMAL_95 * error;
        Uncertain {
            value,
            error: error.max(0.5 * (profile[1] - profile[0]) / NORMAL_95),
            interval: [(value - near).min(profile[0]), (value + near).max(profile[1])],
        }
    }

    /// Whether the whole interval is within this distance of the value.
    fn within(&self, distance: f64) -> bool {
        self.interval.iter().all(|end| (end - self.value).abs() < distance)
    }
}

/// A factor. Its error is compared with `size` if the factor may be zero, otherwise with the factor itself.
fn factor(symbol: &str, unit: [i32; 2], uncertain: Uncertain, size: Option<f64>) -> Parameter {
    let [low, high] = uncertain.interval;
    let zero = size.is_none() && low <= 0.0 && high >= 0.0;
    let size = size.unwrap_or(uncertain.value.abs());
    let passive = PASSIVE.contains(&symbol);
    let negative = passive && high < 0.0;
    let identifiable = !zero && !negative && uncertain.within(FAR * size) && uncertain.error < LARGEST_ERROR * size;
    let remark = match (identifiable, zero, negative) {
        (true, ..) => "",
        (false, true, _) => "zero is possible too",
        (false, _, true) => "the best fit is negative, as in no joint",
        (false, ..) => FITS_AS_WELL,
    };
    let low = if passive && !negative { low.max(0.0) } else { low };
    Parameter {
        symbol: symbol.to_owned(),
        unit,
        value: uncertain.value,
        standard_error: uncertain.error,
        identifiable,
        range: [low, high].map(|end| if end.is_finite() { end } else { f64::NAN }),
        remark: remark.to_owned(),
    }
}

/// A shape parameter from its logarithm.
fn shape(symbol: &str, unit: [i32; 2], log: Uncertain, abscissa: &Curve) -> Parameter {
    let value = log.value.exp();
    let (longest, resolution) = (2.0 * abscissa.largest(), abscissa.resolution);
    // The distance over which the term changes, for any unit of the parameter.
    let power = unit[1];
    let distance = value.powf(1.0 / f64::from(power));
    let (identifiable, range, remark) = if distance < resolution {
        let end = resolution.powi(power);
        let range = if power < 0 { [end, f64::NAN] } else { [f64::NAN, end] };
        (false, range, "the curve changes within the resolution of the data")
    } else if distance > longest {
        let end = longest.powi(power);
        let range = if power < 0 { [f64::NAN, end] } else { [end, f64::NAN] };
        (false, range, "the curve changes beyond the data's range")
    } else {
        let identifiable = log.within(FAR) && log.error < LARGEST_ERROR;
        // Infinite logarithms are no limits, and neither are absurd ones.
        let near = |end: &f64| (end - log.value).abs() < FARTHEST;
        let ends = log
            .interval
            .map(|end| Some(end).filter(near).map_or(f64::NAN, f64::exp));
        (identifiable, ends, if identifiable { "" } else { FITS_AS_WELL })
    };
    Parameter {
        symbol: symbol.to_owned(),
        unit,
        value,
        standard_error: value * log.error,
        identifiable,
        range,
        remark: remark.to_owned(),
    }
}

/// If a tanh is a straight line over all data, the data determine only its slope.
fn slope_only(parameters: &mut [Parameter]) {
    let straight = |p: &Parameter| p.symbol == "g5" && !p.identifiable && p.range[0].is_nan() && p.range[1].is_finite();
    if parameters.iter().any(straight) {
        let factors = parameters.iter_mut().filter(|p| p.symbol == "g4");
        factors.for_each(|p| p.withdraw("these data determine only the product g4 g5, a slope"));
    }
}

/// The three slopes of (12) are nearly equal: if its Stribeck part is not well determined, no slope is well determined.
fn collinear(parameters: &mut [Parameter]) {
    let loose = |p: &Parameter| p.symbol == "g1" && !(p.standard_error < COLLINEAR * p.value.abs());
    let slopes: Vec<f64> = parameters
        .iter()
        .filter(|p| ["g2", "g3", "g5"].contains(&p.symbol.as_str()))
        .map(|p| p.value.ln())
        .collect();
    let alike = (0..slopes.len()).any(|i| slopes[..i].iter().any(|s| (s - slopes[i]).abs() < ALIKE));
    if !alike && !parameters.iter().any(loose) {
        return;
    }
    let group = ["g1", "g2", "g3", "g5"];
    for parameter in parameters.iter_mut().filter(|p| group.contains(&p.symbol.as_str())) {
        if parameter.identifiable || alike {
            parameter.identifiable = false;
            parameter.remark = "only the curve is determined, not g1, g2, g3 and g5 one by one".to_owned();
        }
        // For similar terms, the profile is that of their sum.
        if alike {
            parameter.range = [f64::NAN; 2];
        }
    }
}

/// The shape parameters of a term are not identifiable if its factor is not.
fn shapeless(parameters: &mut [Parameter], factor: &str, shapes: &[&str]) {
    if !parameters.iter().any(|p| p.symbol == factor && !p.identifiable) {
        return;
    }
    let shapes = parameters
        .iter_mut()
        .filter(|p| p.identifiable && shapes.contains(&p.symbol.as_str()));
    shapes.for_each(|p| p.withdraw(&format!("these data do not determine {factor}, whose term it shapes")));
}

/// Replaces Fs - Fc by the static friction Fs.
fn breakaway(parameters: &mut [Parameter], fit: &FormFit, curve: usize) {
    let [coulomb, excess] = [0, 2].map(|term| fit.layout.curves[curve].factors.start + term);
    let [a, b] = [coulomb, excess].map(|factor| fit.layout.unknown(FormParameter::Factor(factor)));
    let value = fit.solution.x[a] + fit.solution.x[b];
    let covariance = |i, j| fit.covariance.at(i, j);
    let variance: f64 = covariance(a, a) + covariance(b, b) + 2.0 * covariance(a, b);
    let error = variance.max(0.0).sqrt();
    let sum = factor("Fs", [1, 0], Uncertain::new(value, error, [value; 2]), None);
    parameters[2] = match parameters[2].identifiable {
        true => sum,
        false => Parameter {
            identifiable: false,
            remark: "these data do not distinguish it from Fc".to_owned(),
            ..sum
        },
    };
}

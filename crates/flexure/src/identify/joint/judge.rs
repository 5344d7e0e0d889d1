//! From a fitted form to its parameters, what the data tell of them, and how far the form is from the free curve.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::forms::{FormName, Shaped, Term};
use super::outcome::{Estimated, Fitted, LackOfFit, Parameter};
use super::shaping::Shapely;

/// A parameter whose standard error is this share of it is not told by the data.
const UNTOLD: f64 = 0.5;
/// Logarithms of shape parameters nearer than this belong to terms that are alike.
const ALIKE: f64 = 0.02;
/// Half the width of an interval of 95 %, in standard errors.
const NORMAL: f64 = 1.959_963_984_540_054;

/// What a form is held against.
pub(super) struct Against<'a> {
    /// The weighted sum of squares that the free curves leave, and the number of unknowns they have.
    pub squares: f64,
    pub unknowns: usize,
    /// The free curve at the data.
    pub curve: &'a [f64],
    /// The data of the curve.
    pub x: &'a [f64],
    /// The smallest distance of x that the data resolve.
    pub resolution: f64,
}

/// The form of one curve of a fit, with its parameters.
///
/// `which` is the curve's number; `inertia` the number of the unknown that is told beside it.
pub(super) fn fitted(
    form: FormName,
    offset: bool,
    fit: &Shapely,
    (which, fixed, inertia): (usize, usize, Option<usize>),
    against: &Against,
) -> Fitted {
    let n = fit.solution.x.len();
    let error = |i: usize| fit.covariance[i * n + i].max(0.0).sqrt();
    let before = |count: fn(&Shaped) -> usize| fit.curves[..which].iter().map(count).sum::<usize>();
    let all_factors: usize = fit.curves.iter().map(|c| c.factors.len()).sum();
    let first_factor = fixed + before(|c| c.factors.len());
    let first_log = fixed + all_factors + before(|c| c.logs.len());
    let curve = &fit.curves[which];
    let symbols = form.symbols(offset);
    let mut parameters = Vec::new();
    for (i, ((symbol, unit), &value)) in symbols.factors.iter().zip(&curve.factors).enumerate() {
        parameters.push(plain(symbol, *unit, value, error(first_factor + i)));
    }
    for (i, ((symbol, unit), &log)) in symbols.shapes.iter().zip(&curve.logs).enumerate() {
        parameters.push(shape(symbol, *unit, log, error(first_log + i), against));
    }
    if form == FormName::Stribeck {
        breakaway(&mut parameters, fit, first_factor);
    }
    if form == FormName::SmoothStribeck && (curve.logs[0] - curve.logs[1]).abs() < ALIKE {
        for parameter in parameters
            .iter_mut()
            .filter(|p| ["g1", "g2", "g3"].contains(&&*p.symbol))
        {
            parameter.identifiable = false;
            parameter.range = [f64::NAN; 2];
            parameter.remark = "g2 and g3 are not told apart, and so g1 is not either".to_owned();
        }
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
    let lines: usize = fit.solution.residuals.iter().map(Vec::len).sum();
    let observations = 2.0 * lines as f64;
    let extra = (against.unknowns as f64 - n as f64).max(1.0);
    let left = (observations - against.unknowns as f64).max(1.0);
    let statistic = ((fit.solution.squares - against.squares).max(0.0) / extra) / (against.squares / left);
    let p_value = FisherSnedecor::new(extra, left).map_or(f64::NAN, |f| 1.0 - f.cdf(statistic));
    let both = against.x.iter().zip(against.curve);
    let (off, size) = both.fold((0.0, 0.0), |(off, size), (&x, &y)| {
        (off + (curve.value(x) - y).powi(2), size + y * y)
    });
    Fitted {
        form,
        parameters,
        inertia: match inertia {
            Some(i) => Estimated {
                value: fit.solution.x[i],
                standard_error: error(i),
            },
            None => Estimated {
                value: f64::NAN,
                standard_error: f64::NAN,
            },
        },
        lack_of_fit: LackOfFit {
            statistic,
            freedom: [extra, left],
            p_value,
            distance: (off / size.max(f64::MIN_POSITIVE)).sqrt(),
        },
        bic: observations * (fit.solution.squares / observations).ln() + n as f64 * observations.ln(),
        shaped: curve.clone(),
    }
}

fn plain(symbol: &str, unit: [i32; 2], value: f64, standard_error: f64) -> Parameter {
    // An offset may well be zero: its standard error is all that is to be told.
    let free = symbol == "F0";
    let identifiable = free || standard_error < UNTOLD * value.abs();
    Parameter {
        symbol: symbol.to_owned(),
        unit,
        value,
        standard_error,
        identifiable,
        range: [value - NORMAL * standard_error, value + NORMAL * standard_error],
        remark: match identifiable {
            true => String::new(),
            false => "not told from zero by these data".to_owned(),
        },
    }
}

fn shape(symbol: &str, unit: [i32; 2], log: f64, error: f64, against: &Against) -> Parameter {
    let value = log.exp();
    let largest = against.x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // The distance over which the term changes, whatever the parameter's unit.
    let distance = value.powf(1.0 / f64::from(unit[1]));
    let limit = |d: f64| d.powi(unit[1]);
    let (identifiable, range, remark) = if distance < against.resolution {
        let range = match unit[1] < 0 {
            true => [limit(against.resolution), f64::NAN],
            false => [f64::NAN, limit(against.resolution)],
        };
        (
            false,
            range,
            "the curve changes within the resolution of the data".to_owned(),
        )
    } else if distance > 2.0 * largest {
        let range = match unit[1] < 0 {
            true => [f64::NAN, limit(2.0 * largest)],
            false => [limit(2.0 * largest), f64::NAN],
        };
        (false, range, "the curve changes beyond the data's range".to_owned())
    } else {
        let spread = (NORMAL * error).min(300.0);
        let told = error < UNTOLD;
        let remark = if told { "" } else { "the data do not tell it" };
        (told, [(log - spread).exp(), (log + spread).exp()], remark.to_owned())
    };
    Parameter {
        symbol: symbol.to_owned(),
        unit,
        value,
        standard_error: value * error,
        identifiable,
        range,
        remark,
    }
}

/// Of a tanh that is a straight line over all of the data, its slope is all that they tell.
fn slope_only(parameters: &mut [Parameter]) {
    let straight = |p: &Parameter| p.symbol == "g5" && !p.identifiable && p.range[0].is_nan() && p.range[1].is_finite();
    if !parameters.iter().any(straight) {
        return;
    }
    for parameter in parameters.iter_mut().filter(|p| p.symbol == "g4") {
        parameter.identifiable = false;
        parameter.range = [f64::NAN; 2];
        parameter.remark = "the data tell only the product g4 g5, a slope".to_owned();
    }
}

/// Without its factor a term has no shape.
fn shapeless(parameters: &mut [Parameter], factor: &str, shapes: &[&str]) {
    if !parameters.iter().any(|p| p.symbol == factor && !p.identifiable) {
        return;
    }
    for parameter in parameters.iter_mut().filter(|p| shapes.contains(&p.symbol.as_str())) {
        if parameter.identifiable {
            parameter.identifiable = false;
            parameter.range = [f64::NAN; 2];
            parameter.remark = format!("{factor}, whose term it shapes, is not told by these data");
        }
    }
}

/// Adds the static friction Fs to Fs - Fc.
fn breakaway(parameters: &mut [Parameter], fit: &Shapely, first: usize) {
    let n = fit.solution.x.len();
    let (a, b) = (first, first + 2);
    let variance = fit.covariance[a * n + a] + fit.covariance[b * n + b] + 2.0 * fit.covariance[a * n + b];
    let value = fit.solution.x[a] + fit.solution.x[b];
    let told = parameters[2].identifiable;
    parameters[2] = Parameter {
        identifiable: told,
        remark: match told {
            true => String::new(),
            false => "not told from Fc by these data".to_owned(),
        },
        ..plain("Fs", [1, 0], value, variance.max(0.0).sqrt())
    };
}

//! From a fitted form to its parameters, what the data tell of them, and how far the form is from the free curve.

use super::departure::Departure;
use super::equations::{Equations, Solution};
use super::forms::{FormName, Shaped, Term};
use super::outcome::{Estimated, Fitted, LackOfFit, Parameter};
use super::shaping::Shapely;

/// A parameter whose standard error is this share of it is not told by the data.
const UNTOLD: f64 = 0.5;
/// A parameter with values farther away than this that fit as well, relatively or in its logarithm, is not told either.
const FAR: f64 = 1.2;
/// Logarithms of shape parameters farther than this from the estimate are no limits.
const FARTHEST: f64 = 6.0;
/// Slopes whose logarithms are nearer than this make terms that are alike.
const ALIKE: f64 = 0.3;
/// Terms are told apart if the standard error of their factor is no more than this share of it.
const COLLINEAR: f64 = 0.15;
/// Half the width of an interval of 95 %, in standard errors.
pub(super) const NORMAL: f64 = 1.959_963_984_540_054;

/// What equations with free curves leave.
#[derive(Debug, Clone, Copy)]
pub(super) struct Left {
    /// The weighted sum of squares, and what is minimised.
    squares: f64,
    objective: f64,
    /// The number of unknowns, and what they take of the sum of squares by chance.
    unknowns: usize,
    taken: f64,
}

impl Left {
    /// By the solution of these equations.
    pub fn by(equations: &Equations, solution: &Solution) -> Left {
        Left {
            squares: solution.squares,
            objective: solution.objective,
            unknowns: solution.x.len(),
            taken: equations.robust(solution).taken,
        }
    }

    /// Schwarz's criterion of a form fitted instead of one of the curves.
    ///
    /// Where the errors are not those that the weights say, what chance takes is a sum of squares of another mean: the form's is made
    /// what it would be if they were.
    fn schwarz(&self, fit: &Shapely) -> f64 {
        let unknowns = fit.solution.x.len() as f64;
        let lines: usize = fit.solution.residuals.iter().map(Vec::len).sum();
        let observations = 2.0 * lines as f64;
        let extra = (self.unknowns as f64 - unknowns).max(1.0);
        let left = (observations - self.unknowns as f64).max(1.0);
        // Never less than the weights say.
        let mean = (self.taken - fit.taken).max(extra * self.squares / left);
        let statistic = (fit.solution.objective - self.objective).max(0.0) / mean;
        let squares = self.squares * (1.0 + statistic * extra / left);
        observations * (squares / observations).ln() + unknowns * observations.ln()
    }
}

/// Takes the test of a form from a fit in which less of the equations has a form.
pub(super) fn retest(form: &mut Fitted, fit: &Shapely) {
    form.lack_of_fit = LackOfFit {
        distance: form.lack_of_fit.distance,
        ..tested(fit)
    };
}

/// The test of the forms of a fit, but for the distance.
fn tested(fit: &Shapely) -> LackOfFit {
    let Departure {
        statistic,
        freedom,
        p_value,
    } = fit.departure;
    LackOfFit {
        statistic,
        freedom,
        p_value,
        distance: f64::NAN,
    }
}

/// What a form is held against.
pub(super) struct Against<'a> {
    /// What the free curves leave.
    pub free: Left,
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
    let largest = against.curve.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    for (i, ((symbol, unit), &value)) in symbols.factors.iter().zip(&curve.factors).enumerate() {
        let at = first_factor + i;
        let free = (*symbol == "F0").then_some(largest);
        parameters.push(plain(
            symbol,
            *unit,
            Told::new(value, error(at), fit.intervals[at]),
            free,
        ));
    }
    for (i, ((symbol, unit), &log)) in symbols.shapes.iter().zip(&curve.logs).enumerate() {
        let at = first_log + i;
        let told = Told::new(log, error(at), fit.intervals[at]);
        parameters.push(shape(symbol, *unit, told, against));
    }
    if form == FormName::Stribeck {
        breakaway(&mut parameters, fit, first_factor);
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
            distance: (off / size.max(f64::MIN_POSITIVE)).sqrt(),
            ..tested(fit)
        },
        bic: against.free.schwarz(fit),
        shaped: curve.clone(),
    }
}

/// What is told of an unknown: its value, its standard error, and the values that fit as well as far as chance goes.
struct Told {
    value: f64,
    error: f64,
    interval: [f64; 2],
}

impl Told {
    /// Neither the curvature at the minimum nor the profile beyond may be more sure than the other.
    fn new(value: f64, error: f64, profile: [f64; 2]) -> Told {
        let near = NORMAL * error;
        Told {
            value,
            error: error.max(0.5 * (profile[1] - profile[0]) / NORMAL),
            interval: [(value - near).min(profile[0]), (value + near).max(profile[1])],
        }
    }

    /// Whether all of the interval is nearer to the value than this.
    fn within(&self, distance: f64) -> bool {
        self.interval.iter().all(|end| (end - self.value).abs() < distance)
    }
}

/// An interval's ends, NaN where it has none.
fn limits(ends: [f64; 2]) -> [f64; 2] {
    ends.map(|end| if end.is_finite() { end } else { f64::NAN })
}

/// A factor; `free` is the largest torque beside one that may well be zero.
fn plain(symbol: &str, unit: [i32; 2], told: Told, free: Option<f64>) -> Parameter {
    let size = free.unwrap_or(told.value.abs());
    let zero = free.is_none() && told.interval[0] <= 0.0 && told.interval[1] >= 0.0;
    let identifiable = !zero && told.within(FAR * size) && told.error < UNTOLD * size;
    let remark = match (identifiable, zero) {
        (true, _) => "",
        (false, true) => "not told from zero by these data",
        (false, false) => "values far from each other fit these data as well",
    };
    Parameter {
        symbol: symbol.to_owned(),
        unit,
        value: told.value,
        standard_error: told.error,
        identifiable,
        range: limits(told.interval),
        remark: remark.to_owned(),
    }
}

fn shape(symbol: &str, unit: [i32; 2], told: Told, against: &Against) -> Parameter {
    let value = told.value.exp();
    let largest = against.x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    // The distance over which the term changes, whatever the parameter's unit.
    let distance = value.powf(1.0 / f64::from(unit[1]));
    let limit = |d: f64| d.powi(unit[1]);
    let (identifiable, range, remark) = if distance < against.resolution {
        let range = match unit[1] < 0 {
            true => [limit(against.resolution), f64::NAN],
            false => [f64::NAN, limit(against.resolution)],
        };
        (false, range, "the curve changes within the resolution of the data")
    } else if distance > 2.0 * largest {
        let range = match unit[1] < 0 {
            true => [f64::NAN, limit(2.0 * largest)],
            false => [limit(2.0 * largest), f64::NAN],
        };
        (false, range, "the curve changes beyond the data's range")
    } else {
        let identifiable = told.within(FAR) && told.error < UNTOLD;
        let remark = match identifiable {
            true => "",
            false => "values far from each other fit these data as well",
        };
        // Logarithms without an end are of no limit, and so are those that would be absurd.
        let ends = told.interval.map(|end| {
            if (end - told.value).abs() < FARTHEST {
                end.exp()
            } else {
                f64::NAN
            }
        });
        (identifiable, ends, remark)
    };
    Parameter {
        symbol: symbol.to_owned(),
        unit,
        value,
        standard_error: value * told.error,
        identifiable,
        range,
        remark: remark.to_owned(),
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

/// The three slopes of (12) are nearly alike: what is not well told of its Stribeck part is told of no slope.
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
            parameter.remark = "g1, g2, g3 and g5 make up for each other: only the curve is told".to_owned();
        }
        // Between terms that are alike the profile is that of their sum.
        if alike {
            parameter.range = [f64::NAN; 2];
        }
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
    let sum = plain(
        "Fs",
        [1, 0],
        Told::new(value, variance.max(0.0).sqrt(), [value; 2]),
        None,
    );
    parameters[2] = match parameters[2].identifiable {
        true => sum,
        false => Parameter {
            identifiable: false,
            remark: "not told from Fc by these data".to_owned(),
            ..sum
        },
    };
}

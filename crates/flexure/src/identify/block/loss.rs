//! The simulation error of a system and its exact derivatives, all by filtering.
//!
//! With $w = G u$, $z = f(w)$, $x = \sum (o + H z)$, $y = g(x)$, every derivative of y by a parameter of a branch is
//! that of x, a filtered signal, times $g'(x)$:
//!
//! - by a parameter p of a front G: $H\,[f'(w)\,\partial w/\partial p]$;
//! - by a coefficient of f: its B-spline through H; by a kink's place or bend: the kink's derivative through H;
//! - by the k-th coefficient of a numerator: the numerator's input, k samples later;
//! - by a coefficient $a_k$ of a section A of either linear block: $\partial G/\partial a_k = -z^{-k} G / A$;
//! - by an offset o: 1.
//!
//! The derivative by a parameter of g is that of g itself at x.
//!
//! If f also acts between the samples ([`Branch::between`]), a branch has two terms H z, with separate numerators and common denominators.

use super::descent::Residuals;
use super::limits::HARDLY_PASSED;
use super::rational::Rational;
use super::signals::{Signals, add, convolved, delayed};
use super::spline::KinkedSpline;
use super::system::{Branch, Level, Numerators, System};
use crate::linear::levenberg_marquardt::Linearisation;
use crate::nonlinearity::spline::basis::LocalCubics;
use crate::parallel;

/// One column of the Jacobian.
#[derive(Clone, Copy, PartialEq)]
enum Column {
    /// A parameter of the branch of this index.
    Branch(usize, BranchColumn),
    Offset,
    /// A parameter of the last nonlinearity.
    Output(usize),
}

#[derive(Clone, Copy, PartialEq)]
enum BranchColumn {
    /// The instant is 0 at the samples and 1 between them.
    FrontNumerator {
        instant: usize,
        lag: usize,
    },
    FrontSection {
        section: usize,
        lag: usize,
    },
    Nonlinearity(usize),
    BackNumerator {
        instant: usize,
        lag: usize,
    },
    BackSection {
        section: usize,
        lag: usize,
    },
}

/// The simulation error of a system over its free parameters: all except those that are held so that scales and levels are unique.
pub(in crate::identify) struct Loss<'a> {
    data: &'a Signals,
    at: System,
    /// The free parameters' places among all.
    free: Vec<usize>,
    columns: Vec<Column>,
}

impl<'a> Loss<'a> {
    pub fn new(at: System, data: &'a Signals) -> Self {
        let all = columns(&at).into_iter().enumerate();
        let (free, columns) = all.filter_map(|(i, c)| Some((i, c?))).unzip();
        Loss {
            data,
            at,
            free,
            columns,
        }
    }

    /// The same, with the scale of what enters a nonlinearity of one piece held: a cubic of any scale is a cubic, so that the samples do not
    /// determine it. The search can leave it free, but it has no standard error.
    pub fn with_unique_scales(at: System, data: &'a Signals) -> Self {
        let mut loss = Loss::new(at, data);
        for i in 0..loss.at.branches.len() {
            let branch = &loss.at.branches[i];
            let b = &branch.front.b;
            let largest = (0..b.len()).max_by(|i, j| b[*i].abs().total_cmp(&b[*j].abs()));
            let Some(lag) = largest.filter(|_| branch.spline.pieces() == 1) else {
                continue;
            };
            let scale = Column::Branch(i, BranchColumn::FrontNumerator { instant: 0, lag });
            if let Some(place) = loss.columns.iter().position(|column| *column == scale) {
                loss.columns.remove(place);
                loss.free.remove(place);
            }
        }
        loss
    }

    /// The free parameters at the start.
    pub fn start(&self) -> Vec<f64> {
        let all = self.at.parameters();
        self.free.iter().map(|&i| all[i]).collect()
    }

    /// The system with these free parameters.
    pub fn system(&self, free: &[f64]) -> System {
        let mut all = self.at.parameters();
        self.free.iter().zip(free).for_each(|(&i, p)| all[i] = *p);
        self.at.with(&all)
    }
}

impl Residuals for Loss<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let s = self.system(parameters);
        if !s.is_stable() {
            return None;
        }
        let mut errors = s.run(&self.data.u);
        errors.iter_mut().zip(&self.data.y).for_each(|(e, y)| *e -= y);
        Some(errors)
    }

    fn linearise(&self, parameters: &[f64]) -> Linearisation {
        let s = self.system(parameters);
        let Signals { u, y, .. } = self.data;
        let parts: Vec<Linearised> = s.branches.iter().map(|b| Linearised::new(b, u)).collect();
        let mut x = vec![0.0; y.len()];
        parts.iter().for_each(|p| add(&mut x, &p.output));
        let last = s.output.as_ref().map(|g| Static::new(g, x.clone()));
        let through_last = |mut column: Vec<f64>| {
            if let Some(last) = &last {
                column.iter_mut().zip(&last.slopes).for_each(|(c, d)| *c *= d);
            }
            column
        };
        let derivative_by = |column: &Column| match (*column, &last) {
            (Column::Branch(i, column), _) => through_last(parts[i].column(column)),
            (Column::Offset, _) => through_last(vec![1.0; y.len()]),
            (Column::Output(j), Some(last)) => last.by_parameter(j),
            // There is no such column without a last nonlinearity.
            (Column::Output(_), None) => vec![0.0; y.len()],
        };
        let output = last.as_ref().map_or(&x, |last| &last.values);
        Linearisation {
            residuals: output.iter().zip(y).map(|(p, y)| p - y).collect(),
            jacobian: parallel::batch(&self.columns, derivative_by),
        }
    }
}

/// The columns of all parameters in the order of [`System::parameters`], `None` for those that are held.
///
/// - The back's largest numerator coefficient is held: the nonlinearity has the scale. No coefficient of the front needs to be held: the
///   breakpoints do not move, so another scale of w means another curve. A front that is only a gain is held, because the nonlinearity has
///   that gain as well.
/// - The coefficient of the middle B-spline is held: an offset has the level. It is free in the first branch if that branch's
///   nonlinearity has the mean of the sum ([`Level::Nonlinearity`]).
/// - The first branch's offset is free under [`Level::Offset`]; under [`Level::Nonlinearity`], offsets after a back that hardly passes a
///   constant are free.
/// - The last nonlinearity's breakpoints do not move either, so no parameter need be held for the scale and level of its input.
fn columns(s: &System) -> Vec<Option<Column>> {
    let mut all = Vec::new();
    for (i, branch) in s.branches.iter().enumerate() {
        let has_level = s.level == Level::Nonlinearity && i == 0;
        let of = branch_columns(branch, has_level).into_iter();
        all.extend(of.map(|column| Some(Column::Branch(i, column?))));
    }
    all.extend(s.branches.iter().enumerate().map(|(i, branch)| {
        let free = match s.level {
            Level::Offset => i == 0,
            Level::Nonlinearity => hardly_passes_constants(&branch.whole_back()),
        };
        free.then_some(Column::Offset)
    }));
    all.extend((0..s.output.as_ref().map_or(0, KinkedSpline::count)).map(|j| Some(Column::Output(j))));
    all
}

fn branch_columns(branch: &Branch, has_level: bool) -> Vec<Option<BranchColumn>> {
    use BranchColumn::{BackNumerator, BackSection, FrontNumerator, FrontSection, Nonlinearity};
    let lags = |r: &Rational| -> Vec<(usize, usize)> {
        let each = r.sections.iter().enumerate();
        each.flat_map(|(section, s)| (1..=s.order).map(move |lag| (section, lag)))
            .collect()
    };
    let b = &branch.back.b;
    let largest = (0..b.len()).max_by(|i, j| b[*i].abs().total_cmp(&b[*j].abs()));
    let middle = branch.spline.middle();
    let front = (0..branch.front.b.len()).map(|lag| FrontNumerator { instant: 0, lag });
    let mut all: Vec<Option<BranchColumn>> = front.map(|c| (!branch.front_is_gain()).then_some(c)).collect();
    all.extend((lags(&branch.front).into_iter()).map(|(section, lag)| Some(FrontSection { section, lag })));
    all.extend((0..branch.spline.count()).map(|j| (has_level || j != middle).then_some(Nonlinearity(j))));
    all.extend((0..b.len()).map(|lag| (Some(lag) != largest).then_some(BackNumerator { instant: 0, lag })));
    all.extend((lags(&branch.back).into_iter()).map(|(section, lag)| Some(BackSection { section, lag })));
    if let Some(between) = &branch.between {
        all.extend((0..between.front.len()).map(|lag| Some(FrontNumerator { instant: 1, lag })));
        all.extend((0..between.back.len()).map(|lag| Some(BackNumerator { instant: 1, lag })));
    }
    all
}

/// Whether the system hardly passes a constant.
fn hardly_passes_constants(g: &Rational) -> bool {
    let denominator: f64 = g.sections.iter().map(|s| 1.0 + s.a[0] + s.a[1]).product();
    let size: f64 = g.b.iter().map(|b| b.abs()).sum();
    g.static_gain().abs() < HARDLY_PASSED * size / denominator.abs()
}

/// A nonlinearity, its input signal, and its values and slopes there.
struct Static<'a> {
    spline: &'a KinkedSpline,
    input: Vec<f64>,
    local: Vec<LocalCubics>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl<'a> Static<'a> {
    fn new(spline: &'a KinkedSpline, input: Vec<f64>) -> Self {
        let local: Vec<LocalCubics> = input.iter().map(|x| spline.local(*x)).collect();
        let tangents = input.iter().zip(&local).map(|(x, l)| spline.tangent(*x, l));
        let (values, slopes) = tangents.map(|t| (t.value, t.slope)).unzip();
        Static {
            spline,
            input,
            local,
            values,
            slopes,
        }
    }

    fn by_parameter(&self, j: usize) -> Vec<f64> {
        self.spline.by_parameter(j, &self.input, &self.local)
    }
}

/// One instant in every sampling interval.
struct Instant<'a> {
    nonlinearity: Static<'a>,
    /// The nonlinearity's output through the back's denominator.
    through_denominator: Vec<f64>,
    /// The back's numerator.
    numerator: &'a [f64],
}

/// A branch and the signals for its derivatives.
struct Linearised<'a> {
    branch: &'a Branch,
    /// The input through the front's denominator.
    through_front_denominator: Vec<f64>,
    instants: Vec<Instant<'a>>,
    /// For every section of the front: the intermediate signal of every instant, filtered by this section once more.
    front_sections: Vec<Vec<Vec<f64>>>,
    /// For every section of the back: the output without the offset, filtered by this section once more.
    back_sections: Vec<Vec<f64>>,
    output: Vec<f64>,
}

impl<'a> Linearised<'a> {
    fn new(branch: &'a Branch, u: &[Vec<f64>]) -> Self {
        let through_front_denominator = branch.front.all_pole(&branch.delayed(u));
        let instant = |Numerators { front, back }: Numerators<'a>| {
            let nonlinearity = Static::new(&branch.spline, convolved(front, &through_front_denominator));
            Instant {
                through_denominator: branch.back.all_pole(&nonlinearity.values),
                nonlinearity,
                numerator: back,
            }
        };
        let instants: Vec<Instant> = branch.instants().map(instant).collect();
        let mut output = vec![branch.offset; through_front_denominator.len()];
        for i in &instants {
            add(&mut output, &convolved(i.numerator, &i.through_denominator));
        }
        let response: Vec<f64> = output.iter().map(|y| y - branch.offset).collect();
        let front_sections = parallel::batch(&branch.front.sections, |a| {
            instants.iter().map(|i| a.run(&i.nonlinearity.input)).collect()
        });
        Linearised {
            branch,
            through_front_denominator,
            front_sections,
            back_sections: parallel::batch(&branch.back.sections, |a| a.run(&response)),
            instants,
            output,
        }
    }

    /// The derivative of the output.
    fn column(&self, column: BranchColumn) -> Vec<f64> {
        match column {
            BranchColumn::FrontNumerator { instant, lag } => self.of_front(
                std::iter::once((&self.instants[instant], &self.through_front_denominator)),
                lag,
                1.0,
            ),
            BranchColumn::FrontSection { section, lag } => {
                self.of_front(self.instants.iter().zip(&self.front_sections[section]), lag, -1.0)
            }
            BranchColumn::Nonlinearity(j) => {
                let each = self
                    .instants
                    .iter()
                    .map(|i| (i.numerator, i.nonlinearity.by_parameter(j)));
                through_back(&self.branch.back, each)
            }
            BranchColumn::BackNumerator { instant, lag } => {
                delayed(&self.instants[instant].through_denominator, lag, 1.0)
            }
            BranchColumn::BackSection { section, lag } => delayed(&self.back_sections[section], lag, -1.0),
        }
    }

    /// The output's derivative by a parameter of the front. `changes` are the derivatives of the intermediate signals, without lag and
    /// sign.
    fn of_front<'i>(
        &'i self,
        changes: impl Iterator<Item = (&'i Instant<'a>, &'i Vec<f64>)>,
        lag: usize,
        sign: f64,
    ) -> Vec<f64> {
        let each = changes.map(|(instant, change)| {
            let mut inner = delayed(change, lag, sign);
            let slopes = &instant.nonlinearity.slopes;
            inner.iter_mut().zip(slopes).for_each(|(i, d)| *i *= d);
            (instant.numerator, inner)
        });
        through_back(&self.branch.back, each)
    }
}

/// The sum of signals, each through its own numerator, over a common denominator.
pub(super) fn through_back<'b>(back: &Rational, each: impl Iterator<Item = (&'b [f64], Vec<f64>)>) -> Vec<f64> {
    let mut sum = Vec::new();
    for (numerator, signal) in each {
        let more = convolved(numerator, &signal);
        if sum.is_empty() {
            sum = more;
        } else {
            add(&mut sum, &more);
        }
    }
    back.all_pole(&sum)
}

#[cfg(test)]
#[path = "loss_tests.rs"]
mod tests;

//! The systems that the search works on: a sum of branches, with or without a last nonlinearity.
//!
//! $$ X_n = \sum_i \left( o_i + H_i(z) f_i(W^{(i)}_n) \right), \qquad W^{(i)}_n = G_i(z) U^{(i)}_{n - s_i},
//!    \qquad Y_n = g(X_n) + e_n $$
//!
//! Every block structure is a special case:
//!
//! | structure | branches | G | H | g |
//! |---|---|---|---|---|
//! | Wiener | one | free | 1 | none |
//! | Wiener-Hammerstein | one | free | free | none |
//! | parallel | several of one input | 1 or free | free | none |
//! | several inputs | one for each input | 1 | free | none |
//! | Hammerstein-Wiener | one | 1 | free | free |

use std::borrow::Cow;

use super::rational::Rational;
use super::signals::{Signals, add, convolved, delayed};
use super::spline::KinkedSpline;
use crate::linear::correlation::mean;

/// Linear, static, linear, of one input.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Branch {
    /// The index of the input.
    pub input: usize,
    /// Samples by which the input is delayed before anything else; numerators may delay it further.
    pub delay: usize,
    pub front: Rational,
    pub spline: KinkedSpline,
    pub back: Rational,
    /// The instant between the samples, if the nonlinearity acts there too.
    pub between: Option<Between>,
    /// Added to the output.
    pub offset: f64,
}

/// The numerators of front and back for an instant between the samples; the denominators are those of front and back.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct Between {
    pub front: Vec<f64>,
    pub back: Vec<f64>,
}

/// The numerators of front and back for one instant in every sampling interval.
pub(in crate::identify) struct Numerators<'a> {
    pub front: &'a [f64],
    pub back: &'a [f64],
}

impl Branch {
    /// The branch of the first input with these blocks, without a delay.
    pub fn new(front: Rational, spline: KinkedSpline, back: Rational) -> Branch {
        Branch {
            input: 0,
            delay: 0,
            front,
            spline,
            back,
            between: None,
            offset: 0.0,
        }
    }

    /// The nonlinearity alone.
    pub fn of(spline: KinkedSpline) -> Branch {
        Branch::new(Rational::pass(), spline, Rational::pass())
    }

    /// The delayed input, 0 before the record.
    pub fn delayed<'u>(&self, u: &'u [Vec<f64>]) -> Cow<'u, [f64]> {
        match self.delay {
            0 => Cow::Borrowed(&u[self.input]),
            delay => Cow::Owned(delayed(&u[self.input], delay, 1.0)),
        }
    }

    /// The output for these inputs, from rest.
    pub fn run(&self, u: &[Vec<f64>]) -> Vec<f64> {
        let all_pole = self.front.all_pole(&self.delayed(u));
        let mut sum = vec![self.offset; all_pole.len()];
        for Numerators { front, back } in self.instants() {
            let w = convolved(front, &all_pole);
            let z: Vec<f64> = w.iter().map(|w| self.spline.value(*w)).collect();
            add(&mut sum, &convolved(back, &self.back.all_pole(&z)));
        }
        sum
    }

    /// The output for these inputs; the back starts in the steady state of its input's mean.
    fn run_settled(&self, u: &[Vec<f64>]) -> Vec<f64> {
        let mut sum = self.run(u);
        for (w, Numerators { back, .. }) in self.intermediate(u).zip(self.instants()) {
            let z: Vec<f64> = w.iter().map(|w| self.spline.value(*w)).collect();
            let back = Rational {
                b: back.to_vec(),
                sections: self.back.sections.clone(),
            };
            let (level, gain) = (mean(&z), back.static_gain());
            let rise = back.run(&vec![level; z.len()]);
            sum.iter_mut().zip(rise).for_each(|(y, r)| *y += gain * level - r);
        }
        sum
    }

    /// The intermediate signals, one for every instant in a sampling interval.
    pub fn intermediate(&self, u: &[Vec<f64>]) -> impl Iterator<Item = Vec<f64>> {
        let all_pole = self.front.all_pole(&self.delayed(u));
        self.instants().map(move |instant| convolved(instant.front, &all_pole))
    }

    /// The numerators of front and back for every instant in a sampling interval.
    pub fn instants(&self) -> impl Iterator<Item = Numerators<'_>> {
        let between = self.between.iter().map(|b| Numerators {
            front: &b.front,
            back: &b.back,
        });
        let at_samples = Numerators {
            front: &self.front.b,
            back: &self.back.b,
        };
        std::iter::once(at_samples).chain(between)
    }

    /// The back for a signal that is the same at all instants.
    pub fn whole_back(&self) -> Rational {
        let mut whole = self.back.clone();
        if let Some(between) = &self.between {
            whole.b.resize(whole.b.len().max(between.back.len()), 0.0);
            add(&mut whole.b, &between.back);
        }
        whole
    }

    /// Whether the front is only a gain, which the nonlinearity has as well.
    pub fn front_is_gain(&self) -> bool {
        self.front.b.len() == 1 && self.front.order() == 0 && self.between.is_none()
    }

    /// All parameters except the offset: front, nonlinearity, back, and the numerators for an instant between the samples.
    pub fn parameters(&self) -> Vec<f64> {
        let mut p = self.front.parameters();
        p.extend(self.spline.parameters());
        p.extend(self.back.parameters());
        p.extend(self.between.iter().flat_map(|b| b.front.iter().chain(&b.back)));
        p
    }

    /// Takes other [`parameters`](Self::parameters) from the start of `p` and returns the rest.
    fn take<'p>(&mut self, p: &'p [f64]) -> &'p [f64] {
        let (front, p) = p.split_at(self.front.count());
        let (spline, p) = p.split_at(self.spline.count());
        let (back, mut p) = p.split_at(self.back.count());
        self.front = self.front.with(front);
        self.spline.set(spline);
        self.back = self.back.with(back);
        for numerator in self.between.iter_mut().flat_map(|b| [&mut b.front, &mut b.back]) {
            let (mine, rest) = p.split_at(numerator.len());
            numerator.copy_from_slice(mine);
            p = rest;
        }
        p
    }

    fn is_stable(&self) -> bool {
        self.front.is_stable() && self.back.is_stable()
    }
}

/// Which parameter has the mean of the sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identify) enum Level {
    /// The first branch's nonlinearity; offsets are free only after a back that hardly passes a constant.
    Nonlinearity,
    /// The first branch's offset.
    Offset,
}

/// A sum of branches, and the last nonlinearity, if there is one.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct System {
    pub branches: Vec<Branch>,
    /// The last nonlinearity, if there is one.
    pub output: Option<KinkedSpline>,
    pub level: Level,
}

impl System {
    /// Branches whose sum is the output; the first nonlinearity has the mean.
    pub fn sum(branches: Vec<Branch>) -> System {
        System {
            branches,
            output: None,
            level: Level::Nonlinearity,
        }
    }

    /// The same; the first branch's offset has the mean.
    pub fn with_offsets(branches: Vec<Branch>) -> System {
        System {
            level: Level::Offset,
            ..System::sum(branches)
        }
    }

    /// The sum of the branches, which enters the last nonlinearity.
    pub fn inner(&self, u: &[Vec<f64>]) -> Vec<f64> {
        self.sum_of(u, Branch::run)
    }

    fn sum_of(&self, u: &[Vec<f64>], run: fn(&Branch, &[Vec<f64>]) -> Vec<f64>) -> Vec<f64> {
        let mut sum = vec![0.0; u.first().map_or(0, Vec::len)];
        self.branches.iter().for_each(|b| add(&mut sum, &run(b, u)));
        sum
    }

    /// The output for these inputs, from rest.
    pub fn run(&self, u: &[Vec<f64>]) -> Vec<f64> {
        self.through_output(self.inner(u))
    }

    /// The output for these inputs, as in a free run of the model: every back starts in the steady state of its input's mean.
    pub fn run_settled(&self, u: &[Vec<f64>]) -> Vec<f64> {
        self.through_output(self.sum_of(u, Branch::run_settled))
    }

    fn through_output(&self, mut x: Vec<f64>) -> Vec<f64> {
        if let Some(output) = &self.output {
            x.iter_mut().for_each(|x| *x = output.value(*x));
        }
        x
    }

    /// The sum of the branches' offsets.
    pub fn offset(&self) -> f64 {
        self.branches.iter().map(|b| b.offset).sum()
    }

    pub fn is_stable(&self) -> bool {
        self.branches.iter().all(Branch::is_stable)
    }

    /// All parameters: those of every branch, the branches' offsets, the last nonlinearity's.
    pub fn parameters(&self) -> Vec<f64> {
        let mut p: Vec<f64> = self.branches.iter().flat_map(Branch::parameters).collect();
        p.extend(self.branches.iter().map(|b| b.offset));
        p.extend(self.output.iter().flat_map(KinkedSpline::parameters));
        p
    }

    /// The same structure with other parameters.
    pub fn with(&self, mut p: &[f64]) -> System {
        let mut next = self.clone();
        for branch in &mut next.branches {
            p = branch.take(p);
        }
        let (offsets, output) = p.split_at(next.branches.len());
        next.branches.iter_mut().zip(offsets).for_each(|(b, o)| b.offset = *o);
        if let Some(spline) = &mut next.output {
            spline.set(output);
        }
        next
    }

    /// The number of identifiable parameters: all of a branch except three (for the scales of its blocks and the level of its
    /// nonlinearity), one offset, and all of the last nonlinearity except its scale and its level.
    ///
    /// Branches of one input that share their poles can be mixed, so the number is then too large; the criterion counts all.
    pub fn degrees(&self) -> usize {
        let branches: usize = self.branches.iter().map(|b| b.parameters().len() - 3).sum();
        branches + 1 + self.output.as_ref().map_or(0, |o| o.count() - 2)
    }

    /// Samples after which the slowest branch has settled.
    pub fn settling(&self, share: f64) -> usize {
        let each = self.branches.iter().map(|b| b.delay + b.back.settling(share));
        each.max().unwrap_or(0)
    }
}

/// One of a system's nonlinearities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identify) enum Part {
    /// The nonlinearity of the branch of this index.
    Branch(usize),
    /// The last one.
    Output,
}

impl System {
    /// All nonlinearities, the last one first.
    pub fn parts(&self) -> Vec<Part> {
        let last = self.output.iter().map(|_| Part::Output);
        last.chain((0..self.branches.len()).map(Part::Branch)).collect()
    }

    /// The nonlinearity; `None` if there is none of this kind.
    pub fn spline(&self, part: Part) -> Option<&KinkedSpline> {
        match part {
            Part::Branch(i) => self.branches.get(i).map(|b| &b.spline),
            Part::Output => self.output.as_ref(),
        }
    }

    /// The nonlinearity, to be changed.
    pub fn spline_mut(&mut self, part: Part) -> Option<&mut KinkedSpline> {
        match part {
            Part::Branch(i) => self.branches.get_mut(i).map(|b| &mut b.spline),
            Part::Output => self.output.as_mut(),
        }
    }

    /// The number of pieces.
    pub fn pieces(&self, part: Part) -> usize {
        self.spline(part).map_or(0, KinkedSpline::pieces)
    }

    /// The input of a nonlinearity at the samples that count, without the delay.
    pub fn entering(&self, part: Part, data: &Signals) -> Vec<f64> {
        let entering = match part {
            Part::Branch(i) => self.branches[i].front.run(&data.u[self.branches[i].input]),
            Part::Output => self.inner(&data.u),
        };
        entering[data.from..].to_vec()
    }

    /// Divides the input of a branch's nonlinearity. Of the nonlinearity, only the places of its kinks are adapted.
    pub fn divide_front(&mut self, branch: usize, divisor: f64) {
        let Some(branch) = self.branches.get_mut(branch) else {
            return;
        };
        let between = branch.between.iter_mut().flat_map(|b| &mut b.front);
        branch.front.b.iter_mut().chain(between).for_each(|b| *b /= divisor);
        branch.spline.kinks.iter_mut().for_each(|k| k.at /= divisor);
    }
}

/// The parts of a branch whose structure may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identify) struct FreeParts {
    pub front: bool,
    pub back: bool,
    /// The delay; without a front, a fast pole that imitates a delay as well.
    pub delay: bool,
    /// An instant between the samples at which the nonlinearity acts.
    pub between: bool,
}

impl FreeParts {
    const NONE: FreeParts = FreeParts {
        front: false,
        back: false,
        delay: false,
        between: false,
    };
    /// Static, linear.
    pub const HAMMERSTEIN: FreeParts = FreeParts {
        back: true,
        ..FreeParts::NONE
    };
    /// Static, linear, after a delay that the search chooses: every input has its own.
    pub const DELAYED_HAMMERSTEIN: FreeParts = FreeParts {
        delay: true,
        ..FreeParts::HAMMERSTEIN
    };
    /// Linear, static.
    pub const WIENER: FreeParts = FreeParts {
        front: true,
        delay: true,
        ..FreeParts::NONE
    };
    /// Linear, static, linear.
    pub const WIENER_HAMMERSTEIN: FreeParts = FreeParts {
        front: true,
        back: true,
        delay: true,
        between: true,
    };
}

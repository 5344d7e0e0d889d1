//! A sum of cascades of one input, and its simulation error.

use super::super::{
    Candidate, Cascade, CascadeLoss, Data, Monitor, Residuals, descend, efficient, parameters, schwarz,
};

/// Cascades whose outputs add up, and their sum of squared errors.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Sum {
    pub branches: Vec<Cascade>,
    pub squares: f64,
}

impl Sum {
    pub fn new(branches: Vec<Cascade>, data: &Data) -> Sum {
        let mut sum = Sum { branches, squares: 0.0 };
        sum.squares = data.squares(&sum.run(&data.u));
        sum
    }

    pub fn run(&self, u: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; u.len()];
        for branch in &self.branches {
            sum.iter_mut().zip(branch.run(u)).for_each(|(s, y)| *s += y);
        }
        sum
    }

    /// The parameters that only one choice of them fits: of every branch all but the two scales and the output's offset, and one
    /// level of the nonlinearities for all branches.
    ///
    /// Branches that share their poles can be mixed, so that these are too many by that; they are counted nevertheless.
    pub fn degrees(&self) -> usize {
        let branches = self.branches.iter().map(parameters);
        branches.sum::<usize>() - (self.branches.len() - 1)
    }

    /// Schwarz's criterion.
    pub fn bic(&self, data: &Data) -> f64 {
        schwarz(self.squares, self.degrees(), data)
    }

    /// What the sum leaves of the output.
    pub fn left(&self, data: &Data) -> Data {
        let mut left = data.clone();
        left.y.iter_mut().zip(self.run(&data.u)).for_each(|(y, o)| *y -= o);
        left
    }

    /// A branch, to be fitted to what the others leave.
    pub fn alone(&self, branch: usize, data: &Data) -> (Candidate, Data) {
        let mut left = data.clone();
        for (_, other) in self.branches.iter().enumerate().filter(|(i, _)| *i != branch) {
            left.y.iter_mut().zip(other.run(&data.u)).for_each(|(y, o)| *y -= o);
        }
        let alone = Candidate {
            cascade: self.branches[branch].clone(),
            squares: self.squares,
        };
        (alone, left)
    }

    /// All parameters fitted from where they are; what was, if that fails.
    pub fn fitted(self, data: &Data, steps: usize, tolerance: f64, monitor: &mut Monitor<'_>) -> Sum {
        let loss = SumLoss::new(&self, data);
        match descend(&loss, loss.start(), steps, tolerance, monitor) {
            Some((p, squares)) => Sum {
                branches: loss.branches(&p),
                squares,
            },
            None => self,
        }
    }

    /// The parameters by generalised least squares, if the error is coloured noise.
    pub fn efficient(self, data: &Data, monitor: &mut Monitor<'_>) -> Sum {
        let loss = SumLoss::new(&self, data);
        match efficient(&loss, &loss.start(), monitor) {
            Some((p, squares)) => Sum {
                branches: loss.branches(&p),
                squares,
            },
            None => self,
        }
    }
}

/// The simulation error over the branches' free parameters, one branch after the other.
struct SumLoss<'a> {
    data: &'a Data,
    each: Vec<CascadeLoss<'a>>,
}

impl<'a> SumLoss<'a> {
    /// The first branch has the level of all nonlinearities.
    fn new(at: &Sum, data: &'a Data) -> Self {
        let loss = |(i, branch): (usize, &Cascade)| {
            let loss = CascadeLoss::new(branch.clone(), data);
            if i == 0 { loss } else { loss.without_level() }
        };
        SumLoss {
            data,
            each: at.branches.iter().enumerate().map(loss).collect(),
        }
    }

    fn start(&self) -> Vec<f64> {
        self.each.iter().flat_map(CascadeLoss::start).collect()
    }

    /// Every branch's loss and free parameters.
    fn split<'p>(&self, mut parameters: &'p [f64]) -> impl Iterator<Item = (&CascadeLoss<'a>, &'p [f64])> {
        self.each.iter().map(move |loss| {
            let (mine, others) = parameters.split_at(loss.free());
            parameters = others;
            (loss, mine)
        })
    }

    fn branches(&self, parameters: &[f64]) -> Vec<Cascade> {
        self.split(parameters).map(|(loss, p)| loss.cascade(p)).collect()
    }

    /// The sum of the branches' own errors, from all but one of which the output is taken out.
    fn total(&self, errors: impl Iterator<Item = Vec<f64>>) -> Vec<f64> {
        let others = self.each.len() as f64 - 1.0;
        let mut total: Vec<f64> = self.data.y.iter().map(|y| others * y).collect();
        errors.for_each(|errors| total.iter_mut().zip(errors).for_each(|(t, e)| *t += e));
        total
    }
}

impl Residuals for SumLoss<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let each: Option<Vec<Vec<f64>>> = self.split(parameters).map(|(loss, p)| loss.residuals(p)).collect();
        Some(self.total(each?.into_iter()))
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let (errors, columns): (Vec<Vec<f64>>, Vec<Vec<Vec<f64>>>) =
            self.split(parameters).map(|(loss, p)| loss.linearise(p)).unzip();
        (self.total(errors.into_iter()), columns.into_iter().flatten().collect())
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::super::super::{Rational, Shape};
    use super::*;
    use crate::identify::derivative_tests::assert_derivatives;
    use crate::linear::Complex;

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..n).map(|_| rng.random_range(-1.5..1.5)).collect()
    }

    fn branch(front: &[f64], back: &[f64], c: &[f64]) -> Cascade {
        let linear = |poles: &[f64]| {
            let poles: Vec<Complex<f64>> = poles.iter().map(|p| Complex::new(*p, 0.0)).collect();
            Rational::from_roots(&[], &poles)
        };
        let mut shape = Shape::new(&[-1.0, 0.1, 1.2]);
        shape.c.copy_from_slice(c);
        Cascade {
            front: linear(front),
            shape,
            back: linear(back),
            between: None,
            offset: 0.0,
        }
    }

    #[test]
    fn every_derivative_agrees_with_a_difference_and_a_gain_in_front_is_not_free() {
        let data = Data::new(noise(200, 1), noise(200, 2), 20);
        let sum = Sum::new(
            vec![
                branch(&[0.6], &[0.3, -0.4], &[0.1, -0.5, 0.3, 0.8, 0.2]),
                branch(&[], &[0.7], &[0.4, 0.1, -0.3, 1.0, 0.5]),
            ],
            &data,
        );
        let loss = SumLoss::new(&sum, &data);
        let p = loss.start();
        // Front, shape, back; the second branch without a front and a level. The backs' numerators are scales alone.
        assert_eq!(p.len(), (2 + 5 + 2) + (4 + 1));
        assert_eq!(loss.branches(&p), sum.branches);
        let (residuals, jacobian) = loss.linearise(&p);
        let direct: Vec<f64> = sum.run(&data.u).iter().zip(&data.y).map(|(p, y)| p - y).collect();
        for (got, want) in residuals.iter().zip(&direct) {
            assert!((got - want).abs() < 1e-12, "{got} {want}");
        }
        assert_derivatives(&p, &jacobian, |p| loss.residuals(p).unwrap());
    }
}

//! The columns of a record, checked and scaled, and branches back in the record's units.

use super::super::super::checks::few_levels;
use super::super::super::samples::Samples;
use super::super::{Scale, Shape, abscissas, conventional_gain, mapped, tabulated as table};
use super::system::{Branch, Signals};
use crate::error::Result;
use crate::linear::TransferFunction;
use crate::nonlinearity::Curve;
use crate::record::Record;

/// At most so many samples, the last ones, are fitted; more would only cost memory.
const MOST_SAMPLES: usize = 200_000;
/// Samples that do not count while the settling time is not known.
const FIRST_LEFT_OUT: usize = 500;

/// Inputs and output of a record, the last part of them kept for the verdict.
pub(in crate::identify) struct Columns<'a> {
    pub u: Vec<&'a [f64]>,
    pub y: &'a [f64],
    /// Samples before this are fitted.
    pub fitted: usize,
    pub inputs: Vec<Scale>,
    pub output: Scale,
}

impl<'a> Columns<'a> {
    /// Checks the columns; `what` names the fit in the error about too few samples.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `NonFinite`, `Constant`, `ConstantPart`, `TooShort`,
    /// `Unit`, [`Error::Parameter`] for a share outside 0.05 to 0.9.
    pub fn new(
        record: &'a Record,
        inputs: &[&str],
        output: &str,
        fresh_share: f64,
        what: &'static str,
    ) -> Result<Columns<'a>> {
        let Samples { u, y, fitted } = Samples::of_inputs(record, inputs, output, fresh_share, what)?;
        Ok(Columns {
            inputs: u.iter().map(|u| Scale::new(&u[..fitted])).collect(),
            output: Scale::new(&y[..fitted]),
            u,
            y,
            fitted,
        })
    }

    /// The same columns without their scales.
    pub fn samples(&self) -> Samples<'a> {
        Samples {
            u: self.u.clone(),
            y: self.y,
            fitted: self.fitted,
        }
    }

    /// What is fitted, at zero mean and unit variance.
    pub fn signals(&self) -> Signals {
        let part = self.fitted.saturating_sub(MOST_SAMPLES)..self.fitted;
        let inputs = self.u.iter().zip(&self.inputs);
        let u = inputs.map(|(u, scale)| scale.standardised(&u[part.clone()])).collect();
        let from = (part.len() / 10).min(FIRST_LEFT_OUT);
        Signals::new(u, self.output.standardised(&self.y[part]), from)
    }
}

/// A branch's linear part in the conventional scale, and what it was divided by.
pub(in crate::identify) fn normalised(branch: &Branch) -> Result<(TransferFunction, f64)> {
    let (gain, _) = conventional_gain(&branch.linear, branch.delay)?;
    let mut linear = branch.linear.clone();
    linear.b.iter_mut().for_each(|b| *b /= gain);
    Ok((linear.transfer_function(branch.delay)?, gain))
}

/// A nonlinearity as a table, straight on beyond its ends, with its breakpoints and its kinks' places, both increasing.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Tabulated {
    pub curve: Curve,
    pub breakpoints: Vec<f64>,
    pub kinks: Vec<f64>,
}

/// A nonlinearity as a table over what enters it; at its levels alone where these are few, as nothing is known of it elsewhere. Both
/// functions are applied to the shape's own coordinates.
pub(in crate::identify) fn tabulated(
    shape: &Shape,
    entering: &[f64],
    abscissa: impl Fn(f64) -> f64,
    ordinate: impl Fn(f64) -> f64,
) -> Result<Tabulated> {
    let range = shape.range_with(entering);
    let (points, kinks) = match few_levels(entering) {
        Some(levels) if levels.len() > 1 => (levels, Vec::new()),
        _ => (abscissas(shape, range), shape.kinks_within(range)),
    };
    Ok(Tabulated {
        curve: table(points.into_iter(), &abscissa, |x| ordinate(shape.value(x)))?,
        breakpoints: mapped(shape.breakpoints(), &abscissa),
        kinks: mapped(&kinks, abscissa),
    })
}

#[cfg(test)]
mod tests {
    use super::super::super::Kink;
    use super::*;

    fn straight(breakpoints: &[f64], kinks: &[(f64, f64)]) -> Shape {
        let mut shape = Shape::new(breakpoints);
        shape.straighten();
        shape.kinks = kinks.iter().map(|&(at, bend)| Kink { at, bend }).collect();
        shape
    }

    fn table_of(shape: &Shape, entering: &[f64]) -> Tabulated {
        tabulated(shape, entering, |x| 3e-7 * x, |y| 2e6 * y).unwrap()
    }

    #[test]
    fn a_table_goes_on_as_its_curve_does() {
        let entering: Vec<f64> = (0..=50).map(|i| -1.3 + f64::from(i) * 0.1).collect();
        let last = entering[50];
        // An end that is the samples' but for rounding, and kinks beyond the breakpoints, one of them beyond the samples.
        let shape = straight(
            &[-1.3, 0.4, last * (1.0 - 3e-14)],
            &[(3.2, -1.0), (20.0, 5.0), (-9.0, 0.0)],
        );
        let found = table_of(&shape, &entering);
        let x = found.curve.x();
        assert!(x[x.len() - 1] >= 3e-7 * last * (1.0 - 1e-9) && x[x.len() - 1] < 3e-7 * 3.8);
        for at in [-2.0, -1.3, 0.0, 3.1999, 3.3, 3.7, 5.0] {
            let want = 2e6 * (at - (at - 3.2_f64).max(0.0));
            assert!((found.curve.value(3e-7 * at) - want).abs() < 1e-3, "{at}");
        }
        assert_eq!(found.kinks.len(), 1);
        assert!((found.kinks[0] - 3e-7 * 3.2).abs() < 1e-15);
    }

    #[test]
    fn of_few_levels_only_these_are_told() {
        let mut shape = straight(&[-1.0, 1.0], &[]);
        // What two levels leave open.
        (shape.c[1], shape.c[2]) = (1e90, -1e90);
        let found = table_of(&shape, &[1.0, -1.0, -1.0, 1.0]);
        assert_eq!(found.curve.x(), [-3e-7, 3e-7]);
        assert!(found.curve.value(0.0).abs() < 1e-3 && (found.curve.value(3e-7) - 2e6).abs() < 1e-3);
    }
}

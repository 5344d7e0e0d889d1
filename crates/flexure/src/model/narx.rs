//! A polynomial of past outputs and inputs.
//!
//! A polynomial that is fed back can run away. Values that are fed back are held within bounds, so that every free run is bounded.

use serde::{Deserialize, Serialize};

use super::LARGEST_LAG;

/// A free run settles within this many samples, or counts as not settling.
const LONGEST_SETTLING: usize = 1000;

/// A monomial and its coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NarxTerm {
    /// The factors, with repetitions. An index i below the number of past outputs is the output i + 1 samples ago; larger ones are inputs,
    /// beginning with that `delay` samples ago.
    pub factors: Vec<usize>,
    /// The coefficient, for inputs and outputs at zero mean and unit variance.
    pub coefficient: f64,
}

/// A polynomial of past outputs and inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NarxModel {
    /// The number of past outputs.
    pub outputs: usize,
    /// The number of past inputs.
    pub inputs: usize,
    /// The age of the latest input, samples.
    pub delay: usize,
    /// The constant, in the unit of the coefficients.
    pub constant: f64,
    /// The monomials.
    pub terms: Vec<NarxTerm>,
    /// Mean and standard deviation of the input, and of the output.
    pub scales: [(f64, f64); 2],
    /// Outputs that are fed back are held between these, at zero mean and unit variance.
    pub held: (f64, f64),
}

/// A free run on scaled signals.
pub(crate) struct FreeRun {
    pub output: Vec<f64>,
    /// Whether no sample had to be held.
    pub bounded: bool,
}

impl NarxTerm {
    /// The monomial of these variables, without the coefficient.
    pub(crate) fn value(&self, lagged: &[f64]) -> f64 {
        self.factors.iter().map(|i| lagged[*i]).product()
    }
}

impl NarxModel {
    /// The free-run response to `input`, one value per sample, from rest at the means; NaN where there is a
    /// [`problem`](Self::problem).
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        if self.problem().is_some() {
            return vec![f64::NAN; input.len()];
        }
        let [(u_mean, u_spread), (y_mean, y_spread)] = self.scales;
        let u: Vec<f64> = input.iter().map(|u| (u - u_mean) / u_spread).collect();
        self.run(&u).output.iter().map(|y| y_mean + y_spread * y).collect()
    }

    /// Why the model cannot be simulated.
    pub fn problem(&self) -> Option<String> {
        let lags = [self.outputs, self.inputs, self.delay];
        if let Some(lag) = lags.iter().find(|l| **l > LARGEST_LAG) {
            return Some(format!("a lag is {lag}, but must be at most {LARGEST_LAG}"));
        }
        let variables = self.outputs + self.inputs;
        let factor = self.terms.iter().flat_map(|t| &t.factors).find(|i| **i >= variables);
        if let Some(i) = factor {
            return Some(format!(
                "a term has factor {i}, but there are only {variables} variables"
            ));
        }
        let (low, high) = self.held;
        if !(low <= high) {
            return Some(format!(
                "the output is held between {low} and {high}, which are not in order"
            ));
        }
        let spreads = [("input", self.scales[0].1), ("output", self.scales[1].1)];
        let wrong = spreads.iter().find(|s| !(s.1 > 0.0 && s.1.is_finite()));
        wrong.map(|(which, spread)| format!("the {which}'s spread is {spread}, but must be positive and finite"))
    }

    /// The samples, at most 1000, after which two free runs under the mean input, started from both ends of the fitted output's range, have
    /// approached each other to `share` of their distance.
    pub(crate) fn settling(&self, share: f64) -> usize {
        if self.problem().is_some() {
            return 0;
        }
        let run = |start: f64| {
            let before = self.outputs.max(1);
            let mut y = vec![start; before];
            let u = vec![0.0; before + LONGEST_SETTLING];
            let mut lagged = vec![0.0; self.outputs + self.inputs];
            for n in before..u.len() {
                self.fill(&mut lagged, &y, &u, n);
                y.push(self.within(self.value(&lagged)));
            }
            y.split_off(before)
        };
        // Values that are fed back are limited to the range in the fit, extended by its span on either side.
        let span = (self.held.1 - self.held.0) / 3.0;
        let (low, high) = (run(self.held.0 + span), run(self.held.1 - span));
        let apart = low
            .iter()
            .zip(&high)
            .rposition(|(l, h)| !((h - l).abs() <= share * span));
        self.delay + self.inputs + apart.map_or(0, |n| n + 1)
    }

    /// A fed-back value, limited to its bounds.
    fn within(&self, value: f64) -> f64 {
        match value.is_nan() {
            true => 0.0_f64.clamp(self.held.0, self.held.1),
            false => value.clamp(self.held.0, self.held.1),
        }
    }

    /// The free run on scaled signals.
    pub(crate) fn run(&self, u: &[f64]) -> FreeRun {
        let mut y: Vec<f64> = Vec::with_capacity(u.len());
        let (mut lagged, mut bounded) = (vec![0.0; self.outputs + self.inputs], true);
        for n in 0..u.len() {
            self.fill(&mut lagged, &y, u, n);
            let value = self.value(&lagged);
            let within = self.within(value);
            bounded &= within == value;
            y.push(within);
        }
        FreeRun { output: y, bounded }
    }

    /// The variables of sample `n`; zero before the record.
    pub(crate) fn fill(&self, lagged: &mut [f64], y: &[f64], u: &[f64], n: usize) {
        let (outputs, inputs) = lagged.split_at_mut(self.outputs);
        for (i, v) in outputs.iter_mut().enumerate() {
            *v = n.checked_sub(i + 1).map_or(0.0, |k| y[k]);
        }
        for (i, v) in inputs.iter_mut().enumerate() {
            *v = n.checked_sub(i + self.delay).map_or(0.0, |k| u[k]);
        }
    }

    fn value(&self, lagged: &[f64]) -> f64 {
        let terms = self.terms.iter().map(|t| t.coefficient * t.value(lagged));
        self.constant + terms.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_contradicts_itself_has_no_response() {
        let term = NarxTerm {
            coefficient: 0.5,
            factors: vec![0],
        };
        let good = NarxModel {
            outputs: 1,
            inputs: 1,
            delay: 0,
            constant: 0.0,
            terms: vec![term],
            scales: [(0.0, 1.0); 2],
            held: (-3.0, 3.0),
        };
        assert_eq!(good.simulate(&[1.0; 5]), [0.0; 5]);
        let mut no_such_variable = good.clone();
        no_such_variable.terms[0].factors = vec![2];
        for bad in [
            no_such_variable,
            NarxModel {
                held: (3.0, -3.0),
                ..good.clone()
            },
            NarxModel {
                delay: usize::MAX,
                ..good.clone()
            },
        ] {
            assert!(bad.problem().is_some());
            assert!(bad.simulate(&[1.0; 5]).iter().all(|y| y.is_nan()));
            assert_eq!(bad.settling(0.01), 0);
        }
    }
}

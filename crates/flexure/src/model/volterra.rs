//! A Volterra series of second order.

use serde::{Deserialize, Serialize};

use super::LARGEST_LAG;

/// A second-order Volterra series about the input's mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VolterraModel {
    /// The delay s in samples.
    pub delay: usize,
    /// The input level; the kernels' arguments are deviations from it.
    pub input_level: f64,
    /// $h_0$, the output under that input.
    pub constant: f64,
    /// $h_1$.
    pub first: Vec<f64>,
    /// $h_2$, symmetric, row-major.
    pub second: Vec<f64>,
    /// The number of lags of $h_2$.
    pub second_memory: usize,
}

impl VolterraModel {
    /// Why the model cannot be simulated.
    pub fn problem(&self) -> Option<String> {
        if self.delay > LARGEST_LAG {
            return Some(format!(
                "the delay is {}, but must be at most {LARGEST_LAG}",
                self.delay
            ));
        }
        let expected = self.second_memory.checked_mul(self.second_memory);
        (expected != Some(self.second.len())).then(|| {
            format!(
                "the second-order kernel has {} values, but {} lags squared are needed",
                self.second.len(),
                self.second_memory
            )
        })
    }

    /// The samples after which an input no longer has an effect.
    pub(crate) fn memory(&self) -> usize {
        self.delay.saturating_add(self.first.len().max(self.second_memory))
    }

    /// The response to `input`, one value per sample; before the record the input is assumed to be at its level. NaN where there is a
    /// [`problem`](Self::problem).
    pub fn simulate(&self, input: &[f64]) -> Vec<f64> {
        if self.problem().is_some() {
            return vec![f64::NAN; input.len()];
        }
        let deviation = |n: usize, lag: usize| {
            n.checked_sub(self.delay + lag)
                .map_or(0.0, |k| input[k] - self.input_level)
        };
        let mut recent = vec![0.0; self.first.len().max(self.second_memory)];
        (0..input.len())
            .map(|n| {
                recent
                    .iter_mut()
                    .enumerate()
                    .for_each(|(lag, u)| *u = deviation(n, lag));
                let dot = |h: &[f64]| h.iter().zip(&recent).map(|(h, u)| h * u).sum::<f64>();
                let rows = self.second.chunks_exact(self.second_memory.max(1));
                let second: f64 = rows.zip(&recent).map(|(row, u)| u * dot(row)).sum();
                self.constant + dot(&self.first) + second
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_contradicts_itself_has_no_response() {
        let good = VolterraModel {
            delay: 1,
            input_level: 0.0,
            constant: 0.5,
            first: vec![2.0],
            second: vec![1.0],
            second_memory: 1,
        };
        assert_eq!(good.simulate(&[1.0, 1.0]), [0.5, 3.5]);
        for bad in [
            VolterraModel {
                delay: usize::MAX,
                ..good.clone()
            },
            VolterraModel {
                second_memory: 2,
                ..good.clone()
            },
        ] {
            assert!(bad.problem().is_some() && bad.memory() >= bad.second_memory);
            assert!(bad.simulate(&[1.0; 3]).iter().all(|y| y.is_nan()));
        }
    }
}

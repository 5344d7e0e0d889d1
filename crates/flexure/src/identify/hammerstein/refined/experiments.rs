//! One or several experiments as one sequence of samples, with the missing samples and the start of each experiment.

use std::ops::Range;

use super::super::FEWEST_SAMPLES;
use crate::error::{Error, Result};
use crate::identify::checks::{both_vary, fresh_part};
use crate::record::{Record, bridged};

/// The samples of all experiments.
pub(super) struct Experiments {
    pub u: Vec<f64>,
    /// The output, interpolated linearly over missing samples.
    pub y: Vec<f64>,
    pub missing: Vec<bool>,
    /// The experiments.
    pub parts: Vec<Range<usize>>,
    /// Samples before this are fitted.
    pub fitted: usize,
}

impl Experiments {
    /// Checks and joins the experiments' columns.
    pub fn new(
        records: &[&Record],
        input: &str,
        output: &str,
        may_miss: bool,
        fresh_share: f64,
    ) -> Result<Experiments> {
        let (mut u, mut y, mut missing, mut parts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for record in records {
            let start = u.len();
            u.extend_from_slice(record.finite(input)?);
            let column = if may_miss {
                record.column(output)?
            } else {
                record.finite(output)?
            };
            if let Some(sample) = column.iter().position(|v| v.is_infinite()) {
                return Err(Error::not_finite(output, sample, column[sample]));
            }
            missing.extend(column.iter().map(|v| v.is_nan()));
            y.extend(bridged(column));
            parts.push(start..u.len());
        }
        let fitted = fresh_part(fresh_share, u.len())?;
        let all = Experiments {
            u,
            y,
            missing,
            parts,
            fitted,
        };
        all.check(input, output)?;
        Ok(all)
    }

    fn check(&self, input: &str, output: &str) -> Result<()> {
        let observed = |part: Range<usize>| self.missing[part].iter().filter(|m| !**m).count();
        if observed(0..self.fitted) < FEWEST_SAMPLES {
            return Err(Error::too_short(
                "a Hammerstein fit (besides the fresh part and missing samples)",
                FEWEST_SAMPLES,
                observed(0..self.fitted),
            ));
        }
        if observed(self.fitted..self.y.len()) == 0 {
            return Err(Error::too_short("the fresh part (besides missing samples)", 1, 0));
        }
        both_vary(&[(input, &self.u), (output, &self.y)], self.fitted)
    }

    /// The experiments' samples that are fitted.
    pub fn fitted_parts(&self) -> Vec<Range<usize>> {
        let cut = |p: &Range<usize>| p.start.min(self.fitted)..p.end.min(self.fitted);
        self.parts.iter().map(cut).filter(|p| !p.is_empty()).collect()
    }

    /// The longest experiment.
    pub fn longest(&self) -> Range<usize> {
        self.parts.iter().max_by_key(|p| p.len()).cloned().unwrap_or(0..0)
    }

    /// The first samples of the longest experiment.
    pub fn head_of_longest(&self, length: usize, input: &str, output: &str) -> Record {
        let start = self.longest().start;
        let part = start..start + length;
        Record::from_equal([(input, self.u[part.clone()].to_vec()), (output, self.y[part].to_vec())])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_split_cuts_the_last_experiment() {
        let wave = |n: usize, offset: usize| -> Vec<f64> { (0..n).map(|i| ((i + offset) as f64).sin()).collect() };
        let record = |n, offset| Record::from_equal([("u", wave(n, offset)), ("y", wave(n, offset + 1))]);
        let (a, b) = (record(300, 0), record(100, 7));
        let all = Experiments::new(&[&a, &b], "u", "y", false, 0.1).unwrap();
        assert_eq!((all.parts.clone(), all.fitted), (vec![0..300, 300..400], 360));
        assert_eq!(all.fitted_parts(), [0..300, 300..360]);
        assert_eq!(all.longest(), 0..300);
        let most = Experiments::new(&[&a, &b], "u", "y", false, 0.5).unwrap();
        assert_eq!((most.fitted_parts().len(), most.fitted_parts()[0].end), (1, 200));
    }
}

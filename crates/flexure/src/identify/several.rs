//! What identifications from several inputs share: what they refuse, and how they are judged.

use super::branches::Columns;
use super::checks::warn_of_levels;
use super::outcome::{Verdict, Warning};
use crate::error::{Error, Result};
use crate::linear::correlation::mean;
use crate::validation::Estimated;

/// Refuses an input that is given twice.
pub(super) fn refuse_repeated(inputs: &[&str]) -> Result<()> {
    let twice = inputs.iter().enumerate().find(|(i, name)| inputs[..*i].contains(name));
    twice.map_or(Ok(()), |(_, name)| {
        Err(Error::DuplicateColumn {
            name: (*name).to_owned(),
        })
    })
}

/// The verdicts on a free run of a model of so many parameters, one an input and then one a pair of inputs, and what the user
/// should know.
///
/// A pair stands for the product of its inputs' deviations from their means: what inputs do together, and none alone, does not turn
/// up in a test with any one of them.
pub(super) fn judged(columns: &Columns, predicted: &[f64], parameters: usize) -> Result<(Vec<Verdict>, Vec<Warning>)> {
    let fitted = columns.fitted;
    let estimated = Estimated {
        parameters,
        samples: fitted,
    };
    let fresh: Vec<&[f64]> = columns.u.iter().map(|u| &u[fitted..]).collect();
    let deviations: Vec<Vec<f64>> = (fresh.iter())
        .map(|u| {
            let centre = mean(u);
            u.iter().map(|u| u - centre).collect()
        })
        .collect();
    let pairs = (0..fresh.len()).flat_map(|i| (i + 1..fresh.len()).map(move |j| (i, j)));
    let products = pairs.map(|(i, j)| deviations[i].iter().zip(&deviations[j]).map(|(a, b)| a * b).collect());
    let tested: Vec<Vec<f64>> = fresh.iter().map(|u| u.to_vec()).chain(products).collect();
    let of = |u: &Vec<f64>| Verdict::of_estimate(u, &columns.y[fitted..], &predicted[fitted..], estimated);
    let verdicts: Vec<Verdict> = tested.iter().map(of).collect::<Result<_>>()?;
    let mut warnings = Vec::new();
    for u in &columns.u {
        warn_of_levels(&u[..fitted], &mut warnings);
    }
    if let Some(fit_percent) = verdicts.first().map(|v| v.measures.fit_percent).filter(|f| *f <= 0.0) {
        warnings.push(Warning::Useless { fit_percent });
    }
    Ok((verdicts, warnings))
}

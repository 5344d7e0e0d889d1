//! Several inputs, each through a nonlinearity and a linear part of its own.
//!
//! $$ Y_n = o + \sum_i G_i(z) z^{-s_i} f_i(U^{(i)}_n) + e_n $$
//! from the record alone. The search is that of the [Hammerstein-Wiener](crate::identify::HammersteinWiener) system without its
//! last nonlinearity: all inputs at once, from least squares over B-splines of all of them with one common denominator; after
//! that every branch has poles of its own, which Schwarz's criterion takes away where they are not needed. Neither white nor
//! independent inputs are needed, only inputs that do not determine one another.
//!
//! By convention every linear part has unit static gain (unit peak gain, where the static gain is less than a tenth of that)
//! and every nonlinearity zero mean over the fit's inputs; the offset has the rest.

use std::ops::ControlFlow;

use super::super::block::{Columns, Monitor, Signals, Stage, System, TriedBranches, ends, normalised, tabulated};
use super::super::outcome::{Verdict, Warning};
use super::super::samples::refuse_repeated;
use crate::error::{Error, Result};
use crate::linear::TransferFunction;
use crate::linear::correlation::mean;
use crate::model::Block;
use crate::nonlinearity::Curve;
use crate::record::Record;

/// The identification of a sum of Hammerstein branches, one an input.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `fresh_share` | share at the end kept for the verdict | 0.05 to 0.9 | 0.25 |
///
/// ```
/// use flexure::identify::MultipleInputs;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let mut input = || -> Vec<f64> { (0..3000).map(|_| random.random_range(-1.0..1.0)).collect() };
/// let (p, q) = (input(), input());
/// let mut y = vec![0.0; 3000];
/// for n in 1..3000 {
///     y[n] = 0.6 * y[n - 1] + p[n].powi(2) + q[n - 1].tanh();
/// }
/// let record = Record::new([("p", p), ("q", q), ("y", y)])?;
/// let result = MultipleInputs::default().identify(&record, &["p", "q"], "y")?;
/// assert_eq!(result.branches[1].delay, 1);
/// assert!(result.fit_percent() > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultipleInputs {
    /// The share of the record that the verdict is made on.
    pub fresh_share: f64,
}

impl Default for MultipleInputs {
    fn default() -> Self {
        MultipleInputs { fresh_share: 0.25 }
    }
}

/// A model with one block an input, whose outputs add up.
#[derive(Debug, Clone, PartialEq)]
pub struct MultipleInputsModel {
    /// What every input passes.
    pub blocks: Vec<Block>,
    /// Added to the sum.
    pub offset: f64,
}

impl MultipleInputsModel {
    /// The model as one block of several inputs.
    pub fn block(&self) -> Block {
        Block::Series(vec![Block::Inputs(self.blocks.clone()), Block::Offset(self.offset)])
    }

    /// The free-run response, one value a sample; every linear part starts in the steady state of its input's mean.
    ///
    /// # Errors
    /// [`Error::Data`]: `LengthMismatch` if there are not as many inputs as blocks, or if they differ in length.
    pub fn simulate(&self, inputs: &[&[f64]]) -> Result<Vec<f64>> {
        self.block().simulate_inputs(inputs)
    }
}

/// What one input passes.
#[derive(Debug, Clone, PartialEq)]
pub struct InputBranch {
    /// The input's column.
    pub input: String,
    /// The static nonlinearity, a cubic spline with kinks where the data show them, in tabulated form, straight on beyond the range of
    /// the fit.
    pub nonlinearity: Curve,
    /// Its breakpoints, increasing, in the input's unit.
    pub breakpoints: Vec<f64>,
    /// Points at which its slope changes at once, increasing, in the input's unit.
    pub kinks: Vec<f64>,
    /// The linear part, of unit static or peak gain; the delay is leading zeros of its numerator. Always stable.
    pub linear: TransferFunction,
    /// The delay in samples.
    pub delay: usize,
    /// The number of poles of the linear part.
    pub order: usize,
}

/// An identified system of several inputs with all that was chosen on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct MultipleInputsIdentification {
    /// The model, ready to simulate.
    pub model: MultipleInputsModel,
    /// What every input passes, in the order in which they were given.
    pub branches: Vec<InputBranch>,
    /// Added to the sum of the branches.
    pub output_offset: f64,
    /// The structures that were tried, in order.
    pub tried: Vec<TriedBranches>,
    /// Samples `0..fitted` were used for the fit, the rest for the verdict.
    pub fitted: usize,
    /// The free-run output over all samples.
    pub predicted: Vec<f64>,
    /// The verdicts on the samples from `fitted` on, one an input and then one a pair of inputs: the fit is the same in all, the
    /// residual tests look for this input, or the product of these inputs' deviations, in the error.
    pub verdicts: Vec<Verdict>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl MultipleInputsIdentification {
    /// The free-run fit on fresh data, percent.
    pub fn fit_percent(&self) -> f64 {
        self.verdicts.first().map_or(f64::NAN, |v| v.measures.fit_percent)
    }

    /// Whether the model holds for every input and every pair of them.
    pub fn holds(&self) -> bool {
        self.verdicts.iter().all(Verdict::holds)
    }
}

impl MultipleInputs {
    /// Identifies the system from `inputs` to `output`.
    ///
    /// # Errors
    /// [`Error::Data`]: `MissingColumn`, `DuplicateColumn` for an input that is given twice, `NonFinite`,
    /// `Constant`, `ConstantPart`, `TooShort` (no input, or fewer than 200 samples an input for the
    /// fit), `Unit`, [`Error::Parameter`] for a parameter outside its range.
    pub fn identify(&self, record: &Record, inputs: &[&str], output: &str) -> Result<MultipleInputsIdentification> {
        self.identify_with(record, inputs, output, &mut |_| ControlFlow::Continue(()))
    }

    /// [`identify`](Self::identify), with `progress` called before every step; it stops the identification by returning
    /// [`ControlFlow::Break`].
    ///
    /// The result depends neither on `progress` nor on the number of threads.
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify), and [`Error::Stopped`] if `progress` stopped it.
    pub fn identify_with(
        &self,
        record: &Record,
        inputs: &[&str],
        output: &str,
        progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<MultipleInputsIdentification> {
        let what = "a fit with several inputs (besides the fresh part)";
        if inputs.is_empty() {
            return Err(Error::too_short(what, 1, 0));
        }
        refuse_repeated(inputs)?;
        let columns = Columns::new(record, inputs, output, self.fresh_share, what)?;
        let data = columns.signals();
        let mut monitor = Monitor::new(progress);
        let found = ends::find(&data, false, &mut monitor);
        monitor.finished()?;
        let found = found.unwrap_or_else(|| ends::without_start(false));
        let (system, tried) = (found.system, found.tried.into_iter().map(TriedBranches::from).collect());
        let (branches, output_offset) = in_units(&system, &data, &columns, inputs)?;
        let model = MultipleInputsModel {
            blocks: (branches.iter())
                .map(|b| {
                    Block::Series(vec![
                        Block::Static(b.nonlinearity.clone()),
                        Block::Linear(b.linear.clone()),
                    ])
                })
                .collect(),
            offset: output_offset,
        };
        let fitted = columns.fitted;
        let predicted = match model.blocks.is_empty() {
            true => vec![output_offset; columns.y.len()],
            false => model.simulate(&columns.u)?,
        };
        let (verdicts, warnings) = columns.samples().verdicts(&predicted, Some(system.degrees()))?;
        Ok(MultipleInputsIdentification {
            model,
            branches,
            output_offset,
            tried,
            fitted,
            predicted,
            verdicts,
            warnings,
        })
    }
}

/// The branches in the record's units and the conventional scale, and the offset.
fn in_units(system: &System, data: &Signals, columns: &Columns, names: &[&str]) -> Result<(Vec<InputBranch>, f64)> {
    let mut offset = columns.output.back(system.offset());
    let mut branches = Vec::new();
    for (i, branch) in system.branches.iter().enumerate() {
        let (linear, gain) = normalised(branch)?;
        let level = mean(&data.u[i].iter().map(|u| branch.spline.value(*u)).collect::<Vec<_>>());
        let scale = columns.output.spread * gain;
        let abscissa = |u: f64| columns.inputs[i].back(u);
        let nonlinearity = tabulated(&branch.spline, &data.u[i][data.from..], abscissa, |v| {
            scale * (v - level)
        })?;
        let fixed = linear.static_gain();
        if fixed.is_finite() {
            offset += fixed * scale * level;
        }
        branches.push(InputBranch {
            input: names[i].to_owned(),
            nonlinearity: nonlinearity.curve,
            breakpoints: nonlinearity.breakpoints,
            kinks: nonlinearity.kinks,
            delay: linear.b().iter().take_while(|b| **b == 0.0).count(),
            order: linear.a().len() - 1,
            linear,
        });
    }
    Ok((branches, offset))
}

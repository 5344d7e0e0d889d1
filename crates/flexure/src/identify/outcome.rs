//! Whether a model holds on fresh data.

use super::limits::{MOST_OF_THE_ERROR, MOSTLY, NEARLY_ALL, NEGLIGIBLE_MISFIT};
use crate::linear::correlation::about_mean;
use crate::outliers::standing_alone;
use crate::text::{self, counted, nearly_all, p_value, percent};
use crate::validation::{Estimated, FitMeasures, ResidualTest, ResidualTests};

/// The answer to "does the model hold?", on data that were not used for the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// How good the free-run prediction is.
    pub measures: FitMeasures,
    /// Tests of its errors; `None` if the fresh part is too short for them.
    pub residuals: Option<ResidualTests>,
    /// What the model was estimated from, if the tests allow for its estimation error.
    pub estimated: Option<Estimated>,
    /// The outliers that hide the rest of the error from the tests, if there are some.
    pub hidden_by: Option<Hiding>,
    /// Where the free run leaves the measured output for good, if it grows without bound.
    pub runs_away: Option<RunsAway>,
}

/// Where a free run leaves the measured output for good.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunsAway {
    /// The first sample that is out of reach.
    pub sample: usize,
    /// Its instant in s, where the sample time is known.
    pub time: Option<f64>,
}

impl RunsAway {
    /// Why, and what to do.
    pub const ADVICE: &str = "Its loop is not stable under this input: identify it from a record with such inputs, or take another structure.";

    /// "runs away from sample 20 (t = 0.2 s)".
    pub fn text(&self) -> String {
        let time = self.time.map(|time| format!(" (t = {} s)", text::short(time)));
        format!("runs away from sample {}{}", self.sample, time.unwrap_or_default())
    }
}

/// Samples that stand alone and carry most of the squared error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hiding {
    /// How many.
    pub samples: usize,
    /// Their share of the squared error.
    pub share: f64,
}

impl Hiding {
    fn text(&self) -> String {
        let [carry, hide] = match self.samples {
            1 => ["carries", "hides"],
            _ => ["carry", "hide"],
        };
        let samples = counted(self.samples, "sample");
        format!(
            "Whether it holds is not known: {samples} far from all others {carry} {} of the squared error and {hide} the rest from the \
             tests. The option robust (--robust) leaves them out of the verdict.",
            percent(self.share)
        )
    }

    /// The outliers among these errors, if they carry most of the squared error; `r_squared` is the share of the output's variance that the
    /// model explains.
    fn among(errors: &[f64], r_squared: f64) -> Option<Self> {
        if r_squared >= MOSTLY {
            return None;
        }
        let squares = |at: &mut dyn Iterator<Item = f64>| at.map(|e| e * e).sum::<f64>();
        let found = standing_alone(errors);
        let share = squares(&mut found.iter().map(|&t| errors[t])) / squares(&mut errors.iter().copied());
        (share > MOST_OF_THE_ERROR).then_some(Hiding {
            samples: found.len(),
            share,
        })
    }
}

/// The common parts of all verdicts on one prediction.
struct Judged {
    measures: FitMeasures,
    errors: Vec<f64>,
    hidden_by: Option<Hiding>,
}

impl Judged {
    fn new(y: &[f64], predicted: &[f64]) -> crate::Result<Self> {
        let measures = FitMeasures::new(y, predicted)?;
        let errors: Vec<f64> = y.iter().zip(predicted).map(|(y, p)| y - p).collect();
        Ok(Judged {
            hidden_by: Hiding::among(&errors, measures.r_squared),
            measures,
            errors,
        })
    }

    fn verdict(
        &self,
        test: impl FnOnce(&[f64]) -> crate::Result<ResidualTests>,
        estimated: Option<Estimated>,
    ) -> Verdict {
        Verdict {
            measures: self.measures,
            residuals: test(&self.errors).ok(),
            estimated,
            hidden_by: self.hidden_by,
            runs_away: None,
        }
    }
}

impl Verdict {
    /// Judges a free-run prediction of `y` under the input `u`.
    ///
    /// # Errors
    /// Those of [`FitMeasures::new`].
    pub fn new(u: &[f64], y: &[f64], predicted: &[f64]) -> crate::Result<Self> {
        let judged = Judged::new(y, predicted)?;
        Ok(judged.verdict(|e| ResidualTests::with_prediction(e, u, predicted), None))
    }

    /// As [`Verdict::new`], for the prediction of a model that was estimated from other samples; the tests allow for the error of its
    /// parameters.
    ///
    /// # Errors
    /// Those of [`FitMeasures::new`].
    pub fn of_estimate(u: &[f64], y: &[f64], predicted: &[f64], estimated: Estimated) -> crate::Result<Self> {
        let test = |e: &[f64]| ResidualTests::of_estimate(e, u, predicted, estimated);
        Ok(Judged::new(y, predicted)?.verdict(test, Some(estimated)))
    }

    /// The verdicts for several inputs: one for each input, then one for each pair of inputs. The model is an estimate if `estimated` says
    /// from what.
    ///
    /// A pair stands for the product of its inputs' deviations from their means: a test with a single input does not show joint effects of
    /// inputs. All verdicts share the level of a single one.
    ///
    /// # Errors
    /// Those of [`FitMeasures::new`].
    pub fn of_inputs(
        inputs: &[&[f64]],
        y: &[f64],
        predicted: &[f64],
        estimated: Option<Estimated>,
    ) -> crate::Result<Vec<Self>> {
        let deviations: Vec<Vec<f64>> = inputs.iter().map(|u| about_mean(u)).collect();
        let pairs = (0..inputs.len()).flat_map(|i| (i + 1..inputs.len()).map(move |j| (i, j)));
        let products = pairs.map(|(i, j)| deviations[i].iter().zip(&deviations[j]).map(|(a, b)| a * b).collect());
        let tested: Vec<Vec<f64>> = inputs.iter().map(|u| u.to_vec()).chain(products).collect();
        let judged = Judged::new(y, predicted)?;
        let of = |u: &Vec<f64>| {
            let test = |e: &[f64]| ResidualTests::among(e, u, predicted, estimated, tested.len());
            judged.verdict(test, estimated)
        };
        Ok(tested.iter().map(of).collect())
    }

    /// The verdict on a model whose free run grows without bound: it does not hold, and no test of its error says more.
    pub fn running_away(self, runs_away: RunsAway) -> Self {
        Verdict {
            residuals: None,
            hidden_by: None,
            runs_away: Some(runs_away),
            ..self
        }
    }

    /// Among several verdicts on one prediction: the one with the largest [misfit](Self::misfit), otherwise the first that does not hold,
    /// otherwise the first.
    pub fn worst(verdicts: &[Verdict]) -> Option<&Verdict> {
        let refuted = verdicts.iter().filter(|v| v.refutation().is_some());
        // Among equal ones, the first.
        let refuted = refuted.rev().max_by(|a, b| a.misfit().total_cmp(&b.misfit()));
        refuted
            .or_else(|| verdicts.iter().find(|v| !v.holds()))
            .or(verdicts.first())
    }

    /// The test that refutes the model of the system, if one does.
    pub fn refutation(&self) -> Option<&ResidualTest> {
        self.residuals.as_ref().and_then(ResidualTests::refutation)
    }

    /// The size of the part of the error that depends on the input, as a share of the output's standard deviation. It is as large as the
    /// refuting tests detect, and 0 if no test refutes the model.
    pub fn misfit(&self) -> f64 {
        self.refutation().map_or(0.0, |test| self.misfit_seen_by(test))
    }

    /// The [misfit](Self::misfit) that this test sees.
    pub fn misfit_seen_by(&self, test: &ResidualTest) -> f64 {
        self.misfit_of(test.dependent_share())
    }

    /// This share of the error's variance, as a share of the output's standard deviation.
    fn misfit_of(&self, share: f64) -> f64 {
        let unexplained = (1.0 - self.measures.r_squared).max(0.0);
        (share.min(1.0) * unexplained).sqrt()
    }

    /// The largest misfit that is possible: the part of the error that follows from its own past is included.
    fn largest_misfit(&self) -> f64 {
        let colour = self.colour().map_or(0.0, |test| test.effect);
        let largest = |test: &ResidualTest| self.misfit_of(test.dependent_share() + colour);
        self.refutation().map_or(0.0, largest)
    }

    /// Whether the model holds: it explains something; no test refutes it, or the [misfit](Self::misfit) is negligible; and its error is
    /// white noise, or at most a tenth of the output's variance. If outliers hide the rest of the error, nothing is known.
    ///
    /// A misfit is negligible below 1 % of the output's standard deviation. The part of the error that follows from its own past is
    /// included: it may be noise, or depend on the input over a longer time than a test covers.
    ///
    /// A large coloured error may be noise or something that the model misses: even if no test finds the input in it, both are possible.
    pub fn holds(&self) -> bool {
        let is_judged = self.residuals.is_some() && self.hidden_by.is_none();
        self.measures.fit_percent > 0.0 && is_judged && !self.is_refuted() && !self.is_open()
    }

    /// Whether a test refutes the model, and the misfit matters.
    fn is_refuted(&self) -> bool {
        self.largest_misfit() >= NEGLIGIBLE_MISFIT
    }

    /// Whether the error is neither white nor small.
    fn is_open(&self) -> bool {
        self.colour().is_some() && self.measures.r_squared < NEARLY_ALL
    }

    /// The test that finds that the error is coloured, if one does.
    fn colour(&self) -> Option<&ResidualTest> {
        let mut tests = self.residuals.iter().flat_map(|r| &r.tests);
        tests.find(|t| !t.kind.refutes() && !t.passed())
    }

    /// Whether the error is more than negligible and coloured, and no test finds the input in it.
    pub(super) fn may_miss_dynamics(&self) -> bool {
        let is_judged = self.measures.fit_percent > 0.0 && self.hidden_by.is_none();
        is_judged && self.colour().is_some() && self.refutation().is_none() && self.misfit_of(1.0) >= NEGLIGIBLE_MISFIT
    }

    /// The shortest answer, printed after a fit: "holds", "does not hold exactly".
    pub fn in_short(&self) -> &'static str {
        match &self.residuals {
            _ if self.runs_away.is_some() => "does not hold",
            _ if self.holds() && self.refutation().is_some() => "holds, but for a negligible misfit",
            _ if self.holds() => "holds",
            _ if self.hidden_by.is_some() => "hidden by outliers",
            None => "not tested: too few fresh data",
            Some(_) if self.measures.fit_percent <= 0.0 => "does not hold",
            Some(_) if !self.is_refuted() => "neither refuted nor supported",
            Some(_) if self.measures.r_squared >= MOSTLY => "does not hold exactly",
            Some(_) => "does not hold",
        }
    }

    /// Whether the model does not hold, not even nearly: its blocks then are not those of the system.
    pub(super) fn misses_much(&self) -> bool {
        self.is_refuted() && self.measures.r_squared < MOSTLY
    }

    /// The answer as a heading.
    pub fn headline(&self) -> &'static str {
        match &self.residuals {
            _ if self.runs_away.is_some() => "The model does not hold: its simulated output runs away",
            _ if self.holds() && self.refutation().is_some() => {
                "The model holds on fresh data, but for a negligible misfit"
            }
            _ if self.holds() => "The model holds on fresh data",
            _ if self.hidden_by.is_some() => "Outliers hide whether the model holds",
            None => "Too few fresh data to judge the model",
            Some(_) if self.measures.fit_percent <= 0.0 => "The model does not hold on fresh data",
            Some(_) if !self.is_refuted() => "The fresh data do not refute the model, nor do they support it",
            Some(_) if self.measures.r_squared >= MOSTLY => {
                "The model explains most of the fresh data, but does not hold exactly"
            }
            Some(_) => "The model does not hold on fresh data",
        }
    }

    /// The answer in sentences: how much the model explains, then how large the misfit is, then the test that says so.
    pub fn text(&self) -> String {
        let fit = self.measures.fit_percent;
        if let Some(runs_away) = self.runs_away {
            return format!(
                "The model does not hold: on fresh data its simulated output {}. {}",
                runs_away.text(),
                RunsAway::ADVICE
            );
        }
        if fit <= 0.0 && self.hidden_by.is_none() {
            return "The model does not hold: on fresh data it predicts no better than a constant, the output's mean."
                .to_owned();
        }
        let answer = match (self.hidden_by, self.refutation()) {
            (Some(hiding), _) => hiding.text(),
            _ if self.residuals.is_none() => {
                "The fresh part is too short for residual tests: whether the model holds is not known.".to_owned()
            }
            (None, None) => self.unrefuted().to_owned(),
            (None, Some(test)) if self.is_refuted() => self.refuted(test),
            (None, Some(test)) => self.negligible(test),
        };
        format!(
            "On fresh data the model explains {} of the output's variance (fit {}). {answer}",
            nearly_all(self.measures.r_squared.max(0.0)),
            text::fit(fit, 1)
        )
    }

    /// The sentence on a misfit that a test sees, but that is negligible.
    fn negligible(&self, test: &ResidualTest) -> String {
        let (by, misfit) = (seen_by(test), percent(self.misfit()));
        match self.is_open() {
            true => format!(
                "The misfit that a test sees is negligible, {misfit} of the output's standard deviation ({by}). But the error is large and \
                 not white: that is coloured noise or something that the model misses."
            ),
            false => format!(
                "The model holds, but for a negligible misfit of {misfit} of the output's standard deviation ({by})."
            ),
        }
    }

    /// The sentences on a model that this test refutes: what it misses, how much, and what that may be.
    fn refuted(&self, test: &ResidualTest) -> String {
        let exactly = match self.measures.r_squared >= MOSTLY {
            true => " exactly",
            false => "",
        };
        let (least, most) = (percent(self.misfit()), percent(self.largest_misfit()));
        // Where all of the error is seen to depend on the input, its colour adds nothing.
        let (misfit, colour) = match least == most {
            true => (most, ""),
            false => (
                format!("between {least} and {most}"),
                " The error is also correlated in time. These data do not show how much of the correlated part is noise.",
            ),
        };
        format!(
            "It does not hold{exactly}: {} ({}). This misfit is {misfit} of the output's standard deviation.{colour} Either the system has \
             another structure, or the estimate is not exact enough.",
            test.kind.dependence(),
            seen_by(test)
        )
    }

    /// The sentence on a model that no test refutes.
    fn unrefuted(&self) -> &'static str {
        match (self.is_open(), self.colour().is_none()) {
            (true, _) => {
                "No test refutes the model, but its error is large and not white. That is coloured \
                 noise or something that the model misses: these data do not show which."
            }
            (false, true) => "The model holds: no residual test finds a dependence that the model misses.",
            (false, false) => {
                "The model holds: no test finds that its error depends on the input. The error is correlated in time: coloured noise, or a misfit \
                 that the tests do not see."
            }
        }
    }
}

/// The test that sees a misfit.
fn seen_by(test: &ResidualTest) -> String {
    format!("test '{}', {}", test.kind.name(), p_value(test.p_value))
}

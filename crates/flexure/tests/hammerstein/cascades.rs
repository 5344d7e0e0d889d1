//! No record that passes the input checks makes the identification of any structure panic, hang, or return what cannot be used.
//!
//! Every case costs fits of all structures, so only a few run by default; `PROPTEST_CASES=1000 cargo test --release -p flexure --test
//! hammerstein cascades` runs more.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use flexure::Block;
use flexure::identify::{AUTO, Options, Request, Structure, Verdict, Warning};
use proptest::prelude::*;

use super::robustness::{Case, case, simulate};

/// Cases that run unless the environment names another number.
const CASES: u32 = 10;
/// No fit of so few samples may take longer, on any machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// Whether all linear blocks are stable and everything is finite.
fn sound(block: &Block) -> bool {
    let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
    match block {
        Block::Static(curve) => finite(curve.x()) && finite(curve.y()),
        Block::Offset(offset) => offset.is_finite(),
        Block::Linear(g) => g.is_stable_or_integrates() && finite(g.b()) && finite(g.a()),
        Block::Surface(surface) => finite(surface.coefficients()),
        Block::Feedback(model) => model.problem().is_none(),
        Block::Narx(model) => model.problem().is_none(),
        Block::Volterra(model) => model.problem().is_none() && finite(&model.first) && finite(&model.second),
        Block::Series(blocks) | Block::Parallel(blocks) | Block::Inputs(blocks) => {
            !blocks.is_empty() && blocks.iter().all(sound)
        }
    }
}

/// What every identification must return.
fn check(case: &Case, model: &Block, predicted: &[f64], verdict: &Verdict, warnings: &[Warning]) -> Result<(), String> {
    let measures = &verdict.measures;
    let all = [
        (sound(model), "the model is unstable or not finite"),
        (predicted.len() == case.n, "the prediction has another length"),
        (predicted.iter().all(|v| v.is_finite()), "the prediction is not finite"),
        (
            measures.fit_percent.is_finite() && measures.rms.is_finite(),
            "the fit is not finite",
        ),
        (!verdict.text().contains("NaN"), "the verdict has no number"),
        (
            warnings.iter().all(|w| !w.to_string().contains("NaN")),
            "a warning has no number",
        ),
    ];
    match all.iter().find(|(holds, _)| !holds) {
        Some((_, problem)) => Err(format!("{problem}: {model:?}")),
        None => Ok(()),
    }
}

/// An error is fine if it says something.
fn refused(error: &flexure::Error) -> Result<(), String> {
    let message = error.to_string();
    match message.len() > 20
        && !matches!(
            error,
            flexure::Error::Stopped(flexure::error::Stopped::Identifying { .. })
        ) {
        true => Ok(()),
        false => Err(message),
    }
}

fn stopped(start: Instant) -> ControlFlow<()> {
    match start.elapsed() > PATIENCE {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

fn identified(case: &Case, structure: &str) -> Result<(), String> {
    let record = simulate(case);
    let options = Options::with_fresh_share(case.method.fresh_share);
    let start = Instant::now();
    let structure = Structure::by_name(structure).unwrap();
    let records = [&record];
    let request = &Request::new(&records, &["u"], "y", options);
    match structure.identify_with(request, &mut |_| stopped(start)) {
        Ok(r) => check(case, &r.model, &r.predicted, &r.verdict, &r.warnings),
        Err(error) => refused(&error),
    }
}

fn compared(case: &Case) -> Result<(), String> {
    let options = Options::with_fresh_share(case.method.fresh_share);
    let start = Instant::now();
    let record = simulate(case);
    let records = [&record];
    let request = &Request::new(&records, &["u"], "y", options);
    match AUTO.identify_with(request, &mut |_| stopped(start)) {
        Ok(r) => {
            check(case, &r.model, &r.predicted, &r.verdict, &r.warnings)?;
            let structure = r.structure;
            let Some(r) = r.comparison else {
                return Err("there is no comparison".to_owned());
            };
            let numbers = r
                .candidates
                .iter()
                .all(|c| c.fit_percent.is_finite() && c.rms.is_finite());
            let message = r.reasons.iter().all(|r| !r.contains("NaN"));
            let named = r.supported.is_none_or(|s| s == structure);
            match numbers && message && named && (0.0..=1.0).contains(&r.not_noise) {
                true => Ok(()),
                false => Err(format!("{:?}", r.reasons)),
            }
        }
        Err(error) => refused(&error),
    }
}

fn cases() -> ProptestConfig {
    let asked = std::env::var("PROPTEST_CASES")
        .ok()
        .and_then(|cases| cases.parse().ok());
    ProptestConfig {
        cases: asked.unwrap_or(CASES),
        // A failure is shrunk little: every step is a fit.
        max_shrink_iters: 30,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(cases())]
    #[test]
    fn every_structure_gives_a_stable_finite_model_or_says_why_not(case in case(200..1200)) {
        // The Hammerstein system's own test has many more cases.
        for structure in ["linear", "wiener", "wiener-hammerstein"] {
            let outcome = identified(&case, structure);
            prop_assert!(outcome.is_ok(), "{structure}: {outcome:?}");
        }
    }

    #[test]
    fn the_comparison_gives_a_stable_finite_model_or_says_why_not(case in case(200..1200)) {
        let outcome = compared(&case);
        prop_assert!(outcome.is_ok(), "{outcome:?}");
    }
}

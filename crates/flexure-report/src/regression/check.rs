//! Whether a regression page's data fit together.

use crate::Result;
use crate::check::{increasing, nonlinearity, same, score};
use crate::data::{RegressionPage, Scatter, Surface};

/// Checks lengths and abscissas; values may be NaN or infinite, they become gaps.
pub(crate) fn check(page: &RegressionPage) -> Result<()> {
    nonlinearity("curve", &page.curve)?;
    scatter("points", &page.points)?;
    if let Some(s) = &page.surface {
        surface("surface", s)?;
    }
    for (k, slice) in page.slices.iter().enumerate() {
        nonlinearity(&format!("slices[{k}].curve"), &slice.curve)?;
    }
    let residuals = &page.residuals;
    scatter("residuals.points", &residuals.points)?;
    increasing("residuals.running_x".into(), &residuals.running_x)?;
    for (name, list) in [("mean", &residuals.running_mean), ("spread", &residuals.running_spread)] {
        let part = format!("residuals.running_{name}");
        same(part, list.len(), residuals.running_x.len(), "value of running_x")?;
    }
    for (k, choice) in page.choices.iter().enumerate() {
        if let Some(curve) = &choice.curve {
            score(&format!("choices[{k}].curve"), curve)?;
        }
    }
    Ok(())
}

/// Checks a surface; `part` is its path.
pub(crate) fn surface(part: &str, surface: &Surface) -> Result<()> {
    increasing(format!("{part}.x"), &surface.x)?;
    increasing(format!("{part}.y"), &surface.y)?;
    let need = surface.x.len() * surface.y.len();
    same(format!("{part}.z"), surface.z.len(), need, "point of the grid")?;
    scatter(&format!("{part}.points"), &surface.points)
}

fn scatter(part: &str, scatter: &Scatter) -> Result<()> {
    same(format!("{part}.y"), scatter.y.len(), scatter.x.len(), "abscissa")
}

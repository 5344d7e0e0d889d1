//! Whether a page's data fit together, before anything is drawn from them.

use crate::data::{
    Approximation, ArmMotion, Axis, LinearPart, Nonlinearity, Page, Prediction, ScoreCurve, Signal, Table,
};
use crate::regression::check_surface;
use crate::{Error, Result};

/// Checks lengths, axes and abscissas; values may be NaN or infinite, they become gaps.
pub(crate) fn page(page: &Page) -> Result<()> {
    record(&page.record, &page.time)?;
    nonlinearity("nonlinearity", &page.nonlinearity)?;
    if let Some(titled) = &page.surface {
        check_surface("surface.surface", &titled.surface)?;
    }
    for (k, titled) in page.curves.iter().enumerate() {
        nonlinearity(&format!("curves[{k}].curve"), &titled.curve)?;
    }
    if let Some(a) = &page.approximation {
        approximation(a)?;
    }
    for (k, part) in page.linear.iter().enumerate() {
        linear(&format!("linear[{k}]"), part)?;
    }
    prediction("prediction", &page.prediction)?;
    let residuals = &page.residuals;
    increasing("residuals.cross_lags".into(), &residuals.cross_lags)?;
    same(
        "residuals.cross_correlation".into(),
        residuals.cross_correlation.len(),
        residuals.cross_lags.len(),
        "lag",
    )?;
    for (k, choice) in page.choices.iter().enumerate() {
        if let Some(curve) = &choice.curve {
            score(&format!("choices[{k}].curve"), curve)?;
        }
    }
    for (k, candidates) in page.candidates.iter().enumerate() {
        table(&format!("candidates[{k}]"), candidates)?;
    }
    page.arm.as_ref().map_or(Ok(()), arm)
}

/// Checks the signals of a record.
pub(crate) fn record(signals: &[Signal], time: &Axis) -> Result<()> {
    let Some(first) = signals.first() else {
        return Ok(());
    };
    axis("time", time)?;
    for (k, signal) in signals.iter().enumerate() {
        let (part, got) = (format!("record[{k}].values"), signal.values.len());
        same(part, got, first.values.len(), "sample of record[0]")?;
    }
    Ok(())
}

/// Checks a measured signal against a computed one; `part` is its path.
pub(crate) fn prediction(part: &str, p: &Prediction) -> Result<()> {
    let (got, need) = (p.predicted.len(), p.measured.len());
    same(format!("{part}.predicted"), got, need, "measured sample")?;
    match need {
        0 => Ok(()),
        _ => axis(&format!("{part}.time"), &p.time),
    }
}

/// Checks a curve with its band; `part` is its path.
pub(crate) fn nonlinearity(part: &str, n: &Nonlinearity) -> Result<()> {
    let need = n.x.len();
    increasing(format!("{part}.x"), &n.x)?;
    same(format!("{part}.y"), n.y.len(), need, "abscissa")?;
    optional(&format!("{part}.lower"), n.lower.len(), need, "abscissa")?;
    let each = "value of the band's lower edge";
    same(format!("{part}.upper"), n.upper.len(), n.lower.len(), each)?;
    optional(&format!("{part}.density"), n.density.len(), need, "abscissa")?;
    optional(&format!("{part}.truth"), n.truth.len(), need, "abscissa")
}

fn approximation(a: &Approximation) -> Result<()> {
    increasing("approximation.frequency".into(), &a.frequency)?;
    if let Some(&value) = a.frequency.first().filter(|f| **f <= 0.0) {
        return Err(Error::NotPositive {
            part: "approximation.frequency".into(),
            value,
        });
    }
    let need = a.frequency.len();
    for (name, list) in [("magnitude_db", &a.magnitude_db), ("phase_deg", &a.phase_deg)] {
        same(format!("approximation.{name}"), list.len(), need, "frequency")?;
    }
    let levels = [
        ("total_db", &a.total_db),
        ("noise_db", &a.noise_db),
        ("distortion_db", &a.distortion_db),
    ];
    for (name, list) in levels {
        optional(&format!("approximation.{name}"), list.len(), need, "frequency")?;
    }
    Ok(())
}

fn linear(part: &str, l: &LinearPart) -> Result<()> {
    increasing(format!("{part}.frequency"), &l.frequency)?;
    let need = l.frequency.len();
    same(format!("{part}.magnitude_db"), l.magnitude_db.len(), need, "frequency")?;
    same(format!("{part}.phase_deg"), l.phase_deg.len(), need, "frequency")?;
    optional(
        &format!("{part}.magnitude_error"),
        l.magnitude_error.len(),
        need,
        "frequency",
    )?;
    optional(&format!("{part}.phase_error"), l.phase_error.len(), need, "frequency")?;
    optional(
        &format!("{part}.pole_covariances"),
        l.pole_covariances.len(),
        l.poles.len(),
        "pole",
    )
}

/// Checks that every row has as many cells as there are columns.
pub(crate) fn table(part: &str, t: &Table) -> Result<()> {
    for (k, row) in t.rows.iter().enumerate() {
        same(format!("{part}.rows[{k}]"), row.len(), t.columns.len(), "column")?;
    }
    Ok(())
}

pub(crate) fn score(part: &str, curve: &ScoreCurve) -> Result<()> {
    increasing(format!("{part}.x"), &curve.x)?;
    same(format!("{part}.y"), curve.y.len(), curve.x.len(), "candidate")?;
    match curve.x.first() {
        Some(&value) if curve.log_x && value <= 0.0 => Err(Error::NotPositive {
            part: format!("{part}.x"),
            value,
        }),
        _ => Ok(()),
    }
}

/// Checks the motion of an arm.
pub(crate) fn arm(arm: &ArmMotion) -> Result<()> {
    axis("arm.time", &arm.time)?;
    for (index, &value) in arm.lengths.iter().enumerate() {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::LinkLength { index, value });
        }
    }
    let need = arm.q[0].len();
    same("arm.q[1]".into(), arm.q[1].len(), need, "sample of arm.q[0]")?;
    for k in 0..2 {
        optional(&format!("arm.qm[{k}]"), arm.qm[k].len(), need, "sample of arm.q[0]")?;
        optional(&format!("arm.tau[{k}]"), arm.tau[k].len(), need, "sample of arm.q[0]")?;
    }
    Ok(())
}

pub(crate) fn same(part: String, got: usize, need: usize, each: &'static str) -> Result<()> {
    if got == need {
        Ok(())
    } else {
        Err(Error::Length { part, got, need, each })
    }
}

/// As [`same`], but the list may be left empty.
fn optional(part: &str, got: usize, need: usize, each: &'static str) -> Result<()> {
    if got == 0 {
        Ok(())
    } else {
        same(part.into(), got, need, each)
    }
}

fn axis(part: &str, axis: &Axis) -> Result<()> {
    let Axis { start, step, .. } = *axis;
    if start.is_finite() && step > 0.0 && step.is_finite() {
        Ok(())
    } else {
        Err(Error::Axis {
            part: part.into(),
            start,
            step,
        })
    }
}

pub(crate) fn increasing(part: String, x: &[f64]) -> Result<()> {
    let mut before = f64::NEG_INFINITY;
    for (index, &value) in x.iter().enumerate() {
        if !(value > before && value.is_finite()) {
            return Err(Error::NotIncreasing { part, index, value });
        }
        before = value;
    }
    Ok(())
}

//! A static nonlinearity as a block of a model.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// The values of a tabulated curve outside its abscissas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    /// Not a number: nothing is known there.
    #[default]
    Nan,
    /// The value at the nearest end.
    Nearest,
    /// The straight line through the last two points.
    Linear,
}

/// A function of one variable, piecewise linear between tabulated points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Table")]
pub struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
    outside: Outside,
}

#[derive(Deserialize)]
struct Table {
    x: Vec<f64>,
    y: Vec<f64>,
    outside: Outside,
}

impl TryFrom<Table> for Curve {
    type Error = Error;
    fn try_from(t: Table) -> Result<Self> {
        Self::new(t.x, t.y, t.outside)
    }
}

impl Curve {
    /// A curve through the points `(x[i], y[i])`: at least one, with strictly increasing `x`.
    ///
    /// # Errors
    /// [`Error::Data`]: `TooShort`, `LengthMismatch`, `NonFinite`, and
    /// [`Error::Parameter`] where `x` does not increase.
    pub fn new(x: Vec<f64>, y: Vec<f64>, outside: Outside) -> Result<Self> {
        if x.is_empty() {
            return Err(Error::too_short("a curve", 1, 0));
        }
        if x.len() != y.len() {
            return Err(Error::length("y", y.len(), x.len()));
        }
        for (column, values) in [("x", &x), ("y", &y)] {
            if let Some(sample) = values.iter().position(|v| !v.is_finite()) {
                return Err(Error::not_finite(column, sample, values[sample]));
            }
        }
        if let Some(i) = x.windows(2).position(|w| w[1] <= w[0]) {
            return Err(Error::parameter(
                format!("x[{}]", i + 1),
                x[i + 1],
                "greater than the abscissa before it",
            ));
        }
        Ok(Curve { x, y, outside })
    }

    /// The abscissas, increasing.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// The ordinates.
    pub fn y(&self) -> &[f64] {
        &self.y
    }

    /// Whether `u` lies between the first and the last abscissa.
    pub fn covers(&self, u: f64) -> bool {
        self.x[0] <= u && u <= self.x[self.x.len() - 1]
    }

    /// Its values beyond its points.
    pub fn outside(&self) -> Outside {
        self.outside
    }

    /// The value at `u`; NaN for NaN.
    pub fn value(&self, u: f64) -> f64 {
        let last = self.x.len() - 1;
        if u.is_nan() {
            return f64::NAN;
        }
        if !self.covers(u) {
            let end = if u < self.x[0] { 0 } else { last };
            return match self.outside {
                Outside::Nan => f64::NAN,
                Outside::Nearest => self.y[end],
                Outside::Linear if last == 0 => self.y[0],
                Outside::Linear => self.on_segment(if end == 0 { 0 } else { last - 1 }, u),
            };
        }
        if last == 0 {
            return self.y[0];
        }
        let right = self.x.partition_point(|&v| v <= u).clamp(1, last);
        self.on_segment(right - 1, u)
    }

    /// The straight line through points `i` and `i + 1`, at `u`.
    fn on_segment(&self, i: usize, u: f64) -> f64 {
        let share = (u - self.x[i]) / (self.x[i + 1] - self.x[i]);
        self.y[i] + share * (self.y[i + 1] - self.y[i])
    }

    /// The same curve with every ordinate mapped through `gain * y + offset`.
    pub fn affine(&self, gain: f64, offset: f64) -> Curve {
        Curve {
            x: self.x.clone(),
            y: self.y.iter().map(|y| gain * y + offset).collect(),
            outside: self.outside,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vee(outside: Outside) -> Curve {
        Curve::new(vec![-1.0, 0.0, 2.0], vec![1.0, 0.0, 2.0], outside).unwrap()
    }

    #[test]
    fn passes_through_its_points_and_is_linear_between() {
        let c = vee(Outside::Nan);
        for (x, y) in [(-1.0, 1.0), (0.0, 0.0), (2.0, 2.0), (-0.25, 0.25), (0.5, 0.5)] {
            assert_eq!(c.value(x), y);
        }
    }

    #[test]
    fn outside_follows_the_policy() {
        assert!(vee(Outside::Nan).value(3.0).is_nan());
        assert_eq!(vee(Outside::Nearest).value(3.0), 2.0);
        assert_eq!(vee(Outside::Nearest).value(-9.0), 1.0);
        assert_eq!(vee(Outside::Linear).value(3.0), 3.0);
        assert_eq!(vee(Outside::Linear).value(-2.0), 2.0);
    }

    #[test]
    fn abscissas_must_increase() {
        let error = Curve::new(vec![0.0, 0.0], vec![1.0, 1.0], Outside::Nan).unwrap_err();
        assert!(error.to_string().contains("x[1]"), "{error}");
    }
}

//! The estimate and its band at some points.

use std::ops::ControlFlow;

use flexure::Record;
use flexure::bands::BandKind;

use super::band::BandMaker;
use super::{BandOptions, Regression, RegressionData, slices};
use crate::text::percent;

/// The estimate at some points.
pub struct Evaluation {
    /// The points, column by column.
    pub x: Vec<Vec<f64>>,
    /// The estimate.
    pub y: Vec<f64>,
    /// The lower edge of the band; NaN where there is none.
    pub lower: Vec<f64>,
    /// The upper edge of the band; NaN where there is none.
    pub upper: Vec<f64>,
    /// What the band is; `None` if there is none.
    pub band: Option<BandDescription>,
}

/// What a band is.
#[derive(Clone)]
pub struct BandDescription {
    /// The nominal coverage.
    pub level: f64,
    /// "pointwise" or "simultaneous".
    pub kind: &'static str,
    /// What the band is about, with a comma in front, such as ", of a smoothed curve"; empty for the estimate itself.
    pub of: &'static str,
    /// How it was made.
    pub method: String,
}

impl BandDescription {
    /// Level and kind, for example "95 % pointwise".
    pub fn label(&self) -> String {
        format!("{} % {}{}", percent(self.level), self.kind, self.of)
    }
}

impl Regression {
    /// The estimate and its band at the points with these coordinates, column by column. `go_on` is called now and then with the numbers of
    /// the band's resamples, done and all; [`ControlFlow::Break`] stops the work.
    pub fn evaluate(
        &self,
        data: &RegressionData,
        options: &BandOptions,
        x: Vec<Vec<f64>>,
        go_on: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> flexure::Result<Evaluation> {
        let y = self.fit.regression.predict(&slices(&x))?;
        let Some(band) = self.band(data, options, &x, go_on)? else {
            let none = vec![f64::NAN; y.len()];
            return Ok(Evaluation {
                x,
                y,
                lower: none.clone(),
                upper: none,
                band: None,
            });
        };
        let of = match (&self.fit.local, BandMaker::new(options, self, data)) {
            (Some(_), Some(BandMaker::Robust(_))) => ", of the local line with one bandwidth",
            _ => "",
        };
        Ok(Evaluation {
            x,
            y,
            lower: band.lower,
            upper: band.upper,
            band: Some(BandDescription {
                level: band.level,
                kind: match band.kind {
                    BandKind::Pointwise => "pointwise",
                    BandKind::Simultaneous => "simultaneous",
                },
                of,
                method: format!("{}{of}", band.method),
            }),
        })
    }
}

impl Evaluation {
    /// The columns of x by their names, then y, lower and upper.
    ///
    /// # Errors
    /// If a column of x has one of these names.
    pub fn record(&self, data: &RegressionData) -> flexure::Result<Record> {
        let x = data.names.x.iter().cloned().zip(self.x.iter().cloned());
        let rest = [("y", &self.y), ("lower", &self.lower), ("upper", &self.upper)];
        let rest = rest.map(|(name, values)| (name.to_owned(), values.clone()));
        Record::new(x.chain(rest))
    }
}

//! The Hammerstein system by prediction error over both blocks, from the plain estimate on.

mod descent;
mod dynamics;
mod loss;
mod noise;
mod pieces;
mod select;

use super::calibration::Calibration;
use super::hammerstein::PlainHammerstein;
use crate::error::Result;
use crate::linear::TransferFunction;
use crate::linear::correlation::mean;
use crate::record::Record;
use dynamics::Request;
use loss::{Data, Dynamics, Model, filter, filter_back, residual};
use select::{Cells, Costs, select};

/// Knobs while prototyping.
#[derive(Debug, Clone)]
pub struct RefinedHammerstein {
    /// order
    pub order: Option<usize>,
    /// delay
    pub delay: Option<usize>,
    /// calibration
    pub calibration: Calibration,
    /// fresh
    pub fresh_share: f64,
    /// passes
    pub passes: usize,
    /// cost
    pub cost: [f64; 3],
    /// whiten
    pub whiten: bool,
    /// print
    pub verbose: bool,
}

impl Default for RefinedHammerstein {
    fn default() -> Self {
        RefinedHammerstein {
            order: None,
            delay: None,
            calibration: Calibration::default(),
            fresh_share: 0.25,
            passes: 4,
            cost: [20.0, 20.0, 20.0],
            whiten: true,
            verbose: false,
        }
    }
}

/// Prototype result.
pub struct Refined {
    phi: pieces::Pieces,
    /// G
    pub linear: TransferFunction,
    /// o
    pub offset: f64,
    /// order
    pub order: usize,
    /// breakpoints
    pub breakpoints: Vec<f64>,
}

impl Refined {
    /// phi
    pub fn value(&self, x: f64) -> f64 {
        self.phi.value(x)
    }
    /// simulate
    pub fn simulate(&self, u: &[f64]) -> Vec<f64> {
        let w: Vec<f64> = u.iter().map(|u| self.phi.value(*u)).collect();
        self.linear.simulate(&w).iter().map(|y| y + self.offset).collect()
    }
}

impl RefinedHammerstein {
    /// Identifies.
    #[allow(clippy::print_stderr)]
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<Refined> {
        let n = record.len();
        let fitted = n - (self.fresh_share * n as f64).round() as usize;
        let part = record.slice(0..fitted.min(30_000));
        let start = PlainHammerstein {
            fresh_share: 0.05,
            order: self.order,
            delay: self.delay,
            ..Default::default()
        }
        .identify(&part, input, output)?;
        let u = &record.column(input)?[..fitted];
        let y = &record.column(output)?[..fitted];
        let output_mean = mean(y);
        let centred: Vec<f64> = y.iter().map(|y| y - output_mean).collect();
        let settled = start.linear.settling(0.01).max(10);
        let mut data = Data {
            u,
            y: &centred,
            parts: vec![0..fitted],
            counts: (0..fitted).map(|i| i >= (settled + 30).min(fitted / 10)).collect(),
        };
        let cells = Cells::new(u);
        let mut w: Vec<f64> = u.iter().map(|u| start.nonlinearity.value(*u)).collect();
        let wm = mean(&w);
        w.iter_mut().for_each(|w| *w -= wm);
        let mut dynamics = Dynamics {
            b: start.linear.b()[start.delay..].to_vec(),
            a: start.linear.a().to_vec(),
            delay: start.delay,
        };
        let mut offset = 0.0;
        let mut terms = Vec::new();
        let mut model: Option<Model> = None;
        let mut whitening = vec![1.0];
        for pass in 0..self.passes {
            let e = residual(&data, &filter(&dynamics, &data.parts, &w), offset);
            if self.whiten {
                whitening = noise::whitening(&e);
            }
            let chosen = dynamics::choose(
                &data,
                &w,
                &whitening,
                Request {
                    order: self.order,
                    delay: self.delay,
                    supposed_delay: dynamics.delay,
                    memory: settled,
                },
            );
            if let Some(c) = chosen {
                dynamics = c.dynamics;
            }
            let e = residual(&data, &filter(&dynamics, &data.parts, &w), offset);
            if self.whiten {
                whitening = noise::whitening(&e);
            }
            let white = Dynamics::moving_average(&whitening);
            let mut ew = filter(&white, &data.parts, &e);
            for (e, c) in ew.iter_mut().zip(&data.counts) {
                if !c {
                    *e = 0.0;
                }
            }
            let count = data.counts.iter().filter(|c| **c).count() as f64;
            let power = ew.iter().map(|e| e * e).sum::<f64>() / count;
            let combined = Dynamics {
                b: loss::product(&dynamics.b, &whitening),
                a: dynamics.a.clone(),
                delay: dynamics.delay,
            };
            let back = filter_back(&combined, &data.parts, &ew);
            let k = TransferFunction::new(combined.b.clone(), combined.a.clone())?;
            let energy: f64 = k.impulse_response(2000.min(fitted)).iter().map(|k| k * k).sum();
            let z: Vec<f64> = w.iter().zip(&back).map(|(w, g)| w + g / energy).collect();
            let unit = power / energy;
            let costs = Costs {
                of: self.cost.map(|c| c * unit),
                power: self.cost[2] * unit,
                fewest: 5.0,
            };
            let selection = select(&cells, &cells.means(&z), &terms, &costs);
            terms = selection.terms.clone();
            let next = Model {
                basis: selection.basis,
                c: selection.coefficients[1..].to_vec(),
                dynamics: dynamics.clone(),
                offset,
            };
            let steps = if pass + 1 == self.passes { 10 } else { 3 };
            let (next, normal) = descent::descend(next, &data, &whitening, steps);
            w = next.signal(u);
            dynamics = next.dynamics.clone();
            offset = next.offset;
            if self.verbose {
                eprintln!(
                    "pass {pass}: whitening {} order {} delay {} terms {} rms {:.6} sigma_z {:.4} breakpoints {:?}",
                    whitening.len() - 1,
                    dynamics.a.len() - 1,
                    dynamics.delay,
                    terms.len(),
                    (normal.squares / normal.count as f64).sqrt(),
                    unit.sqrt(),
                    terms.iter().map(|t| match t {
                        pieces::Term::Power(k) => format!("x^{k}"),
                        pieces::Term::From{at, degree} => format!("{:.3}^{degree}", cells.unit.back(*at)),
                    }).collect::<Vec<_>>()
                );
            }
            model = Some(next);
        }
        let Some(model) = model else { unreachable!() };
        data.counts.clear();
        let d = &model.dynamics;
        let b = std::iter::repeat_n(0.0, d.delay).chain(d.b.iter().copied()).collect();
        Ok(Refined {
            breakpoints: model.basis.breakpoints().collect(),
            phi: model.combined(),
            linear: TransferFunction::new(b, d.a.clone())?,
            offset: output_mean + model.offset,
            order: d.a.len() - 1,
        })
    }
}

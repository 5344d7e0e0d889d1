//! A link in its own frame: a rigid hub at the root, and a beam along x with its shape functions.

use super::shapes::{ShapeFunctions, gauss};
use crate::manipulator::chain::Beam;
use crate::vectors::dot;

/// The axial functions: the share s of the length, and its cube. They have the exact extension of a turning uniform beam with a load.
const AXIAL: usize = 2;
/// Gauss points between two places that integrate products of slopes to rounding.
const SLOPE_POINTS: usize = 12;

/// A rigid body in the plane of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rigid {
    pub mass: f64,
    pub com: [f64; 2],
    /// About the centre of mass, kg m^2.
    pub inertia: f64,
}

/// A place on the axis of a beam: its coordinate, and what the shape functions say there.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub mass: f64,
    pub x: f64,
    axial: Vec<f64>,
    bending: Vec<f64>,
    pub slope: Vec<f64>,
    /// H = int_0^x w'_i w'_j, by rows.
    shortening: Vec<f64>,
}

/// A point in a frame: where it is, how it moves with the frame's elastic coordinates, and its acceleration at steady rates of them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Local {
    pub at: [f64; 2],
    pub by: [Vec<f64>; 2],
    pub curved: [f64; 2],
}

impl Local {
    /// A point that is fixed in a frame with this many elastic coordinates.
    pub fn fixed(at: [f64; 2], coordinates: usize) -> Self {
        Local {
            at,
            by: [vec![0.0; coordinates], vec![0.0; coordinates]],
            curved: [0.0; 2],
        }
    }
}

/// `M v` of a square matrix by rows.
pub(super) fn times(matrix: &[f64], v: &[f64]) -> Vec<f64> {
    matrix.chunks(v.len().max(1)).map(|row| dot(row, v)).collect()
}

/// A beam with its shape functions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BeamShape {
    pub length: f64,
    functions: ShapeFunctions,
    axial: usize,
    /// The Gauss points, with their masses.
    pub points: Vec<Place>,
    pub tip: Place,
    /// By rows, N/m.
    pub stiffness: Vec<f64>,
    /// Dampers have this times the stiffness, s.
    pub damping_time: f64,
}

impl BeamShape {
    pub fn new(beam: &Beam, functions: ShapeFunctions, axial_stiffness: Option<f64>) -> Self {
        let axial = if axial_stiffness.is_some() { AXIAL } else { 0 };
        let n = functions.coordinates();
        let mut shape = BeamShape {
            length: beam.length,
            functions,
            axial,
            points: Vec::new(),
            tip: Place {
                mass: 0.0,
                x: 0.0,
                axial: Vec::new(),
                bending: Vec::new(),
                slope: Vec::new(),
                shortening: Vec::new(),
            },
            stiffness: vec![0.0; (axial + n) * (axial + n)],
            damping_time: beam.damping_time(),
        };
        let (borders, rule) = (functions.borders(), gauss(functions.points()));
        let (mut shortening, mut before) = (vec![0.0; n * n], 0.0);
        for ends in borders.windows(2) {
            let piece = ends[1] - ends[0];
            for (at, weight) in &rule {
                let s = ends[0] + piece * at;
                shape.add_shortening(&mut shortening, before, s);
                before = s;
                let mass = beam.density * beam.length * piece * weight;
                shape.points.push(shape.place(s, mass, &shortening));
                shape.add_stiffness(s, piece * weight, beam.stiffness, axial_stiffness.unwrap_or(0.0));
            }
            shape.add_shortening(&mut shortening, before, ends[1]);
            before = ends[1];
        }
        shape.tip = shape.place(1.0, 0.0, &shortening);
        shape
    }

    /// The number of elastic coordinates: axial, then bending.
    pub fn coordinates(&self) -> usize {
        self.axial + self.functions.coordinates()
    }

    /// The place at the share s of the length, seen with what the slopes shorten up to there.
    fn place(&self, s: f64, mass: f64, shortening: &[f64]) -> Place {
        let values = self.functions.at(s);
        Place {
            mass,
            x: s * self.length,
            axial: [s, s.powi(3)][..self.axial].to_vec(),
            bending: values.value,
            slope: values.slope.iter().map(|v| v / self.length).collect(),
            shortening: shortening.to_vec(),
        }
    }

    /// Adds what the slopes from one share of the length to the next shorten.
    fn add_shortening(&self, sum: &mut [f64], from: f64, to: f64) {
        for (at, weight) in gauss(SLOPE_POINTS) {
            let slope = self.functions.at(from + (to - from) * at).slope;
            let n = slope.len();
            for (k, value) in sum.iter_mut().enumerate() {
                *value += weight * (to - from) * slope[k / n] * slope[k % n] / self.length;
            }
        }
    }

    /// Adds the share of the strain energy at a Gauss point.
    fn add_stiffness(&mut self, s: f64, weight: f64, bending: f64, axial: f64) {
        let curvature = self.functions.at(s).curvature;
        let strain = [1.0, 3.0 * s * s];
        let (all, bending) = (self.coordinates(), bending / self.length.powi(3));
        for (k, value) in self.stiffness.iter_mut().enumerate() {
            let (i, j) = (k / all, k % all);
            if i >= self.axial && j >= self.axial {
                *value += weight * bending * curvature[i - self.axial] * curvature[j - self.axial];
            } else if i < self.axial && j < self.axial {
                *value += weight * axial / self.length * strain[i] * strain[j];
            }
        }
    }

    /// A place on the axis of the bent beam.
    pub fn local(&self, place: &Place, e: &[f64], rates: &[f64]) -> Local {
        let (stretch, bend) = e.split_at(self.axial);
        let shortened = times(&place.shortening, bend);
        let rate = &rates[self.axial..];
        let mut along = place.axial.clone();
        along.extend(shortened.iter().map(|h| -h));
        let mut across = vec![0.0; self.axial];
        across.extend(&place.bending);
        Local {
            at: [
                place.x + dot(&place.axial, stretch) - 0.5 * dot(&shortened, bend),
                dot(&place.bending, bend),
            ],
            by: [along, across],
            curved: [-dot(rate, &times(&place.shortening, rate)), 0.0],
        }
    }

    /// The slope at the tip by all elastic coordinates, rad.
    pub fn turn(&self) -> Vec<f64> {
        let mut turn = vec![0.0; self.axial];
        turn.extend(&self.tip.slope);
        turn
    }

    /// The point at `offset` from the tip, in the tip's axes.
    pub fn carried(&self, offset: [f64; 2], e: &[f64], rates: &[f64]) -> Local {
        let mut local = self.local(&self.tip, e, rates);
        let turn = self.turn();
        let (rate, (sin, cos)) = (dot(&turn, rates), dot(&turn, e).sin_cos());
        let [x, y] = [cos * offset[0] - sin * offset[1], sin * offset[0] + cos * offset[1]];
        for (k, by) in turn.iter().enumerate() {
            local.by[0][k] -= y * by;
            local.by[1][k] += x * by;
        }
        for (k, at) in [x, y].into_iter().enumerate() {
            local.at[k] += at;
            local.curved[k] -= rate * rate * at;
        }
        local
    }

    /// The axis of the bent beam at a share s of the length.
    pub fn point(&self, s: f64, e: &[f64]) -> [f64; 2] {
        let n = self.functions.coordinates();
        let mut shortening = vec![0.0; n * n];
        let mut before = 0.0;
        for border in self.functions.borders().into_iter().chain([s]).filter(|b| *b <= s) {
            self.add_shortening(&mut shortening, before, border);
            before = border;
        }
        let place = self.place(s, 0.0, &shortening);
        self.local(&place, e, &vec![0.0; e.len()]).at
    }
}

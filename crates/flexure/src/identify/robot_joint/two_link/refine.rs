//! The curves' divisions and the equations' weights, once more where all equations stand together.

use super::super::equations::NoiseModel;
use super::super::pair::{FRICTION_PIECES, STIFFNESS_PIECES, Splines, akaike};
use super::super::pieces::{Divisions, ROUNDS};
use super::{CONSTANTS, Whole};

impl Whole<'_> {
    /// The same with curves as fine as pays in all equations, and these with the noise that they then turn out to have.
    ///
    /// A motor's equation has the noise of its torque; the link's has none, and shows far finer detail of the stiffness.
    pub fn refined(mut self) -> Option<Self> {
        for _ in 0..ROUNDS {
            let [motor, link] = self.noise_now()?;
            (self.motor_noise, self.free.noise) = (motor, link);
            let [splines, finer] = self.divided()?;
            self.finer = finer;
            let Ok([k1, k2, f1, f2]) = <[Splines; 4]>::try_from(splines) else {
                return None;
            };
            (self.stiffness, self.free.friction) = ([k1, k2], [f1, f2]);
        }
        let [motor, link] = self.noise_now()?;
        (self.motor_noise, self.free.noise) = (motor, link);
        Some(self)
    }

    /// The noise that the motors' and the links' equations turn out to have.
    fn noise_now(&self) -> Option<[[Vec<f64>; 2]; 2]> {
        let equations = self.equations();
        let solution = equations.solve()?;
        let powers = equations.powers(&solution);
        let motor = [0, 1].map(|i| {
            let known = self.pairs[i].encoder[0].iter().map(|e| solution.x[i].powi(2) * e);
            NoiseModel::of_power(&powers[i], &known.collect::<Vec<_>>()).lines
        });
        let known = self.links.known(&solution.x[2..2 + CONSTANTS], solution.x[1]);
        let link = [0, 1].map(|i| NoiseModel::of_power(&powers[2 + i], &known[i]).lines);
        Some([motor, link])
    }

    /// The next finer splines than those with the smallest criterion of Akaike, of stiffness 1 and 2, friction 1 and 2,
    /// and the next finer ones again.
    fn divided(&self) -> Option<[Vec<Splines>; 2]> {
        let lines = 4 * self.modulation.len();
        let candidates: Vec<&'static [usize]> =
            vec![&STIFFNESS_PIECES, &STIFFNESS_PIECES, &FRICTION_PIECES, &FRICTION_PIECES];
        let mut divisions = Divisions::new(candidates, |curve, pieces| {
            let pair = &self.pairs[curve % 2];
            if curve < 2 {
                pair.stiffness_splines(pieces)
            } else {
                pair.friction_splines(pieces)
            }
        });
        divisions.improve(&|splines| {
            let curves = splines.try_into().ok()?;
            Some(akaike(&self.equations_with(curves).solve()?, lines))
        })?;
        Some([1, 2].map(|by| divisions.finer(by)))
    }
}

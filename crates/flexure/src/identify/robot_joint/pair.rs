//! The two equations of motion of a flexible joint, and the free curves in them.

use super::alignment::{Alignment, stiffness_columns};
use super::basis::Basis;
use super::compliance::Deflection;
use super::equations::{Column, Equations, NoiseModel, Solution};
use super::flexible::Motion;
use super::fourier::Modulation;
use super::noisy::{Abscissa, Noisy};
use super::pieces::{self, Divisions, undersmoothed};
use super::rigid::ROUNDS;
use super::smooth::Reflected;
use crate::linalg::Complex;

/// Intervals on either side of zero that are tried for the stiffness and for the friction curve.
pub(super) const STIFFNESS_PIECES: [usize; 6] = [3, 5, 7, 10, 14, 20];
pub(super) const FRICTION_PIECES: [usize; 5] = [9, 13, 18, 25, 34];

/// The two equations of motion, transformed.
pub(super) struct Pair<'a> {
    pub modulation: &'a Modulation,
    /// The deflection and the link's velocity at every sample.
    pub d: Vec<f64>,
    pub v: Vec<f64>,
    /// The share of the deflection's mean square that is noise: the elastic torque comes out too small by it, which the motor's
    /// inertia makes up for where both angles accelerate alike.
    pub attenuation: f64,
    /// By how much of itself the motor's inertia may be off, as its acceleration has the noise of the deflection.
    pub confusion: f64,
    /// The torque less the known part of the motor's.
    pub torque: Vec<Complex<f64>>,
    /// The motor's acceleration; `None` if its inertia is known.
    pub motor: Option<Vec<Complex<f64>>>,
    /// Minus the link's acceleration.
    pub link: Vec<Complex<f64>>,
    /// The encoders' noise in the accelerations of motor and link.
    pub encoder: [Vec<f64>; 2],
    /// The gains of an angle's noise: squared in a deflection, and in the product of a deflection and minus an acceleration.
    pub elastic: Vec<f64>,
    pub shared: Vec<f64>,
    /// Whether the deflection was smoothed: its noise is then none of a sample, and is allowed for by `confusion` instead.
    pub smoothed: bool,
    /// The variances of the noise of the motor's and of the link's angle.
    pub variances: [f64; 2],
}

/// The splines of a free curve, and what they are in the equations.
pub(super) type Splines = (Basis, Vec<Vec<Complex<f64>>>);

/// The free curves.
pub(super) struct Free {
    pub stiffness: Splines,
    /// Minus the splines.
    pub friction: Splines,
    pub noise: [Vec<f64>; 2],
    /// The next finer splines of stiffness and friction, which tell what those in use smooth away.
    pub finer: Vec<Splines>,
    /// The splines beside which forms of stiffness and friction are tested.
    pub tested: [Splines; 2],
}

impl Pair<'_> {
    pub fn new<'a>(motion: &Motion, modulation: &'a Modulation, alignment: &Alignment, link: &[f64]) -> Pair<'a> {
        let mut torque = alignment.torque(modulation, motion.torque, motion.step);
        let motor = motion.rotor_acceleration(modulation);
        if let Some(known) = motion.motor_inertia {
            torque.iter_mut().zip(&motor).for_each(|(t, m)| *t -= m * known);
        }
        let encoder = |sd: f64| modulation.omega.iter().map(|w| (sd * w * w).powi(2)).collect();
        let Deflection {
            d,
            attenuation,
            confusion,
            smoothed,
        } = motion.deflection(link);
        Pair {
            d,
            attenuation,
            confusion,
            smoothed,
            elastic: vec![1.0; modulation.len()],
            shared: modulation.omega.iter().map(|w| w * w).collect(),
            variances: [motion.motor_noise.sd, motion.link_noise.sd].map(|sd| sd * sd),
            v: Reflected::new(link, motion.step).velocity(motion.link_noise.cut_off()),
            link: modulation.of_acceleration(link).into_iter().map(|v| -v).collect(),
            encoder: [encoder(motion.rotor_sd()), encoder(motion.link_noise.sd)],
            motor: motion.motor_inertia.is_none().then_some(motor),
            torque,
            modulation,
        }
    }

    /// The noise of an equation with this inertia, from what it leaves.
    fn noise(&self, residuals: &[Complex<f64>], which: usize, inertia: f64) -> Vec<f64> {
        let known: Vec<f64> = self.encoder[which].iter().map(|e| inertia * inertia * e).collect();
        NoiseModel::fit(residuals, &known).lines
    }

    pub(super) fn one(columns: impl Iterator<Item = Vec<Complex<f64>>>) -> Vec<Column> {
        columns.map(|c| vec![Some(c)]).collect()
    }

    /// The motor's equation with a free stiffness curve.
    pub(super) fn motor_equation<'b>(&'b self, stiffness: &Splines, noise: &'b [f64]) -> Equations<'b> {
        let columns = self.motor.iter().cloned().chain(stiffness.1.iter().cloned());
        let first = usize::from(self.motor.is_some());
        let mut noisy = self.noisy_motor();
        noisy.extend(self.noisy_curve(&self.abscissa(None), stiffness, first));
        Equations {
            columns: Self::one(columns),
            right: vec![self.torque.clone()],
            noise: vec![noise],
            noisy,
        }
    }

    /// The solution of the motor's equation, and the noise that it turns out to have.
    fn motor_side(&self, stiffness: &Splines, noise: &[f64]) -> Option<(Solution, Vec<f64>)> {
        let solution = self.motor_equation(stiffness, noise).solve()?;
        let inertia = if self.motor.is_some() { solution.x[0] } else { 0.0 };
        let noise = self.noise(&solution.residuals[0], 0, inertia);
        Some((solution, noise))
    }

    /// The sum of both equations, `tau = Jm qm'' + M q'' + f(q')`: the link's inertia and friction for a start.
    fn sum(&self, friction: &[Vec<Complex<f64>>], band: f64) -> Option<Solution> {
        let columns = self.motor.iter().chain([&self.link]).chain(friction).cloned();
        let columns = Self::one(columns);
        // Low frequencies, where the encoders' noise does no harm, begin.
        let edge = std::f64::consts::PI * band;
        let mut noise: Vec<f64> = self.modulation.omega.iter().map(|w| 1.0 + (w / edge).powi(8)).collect();
        let at = usize::from(self.motor.is_some());
        let mut solution = None;
        for _ in 0..ROUNDS {
            let mut found = Equations {
                columns: columns.clone(),
                right: vec![self.torque.clone()],
                noise: vec![&noise],
                noisy: self.noisy_motor().into_iter().chain([self.noisy_link(at, 0)]).collect(),
            }
            .solve()?;
            // The columns of the link have the link equation's sign.
            noise = self.noise(&found.residuals[0], 1, found.x[at]);
            found.x[at..].iter_mut().for_each(|x| *x = -*x);
            solution = Some(found);
        }
        solution
    }

    /// The residuals of the link's equation `kappa - M q'' - f = 0`.
    fn link_residuals(&self, kappa: &[Complex<f64>], rest: &[(&[Complex<f64>], f64)]) -> Vec<Complex<f64>> {
        let mut left = kappa.to_vec();
        for (column, x) in rest {
            left.iter_mut().zip(*column).for_each(|(l, c)| *l += c * *x);
        }
        left
    }

    /// The free stiffness curve with as many splines as pay for themselves, and the motor's equation with it.
    pub fn stiffness(&self) -> Option<(Splines, Solution, Vec<f64>)> {
        let start = vec![1.0; self.modulation.len()];
        let lines = self.modulation.len();
        let coarse = self.stiffness_splines(STIFFNESS_PIECES[1]);
        let mut motor_noise = start;
        for _ in 0..2 {
            motor_noise = self.motor_side(&coarse, &motor_noise)?.1;
        }
        let curves = STIFFNESS_PIECES.iter().filter_map(|&pieces| {
            let splines = self.stiffness_splines(pieces);
            let (solution, noise) = self.motor_side(&splines, &motor_noise)?;
            Some((akaike(&solution, lines), splines, solution, noise))
        });
        let (_, stiffness, solution, noise) = curves.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((stiffness, solution, noise))
    }

    /// The deflection in `pieces` intervals on either side of zero: the splines of a stiffness curve.
    pub fn stiffness_splines(&self, pieces: usize) -> Splines {
        let basis = Basis::stiffness(&self.d, pieces);
        let columns = stiffness_columns(self.modulation, &basis, &self.d);
        (basis, columns)
    }

    /// The link's velocity in `pieces` intervals on either side of zero: minus the splines of a friction curve.
    pub fn friction_splines(&self, pieces: usize) -> Splines {
        let basis = Basis::friction(&self.v, pieces);
        let columns = self.modulation.of_all(&basis.mean_columns(&self.v, -1.0));
        (basis, columns)
    }

    /// The splines beside which forms of stiffness and friction are tested: of a division that does not depend on the torques.
    pub fn tested(&self) -> [Splines; 2] {
        [
            self.stiffness_splines(STIFFNESS_PIECES[2]),
            self.friction_splines(FRICTION_PIECES[1]),
        ]
    }

    /// The free curves with as many splines as pay for themselves, and the noise of both equations.
    pub fn free(&self, motion: &Motion) -> Option<Free> {
        let (stiffness, solution, motor_noise) = self.stiffness()?;
        let lines = self.modulation.len();
        let from = usize::from(self.motor.is_some());
        let kappa = combine(&stiffness.1, &solution.x[from..]);
        let splines = |pieces: usize| self.friction_splines(pieces);
        let (_, columns) = splines(FRICTION_PIECES[1]);
        let sum = self.sum(&columns, motion.link_noise.band)?;
        let at = usize::from(self.motor.is_some());
        let mut rest: Vec<(&[Complex<f64>], f64)> = vec![(&self.link, sum.x[at])];
        rest.extend(columns.iter().map(Vec::as_slice).zip(sum.x[at + 1..].iter().copied()));
        let mut link_noise = self.noise(&self.link_residuals(&kappa, &rest), 1, sum.x[at]);
        let right: Vec<Complex<f64>> = kappa.iter().map(|v| -v).collect();
        let solved = |friction: &[Vec<Complex<f64>>], noise: &[f64]| {
            let columns = std::iter::once(self.link.clone()).chain(friction.iter().cloned());
            Equations {
                columns: Self::one(columns),
                right: vec![right.clone()],
                noise: vec![noise],
                noisy: vec![self.noisy_link(0, 0)],
            }
            .solve()
        };
        let coarse = solved(&columns, &link_noise)?;
        link_noise = self.noise(&coarse.residuals[0], 1, coarse.x[0]);
        let scores = FRICTION_PIECES
            .iter()
            .map(|&pieces| Some(akaike(&solved(&splines(pieces).1, &link_noise)?, lines)));
        let friction = splines(undersmoothed(&FRICTION_PIECES, scores)?);
        let fine = solved(&friction.1, &link_noise)?;
        self.refined(Free {
            noise: [motor_noise, self.noise(&fine.residuals[0], 1, fine.x[0])],
            stiffness,
            friction,
            finer: Vec::new(),
            tested: self.tested(),
        })
    }

    /// The same with curves as fine as pays in both equations, and these with the noise that they then turn out to have.
    ///
    /// The motor's equation has the noise of its torque; the link's has none, and shows far finer detail of the stiffness.
    fn refined(&self, mut free: Free) -> Option<Free> {
        let lines = 2 * self.modulation.len();
        let noise = |free: &Free| -> Option<[Vec<f64>; 2]> {
            let equations = self.both(free);
            Some(self.noise_of(&equations, &equations.solve()?, free.stiffness.0.len()))
        };
        for _ in 0..pieces::ROUNDS {
            free.noise = noise(&free)?;
            let mut divisions =
                Divisions::new(vec![&STIFFNESS_PIECES, &FRICTION_PIECES], |curve, pieces| match curve {
                    0 => self.stiffness_splines(pieces),
                    _ => self.friction_splines(pieces),
                });
            divisions.improve(&|splines| {
                let [stiffness, friction] = splines else { return None };
                let equations = self.both_with(stiffness, friction, &free.noise);
                Some(akaike(&equations.solve()?, lines))
            })?;
            let Ok([stiffness, friction]) = <[Splines; 2]>::try_from(divisions.finer(1)) else {
                return None;
            };
            (free.stiffness, free.friction) = (stiffness, friction);
            free.finer = divisions.finer(2);
        }
        free.noise = noise(&free)?;
        Some(free)
    }

    /// The noise of both equations, with so many splines of the stiffness, from what their solution leaves.
    pub fn noise_of(&self, equations: &Equations, solution: &Solution, splines: usize) -> [Vec<f64>; 2] {
        let powers = equations.powers(solution);
        let first = usize::from(self.motor.is_some());
        let motor = if first == 1 { solution.x[0] } else { 0.0 };
        let inertias = [motor, solution.x[first + splines]];
        [0, 1].map(|i| {
            let known = self.encoder[i].iter().map(|e| inertias[i].powi(2) * e);
            NoiseModel::of_power(&powers[i], &known.collect::<Vec<_>>()).lines
        })
    }

    /// The columns of the inertias in both equations: of the motor, if it is not known, and of the link.
    pub(super) fn inertias(&self) -> (Option<Column>, Column) {
        let motor = self.motor.clone().map(|m| vec![Some(m), None]);
        (motor, vec![None, Some(self.link.clone())])
    }

    /// The noise of the motor's acceleration, where its inertia is the first unknown.
    pub(super) fn noisy_motor(&self) -> Vec<Noisy<'_>> {
        let noisy = self.motor.is_some().then_some(Noisy {
            columns: [0, 0],
            block: 0,
            lines: &self.encoder[0],
            factor: 1.0,
        });
        noisy.into_iter().collect()
    }

    /// That of the link's acceleration, the unknown `at` of the equations of `block`.
    pub(super) fn noisy_link(&self, at: usize, block: usize) -> Noisy<'_> {
        Noisy {
            columns: [at, at],
            block,
            lines: &self.encoder[1],
            factor: 1.0,
        }
    }

    /// The deflection as an abscissa in the motor's equation, and in that of the link, whose inertia is the unknown `link_at`.
    pub(super) fn abscissa(&self, link_at: Option<usize>) -> Abscissa<'_> {
        // Taken off a smoothed deflection it made the inertias of stiff joints worse.
        if self.smoothed {
            return Abscissa::default();
        }
        let [motor, link] = self.variances;
        let blocks = 0..1 + usize::from(link_at.is_some());
        // The deflection has plus the motor's noise and minus the link's; so has, but for a positive factor, minus each acceleration.
        let rotor = self.motor.is_some().then_some((0, 0, &self.shared[..], -motor));
        let carried = link_at.map(|at| (at, 1, &self.shared[..], -link));
        Abscissa {
            own: blocks.map(|block| (block, &self.elastic[..], motor + link)).collect(),
            with: rotor.into_iter().chain(carried).collect(),
        }
    }

    /// What the abscissa's noise adds to the products of the splines of a stiffness curve, the columns from `first` on.
    pub(super) fn noisy_curve<'b>(&self, abscissa: &Abscissa<'b>, splines: &Splines, first: usize) -> Vec<Noisy<'b>> {
        if abscissa.is_exact() {
            return Vec::new();
        }
        abscissa.noisy(&splines.0.slopes(self.modulation, &self.d), |k| first + k)
    }

    pub(super) fn right(&self) -> Vec<Vec<Complex<f64>>> {
        vec![self.torque.clone(), vec![Complex::new(0.0, 0.0); self.torque.len()]]
    }

    /// Both equations with free curves.
    pub fn both<'b>(&'b self, free: &'b Free) -> Equations<'b> {
        self.both_with(&free.stiffness, &free.friction, &free.noise)
    }

    /// Both equations with these curves.
    pub(super) fn both_with<'b>(
        &'b self,
        stiffness: &Splines,
        friction: &Splines,
        noise: &'b [Vec<f64>; 2],
    ) -> Equations<'b> {
        let (motor, link) = self.inertias();
        let first = usize::from(motor.is_some());
        let link_at = first + stiffness.1.len();
        let curve = self.noisy_curve(&self.abscissa(Some(link_at)), stiffness, first);
        let stiffness = stiffness.1.iter().map(|c| vec![Some(c.clone()), Some(c.clone())]);
        let friction = friction.1.iter().map(|c| vec![None, Some(c.clone())]);
        Equations {
            columns: motor
                .into_iter()
                .chain(stiffness)
                .chain([link])
                .chain(friction)
                .collect(),
            right: self.right(),
            noise: noise.iter().map(Vec::as_slice).collect(),
            noisy: self
                .noisy_motor()
                .into_iter()
                .chain([self.noisy_link(link_at, 1)])
                .chain(curve)
                .collect(),
        }
    }
}

/// Akaike's criterion of a solution of so many equations.
pub(super) fn akaike(s: &Solution, lines: usize) -> f64 {
    let observations = 2.0 * lines as f64;
    observations * (s.squares / observations).ln() + 2.0 * s.x.len() as f64
}

/// The sum of the columns, each times its factor.
pub(super) fn combine(columns: &[Vec<Complex<f64>>], factors: &[f64]) -> Vec<Complex<f64>> {
    let mut sum = vec![Complex::new(0.0, 0.0); columns.first().map_or(0, Vec::len)];
    for (column, factor) in columns.iter().zip(factors) {
        sum.iter_mut().zip(column).for_each(|(s, v)| *s += v * *factor);
    }
    sum
}

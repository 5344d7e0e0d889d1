//! Reference motions of an arm: paths of the tip by inverse kinematics, and moves of the joints.
//!
//! A path is passed at constant speed, with velocities that blend into one another around every corner and at both ends. The step of
//! velocity at time t_i is spread over the width w by the smooth step S of degree 11, whose first five derivatives vanish at both ends:
//!
//! $$ p(t) = p_0 + \sum_i \Delta v_i\, w R\!\left(\frac{t - t_i}{w} + \frac12\right), \qquad R' = S $$
//!
//! So positions are continuous with six derivatives: more than the four that inverse dynamics of flexible joints needs, and as many
//! as coupled rotors need. A blended path cuts its corners.

use super::jet::{COEFFICIENTS, Jet};
use crate::error::{Error, Result};
use crate::manipulator::Link;

/// A motion of both joints in time.
pub trait Trajectory: Send + Sync {
    /// The link angles at time `t` with their derivatives; before 0 and after the end the arm rests.
    fn at(&self, t: f64) -> [Jet; 2];

    /// When it comes to rest, s.
    fn end(&self) -> f64;
}

/// The coefficients of the smooth step `S(x) = x^6 sum a_j x^j`, of degree 11.
const STEP: [f64; 6] = [462.0, -1980.0, 3465.0, -3080.0, 1386.0, -252.0];

/// The smooth step's integral `R` at `x`, with derivatives: 0 below 0, `x - 1/2` above 1.
fn ramp(x: Jet) -> Jet {
    if x.value() <= 0.0 {
        return Jet::default();
    }
    if x.value() >= 1.0 {
        return x - Jet::constant(0.5);
    }
    let mut sum = Jet::default();
    for (j, a) in STEP.iter().enumerate().rev() {
        sum = sum * x + Jet::constant(a / (7 + j) as f64);
    }
    let square = x * x;
    sum * square * square * square * x
}

/// The smooth step at `x`, with derivatives.
fn smooth_step(x: Jet) -> Jet {
    if x.value() <= 0.0 {
        return Jet::default();
    }
    if x.value() >= 1.0 {
        return Jet::constant(1.0);
    }
    let polynomial = STEP
        .iter()
        .rev()
        .fold(Jet::default(), |sum, a| sum * x + Jet::constant(*a));
    let square = x * x;
    polynomial * square * square * square
}

/// The time as a signal.
fn time(t: f64) -> Jet {
    let mut c = [0.0; COEFFICIENTS];
    (c[0], c[1]) = (t, 1.0);
    Jet(c)
}

/// A path of the tip along straight lines with blended corners.
#[derive(Debug, Clone, PartialEq)]
pub struct TipPath {
    lengths: [f64; 2],
    elbow: f64,
    start: [f64; 2],
    /// The instant of each step of velocity, and the step, m/s.
    steps: Vec<(f64, [f64; 2])>,
    blend: f64,
    end: f64,
}

impl TipPath {
    /// The path through `points` (m, the shoulder at the origin) in `duration` seconds, from rest to rest.
    ///
    /// `blend` is the time over which a corner's change of velocity is spread; at most the time for the shortest side. With
    /// `elbow_left` the elbow angle is negative.
    ///
    /// # Errors
    /// [`Error::Parameter`] for fewer than two points, points that repeat or cannot be reached, and times outside their range.
    ///
    /// ```
    /// use flexure::control::{TipPath, Trajectory, square};
    /// use flexure::manipulator::{JointKind, space_arm};
    ///
    /// let path = TipPath::new(&space_arm(JointKind::Rigid).links, &square(12.6), 60.0, 4.0, false)?;
    /// assert_eq!(path.tip(0.0), [6.3, -6.3]);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn new(links: &[Link; 2], points: &[[f64; 2]], duration: f64, blend: f64, elbow_left: bool) -> Result<Self> {
        let lengths = [links[0].length, links[1].length];
        let wrong = |name: String, value, requirement| Err(Error::parameter(name, value, requirement));
        if points.len() < 2 {
            return wrong("points".into(), points.len() as f64, "at least 2");
        }
        let [longest, nearest] = [lengths[0] + lengths[1], (lengths[0] - lengths[1]).abs()];
        for (i, [x, y]) in points.iter().enumerate() {
            let distance = x.hypot(*y);
            if !(distance < longest && distance > nearest) {
                let name = format!("the distance of point {} from the shoulder", i + 1);
                return wrong(
                    name,
                    distance,
                    "less than the sum of the links' lengths and more than their difference (in m)",
                );
            }
        }
        let sides: Vec<[f64; 2]> = points
            .windows(2)
            .map(|p| [p[1][0] - p[0][0], p[1][1] - p[0][1]])
            .collect();
        let length = |side: &[f64; 2]| side[0].hypot(side[1]);
        let whole: f64 = sides.iter().map(length).sum();
        if let Some(i) = sides.iter().position(|s| !(length(s) > 0.0)) {
            return wrong(
                format!("the length of side {}", i + 1),
                0.0,
                "positive: leave out points that repeat",
            );
        }
        if !(duration > 0.0 && duration.is_finite()) {
            return wrong("duration".into(), duration, "positive and finite (in s)");
        }
        if !(blend > 0.0 && blend < duration) {
            return wrong("blend".into(), blend, "positive and less than the duration (in s)");
        }
        let speed = whole / (duration - blend);
        let shortest = sides.iter().map(length).fold(f64::INFINITY, f64::min) / speed;
        if blend > shortest * (1.0 + 1e-12) {
            return wrong(
                "blend".into(),
                blend,
                "at most as long as the shortest side takes (in s)",
            );
        }
        let mut steps = Vec::with_capacity(points.len());
        let (mut instant, mut before) = (0.5 * blend, [0.0; 2]);
        for side in &sides {
            let velocity = side.map(|s| s * speed / length(side));
            steps.push((instant, [velocity[0] - before[0], velocity[1] - before[1]]));
            instant += length(side) / speed;
            before = velocity;
        }
        steps.push((instant, before.map(|v| -v)));
        let path = TipPath {
            lengths,
            elbow: if elbow_left { -1.0 } else { 1.0 },
            start: points[0],
            steps,
            blend,
            end: duration,
        };
        path.check_reach(nearest)?;
        Ok(path)
    }

    /// Refuses a path that comes too near to the shoulder to be followed.
    fn check_reach(&self, nearest: f64) -> Result<()> {
        const PLACES: usize = 1000;
        // A margin that keeps inverse kinematics away from its singularity.
        let least = nearest + 0.01 * (self.lengths[0] + self.lengths[1]);
        for k in 0..=PLACES {
            let t = self.end * k as f64 / PLACES as f64;
            let [x, y] = self.tip(t);
            let distance = x.hypot(y);
            if !(distance > least) {
                let name = format!("the distance of the path from the shoulder at {t:.2} s");
                return Err(Error::parameter(
                    name,
                    distance,
                    "more than the difference of the links' lengths (in m)",
                ));
            }
        }
        Ok(())
    }

    /// The reference of the tip at time `t`, m.
    pub fn tip(&self, t: f64) -> [f64; 2] {
        self.tip_series(t).map(|x| x.value())
    }

    /// The path's farthest distance from the corners that it blends, m.
    pub fn cut(&self) -> f64 {
        let corners = &self.steps[1..self.steps.len() - 1];
        let half = self.blend * ramp(Jet::constant(0.5)).value();
        corners
            .iter()
            .map(|(_, dv)| half * dv[0].hypot(dv[1]))
            .fold(0.0, f64::max)
    }

    fn tip_series(&self, t: f64) -> [Jet; 2] {
        let mut tip = self.start.map(Jet::constant);
        for (instant, dv) in &self.steps {
            let x = (time(t) - Jet::constant(*instant)) * (1.0 / self.blend) + Jet::constant(0.5);
            let way = ramp(x) * self.blend;
            tip = [tip[0] + way * dv[0], tip[1] + way * dv[1]];
        }
        tip
    }
}

impl Trajectory for TipPath {
    fn at(&self, t: f64) -> [Jet; 2] {
        inverse_kinematics(self.lengths, self.elbow, self.tip_series(t.clamp(0.0, self.end)))
    }

    fn end(&self) -> f64 {
        self.end
    }
}

/// The corners of a square of this side, m, around the shoulder, back to the first.
pub fn square(side: f64) -> Vec<[f64; 2]> {
    let h = 0.5 * side;
    vec![[h, -h], [h, h], [-h, h], [-h, -h], [h, -h]]
}

/// The angles at which the tip is at this place, with the elbow angle of this sign.
///
/// The shoulder angle is within half a turn of 0; along a path around the shoulder its value jumps by a turn although the arm does not:
/// [`TurnCounted`] counts the turns.
fn inverse_kinematics([l1, l2]: [f64; 2], elbow: f64, [x, y]: [Jet; 2]) -> [Jet; 2] {
    let square = x * x + y * y;
    let cos = (square - Jet::constant(l1 * l1 + l2 * l2)) * (0.5 / (l1 * l2));
    let sin = (Jet::constant(1.0) - cos * cos).sqrt() * elbow;
    let q2 = sin.atan2(cos);
    let along = cos * l2 + Jet::constant(l1);
    let across = sin * l2;
    [(y * along - x * across).atan2(x * along + y * across), q2]
}

/// The place of the tip, m.
pub fn tip(links: &[Link; 2], q: [f64; 2]) -> [f64; 2] {
    let (s1, c1) = q[0].sin_cos();
    let (s12, c12) = (q[0] + q[1]).sin_cos();
    let [l1, l2] = [links[0].length, links[1].length];
    [l1 * c1 + l2 * c12, l1 * s1 + l2 * s12]
}

/// A trajectory whose shoulder angle is continuous over whole turns.
pub struct TurnCounted<T> {
    inner: T,
    /// The instants at which the inner angle jumps, and by how many turns.
    jumps: Vec<(f64, f64)>,
}

impl<T: Trajectory> TurnCounted<T> {
    /// Finds the jumps.
    pub fn new(inner: T) -> Self {
        const PLACES: usize = 4000;
        let angle = |t: f64| inner.at(t)[0].value();
        let mut jumps = Vec::new();
        let mut before = (0.0, angle(0.0));
        for k in 1..=PLACES {
            let now = inner.end() * k as f64 / PLACES as f64;
            let next = angle(now);
            let turns = ((next - before.1) / std::f64::consts::TAU).round();
            if turns != 0.0 {
                let (mut early, mut late) = (before.0, now);
                for _ in 0..60 {
                    let middle = 0.5 * (early + late);
                    match (angle(middle) - before.1).abs() > std::f64::consts::PI {
                        true => late = middle,
                        false => early = middle,
                    }
                }
                jumps.push((late, -turns));
            }
            before = (now, next);
        }
        TurnCounted { inner, jumps }
    }
}

impl<T: Trajectory> Trajectory for TurnCounted<T> {
    fn at(&self, t: f64) -> [Jet; 2] {
        let [first, second] = self.inner.at(t);
        let turns: f64 = self.jumps.iter().filter(|(at, _)| t >= *at).map(|(_, n)| n).sum();
        [first + Jet::constant(turns * std::f64::consts::TAU), second]
    }

    fn end(&self) -> f64 {
        self.inner.end()
    }
}

/// Moves of the joints through postures, from rest to rest, each in the same time.
#[derive(Debug, Clone, PartialEq)]
pub struct JointMoves {
    postures: Vec<[f64; 2]>,
    duration: f64,
    pause: f64,
}

impl JointMoves {
    /// Moves through `postures` (rad), each in `duration` seconds, with rests of `pause` seconds between them.
    ///
    /// # Errors
    /// [`Error::Parameter`] for fewer than two postures, angles that are not finite, and times outside their range.
    pub fn new(postures: &[[f64; 2]], duration: f64, pause: f64) -> Result<Self> {
        if postures.len() < 2 {
            return Err(Error::parameter("postures", postures.len() as f64, "at least 2"));
        }
        if let Some(&angle) = postures.iter().flatten().find(|a| !a.is_finite()) {
            return Err(Error::parameter("an angle of the postures", angle, "finite (in rad)"));
        }
        if !(duration > 0.0 && duration.is_finite()) {
            return Err(Error::parameter("duration", duration, "positive and finite (in s)"));
        }
        if !(pause >= 0.0 && pause.is_finite()) {
            return Err(Error::parameter("pause", pause, "not negative and finite (in s)"));
        }
        Ok(JointMoves {
            postures: postures.to_vec(),
            duration,
            pause,
        })
    }
}

impl Trajectory for JointMoves {
    fn at(&self, t: f64) -> [Jet; 2] {
        let mut q = self.postures[0].map(Jet::constant);
        for (i, pair) in self.postures.windows(2).enumerate() {
            let start = i as f64 * (self.duration + self.pause);
            let s = smooth_step((time(t) - Jet::constant(start)) * (1.0 / self.duration));
            q = [0, 1].map(|j| q[j] + s * (pair[1][j] - pair[0][j]));
        }
        q
    }

    fn end(&self) -> f64 {
        let moves = (self.postures.len() - 1) as f64;
        moves * self.duration + (moves - 1.0) * self.pause
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::{JointKind, space_arm};

    fn links() -> [Link; 2] {
        space_arm(JointKind::Nonlinear).links
    }

    fn path() -> TurnCounted<TipPath> {
        TurnCounted::new(TipPath::new(&links(), &square(12.6), 60.0, 4.0, false).unwrap())
    }

    #[test]
    fn the_tip_of_the_angles_is_on_the_path() {
        let path = path();
        for k in 0..=600 {
            let t = 0.1 * k as f64;
            let q = path.at(t).map(|q| q.value());
            let ([x, y], [rx, ry]) = (tip(&links(), q), path.inner.tip(t));
            assert!((x - rx).abs() < 1e-12 && (y - ry).abs() < 1e-12, "{t}");
        }
        // The middles of the sides and the last corner lie on the path; at the other corners it cuts.
        assert_eq!(path.inner.tip(60.0).map(|x| (x * 1e9).round() / 1e9), [6.3, -6.3]);
        assert!((path.inner.tip(9.0)[0] - 6.3).abs() < 1e-12);
        let corner = path.inner.tip(2.0 + 14.0);
        let cut = (corner[0] - 6.3).hypot(corner[1] - 6.3);
        assert!((cut - path.inner.cut()).abs() < 1e-9 && cut < 0.6, "{cut}");
    }

    /// Series about neighbouring instants agree with one another: the derivatives are those of the angles, across knots too.
    #[test]
    fn the_angles_are_smooth_with_their_derivatives() {
        let moves = JointMoves::new(&[[0.0, 0.5], [1.0, 1.5], [0.2, 1.0]], 2.0, 0.5).unwrap();
        let path = path();
        for trajectory in [&path as &dyn Trajectory, &moves] {
            let h = 0.002;
            for k in 0..(trajectory.end() / h) as usize {
                let t = k as f64 * h;
                let (here, there) = (trajectory.at(t), trajectory.at(t + h));
                for j in 0..2 {
                    let ahead = here[j].shifted(h);
                    for order in 0..4 {
                        let (a, b) = (ahead.derivative(order), there[j].derivative(order));
                        assert!((a - b).abs() < 2e-4 * (1.0 + b.abs()), "{t} {order}: {a} {b}");
                    }
                    assert!((ahead.value() - there[j].value()).abs() < 1e-12);
                }
            }
        }
        assert_eq!(moves.end(), 4.5);
        assert_eq!(moves.at(4.5).map(|q| (q.value() * 1e12).round() / 1e12), [0.2, 1.0]);
    }

    #[test]
    fn what_cannot_be_followed_is_refused() {
        let refused = |points: &[[f64; 2]], duration, blend| {
            TipPath::new(&links(), points, duration, blend, false)
                .unwrap_err()
                .to_string()
        };
        assert!(refused(&[[1.0, 1.0]], 1.0, 0.1).contains("at least 2"));
        assert!(refused(&square(13.0), 60.0, 1.0).contains("point 1"));
        assert!(refused(&[[3.0, 0.0], [3.0, 0.0]], 10.0, 1.0).contains("side 1"));
        assert!(refused(&[[3.0, 0.1], [-3.0, -0.1]], 10.0, 1.0).contains("from the shoulder at"));
        assert!(refused(&square(12.6), 60.0, 15.0).contains("shortest side"));
        assert!(refused(&square(12.6), f64::NAN, 15.0).contains("duration"));
        assert!(JointMoves::new(&[[0.0, 0.0]], 1.0, 0.0).is_err());
    }
}

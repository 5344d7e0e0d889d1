//! Neighbours on a line: a window that slides over the distinct abscissas.

use super::super::estimator::Points;
use super::{Mass, Neighbourhood, Scores};
use crate::interrupt;
use crate::sort::order;

/// Sorted points. Points with the same abscissa form a group.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line {
    /// The distinct abscissas, increasing.
    x: Vec<f64>,
    points: Vec<LinePoint>,
    /// The sums of the weights, and of the weighted ordinates, before every distinct abscissa and after the last.
    weight: Vec<Sum>,
    moment: Vec<Sum>,
    mean: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct LinePoint {
    /// The index of its abscissa.
    group: usize,
    weight: f64,
    /// The centred ordinate.
    y: f64,
}

/// A sum and its rounding error, so that differences of two keep their digits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sum(f64, f64);

impl Sum {
    /// Knuth's two-sum.
    fn plus(self, v: f64) -> Sum {
        let sum = self.0 + v;
        let added = sum - self.0;
        Sum(sum, self.1 + ((self.0 - (sum - added)) + (v - added)))
    }

    fn minus(self, other: Sum) -> f64 {
        (self.0 - other.0) + (self.1 - other.1)
    }
}

/// The abscissas from `left` up to `right`, which is excluded.
#[derive(Debug, Clone, Copy)]
struct Window {
    left: usize,
    right: usize,
}

impl Line {
    pub fn new(data: &Points) -> Line {
        let (x, mean) = (data.distinct(), data.mean());
        let (mut weight, mut moment) = (vec![Sum::default(); x.len() + 1], vec![Sum::default(); x.len() + 1]);
        let mut points = Vec::with_capacity(data.len());
        let mut group = 0;
        let (mut w_sum, mut m_sum) = (Sum::default(), Sum::default());
        for ((at, y), w) in data.x[0].iter().zip(&data.y).zip(&data.w) {
            if *at != x[group] {
                group += 1;
            }
            let y = y - mean;
            (w_sum, m_sum) = (w_sum.plus(*w), m_sum.plus(w * y));
            (weight[group + 1], moment[group + 1]) = (w_sum, m_sum);
            points.push(LinePoint { group, weight: *w, y });
        }
        Line {
            x,
            points,
            weight,
            moment,
            mean,
        }
    }

    fn mass(&self, w: Window) -> Mass {
        Mass {
            weight: self.weight[w.right].minus(self.weight[w.left]),
            moment: self.moment[w.right].minus(self.moment[w.left]),
        }
    }

    /// Moves `window` to the smallest set of nearest abscissas around `q`, ties included, of weight at least
    /// `need` (no more than all), and returns its sums.
    ///
    /// The result does not depend on the window before. From the window of a neighbouring query it takes few steps.
    fn slide(&self, window: &mut Window, q: f64, need: f64) -> Neighbourhood {
        let n = self.x.len();
        let Window { left, right } = *window;
        if !(self.x[left.min(n - 1)] <= q && q <= self.x[right.min(n - 1)]) {
            // The query is far away: from its own place the search takes no more steps than there are neighbours.
            let at = self.x.partition_point(|&x| x < q);
            *window = Window { left: at, right: at };
        }
        let before = |left: usize| if left > 0 { q - self.x[left - 1] } else { f64::INFINITY };
        let after = |right: usize| if right < n { self.x[right] - q } else { f64::INFINITY };
        loop {
            let Window { left, right } = *window;
            let weight = self.weight[right].minus(self.weight[left]);
            // Every abscissa nearer than the farthest one inside is added. Then the farthest is removed if the rest is enough.
            let farthest = if left < right {
                (q - self.x[left]).max(self.x[right - 1] - q)
            } else {
                f64::NEG_INFINITY
            };
            let next = before(left).min(after(right));
            if next < f64::INFINITY && (next <= farthest || weight < need) {
                if before(left) <= next {
                    window.left -= 1;
                }
                if after(right) <= next {
                    window.right += 1;
                }
                continue;
            }
            let inner = self.inside(*window, q, farthest);
            if inner.left < inner.right && self.weight[inner.right].minus(self.weight[inner.left]) >= need {
                *window = inner;
                continue;
            }
            // The tied points are summed by themselves: a difference would lose digits.
            let low = self.mass(Window {
                left,
                right: inner.left,
            });
            let high = self.mass(Window {
                left: inner.right,
                right,
            });
            return Neighbourhood {
                near: self.mass(inner),
                tied: low.plus(high),
                radius: farthest,
            };
        }
    }

    /// The window without the abscissas at the distance `farthest`.
    fn inside(&self, window: Window, q: f64, farthest: f64) -> Window {
        let Window { mut left, mut right } = window;
        while left < right && q - self.x[left] >= farthest {
            left += 1;
        }
        while left < right && self.x[right - 1] - q >= farthest {
            right -= 1;
        }
        Window { left, right }
    }

    /// The estimates at `x`, all finite, in any order.
    pub fn means(&self, x: &[f64], k: f64) -> Vec<f64> {
        let mut window = Window { left: 0, right: 0 };
        let mut means = vec![0.0; x.len()];
        for (visited, i) in order(&[x]).into_iter().enumerate() {
            interrupt::leave_at(visited);
            means[i] = self.mean + self.slide(&mut window, x[i], k).mean(k);
        }
        means
    }

    /// The score's sums for one number of neighbours.
    pub fn scores(&self, k: f64) -> Scores {
        let (mut with, mut without) = (Window { left: 0, right: 0 }, Window { left: 0, right: 0 });
        let mut scores = Scores::default();
        for (visited, &LinePoint { group, weight: w, y }) in self.points.iter().enumerate() {
            interrupt::leave_at(visited);
            let q = self.x[group];
            let whole = self.slide(&mut with, q, k);
            let more = self.slide(&mut without, q, k + w);
            scores.add(k, w, y, whole, more);
        }
        scores
    }
}

//! Piecewise cubic polynomials whose breakpoints may be jumps, kinks or jumps of the third derivative.

use serde::{Deserialize, Serialize};

use super::limits::FREE_POWERS;
use crate::sort;
use crate::vectors::{add, dot};

/// A basis function, in the unit coordinate s in [-1, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Term {
    /// s^k.
    Power(u8),
    /// The truncated power (s - at)^degree where s >= at, else 0; degree 0, 1 or 3.
    TruncatedPower {
        /// The breakpoint.
        at: f64,
        /// The degree of the piece that begins there.
        degree: u8,
    },
}

impl Term {
    /// Whether it has a breakpoint.
    pub fn is_breakpoint(&self) -> bool {
        matches!(self, Term::TruncatedPower { .. })
    }

    /// The function's value at s.
    pub fn value(self, s: f64) -> f64 {
        match self {
            Term::Power(k) => s.powi(i32::from(k)),
            Term::TruncatedPower { at, degree } if s >= at => (s - at).powi(i32::from(degree)),
            Term::TruncatedPower { .. } => 0.0,
        }
    }

    /// The coefficients of the powers of s - `from` for s just above `from`.
    fn expanded(self, from: f64) -> [f64; 4] {
        let (distance, degree) = match self {
            Term::Power(k) => (from, k),
            Term::TruncatedPower { at, degree } if from >= at => (from - at, degree),
            Term::TruncatedPower { .. } => return [0.0; 4],
        };
        let power = |k: i32| distance.powi(k);
        match degree {
            0 => [1.0, 0.0, 0.0, 0.0],
            1 => [power(1), 1.0, 0.0, 0.0],
            2 => [power(2), 2.0 * power(1), 1.0, 0.0],
            _ => [power(3), 3.0 * power(2), 3.0 * power(1), 1.0],
        }
    }
}

/// The powers that every basis begins with.
pub(super) fn powers() -> impl Iterator<Item = Term> {
    (0..FREE_POWERS).map(Term::Power)
}

/// The linear maps from the input to the unit coordinate and back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct UnitCoordinate {
    pub centre: f64,
    pub half: f64,
}

impl UnitCoordinate {
    /// [low, high] becomes [-1, 1].
    pub fn new(low: f64, high: f64) -> Self {
        UnitCoordinate {
            centre: 0.5 * low + 0.5 * high,
            half: 0.5 * high - 0.5 * low,
        }
    }

    /// The unit coordinate, held at the ends outside of the range.
    pub fn of(&self, x: f64) -> f64 {
        ((x - self.centre) / self.half).clamp(-1.0, 1.0)
    }

    /// The input at a unit coordinate.
    pub fn back(&self, s: f64) -> f64 {
        self.centre + self.half * s
    }
}

/// A breakpoint chosen from the data.
pub(super) struct Breakpoint {
    /// Where, in the input's unit.
    pub at: f64,
    /// "jump" where the value changes, "kink" where the slope does, "knot" where the third derivative does.
    pub kind: &'static str,
    /// The standard error of a kink's place.
    pub error: Option<f64>,
}

/// The breakpoints of a basis, in order, with their standard errors if known.
pub(super) fn breakpoints(
    terms: &[Term],
    unit: UnitCoordinate,
    error: impl Fn(usize) -> Option<f64>,
) -> Vec<Breakpoint> {
    let breakpoint = |(k, term): (usize, &Term)| match term {
        Term::Power(_) => None,
        Term::TruncatedPower { at, degree } => Some(Breakpoint {
            error: error(k),
            at: unit.back(*at),
            kind: match degree {
                0 => "jump",
                1 => "kink",
                _ => "knot",
            },
        }),
    };
    let mut all: Vec<Breakpoint> = terms.iter().enumerate().filter_map(breakpoint).collect();
    sort::by_key(&mut all, |b| b.at);
    all
}

/// Several linear combinations of terms, as a table of cubic polynomials between the breakpoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PiecewiseCubics {
    pub unit: UnitCoordinate,
    /// The lower end of every piece, the first -1.
    lower: Vec<f64>,
    /// For every piece the coefficients of 1, d, d^2, d^3 with d = s - lower end, `size` of each.
    table: Vec<f64>,
    size: usize,
}

impl PiecewiseCubics {
    /// The functions $q_i = \sum_j \mathrm{mix}_{ij} \mathrm{term}_j$, `mix` row-major with a row a function.
    pub fn new(unit: UnitCoordinate, terms: &[Term], mix: &[f64]) -> PiecewiseCubics {
        let mut lower = vec![-1.0];
        lower.extend(terms.iter().filter_map(|t| match t {
            Term::TruncatedPower { at, .. } => Some(*at),
            Term::Power(_) => None,
        }));
        lower.sort_unstable_by(f64::total_cmp);
        lower.dedup();
        let size = mix.len() / terms.len();
        let mut table = vec![0.0; lower.len() * 4 * size];
        for (piece, l) in lower.iter().enumerate() {
            let at = &mut table[piece * 4 * size..][..4 * size];
            for (j, term) in terms.iter().enumerate() {
                let expanded = term.expanded(*l);
                for i in 0..size {
                    for p in 0..4 {
                        at[p * size + i] += mix[i * terms.len() + j] * expanded[p];
                    }
                }
            }
        }
        PiecewiseCubics {
            unit,
            lower,
            table,
            size,
        }
    }

    /// With these terms as further functions; their breakpoints must be among the present ones.
    pub fn with_terms(&self, terms: &[Term]) -> PiecewiseCubics {
        let (n, size) = (self.size, self.size + terms.len());
        let mut table = Vec::with_capacity(self.lower.len() * 4 * size);
        for (piece, l) in self.lower.iter().enumerate() {
            for p in 0..4 {
                table.extend_from_slice(&self.table[(piece * 4 + p) * n..][..n]);
                table.extend(terms.iter().map(|term| term.expanded(*l)[p]));
            }
        }
        PiecewiseCubics {
            unit: self.unit,
            lower: self.lower.clone(),
            table,
            size,
        }
    }

    /// The change of the first function's slope at a breakpoint, in the unit coordinate.
    pub fn slope_change(&self, at: f64) -> f64 {
        self.slope_changes(self.lower.partition_point(|l| *l < at))[0]
    }

    /// The changes of the functions' slopes at the start of a piece.
    fn slope_changes(&self, piece: usize) -> Vec<f64> {
        let d = self.lower[piece] - self.lower[piece - 1];
        let (before, after) = (self.piece(piece - 1), self.piece(piece));
        let of = |i: usize| {
            let c = |p: usize| before[p * self.size + i];
            after[self.size + i] - (c(1) + d * (2.0 * c(2) + 3.0 * d * c(3)))
        };
        (0..self.size).map(of).collect()
    }

    /// The coefficients of a piece.
    fn piece(&self, piece: usize) -> &[f64] {
        &self.table[piece * 4 * self.size..][..4 * self.size]
    }

    /// The same functions with a kink moved; no other breakpoint may lie between the two places.
    ///
    /// A slope change k that moves from t to t' adds k (t - t') to all pieces above it. The first of these begins at t'.
    pub fn with_kink_moved(&self, from: f64, to: f64) -> PiecewiseCubics {
        let n = self.size;
        let first = self.lower.partition_point(|l| *l < from);
        let mut moved = self.clone();
        moved.lower[first] = to;
        let raised: Vec<f64> = self.slope_changes(first).iter().map(|k| k * (from - to)).collect();
        for piece in moved.table[first * 4 * n..].chunks_exact_mut(4 * n) {
            piece.iter_mut().zip(&raised).for_each(|(c, by)| *c += by);
        }
        let (d, piece) = (to - from, &mut moved.table[first * 4 * n..][..4 * n]);
        for i in 0..n {
            let [c0, c1, c2, c3] = [0, 1, 2, 3].map(|p| piece[p * n + i]);
            piece[i] = c0 + d * (c1 + d * (c2 + d * c3));
            piece[n + i] = c1 + d * (2.0 * c2 + 3.0 * d * c3);
            piece[2 * n + i] = c2 + 3.0 * d * c3;
        }
        moved
    }

    /// Subtracts from each function, except the constant first one, its weighted mean over these points. Returns the means.
    pub fn centre(&mut self, points: &[f64], weights: &[f64]) -> Vec<f64> {
        let (mut values, mut sums) = (vec![0.0; self.size], vec![0.0; self.size]);
        for (s, weight) in points.iter().zip(weights) {
            self.values(self.unit.back(*s), &mut values);
            add(&mut sums, *weight, &values);
        }
        let total: f64 = weights.iter().sum();
        let means: Vec<f64> = sums.iter().map(|sum| sum / total).collect();
        for piece in self.table.chunks_exact_mut(4 * self.size) {
            let constants = piece[..self.size].iter_mut().zip(&means).skip(1);
            constants.for_each(|(c, mean)| *c -= mean);
        }
        means
    }

    /// Whether the table has what the functions need.
    pub fn is_whole(&self) -> bool {
        self.size > 0 && !self.lower.is_empty() && self.table.len() == self.lower.len() * 4 * self.size
    }

    /// The number of functions.
    pub fn size(&self) -> usize {
        self.size
    }

    /// All functions at x.
    pub fn values(&self, x: f64, out: &mut [f64]) {
        let s = self.unit.of(x);
        let piece = self.lower[1..].partition_point(|l| *l <= s);
        let d = s - self.lower[piece];
        let n = self.size;
        let at = &self.table[piece * 4 * n..][..4 * n];
        let (low, high) = at.split_at(2 * n);
        let (c0, c1) = low.split_at(n);
        let (c2, c3) = high.split_at(n);
        for ((((o, a), b), c), e) in out.iter_mut().zip(c0).zip(c1).zip(c2).zip(c3) {
            *o = a + d * (b + d * (c + d * e));
        }
    }

    /// The one function with these coefficients.
    pub fn combined(&self, c: &[f64]) -> PiecewiseCubics {
        let table = self.table.chunks_exact(self.size).map(|row| dot(row, c));
        PiecewiseCubics {
            unit: self.unit,
            lower: self.lower.clone(),
            table: table.collect(),
            size: 1,
        }
    }

    /// The first function at x.
    pub fn value(&self, x: f64) -> f64 {
        let s = self.unit.of(x);
        let piece = self.lower[1..].partition_point(|l| *l <= s);
        let d = s - self.lower[piece];
        let at = &self.table[piece * 4 * self.size..];
        let n = self.size;
        at[0] + d * (at[n] + d * (at[2 * n] + d * at[3 * n]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_sum_of_the_terms() {
        let unit = UnitCoordinate::new(3.0, 7.0);
        let terms = [
            Term::Power(0),
            Term::Power(1),
            Term::Power(2),
            Term::Power(3),
            Term::TruncatedPower { at: 0.3, degree: 0 },
            Term::TruncatedPower { at: -0.6, degree: 1 },
            Term::TruncatedPower { at: 0.3, degree: 3 },
        ];
        let mix: Vec<f64> = (0..14).map(|i| ((7 * i) as f64).sin()).collect();
        let pieces = PiecewiseCubics::new(unit, &terms, &mix);
        let both = pieces.combined(&[2.0, -1.0]);
        for x in [3.0, 3.7, 3.81, 5.0, 5.59, 5.61, 7.0, 9.0] {
            let mut got = [0.0; 2];
            pieces.values(x, &mut got);
            // Outside, the value of the end is held.
            let s = unit.of(x.min(7.0));
            for i in 0..2 {
                let want: f64 = terms.iter().zip(&mix[7 * i..]).map(|(t, m)| m * t.value(s)).sum();
                assert!((got[i] - want).abs() < 1e-14, "{x} {i}");
            }
            assert!((both.value(x) - (2.0 * got[0] - got[1])).abs() < 1e-14);
            assert!((pieces.value(x) - got[0]).abs() < 1e-15);
        }
    }

    #[test]
    fn functions_with_more_terms_and_with_a_moved_kink() {
        let unit = UnitCoordinate::new(3.0, 7.0);
        let kink = Term::TruncatedPower { at: -0.2, degree: 1 };
        let cubic = Term::TruncatedPower { at: 0.4, degree: 3 };
        let terms = [Term::Power(1), Term::Power(3), kink, cubic];
        let mix = [0.3, -0.8, 1.7, 2.1, 0.0, 0.2, 0.5, -1.0];
        let pieces = PiecewiseCubics::new(unit, &terms, &mix);
        let jump = Term::TruncatedPower { at: -0.2, degree: 0 };
        let more = pieces.with_terms(&[jump]);
        for x in [3.0, 4.5999, 4.6001, 5.0, 6.0, 7.0] {
            let (mut two, mut three) = ([0.0; 2], [0.0; 3]);
            pieces.values(x, &mut two);
            more.values(x, &mut three);
            assert_eq!(three, [two[0], two[1], jump.value(unit.of(x))]);
        }
        // The first function has the first four coefficients, and so the kink's.
        assert!((pieces.slope_change(-0.2) - 1.7).abs() < 1e-12);
        assert!(pieces.slope_change(0.4).abs() < 1e-12);
        for to in [-0.9, -0.25, -0.15, 0.39] {
            let moved = pieces.with_kink_moved(-0.2, to);
            let expected = [terms[0], terms[1], Term::TruncatedPower { at: to, degree: 1 }, terms[3]];
            let expected = PiecewiseCubics::new(unit, &expected, &mix);
            for i in 0..200 {
                let x = 3.0 + 4.0 * f64::from(i) / 199.0;
                let (mut got, mut want) = ([0.0; 2], [0.0; 2]);
                moved.values(x, &mut got);
                expected.values(x, &mut want);
                assert!(
                    (got[0] - want[0]).abs() < 1e-14 && (got[1] - want[1]).abs() < 1e-14,
                    "{to} {x}"
                );
            }
        }
    }
}

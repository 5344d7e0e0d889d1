//! The windows x_i - h <= x_j <= x_i + h of all sorted points, by one merge.
//!
//! Walk through the plane of (i, j): where x_j - x_i <= h go to the next j, else to the next i. When the walk leaves
//! i, j is the end of i's window; when it leaves j, i is the start of j's. The walk is a staircase of at most 2n
//! steps, each without a branch that could be mispredicted. A step must wait for the one before; so it is cut in
//! several pieces, whose ends a search along the diagonals i + j = const finds, and these are made side by side.

use std::ops::Range;

/// Steps that are made at a time, a power of two.
const TILE: usize = 4096;
/// Pieces that are made side by side.
const PIECES: usize = 6;

/// Sorted abscissas, continued by infinity.
pub struct Abscissas<'a> {
    x: &'a [f64],
    /// The last points and what follows them.
    tail: Vec<f64>,
    tail_start: usize,
}

/// The windows of neighbouring points, a few of them at a time.
pub struct Windows<'a> {
    abscissas: &'a Abscissas<'a>,
    h: f64,
    range: Range<usize>,
    /// The first point whose window has not been told yet.
    next: usize,
    /// The next step is from here.
    i: usize,
    j: usize,
    /// Where it ends: the windows of all further points of the range end alike.
    last: (usize, usize),
    room: &'a mut Room,
}

/// Room for windows, which may be used again.
pub struct Room {
    /// The starts of all windows of the range, as far as they are known.
    starts: Vec<u32>,
    /// The ends of the windows that the last tile of steps has found.
    ends: Box<[u32; TILE]>,
    /// Where the walk left each j and each i of a tile: the i and the j, counted from where the tile starts.
    left_j: Box<[u16; TILE]>,
    left_i: Box<[u16; TILE]>,
}

impl Default for Room {
    fn default() -> Self {
        Room {
            starts: Vec::new(),
            ends: Box::new([0; TILE]),
            left_j: Box::new([0; TILE]),
            left_i: Box::new([0; TILE]),
        }
    }
}

impl<'a> Windows<'a> {
    /// Those of the points `range`, of which there must be one.
    pub fn new(abscissas: &'a Abscissas<'a>, h: f64, range: Range<usize>, room: &'a mut Room) -> Self {
        let x = abscissas.x;
        let start = |i: usize| x[..=i].partition_point(|&v| x[i] - v > h);
        let end = |i: usize| i + x[i..].partition_point(|&v| v - x[i] <= h);
        let (i, last) = (start(range.start), end(range.end - 1));
        let j = end(i);
        // All points up to j are in the first window and have its start.
        room.starts.resize(range.len(), 0);
        room.starts[..j.min(range.end) - range.start].fill(i as u32);
        Windows {
            abscissas,
            h,
            next: range.start,
            range,
            i,
            j,
            last: (start(last - 1), last),
            room,
        }
    }

    /// The next points, the first of each one's window and the one after the last.
    pub fn next(&mut self) -> Option<(Range<usize>, &[u32], &[u32])> {
        let first = self.next;
        while self.i <= first && (self.i, self.j) != self.last {
            self.climb();
        }
        self.next = if self.i > first {
            self.i
        } else {
            // All steps are made: what remains ends where the last window does.
            let next = self.range.end.min(first + TILE);
            self.room.ends[..next - first].fill(self.j as u32);
            next
        };
        let points = first..self.next;
        let starts = &self.room.starts[first - self.range.start..][..points.len()];
        let ends = &self.room.ends[..points.len()];
        (!points.is_empty()).then_some((points, starts, ends))
    }

    /// Makes TILE steps, or those that are left.
    fn climb(&mut self) {
        let (i, j) = (self.i, self.j);
        let steps = TILE.min(self.last.0 - i + (self.last.1 - j));
        let (right, up) = self.make_steps(steps);
        let Room {
            starts,
            ends,
            left_j,
            left_i,
        } = &mut *self.room;
        let known = starts.len().min(j - self.range.start);
        for (start, &left) in starts[known..].iter_mut().zip(&left_j[..up]) {
            *start = i as u32 + u32::from(left);
        }
        // Points before the range have starts and ends that nobody asks for.
        let before = right.min(self.next.saturating_sub(i));
        for (end, &left) in ends.iter_mut().zip(&left_i[before..right]) {
            *end = j as u32 + u32::from(left);
        }
        (self.i, self.j) = (i + right, j + up);
    }

    /// Makes these steps, TILE at most, and tells how many went to the next i and to the next j.
    #[inline(never)]
    fn make_steps(&mut self, steps: usize) -> (usize, usize) {
        let (xi, xj, h) = (self.abscissas.tile(self.i), self.abscissas.tile(self.j), self.h);
        let (left_i, left_j) = (&mut *self.room.left_i, &mut *self.room.left_j);
        // The remainders tell the compiler that the places are in the tile.
        let rises = |i: usize, j: usize| xj[j % TILE] - xi[i % TILE] <= h;
        let diagonals: [usize; PIECES] = std::array::from_fn(|piece| piece * steps / PIECES);
        let first_js = on_diagonals(diagonals, rises);
        let mut js = first_js;
        // Pieces may overlap by a step, which both make alike.
        for step in 0..steps.div_ceil(PIECES) {
            for (j, diagonal) in js.iter_mut().zip(diagonals) {
                let i = diagonal + step - *j;
                // Written over until the walk has left them.
                left_j[*j % TILE] = i as u16;
                left_i[i % TILE] = *j as u16;
                *j += usize::from(rises(i, *j));
            }
        }
        // But the piece that arrives where another starts has written over what that one found.
        for piece in (1..PIECES).rev() {
            let end = diagonals.get(piece + 1).map_or(steps, |&diagonal| diagonal);
            let j = first_js[piece];
            let i = diagonals[piece] - j;
            if let Some(j) = (j..end - i).find(|&j| !rises(i, j)) {
                left_i[i % TILE] = j as u16;
            }
            if let Some(i) = (i..end - j).find(|&i| rises(i, j)) {
                left_j[j % TILE] = i as u16;
            }
        }
        let up = js[PIECES - 1];
        (steps - up, up)
    }
}

impl<'a> Abscissas<'a> {
    pub fn new(x: &'a [f64]) -> Self {
        let tail_start = x.len().saturating_sub(TILE);
        let mut tail = x[tail_start..].to_vec();
        tail.resize(x.len() - tail_start + TILE, f64::INFINITY);
        Abscissas { x, tail, tail_start }
    }

    /// Those from `start` on.
    fn tile(&self, start: usize) -> &[f64; TILE] {
        let beyond = &[f64::INFINITY; TILE];
        let inside = self.x.get(start..).and_then(|x| x.first_chunk());
        let tail = || self.tail.get(start - self.tail_start..).and_then(|x| x.first_chunk());
        inside.or_else(tail).unwrap_or(beyond)
    }
}

/// The staircase's j on the diagonals i + j = `sums`, of which the last is the farthest.
#[inline(always)]
fn on_diagonals<const D: usize>(sums: [usize; D], rises: impl Fn(usize, usize) -> bool) -> [usize; D] {
    // The lowest i which the last j before is in reach of. All searches are made at once, as each waits for what it
    // has read, and without a branch.
    let (mut low, mut len) = ([0; D], sums);
    for _ in 0..usize::BITS - sums[D - 1].leading_zeros() {
        for k in 0..D {
            let half = len[k] / 2;
            let beyond = !rises(low[k] + half, sums[k].wrapping_sub(low[k] + half + 1));
            let beyond = usize::from(beyond) & usize::from(len[k] > 0);
            low[k] += beyond * (half + 1);
            // Of an odd number as many are on either side.
            len[k] = half - (beyond & !len[k]);
        }
    }
    std::array::from_fn(|k| sums[k] - low[k])
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn windows_are_those_found_by_bisection() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        for n in [1, 2, 3, 7, 100, 1023, 2048, 4095, 4097, 9001] {
            let mut draw = |f: &dyn Fn(f64) -> f64| {
                let mut x: Vec<f64> = (0..n).map(|_| f(rng.random())).collect();
                x.sort_by(f64::total_cmp);
                x
            };
            let lines = [
                draw(&|u| u),
                draw(&|u| 1e6 + u),
                draw(&|u| (std::f64::consts::PI * (u - 0.5)).tan()),
                draw(&|u| (6.0 * u).floor() / 6.0),
                draw(&|u| (4.0 * u).floor() + 1e-9 * u),
                draw(&|_| 2.0),
            ];
            for x in &lines {
                let abscissas = Abscissas::new(x);
                let mut room = Room::default();
                for h in [1e-300, 1e-10, 1e-3, 1.0 / 6.0, 0.3, 0.9, 2.0, 1e9] {
                    for range in [0..n, n / 3..n / 2, n / 2..n, n - 1..n] {
                        if range.is_empty() {
                            continue;
                        }
                        let (mut starts, mut ends) = (Vec::new(), Vec::new());
                        let mut windows = Windows::new(&abscissas, h, range.clone(), &mut room);
                        while let Some((points, some_starts, some_ends)) = windows.next() {
                            assert!(points.start == range.start + starts.len() && !points.is_empty());
                            starts.extend_from_slice(some_starts);
                            ends.extend_from_slice(some_ends);
                        }
                        assert_eq!((starts.len(), ends.len()), (range.len(), range.len()));
                        for (k, i) in range.enumerate() {
                            let start = x.partition_point(|v| x[i] - v > h);
                            let end = x.partition_point(|v| v - x[i] <= h);
                            assert_eq!(
                                (starts[k] as usize, ends[k] as usize),
                                (start, end),
                                "n={n} h={h} i={i}"
                            );
                        }
                    }
                }
            }
        }
    }
}

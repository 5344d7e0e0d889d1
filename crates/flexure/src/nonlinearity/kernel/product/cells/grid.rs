//! Cells with numbers. The coordinates of a cell are the digits of its number. The last dimension has the last digit.

use std::ops::Range;

use super::{Ends, InOrder, Rule, SLICES, push};

#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Cells along every dimension.
    spans: Vec<usize>,
    /// Cell c holds the points `starts[c]..starts[c + 1]`.
    starts: Vec<u32>,
}

impl Grid {
    /// Orders the points by counting. They lie between `ends` along every dimension.
    pub fn ordered(rule: &Rule, x: &[&[f64]], ends: &[(f64, f64)]) -> InOrder<Grid> {
        let n = x[0].len();
        let last = |(j, ends): (usize, &(f64, f64))| rule.coordinate(j, ends.1) as usize;
        let spans: Vec<usize> = ends.iter().enumerate().map(|end| last(end) + 1).collect();
        let mut keys = vec![0_u32; n];
        for (j, column) in x.iter().enumerate() {
            let (origin, rate, span) = (rule.origin[j], rule.rate[j], spans[j] as u32);
            for (key, x) in keys.iter_mut().zip(*column) {
                // No point is below the origin.
                *key = *key * span + ((x - origin) * rate) as u32;
            }
        }
        // The counts stand two cells ahead. After they have been added up, `starts[c + 1]` is the start of cell c, and after all
        // points have been placed it is the end of cell c.
        let mut starts = vec![0_u32; spans.iter().product::<usize>() + 2];
        for &key in &keys {
            starts[key as usize + 2] += 1;
        }
        let mut total = 0;
        for start in &mut starts {
            total += *start;
            *start = total;
        }
        let mut order = vec![0; n];
        for (i, &key) in keys.iter().enumerate() {
            let start = &mut starts[key as usize + 1];
            order[*start as usize] = i as u32;
            *start += 1;
        }
        starts.pop();
        InOrder {
            index: Grid { spans, starts },
            order,
        }
    }

    pub fn groups(&self) -> Vec<Range<usize>> {
        let Some(&span) = self.spans.last() else {
            return Vec::new();
        };
        let mut groups = Vec::new();
        for row in (0..self.starts.len() - 1).step_by(span) {
            for cell in (row..row + span).step_by(SLICES) {
                let next = (cell + SLICES).min(row + span);
                let group = self.starts[cell] as usize..self.starts[next] as usize;
                if !group.is_empty() {
                    groups.push(group);
                }
            }
        }
        groups
    }

    pub fn runs(&self, ends: &Ends, runs: &mut Vec<Range<usize>>) {
        let mut within: [(usize, usize); super::MOST] = [(0, 0); super::MOST];
        for (j, &span) in self.spans.iter().enumerate() {
            let (low, high) = (ends[j].0.max(0), ends[j].1.min(span as i64 - 1));
            if low > high {
                return;
            }
            within[j] = (low as usize, high as usize);
        }
        self.descend(0, 0, &within[..self.spans.len()], runs);
    }

    /// Adds the runs of the cells whose first digits are `before` and whose other coordinates, from the `j`-th on, lie in `within`.
    fn descend(&self, j: usize, before: usize, within: &[(usize, usize)], runs: &mut Vec<Range<usize>>) {
        let first = before * self.spans[j];
        let (low, high) = (first + within[0].0, first + within[0].1);
        match &within[1..] {
            [] => push(self.starts[low] as usize..self.starts[high + 1] as usize, runs),
            rest => (low..=high).for_each(|cell| self.descend(j + 1, cell, rest, runs)),
        }
    }
}

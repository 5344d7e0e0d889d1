//! Sorting of numbers, and of anything by numbers.
//!
//! A standard sort is compiled again for every kind of item and of comparison. Here one function sorts all items through their places. It
//! is also faster than a sort of the items themselves, because the keys lie next to one another and ties are rare.

use std::cell::Cell;
use std::cmp::Ordering;
use std::sync::{Mutex, PoisonError};

use crate::{interrupt, parallel};

/// The number of comparisons between two checks whether the work must stop. They take about a millisecond.
const COMPARISONS: u32 = 1 << 16;

/// Up to this many items are sorted by one thread.
const PIECE: usize = 1 << 16;
/// More items are sorted in this many pieces.
const PIECES: usize = 64;

/// The places of the rows of these columns in increasing order of the first column, then of the second and so on. Equal rows keep their
/// order.
pub(crate) fn order(columns: &[&[f64]]) -> Vec<usize> {
    let [first, others @ ..] = columns else {
        return Vec::new();
    };
    let by_others = |i: u32, j: u32| {
        let compared = others
            .iter()
            .map(|column| column[i as usize].total_cmp(&column[j as usize]));
        compared.fold(Ordering::Equal, Ordering::then).then(i.cmp(&j))
    };
    let keys: Vec<(f64, u32)> = first.iter().copied().zip(0..).collect();
    let keys = ordered(keys, |a, b| a.0.total_cmp(&b.0).then_with(|| by_others(a.1, b.1)));
    keys.into_iter().map(|(_, place)| place as usize).collect()
}

/// The items in increasing order. Equal items must be indistinguishable. If there are many, all cores sort.
fn ordered<T: Copy + Send + Sync>(mut items: Vec<T>, compare: impl Fn(&T, &T) -> Ordering + Sync) -> Vec<T> {
    let sort = |piece: &mut [T]| {
        let asked = Asked::default();
        piece.sort_unstable_by(|a, b| {
            asked.once_more();
            compare(a, b)
        });
    };
    if items.len() <= PIECE {
        sort(&mut items);
        return items;
    }
    let length = items.len().div_ceil(PIECES);
    let pieces: Vec<_> = items.chunks_mut(length).map(Mutex::new).collect();
    parallel::map(pieces.len(), |k| {
        sort(&mut pieces[k].lock().unwrap_or_else(PoisonError::into_inner));
    });
    drop(pieces);
    // A range of the result holds the items of all pieces between two bounds.
    let mut bounds: Vec<T> = items.iter().copied().step_by(length.div_ceil(PIECES)).collect();
    sort(&mut bounds);
    let bounds: Vec<T> = bounds.into_iter().step_by(PIECES).collect();
    let range = |r: usize| {
        let below = |piece: &[T], bound: &T| piece.partition_point(|item| compare(item, bound).is_lt());
        let mut merged = Vec::new();
        for piece in items.chunks(length) {
            let from = r.checked_sub(1).map_or(0, |r| below(piece, &bounds[r]));
            let to = bounds.get(r).map_or(piece.len(), |bound| below(piece, bound));
            merged.extend_from_slice(&piece[from..to]);
        }
        // This sort merges runs that are already in order.
        merged.sort_by(&compare);
        merged
    };
    let ranges = parallel::map(bounds.len() + 1, range);
    drop(items);
    ranges.concat()
}

/// Ends a long sort if the work must stop. A sort of millions of numbers takes tenths of a second.
#[derive(Default)]
struct Asked(Cell<u32>);

impl Asked {
    fn once_more(&self) {
        self.0.set(self.0.get().wrapping_add(1));
        if self.0.get().is_multiple_of(COMPARISONS) {
            interrupt::leave();
        }
    }
}

/// Sorts items in increasing order of a key. Items with equal keys keep their order.
pub(crate) fn by_key<T>(items: &mut Vec<T>, key: impl FnMut(&T) -> f64) {
    let keys: Vec<f64> = items.iter().map(key).collect();
    let mut unsorted: Vec<Option<T>> = items.drain(..).map(Some).collect();
    items.extend(order(&[&keys]).into_iter().filter_map(|i| unsorted[i].take()));
}

/// The values in increasing order.
pub(crate) fn sorted(values: &[f64]) -> Vec<f64> {
    ordered(values.to_vec(), f64::total_cmp)
}

/// The median. For an even number of values it is the larger of the two in the middle. There must be at least one value.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn ties_are_broken_by_the_next_column_and_then_by_place() {
        let first = [2.0, -1.0, 2.0, 2.0, f64::NEG_INFINITY];
        let second = [5.0, 0.0, 4.0, 4.0, 7.0];
        assert_eq!(order(&[&first, &second]), [4, 1, 2, 3, 0]);
        assert_eq!(order(&[&first]), [4, 1, 0, 2, 3]);
        assert!(order(&[]).is_empty() && order(&[&[]]).is_empty());
    }

    #[test]
    fn the_median_of_an_even_number_is_the_larger_one_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 4.0, 2.0]), 3.0);
        assert_eq!(median(vec![5.0, 7.0, 6.0]), 6.0);
    }

    #[test]
    fn a_long_sort_ends_when_it_is_asked_to() {
        let values: Vec<f64> = (0..200_000).map(|i| f64::from(i * 7919 % 200_003)).collect();
        let work: [fn(&[f64]); 2] = [|v| drop(order(&[v])), |v| drop(sorted(v))];
        for sort in work {
            let interrupt = interrupt::Interrupt::after(3);
            assert!(interrupt.watch(|| sort(&values)).is_err());
            // The check came within the sort, not only after it.
            let whole = interrupt::Interrupt::after(1000);
            assert!(whole.watch(|| sort(&values)).is_ok());
            assert!(1000 - whole.left() > 5);
        }
    }

    #[test]
    fn many_items_are_sorted_in_pieces_as_few_are() {
        let n = 3 * PIECE + 17;
        let first: Vec<f64> = (0..n).map(|i| (i * 7919 % 100_003 / 40) as f64).collect();
        let second: Vec<f64> = (0..n).map(|i| (i * 104_729 % 65_537 % 5) as f64).collect();
        let mut want: Vec<usize> = (0..n).collect();
        want.sort_by(|&i, &j| {
            let compared = first[i].total_cmp(&first[j]).then(second[i].total_cmp(&second[j]));
            compared.then(i.cmp(&j))
        });
        assert_eq!(order(&[&first, &second]), want);
        // Equal numbers, increasing numbers and decreasing numbers.
        for x in [
            vec![1.0; n],
            (0..n).map(|i| i as f64).collect(),
            (0..n).map(|i| -(i as f64)).collect(),
        ] {
            let mut want = x.clone();
            want.sort_by(f64::total_cmp);
            assert_eq!(sorted(&x), want);
        }
    }

    proptest! {
        #[test]
        fn any_items_are_sorted(x in prop::collection::vec(prop::num::f64::ANY, 0..600)) {
            let mut items: Vec<(usize, f64)> = x.iter().map(|x| (x * 4.0).round()).enumerate().collect();
            let mut want = items.clone();
            want.sort_by(|a, b| a.1.total_cmp(&b.1));
            by_key(&mut items, |item| item.1);
            prop_assert!(items.iter().zip(&want).all(|(a, b)| a.0 == b.0));
        }
    }
}

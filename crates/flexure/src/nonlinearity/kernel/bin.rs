//! Bins of data: how many they are, their means and the products of the deviations from these.

/// 2^52: what it is added to has no place left for a fraction, and its bits count up.
const WHOLE: f64 = 4_503_599_627_370_496.0;

/// The number of points, their means, and the sums of products of their deviations from these.
#[derive(Debug, Clone, Copy)]
pub struct Bin {
    pub count: f64,
    pub x: f64,
    pub y: f64,
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
}

impl Bin {
    /// The data of both.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        let count = self.count + other.count;
        // Both may be empty.
        let share = other.count / count.max(1.0);
        let (dx, dy, product) = (other.x - self.x, other.y - self.y, self.count * share);
        Bin {
            count,
            x: self.x + share * dx,
            y: self.y + share * dy,
            xx: self.xx + other.xx + product * dx * dx,
            xy: self.xy + other.xy + product * dx * dy,
            yy: self.yy + other.yy + product * dy * dy,
        }
    }
}

/// The bins of increasing items, [first + k width, first + (k + 1) width) for integers k.
pub fn gather(items: impl Iterator<Item = Bin>, first: f64, width: f64) -> Vec<Bin> {
    let (mut bins, per_width) = (Vec::with_capacity(items.size_hint().0 / 2 + 1), 1.0 / width);
    // The sums of a bin so far, about its first item.
    let mut origin = [0.0; 2];
    let mut sums = Products::default();
    let mut end = f64::NEG_INFINITY;
    for item in items {
        if item.x >= end {
            if sums.count > 0.0 {
                bins.push(sums.about_mean(origin));
            }
            let place = ((item.x - first) * per_width) as i64 as f64;
            // Rounding may have made the place one less, but those of one abscissa are in one bin.
            end = (first + (place + 1.0) * width).max(item.x.next_up());
            origin = [item.x, item.y];
            sums = Products::default();
        }
        let (dx, dy) = (item.x - origin[0], item.y - origin[1]);
        sums.count += item.count;
        sums.x += item.count * dx;
        sums.y += item.count * dy;
        sums.xx += item.xx + item.count * dx * dx;
        sums.xy += item.xy + item.count * dx * dy;
        sums.yy += item.yy + item.count * dy * dy;
    }
    if sums.count > 0.0 {
        bins.push(sums.about_mean(origin));
    }
    bins
}

/// Sums of deviations and of their products, in one line of the cache.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
pub struct Products {
    pub count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Products {
    /// Adds a point by its deviations.
    #[inline(always)]
    pub fn add(&mut self, dx: f64, dy: f64) {
        self.count += 1.0;
        self.x += dx;
        self.y += dy;
        self.xx += dx * dx;
        self.xy += dx * dy;
        self.yy += dy * dy;
    }

    /// The sums over both, from one origin.
    pub fn plus(self, other: Self) -> Self {
        Products {
            count: self.count + other.count,
            x: self.x + other.x,
            y: self.y + other.y,
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    pub fn about_mean(&self, origin: [f64; 2]) -> Bin {
        let per_count = 1.0 / self.count;
        let (x, y) = (self.x * per_count, self.y * per_count);
        Bin {
            count: self.count,
            x: origin[0] + x,
            y: origin[1] + y,
            xx: (self.xx - x * self.x).max(0.0),
            xy: self.xy - x * self.y,
            yy: (self.yy - y * self.y).max(0.0),
        }
    }
}

/// The whole number nearest to a place and what the place is more than it; no index of anything where the place is negative or not
/// finite. Without a conversion, which would take longer than the rest.
#[inline(always)]
pub fn nearest_whole(place: f64) -> (usize, f64) {
    let rounded = place + WHOLE;
    // Below WHOLE the bits are less than its own, and so the difference is large.
    let k = rounded.to_bits().wrapping_sub(WHOLE.to_bits());
    (usize::try_from(k).unwrap_or(usize::MAX), place - (rounded - WHOLE))
}

/// A place of at least zero and less than 2^32, rounded down; zero of what is not a number. Without a conversion, of which few are made at a time.
#[inline(always)]
pub fn whole_below(place: f64) -> u32 {
    let rounded = place + WHOLE;
    let up = u64::from(rounded - WHOLE > place);
    // The lower half of WHOLE's own bits is zero.
    (rounded.to_bits() - up) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_rounded_down() {
        let whole = [0, 1, 2, 3, 1000, 1001, u32::MAX - 1, u32::MAX];
        for k in whole {
            let place = f64::from(k);
            assert_eq!(whole_below(place), k);
            for rest in [1e-9, 0.25, 0.5, 0.75] {
                assert_eq!(whole_below(place + rest), (place + rest) as u32, "{place} + {rest}");
            }
            assert_eq!(whole_below((place + 1.0).next_down()), k);
        }
        assert_eq!(whole_below(f64::MIN_POSITIVE), 0);
        assert_eq!(whole_below(f64::NAN), 0);
    }
}

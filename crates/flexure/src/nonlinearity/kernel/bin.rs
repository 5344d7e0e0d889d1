//! Bins of data: their counts, their means and the products of the deviations from these.

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
    /// A bin without points.
    pub const EMPTY: Bin = Bin {
        count: 0.0,
        x: 0.0,
        y: 0.0,
        xx: 0.0,
        xy: 0.0,
        yy: 0.0,
    };

    /// A bin of one point.
    pub fn of_point(x: f64, y: f64) -> Self {
        Bin {
            count: 1.0,
            x,
            y,
            xx: 0.0,
            xy: 0.0,
            yy: 0.0,
        }
    }

    /// The points of both bins. At least one of them must not be empty.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        let count = self.count + other.count;
        let share = other.count / count;
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

/// The sum of squared distances of a bin's points from the line through its mean's abscissa at `value` with this slope.
#[inline(always)]
pub fn squares_about(bin: Bin, value: f64, slope: f64) -> f64 {
    let residual = bin.y - value;
    bin.yy + slope * (slope * bin.xx - 2.0 * bin.xy) + bin.count * residual * residual
}

/// Gathers increasing items into the bins [first + k width, first + (k + 1) width) for integers k. Empty bins are left out.
pub fn gather(items: impl Iterator<Item = Bin>, first: f64, width: f64) -> Vec<Bin> {
    let (mut bins, per_width) = (Vec::<Bin>::with_capacity(items.size_hint().0 / 2 + 1), 1.0 / width);
    let mut end = f64::NEG_INFINITY;
    let mut current: Option<Bin> = None;
    for item in items {
        current = match current {
            Some(bin) if item.x < end => Some(bin.plus(item)),
            full => {
                bins.extend(full);
                let index = ((item.x - first) * per_width) as i64 as f64;
                // Rounding can make the index one less, but points at one abscissa share one bin.
                end = (first + (index + 1.0) * width).max(item.x.next_up());
                Some(item)
            }
        };
    }
    bins.extend(current);
    bins
}

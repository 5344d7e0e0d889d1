use super::*;
use crate::identify::request::Options;
use crate::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

fn system() -> KnownHammerstein {
    let [linear, _] = known_linear_parts();
    KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear)
}

fn started(record: &Record, excerpt: usize) -> ShardedHammerstein {
    let (third, n) = (excerpt / 3, record.len());
    let parts = [0, n / 3, n - third].map(|at| record.slice(at..at + third));
    ShardedHammerstein::new(RefinedHammerstein::default(), &parts.each_ref(), "u", "y").unwrap()
}

/// The sums over the first `n` samples, cut at these places.
fn summed(point: &ShardPoint, record: &Record, n: usize, cuts: &[usize], reach: usize) -> ShardSums {
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let ends = cuts.iter().copied().chain([n]);
    let starts = [0].into_iter().chain(cuts.iter().copied());
    let of_shard = |(from, end): (usize, usize)| {
        let first = from.saturating_sub(reach);
        point
            .sums(&u[first..end], &y[first..end], first, from - first, n)
            .unwrap()
    };
    let mut shards = starts.zip(ends).map(of_shard);
    let mut sums = shards.next().unwrap();
    shards.for_each(|shard| sums.merge(&shard).unwrap());
    sums
}

/// The largest difference of two sums, each entry in units of its parameters' own sums.
fn difference(a: &ShardSums, b: &ShardSums) -> f64 {
    let (a, b) = (&a.0.normal, &b.0.normal);
    let n = a.descent.len();
    let size = |i: usize| a.normal[i * n + i].sqrt();
    let cost = (a.cost - b.cost).abs() / a.cost;
    (0..n * n).fold(cost, |worst, k| {
        let (i, j) = (k / n, k % n);
        let of_normal = (a.normal[k] - b.normal[k]).abs() / (size(i) * size(j));
        let of_descent = (a.descent[i] - b.descent[i]).abs() / (size(i) * a.cost.sqrt());
        worst.max(of_normal).max(of_descent)
    })
}

fn identified(record: &Record, excerpt: usize, cuts: &[usize]) -> Identification {
    let fitted = record.len() * 3 / 4;
    let mut found = started(&record.slice(0..fitted), excerpt);
    // The excerpts keep nothing back for the verdict: the share of the request counts.
    found.method.fresh_share = 0.05;
    while found
        .advance(summed(&found.point(), record, fitted, cuts, found.point().reach()))
        .unwrap()
    {}
    let (records, inputs) = ([record], ["u"]);
    let result = found
        .identification(&Request::new(&records, &inputs, "y", Options::default()))
        .unwrap();
    assert_eq!(result.fitted, fitted);
    result
}

fn coefficients(found: &Identification) -> Vec<f64> {
    let linear = found.linear("linear").unwrap();
    [linear.b(), linear.a(), found.curve("nonlinearity").unwrap().y()].concat()
}

fn error(found: &Identification) -> f64 {
    let curve = found.curve("nonlinearity").unwrap();
    let grid: Vec<f64> = (0..=200).map(|i| -1.9 + 3.8 * f64::from(i) / 200.0).collect();
    system().nonlinearity_error(&grid, |x| curve.value(x))
}

#[test]
fn the_sums_are_those_of_the_whole_record_however_it_is_cut() {
    let n = 200_000;
    let record = system().simulate(n, 3);
    let point = started(&record, 6000).point();
    let whole = summed(&point, &record, n, &[], 0);
    let even: Vec<usize> = (1..20).map(|k| k * n / 20).collect();
    for cuts in [&[70_001][..], &[5, 1000, 199_000], &even] {
        let sums = summed(&point, &record, n, cuts, point.reach());
        assert_eq!(sums.0.count, whole.0.count);
        assert!(
            difference(&whole, &sums) < 1e-10,
            "{cuts:?}: {}",
            difference(&whole, &sums)
        );
    }
    // What comes before a shard matters.
    let blind = summed(&point, &record, n, &even, 2);
    assert!(difference(&whole, &blind) > 1e-7, "{}", difference(&whole, &blind));
}

#[test]
fn the_system_does_not_depend_on_the_cuts_and_is_that_of_the_record_in_memory() {
    let record = system().simulate(60_000, 4);
    let whole = identified(&record, 15_000, &[]);
    let cut = identified(&record, 15_000, &[700, 20_000, 31_234]);
    for (a, b) in coefficients(&whole).iter().zip(coefficients(&cut)) {
        assert!((a - b).abs() < 1e-10 * (1.0 + a.abs()), "{a} {b}");
    }
    let own = RefinedHammerstein::default().identify(&record, "u", "y").unwrap();
    assert_eq!(
        (whole.order, whole.delay, whole.parameters),
        (own.order, own.delay, own.parameters)
    );
    let errors = |found: &Identification| {
        let linear = found.paths[0].blocks.iter().find_map(|block| block.linear()).unwrap();
        let errors = linear.errors.clone().unwrap();
        [errors.b, errors.a].concat()
    };
    let values = |found: &Identification| {
        let linear = found.linear("linear").unwrap();
        [linear.b(), linear.a()].concat()
    };
    let both = values(&whole).into_iter().zip(values(&own));
    for ((a, b), (error, of_own)) in both.zip(errors(&whole).into_iter().zip(errors(&own))) {
        assert!((a - b).abs() <= 0.2 * of_own, "{a} {b} {of_own}");
        assert!((error - of_own).abs() <= 0.05 * of_own, "{error} {of_own}");
    }
}

#[test]
fn the_error_falls_with_the_data_and_not_with_the_excerpts() {
    let error = |n: usize| -> f64 {
        let errors = (0..6).map(|seed| error(&identified(&system().simulate(n, seed), 6000, &[n / 2])));
        errors.sum::<f64>() / 6.0
    };
    // Sixteen times the samples.
    let (few, many) = (error(10_000), error(160_000));
    assert!(many < 0.4 * few, "{few} {many}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let record = system().simulate(20_000, 5);
    let mut found = started(&record, 6000);
    let sums = summed(&found.point(), &record, 20_000, &[], 0);
    let mut other = sums.clone();
    other.0.normal = NormalEquations::zero(3);
    assert!(sums.clone().merge(&other).is_err() && found.advance(other).is_err());
    let mut nothing = sums;
    nothing.0.count = 0;
    assert!(found.advance(nothing).is_err());
    let point = found.point();
    let not_finite = point.sums(&[1.0, f64::NAN], &[0.0, 0.0], 40, 0, 100).unwrap_err();
    assert!(not_finite.to_string().contains("sample 41"), "{not_finite}");
    assert!(point.sums(&[1.0], &[0.0, 0.0], 0, 0, 2).is_err());
    let damaged = ShardPoint {
        whitening: Vec::new(),
        ..point
    };
    assert!(damaged.sums(&[1.0], &[0.0], 0, 0, 1).is_err());
}

#[test]
fn sums_are_values_that_are_merged_in_any_order_and_travel_as_bytes() {
    let n = 30_000;
    let record = system().simulate(n, 6);
    let point = started(&record, 6000).point();
    let whole = summed(&point, &record, n, &[], 0);
    let (u, y) = (record.column("u").unwrap(), record.column("y").unwrap());
    let shards: Vec<ShardSums> = (0..6)
        .map(|k| {
            let (from, end) = (k * n / 6, (k + 1) * n / 6);
            let first = from.saturating_sub(point.reach());
            let mut sums = point.empty();
            sums.push(&point, &u[first..end], &y[first..end], first, from - first, n)
                .unwrap();
            sums
        })
        .collect();
    for order in [[0, 1, 2, 3, 4, 5], [5, 3, 1, 0, 2, 4], [2, 0, 5, 4, 1, 3]] {
        let mut all = point.empty();
        for k in order {
            let bytes = shards[k].to_bytes();
            let again = ShardSums::from_bytes(&bytes).unwrap();
            assert_eq!((&again, again.to_bytes()), (&shards[k], bytes));
            all.merge(&again).unwrap();
        }
        assert_eq!(all.count(), whole.count());
        assert!(
            difference(&whole, &all) < 1e-10,
            "{order:?}: {}",
            difference(&whole, &all)
        );
    }
    assert!(point.empty().push(&point, &[f64::NAN], &[0.0], 0, 0, 1).is_err());
}

#[test]
fn bytes_of_another_version_and_damaged_ones_are_refused_in_words() {
    let record = system().simulate(20_000, 7);
    let point = started(&record, 6000).point();
    let bytes = summed(&point, &record, 20_000, &[], 0).to_bytes();
    let refused = |bytes: &[u8]| ShardSums::from_bytes(bytes).unwrap_err().to_string();
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        let reason = match at {
            0..4 => "they begin otherwise",
            4 => "they are of another version",
            _ => "they are damaged",
        };
        assert!(refused(&damaged).contains(reason), "{at}: {}", refused(&damaged));
        let words = refused(&bytes[..at]);
        assert!(words.starts_with("these are no partial sums: they "), "{at}: {words}");
    }
    assert!(refused(&[&bytes[..], &[0]].concat()).contains("damaged"));
}

use super::*;
use crate::nonlinearity::kernel::leave_one_out;
use crate::selection::test_data::{noisy, slow};

/// The score by refits, one for every sample.
fn by_refits(kernel: Kernel, degree: Degree, h: f64, data: [&[f64]; 3], gap: usize) -> f64 {
    let [x, y, w] = data;
    let (mut error, mut total) = (0.0, 0.0);
    for t in (0..x.len()).filter(|&t| w[t] > 0.0) {
        let far = |v: &[f64]| {
            (0..x.len())
                .filter(|s| s.abs_diff(t) > gap)
                .map(|s| v[s])
                .collect::<Vec<_>>()
        };
        let (x_far, y_far, w_far) = (far(x), far(y), far(w));
        let method = KernelRegression { kernel, bandwidth: h };
        let fit = method.fit_weighted(&x_far, &y_far, &w_far).unwrap().with_degree(degree);
        let mut estimate = fit.value(x[t]);
        if estimate.is_nan() {
            let there = |s: &usize| w_far[*s] > 0.0;
            let distance = (0..x_far.len())
                .filter(there)
                .map(|s| (x_far[s] - x[t]).abs())
                .fold(f64::INFINITY, f64::min);
            let near: Vec<usize> = (0..x_far.len())
                .filter(there)
                .filter(|&s| (x_far[s] - x[t]).abs() == distance)
                .collect();
            let weight: f64 = near.iter().map(|&s| w_far[s]).sum();
            estimate = near.iter().map(|&s| w_far[s] * y_far[s]).sum::<f64>() / weight;
        }
        error += w[t] * (y[t] - estimate).powi(2);
        total += w[t];
    }
    error / total
}

#[test]
fn scores_are_those_of_refits() {
    let n = 90;
    let (scattered, _) = noisy(1, n, |_| 0.0);
    let levels: Vec<f64> = scattered.iter().map(|x| (2.0 * x).round()).collect();
    let (rising, y) = slow(2, n, 0.8, |x| 1e3 + x.sin());
    let ones = vec![1.0; n];
    let uneven: Vec<f64> = (0..n).map(|i| [0.0, 1.0, 0.01, 20.0][i % 4]).collect();
    for x in [&scattered, &levels, &rising] {
        for w in [None, Some(&uneven)] {
            for gap in [0, 1, 9] {
                let blocks = InTime::new(x, &y, w.map(|w| &w[..]), gap).unwrap();
                for kernel in Kernel::ALL {
                    for degree in [Degree::Constant, Degree::Linear] {
                        for h in [0.02, 0.4, 3.0] {
                            let want = by_refits(kernel, degree, h, [x, &y, w.unwrap_or(&ones)], gap);
                            let got = blocks.score(kernel, degree, h);
                            let what = format!("{kernel:?} {degree:?} h={h} gap={gap} {}", w.is_some());
                            assert!((got - want).abs() < 1e-9 * want, "{what}: {got} {want}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn without_a_gap_it_is_leave_one_out() {
    let (x, y) = noisy(4, 2000, |x| x.abs());
    let blocks = InTime::new(&x, &y, None, 0).unwrap();
    for degree in [Degree::Constant, Degree::Linear] {
        let want = leave_one_out(&Sorted::new(&x, &y, None), Kernel::Epanechnikov, degree, &[0.1])[0];
        let got = blocks.score(Kernel::Epanechnikov, degree, 0.1);
        assert!((got - want).abs() < 1e-12 * want);
    }
}

/// The mean squared error of the local line with each bandwidth, over seeds: by leave-one-out, by h-blocks and at
/// best.
#[test]
fn with_dependent_errors_leave_one_out_undersmooths_and_h_blocks_do_not() {
    let m = |x: f64| (2.0 * x).sin();
    let (kernel, degree) = (Kernel::Epanechnikov, Degree::Linear);
    let mut totals = [0.0; 3];
    for seed in 0..10 {
        let (x, y) = slow(seed, 600, 0.8, m);
        let error = |h: f64| {
            let method = KernelRegression { kernel, bandwidth: h };
            let fitted = method.fit(&x, &y).unwrap().with_degree(degree).predict(&x);
            fitted.iter().zip(&x).map(|(f, &x)| (f - m(x)).powi(2)).sum::<f64>() / 600.0
        };
        let one = BandwidthSearch::search(kernel, degree, &x, &y, None).unwrap();
        let gap = gap_from_data(&x, &y);
        assert!((4..60).contains(&gap), "{gap}");
        let blocks = InTime::new(&x, &y, None, gap).unwrap().search(kernel, degree);
        let best = (1..60)
            .map(|i| error(0.03 * f64::from(i)))
            .fold(f64::INFINITY, f64::min);
        for (total, e) in totals
            .iter_mut()
            .zip([error(one.bandwidth), error(blocks.bandwidth), best])
        {
            *total += e / 10.0;
        }
    }
    let [one, blocks, best] = totals;
    eprintln!("mean squared errors: leave-one-out {one:.5}, h-block {blocks:.5}, best {best:.5}");
    assert!(one > 1.8 * best && blocks < 1.4 * best, "{one} {blocks} {best}");
}

#[test]
fn independent_errors_call_for_a_small_gap() {
    let gaps: Vec<usize> = (0..20)
        .map(|seed| {
            let (x, y) = noisy(seed, 2000, |x| x.sin());
            gap_from_data(&x, &y)
        })
        .collect();
    assert!(
        gaps.iter().filter(|g| **g == 0).count() >= 15 && gaps.iter().all(|g| *g <= 3),
        "{gaps:?}"
    );
    assert_eq!(gap_from_data(&[1.0; 50], &[2.0; 50]), 0);
    assert_eq!(gap_from_data(&[1.0, 2.0], &[2.0, 1.0]), 0);
}

#[test]
fn a_gap_that_leaves_nothing_is_refused() {
    let x = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    assert!(InTime::new(&x, &x, None, 1).is_ok());
    let refused = InTime::new(&x, &x, None, 2).err().unwrap().to_string();
    assert!(
        refused.contains("the gap is 2") && refused.contains("at most half"),
        "{refused}"
    );
}

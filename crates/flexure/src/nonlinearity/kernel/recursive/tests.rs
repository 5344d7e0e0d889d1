use rand::{RngExt, SeedableRng};

use super::*;

const AT: [f64; 5] = [0.9, -0.5, 0.0, 7.0, 0.3];

fn stream(n: usize) -> Vec<(f64, f64)> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
    (0..n)
        .map(|_| {
            let x = rng.random_range(-1.0..1.0);
            (x, 1e6 + x * x + rng.random_range(-0.1..0.1))
        })
        .collect()
}

fn method(kernel: Kernel, form: RecursiveForm) -> RecursiveKernel {
    RecursiveKernel {
        kernel,
        form,
        bandwidth: 0.8,
        exponent: 0.25,
    }
}

#[test]
fn any_number_of_shards_gives_the_sums_as_they_are_written() {
    let data = stream(3000);
    for kernel in Kernel::ALL {
        for (form, r) in [(RecursiveForm::WolvertonWagner, 1), (RecursiveForm::DevroyeWagner, 0)] {
            let shards = |size: usize| {
                let mut parts = data.chunks(size).enumerate().map(|(k, part)| {
                    let mut sums = method(kernel, form).start_from((k * size) as u64, &AT).unwrap();
                    part.iter().for_each(|&(x, y)| sums.push(x, y).unwrap());
                    sums
                });
                let mut whole = parts.next_back().unwrap();
                parts.for_each(|part| whole.merge(&part).unwrap());
                assert_eq!(whole.count(), 3000);
                whole.finish()
            };
            let (one, ten) = (shards(3000), shards(300));
            for (j, q) in AT.iter().enumerate() {
                let (mut s, mut t) = (0.0, 0.0);
                for (i, (x, y)) in data.iter().enumerate() {
                    let h = 0.8 * (i as f64 + 1.0).log2().floor().mul_add(-0.25, 0.0).exp2();
                    let k = h.powi(-r) * kernel.weight((q - x) / h);
                    s += k;
                    t += k * (y - 1e6);
                }
                if s > 0.0 {
                    let want = 1e6 + t / s;
                    assert!((one[j] / want - 1.0).abs() < 1e-12 && (ten[j] / want - 1.0).abs() < 1e-12);
                } else {
                    assert!(one[j].is_nan() && ten[j].is_nan());
                }
            }
            assert!(kernel == Kernel::Gaussian || one[3].is_nan());
        }
    }
}

#[test]
fn ten_shards_of_many_points_give_what_one_gives() {
    let data = stream(200_000);
    let run = method(Kernel::Epanechnikov, RecursiveForm::WolvertonWagner);
    let sums = |from: usize, part: &[(f64, f64)]| {
        let mut sums = run.start_from(from as u64, &AT).unwrap();
        part.iter().for_each(|&(x, y)| sums.push(x, y - 1e6).unwrap());
        sums
    };
    let one = sums(0, &data).finish();
    let mut parts = data.chunks(20_000).enumerate().map(|(k, part)| sums(k * 20_000, part));
    let mut whole = parts.next().unwrap();
    parts.for_each(|part| whole.merge(&part).unwrap());
    for (&a, b) in one.iter().zip(whole.finish()) {
        assert!(a.is_nan() == b.is_nan() && !((a - b).abs() >= 1e-12), "{a} {b}");
    }
    assert!(
        one[3].is_nan() && one.iter().filter(|m| m.is_nan()).count() == 1,
        "{one:?}"
    );
}

#[test]
fn in_columns_the_estimate_is_the_sum_of_products_as_it_is_written() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
    let n = 500;
    let [a, b] = [1.0, 10.0].map(|scale| {
        (0..n)
            .map(|_| scale * rng.random_range(-1.0..1.0))
            .collect::<Vec<f64>>()
    });
    let y: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a * b).collect();
    let (at, proportions): ([&[f64]; 2], _) = ([&[0.3, -0.9, 0.0, 0.3], &[5.0, -9.0, 40.0, -2.0]], [1.0, 10.0]);
    for form in [RecursiveForm::WolvertonWagner, RecursiveForm::DevroyeWagner] {
        for kernel in [Kernel::Epanechnikov, Kernel::Gaussian, Kernel::Uniform] {
            let run = method(kernel, form);
            let sums = |from: usize, to: usize| {
                let mut sums = run.start_in_columns(from as u64, &at, &proportions).unwrap();
                (from..to).for_each(|i| sums.push_point(&[a[i], b[i]], y[i]).unwrap());
                sums
            };
            let mut whole = sums(200, n);
            whole.merge(&sums(0, 200)).unwrap();
            let found = whole.finish();
            let r = if form == RecursiveForm::WolvertonWagner { 2 } else { 0 };
            for (j, found) in found.iter().enumerate() {
                let (mut s, mut t) = (0.0, 0.0);
                for i in 0..n {
                    let h = run.bandwidth * (-run.exponent * (i as f64 + 1.0).log2().floor()).exp2();
                    let [u, v] = [(at[0][j] - a[i]) / h, (at[1][j] - b[i]) / (10.0 * h)];
                    let k = h.powi(-r) * kernel.weight(u) * kernel.weight(v);
                    s += k;
                    t += k * y[i];
                }
                match s > 0.0 {
                    true => assert!(
                        (found - t / s).abs() < 1e-12 * (1.0 + (t / s).abs()),
                        "{found} {}",
                        t / s
                    ),
                    false => assert!(found.is_nan()),
                }
            }
            assert!(kernel == Kernel::Gaussian || found[2].is_nan());
        }
    }
}

#[test]
fn columns_must_fit_together() {
    let run = method(Kernel::Epanechnikov, RecursiveForm::WolvertonWagner);
    let message =
        |at: &[&[f64]], proportions: &[f64]| run.start_in_columns(0, at, proportions).unwrap_err().to_string();
    assert!(message(&[], &[]).contains("1 to 6"), "{}", message(&[], &[]));
    let uneven = message(&[&[0.0], &[0.0, 1.0]], &[1.0, 1.0]);
    assert!(uneven.contains("'at'") && uneven.contains('2'), "{uneven}");
    let few = message(&[&[0.0], &[0.0]], &[1.0]);
    assert!(few.contains("the list of proportions"), "{few}");
    assert!(message(&[&[0.0]], &[-1.0]).contains("a column's proportion is -1"));
    let mut sums = run.start_in_columns(0, &[&[0.0], &[0.0]], &[1.0, 1.0]).unwrap();
    let refused = sums.push(0.0, 1.0).unwrap_err().to_string();
    assert!(refused.contains("an observation"), "{refused}");
    let other = run.start_in_columns(0, &[&[0.0], &[0.0]], &[1.0, 2.0]).unwrap();
    assert!(
        sums.merge(&other)
            .unwrap_err()
            .to_string()
            .contains("columns' bandwidths")
    );
}

#[test]
fn the_estimate_converges() {
    let mut sums = method(Kernel::Epanechnikov, RecursiveForm::WolvertonWagner)
        .start(&AT)
        .unwrap();
    stream(40_000).iter().for_each(|&(x, y)| sums.push(x, y).unwrap());
    for (q, m) in AT.iter().zip(sums.finish()).filter(|(q, _)| q.abs() < 0.9) {
        assert!((m - 1e6 - q * q).abs() < 0.01, "{q} {m}");
    }
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let good = method(Kernel::Uniform, RecursiveForm::DevroyeWagner);
    let message = |exponent, bandwidth, at: &[f64]| {
        let bad = RecursiveKernel {
            exponent,
            bandwidth,
            ..good
        };
        bad.start(at).unwrap_err().to_string()
    };
    assert_eq!(
        message(1.0, 1.0, &[0.0]),
        "the bandwidth's exponent is 1, but must be between 0 and 1"
    );
    assert!(message(0.2, f64::NAN, &[0.0]).contains("the bandwidth is NaN"));
    assert!(message(0.2, 1.0, &[0.0, f64::INFINITY]).contains("column 'at' is inf at sample 1"));
    let mut sums = good.start_from(7, &AT).unwrap();
    sums.push(0.0, 1.0).unwrap();
    let before = sums.clone();
    let refused = sums.push(0.0, f64::NAN).unwrap_err().to_string();
    assert!(refused.contains("column 'y' is NaN at sample 8"), "{refused}");
    assert_eq!(sums, before);
    let other = good.start(&AT[..4]).unwrap();
    let refused = sums.merge(&other).unwrap_err().to_string();
    assert!(refused.contains("evaluation points"), "{refused}");
}

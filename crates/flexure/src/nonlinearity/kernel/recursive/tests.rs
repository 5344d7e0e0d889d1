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

//! Values by statsmodels: scripts/reference/product_kernel.py.

use super::*;

#[test]
fn gaussian_product_kernels_are_those_of_statsmodels() {
    let a: Vec<f64> = (0..60).map(|i| f64::from((37 * i) % 101) / 50.0 - 1.0).collect();
    let b: Vec<f64> = (0..60).map(|i| f64::from((61 * i + 5) % 97) / 40.0).collect();
    let y: Vec<f64> = (0..60)
        .map(|i| {
            let (a, b) = (a[i as usize], b[i as usize]);
            a * a - b.sin() + f64::from((53 * i * i + 7 * i) % 97) / 97.0
        })
        .collect();
    let at: [&[f64]; 2] = [&[-0.9, -0.4, 0.05, 0.55, 0.9], &[0.2, 2.0, 1.1, 0.7, 2.3]];
    let constant = [
        0.5430124241566077,
        -0.18404394374937488,
        -0.3019967242599531,
        0.12669880165171934,
        0.5397360344321334,
    ];
    let linear = [
        0.7612134321370009,
        -0.4209394079259878,
        -0.39005812278457924,
        0.061952201179395046,
        0.6707817152862738,
    ];
    for (degree, want, left_out) in [
        (Degree::Constant, constant, 0.16262552007868036),
        (Degree::Linear, linear, 0.11260499438514768),
    ] {
        let method = method(Kernel::Gaussian, degree, &[0.35, 0.5]);
        let got = method.clone().fit(&[&a, &b], &y, None).unwrap().predict(&at).unwrap();
        for (got, want) in got.iter().zip(want) {
            assert!((got - want).abs() < 1e-12, "{degree:?}: {got} {want}");
        }
        let score = method.score(Criterion::LeaveOneOut, &[&a, &b], &y, None).unwrap();
        assert!((score - left_out).abs() < 1e-12, "{degree:?}: {score} {left_out}");
    }
}

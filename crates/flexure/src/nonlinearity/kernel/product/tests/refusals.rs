//! What is refused, and in which words.

use super::*;

fn refused(method: &KernelEstimator, x: &[&[f64]], y: &[f64]) -> String {
    method.clone().fit(x, y, None).unwrap_err().to_string()
}

#[test]
fn bandwidths_are_checked() {
    let x: [&[f64]; 2] = [&[0.0, 1.0, 2.0, 5.0], &[1.0, 0.0, 4.0, 1.0]];
    let y = [1.0, 2.0, 3.0, 4.0];
    let with = |h: &[f64]| method(Kernel::Epanechnikov, Degree::Linear, h);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(&with(&[1.0, bad]), &x, &y);
        assert!(
            error.starts_with("the bandwidth of x[1] is") && error.contains("positive and finite"),
            "{error}"
        );
        assert!(refused(&with(&[bad]), &x, &y).starts_with("the bandwidth is"));
        assert!(refused(&with(&[bad]), &x[..1], &y).starts_with("the bandwidth is"));
    }
    assert_eq!(
        refused(&with(&[1.0; 3]), &x, &y),
        "the bandwidth takes one value for all columns or 2 values, one a column, but 3 were given"
    );
    assert_eq!(
        refused(&with(&[1.0; 2]), &x[..1], &y),
        "the bandwidth takes one value, but 2 were given"
    );
    assert!(refused(&with(&[]), &x, &y).contains("but 0 were given"));
    let undecided = KernelEstimator::default().score(Criterion::LeaveOneOut, &x, &y, None);
    assert!(undecided.unwrap_err().to_string().contains("but 0 were given"));
    assert!(with(&[1.0]).fit(&x, &y, None).is_ok());
}

#[test]
fn too_few_distinct_points_are_reported() {
    let x: [&[f64]; 3] = [&[0.0, 1.0, 1.0, 0.0], &[1.0, 0.0, 0.0, 1.0], &[1.0, 0.0, 0.0, 1.0]];
    let y = [1.0, 2.0, 3.0, 4.0];
    let error = refused(&method(Kernel::Uniform, Degree::Linear, &[1.0]), &x, &y);
    assert!(
        error.contains("a local linear regression in 3 columns needs points of positive weight at 4 or more different places, but there are 2"),
        "{error}"
    );
    assert!(
        method(Kernel::Uniform, Degree::Constant, &[1.0])
            .fit(&x, &y, None)
            .is_ok()
    );
    let error = refused(&KernelEstimator::default(), &x[..1], &y);
    assert!(
        error.contains("in 1 column needs") && error.contains("at 3 or more"),
        "{error}"
    );
    let weightless = method(Kernel::Uniform, Degree::Linear, &[1.0]).fit(&x[..1], &y, Some(&[1.0, 0.0, 0.0, 1.0]));
    assert!(weightless.unwrap_err().to_string().contains("but there are 1"));
}

#[test]
fn columns_are_checked() {
    let seven = vec![&[1.0, 2.0, 3.0][..]; 7];
    let error = refused(&KernelEstimator::default(), &seven, &[1.0; 3]);
    assert_eq!(error, "a kernel regression takes 1 to 6 columns, but 7 were given");
    let error = refused(&KernelEstimator::default(), &[&[1.0, f64::NAN], &[0.0, 1.0]], &[1.0; 2]);
    assert!(error.contains("'x[0]' is NaN at sample 1"), "{error}");
    let fit = method(Kernel::Uniform, Degree::Constant, &[1.0])
        .fit(&[&[1.0], &[2.0]], &[3.0], None)
        .unwrap();
    assert!(
        fit.predict(&[&[1.0]])
            .unwrap_err()
            .to_string()
            .contains("2 columns, but 1")
    );
    assert_eq!(fit.predict(&[&[1.5, 9.0], &[2.0, 2.0]]).unwrap()[0], 3.0);
    assert!(fit.predict(&[&[], &[]]).unwrap().is_empty());
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(64))]
    #[test]
    fn no_data_make_anything_panic(
        points in proptest::collection::vec((
            proptest::prop_oneof![-3.0..3.0, proptest::prelude::any::<f64>(), proptest::prelude::Just(1.0)],
            proptest::prop_oneof![-3.0..3.0, proptest::prelude::any::<f64>(), proptest::prelude::Just(1.0)],
            0.0..2.0,
        ), 1..20),
        h in proptest::prop_oneof![0.1..2.0, proptest::prelude::any::<f64>()],
        q in proptest::prelude::any::<f64>(),
    ) {
        let a: Vec<f64> = points.iter().map(|p| p.0).collect();
        let b: Vec<f64> = points.iter().map(|p| p.1).collect();
        let w: Vec<f64> = points.iter().map(|p| p.2).collect();
        for kernel in [Kernel::Uniform, Kernel::Epanechnikov, Kernel::Gaussian] {
            for outside in [Outside::Nan, Outside::Nearest, Outside::Linear] {
                let fixed = KernelEstimator { outside, ..method(kernel, Degree::Linear, &[h]) };
                if let Ok(fit) = fixed.fit(&[&a, &b], &a, Some(&w)) {
                    proptest::prop_assert_eq!(fit.predict(&[&[q, 0.0], &[0.0, q]]).unwrap().len(), 2);
                }
            }
        }
        if let Ok(fit) = KernelEstimator::default().fit(&[&a, &b], &b, None) {
            proptest::prop_assert_eq!(fit.predict(&[&[q], &[0.0]]).unwrap().len(), 1);
        }
    }
}

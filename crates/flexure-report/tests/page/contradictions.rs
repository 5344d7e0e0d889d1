//! Pages whose data contradict themselves: the message says where.

use flexure_report::data::Page;
use flexure_report::{Error, render};

use super::pages;

/// The error that a change of the full page leads to.
fn fault(change: impl FnOnce(&mut Page)) -> Error {
    let mut page = pages::full();
    change(&mut page);
    render(&page).expect_err("the page is refused")
}

#[test]
fn contradictions_are_named() {
    let cases = [
        (
            fault(|p| p.record[1].values.truncate(10)),
            "record[1].values has 10 values where 6000 are needed: give one for each sample of record[0]",
        ),
        (
            fault(|p| p.nonlinearity.truth.truncate(4)),
            "nonlinearity.truth has 4 values where 181 are needed: give one for each abscissa",
        ),
        (
            fault(|p| p.nonlinearity.x[2] = -100.0),
            "nonlinearity.x[2] = -100 is not a finite value above the one before it: sort the abscissas",
        ),
        (
            fault(|p| p.choices[0].curve.as_mut().expect("a curve").x[0] = 0.0),
            "choices[0].curve.x[0] = 0 has no logarithm: leave out candidates that are not positive, or take a linear axis",
        ),
        (
            fault(|p| p.time.step = f64::NAN),
            "time starts at 0 and steps by NaN: the start must be finite, the step finite and positive",
        ),
        (
            fault(|p| p.arm.as_mut().expect("an arm").lengths[1] = 0.0),
            "arm.lengths[1] = 0: a link's length must be finite and positive, in metres",
        ),
    ];
    for (error, message) in cases {
        assert_eq!(error.to_string(), message);
    }
}

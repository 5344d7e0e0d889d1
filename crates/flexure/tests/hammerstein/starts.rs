//! The refinement from every estimator's plain estimate.

use flexure::identify::RefinedHammerstein;
use flexure::nonlinearity::EstimatorName;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};

use super::refined::{breakpoints, error, is_refined};

#[test]
fn every_estimator_can_be_the_start_and_leads_to_the_same_model() {
    let [linear, _] = known_linear_parts();
    let record = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear).simulate(8000, 5);
    for start in EstimatorName::ALL {
        let method = RefinedHammerstein {
            start,
            ..Default::default()
        };
        let result = method.identify(&record, "u", "y").unwrap();
        assert!(is_refined(&result), "{start:?}");
        assert_eq!((result.delay, result.order), (0, 2), "{start:?}");
        let kinks = breakpoints(&result);
        assert_eq!(kinks.len(), 2, "{start:?}: {kinks:?}");
        let got = error(|x| KnownNonlinearity::DeadZone.value(x), &result);
        // With this many samples, a known linear part and twenty knots give 0.025.
        assert!(got < 0.025, "{start:?}: {got}");
    }
}

//! Forms of a nonlinearity by name.

use flexure::identify::PhysicalForm;
use flexure::identify::hammerstein::MOST_DEGREE;

/// A form by name, with its degree where it is a polynomial.
pub fn form(text: &str) -> Result<PhysicalForm, String> {
    let polynomial = || {
        let degree = text.strip_prefix("polynomial:")?.parse().ok()?;
        (1..=MOST_DEGREE)
            .contains(&degree)
            .then_some(PhysicalForm::Polynomial(degree))
    };
    match text {
        "dead-zone" => Ok(PhysicalForm::DeadZone),
        "saturation" => Ok(PhysicalForm::Saturation),
        "limited-dead-zone" => Ok(PhysicalForm::LimitedDeadZone),
        "quantizer" => Ok(PhysicalForm::Quantizer),
        "friction" => Ok(PhysicalForm::Friction),
        "stiffness" => Ok(PhysicalForm::Stiffness),
        _ => polynomial().ok_or_else(|| {
            format!("expected dead-zone, saturation, limited-dead-zone, quantizer, polynomial:N with N from 1 to {MOST_DEGREE}, friction or stiffness")
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::form;

    #[test]
    fn forms_are_read_as_they_are_named() {
        for name in [
            "dead-zone",
            "saturation",
            "limited-dead-zone",
            "quantizer",
            "friction",
            "stiffness",
            "polynomial:1",
            "polynomial:15",
        ] {
            assert_eq!(form(name).map(|form| form.to_string()), Ok(name.to_owned()));
        }
        for wrong in [
            "",
            "polynomial",
            "polynomial:0",
            "polynomial:16",
            "polynomial:x",
            "Dead-zone",
        ] {
            assert!(form(wrong).is_err(), "{wrong}");
        }
    }
}

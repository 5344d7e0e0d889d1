//! Forms of a nonlinearity by name.

use flexure::identify::Form;

/// The largest degree of a polynomial that can be asked for.
const MOST_DEGREE: usize = 15;

/// A form by name, with its degree where it is a polynomial.
pub fn form(text: &str) -> Result<Form, String> {
    let polynomial = || {
        let degree = text.strip_prefix("polynomial:")?.parse().ok()?;
        (1..=MOST_DEGREE).contains(&degree).then_some(Form::Polynomial(degree))
    };
    match text {
        "dead-zone" => Ok(Form::DeadZone),
        "saturation" => Ok(Form::Saturation),
        "quantizer" => Ok(Form::Quantizer),
        "friction" => Ok(Form::Friction),
        "stiffness" => Ok(Form::Stiffness),
        _ => polynomial().ok_or_else(|| {
            format!("expected dead-zone, saturation, quantizer, polynomial:N with N from 1 to {MOST_DEGREE}, friction or stiffness")
        }),
    }
}

/// What [`form`] reads as this form.
pub fn form_name(form: Form) -> String {
    let name = match form {
        Form::DeadZone => "dead-zone",
        Form::Saturation => "saturation",
        Form::Quantizer => "quantizer",
        Form::Friction => "friction",
        Form::Stiffness => "stiffness",
        Form::Polynomial(degree) => return format!("polynomial:{degree}"),
    };
    name.to_owned()
}

#[cfg(test)]
mod tests {
    use super::{form, form_name};

    #[test]
    fn forms_are_read_as_they_are_named() {
        for name in [
            "dead-zone",
            "saturation",
            "quantizer",
            "friction",
            "stiffness",
            "polynomial:1",
            "polynomial:15",
        ] {
            assert_eq!(form(name).map(form_name), Ok(name.to_owned()));
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

//! Columns of two words, such as on and off.

/// Words for the two states of a switch: off and on, in lower case. They are 0 and 1.
const SWITCHES: [[&str; 2]; 3] = [["false", "true"], ["off", "on"], ["no", "yes"]];

/// The two words of a switch.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Switch(pub(super) &'static [&'static str; 2]);

impl Switch {
    /// The switch that has this word.
    pub(super) fn of(field: &str) -> Option<Switch> {
        SWITCHES
            .iter()
            .map(Switch)
            .find(|switch| switch.state(field, &mut [false; 2]).is_some())
    }

    /// The state that a word means, 0 or 1, which is then `seen`.
    pub(super) fn state(self, field: &str, seen: &mut [bool; 2]) -> Option<f64> {
        let state = self.0.iter().position(|word| field.eq_ignore_ascii_case(word))?;
        seen[state] = true;
        Some(state as f64)
    }
}

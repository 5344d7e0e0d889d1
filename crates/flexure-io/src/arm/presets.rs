//! The arm files that come with Flexure.

use super::error::ArmError;
use super::file::ArmFile;

/// The names of the presets with their commented texts.
pub const PRESETS: [(&str, &str); 5] = [
    ("space-arm", include_str!("../../presets/space-arm.toml")),
    ("motor-log", include_str!("../../presets/motor-log.toml")),
    ("elbow-test", include_str!("../../presets/elbow-test.toml")),
    ("short-stiff", include_str!("../../presets/short-stiff.toml")),
    ("frictionless", include_str!("../../presets/frictionless.toml")),
];

/// The commented text of a preset, to be copied and changed.
///
/// # Errors
/// [`ArmError::UnknownPreset`], which lists the names.
pub fn preset_text(name: &str) -> Result<&'static str, ArmError> {
    PRESETS
        .iter()
        .find(|(n, _)| *n == name)
        .map(|(_, text)| *text)
        .ok_or_else(|| ArmError::UnknownPreset {
            name: name.to_owned(),
            available: PRESETS.iter().map(|(n, _)| *n).collect(),
        })
}

/// A preset.
///
/// # Errors
/// [`ArmError::UnknownPreset`], which lists the names.
pub fn preset(name: &str) -> Result<ArmFile, ArmError> {
    ArmFile::from_toml_str(preset_text(name)?, &format!("preset {name}"))
}

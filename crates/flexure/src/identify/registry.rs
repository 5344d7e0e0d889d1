//! The list of the structures that can be identified.
//!
//! The command line, its help, the model files, the pages and the Python package take the structures from [`structures`]: a
//! structure made of existing blocks needs its own file and one row there.

use super::auto::AUTO;
use super::hammerstein::HAMMERSTEIN;
use super::reference::{NARX, VOLTERRA};
use super::request::Structure;
use super::structures::{
    DELAYED_STATIC, HAMMERSTEIN_WIENER, LINEAR, MULTIPLE_INPUTS, PARALLEL, WIENER, WIENER_HAMMERSTEIN,
};
use super::surface::JOINT_INPUTS;

/// All structures, in the order of lists.
pub fn structures() -> &'static [Structure] {
    &STRUCTURES
}

static STRUCTURES: [Structure; 12] = [
    AUTO,
    LINEAR,
    HAMMERSTEIN,
    WIENER,
    WIENER_HAMMERSTEIN,
    HAMMERSTEIN_WIENER,
    PARALLEL,
    MULTIPLE_INPUTS,
    JOINT_INPUTS,
    DELAYED_STATIC,
    NARX,
    VOLTERRA,
];

impl Structure {
    /// The structure of this name.
    pub fn by_name(key: &str) -> Option<&'static Structure> {
        structures().iter().find(|s| s.name.key == key)
    }
}

#[cfg(test)]
mod tests {
    /// The structure of CONTRIBUTING.md's recipe, as it stands there.
    #[test]
    fn the_worked_example_is_a_structure() {
        let contributing = include_str!("../../../../CONTRIBUTING.md");
        let example = include_str!("structures/delayed_static.rs");
        assert!(
            contributing.contains(&format!("```rust\n{example}```")),
            "CONTRIBUTING.md's example differs from delayed_static.rs"
        );
    }

    #[test]
    fn names_are_unique_and_complexities_start_at_one() {
        let keys: Vec<&str> = super::structures().iter().map(|s| s.name.key).collect();
        assert!((0..keys.len()).all(|i| !keys[..i].contains(&keys[i])), "{keys:?}");
        let simplest = super::structures().iter().filter_map(|s| s.complexity).min();
        assert_eq!(simplest, Some(1));
        assert!(super::Structure::by_name("none").is_none());
    }
}

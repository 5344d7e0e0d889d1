//! The structures that can be identified, as a list and by name.
//!
//! The command line, its help, the model files, the pages and the Python package take the structures from [`structures`]. A structure made
//! of existing blocks needs its own file, and its `mod` and its row in `structures/mod.rs`; this file stays unchanged.

use super::request::Structure;
use super::structures::STRUCTURES;

/// All structures, in the order of lists.
pub fn structures() -> &'static [Structure] {
    STRUCTURES
}

impl Structure {
    /// The structure of this name.
    pub fn by_name(key: &str) -> Option<&'static Structure> {
        structures().iter().find(|s| s.name.key == key)
    }
}

#[cfg(test)]
mod tests {
    /// The structure of the recipe in CONTRIBUTING.md.
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
    fn names_are_unique_and_the_linear_structure_is_the_simplest() {
        let keys: Vec<&str> = super::structures().iter().map(|s| s.name.key).collect();
        assert!((0..keys.len()).all(|i| !keys[..i].contains(&keys[i])), "{keys:?}");
        let simplest = super::structures().iter().filter_map(|s| s.rank).min();
        assert_eq!(simplest, Some(crate::identify::request::Rank::Linear));
        assert!(super::Structure::by_name("none").is_none());
    }
}

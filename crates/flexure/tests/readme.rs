//! The README shows the code of its example as it is.

#[test]
fn the_readme_shows_the_example() {
    let example = include_str!("../examples/readme.rs");
    let (_, code) = example.split_once("\n\n").unwrap();
    let readme = include_str!("../../../README.md");
    assert!(
        readme.contains(code),
        "the README's Rust example differs from examples/readme.rs"
    );
}

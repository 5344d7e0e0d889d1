//! What runs the exported models.

/// The exit code of `agreement.py` where the runtime is missing.
pub const MISSING: i32 = 77;

/// The interpreter whose packages are used: `FLEXURE_PYTHON`, or python3.
pub fn python() -> String {
    std::env::var("FLEXURE_PYTHON").unwrap_or_else(|_| "python3".to_owned())
}

/// Says that a test is skipped. Where `FLEXURE_PYTHON` is set, everything is to be there.
///
/// # Panics
/// Where `FLEXURE_PYTHON` is set.
pub fn skipped(why: &str) {
    assert!(std::env::var_os("FLEXURE_PYTHON").is_none(), "not to be skipped: {why}");
    eprintln!("skipped: {why}");
}

//! The block structures, a file each: where its search starts, and which parts it has.

mod delayed_static;
mod hammerstein_wiener;
mod linear;
mod multiple_inputs;
mod parallel;
#[cfg(test)]
mod tests;
mod wiener;
mod wiener_hammerstein;

pub use delayed_static::ROW as DELAYED_STATIC;
pub use hammerstein_wiener::ROW as HAMMERSTEIN_WIENER;
pub use linear::ROW as LINEAR;
pub use multiple_inputs::ROW as MULTIPLE_INPUTS;
pub use parallel::ROW as PARALLEL;
pub use wiener::ROW as WIENER;
pub use wiener_hammerstein::ROW as WIENER_HAMMERSTEIN;

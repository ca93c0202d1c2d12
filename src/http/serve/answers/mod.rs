//! Parts of answers that many operations share: values and surfaces at the queries, and diagnostics.

mod diagnostics;
pub use diagnostics::repeated_rows;
pub mod place;
pub mod surface;
pub mod values;

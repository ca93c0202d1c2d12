//! Machine resources: registers, memory and threads, with small vectors and matrices, random numbers and Φ.

pub mod heap;
pub mod instruction_set;
pub mod normal;
pub mod pages;
pub mod price;

pub(crate) mod eigen;
pub(crate) mod lanes;
pub(crate) mod parallelism;
pub(crate) mod random;
pub(crate) mod registers;
pub(crate) mod small;
pub(crate) mod vector;

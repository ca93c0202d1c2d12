//! Client of gramian, an HTTP service for geometric kernel interpolation and regression on point clouds.
//!
//! [`Client`] has one method per operation of the service. A method returns a builder, whose `send` returns
//! the answer or fails with an [`Error`]. If the service refuses a request, the error is
//! [`Error::ErrorResponse`] with a [`types::Problem`], which names the fields. Everything is generated from
//! the OpenAPI document of the service, when this crate is built (build.rs).

#[allow(clippy::all)]
mod generated {
    include!(concat!(env!("OUT_DIR"), "/client.rs"));
}

pub use generated::*;

//! Client of gramian, an HTTP service for geometric kernel interpolation and regression on point clouds.
//!
//! [`Client`] has one method per operation of the service. It returns a builder, whose `send` answers or fails with an
//! [`Error`]: what the service refuses is [`Error::ErrorResponse`] with a [`types::Problem`], which names the fields.
//! Everything is generated from the OpenAPI document of the service.

#[rustfmt::skip]
#[allow(clippy::all)]
mod generated;

pub use generated::*;

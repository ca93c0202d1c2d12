//! The service over real sockets.

mod cache;
mod golden;
mod openapi;
mod support;

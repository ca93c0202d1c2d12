//! Tests of the OpenAPI document and the documentation.

mod compatibility;
pub mod contract;
mod docs;
mod examples;
mod openapi;
mod words;

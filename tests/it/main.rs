//! Tests of the service over real sockets.

// The lint keeps locks and waits off the threads of pools. The threads of tests belong to no pool.
#![allow(clippy::disallowed_methods)]

#[path = "../../numerics/tests/common/mod.rs"]
mod common;

mod access;
mod batches;
mod bodies;
mod cache;
mod clouds;
mod clouds_at_once;
mod compatibility;
mod connections;
mod contention;
mod contract;
mod docs;
mod doubts;
mod durable;
mod ending;
mod estimate;
mod examples;
mod files;
mod fits;
mod golden;
mod hostile;
mod idempotency;
mod jobs;
mod kept_jobs;
mod keys;
mod learned;
mod length_scales;
mod level_sets;
mod limits;
mod load;
mod local;
mod log;
mod memory;
mod metrics;
mod model;
mod model_selection;
mod openapi;
mod pages;
mod poor_fit;
mod problems;
mod process;
mod protocol;
mod refusals;
mod renamed;
mod repeated_rows;
mod routes;
mod settings;
mod sharp_edges;
mod solvers;
mod spans;
mod support;
mod surfaces;
mod tiles;
mod tls;
mod units_differ;
mod unsolvable;
mod values;
mod words;

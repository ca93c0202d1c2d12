//! The service over real sockets.

mod access;
mod bodies;
mod cache;
mod clouds;
mod compatibility;
mod connections;
mod contract;
mod docs;
mod examples;
mod fits;
mod golden;
mod limits;
mod memory;
mod openapi;
mod pages;
mod problems;
mod process;
mod protocol;
mod refusals;
mod routes;
mod support;
mod surfaces;
mod unsolvable;

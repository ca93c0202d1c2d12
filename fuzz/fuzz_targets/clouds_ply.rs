//! A cloud as a PLY file.

#![no_main]

use gramian::http::reading::read_as;
use gramian::http::wire::negotiation::{BodyFormat, Coding};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = read_as("create_cloud", BodyFormat::Ply, Coding::Identity, data);
});

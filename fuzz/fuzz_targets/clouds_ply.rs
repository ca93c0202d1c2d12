//! A cloud as a PLY file.

#![no_main]

use gramian::http::reading::read_cloud;
use gramian_host::wire::negotiation::{BodyFormat, Coding};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let _ = read_cloud(BodyFormat::Ply, Coding::Identity, data);
});

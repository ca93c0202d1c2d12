//! A compressed body, gzip or zstd by its first byte. The size that it unpacks to is bounded.

#![no_main]

use gramian::http::reading::read_cloud;
use gramian_host::wire::negotiation::{BodyFormat, Coding};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&first, body)) = data.split_first() else { return };
    let coding = if first % 2 == 0 { Coding::Gzip } else { Coding::Zstd };
    let _ = read_cloud(BodyFormat::Json, coding, body);
});

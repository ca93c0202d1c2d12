//! A safetensors body, read as a request of the operation that its first byte selects.

#![no_main]

use gramian::http::reading::{OPERATIONS, read_as};
use gramian_host::wire::negotiation::{BodyFormat, Coding};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&first, body)) = data.split_first() else { return };
    let operation = OPERATIONS[usize::from(first) % OPERATIONS.len()];
    let _ = read_as(operation, BodyFormat::Safetensors, Coding::Identity, body);
});

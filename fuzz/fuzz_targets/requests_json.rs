//! A JSON body, read as a request of the operation that its first byte selects. Reading it again with white
//! space must give the same outcome.

#![no_main]

use gramian::http::reading::{OPERATIONS, read_as};
use gramian_host::wire::negotiation::{BodyFormat, Coding};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&first, body)) = data.split_first() else { return };
    let operation = OPERATIONS[usize::from(first) % OPERATIONS.len()];
    let read = |bytes: &[u8]| read_as(operation, BodyFormat::Json, Coding::Identity, bytes);
    let told = read(body);
    // White space around the body changes only the columns in error messages.
    assert_eq!(told.is_ok(), read(&[b" ", body, b"\n"].concat()).is_ok());
});

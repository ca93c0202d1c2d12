//! A body in JSON, as the request of every operation. The first byte chooses which; what is read once is read again in the same way.

#![no_main]

use gramian::http::reading::{OPERATIONS, read_as};
use gramian::http::wire::negotiation::{Coding, Format};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&first, body)) = data.split_first() else { return };
    let operation = OPERATIONS[usize::from(first) % OPERATIONS.len()];
    let read = |bytes: &[u8]| read_as(operation, Format::Json, Coding::Identity, bytes);
    let told = read(body);
    // White space around it changes nothing but the columns of what is told.
    assert_eq!(told.is_ok(), read(&[b" ", body, b"\n"].concat()).is_ok());
});

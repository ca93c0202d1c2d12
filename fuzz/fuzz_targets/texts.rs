//! Short texts from outside: ids, places of a store, origins, and key files.

#![no_main]

use gramian_host::state::settings::Origins;
use gramian_host::access::check_file;
use gramian::store::key::CloudId;
use gramian_host::store::Place;
use gramian_host::store::jobs::JobId;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Some(id) = CloudId::parse(text) {
        assert_eq!(id.to_string(), text);
    }
    if let Some(id) = JobId::parse(text) {
        assert_eq!(id.to_string(), text);
    }
    let _ = text.parse::<Place>();
    let _ = text.parse::<Origins>();
    let _ = check_file(text);
});

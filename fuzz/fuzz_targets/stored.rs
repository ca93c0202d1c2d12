//! Bytes of the store: what is read as a cloud has the name that its points give it, and is written as it was read.

#![no_main]

use std::sync::Arc;

use gramian::store::key::CloudId;
use gramian::store::objects::cloud_object::{decode, encode};
use gramian::store::objects::jobs::read_request;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((first, bytes)) = data.split_first_chunk::<32>() else { return };
    let hex: String = first.iter().map(|byte| format!("{byte:02x}")).collect();
    let Some(id) = CloudId::parse(&hex) else { return };
    if let Ok(cloud) = decode(id, bytes) {
        let cloud = Arc::new(cloud);
        assert_eq!(CloudId::of(&cloud.cloud, cloud.normals.as_ref()), id);
        assert_eq!(encode(&cloud).concat(), bytes);
    }
    let _ = read_request(&bytes.to_vec().into());
});

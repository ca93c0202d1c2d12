//! Bytes from the store. A cloud that can be read has the id of its points, and is encoded to the same bytes.
//! Reading a job or its result terminates.

#![no_main]

use std::sync::Arc;

use futures_util::StreamExt;
use gramian::store::key::CloudId;
use gramian_host::store::{Objects, OwnerName};
use gramian::store::objects::cloud_object::{decode, encode};
use gramian_host::store::jobs::JobId;
use libfuzzer_sys::fuzz_target;
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt};

fuzz_target!(|data: &[u8]| {
    let Some((first, bytes)) = data.split_first_chunk::<32>() else { return };
    let hex: String = first.iter().map(|byte| format!("{byte:02x}")).collect();
    let Some(id) = CloudId::parse(&hex) else { return };
    if let Ok(cloud) = decode(id, bytes) {
        assert_eq!(CloudId::of(&cloud.points, cloud.normals.as_deref()), id);
        assert_eq!(encode(cloud).concat(), bytes);
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().expect("a runtime with a clock");
    runtime.block_on(read_job(bytes));
});

async fn read_job(bytes: &[u8]) {
    let (store, id, owner) = (Arc::new(InMemory::new()), JobId::new(), OwnerName("a".to_owned()));
    for part in ["request", "result", "answer-0"] {
        let name = Path::from(format!("a/jobs/{id}/{part}"));
        store.put(&name, bytes.to_vec().into()).await.expect("there is memory");
    }
    let objects = Arc::new(Objects::over(store as Arc<dyn ObjectStore>, Path::default()));
    if let Ok(Some(Ok(found))) = objects.open_job(&owner, id).await {
        found.body.for_each(|_| std::future::ready(())).await;
    }
    if let Ok(Some(found)) = objects.get_result(&owner, id).await {
        found.body.for_each(|_| std::future::ready(())).await;
    }
}

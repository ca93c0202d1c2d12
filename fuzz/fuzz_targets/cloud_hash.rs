//! The canonical hash of a cloud: equal for equal points, also after a round trip through the store, and
//! different for all others.

#![no_main]

use gramian_numerics::points::cloud::Cloud;
use gramian_host::memory::Owner;
use gramian::store::clouds::CloudStore;
use gramian::store::key::CloudId;
use gramian::store::objects::cloud_object::{decode, encode};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (u8, Vec<f64>, Option<Vec<f64>>, u8)| {
    let (dimension, mut points, normals, at) = input;
    let d = usize::from(dimension % 5) + 1;
    points.truncate(points.len() / d * d);
    let Ok(cloud) = Cloud::new(points.clone(), d) else { return };
    let normals = normals.and_then(|normals| Cloud::new(normals, d).ok());
    let normals = normals.filter(|normals| normals.n_points() == cloud.n_points());
    let id = CloudId::of(&cloud, normals.as_ref());
    assert_eq!(CloudId::parse(&id.to_string()), Some(id));
    // −0 counts as 0. All other coordinates differ.
    let flipped = points.iter().map(|&x| if x == 0.0 { -x } else { x }).collect();
    let flipped = Cloud::new(flipped, d).expect("it has the same points");
    assert_eq!(CloudId::of(&flipped, normals.as_ref()), id);
    let at = usize::from(at) % points.len();
    points[at] = if points[at] == 0.0 { 1.0 } else { points[at] / 2.0 + 1.0 };
    if points[at] != cloud.coordinates()[at] && let Ok(other) = Cloud::new(points.clone(), d) {
        assert_ne!(CloudId::of(&other, normals.as_ref()), id);
    }
    for other in 1..=points.len() {
        if other != d && points.len() % other == 0 && let Ok(other) = Cloud::new(cloud.coordinates().to_vec(), other) {
            assert_ne!(CloudId::of(&other, None), CloudId::of(&cloud, None));
        }
    }
    let store = CloudStore::<()>::new(1 << 24);
    let (registered, _) = store.register(Owner(0), cloud, normals);
    assert_eq!(registered.id, id);
    let restored = decode(id, &encode(registered.stored()).concat()).expect("it is what was written");
    assert_eq!(restored.points.coordinates(), registered.cloud.coordinates());
});

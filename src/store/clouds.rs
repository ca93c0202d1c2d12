//! Registered clouds, named by their content.

use std::sync::{Arc, OnceLock};
use std::time::SystemTime;

use moka::sync::Cache;

use super::key::CloudId;
use super::{Owner, bounded_cache, n_bytes_of};
use crate::numerics::cloud::Cloud;
use crate::numerics::defaults::Scales;
use crate::numerics::duplicates::count_duplicates;
use crate::numerics::heap::{arc_payload, block_bytes};
use crate::numerics::neighbours::Neighbours;
use crate::numerics::noise::estimate_noise;

/// A cloud with the lengths that are derived from it once, on demand; not with the tree that they come from, which would
/// weigh as much again and is built in a small part of their time.
pub struct StoredCloud {
    pub id: CloudId,
    pub cloud: Arc<Cloud>,
    /// The client's normals, `[n, d]`, not normalised.
    pub normals: Option<Cloud>,
    pub created_at: SystemTime,
    spacings: OnceLock<Spacings>,
    scales: OnceLock<Scales>,
    noise: OnceLock<f64>,
}

/// Distances from each point to the nearest point elsewhere, unit L, and the number of exact duplicates.
#[derive(Debug, Clone, Copy)]
pub struct Spacings {
    /// Least, median and greatest; `None` if all points coincide.
    pub min_median_max: Option<[f64; 3]>,
    pub n_duplicates: usize,
}

impl StoredCloud {
    pub fn spacings(&self) -> Spacings {
        *self.spacings.get_or_init(|| {
            let mut spacings = Neighbours::of(&self.cloud).spacings(&self.cloud);
            spacings.sort_unstable_by(f64::total_cmp);
            let min_median_max = match spacings.as_slice() {
                [] => None,
                [first, .., last] => Some([*first, spacings[spacings.len() / 2], *last]),
                [only] => Some([*only; 3]),
            };
            Spacings { min_median_max, n_duplicates: count_duplicates(&self.cloud) }
        })
    }

    /// The lengths that kernels are chosen by.
    pub fn scales(&self) -> &Scales {
        self.scales.get_or_init(|| Scales::of(&self.cloud, &Neighbours::of(&self.cloud)))
    }

    /// Standard deviation of the points across the surface that they sample, unit L.
    pub fn noise(&self) -> f64 {
        *self.noise.get_or_init(|| estimate_noise(&self.cloud, &Neighbours::of(&self.cloud)))
    }

    /// Bytes held on the heap.
    fn n_bytes(&self) -> usize {
        let own = block_bytes(arc_payload::<Self>()) + block_bytes(arc_payload::<Cloud>());
        own + self.cloud.n_bytes() + self.normals.as_ref().map_or(0, Cloud::n_bytes)
    }
}

/// The clouds of all owners within one byte budget.
pub struct CloudStore {
    clouds: Cache<(Owner, CloudId), Arc<StoredCloud>>,
}

impl CloudStore {
    pub fn new(max_bytes: u64) -> Self {
        Self { clouds: bounded_cache(max_bytes, |stored: &Arc<StoredCloud>| stored.n_bytes()).build() }
    }

    /// Registers a cloud, or finds it; says whether it is new. A cloud beyond the whole budget is answered, not kept.
    pub fn register(&self, owner: Owner, cloud: Cloud, normals: Option<Cloud>) -> (Arc<StoredCloud>, bool) {
        let id = CloudId::of(&cloud, normals.as_ref());
        let entry = self.clouds.entry((owner, id)).or_insert_with(|| {
            Arc::new(StoredCloud {
                id,
                cloud: Arc::new(cloud.compact()),
                normals: normals.map(Cloud::compact),
                created_at: SystemTime::now(),
                spacings: OnceLock::new(),
                scales: OnceLock::new(),
                noise: OnceLock::new(),
            })
        });
        let is_new = entry.is_fresh();
        if is_new {
            self.clouds.run_pending_tasks();
        }
        (entry.into_value(), is_new)
    }

    pub fn get(&self, owner: Owner, id: CloudId) -> Option<Arc<StoredCloud>> {
        self.clouds.get(&(owner, id))
    }

    /// Forgets a cloud; says whether it was there.
    pub fn remove(&self, owner: Owner, id: CloudId) -> bool {
        self.clouds.remove(&(owner, id)).is_some()
    }

    /// Bytes of all clouds that are kept.
    pub fn n_bytes(&self) -> u64 {
        n_bytes_of(&self.clouds)
    }

    /// All clouds of an owner, oldest first, ties by id.
    pub fn list(&self, owner: Owner) -> Vec<Arc<StoredCloud>> {
        let mut clouds: Vec<_> =
            self.clouds.iter().filter(|(key, _)| key.0 == owner).map(|(_, stored)| stored).collect();
        clouds.sort_by_key(|stored| (stored.created_at, stored.id));
        clouds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(n: usize, offset: f64) -> Cloud {
        Cloud::new((0..n).map(|i| i as f64 + offset).collect(), 1).unwrap()
    }

    #[test]
    fn a_cloud_is_registered_once_and_belongs_to_its_owner() {
        let store = CloudStore::new(1 << 20);
        let (first, is_new) = store.register(Owner(0), line(4, 0.0), None);
        assert!(is_new);
        let (again, is_new) = store.register(Owner(0), line(4, 0.0), None);
        assert!(!is_new && Arc::ptr_eq(&first, &again));
        assert!(store.get(Owner(1), first.id).is_none());
        assert!(!store.remove(Owner(1), first.id) && store.remove(Owner(0), first.id));
        assert!(store.get(Owner(0), first.id).is_none());
    }

    #[test]
    fn the_least_recently_used_clouds_make_room() {
        // 1,000 points weigh 8 KB and less than one beside; the budget holds four of them.
        let store = CloudStore::new(40 << 10);
        let ids: Vec<_> =
            (0..10).map(|k| store.register(Owner(0), line(1000, f64::from(k) / 16.0), None).0.id).collect();
        let kept = store.list(Owner(0)).len();
        assert_eq!(kept, 4);
        assert!(store.get(Owner(0), ids[0]).is_none() && store.get(Owner(0), ids[9]).is_some());
    }

    #[test]
    fn spacings_and_duplicates_are_counted() {
        let cloud = Cloud::new(vec![0.0, 1.0, 1.0, 5.0], 1).unwrap();
        let (stored, _) = CloudStore::new(1 << 20).register(Owner(0), cloud, None);
        let spacings = stored.spacings();
        assert_eq!((spacings.min_median_max, spacings.n_duplicates), (Some([1.0, 1.0, 4.0]), 1));
    }
}

//! Encoding of a cloud as the bytes of an object.
//!
//! ```text
//! head     "gramian cloud 1\n"                      16 bytes
//!          created_at  n  d  has_normals  n_duplicates   u64 each; nanoseconds since 1970
//!          least, greatest value of each coordinate      2 d f64
//!          BLAKE3 of the head so far                32 bytes
//! points   n d f64, row by row
//! normals  n d f64, if there are any
//! BLAKE3 of points and normals                      32 bytes
//! ```
//!
//! Numbers are little-endian. The head has a hash of its own, so a list of clouds needs no points. Reading
//! returns what was written, or refuses it. It checks the hashes, the lengths, and the name of the cloud,
//! which is the hash of its points.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use bytes::Bytes;

use crate::store::key::CloudId;
use gramian_host::store::DamagedObject;
use gramian_numerics::points::cloud::Cloud;

const MAGIC: &[u8; 16] = b"gramian cloud 1\n";
const N_COUNTS: usize = 5;
const HASH_BYTES: usize = 32;
/// Byte position of the number of coordinates d.
const DIMENSION_AT: usize = MAGIC.len() + 16;

/// Facts about a cloud that a list shows.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudHead {
    pub created_at: SystemTime,
    pub n_points: usize,
    pub dimension: usize,
    pub has_normals: bool,
    pub n_duplicates: usize,
    /// The least and the greatest value of each coordinate.
    pub bounding_box: (Vec<f64>, Vec<f64>),
}

/// Bytes of a head for points of this dimension.
fn head_bytes(dimension: usize) -> usize {
    MAGIC.len() + 8 * (N_COUNTS + 2 * dimension) + HASH_BYTES
}

/// Bytes of a head as computed from its own dimension field, which may be wrong. A missing field counts as 0.
pub(super) fn head_bytes_of(bytes: &[u8]) -> u64 {
    let dimension = bytes.get(DIMENSION_AT..DIMENSION_AT + 8).and_then(|word| word.try_into().ok());
    let dimension = dimension.map_or(0, u64::from_le_bytes).min(1 << 30);
    head_bytes(dimension as usize) as u64
}

/// Bytes of the object of a cloud. `None` on overflow.
pub fn object_bytes(head: &CloudHead) -> Option<usize> {
    let lists = if head.has_normals { 2 } else { 1 };
    let numbers = head.n_points.checked_mul(head.dimension)?.checked_mul(8 * lists)?;
    numbers.checked_add(head_bytes(head.dimension))?.checked_add(HASH_BYTES)
}

/// A cloud with everything that its object contains.
pub struct StoredCloud {
    pub head: CloudHead,
    pub points: Arc<Cloud>,
    pub normals: Option<Arc<Cloud>>,
}

impl CloudHead {
    fn encode(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let since_epoch = self.created_at.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let counts = [
            u64::try_from(since_epoch.as_nanos()).unwrap_or(u64::MAX),
            self.n_points as u64,
            self.dimension as u64,
            u64::from(self.has_normals),
            self.n_duplicates as u64,
        ];
        counts.iter().for_each(|count| bytes.extend(count.to_le_bytes()));
        let (least, greatest) = &self.bounding_box;
        least.iter().chain(greatest).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend(blake3::hash(&bytes).as_bytes());
        bytes
    }

    /// Reads the head of an object from its first bytes, however many are given.
    ///
    /// # Errors
    /// [`DamagedObject`] if the bytes are not a head, or not as written.
    pub(super) fn decode(bytes: &[u8]) -> Result<Self, DamagedObject> {
        let rest = bytes.strip_prefix(MAGIC).ok_or(DamagedObject("it does not start like a cloud"))?;
        let counts = rest.get(..8 * N_COUNTS).ok_or(TRUNCATED)?;
        let mut counts =
            counts.chunks_exact(8).map(|word| u64::from_le_bytes(word.try_into().unwrap_or_default()));
        let mut next = || counts.next().unwrap_or_default();
        let (nanoseconds, n_points, dimension, has_normals, n_duplicates) =
            (next(), next(), next(), next(), next());
        let count =
            |x: u64| usize::try_from(x).map_err(|_| DamagedObject("a number does not fit this machine"));
        let (n_points, dimension) = (count(n_points)?, count(dimension)?);
        // Nothing is built from the numbers before their hash is checked.
        if dimension > bytes.len() {
            return Err(TRUNCATED);
        }
        let head = bytes.get(..head_bytes(dimension)).ok_or(TRUNCATED)?;
        let (head, hash) = head.split_at(head.len() - HASH_BYTES);
        if blake3::hash(head).as_bytes() != hash {
            return Err(WRONG_CHECKSUM);
        }
        let box_of = floats(&head[MAGIC.len() + 8 * N_COUNTS..]);
        let (least, greatest) = box_of.split_at(dimension);
        Ok(Self {
            created_at: SystemTime::UNIX_EPOCH + Duration::from_nanos(nanoseconds),
            n_points,
            dimension,
            has_normals: has_normals != 0,
            n_duplicates: count(n_duplicates)?,
            bounding_box: (least.to_vec(), greatest.to_vec()),
        })
    }
}

pub(super) const TRUNCATED: DamagedObject = DamagedObject("it is truncated");
const WRONG_CHECKSUM: DamagedObject = DamagedObject("its checksum does not match");
const NOT_A_CLOUD: DamagedObject = DamagedObject("its numbers do not form a cloud");
const OTHER_CLOUD: DamagedObject = DamagedObject("its name is that of another cloud");

/// Encodes a cloud as the pieces of its object. The numbers are shared with the cloud, not copied.
pub fn encode(cloud: StoredCloud) -> Vec<Bytes> {
    let mut hasher = blake3::Hasher::new();
    let mut pieces = vec![Bytes::from(cloud.head.encode())];
    for numbers in [Some(cloud.points), cloud.normals].into_iter().flatten() {
        let piece = Numbers(numbers).into_bytes();
        hasher.update(&piece);
        pieces.push(piece);
    }
    pieces.push(Bytes::copy_from_slice(hasher.finalize().as_bytes()));
    pieces
}

/// Coordinates of a cloud, kept alive while they are written.
struct Numbers(Arc<Cloud>);

impl Numbers {
    fn into_bytes(self) -> Bytes {
        if cfg!(target_endian = "little") {
            return Bytes::from_owner(self);
        }
        self.0.coordinates().iter().flat_map(|x| x.to_le_bytes()).collect()
    }
}

impl AsRef<[u8]> for Numbers {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(self.0.coordinates())
    }
}

/// A streaming check that the bytes of an object are those that were written. It keeps no bytes.
pub(super) struct Check {
    numbers: Range<usize>,
    is_as_long: bool,
    at: usize,
    hasher: blake3::Hasher,
    hash: Vec<u8>,
}

impl Check {
    /// Creates a check for an object of `n_bytes` whose head is intact.
    pub(super) fn new(head: &CloudHead, n_bytes: u64) -> Self {
        let first = head_bytes(head.dimension);
        let expected = object_bytes(head).filter(|&expected| expected as u64 == n_bytes);
        let numbers = first..expected.map_or(first, |expected| expected - HASH_BYTES);
        let is_as_long = expected.is_some();
        Self { numbers, is_as_long, at: 0, hasher: blake3::Hasher::new(), hash: Vec::new() }
    }

    /// Takes the next bytes.
    pub(super) fn read(&mut self, bytes: &[u8]) {
        let end = self.at + bytes.len();
        let [first, last] =
            [self.numbers.start, self.numbers.end].map(|place| place.clamp(self.at, end) - self.at);
        self.hasher.update(&bytes[first..last]);
        let n_missing = HASH_BYTES.saturating_sub(self.hash.len());
        self.hash.extend(bytes[last..].iter().take(n_missing));
        self.at = end;
    }

    /// Ends the check.
    ///
    /// # Errors
    /// [`DamagedObject`] unless all bytes are those that were written.
    pub(super) fn end(self) -> Result<(), DamagedObject> {
        match () {
            () if !self.is_as_long || self.at != self.numbers.end + HASH_BYTES => Err(TRUNCATED),
            () if self.hasher.finalize().as_bytes()[..] != self.hash => Err(WRONG_CHECKSUM),
            () => Ok(()),
        }
    }
}

/// Returns whether the bytes differ from those written. Otherwise they are intact, but encode no cloud or
/// another one.
pub(super) fn is_of_bytes(damaged: DamagedObject) -> bool {
    damaged != NOT_A_CLOUD && damaged != OTHER_CLOUD
}

/// Reads the cloud `id` from its object.
///
/// # Errors
/// [`DamagedObject`] unless the object is complete and as written.
pub fn decode(id: CloudId, bytes: &[u8]) -> Result<StoredCloud, DamagedObject> {
    let head = CloudHead::decode(bytes)?;
    if object_bytes(&head) != Some(bytes.len()) {
        return Err(TRUNCATED);
    }
    let (rest, hash) = bytes.split_at(bytes.len() - HASH_BYTES);
    let numbers = &rest[head_bytes(head.dimension)..];
    if blake3::hash(numbers).as_bytes() != hash {
        return Err(WRONG_CHECKSUM);
    }
    let (points, normals) = numbers.split_at(8 * head.n_points * head.dimension);
    let cloud_of =
        |bytes: &[u8]| Cloud::new(floats(bytes), head.dimension).map(Arc::new).map_err(|_| NOT_A_CLOUD);
    let points = cloud_of(points)?;
    let normals = head.has_normals.then(|| cloud_of(normals)).transpose()?;
    if CloudId::of(&points, normals.as_deref()) != id {
        return Err(OTHER_CLOUD);
    }
    Ok(StoredCloud { head, points, normals })
}

fn floats(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks_exact(8).map(|word| f64::from_le_bytes(word.try_into().unwrap_or_default())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the name of a cloud and its content, equal at each call.
    fn stored(has_normals: bool) -> (CloudId, StoredCloud) {
        let points = Arc::new(Cloud::new(vec![-0.0, 1.5, 2.0, -3.0, 2.0, -3.0], 2).unwrap());
        let normals = Cloud::new(vec![1.0, 0.0, 0.0, 2.0, 1.0, 1.0], 2).unwrap();
        let normals = has_normals.then(|| Arc::new(normals));
        let head = CloudHead {
            created_at: SystemTime::UNIX_EPOCH + Duration::from_nanos(1_234_567_890),
            n_points: 3,
            dimension: 2,
            has_normals,
            n_duplicates: 1,
            bounding_box: points.bounding_box(),
        };
        (CloudId::of(&points, normals.as_deref()), StoredCloud { head, points, normals })
    }

    #[test]
    fn a_cloud_is_read_as_it_was_written() {
        for with_normals in [false, true] {
            let (id, cloud) = stored(with_normals);
            let bytes = encode(stored(with_normals).1).concat();
            let found = decode(id, &bytes).unwrap();
            let coordinates = |cloud: &StoredCloud| {
                [Some(&cloud.points), cloud.normals.as_ref()]
                    .map(|list| list.map(|list| list.coordinates().to_vec()))
            };
            assert_eq!(coordinates(&found), coordinates(&cloud));
            assert_eq!(found.head, cloud.head);
            assert_eq!(CloudHead::decode(&bytes[..head_bytes(2)]), Ok(cloud.head));
        }
    }

    #[test]
    fn any_changed_byte_or_length_is_refused() {
        let (id, cloud) = stored(true);
        let bytes = encode(cloud).concat();
        for at in 0..bytes.len() {
            for bit in [0, 7] {
                let mut other = bytes.clone();
                other[at] ^= 1 << bit;
                assert!(decode(id, &other).is_err(), "byte {at}");
            }
            assert!(decode(id, &bytes[..at]).is_err(), "the first {at}");
        }
        assert!(decode(id, &[&bytes[..], &[0]].concat()).is_err());
        let name = stored(false).0;
        assert_eq!(decode(name, &bytes).err(), Some(DamagedObject("its name is that of another cloud")));
    }
}

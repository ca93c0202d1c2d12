//! Bearer keys: whose each of them is.

use subtle::{Choice, ConditionallySelectable, ConstantTimeEq};

use crate::store::Owner;

/// The configured keys as hashes; the keys themselves are not kept.
pub struct Keys {
    digests: Vec<[u8; 32]>,
    is_open: bool,
}

impl Keys {
    /// A blank key, which the configuration refuses, is nobody's; only no key at all leaves the service open.
    pub fn new(keys: &[String]) -> Self {
        let digest = |key: &String| blake3::hash(key.trim().as_bytes()).into();
        let digests = keys.iter().filter(|key| !key.trim().is_empty()).map(digest).collect();
        Self { digests, is_open: keys.is_empty() }
    }

    /// Whether anyone may call.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// How many owners share the service; one where it is open.
    pub fn n_owners(&self) -> usize {
        self.digests.len().max(1)
    }

    /// Finds the owner of a key in time that does not depend on the keys: hashes are compared in full, and all of them.
    pub fn owner_of(&self, key: &str) -> Option<Owner> {
        let digest: [u8; 32] = blake3::hash(key.as_bytes()).into();
        let (mut found, mut position) = (Choice::from(0), 0u64);
        for (index, candidate) in self.digests.iter().enumerate() {
            let is_equal = candidate.ct_eq(&digest);
            position.conditional_assign(&(index as u64), is_equal);
            found |= is_equal;
        }
        bool::from(found).then_some(Owner(position as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_key_has_its_owner_and_others_have_none() {
        let keys = Keys::new(&["one".to_owned(), "".to_owned(), " two ".to_owned()]);
        assert_eq!(keys.owner_of("one"), Some(Owner(0)));
        assert_eq!(keys.owner_of("two"), Some(Owner(1)));
        assert_eq!(keys.owner_of(""), None);
        assert!(!keys.is_open() && !Keys::new(&[String::new()]).is_open() && Keys::new(&[]).is_open());
    }
}

//! Place of the objects: a directory or a bucket.

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::{ObjectStore, parse_url_opts};
use url::Url;

use crate::process::features::Feature;

/// A directory, or `s3://bucket/prefix`, `gs://…`, `az://…`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    Directory(PathBuf),
    Bucket(Url),
}

const SCHEMES: [&str; 3] = ["s3", "gs", "az"];

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        match text.split_once("://") {
            _ if text.is_empty() => Err("is blank; unset it to keep everything in memory".to_owned()),
            None => Ok(Self::Directory(PathBuf::from(text))),
            Some((scheme, _)) if SCHEMES.contains(&scheme) => {
                Feature::Buckets.require().map_err(|missing| missing.to_string())?;
                let url = Url::parse(text).map_err(|error| format!("is no address: {error}"))?;
                match url.host_str() {
                    Some(bucket) if !bucket.is_empty() => Ok(Self::Bucket(url)),
                    _ => Err("names no bucket".to_owned()),
                }
            }
            Some((scheme, _)) => {
                Err(format!("has the scheme {scheme}; a directory, s3://, gs:// or az:// are known"))
            }
        }
    }
}

impl Place {
    /// Opens the store. Returns it with the prefix of all names in it. Credentials and endpoints of buckets
    /// come from `variables`, under the names that the tools of their vendors read.
    ///
    /// # Errors
    /// Returns what prevents it.
    pub(super) fn open(
        &self,
        variables: impl IntoIterator<Item = (String, String)>,
    ) -> Result<(Arc<dyn ObjectStore>, Path), String> {
        match self {
            Self::Directory(directory) => {
                std::fs::create_dir_all(directory).map_err(|error| format!("cannot be made: {error}"))?;
                let store = LocalFileSystem::new_with_prefix(directory).map_err(|error| error.to_string())?;
                // An answer promises that the cloud is stored, even after a power failure: hence fsync. A
                // folder is removed with its last file.
                let store = store.with_fsync(true).with_automatic_cleanup(true);
                Ok((Arc::new(store), Path::default()))
            }
            Self::Bucket(url) => {
                let named = ["aws_", "google_", "azure_"];
                let options = variables.into_iter().map(|(name, value)| (name.to_ascii_lowercase(), value));
                let options = options.filter(|(name, _)| named.iter().any(|start| name.starts_with(start)));
                let (store, prefix) = parse_url_opts(url, options).map_err(|error| error.to_string())?;
                Ok((Arc::from(store), prefix))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directories_and_buckets_are_told_apart() {
        assert_eq!("/var/lib/gramian".parse(), Ok(Place::Directory("/var/lib/gramian".into())));
        assert_eq!("clouds".parse(), Ok(Place::Directory("clouds".into())));
        let is_built_in = Feature::Buckets.is_present();
        for bucket in ["s3://bucket/some/prefix", "gs://bucket", "az://container/prefix"] {
            match bucket.parse() {
                Ok(place) => {
                    assert!(is_built_in);
                    assert!(matches!(place, Place::Bucket(url) if url.as_str().starts_with(bucket)));
                }
                Err(error) => assert!(!is_built_in && error.contains("`buckets`"), "{error}"),
            }
        }
        for bad in ["", " ", "s3://", "http://example.org", "file:///tmp"] {
            assert!(bad.parse::<Place>().is_err(), "{bad}");
        }
    }
}

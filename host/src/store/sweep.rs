//! Lists of objects, and what is left of processes that were killed.

use std::path::Path;
use std::time::{Duration, SystemTime};

use futures_util::TryStreamExt;
use object_store::ObjectMeta;

use super::tally::Verb;
use super::{Objects, OwnerName, Unavailable};

/// Longest time that a writer may take to write an object.
pub const AT_WORK: Duration = Duration::from_secs(3600);

impl Objects {
    /// Removes unfinished files of processes that ended while writing. No list shows their names.
    pub async fn remove_half_written(&self, now: SystemTime) {
        let Some(directory) = self.directory.clone() else { return };
        let removed = tokio::task::spawn_blocking(move || remove_half_written(&directory, now)).await;
        match removed {
            Ok(0) => {}
            Ok(n_files) => tracing::info!(n_files, "incomplete files were removed"),
            Err(error) => tracing::error!(%error, "incomplete files could not be removed"),
        }
    }

    /// Owners of any object in the store.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn owners(&self) -> Result<Vec<OwnerName>, Unavailable> {
        let found = self.store.list_with_delimiter(Some(&self.root)).await;
        let found = self.counted(Verb::List, &self.root, found)?;
        let folders = found.into_iter().flat_map(|found| found.common_prefixes);
        let name = |folder: object_store::path::Path| Some(OwnerName(folder.filename()?.to_owned()));
        Ok(folders.filter_map(name).filter(|owner| owner.0 != "probe").collect())
    }

    /// All objects in a folder of an owner.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn objects_in(
        &self,
        owner: &OwnerName,
        folder: &[&str],
    ) -> Result<Vec<ObjectMeta>, Unavailable> {
        let folder = self.path(&[&[&*owner.0], folder].concat());
        let found = self.store.list(Some(&folder)).try_collect().await;
        Ok(self.counted(Verb::List, &folder, found)?.unwrap_or_default())
    }
}

/// Removes unfinished files in this folder and all folders below. Returns their number. Files that cannot be
/// read or removed are tried again in the next sweep.
fn remove_half_written(directory: &Path, now: SystemTime) -> usize {
    let mut n_removed = 0;
    for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        let Ok(about) = entry.metadata() else { continue };
        if about.is_dir() {
            n_removed += remove_half_written(&path, now);
            continue;
        }
        let age = about.modified().ok().and_then(|since| now.duration_since(since).ok());
        if is_half_written(&name.to_string_lossy()) && age.is_some_and(|age| age > AT_WORK) {
            n_removed += usize::from(std::fs::remove_file(path).is_ok());
        }
    }
    n_removed
}

/// Recognises the names that the `object_store` crate gives to unfinished files: a number after `#`.
fn is_half_written(name: &str) -> bool {
    name.rsplit_once('#')
        .is_some_and(|(_, number)| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
}

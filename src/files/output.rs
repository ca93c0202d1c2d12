//! The file of an answer.
//!
//! An answer is written beside its file, and takes its place in one step once it is whole. So a full disk or
//! an interrupt leaves an older file as it was.

use std::fs::{self, Metadata, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
use std::path::{Path, PathBuf};

use axum::body::Bytes;
use tempfile::NamedTempFile;

use super::failure::Failure;
use super::on_thread;

/// Links that are followed from the name of a file, as many as Linux follows.
const MAX_LINKS: usize = 40;

/// Name of standard output in messages.
const STANDARD: &str = "standard output";

/// Permissions of a new file, without those that the umask takes away.
const NEW_FILE: u32 = 0o666;

/// Where an answer goes.
pub enum Output {
    Standard,
    /// A pipe or a device. It is opened when the answer is there.
    Stream(PathBuf),
    /// A file, which is replaced by the one beside it.
    File {
        /// The path as it was given.
        named: PathBuf,
        /// The file behind its links.
        path: PathBuf,
        beside: NamedTempFile,
    },
}

impl Output {
    /// Makes sure that an answer can be written, before it is computed.
    ///
    /// # Errors
    /// Refuses files that are read, unless it is forced to replace them, folders, and what the operating
    /// system does not let be written.
    pub fn prepare(path: &Path, inputs: &[PathBuf], is_forced: bool) -> Result<Self, Failure> {
        let failed = |error: io::Error| failure(path, &error);
        let older = match fs::metadata(path) {
            Ok(older) => Some(older),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(failed(error)),
        };
        if let Some(older) = &older {
            if !is_forced && inputs.iter().any(|input| is_same_file(older, input)) {
                let detail = "the answer would replace the file that is read; give --force to allow it";
                return Err(Failure::Argument(format!("{}: {detail}", path.display())));
            }
            if older.is_dir() {
                return Err(failed(io::ErrorKind::IsADirectory.into()));
            }
            if !older.is_file() || is_descriptor(path) {
                return Ok(Self::Stream(path.to_owned()));
            }
            // A file that must not be written must not be replaced either.
            OpenOptions::new().write(true).open(path).map_err(failed)?;
        }
        let named = path.to_owned();
        let path = followed(path).map_err(failed)?;
        let beside = file_beside(&path, older.as_ref());
        let beside = beside.map_err(|error| {
            let reason = match error.kind() {
                io::ErrorKind::NotFound => "the folder does not exist".to_owned(),
                kind => format!("nothing can be written in its folder: {kind}"),
            };
            Failure::File(format!("{}: {reason}", path.display()))
        })?;
        Ok(Self::File { named, path, beside })
    }

    /// The name of the place for messages.
    pub fn name(&self) -> String {
        match self {
            Self::Standard => STANDARD.to_owned(),
            Self::Stream(path) => path.display().to_string(),
            Self::File { named, .. } => named.display().to_string(),
        }
    }

    /// Writes an answer. If this is dropped before it is done, an older file is as it was.
    ///
    /// # Errors
    /// [`Failure::File`], for instance if the disk is full.
    pub async fn write(self, bytes: Bytes) -> Result<(), Failure> {
        match self {
            Self::Standard => on_thread(move || standard(&bytes)).await,
            Self::Stream(path) => {
                on_thread(move || fs::write(&path, bytes).map_err(|error| failure(&path, &error))).await
            }
            Self::File { path, beside, .. } => {
                let (mut file, beside) = beside.into_parts();
                let named = path.clone();
                on_thread(move || {
                    let written = file.write_all(&bytes).and_then(|()| file.sync_all());
                    written.map_err(|error| failure(&named, &error))
                })
                .await?;
                beside.persist(&path).map_err(|error| failure(&path, &error.error))
            }
        }
    }
}

/// Writes an answer, and the end of its line if it is JSON.
fn standard(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    let end: &[u8] = if bytes.starts_with(b"{") { b"\n" } else { b"" };
    let written = out.write_all(bytes).and_then(|()| out.write_all(end)).and_then(|()| out.flush());
    written.map_err(|error| failure(Path::new(STANDARD), &error))
}

fn failure(path: &Path, error: &io::Error) -> Failure {
    Failure::File(format!("{}: {error}", path.display()))
}

/// Whether a file is the one at a path, through whatever links. A pipe or device may be input and output.
fn is_same_file(file: &Metadata, path: &Path) -> bool {
    let is_equal = |other: Metadata| (file.dev(), file.ino()) == (other.dev(), other.ino());
    file.is_file() && fs::metadata(path).is_ok_and(is_equal)
}

/// Whether a path stands for an open file of a process, as /dev/stdout does. Replacing that file would leave
/// the process with the older one.
fn is_descriptor(path: &Path) -> bool {
    let of_processes = |path: PathBuf| path.starts_with("/proc");
    links_of(path).any(|link| folder_of(&link).canonicalize().is_ok_and(of_processes))
}

/// A path, and those to which it links one after another.
fn links_of(path: &Path) -> impl Iterator<Item = PathBuf> {
    std::iter::successors(Some(path.to_owned()), |path| Some(folder_of(path).join(fs::read_link(path).ok()?)))
        .take(MAX_LINKS)
}

/// The file behind links, which need not exist.
fn followed(path: &Path) -> io::Result<PathBuf> {
    let last = links_of(path).last().unwrap_or_else(|| path.to_owned());
    if last.is_symlink() { Err(io::Error::other("too many links")) } else { Ok(last) }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// An empty file beside another, with the permissions of an older file and its owner where that is allowed.
fn file_beside(path: &Path, older: Option<&Metadata>) -> io::Result<NamedTempFile> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = tempfile::Builder::new()
        .prefix(&format!(".{name}."))
        .permissions(Permissions::from_mode(NEW_FILE))
        .tempfile_in(folder_of(path))?;
    if let Some(older) = older {
        // Only root may give files away. Others keep what they write.
        let _ = fchown(beside.as_file(), Some(older.uid()), Some(older.gid()));
        beside.as_file().set_permissions(older.permissions())?;
    }
    Ok(beside)
}

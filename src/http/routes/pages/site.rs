//! A folder of files for browsers. They are in the binary, and none loads anything from elsewhere.

use std::sync::LazyLock;

use axum::body::Bytes;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::http::problem::Problem;
use crate::http::problem::catalogue;
use gramian_host::wire::compression::Compressor;
use gramian_host::wire::etag::if_none_match;
use gramian_host::wire::negotiation::{Coding, accepted_text_coding};

pub const HTML: &str = "text/html; charset=utf-8";
pub const SCRIPT: &str = "text/javascript; charset=utf-8";
pub const STYLE: &str = "text/css; charset=utf-8";
pub const PICTURE: &str = "image/svg+xml";
pub const NUMBERS: &str = "application/octet-stream";

/// A file of a folder.
pub struct File {
    pub path: &'static str,
    pub media_type: &'static str,
    pub bytes: &'static [u8],
}

/// Lists files of a folder of this repository by their paths in it, each with its media type.
macro_rules! files {
    ($folder:literal: $($path:literal $media_type:ident),* $(,)?) => {
        &[$($crate::http::routes::pages::site::File {
            path: $path,
            media_type: $crate::http::routes::pages::site::$media_type,
            bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/", $folder, "/", $path)),
        }),*]
    };
}
pub(super) use files;

/// The file that a folder itself stands for.
pub const INDEX: &str = "index.html";

/// A folder as it is served.
pub struct Site {
    /// Content security policy of all files.
    policy: &'static str,
    /// All files, compressed at the first request for any.
    packed: LazyLock<Vec<EncodedFile>>,
}

impl Site {
    /// `pack` is to return [`packed`] files.
    pub const fn new(policy: &'static str, pack: fn() -> Vec<EncodedFile>) -> Self {
        Self { policy, packed: LazyLock::new(pack) }
    }

    /// Answers a request for a file.
    ///
    /// # Errors
    /// Returns 404 if the folder has no such file.
    pub fn answer(&self, path: &str, headers: &HeaderMap) -> Result<Response, Problem> {
        let packed = self.packed.iter().find(|packed| packed.file.path == path);
        let packed = packed.ok_or_else(|| Problem::new(catalogue::NOT_FOUND, "the page has no such file"))?;
        Ok(packed.answer(headers, self.policy))
    }
}

/// Compresses files.
pub fn packed(files: &'static [File]) -> Vec<EncodedFile> {
    files.iter().map(EncodedFile::of).collect()
}

/// A file as it is sent.
pub struct EncodedFile {
    file: &'static File,
    /// Weak, since it stands for every coding.
    etag: String,
    gzip: Bytes,
    zstd: Bytes,
}

impl EncodedFile {
    fn of(file: &'static File) -> Self {
        let hash = blake3::hash(file.bytes).to_hex();
        Self {
            file,
            etag: format!("W/\"{}\"", &hash[..32]),
            gzip: compressed(file.bytes, Coding::Gzip),
            zstd: compressed(file.bytes, Coding::Zstd),
        }
    }

    fn body(&self, coding: Coding) -> Bytes {
        match coding {
            Coding::Identity => Bytes::from_static(self.file.bytes),
            Coding::Gzip => self.gzip.clone(),
            Coding::Zstd => self.zstd.clone(),
        }
    }

    fn answer(&self, headers: &HeaderMap, policy: &'static str) -> Response {
        let etag = [(header::ETAG, self.etag.clone())];
        let common = [
            (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
            (header::VARY, HeaderValue::from_static("accept-encoding")),
            (header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(policy)),
        ];
        if if_none_match(headers, &self.etag) {
            return (StatusCode::NOT_MODIFIED, etag, common).into_response();
        }
        let coding = accepted_text_coding(headers);
        let content_type = [(header::CONTENT_TYPE, HeaderValue::from_static(self.file.media_type))];
        let mut response = (etag, common, content_type, self.body(coding)).into_response();
        if coding != Coding::Identity {
            let name = HeaderValue::from_static(coding.name());
            response.headers_mut().insert(header::CONTENT_ENCODING, name);
        }
        response
    }
}

/// The bytes of a file in a coding.
fn compressed(bytes: &[u8], coding: Coding) -> Bytes {
    let pack = || {
        let mut compressor = Compressor::new(coding)?;
        let mut packed = compressor.write(bytes.to_vec())?;
        packed.extend(compressor.finish()?);
        std::io::Result::Ok(packed)
    };
    // Compression into memory has no errors. If it had, browsers would report an empty file.
    pack().unwrap_or_default().into()
}

#[cfg(test)]
pub mod testing {
    //! What holds for every folder.

    use std::path::{Path, PathBuf};

    use super::Site;

    fn files_in(folder: &Path) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        entries.flat_map(|path| if path.is_dir() { files_in(&path) } else { vec![path] }).collect()
    }

    impl Site {
        /// Checks that all files of the folder are served, but those that people read or run, and types.
        pub fn assert_complete(&self, folder: &str, not_served: &[&str]) {
            let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
            let paths = files_in(&root).into_iter();
            let paths = paths.map(|path| path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned());
            let is_for_browsers =
                |path: &String| !path.ends_with(".d.ts") && !not_served.contains(&path.as_str());
            let mut found: Vec<String> = paths.filter(is_for_browsers).collect();
            let mut served: Vec<String> =
                self.packed.iter().map(|packed| packed.file.path.to_owned()).collect();
            found.sort();
            served.sort();
            assert_eq!(found, served);
        }

        /// Checks files that were copied from elsewhere by their BLAKE3.
        pub fn assert_hashes(&self, expected: &[(&str, &str)]) {
            for (path, hash) in expected {
                assert_eq!(blake3::hash(self.bytes(path)).to_hex().as_str(), *hash, "{path}");
            }
        }

        /// Bytes of all files as browsers get them.
        pub fn n_compressed_bytes(&self) -> usize {
            self.packed.iter().map(|packed| packed.gzip.len()).sum()
        }

        pub fn bytes(&self, path: &str) -> &'static [u8] {
            self.packed.iter().find(|packed| packed.file.path == path).unwrap().file.bytes
        }

        pub fn text(&self, path: &str) -> &'static str {
            std::str::from_utf8(self.bytes(path)).unwrap()
        }
    }
}

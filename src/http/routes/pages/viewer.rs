//! The page at `/`, which shows clouds and what the service says about them. Its files are in the binary, and
//! it loads nothing from elsewhere.

use std::sync::LazyLock;

use axum::body::Bytes;
use axum::extract::Path;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::http::openapi::responses::ProbeProblems;
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::wire::compression::Compressor;
use crate::http::wire::etag::is_known;
use crate::http::wire::negotiation::{Coding, accepted_text_coding};

/// What the page may do: scripts, styles and requests of its own origin, and pictures that it makes.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
     connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const PICTURE: &str = "image/svg+xml";
const NUMBERS: &str = "application/octet-stream";

/// A file of the folder `page`.
struct File {
    path: &'static str,
    media_type: &'static str,
    bytes: &'static [u8],
}

macro_rules! files {
    ($($path:literal $media_type:ident),* $(,)?) => {
        [$(File {
            path: $path,
            media_type: $media_type,
            bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/page/", $path)),
        }),*]
    };
}

const INDEX: &str = "index.html";

static FILES: [File; 22] = files![
    "index.html" HTML,
    "style.css" STYLE,
    "icon.svg" PICTURE,
    "main.js" SCRIPT,
    "data/dragon.bin" NUMBERS,
    "model/examples.js" SCRIPT,
    "model/files.js" SCRIPT,
    "model/operations.js" SCRIPT,
    "model/section.js" SCRIPT,
    "model/service.js" SCRIPT,
    "model/snippets.js" SCRIPT,
    "model/state.js" SCRIPT,
    "model/tables.js" SCRIPT,
    "model/tensors.js" SCRIPT,
    "view/colours.js" SCRIPT,
    "view/histogram.js" SCRIPT,
    "view/material.js" SCRIPT,
    "view/readout.js" SCRIPT,
    "view/scene.js" SCRIPT,
    "vendor/three/OrbitControls.js" SCRIPT,
    "vendor/three/three.core.min.js" SCRIPT,
    "vendor/three/three.module.min.js" SCRIPT,
];

/// A file as it is sent.
struct Packed {
    file: &'static File,
    /// Weak, since it stands for every coding.
    etag: String,
    gzip: Bytes,
    zstd: Bytes,
}

/// All files, compressed at the first request for any.
static PACKED: LazyLock<Vec<Packed>> = LazyLock::new(|| FILES.iter().map(Packed::of).collect());

impl Packed {
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

    fn answer(&self, headers: &HeaderMap) -> Response {
        let etag = [(header::ETAG, self.etag.clone())];
        let common = [
            (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
            (header::VARY, HeaderValue::from_static("accept-encoding")),
            (header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY)),
        ];
        if is_known(headers, &self.etag) {
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

fn answer(path: &str, headers: &HeaderMap) -> Result<Response, Problem> {
    let packed = PACKED.iter().find(|packed| packed.file.path == path);
    let packed = packed.ok_or_else(|| Problem::new(Slug::NotFound, "the page has no such file"))?;
    Ok(packed.answer(headers))
}

/// See a cloud
///
/// Returns a page that shows clouds in three dimensions with normals, curvatures, meshes and their error
/// bars. It asks this service, and loads nothing from elsewhere.
#[utoipa::path(
    get,
    path = "/",
    tag = "process",
    responses(
        (status = 200, description = "The page", body = String, content_type = "text/html"),
        (status = 304, description = "The client has it already"),
        ProbeProblems
    )
)]
pub async fn get_start_page(headers: HeaderMap) -> Result<Response, Problem> {
    answer(INDEX, &headers)
}

/// Returns a file that the page loads.
pub async fn get_page_file(Path(path): Path<String>, headers: HeaderMap) -> Result<Response, Problem> {
    answer(&path, &headers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::{Path as FilePath, PathBuf};

    /// Files that people read, and what makes the others.
    const NOT_SERVED: [&str; 2] = ["data/make_dragon", "vendor/three/LICENSE"];

    fn files_in(folder: &FilePath) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        entries.flat_map(|path| if path.is_dir() { files_in(&path) } else { vec![path] }).collect()
    }

    #[test]
    fn every_file_of_the_page_is_served() {
        let root = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("page");
        let mut found: Vec<String> = files_in(&root)
            .iter()
            .map(|path| path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned())
            .filter(|path| !NOT_SERVED.contains(&path.as_str()))
            .collect();
        let mut served: Vec<String> = FILES.iter().map(|file| file.path.to_owned()).collect();
        found.sort();
        served.sort();
        assert_eq!(found, served);
    }

    #[test]
    fn the_page_arrives_in_less_than_500_kb() {
        let n_bytes: usize = PACKED.iter().map(|packed| packed.gzip.len()).sum();
        assert!(n_bytes < 500_000, "{n_bytes}");
    }

    #[test]
    fn nothing_is_inline_or_from_elsewhere() {
        let text = |path: &str| {
            let file = FILES.iter().find(|file| file.path == path).unwrap();
            std::str::from_utf8(file.bytes).unwrap()
        };
        for forbidden in ["style=", "<style", "<script>", "onclick", "http://", "https://"] {
            assert!(!text(INDEX).contains(forbidden), "{forbidden}");
        }
        for forbidden in ["@import", "url("] {
            assert!(!text("style.css").contains(forbidden), "{forbidden}");
        }
    }

    #[test]
    fn vendored_files_are_those_of_three_0_184_0() {
        let hash = |path: &str| {
            let file = FILES.iter().find(|file| file.path == path).unwrap();
            blake3::hash(file.bytes).to_hex().to_string()
        };
        for (path, expected) in VENDORED {
            assert_eq!(hash(path), expected, "{path}");
        }
    }

    /// BLAKE3 of the files. In `OrbitControls.js`, the import of three names its file.
    const VENDORED: [(&str, &str); 3] = [
        (
            "vendor/three/three.core.min.js",
            "ea9bce76382aa29701ff54bf518d39eab41df6eee28bfaa35b026073f27bcf42",
        ),
        (
            "vendor/three/three.module.min.js",
            "fbe28e0101f059d49e8921dc6c76daf4ec129eb40c5f418d1c8f88496f309fd6",
        ),
        ("vendor/three/OrbitControls.js", "351d7fb1fdea4fe0df367272ae5ed89d18abf624e28e05b542777aa145dd4726"),
    ];
}

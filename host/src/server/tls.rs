//! TLS without a proxy in front: certificate and key are read from files, and again when these change.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use arc_swap::ArcSwap;
use tokio::net::TcpStream;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::crypto::{CryptoProvider, ring};
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::server::TlsStream;

/// Interval at which the files are checked for changes.
const LOOKING: Duration = Duration::from_secs(1);

/// Protocols offered over TLS, the preferred first.
const PROTOCOLS: [&[u8]; 2] = [b"h2", b"http/1.1"];

/// A certificate with the authorities up to a root, and its key.
pub struct Tls {
    certificate: PathBuf,
    key: PathBuf,
    /// Digest of both files at the start.
    first: Digest,
    current: ArcSwap<ServerConfig>,
}

/// BLAKE3 of both files.
type Digest = [u8; 32];

impl Tls {
    /// Reads both files.
    ///
    /// # Errors
    /// Returns which file is wrong, and how.
    pub fn new(certificate: &Path, key: &Path) -> Result<Self, String> {
        let (config, first) = read(certificate, key)?;
        let current = ArcSwap::from_pointee(config);
        Ok(Self { certificate: certificate.to_owned(), key: key.to_owned(), first, current })
    }

    /// Performs the handshake with a new connection.
    ///
    /// # Errors
    /// Returns an error if the client refuses the handshake or is gone.
    pub async fn accept(&self, socket: TcpStream) -> std::io::Result<TlsStream<TcpStream>> {
        TlsAcceptor::from(self.current.load_full()).accept(socket).await
    }

    /// Reloads the files whenever they change, for as long as the process lives.
    ///
    /// Files that do not match, as while one of them is replaced, change nothing. Both are read each time:
    /// their times and lengths do not tell whether they can be read.
    pub async fn follow_files(self: Arc<Self>) {
        let mut last = Ok(self.first);
        let mut ticks = tokio::time::interval(LOOKING);
        loop {
            ticks.tick().await;
            let found = read(&self.certificate, &self.key);
            let now = found.as_ref().map(|(_, digest)| *digest).map_err(String::clone);
            if now == last {
                continue;
            }
            last = now;
            match found {
                Ok((config, _)) => {
                    self.current.store(Arc::new(config));
                    tracing::info!("the certificate was read again");
                }
                Err(error) => tracing::error!(error, "the certificate is unchanged"),
            }
        }
    }
}

/// The cryptographic provider shared by server and probe.
pub fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

/// Makes that provider the one of the process, for clients that choose none: those of buckets and collectors
/// refuse to be made without. A second call changes nothing.
pub fn install_provider() {
    // It fails if there is one already.
    let _ = ring::default_provider().install_default();
}

fn read(certificate: &Path, key: &Path) -> Result<(ServerConfig, Digest), String> {
    let mut hasher = blake3::Hasher::new();
    let mut bytes_of = |path: &Path| {
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        hasher.update(&(bytes.len() as u64).to_le_bytes()).update(&bytes);
        Ok::<_, String>(bytes)
    };
    let failed = |error: String| format!("the certificate (GRAMIAN_TLS_CERTIFICATE) cannot be read: {error}");
    let chain = bytes_of(certificate).and_then(|bytes| certificates(&bytes)).map_err(failed)?;
    let key_of = bytes_of(key)
        .and_then(|bytes| PrivateKeyDer::from_pem_slice(&bytes).map_err(|error| error.to_string()));
    let key_of = key_of.map_err(|error| format!("the key (GRAMIAN_TLS_KEY) cannot be read: {error}"))?;
    let config = ServerConfig::builder_with_provider(provider()).with_safe_default_protocol_versions();
    let config = config.map_err(|error| error.to_string())?.with_no_client_auth();
    let config = config.with_single_cert(chain, key_of);
    let mut config =
        config.map_err(|error| format!("the certificate (GRAMIAN_TLS_CERTIFICATE) and its key: {error}"))?;
    config.alpn_protocols = PROTOCOLS.map(<[u8]>::to_vec).to_vec();
    Ok((config, hasher.finalize().into()))
}

/// Parses the certificates of a file, that of the server first.
fn certificates(bytes: &[u8]) -> Result<Vec<CertificateDer<'static>>, String> {
    let found = CertificateDer::pem_slice_iter(bytes).collect::<Result<Vec<_>, _>>();
    let found = found.map_err(|error| error.to_string())?;
    if found.is_empty() { Err("it has none".to_owned()) } else { Ok(found) }
}

//! TLS for whoever wants no proxy in front: a certificate and its key from files, which are read again when they change.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use arc_swap::ArcSwap;
use tokio::net::TcpStream;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::crypto::{CryptoProvider, aws_lc_rs};
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::server::TlsStream;

/// How often it is looked whether the files have changed.
const LOOKING: Duration = Duration::from_secs(1);

/// What is spoken over it, the preferred first.
const PROTOCOLS: [&[u8]; 2] = [b"h2", b"http/1.1"];

/// A certificate with the authorities up to a root, and its key.
pub struct Tls {
    certificate: PathBuf,
    key: PathBuf,
    current: ArcSwap<ServerConfig>,
}

impl Tls {
    /// Reads both files.
    ///
    /// # Errors
    /// Says which of them is wrong, and how.
    pub fn new(certificate: &Path, key: &Path) -> Result<Self, String> {
        let current = ArcSwap::from_pointee(read(certificate, key)?);
        Ok(Self { certificate: certificate.to_owned(), key: key.to_owned(), current })
    }

    /// Shakes hands with a newcomer.
    ///
    /// # Errors
    /// If the newcomer does not want to, or is gone.
    pub async fn accept(&self, socket: TcpStream) -> std::io::Result<TlsStream<TcpStream>> {
        TlsAcceptor::from(self.current.load_full()).accept(socket).await
    }

    /// Reads the files again whenever they change, for as long as the process lives. Files that do not go together, as while one of them
    /// is replaced, change nothing.
    pub async fn follow_files(self: Arc<Self>) {
        let mut last = self.state();
        let mut ticks = tokio::time::interval(LOOKING);
        loop {
            ticks.tick().await;
            let now = self.state();
            if now == last {
                continue;
            }
            last = now;
            match read(&self.certificate, &self.key) {
                Ok(config) => {
                    self.current.store(Arc::new(config));
                    tracing::info!("the certificate was read again");
                }
                Err(error) => tracing::error!(error, "the certificate stays as it was"),
            }
        }
    }

    fn state(&self) -> [Option<(SystemTime, u64)>; 2] {
        let state =
            |path| std::fs::metadata(path).and_then(|found| Ok((found.modified()?, found.len()))).ok();
        [state(&self.certificate), state(&self.key)]
    }
}

/// The primitives, the same for server and probe.
pub fn provider() -> Arc<CryptoProvider> {
    Arc::new(aws_lc_rs::default_provider())
}

fn read(certificate: &Path, key: &Path) -> Result<ServerConfig, String> {
    let chain = certificates(certificate)?;
    let key_of = PrivateKeyDer::from_pem_file(key);
    let key_of = key_of.map_err(|error| format!("the key (GRAMIAN_TLS_KEY) cannot be read: {error}"))?;
    let config = ServerConfig::builder_with_provider(provider()).with_safe_default_protocol_versions();
    let config = config.map_err(|error| error.to_string())?.with_no_client_auth();
    let config = config.with_single_cert(chain, key_of);
    let mut config =
        config.map_err(|error| format!("the certificate (GRAMIAN_TLS_CERTIFICATE) and its key: {error}"))?;
    config.alpn_protocols = PROTOCOLS.map(<[u8]>::to_vec).to_vec();
    Ok(config)
}

/// The certificates of a file, that of the server first.
///
/// # Errors
/// Says what is wrong with the file.
pub fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, String> {
    let failed = |error: &dyn std::fmt::Display| {
        format!("the certificate (GRAMIAN_TLS_CERTIFICATE) cannot be read: {error}")
    };
    let found = CertificateDer::pem_file_iter(path).map_err(|error| failed(&error))?;
    let found: Vec<_> = found.collect::<Result<_, _>>().map_err(|error| failed(&error))?;
    if found.is_empty() { Err(failed(&"it has none")) } else { Ok(found) }
}

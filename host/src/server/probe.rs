//! A client for the readiness probe.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use tokio_rustls::rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use tokio_rustls::rustls::crypto::{CryptoProvider, verify_tls12_signature, verify_tls13_signature};
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use tokio_rustls::rustls::{
    ClientConfig, ClientConnection, DigitallySignedStruct, Error, SignatureScheme, StreamOwned,
};

use super::address::reachable;
use super::tls;

/// Time for each step of the probe.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Returns whether a server at this address answers its readiness probe with 200. It is asked in plain HTTP
/// first, then over TLS, so that the probe needs no setting of the server but its address.
///
/// # Errors
/// Returns errors of the connection.
pub fn is_ready(bind: SocketAddr) -> io::Result<bool> {
    let connect = || -> io::Result<TcpStream> {
        let stream = TcpStream::connect_timeout(&reachable(bind), TIMEOUT)?;
        stream.set_read_timeout(Some(TIMEOUT))?;
        stream.set_write_timeout(Some(TIMEOUT))?;
        Ok(stream)
    };
    match ask(connect()?, bind) {
        Err(error) if speaks_no_http(&error) => ask(over_tls(connect()?)?, bind),
        answered => answered,
    }
}

/// Whether a server closed the connection instead of an answer, or answered something else than HTTP, as one
/// does that speaks TLS alone.
fn speaks_no_http(error: &io::Error) -> bool {
    use io::ErrorKind as Kind;
    matches!(error.kind(), Kind::UnexpectedEof | Kind::InvalidData | Kind::ConnectionReset | Kind::BrokenPipe)
}

fn ask(mut stream: impl Read + Write, bind: SocketAddr) -> io::Result<bool> {
    write!(stream, "GET /health/ready HTTP/1.1\r\nHost: {bind}\r\nConnection: close\r\n\r\n")?;
    let mut status_line = [0; 12];
    stream.read_exact(&mut status_line)?;
    if !status_line.starts_with(b"HTTP/") {
        return Err(io::Error::new(
            io::ErrorKind::InvalidData,
            "what listens there speaks neither HTTP nor TLS",
        ));
    }
    Ok(&status_line[9..] == b"200")
}

fn over_tls(stream: TcpStream) -> io::Result<StreamOwned<ClientConnection, TcpStream>> {
    let provider = tls::provider();
    let config = ClientConfig::builder_with_provider(provider.clone()).with_safe_default_protocol_versions();
    let config = config.map_err(io::Error::other)?.dangerous();
    let config = config.with_custom_certificate_verifier(Arc::new(AnyCertificate(provider)));
    let name = ServerName::from(Ipv4Addr::LOCALHOST);
    let connection = ClientConnection::new(Arc::new(config.with_no_client_auth()), name);
    Ok(StreamOwned::new(connection.map_err(io::Error::other)?, stream))
}

/// Accepts any certificate of the server at its own address. The probe reveals nothing, and learns only
/// whether the server is ready. The certificate file is not checked, because a server whose new certificate
/// is wrong keeps the old one.
#[derive(Debug)]
struct AnyCertificate(Arc<CryptoProvider>);

impl ServerCertVerifier for AnyCertificate {
    fn verify_server_cert(
        &self,
        _shown: &CertificateDer<'_>,
        _authorities: &[CertificateDer<'_>],
        _name: &ServerName<'_>,
        _ocsp: &[u8],
        _now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        Ok(ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        let algorithms = &self.0.signature_verification_algorithms;
        verify_tls12_signature(message, certificate, signature, algorithms)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        let algorithms = &self.0.signature_verification_algorithms;
        verify_tls13_signature(message, certificate, signature, algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.0.signature_verification_algorithms.supported_schemes()
    }
}

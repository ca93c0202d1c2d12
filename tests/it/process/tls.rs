//! TLS, and renewal of certificates.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use rcgen::{CertifiedKey, generate_simple_self_signed};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

use crate::running::{Process, gramian};
use crate::store::durable::Folder;
use crate::support::pause;

/// A certificate for localhost and its key, as files.
struct Files {
    folder: Folder,
}

impl Files {
    fn new(name: &str) -> (Self, CertificateDer<'static>) {
        let files = Self { folder: Folder::new(name) };
        let certificate = files.renew();
        (files, certificate)
    }

    /// Writes a new certificate and key over the previous ones.
    fn renew(&self) -> CertificateDer<'static> {
        let CertifiedKey { cert, signing_key } =
            generate_simple_self_signed(vec!["localhost".to_owned()]).unwrap();
        fs::write(self.path("key"), signing_key.serialize_pem()).unwrap();
        fs::write(self.path("certificate"), cert.pem()).unwrap();
        cert.der().clone()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn flags(&self) -> [String; 4] {
        let path = |name| self.path(name).to_str().unwrap().to_owned();
        ["--tls-certificate".to_owned(), path("certificate"), "--tls-key".to_owned(), path("key")]
    }
}

fn start(files: &Files) -> Process {
    let flags = files.flags();
    Process::start(&flags.each_ref().map(String::as_str))
}

/// Completes a TLS handshake with a server that has this certificate.
async fn connect(
    process: &Process,
    certificate: &CertificateDer<'static>,
    protocol: &[u8],
) -> std::io::Result<TlsStream<TcpStream>> {
    let mut roots = RootCertStore::empty();
    roots.add(certificate.clone()).unwrap();
    let mut config = ClientConfig::builder().with_root_certificates(roots).with_no_client_auth();
    config.alpn_protocols = vec![protocol.to_vec()];
    let socket = TcpStream::connect(process.address()).await.unwrap();
    TlsConnector::from(Arc::new(config)).connect(ServerName::try_from("localhost").unwrap(), socket).await
}

async fn get(stream: &mut TlsStream<TcpStream>, path: &str) -> String {
    let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = String::new();
    // Fails if the server ends the connection without close_notify.
    stream.read_to_string(&mut answer).await.unwrap();
    answer
}

#[tokio::test]
async fn requests_are_answered_over_tls_and_nothing_else() {
    let (files, certificate) = Files::new("tls");
    let process = start(&files);
    let mut stream = connect(&process, &certificate, b"http/1.1").await.unwrap();
    let answer = get(&mut stream, "/openapi.json").await;
    assert!(answer.starts_with("HTTP/1.1 200 OK") && answer.trim_end().ends_with('}'), "{answer:.300}");
    let stream = connect(&process, &certificate, b"h2").await.unwrap();
    let (mut client, connection) = h2::client::handshake(stream).await.unwrap();
    tokio::spawn(connection);
    let request = axum::http::Request::get("https://localhost/health/live").body(()).unwrap();
    let (response, _) = client.send_request(request, true).unwrap();
    assert_eq!(response.await.unwrap().status(), 200);
    // A client without TLS receives no answer, and does not block others.
    let mut plain = TcpStream::connect(process.address()).await.unwrap();
    plain.write_all(b"GET /health/live HTTP/1.1\r\nHost: localhost\r\n\r\n").await.unwrap();
    let mut answer = Vec::new();
    plain.read_to_end(&mut answer).await.ok();
    assert!(!answer.starts_with(b"HTTP"), "{answer:?}");
    assert!(connect(&process, &certificate, b"http/1.1").await.is_ok());
}

#[tokio::test]
async fn a_renewed_certificate_is_taken_up_without_a_restart() {
    let (files, first) = Files::new("tls-renewed");
    let process = start(&files);
    let mut under_way = connect(&process, &first, b"http/1.1").await.unwrap();
    let second = files.renew();
    while connect(&process, &second, b"http/1.1").await.is_err() {
        pause().await;
    }
    assert!(connect(&process, &first, b"http/1.1").await.is_err());
    assert!(get(&mut under_way, "/health/live").await.starts_with("HTTP/1.1 200"));
    // One invalid file of the pair changes nothing.
    fs::write(files.path("key"), "no key").unwrap();
    while !process.lines.lock().unwrap().iter().any(|line| line.contains("the certificate is unchanged")) {
        pause().await;
    }
    assert!(connect(&process, &second, b"http/1.1").await.is_ok());
}

#[tokio::test]
async fn the_probe_asks_over_tls_whatever_the_files_have() {
    let (files, _) = Files::new("tls-probe");
    let process = start(&files);
    let probe = |files: &Files| {
        let mut command = gramian();
        command.args(["--bind", process.address()]).args(files.flags()).arg("health");
        command.output().unwrap()
    };
    assert!(probe(&files).status.success());
    // The server continues with the certificate that it has read.
    fs::write(files.path("certificate"), "half a certifi").unwrap();
    assert!(probe(&files).status.success());
    // The address is enough.
    let without_files = gramian().args(["health", "--bind", process.address()]).output().unwrap();
    assert!(without_files.status.success());
}

#[test]
fn the_probe_tells_where_it_asked_in_vain() {
    // The first server accepts connections and closes them. It speaks neither HTTP nor TLS.
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let ask = || gramian().args(["health", "--bind", &address]).output().unwrap();
    let closing = std::thread::spawn(move || (0..2).for_each(|_| drop(listener.accept())));
    for output in [ask(), ask()] {
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(
            !output.status.success() && told.contains(&address) && told.contains("GRAMIAN_BIND"),
            "{told}"
        );
    }
    closing.join().unwrap();
}

#[tokio::test]
async fn a_certificate_that_is_none_ends_the_start() {
    let (files, _) = Files::new("tls-wrong");
    for (name, text, told) in
        [("certificate", "nothing", "GRAMIAN_TLS_CERTIFICATE"), ("key", "nothing", "GRAMIAN_TLS_KEY")]
    {
        files.renew();
        fs::write(files.path(name), text).unwrap();
        let ended = gramian().args(["--bind", "127.0.0.1:0"]).args(files.flags()).output().unwrap();
        assert!(!ended.status.success());
        let text = String::from_utf8(ended.stderr).unwrap();
        assert!(text.contains(told) && !text.contains("listening"), "{text}");
    }
    let half = gramian().args(["--tls-key", "x"]).output().unwrap();
    assert!(!half.status.success() && String::from_utf8(half.stderr).unwrap().contains("--tls-certificate"));
}

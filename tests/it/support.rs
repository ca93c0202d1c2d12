//! A server under test, and a client for it.

use std::net::SocketAddr;
use std::time::Duration;

use clap::Parser;
use gramian::config::Config;
use gramian::http::serve;
use gramian::http::state::app::App;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;

use crate::common::clouds;
use crate::document::contract::{self, AnswerParts};

/// A server in this process, on a free port. Drains when dropped.
pub struct Server {
    pub address: SocketAddr,
    pub client: reqwest::Client,
    _stop: oneshot::Sender<()>,
}

/// Flags as on the command line, so that tests configure what users configure.
#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    config: Config,
}

/// An answer, read to its end.
pub struct Answer {
    pub status: u16,
    pub headers: reqwest::header::HeaderMap,
    pub text: String,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.text).unwrap_or_else(|error| panic!("{error}: {}", self.text))
    }

    pub fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |value| value.to_str().unwrap())
    }

    /// Returns the body of an answer that must be a success.
    pub fn expect_ok(self) -> Value {
        assert_eq!(self.status, 200, "{}", self.text);
        self.json()
    }

    /// Returns the document of a problem, checked for what every problem has.
    pub fn expect_problem(&self, status: u16, slug: &str) -> Value {
        let document = self.json();
        assert_eq!(
            (self.status, &document["type"]),
            (status, &json!(format!("/problems/{slug}"))),
            "{}",
            self.text
        );
        assert_eq!(self.header("content-type"), "application/problem+json");
        assert_eq!(document["status"], json!(status));
        assert_eq!(document["instance"], json!(self.header("x-request-id")));
        assert!(document["title"].is_string() && document["detail"].is_string());
        document
    }
}

impl Server {
    pub async fn start() -> Self {
        Self::with_flags(&[]).await
    }

    pub async fn with_flags(flags: &[&str]) -> Self {
        let config = Flags::parse_from(["gramian"].iter().chain(flags)).config;
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (stop, stopped) = oneshot::channel::<()>();
        let stop_signal = async move {
            stopped.await.ok();
        };
        tokio::spawn(serve(App::new(config).await.unwrap(), listener, stop_signal));
        Self { address, client: http_client().build().unwrap(), _stop: stop }
    }

    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    pub async fn send(&self, request: reqwest::RequestBuilder) -> Answer {
        let AnswerParts { status, headers, bytes } = receive(request).await;
        Answer { status, headers, text: String::from_utf8_lossy(&bytes).into_owned() }
    }

    pub async fn get(&self, path: &str) -> Answer {
        self.send(self.client.get(self.url(path))).await
    }

    pub async fn post(&self, path: &str, body: &Value) -> Answer {
        self.send(self.client.post(self.url(path)).json(body)).await
    }

    /// Posts a body that begins and never ends. `head` holds further lines of the head, and `body` the bytes
    /// that are sent. Returns the answer, read until the server closes the connection.
    pub async fn post_stalled(&self, path: &str, head: &str, body: &str) -> AnswerParts {
        let mut stream = TcpStream::connect(self.address).await.unwrap();
        let request = format!(
            "POST {path} HTTP/1.1\r\nHost: test\r\nConnection: close\r\nContent-Type: application/json\r\n{head}\r\n\r\n{body}"
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        let answer = AnswerParts::parse(&answer);
        contract::check("POST", path, &answer);
        answer
    }

    /// Posts a body as it is, declared as JSON.
    pub async fn post_text(&self, path: &str, body: impl Into<reqwest::Body>) -> Answer {
        let request = self.client.post(self.url(path)).header("content-type", "application/json");
        self.send(request.body(body)).await
    }
}

thread_local! {
    static CLIENT: reqwest::Client =
        http_client().pool_max_idle_per_host(0).build().expect("a client without options");
}

/// Begins a client. One that speaks TLS needs a cryptographic provider, which is that of the process.
pub fn http_client() -> reqwest::ClientBuilder {
    gramian_host::server::install_provider();
    reqwest::Client::builder()
}

/// Returns the client of this test, for requests that have a connection each. To make one reads the
/// certificates of the system, which takes longer than most requests.
pub fn unpooled() -> reqwest::Client {
    CLIENT.with(Clone::clone)
}

/// How long a test waits before it looks again whether something has happened.
pub const LOOK_EVERY: Duration = Duration::from_millis(5);

/// Waits until it is worth looking again. A loop without a pause takes a processor from the server that it
/// waits for.
pub async fn pause() {
    tokio::time::sleep(LOOK_EVERY).await;
}

/// Sends a request, reads its answer to the end, and checks it against the OpenAPI document.
pub async fn receive(request: reqwest::RequestBuilder) -> AnswerParts {
    let (client, request) = request.build_split();
    let request = request.unwrap();
    let (method, path) = (request.method().to_string(), request.url().path().to_owned());
    let response = client.execute(request).await.unwrap();
    let (status, headers) = (response.status().as_u16(), response.headers().clone());
    let received = AnswerParts { status, headers, bytes: response.bytes().await.unwrap().to_vec() };
    contract::check(&method, &path, &received);
    received
}

/// Returns `n` points on the unit sphere.
pub fn fibonacci_sphere(n: usize) -> Vec<[f64; 3]> {
    clouds::rows(&clouds::fibonacci_sphere(n))
}

/// Returns the details of the warnings of an answer that have a code.
pub fn warnings_of(answer: &Value, code: &str) -> Vec<String> {
    let warnings = answer["diagnostics"]["warnings"].as_array().unwrap();
    let of_code = warnings.iter().filter(|warning| warning["code"] == code);
    of_code.map(|warning| warning["detail"].as_str().unwrap().to_owned()).collect()
}

/// Returns all numbers of nested arrays, in order. Skips nulls in arrays.
///
/// A member that an answer lacks is null too. It has no numbers, and a loop over them would test nothing.
pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().filter(|item| !item.is_null()).flat_map(numbers).collect(),
        Value::Number(number) => vec![number.as_f64().unwrap()],
        other => panic!("no number: {other}"),
    }
}

/// Returns whether tests of committed files overwrite them instead of comparing.
pub fn overwrites() -> bool {
    std::env::var("EXPECTORATE").is_ok_and(|value| value == "overwrite")
}

/// Returns the OpenAPI document of this build.
pub fn document() -> Value {
    serde_json::from_str(&gramian::http::openapi_json()).unwrap()
}

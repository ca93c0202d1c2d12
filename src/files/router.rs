//! The service in this process: requests go to its router.

use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::http::{HeaderName, Method, Request, StatusCode, header};
use axum::response::Response;
use serde_json::Value;
use tower::ServiceExt;

use super::JSON;
use super::failure::Failure;
use super::progress::Progress;
use crate::config::Config;
use crate::http;
use crate::http::state::app::App;
use gramian_host::state::settings::Settings;

/// Time between two looks at a computation.
const LOOKING: Duration = Duration::from_millis(100);

/// A service that answers this process alone.
pub struct Answerer {
    router: Router,
    /// Whether no progress is shown.
    is_quiet: bool,
}

impl Answerer {
    /// Starts it, without keys and without a store: nobody else can ask, and nothing is kept.
    pub async fn start(config: Config, is_quiet: bool) -> Result<Self, Failure> {
        let host = Settings { api_keys: Vec::new(), keys_file: None, store: None, ..config.host };
        let config = Config { host, ..config };
        let app = App::new(config).await;
        let app = app.map_err(|error| Failure::File(format!("the service does not start: {error}")))?;
        let (router, _) = http::router(app);
        Ok(Self { router, is_quiet })
    }

    /// Registers a cloud. Returns its id.
    pub async fn register(&self, media_type: &'static str, body: Bytes) -> Result<Value, Failure> {
        let headers = [(header::CONTENT_TYPE, media_type), (header::ACCEPT, JSON)];
        let found = self.ask(Method::POST, "/v1/clouds", &headers, body).await?;
        Ok(json_of(found).await?["cloud_id"].take())
    }

    /// Computes an answer as a job, and shows its progress.
    pub async fn compute(&self, path: &str, body: Bytes, accept: &'static str) -> Result<Bytes, Failure> {
        let prefer = (HeaderName::from_static("prefer"), "respond-async");
        let headers = [(header::CONTENT_TYPE, JSON), (header::ACCEPT, accept), prefer];
        let found = self.ask(Method::POST, path, &headers, body).await?;
        if found.status() != StatusCode::ACCEPTED {
            return bytes_of(found).await;
        }
        let location = found.headers().get(header::LOCATION).and_then(|value| value.to_str().ok());
        let job = location.unwrap_or_default().to_owned();
        self.wait_for(&job).await?;
        let headers = [(header::ACCEPT, accept)];
        let found = self.ask(Method::GET, &format!("{job}/result"), &headers, Bytes::new()).await?;
        bytes_of(found).await
    }

    async fn wait_for(&self, job: &str) -> Result<(), Failure> {
        let mut progress = Progress::new(self.is_quiet);
        loop {
            let found = self.ask(Method::GET, job, &[(header::ACCEPT, JSON)], Bytes::new()).await?;
            let state = json_of(found).await?;
            if !matches!(state["status"].as_str(), Some("queued" | "running")) {
                return Ok(());
            }
            progress.show(&state["progress"]);
            tokio::time::sleep(LOOKING).await;
        }
    }

    /// Sends a request through the router. An answer that is a problem is a failure.
    async fn ask(
        &self,
        method: Method,
        path: &str,
        headers: &[(HeaderName, &'static str)],
        body: Bytes,
    ) -> Result<Response, Failure> {
        let mut request = Request::builder().method(method).uri(path).header(header::HOST, "localhost");
        for (name, value) in headers {
            request = request.header(name, *value);
        }
        let request = request
            .header(header::CONTENT_LENGTH, body.len())
            .body(Body::from(body))
            .map_err(|error| Failure::File(format!("{path} is not a valid path: {error}")))?;
        let Ok(response) = self.router.clone().oneshot(request).await;
        let status = response.status();
        if status.is_client_error() || status.is_server_error() {
            return Err(Failure::Problem(status, json_of(response).await?));
        }
        Ok(response)
    }
}

async fn bytes_of(response: Response) -> Result<Bytes, Failure> {
    let found = to_bytes(response.into_body(), usize::MAX).await;
    found.map_err(|error| Failure::File(format!("the answer was cut short: {error}")))
}

async fn json_of(response: Response) -> Result<Value, Failure> {
    let bytes = bytes_of(response).await?;
    serde_json::from_slice(&bytes).map_err(|error| Failure::File(format!("the answer is not JSON: {error}")))
}

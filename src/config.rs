//! Every setting of the process: one flag and one environment variable of the same name each.

use std::net::SocketAddr;
use std::time::Duration;

use crate::memory;

/// The configuration, read once in `main` and passed down.
#[derive(Debug, Clone, clap::Args)]
pub struct Config {
    /// Address and port to listen on.
    #[arg(long, env = "GRAMIAN_BIND", default_value = "127.0.0.1:8080")]
    pub bind: SocketAddr,

    /// Compute threads; 0 means one per core.
    #[arg(long, env = "GRAMIAN_THREADS", default_value_t = 0)]
    pub threads: usize,

    /// Bytes of memory for everything: bodies, clouds, factorizations, work and answers. Absent: three quarters of what the
    /// machine or the container has.
    #[arg(long, env = "GRAMIAN_MEMORY_BYTES", value_parser = enough_bytes)]
    pub memory_bytes: Option<usize>,

    /// Of these, bytes of factorizations and weights that are kept, an eighth of it for the next factorization; less where
    /// work needs them.
    #[arg(long, env = "GRAMIAN_CACHE_BYTES", default_value_t = 4 << 30)]
    pub cache_bytes: usize,

    /// Of these, bytes of registered clouds that are kept, an eighth of all at most.
    #[arg(long, env = "GRAMIAN_CLOUD_BYTES", default_value_t = 256 << 20)]
    pub cloud_bytes: usize,

    /// Points a cloud may have; a dense factorization takes 4 n² bytes and n³/3 flops.
    #[arg(long, env = "GRAMIAN_MAX_POINTS", default_value_t = 20_000)]
    pub max_points: usize,

    /// Queries a request may have.
    #[arg(long, env = "GRAMIAN_MAX_QUERIES", default_value_t = 100_000)]
    pub max_queries: usize,

    /// Coordinates a point may have.
    #[arg(long, env = "GRAMIAN_MAX_DIMENSION", default_value_t = 16)]
    pub max_dimension: usize,

    /// Bytes a request body may have.
    #[arg(long, env = "GRAMIAN_MAX_BODY_BYTES", default_value_t = 64 << 20)]
    pub max_body_bytes: usize,

    /// Bytes an answer may have, estimated at 25 bytes a number before anything is computed.
    #[arg(long, env = "GRAMIAN_MAX_RESPONSE_BYTES", default_value_t = 512 << 20)]
    pub max_response_bytes: usize,

    /// Compute requests that may wait for a thread; the next one is answered 503.
    #[arg(long, env = "GRAMIAN_MAX_QUEUE", default_value_t = 256)]
    pub max_queue: usize,

    /// Seconds from the arrival of a request to its answer; later it is answered 504.
    #[arg(long, env = "GRAMIAN_DEADLINE_SECONDS", default_value_t = 120.0, value_parser = positive_seconds)]
    pub deadline_seconds: f64,

    /// Seconds that a body may be late by: it must come at 16 KiB a second otherwise, or is answered 408.
    #[arg(long, env = "GRAMIAN_BODY_SECONDS", default_value_t = 10.0, value_parser = positive_seconds)]
    pub body_seconds: f64,

    /// Bearer keys, separated by commas; none leaves the service open.
    #[arg(long, env = "GRAMIAN_API_KEYS", value_delimiter = ',', hide_env_values = true)]
    pub api_keys: Vec<String>,

    /// Origins that browsers may call from, separated by commas, or `*`.
    #[arg(long, env = "GRAMIAN_CORS_ORIGINS", value_delimiter = ',')]
    pub cors_origins: Vec<String>,
}

impl Config {
    /// Compute threads, at least one.
    pub fn n_threads(&self) -> usize {
        match self.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        }
    }

    /// Bytes of memory for everything.
    pub fn memory_bytes(&self) -> usize {
        self.memory_bytes.unwrap_or_else(memory::default_bytes)
    }

    /// How late a body may be.
    pub fn body_timeout(&self) -> Duration {
        Duration::from_secs_f64(self.body_seconds)
    }

    /// The deadline as a duration.
    pub fn deadline(&self) -> Duration {
        Duration::from_secs_f64(self.deadline_seconds)
    }
}

/// As many as the process needs to answer at all.
fn enough_bytes(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(bytes) if bytes >= memory::LEAST_BYTES => Ok(bytes),
        _ => Err(format!("must be a number of bytes, at least {}", memory::LEAST_BYTES)),
    }
}

/// Up to ten years, so that the deadline is representable as an instant.
fn positive_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 3e8 => Ok(seconds),
        _ => Err("must be a positive number of seconds, at most 3e8".to_owned()),
    }
}

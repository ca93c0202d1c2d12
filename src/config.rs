//! Settings of the process, each with a flag and an environment variable of the same name.

use std::time::Duration;

use clap::Args;

use crate::store::objects::Retention;
use gramian_host::state::settings::{MAX_BYTES, MAX_COUNT, Settings, flag, whole};

/// The configuration, read once in `main` and passed down.
#[derive(Debug, Clone, clap::Args)]
pub struct Config {
    #[command(flatten)]
    pub host: Settings,

    /// Bytes of this memory for cached factorizations and weights, an eighth of them for the next
    /// factorization. Less where work needs them.
    #[arg(long, env = "GRAMIAN_CACHE_BYTES", default_value_t = 4 << 30)]
    pub cache_bytes: usize,

    /// Bytes of this memory for registered clouds, at most an eighth of all.
    #[arg(long, env = "GRAMIAN_CLOUD_BYTES", default_value_t = 512 << 20)]
    pub cloud_bytes: usize,

    /// Points a cloud may have, with any solver.
    #[arg(long, env = "GRAMIAN_MAX_POINTS", default_value_t = 2_000_000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_points: usize,

    /// Points that are factorized densely, which takes 4 n² bytes and n³/3 flops.
    #[arg(long, env = "GRAMIAN_MAX_DENSE_POINTS", default_value_t = 20_000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_dense_points: usize,

    /// Queries a request may have.
    #[arg(long, env = "GRAMIAN_MAX_QUERIES", default_value_t = 2_000_000, value_parser = whole::<1, MAX_COUNT>)]
    pub max_queries: usize,

    /// Coordinates a point may have.
    #[arg(long, env = "GRAMIAN_MAX_DIMENSION", default_value_t = 16, value_parser = whole::<1, MAX_COUNT>)]
    pub max_dimension: usize,

    /// Bytes an answer may have, estimated at 25 bytes per number before anything is computed.
    #[arg(long, env = "GRAMIAN_MAX_RESPONSE_BYTES", default_value_t = 1 << 30, value_parser = whole::<1, MAX_BYTES>)]
    pub max_response_bytes: usize,

    /// Whether the service is ready only while the store takes all clouds.
    #[arg(long, env = "GRAMIAN_STORE_REQUIRED", default_value_t = false, action = clap::ArgAction::Set, value_parser = flag)]
    pub store_required: bool,

    /// Days that a cloud stays in the store after it was written. Absent: forever.
    #[arg(long, env = "GRAMIAN_STORE_DAYS", value_parser = positive_days)]
    pub store_days: Option<f64>,

    /// Bytes of clouds in the store. Beyond them the oldest are deleted. Absent: unlimited.
    #[arg(long, env = "GRAMIAN_STORE_BYTES", value_parser = clap::value_parser!(u64).range(1..))]
    pub store_bytes: Option<u64>,

    /// Bytes of factorizations in the store. Beyond them the oldest are deleted. 0 keeps none.
    #[arg(long, env = "GRAMIAN_STORE_FACTOR_BYTES", default_value_t = 16 << 30)]
    pub store_factor_bytes: u64,
}

impl Config {
    /// Limits on the age and the bytes of the store.
    pub fn retention(&self) -> Retention {
        let age = self.store_days.map(|days| Duration::from_secs_f64(days * 86400.0));
        Retention { age, n_bytes: self.store_bytes, n_factor_bytes: self.store_factor_bytes }
    }

    /// Returns the names that look like settings but are none, usually because of a typing error.
    pub fn unknown_variables(names: impl Iterator<Item = String>) -> Vec<String> {
        let command = Self::augment_args(clap::Command::new("gramian"));
        let is_known =
            |name: &str| command.get_arguments().any(|arg| arg.get_env().is_some_and(|env| env == name));
        names.filter(|name| name.starts_with("GRAMIAN_") && !is_known(name)).collect()
    }
}

/// Parses days up to ten years, so that instants that far ahead are representable.
fn positive_days(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(days) if days > 0.0 && days <= 3650.0 => Ok(days),
        _ => Err("must be a positive number of days, at most 3650".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistyped_variables_are_found() {
        let names = ["GRAMIAN_API_KEY", "GRAMIAN_API_KEYS", "GRAMIAN_BIND", "PATH"].map(str::to_owned);
        assert_eq!(Config::unknown_variables(names.into_iter()), ["GRAMIAN_API_KEY"]);
    }
}

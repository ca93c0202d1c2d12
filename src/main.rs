//! Entry point: reads the configuration, then serves, answers a file, asks a running server whether it is
//! ready, or makes a key.

use std::process::ExitCode;

use clap::Parser;
use futures_util::future::OptionFuture;
use gramian::config::Config;
use gramian::files::{self, FileCommand};
use gramian::http;
use gramian::http::serve::durable;
use gramian::http::state::app::App;
use gramian_host::process::signals::{self, Signals};
use gramian_host::process::telemetry;
use gramian_host::{access, server};
use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};

/// Threads for files of a store. Their memory is part of what the process takes for itself (`memory.rs`).
const FILE_THREADS: usize = 8;

/// Exit status after a second signal during shutdown: 128 plus the number of SIGINT, as shells report it.
const INTERRUPTED: i32 = 130;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Geometric kernel interpolation and regression on point clouds, served over HTTP.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    config: Config,
    /// Serve until standard input is closed, then end as after SIGTERM. A program that starts the server
    /// keeps a pipe to it, and the server ends with the program, even if that is killed.
    #[arg(long)]
    while_stdin: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Exit with 0 if the server at GRAMIAN_BIND is ready.
    Health,
    /// Make a key, and the lines for the file of keys (GRAMIAN_KEYS_FILE) that let it in.
    Key {
        /// Name of its holder: letters, digits, '-' and '_'.
        name: String,
    },
    #[command(flatten)]
    File(FileCommand),
}

fn main() -> ExitCode {
    server::install_provider();
    let Arguments { config, while_stdin, command } = Arguments::parse();
    let outcome = match command {
        Some(Command::Health) => {
            match server::is_ready(config.host.bind, config.host.tls_certificate.is_some()) {
                Ok(true) => Ok(()),
                Ok(false) => Err("not ready".into()),
                Err(error) => Err(error.into()),
            }
        }
        Some(Command::File(command)) => return files::run(command, config),
        Some(Command::Key { name }) => make_key(&name).map_err(Into::into),
        None => {
            let log = telemetry::start();
            let served = runtime()
                .map_err(Into::into)
                .and_then(|runtime| runtime.block_on(serve(config, while_stdin)));
            log.mention_losses();
            served
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("gramian: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Prints a new key to standard error, where it is seen, and its lines for the key file to standard output.
/// The lines do not reveal the key.
fn make_key(name: &str) -> Result<(), String> {
    let (key, lines) = access::generate(name)?;
    eprintln!("The key, which nothing keeps: {key}");
    print!("{lines}");
    Ok(())
}

/// Creates the threads of connections, and a bounded number of threads for files.
///
/// By default there may be 512 threads for files. Each holds a stack and a heap of its own, so a few hundred
/// clients that read results from a directory would take memory that nothing counts.
fn runtime() -> std::io::Result<Runtime> {
    Builder::new_multi_thread().enable_all().max_blocking_threads(FILE_THREADS).build()
}

async fn serve(config: Config, while_stdin: bool) -> Result<(), Box<dyn std::error::Error>> {
    for name in Config::unknown_variables(std::env::vars_os().filter_map(|(name, _)| name.into_string().ok()))
    {
        tracing::warn!(name, "there is no such setting");
    }
    if config.host.is_exposed() && !config.host.allow_anonymous {
        let remedy =
            "set GRAMIAN_KEYS_FILE or GRAMIAN_API_KEYS, or GRAMIAN_ALLOW_ANONYMOUS=1 if that is meant";
        return Err(
            format!("anyone who can reach {} could use the service: {remedy}", config.host.bind).into()
        );
    }
    let listener = TcpListener::bind(config.host.bind).await;
    let listener =
        listener.map_err(|error| format!("cannot listen on {} (GRAMIAN_BIND): {error}", config.host.bind))?;
    if config.host.is_exposed() {
        tracing::warn!("no keys are configured: anyone who can reach this address may use the service");
    }
    let mut signals = Signals::new()?;
    let stdin_closed = if while_stdin { Some(signals::stdin_closed()?) } else { None };
    let stop = async move {
        tokio::select! {
            _ = signals.next() => {}
            Some(()) = OptionFuture::from(stdin_closed) => {}
        }
        tokio::spawn(async move {
            signals.next().await;
            tracing::warn!("told to end a second time: ending at once");
            std::process::exit(INTERRUPTED);
        });
    };
    let app = App::new(config).await?;
    let (address, n_api_keys) = (listener.local_addr()?, app.keys.n_keys());
    tracing::info!(%address, threads = app.settings.n_threads(), n_api_keys, "listening");
    tokio::spawn(durable::catch_up(app.clone()));
    tokio::spawn(durable::retain(app.clone()));
    tokio::spawn(app.keys.clone().follow_file());
    http::serve(app, listener, stop).await?;
    Ok(())
}

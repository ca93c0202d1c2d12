//! Entry point: reads the configuration, then serves, answers a file, asks a running server whether it is
//! ready, makes a key, or prints completions.

use std::io::Write;
use std::net::SocketAddr;
use std::process::ExitCode;

use futures_util::future::OptionFuture;
use gramian::arguments::{Arguments, Command, ServerArguments};
use gramian::config::{Config, UnknownVariable};
use gramian::files;
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

fn main() -> ExitCode {
    server::install_provider();
    let Arguments { server: ServerArguments { config, while_stdin }, command } = Arguments::of_process();
    let outcome = match command {
        Some(Command::Health) => check_health(config.host.bind).map_err(Into::into),
        Some(Command::File(command)) => return files::run(command, config),
        Some(Command::Key { name }) => make_key(&name).map_err(Into::into),
        Some(Command::Completions { shell }) => {
            std::io::stdout().write_all(&Arguments::completions(shell)).map_err(Into::into)
        }
        None | Some(Command::Serve) => {
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

/// Asks the server at an address whether it is ready.
fn check_health(bind: SocketAddr) -> Result<(), String> {
    match server::is_ready(bind) {
        Ok(true) => Ok(()),
        Ok(false) => Err(format!("the server at {bind} is not ready: its log has the reason")),
        Err(error) => Err(format!("no server answers at {bind} (GRAMIAN_BIND): {error}")),
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
    let names = std::env::vars_os().filter_map(|(name, _)| name.into_string().ok());
    for UnknownVariable { name, nearest } in Config::unknown_variables(names) {
        tracing::warn!(name, nearest, "there is no such setting; `gramian serve --help` lists all");
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
    tokio::spawn(durable::catch_up(app.clone()));
    tokio::spawn(durable::retain(app.clone()));
    tokio::spawn(app.keys.clone().follow_file());
    http::serve(app, listener, stop).await?;
    Ok(())
}

//! Arguments and environment to configuration; serve, or ask a running server how it is.

use std::process::ExitCode;

use clap::Parser;
use gramian::app::App;
use gramian::config::Config;
use gramian::{server, telemetry};
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Geometric kernel interpolation and regression on point clouds, served over HTTP.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    config: Config,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Exit with 0 if the server at GRAMIAN_BIND is ready.
    Health,
}

fn main() -> ExitCode {
    let Arguments { config, command } = Arguments::parse();
    let outcome = match command {
        Some(Command::Health) => match server::is_ready(config.bind) {
            Ok(true) => Ok(()),
            Ok(false) => Err("not ready".into()),
            Err(error) => Err(error.into()),
        },
        None => serve(config),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("gramian: {error}");
            ExitCode::FAILURE
        }
    }
}

#[tokio::main]
async fn serve(config: Config) -> Result<(), Box<dyn std::error::Error>> {
    telemetry::start();
    let listener = TcpListener::bind(config.bind).await?;
    let (mut terminate, mut interrupt) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    let stop = async move {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = interrupt.recv() => {}
        }
    };
    tracing::info!(address = %listener.local_addr()?, threads = config.n_threads(), "listening");
    server::serve(App::new(config)?, listener, stop).await?;
    Ok(())
}

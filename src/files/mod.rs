//! Subcommands that answer files without a server. They send the request through the same router, in this
//! process and without a port, so that answers and refusals are those of the service.

mod output;
mod progress;
mod read;
mod router;
mod tensors;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use axum::body::Bytes;
use serde_json::{Map, Value, json};

use crate::config::Config;
use gramian_host::process::signals::Signals;
use output::Output;
use router::{Answerer, Failure};

const JSON: &str = "application/json";

/// Media types of answers by the ending of a file.
const ANSWERS: [(&str, &str); 6] = [
    ("json", JSON),
    ("safetensors", "application/x-safetensors"),
    ("npy", "application/x-npy"),
    ("ply", "model/ply"),
    ("glb", "model/gltf-binary"),
    ("obj", "model/obj"),
];

/// A subcommand that reads a file and writes a file.
#[derive(clap::Subcommand)]
pub enum FileCommand {
    /// Compute normals of a cloud: gramian normals scan.ply -o scan-normals.ply
    Normals(OfCloud),
    /// Compute curvatures of a cloud: gramian curvatures scan.ply -o scan-curvatures.ply
    Curvatures(OfCloud),
    /// Mesh the surface of a cloud: gramian mesh scan.ply -o scan.glb
    Mesh(OfCloud),
    /// Answer a request: gramian ask laplace-beltrami/sparse-matrix request.json -o matrix.safetensors
    Ask {
        /// The end of a path under /v1, such as interpolation or laplace-beltrami/matrix.
        operation: String,
        /// A file with the request as JSON.
        request: PathBuf,
        /// The file of the answer: .json, .safetensors, .npy, .ply, .glb or .obj. Default: JSON on
        /// standard output.
        #[arg(short, long)]
        output: Option<PathBuf>,
    },
}

/// A cloud in a file, and where its answer goes.
#[derive(clap::Args)]
pub struct OfCloud {
    #[arg(help = format!("A file of points: {}", read::formats::endings()), long_help = read::formats::help())]
    cloud: PathBuf,
    /// The file of the answer: .ply, .json or .safetensors, and for meshes .glb or .obj.
    #[arg(short, long)]
    output: PathBuf,
    /// Add standard deviations.
    #[arg(long)]
    std: bool,
    /// Further members of the request as JSON, such as '{"alpha": 1e-6, "duplicates": "merge"}'.
    #[arg(long, value_name = "JSON")]
    with: Option<String>,
}

/// Answers a subcommand.
///
/// The exit code is 0 for an answer, 1 if a file cannot be read or written, 2 for wrong arguments, 3 if the
/// request was refused, and 4 if it failed. After a signal it is 128 and the signal's number.
pub fn run(command: FileCommand, config: Config) -> ExitCode {
    let answered = tokio::runtime::Runtime::new()
        .map_err(|error| Failure::File(format!("the runtime does not start: {error}")))
        .and_then(|runtime| {
            let answered = runtime.block_on(answer_until_told_to_end(command, config));
            // Computations and writes that a signal has ended are not awaited.
            runtime.shutdown_background();
            answered
        });
    match answered {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("gramian: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Answers a subcommand. A signal drops what is under way, and the file beside the output with it.
async fn answer_until_told_to_end(command: FileCommand, config: Config) -> Result<(), Failure> {
    let signals = Signals::new();
    let mut signals =
        signals.map_err(|error| Failure::File(format!("signals cannot be received: {error}")))?;
    tokio::select! {
        answered = answer(command, config) => answered,
        signal = signals.next() => Err(Failure::Ended(signal)),
    }
}

async fn answer(command: FileCommand, config: Config) -> Result<(), Failure> {
    match command {
        FileCommand::Normals(of) => of_cloud("normals", &of, config).await,
        FileCommand::Curvatures(of) => of_cloud("curvatures", &of, config).await,
        FileCommand::Mesh(of) => of_cloud("level-set", &of, config).await,
        FileCommand::Ask { operation, request, output } => {
            let accept = output.as_deref().map_or(Ok(JSON), media_type_of)?;
            let output = Output::prepare(output.as_deref(), &request)?;
            let body = on_thread(move || bytes_in(&request)).await?;
            let answerer = Answerer::start(config).await?;
            output.write(answerer.compute(&format!("/v1/{operation}"), body, accept).await?).await
        }
    }
}

async fn of_cloud(operation: &str, of: &OfCloud, config: Config) -> Result<(), Failure> {
    let accept = media_type_of(&of.output)?;
    let mut request = match &of.with {
        None => Map::new(),
        Some(text) => serde_json::from_str(text)
            .map_err(|error| Failure::Argument(format!("--with is not a JSON object: {error}")))?,
    };
    if of.std {
        let include = request.entry("include").or_insert(json!([])).as_array_mut();
        let include = include.ok_or_else(|| Failure::Argument("--with: include is not a list".to_owned()))?;
        if !include.contains(&json!("std")) {
            include.push(json!("std"));
        }
    }
    let output = Output::prepare(Some(&of.output), &of.cloud)?;
    let cloud = of.cloud.clone();
    let body = on_thread(move || cloud_in(&cloud)).await?;
    let answerer = Answerer::start(config).await?;
    let cloud = answerer.register(tensors::MEDIA_TYPE, body).await?;
    request.insert("cloud".to_owned(), json!({"id": cloud}));
    let body = Bytes::from(Value::Object(request).to_string());
    output.write(answerer.compute(&format!("/v1/{operation}"), body, accept).await?).await
}

/// Works with files on a thread of its own, so that signals are heard while a pipe has nothing to say.
async fn on_thread<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let done = tokio::task::spawn_blocking(work).await;
    done.map_err(|error| Failure::File(format!("a thread broke off: {error}")))?
}

/// The tensors of a cloud in a file.
fn cloud_in(path: &Path) -> Result<Bytes, Failure> {
    let refused = |detail: String| Failure::File(format!("{}: {detail}", path.display()));
    let cloud = read::read(&path.to_string_lossy(), &bytes_in(path)?);
    let cloud = cloud.map_err(|error| refused(error.to_string()))?;
    if let Some(sentence) = cloud.left_out() {
        eprintln!("gramian: {}: {sentence}", path.display());
    }
    tensors::of(&cloud).map(Bytes::from).map_err(refused)
}

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn media_type_of(path: &Path) -> Result<&'static str, Failure> {
    let ending = ending(path);
    let known = ANSWERS.iter().find(|(name, _)| *name == ending);
    known.map(|(_, media_type)| *media_type).ok_or_else(|| {
        let names = ANSWERS.map(|(name, _)| format!(".{name}")).join(", ");
        Failure::Argument(format!("{}: the file of an answer ends with one of {names}", path.display()))
    })
}

fn bytes_in(path: &Path) -> Result<Bytes, Failure> {
    let found = std::fs::read(path);
    found.map(Bytes::from).map_err(|error| Failure::File(format!("{}: {error}", path.display())))
}

//! Subcommands that answer files without a server. They send the request through the same router, in this
//! process and without a port, so that answers and refusals are those of the service.

mod command;
mod failure;
mod output;
mod places;
mod progress;
mod read;
mod report;
mod request;
mod router;
mod tensors;
mod words;
mod write;

use std::path::Path;
use std::process::ExitCode;

use axum::body::Bytes;

use crate::config::Config;
use crate::http;
pub use command::FileCommand;
use command::{Ask, Files};
use failure::Failure;
use gramian_host::process::signals::Signals;
use places::{FileArguments, Task, bytes_in, is_standard, shown};
use read::FileCloud;
use request::CloudRequest;
use router::Answerer;
use write::{Answer, Content};

const JSON: &str = "application/json";

/// Answers a subcommand. Its help lists the exit codes.
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
            tell(&failure.to_string());
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Writes a line for people to standard error.
fn tell(text: &str) {
    if !text.is_empty() {
        eprintln!("gramian: {text}");
    }
}

/// Answers a subcommand. A signal drops what is under way, and the files beside outputs with it.
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
    let (of, operation) = match command {
        FileCommand::Normals(of) => (of, "normals"),
        FileCommand::Curvatures(of) => (of, "curvatures"),
        FileCommand::Mesh(of) => {
            let request = CloudRequest::of_mesh(&of)?;
            let arguments = file_arguments(&of.files, Content::Mesh, "mesh");
            let arguments = FileArguments { output: of.output.as_deref(), to: of.to.as_deref(), ..arguments };
            return answer_clouds(arguments, &of.files, &request, config).await;
        }
        FileCommand::Ask(ask) => return answer_request(ask, config).await,
    };
    let request = CloudRequest::of_points(operation, &of.fit)?;
    let arguments = file_arguments(&of.files, Content::Points, operation);
    let arguments = FileArguments { output: of.output.as_deref(), to: of.to.as_deref(), ..arguments };
    answer_clouds(arguments, &of.files, &request, config).await
}

fn file_arguments<'a>(files: &'a Files, content: Content, suffix: &'a str) -> FileArguments<'a> {
    let is_forced = files.manners.force;
    FileArguments { inputs: &files.clouds, output: None, to: None, content, suffix, is_forced }
}

/// Answers one cloud after another. A cloud that fails does not keep the others from their answers.
async fn answer_clouds(
    arguments: FileArguments<'_>,
    files: &Files,
    request: &CloudRequest,
    config: Config,
) -> Result<(), Failure> {
    let tasks = arguments.tasks()?;
    let answerer = Answerer::start(config, files.manners.quiet).await?;
    let mut last = Ok(());
    for task in tasks {
        let input = task.input.clone();
        let answered = answer_cloud(&answerer, task, files, request).await;
        let about = |problem: &_| format!("{}: {}", shown(&input), words::of_cloud_problem(problem));
        if let Err(failure) = answered
            && let Err(before) = std::mem::replace(&mut last, Err(failure.in_words(about)))
        {
            tell(&before.to_string());
        }
    }
    last
}

async fn answer_cloud(
    answerer: &Answerer,
    task: Task,
    files: &Files,
    request: &CloudRequest,
) -> Result<(), Failure> {
    let Task { input, output, format } = task;
    let (name, place) = (shown(&input), output.name());
    let refused = |reason: String| Failure::Argument(format!("{name}: {reason}"));
    let (path, from) = (input.clone(), files.from.clone());
    let (cloud, body) = on_thread(move || cloud_in(&path, from.as_deref())).await?;
    let mut warnings: Vec<String> = cloud.left_out().into_iter().collect();
    let id = answerer.register(tensors::MEDIA_TYPE, body).await?;
    let path = format!("/v1/{}", request.operation);
    let found = answerer.compute(&path, request.about(&id).into(), format.asked_for()).await?;
    let answer =
        Answer::of(found).map_err(|error| Failure::File(format!("the answer cannot be read: {error}")))?;
    warnings.extend(report::warnings(&answer));
    let success = report::success(&answer, &place);
    let bytes = on_thread(move || Ok(format.write(answer, &cloud))).await?.map_err(refused)?;
    output.write(bytes.into()).await?;
    if !files.manners.quiet {
        warnings.iter().for_each(|warning| tell(&format!("{name}: {warning}")));
        eprintln!("{success}");
    }
    Ok(())
}

async fn answer_request(ask: Ask, config: Config) -> Result<(), Failure> {
    let Ask { operation, request, output, manners } = ask;
    let inputs = [request];
    let arguments = FileArguments {
        inputs: &inputs,
        output: Some(output.as_deref().unwrap_or(Path::new("-"))),
        to: output.as_deref().is_none_or(is_standard).then_some("json"),
        content: Content::Answer,
        suffix: "answer",
        is_forced: manners.force,
    };
    for Task { input, output, format } in arguments.tasks()? {
        let (name, place) = (shown(&input), output.name());
        let is_file = !matches!(output, output::Output::Standard);
        let body = on_thread(move || bytes_in(&input)).await?;
        let answerer = Answerer::start(config.clone(), manners.quiet).await?;
        let found = answerer.compute(&format!("/v1/{operation}"), body, format.media_type()).await;
        let found = found.map_err(|failure| {
            failure.in_words(|problem| {
                if problem["type"] == "/problems/not-found" {
                    let names = http::operations().join(", ");
                    return format!("there is no operation {operation}. There are {names}");
                }
                format!("{name}: {}", words::of_request_problem(problem))
            })
        })?;
        let n_bytes = words::counted(found.len(), "byte");
        output.write(found).await?;
        if is_file && !manners.quiet {
            eprintln!("{n_bytes}, wrote {place}");
        }
    }
    Ok(())
}

/// Works with files on a thread of its own, so that signals are heard while a pipe has nothing to say.
async fn on_thread<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let done = tokio::task::spawn_blocking(work).await;
    done.map_err(|error| Failure::File(format!("a worker thread failed: {error}")))?
}

/// The cloud in a file, and the body that registers it. `from` is the ending of its format where it is given.
fn cloud_in(path: &Path, from: Option<&str>) -> Result<(FileCloud, Bytes), Failure> {
    let refused = |detail: String| Failure::File(format!("{}: {detail}", shown(path)));
    let name = match from {
        Some(ending) => format!("cloud.{}", ending.trim_start_matches('.')),
        None => path.to_string_lossy().into_owned(),
    };
    let cloud = read::read(&name, &bytes_in(path)?).map_err(|error| refused(error.to_string()))?;
    let body = tensors::of(&cloud).map_err(refused)?;
    Ok((cloud, body.into()))
}

//! Subcommands that answer files, and their options.

use std::path::PathBuf;

use super::read::formats::{endings, help as formats_help};
use super::write::{self, Content};
use crate::http::fields::{DuplicatePolicy, SolverChoice, SurfaceModelChoice};

/// A subcommand that reads files and writes files.
#[derive(clap::Subcommand)]
pub enum FileCommand {
    /// Compute normals of a cloud: gramian normals scan.ply
    #[command(after_long_help = EXIT_CODES)]
    Normals(OfPoints),
    /// Compute curvatures of a cloud: gramian curvatures scan.ply -o scan.csv --std
    #[command(after_long_help = EXIT_CODES)]
    Curvatures(OfPoints),
    /// Mesh the surface of a cloud: gramian mesh scan.ply -o scan.stl
    #[command(after_long_help = EXIT_CODES)]
    Mesh(OfMesh),
    /// Answer a request: gramian ask laplace-beltrami/sparse-matrix request.json -o matrix.safetensors
    #[command(after_long_help = EXIT_CODES)]
    Ask(Ask),
}

const EXIT_CODES: &str = "\
Exit codes: 0 for an answer, 1 if a file cannot be read or written, 2 for wrong arguments, 3 if the cloud or the
request is refused, 4 if the computation fails. After a signal 128 and its number: 130 for Ctrl-C.";

/// Options of normals and curvatures.
#[derive(clap::Args)]
pub struct OfPoints {
    #[command(flatten)]
    pub files: Files,
    #[arg(short, long, value_name = "FILE", help = output_help(Content::Points))]
    pub output: Option<PathBuf>,
    #[arg(long, value_name = "ENDING", help = to_help(Content::Points))]
    pub to: Option<String>,
    #[command(flatten)]
    pub fit: FitArguments,
}

/// Options of meshes.
#[derive(clap::Args)]
pub struct OfMesh {
    #[command(flatten)]
    pub files: Files,
    #[arg(short, long, value_name = "FILE", help = output_help(Content::Mesh))]
    pub output: Option<PathBuf>,
    #[arg(long, value_name = "ENDING", help = to_help(Content::Mesh))]
    pub to: Option<String>,
    /// The surface ends where its points end. A closed mesh bridges holes.
    #[arg(long)]
    pub open: bool,
    /// The longest edge, in the unit of the points. Default: their median spacing.
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    pub step: Option<f64>,
    /// Add curvatures at the vertices.
    #[arg(long)]
    pub curvatures: bool,
    #[command(flatten)]
    pub fit: FitArguments,
}

/// A request in a file.
#[derive(clap::Args)]
pub struct Ask {
    /// The end of a path under /v1, such as interpolation or laplace-beltrami/matrix.
    pub operation: String,
    /// A file with the request as JSON, or - for standard input.
    pub request: PathBuf,
    #[arg(short, long, value_name = "FILE", help = ask_output_help())]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub manners: Manners,
}

/// The clouds that are read.
#[derive(clap::Args)]
pub struct Files {
    #[arg(required = true, value_name = "CLOUD", help = clouds_help(), long_help = format!("{}\n\n- alone is standard input.", formats_help()))]
    pub clouds: Vec<PathBuf>,
    /// The format of standard input, where its content does not tell: an ending, such as csv.
    #[arg(long, value_name = "ENDING")]
    pub from: Option<String>,
    #[command(flatten)]
    pub manners: Manners,
}

/// How files are replaced, and what is told.
#[derive(clap::Args)]
pub struct Manners {
    /// Let the answer replace the file that is read.
    #[arg(long)]
    pub force: bool,
    /// Print only errors.
    #[arg(short, long)]
    pub quiet: bool,
}

/// Options that determine a surface. What is left out is chosen from the points.
#[derive(clap::Args)]
pub struct FitArguments {
    /// Add standard deviations.
    #[arg(long)]
    pub std: bool,
    /// Added to the diagonal of the Gram matrix: the variance of the noise in units of the kernel.
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true)]
    pub alpha: Option<f64>,
    /// A family with its length scale and parameters, such as gauss, matern:0.5 or laplace:0.5,epsilon=0.01.
    #[arg(long, value_name = "FAMILY[:LENGTH]")]
    pub kernel: Option<String>,
    /// The method that solves the linear system.
    #[arg(long, value_enum)]
    pub solver: Option<SolverChoice>,
    /// The function whose level set is the surface.
    #[arg(long, value_enum)]
    pub surface: Option<SurfaceModelChoice>,
    /// The treatment of points that coincide, where alpha is 0.
    #[arg(long, value_enum)]
    pub duplicates: Option<DuplicatePolicy>,
    /// Further members of the request as JSON, such as '{"orientation": "gradient"}'.
    #[arg(long, value_name = "JSON")]
    pub with: Option<String>,
}

fn clouds_help() -> String {
    format!("Files of points, or - for standard input: {}", endings())
}

fn output_help(content: Content) -> String {
    format!(
        "The file of the answer, - for standard output, or a folder for several clouds: {}. Default: beside the cloud, \
         with the name of the command",
        write::endings(content)
    )
}

fn to_help(content: Content) -> String {
    let first = write::FORMATS[0].ending;
    let among = write::endings(content);
    format!("The format of answers whose file names have no known ending: one of {among}. Default: {first}")
}

fn ask_output_help() -> String {
    format!("The file of the answer: {}. Default: JSON on standard output", write::endings(Content::Answer))
}

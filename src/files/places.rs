//! Where clouds come from, and where their answers go. All of it is checked before anything is computed.

use std::collections::HashSet;
use std::fs;
use std::io::{IsTerminal, Read, stdin, stdout};
use std::path::{Path, PathBuf};

use axum::body::Bytes;

use super::failure::Failure;
use super::output::Output;
use super::write::{Content, FORMATS, Format};

/// The name of standard input or output among arguments.
const STANDARD: &str = "-";

/// A file that is read and the one that is written.
pub struct Task {
    pub input: PathBuf,
    pub output: Output,
    pub format: &'static Format,
}

/// Input files and the place of their answers, from a command line.
pub struct FileArguments<'a> {
    pub inputs: &'a [PathBuf],
    pub output: Option<&'a Path>,
    /// The ending of answers, where their names do not tell it.
    pub to: Option<&'a str>,
    pub content: Content,
    /// The end of names of answers: scan-normals.ply.
    pub suffix: &'a str,
    pub is_forced: bool,
}

impl FileArguments<'_> {
    /// Finds a place for each answer, and makes sure that it can be written.
    ///
    /// # Errors
    /// Refuses formats that cannot hold the answer, two answers at one place, and what
    /// [`Output::prepare`] refuses.
    pub fn tasks(&self) -> Result<Vec<Task>, Failure> {
        self.check_standard_input()?;
        let mut taken = HashSet::new();
        let task = |input: &PathBuf| {
            let path = self.path_for(input)?;
            let format = self.format_at(path.as_deref())?;
            let Some(path) = path else {
                return Ok(Task { input: input.clone(), output: Output::Standard, format });
            };
            if !taken.insert(path.clone()) {
                let detail = "two answers would have this name; run them separately, each with its own -o";
                return Err(Failure::Argument(format!("{}: {detail}", path.display())));
            }
            let output = Output::prepare(&path, self.inputs, self.is_forced)?;
            Ok(Task { input: input.clone(), output, format })
        };
        self.inputs.iter().map(task).collect()
    }

    fn check_standard_input(&self) -> Result<(), Failure> {
        let n_standard = self.inputs.iter().filter(|input| is_standard(input)).count();
        if n_standard > 1 {
            return Err(Failure::Argument("standard input (-) can be read once".to_owned()));
        }
        Ok(())
    }

    /// The path of an answer. `None` is standard output.
    fn path_for(&self, input: &Path) -> Result<Option<PathBuf>, Failure> {
        let is_single = self.inputs.len() == 1;
        match self.output {
            None if is_standard(input) => Ok(None),
            None => Ok(Some(input.with_file_name(self.name_for(input)))),
            Some(output) if is_standard(output) && is_single => Ok(None),
            Some(output) if is_folder(output)? => Ok(Some(output.join(self.name_for(input)))),
            Some(output) if is_single => Ok(Some(output.to_owned())),
            Some(output) => {
                let detail = "several answers need a folder that exists, or a name that ends with /";
                Err(Failure::Argument(format!("-o {}: {detail}", output.display())))
            }
        }
    }

    /// The name of an answer that was given none: that of the cloud, the command, and the ending.
    fn name_for(&self, input: &Path) -> String {
        let stem = if is_standard(input) {
            "stdin".into()
        } else {
            input.file_stem().unwrap_or_default().to_string_lossy()
        };
        let ending = self.to.unwrap_or(FORMATS[0].ending).trim_start_matches('.');
        format!("{stem}-{}.{ending}", self.suffix)
    }

    fn format_at(&self, path: Option<&Path>) -> Result<&'static Format, Failure> {
        let own = path.map(ending_of).unwrap_or_default();
        let default = if path.is_none() { FORMATS[0].ending } else { &own };
        let format = Format::named(self.to.unwrap_or(default), self.content).map_err(|reason| {
            let place = path.map(|path| format!("{}: ", path.display())).unwrap_or_default();
            Failure::Argument(format!("{place}{reason}"))
        })?;
        if path.is_none() && !format.is_text() && stdout().is_terminal() {
            let detail = "a terminal cannot show it: give -o FILE, or --to csv or json";
            return Err(Failure::Argument(format!(".{} is a binary format, {detail}", format.ending)));
        }
        Ok(format)
    }
}

/// Whether an argument is standard input or output.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == STANDARD
}

/// Whether a path is a folder. One whose name ends with a slash is made if it is not there.
fn is_folder(path: &Path) -> Result<bool, Failure> {
    if !path.is_dir() && path.to_string_lossy().ends_with('/') {
        fs::create_dir_all(path).map_err(|error| Failure::File(format!("{}: {error}", path.display())))?;
    }
    Ok(path.is_dir())
}

/// The ending of a name in lower case, without its dot.
fn ending_of(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// The name of an input for messages.
pub fn shown(input: &Path) -> String {
    if is_standard(input) { "standard input".to_owned() } else { input.display().to_string() }
}

/// Reads a whole file, or standard input to its end.
///
/// # Errors
/// [`Failure::File`] with the name.
pub fn bytes_in(input: &Path) -> Result<Bytes, Failure> {
    let mut bytes = Vec::new();
    let found = if is_standard(input) {
        stdin().lock().read_to_end(&mut bytes).map(|_| bytes)
    } else {
        fs::read(input)
    };
    found.map(Bytes::from).map_err(|error| Failure::File(format!("{}: {error}", shown(input))))
}

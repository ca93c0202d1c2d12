//! Subcommands that answer files without a server.

mod answers;
mod outputs;
mod words;

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Output, Stdio};

use crate::running::gramian;
use crate::support::fibonacci_sphere;

/// A folder that is removed with its files.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("gramian-files-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.0.join(name)).unwrap()
    }

    /// Runs the binary in the folder, without the settings of this process.
    fn run(&self, arguments: &[&str]) -> Output {
        gramian().current_dir(&self.0).args(arguments).output().unwrap()
    }

    /// Runs the binary in the folder with this on standard input.
    fn run_on(&self, arguments: &[&str], input: &str) -> Output {
        let mut command = gramian();
        command.current_dir(&self.0).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
        child.wait_with_output().unwrap()
    }

    /// The names of all files, in order.
    fn names(&self) -> Vec<String> {
        let files = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn sphere(n: usize) -> String {
    let rows = fibonacci_sphere(n).into_iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    rows.collect()
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

/// Returns what a command writes to standard error.
fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

//! Arguments of the program: commands, and the settings of the server.

use std::ffi::OsStr;

use clap::error::{ContextKind, ContextValue};
use clap::{Args, CommandFactory, FromArgMatches, Parser};
use clap_complete::Shell;

use crate::config::Config;
use crate::files::FileCommand;

/// Normals, curvatures and meshes of point clouds with their error bars, by geometric kernel interpolation.
#[derive(Parser)]
#[command(name = "gramian", version, after_help = AFTER_HELP)]
pub struct Arguments {
    #[command(flatten)]
    pub server: ServerArguments,
    #[command(subcommand)]
    pub command: Option<Command>,
}

const AFTER_HELP: &str = "\
Without a command, gramian runs the server, as `gramian serve` does.
`gramian serve --help` lists its settings, which are variables of the environment as well.
Limits among them, such as --memory-bytes, hold for every command.";

/// The settings of the server. Every command takes them, and the help of `serve` lists them.
#[derive(Args)]
pub struct ServerArguments {
    #[command(flatten)]
    pub config: Config,
    /// Serve until standard input is closed, then end as after SIGTERM. A program that starts the server
    /// keeps a pipe to it, and the server ends with the program, even if that is killed.
    #[arg(long)]
    pub while_stdin: bool,
}

/// A command.
#[derive(clap::Subcommand)]
pub enum Command {
    #[command(flatten)]
    File(FileCommand),
    /// Run the server, with the page for a browser
    Serve,
    /// Exit with 0 if the server at GRAMIAN_BIND is ready, in plain HTTP or over TLS
    Health,
    /// Make a key, and the lines for the file of keys (GRAMIAN_KEYS_FILE) that let it in
    Key {
        /// Name of its holder: letters, digits, '-' and '_'.
        name: String,
    },
    /// Print the completions of a shell, such as bash, zsh or fish
    Completions {
        /// The shell.
        shell: Shell,
    },
}

impl Arguments {
    /// The command line as clap parses it. Settings are hidden everywhere but in the help of `serve`.
    pub fn command_line() -> clap::Command {
        let settings = ServerArguments::augment_args(clap::Command::new("serve"));
        let are_settings = settings.clone();
        let command = Self::command().mut_args(|arg| {
            let is_setting = are_settings.get_arguments().any(|setting| setting.get_id() == arg.get_id());
            if is_setting { arg.global(true).hide(true) } else { arg }
        });
        command.mut_subcommand("serve", |serve| serve.args(settings.get_arguments().cloned()))
    }

    /// Reads the arguments of the process. Ends it with help, or with what is wrong.
    pub fn of_process() -> Self {
        let arguments = Self::command_line().try_get_matches();
        match arguments.and_then(|mut arguments| Self::from_arg_matches_mut(&mut arguments)) {
            Ok(arguments) => arguments,
            Err(error) => {
                // Nothing is left to tell it to.
                let _ = error.print();
                if let Some(variable) = variable_of(&error, std::env::args_os()) {
                    eprintln!("\nThe value is that of the variable {variable}.");
                }
                std::process::exit(error.exit_code())
            }
        }
    }

    /// The text of the completions of a shell.
    pub fn completions(shell: Shell) -> Vec<u8> {
        let (mut text, mut command) = (Vec::new(), Self::command_line());
        clap_complete::generate(shell, &mut command, "gramian", &mut text);
        text
    }
}

/// The variable that a refused value comes from, if its option is not among the arguments.
fn variable_of(
    error: &clap::Error,
    mut arguments: impl Iterator<Item = impl AsRef<OsStr>>,
) -> Option<String> {
    let Some(ContextValue::String(option)) = error.get(ContextKind::InvalidArg) else { return None };
    let long = option.split_whitespace().next()?.strip_prefix("--")?;
    let settings = Config::augment_args(clap::Command::new("serve"));
    let setting = settings.get_arguments().find(|arg| arg.get_long() == Some(long))?;
    let variable = setting.get_env()?.to_str()?;
    let flag = format!("--{long}");
    let is_flag = |argument: &OsStr| {
        argument.to_str().is_some_and(|text| text == flag || text.starts_with(&format!("{flag}=")))
    };
    let is_given = arguments.any(|argument| is_flag(argument.as_ref()));
    (!is_given && std::env::var_os(variable).is_some()).then(|| variable.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(arguments: &[&str]) -> Config {
        let mut found = Arguments::command_line().get_matches_from([&["gramian"], arguments].concat());
        Arguments::from_arg_matches_mut(&mut found).unwrap().server.config
    }

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command_line().debug_assert();
    }

    #[test]
    fn settings_may_stand_before_and_after_every_command() {
        for arguments in [
            &["--max-points", "5"][..],
            &["serve", "--max-points", "5"],
            &["--max-points", "5", "serve"],
            &["health", "--max-points", "5"],
            &["key", "lab", "--max-points", "5"],
        ] {
            assert_eq!(config(arguments).max_points, 5, "{arguments:?}");
        }
    }
}

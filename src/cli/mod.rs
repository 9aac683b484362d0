//! The command line. It turns arguments into edits of a job, shows progress and writes files; it decides
//! nothing about rendering. Only this module and `main` print.

mod choosing;
pub mod compare;
mod info;
mod merge;
mod numbers;
mod preview;
mod progress;
mod radiosity;
mod render;
mod resume;
mod study;
mod told;

use std::ffi::OsString;
use std::fmt;
use std::io::Write;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::format::SceneError;
use crate::image_io::ImageError;
use crate::study::CompareError;

#[derive(Parser, Debug)]
#[command(
    name = "luxel",
    version,
    about = "Renders scenes written in Mitsuba's scene language, and says how large the error is",
    after_help = "Exit codes: 0 done; 1 the scene or an input is wrong, or a comparison failed; \
                  2 the command line is wrong; 3 a file could not be written; 130 stopped by Ctrl-C."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene to an image, with an estimate of its error
    Render(Box<render::RenderArgs>),
    Compare(Box<compare::CompareArgs>),
    /// Join the shards of a picture that `render --shard` made
    Merge(merge::MergeArgs),
    Study(Box<study::StudyArgs>),
    /// Solve for the radiosity of a scene, and write it as a mesh with colours
    Radiosity(Box<radiosity::RadiosityArgs>),
    /// Show what a scene contains and what is modelled for it, or what is supported at all
    Info(info::InfoArgs),
    /// Print a completion script for a shell
    Completions {
        /// The shell to print the script for
        shell: clap_complete::Shell,
    },
}

/// Why a command ended without its result.
#[derive(Debug)]
pub enum Failure {
    /// The scene or another input is wrong.
    Input(String),
    /// A file could not be written.
    Output(String),
    /// The command line is wrong in a way that the parser of arguments cannot see.
    Usage(String),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Input(what) | Failure::Output(what) | Failure::Usage(what) => {
                f.write_str(what)
            }
        }
    }
}

impl std::error::Error for Failure {}

impl Failure {
    /// What the program answers to its caller.
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Input(_) => 1,
            Failure::Usage(_) => 2,
            Failure::Output(_) => 3,
        }
    }
}

impl From<SceneError> for Failure {
    fn from(e: SceneError) -> Failure {
        Failure::Input(e.to_string())
    }
}

impl From<ImageError> for Failure {
    fn from(e: ImageError) -> Failure {
        match e {
            ImageError::Read { .. } => Failure::Input(e.to_string()),
            ImageError::Write { .. } => Failure::Output(e.to_string()),
        }
    }
}

impl From<CompareError> for Failure {
    fn from(e: CompareError) -> Failure {
        Failure::Input(e.to_string())
    }
}

/// How a command ended that ran to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Done,
    /// A test that was asked for failed.
    TestFailed,
    /// Stopped by Ctrl-C; what was done is written.
    Interrupted,
}

impl Outcome {
    /// What the program answers to its caller.
    pub fn exit_code(self) -> u8 {
        match self {
            Outcome::Done => 0,
            Outcome::TestFailed => 1,
            // As a shell reports the end by this signal: 128 + SIGINT.
            Outcome::Interrupted => 130,
        }
    }
}

/// Runs the program with these arguments (the program's name first) and gives its exit code.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args: Vec<OsString> = args.into_iter().collect();
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are "errors" of exit code 0 that go to stdout.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let line = args
        .iter()
        .map(|a| study::quoted(&a.to_string_lossy()))
        .collect::<Vec<_>>()
        .join(" ");
    let result = match &cli.command {
        Command::Render(args) => render::run(args, &line),
        Command::Compare(args) => compare::run(args),
        Command::Merge(args) => merge::run(args, &line),
        Command::Study(args) => study::run(args, &line),
        Command::Radiosity(args) => radiosity::run(args, &line),
        Command::Info(args) => info::run(args),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "luxel", &mut script);
            // A reader that closed the pipe has seen enough.
            let _ = std::io::stdout().write_all(&script);
            Ok(Outcome::Done)
        }
    };
    match result {
        Ok(outcome) => ExitCode::from(outcome.exit_code()),
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}

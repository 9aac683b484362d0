use std::process::ExitCode;

fn main() -> ExitCode {
    luxel::cli::run(std::env::args_os())
}

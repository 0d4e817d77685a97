//! The `hapterra` command; its code is in the library.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    hapterra::cli::main()
}

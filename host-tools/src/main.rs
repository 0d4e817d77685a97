//! The `hapterra` command; everything it does is in the library.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    hapterra::cli::main()
}

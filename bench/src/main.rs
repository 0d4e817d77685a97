//! `hapterra-lab`; all its code is in the library.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    hapterra_lab::cli::main()
}

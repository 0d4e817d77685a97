//! Messages from the worker to its guardian, one a line.

use std::path::PathBuf;

/// Message to the guardian.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::cli) enum WorkerMessage {
    /// The worker handles signals itself from now on.
    Listening,
    /// A key requested an end.
    Pressed,
    /// The program that sends commands ended, which also requests an end.
    InputEnded,
    /// The device at this address may be armed.
    MayBeArmed(String),
    /// The thread that serves this device has detected the request to end.
    Leaving(String),
    /// The device confirmed that it is disarmed, or the user was informed that it is missing.
    Settled(String),
    /// This file is being written.
    Recording(PathBuf),
}

#[cfg(unix)]
mod lines {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    use super::WorkerMessage;

    impl WorkerMessage {
        /// Returns the line, without its line end.
        pub(in crate::cli) fn line(&self) -> Vec<u8> {
            let (word, rest): (&str, &[u8]) = match self {
                Self::Listening => ("listening", b""),
                Self::Pressed => ("pressed", b""),
                Self::InputEnded => ("ended", b""),
                Self::MayBeArmed(address) => ("armed", address.as_bytes()),
                Self::Leaving(address) => ("leaving", address.as_bytes()),
                Self::Settled(address) => ("settled", address.as_bytes()),
                Self::Recording(path) => ("recording", path.as_os_str().as_bytes()),
            };
            [word.as_bytes(), b" ", rest].concat()
        }

        /// Parses a line; returns `None` if it is no message.
        pub(in crate::cli) fn read(line: &[u8]) -> Option<Self> {
            let space = line.iter().position(|byte| *byte == b' ')?;
            let (word, rest) = (line.get(..space)?, line.get(space + 1..)?);
            let text = || String::from_utf8_lossy(rest).into_owned();
            Some(match word {
                b"listening" => Self::Listening,
                b"pressed" => Self::Pressed,
                b"ended" => Self::InputEnded,
                b"armed" => Self::MayBeArmed(text()),
                b"leaving" => Self::Leaving(text()),
                b"settled" => Self::Settled(text()),
                b"recording" => Self::Recording(OsStr::from_bytes(rest).into()),
                _ => return None,
            })
        }
    }

    #[test]
    fn worker_messages_round_trip() {
        for message in [
            WorkerMessage::Listening,
            WorkerMessage::Pressed,
            WorkerMessage::InputEnded,
            WorkerMessage::MayBeArmed("usb:0039".into()),
            WorkerMessage::Leaving("tcp:localhost:4000".into()),
            WorkerMessage::Settled(String::new()),
            WorkerMessage::Recording("a folder/felt.csv.a1b2c3.partial".into()),
        ] {
            assert_eq!(WorkerMessage::read(&message.line()), Some(message));
        }
        assert_eq!(WorkerMessage::read(b"something else"), None);
        assert_eq!(WorkerMessage::read(b""), None);
    }
}

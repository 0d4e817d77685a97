//! Single keys, without Enter. In raw mode Ctrl-C is read as a key and keeps its usual meaning.

use std::io::{self, Read};
use std::sync::mpsc::SyncSender;

use super::{interrupt, raw_mode};
use crate::steering::keys::Key;

/// Input read by the keyboard's thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pressed {
    /// Enter.
    Enter,
    /// Any other key, which may change the placement.
    Key(Key),
}

/// Reads keys until the terminal is closed.
pub(super) fn read(pressed: &SyncSender<Pressed>) {
    let (mut keys, mut chunk, mut stdin) = (Sequence::default(), [0; 64], io::stdin().lock());
    while let Ok(n @ 1..) = stdin.read(&mut chunk) {
        for byte in chunk.iter().take(n) {
            match keys.push(*byte) {
                Some(Typed::Interrupt) => interrupt::press_key(),
                // Keys beyond the limit are dropped.
                Some(Typed::Pressed(key)) => drop(pressed.try_send(key)),
                None => {}
            }
        }
    }
    raw_mode::restore();
}

/// Meaning of a byte, or of the end of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Typed {
    /// Ctrl-C, or Ctrl-\.
    Interrupt,
    Pressed(Pressed),
}

/// State of a key's sequence. Arrows are `ESC [ A` to `D`, or `ESC O A` to `D`; other sequences are
/// skipped as a whole.
#[derive(Clone, Copy, Debug, Default)]
enum Sequence {
    #[default]
    None,
    Escape,
    Control,
}

impl Sequence {
    fn push(&mut self, byte: u8) -> Option<Typed> {
        let arrow = |east, north| Some(Typed::Pressed(Pressed::Key(Key::Arrow(east, north))));
        match (std::mem::take(self), byte) {
            (_, 0x03 | 0x1C) => Some(Typed::Interrupt),
            (_, 0x1B) => {
                *self = Self::Escape;
                None
            }
            (Self::Escape, b'[' | b'O') => {
                *self = Self::Control;
                None
            }
            // Parameters before the last byte; for an arrow, the modifier keys.
            (Self::Control, 0x20..=0x3F) => {
                *self = Self::Control;
                None
            }
            (Self::Control, b'A') => arrow(0, 1),
            (Self::Control, b'B') => arrow(0, -1),
            (Self::Control, b'C') => arrow(1, 0),
            (Self::Control, b'D') => arrow(-1, 0),
            (Self::Control, _) => None,
            (_, b'\r' | b'\n') => Some(Typed::Pressed(Pressed::Enter)),
            (_, b' '..=b'~') => Some(Typed::Pressed(Pressed::Key(Key::Char(byte.into())))),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(bytes: &[u8]) -> Vec<Typed> {
        let mut keys = Sequence::default();
        bytes.iter().filter_map(|byte| keys.push(*byte)).collect()
    }

    #[test]
    fn characters_and_escape_sequences_decode_to_keys() {
        let key = |key| Typed::Pressed(Pressed::Key(key));
        let arrow = |east, north| key(Key::Arrow(east, north));
        for (bytes, expected) in [
            (
                &b"+ \r\n"[..],
                vec![
                    key(Key::Char('+')),
                    key(Key::Char(' ')),
                    Typed::Pressed(Pressed::Enter),
                    Typed::Pressed(Pressed::Enter),
                ],
            ),
            (
                b"\x1b[A\x1b[B\x1bOC\x1bOD",
                vec![arrow(0, 1), arrow(0, -1), arrow(1, 0), arrow(-1, 0)],
            ),
            // An arrow with Ctrl; a page key, whose digits are no keys.
            (b"\x1b[1;5C\x1b[5~0", vec![arrow(1, 0), key(Key::Char('0'))]),
            (b"\x1b[\x03", vec![Typed::Interrupt]),
            (b"\xc3\xa4\x07\x1b\x1b[A", vec![arrow(0, 1)]),
        ] {
            assert_eq!(typed(bytes), expected, "{bytes:?}");
        }
    }
}

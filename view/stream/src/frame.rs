//! Messages in frames.

use std::io::{self, ErrorKind, Read, Write};

use crate::Message;

/// Max bytes of a frame's body: a layer of the maximum size, and a margin.
pub const MAX_BODY: usize = 16 << 20;

/// Reason why there is no message.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The pipe failed.
    #[error("the stream cannot be read or written: {0}")]
    Io(#[from] io::Error),
    /// The length exceeds [`MAX_BODY`].
    #[error("a frame of {0} bytes, where at most {MAX_BODY} are allowed")]
    TooLong(usize),
    /// The body is no message.
    #[error("a frame is no message of this version: {0}")]
    Body(#[from] postcard::Error),
}

/// Writes a message as one frame, and returns its number of bytes.
///
/// # Errors
/// [`FrameError`]; the stream cannot be continued after an error.
pub fn write(to: &mut dyn Write, message: &Message) -> Result<usize, FrameError> {
    // The length is at the beginning, so that the frame is written at once.
    let mut frame = postcard::to_extend(message, vec![0; 4])?;
    let length = frame.len() - 4;
    if length > MAX_BODY {
        return Err(FrameError::TooLong(length));
    }
    if let Some(head) = frame.first_chunk_mut::<4>() {
        *head = (length as u32).to_le_bytes();
    }
    to.write_all(&frame)?;
    Ok(frame.len())
}

/// Reads the next message; `None` if the stream ends between two frames or within one, as it does
/// when its writer is killed.
///
/// # Errors
/// [`FrameError`].
pub fn read(from: &mut dyn Read) -> Result<Option<Message>, FrameError> {
    let mut head = [0; 4];
    if !filled(from, &mut head)? {
        return Ok(None);
    }
    let length = u32::from_le_bytes(head) as usize;
    if length > MAX_BODY {
        return Err(FrameError::TooLong(length));
    }
    let mut body = vec![0; length];
    match filled(from, &mut body)? {
        true => Ok(Some(postcard::from_bytes(&body)?)),
        false => Ok(None),
    }
}

fn filled(from: &mut dyn Read, bytes: &mut [u8]) -> io::Result<bool> {
    match from.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Hello, Tiles, VERSION};

    fn messages() -> [Message; 3] {
        let hello = Hello {
            version: VERSION,
            program: "1.2.3".into(),
        };
        let tiles = Tiles {
            held: vec![[1, -2], [3, 4]],
            awaited: vec![],
        };
        [Message::Hello(hello), Message::Tiles(tiles), Message::End]
    }

    #[test]
    fn messages_round_trip_in_order_until_the_end() {
        let mut pipe = Vec::new();
        for message in &messages() {
            write(&mut pipe, message).expect("memory");
        }
        let mut rest = pipe.as_slice();
        for message in messages() {
            assert_eq!(read(&mut rest).expect("whole"), Some(message));
        }
        assert_eq!(read(&mut rest).expect("an end"), None);
    }

    #[test]
    fn stream_cut_anywhere_ends() {
        let mut pipe = Vec::new();
        for message in &messages() {
            write(&mut pipe, message).expect("memory");
        }
        for cut in 0..pipe.len() {
            let mut rest = pipe.get(..cut).expect("inside");
            while let Some(message) = read(&mut rest).expect("no message is misread") {
                assert!(messages().contains(&message));
            }
        }
    }

    #[test]
    fn malformed_frame_is_refused_before_allocation() {
        let mut long: &[u8] = &[0xff, 0xff, 0xff, 0x7f, 0];
        assert!(matches!(read(&mut long), Err(FrameError::TooLong(_))));
        let mut nonsense: &[u8] = &[1, 0, 0, 0, 0xee];
        assert!(matches!(read(&mut nonsense), Err(FrameError::Body(_))));
    }
}

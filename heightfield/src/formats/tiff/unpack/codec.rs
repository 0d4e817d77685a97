//! Compressions that can be decompressed as a stream.

use std::io::{self, BufRead, Error, ErrorKind, Read};

use flate2::bufread::ZlibDecoder;
use ruzstd::decoding::StreamingDecoder;
use weezl::decode::{Configuration, Decoder};
use weezl::{BitOrder, LzwStatus};

/// Returns true if a compression code can be decompressed as a stream. LERC cannot: it stores bits
/// of all samples of a chunk apart from their values.
pub(super) const fn is_known(code: u16) -> bool {
    matches!(code, 1 | 5 | 8 | 32773 | 32946 | 50000)
}

/// Decompresses bytes by the compression's code.
pub(super) fn unpacked<'f>(code: u16, packed: impl BufRead + 'f) -> io::Result<Box<dyn Read + 'f>> {
    Ok(match code {
        1 => Box::new(packed),
        5 => Box::new(Lzw::new(packed)),
        8 | 32946 => Box::new(ZlibDecoder::new(packed)),
        32773 => Box::new(PackBits::new(packed)),
        50000 => Box::new(StreamingDecoder::new(packed).map_err(Error::other)?),
        _ => return Err(ErrorKind::Unsupported.into()),
    })
}

/// LZW in TIFF's variant, the most significant bit first.
struct Lzw<R> {
    packed: R,
    decoder: Decoder,
}

impl<R: BufRead> Lzw<R> {
    fn new(packed: R) -> Self {
        let decoder = Configuration::with_tiff_size_switch(BitOrder::Msb, 8)
            .with_yield_on_full_buffer(true)
            .build();
        Self { packed, decoder }
    }
}

impl<R: BufRead> Read for Lzw<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        // Each pass consumes or returns bytes, or is the last.
        loop {
            let packed = self.packed.fill_buf()?;
            let is_over = packed.is_empty();
            let done = self.decoder.decode_bytes(packed, into);
            self.packed.consume(done.consumed_in);
            if done.consumed_out > 0 || into.is_empty() {
                return Ok(done.consumed_out);
            }
            match done.status {
                Err(error) => return Err(Error::new(ErrorKind::InvalidData, error)),
                Ok(LzwStatus::Done) => return Ok(0),
                Ok(_) if is_over => return Ok(0),
                Ok(_) if done.consumed_in == 0 => {
                    return Err(Error::new(ErrorKind::InvalidData, "it does not continue"));
                }
                Ok(_) => {}
            }
        }
    }
}

/// Runs of equal bytes, and of different ones.
struct PackBits<R> {
    packed: R,
    run: Run,
}

/// Rest of a run.
enum Run {
    Literal(usize),
    Repeat(usize, u8),
}

impl<R: BufRead> PackBits<R> {
    const fn new(packed: R) -> Self {
        let run = Run::Literal(0);
        Self { packed, run }
    }

    fn byte(&mut self) -> io::Result<Option<u8>> {
        let byte = self.packed.fill_buf()?.first().copied();
        self.packed.consume(usize::from(byte.is_some()));
        Ok(byte)
    }

    /// Reads the next run that is not empty; `None` at the end.
    fn next(&mut self) -> io::Result<Option<Run>> {
        let cut = || Error::new(ErrorKind::UnexpectedEof, "it ends in a run");
        while let Some(head) = self.byte()? {
            match head {
                // This code has no effect.
                128 => {}
                0..=127 => return Ok(Some(Run::Literal(usize::from(head) + 1))),
                _ => {
                    let byte = self.byte()?.ok_or_else(cut)?;
                    return Ok(Some(Run::Repeat(257 - usize::from(head), byte)));
                }
            }
        }
        Ok(None)
    }
}

impl<R: BufRead> Read for PackBits<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if matches!(self.run, Run::Literal(0) | Run::Repeat(0, _)) {
            match self.next()? {
                Some(run) => self.run = run,
                None => return Ok(0),
            }
        }
        match &mut self.run {
            Run::Literal(left) => {
                let count = into.len().min(*left);
                let count = self.packed.read(&mut into[..count])?;
                *left -= count;
                Ok(count)
            }
            Run::Repeat(left, byte) => {
                let count = into.len().min(*left);
                into[..count].fill(*byte);
                *left -= count;
                Ok(count)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decompresses input in small pieces, with reads of other sizes.
    fn all(code: u16, packed: &[u8]) -> io::Result<Vec<u8>> {
        let pieces = io::BufReader::with_capacity(3, packed);
        let mut from = unpacked(code, pieces)?;
        let (mut found, mut piece) = (vec![], [0; 5]);
        loop {
            match from.read(&mut piece)? {
                0 => return Ok(found),
                count => found.extend(&piece[..count]),
            }
        }
    }

    #[test]
    fn packbits_runs_continue_across_chunks() {
        // The example of the TIFF specification, with a code without effect.
        let packed = b"\xfe\xaa\x02\x80\x00\x2a\x80\xfd\xaa\x03\x80\x00\x2a\x22\xf7\xaa";
        let found = all(32773, packed).expect("unpacked");
        let expected = b"\xaa\xaa\xaa\x80\x00\x2a\xaa\xaa\xaa\xaa\x80\x00\x2a\x22";
        assert_eq!(found, [&expected[..], &[0xaa; 10]].concat());
        assert!(all(32773, b"\xfe").is_err());
    }

    #[test]
    fn lzw_continues_across_chunks_and_keeps_truncated_prefix() {
        let bytes: Vec<u8> = (0..40_000_u32)
            .map(|index| ((index * index) >> 7) as u8)
            .collect();
        let mut encoder = weezl::encode::Encoder::with_tiff_size_switch(BitOrder::Msb, 8);
        let packed = encoder.encode(&bytes).expect("packed");
        assert!(all(5, &packed).expect("unpacked") == bytes);
        let cut = all(5, &packed[..packed.len() / 2]).expect("what is there");
        assert!(!cut.is_empty() && bytes.starts_with(&cut));
        assert!(all(5, &[0xff; 64]).is_err());
    }

    #[test]
    fn unknown_compression_codes_are_unsupported() {
        for code in 0..=u16::MAX {
            let is_unsupported =
                unpacked(code, &[][..]).is_err_and(|error| error.kind() == ErrorKind::Unsupported);
            assert_eq!(is_unsupported, !is_known(code), "{code}");
        }
    }
}

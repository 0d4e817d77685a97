//! Names and bytes of coarse samples in the disk cache.
//!
//! A piece is stored as one bit per sample, set if the sample is known, from the lowest bit of the
//! first byte on, and the values: as `f32` if that is exact for all of them, else as `f64`,
//! little-endian.

use super::cache::Key;
use super::coarse::Piece;
use super::{Block, BlockImage, BlockReader};
use crate::disk_cache::{DiskCache, Name};

/// Min step of native images that are saved: the samples of finer ones are adjacent in the file.
const MIN_SAVED_STEP: u32 = 8;

/// Returns true if blocks of an image are saved on disk, and read in the background.
pub(super) fn is_coarse(image: &BlockImage) -> bool {
    image.every.is_some_and(|every| every >= MIN_SAVED_STEP)
}

/// Returns the name of a piece of a coarse image in the present state of the file; `None` if
/// nothing may be saved.
pub(super) fn name(reader: &dyn BlockReader, image: &BlockImage, key: &Key) -> Option<Name> {
    let part = image.part(key.at);
    // Computed samples depend on the part of the full image that they cover.
    let native = key.image.min(reader.images().len() - 1);
    let stamp = reader.stamp(native, &part)?;
    let place = format!("{:?} {:?} {:?}", image.every, image.first, part);
    Some(Name::of(&["coarse", reader.format(), &stamp, &place]))
}

/// Loads a saved piece of `samples` samples.
pub(super) fn load(cache: &DiskCache, name: &Name, samples: usize) -> Option<Piece> {
    decoded(&cache.get(name)?, samples)
}

/// Saves a piece, merged with the one on disk.
pub(super) fn save(cache: &DiskCache, name: &Name, mut piece: Piece) {
    let samples = piece.values.len();
    if let Some(on_disk) = load(cache, name, samples) {
        if piece.known.is_subset(&on_disk.known) {
            return;
        }
        piece.join(&on_disk);
    }
    cache.put(name, &encoded(&piece));
}

/// Returns a block as a piece with all samples known.
pub(super) fn piece_of(block: Option<&Block>, samples: usize) -> Piece {
    let mut piece = Piece::unknown(samples);
    let value = |index: usize| block.and_then(|block| block.stored(index));
    piece.values = (0..samples)
        .map(|index| value(index).unwrap_or(f64::NAN))
        .collect();
    piece.known.insert_range(..);
    piece
}

/// Returns the block of a piece if all samples are known.
pub(super) fn block_of(piece: Piece) -> Option<Block> {
    piece.known.is_full().then(|| Block {
        samples: piece.values.into(),
        no_data_mask: None,
        is_incomplete: false,
    })
}

fn encoded(piece: &Piece) -> Vec<u8> {
    let mut bytes = vec![0_u8; piece.values.len().div_ceil(8)];
    for index in piece.known.ones() {
        bytes[index / 8] |= 1 << (index % 8);
    }
    let values = || piece.values.iter().copied();
    let fits = |value: f64| value.is_nan() || f64::from(value as f32).to_bits() == value.to_bits();
    match values().all(fits) {
        true => bytes.extend(values().flat_map(|value| (value as f32).to_le_bytes())),
        false => bytes.extend(values().flat_map(f64::to_le_bytes)),
    }
    bytes
}

fn decoded(bytes: &[u8], samples: usize) -> Option<Piece> {
    let (known, values) = bytes.split_at_checked(samples.div_ceil(8))?;
    let mut piece = Piece::unknown(samples);
    let is_known = |index: &usize| known[index / 8] & (1 << (index % 8)) != 0;
    piece.known.extend((0..samples).filter(is_known));
    piece.values = if values.len() == 4 * samples {
        let each = values.chunks_exact(4).flat_map(<[u8; 4]>::try_from);
        each.map(|bytes| f64::from(f32::from_le_bytes(bytes)))
            .collect()
    } else if values.len() == 8 * samples {
        let each = values.chunks_exact(8).flat_map(<[u8; 8]>::try_from);
        each.map(f64::from_le_bytes).collect()
    } else {
        return None;
    };
    Some(piece)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(values: &[f64]) -> Piece {
        let mut piece = Piece::unknown(values.len());
        for (index, value) in values.iter().enumerate().skip(1) {
            piece.values[index] = *value;
            piece.known.insert(index);
        }
        piece
    }

    #[test]
    fn encoded_piece_round_trips_exactly_in_few_bytes() {
        for (values, bytes) in [
            (&[0.0, -0.0, 1.5, f64::from(f32::MIN_POSITIVE), 3e9][..], 4),
            (
                &[0.0, 0.1, 2.0, 1e300, f64::MIN_POSITIVE, 5.0, 6.0, 7.0, 8.0],
                8,
            ),
        ] {
            let piece = piece(values);
            let encoded = encoded(&piece);
            assert_eq!(
                encoded.len(),
                values.len().div_ceil(8) + bytes * values.len()
            );
            let back = decoded(&encoded, values.len()).expect("whole");
            assert_eq!(back.known, piece.known);
            let bits =
                |piece: &Piece| Vec::from_iter(piece.values[1..].iter().map(|v| v.to_bits()));
            assert_eq!(bits(&back), bits(&piece));
            assert!(back.values[0].is_nan(), "unknown samples are not stored");
            for other in [0, 1, encoded.len() - 1] {
                assert!(decoded(&encoded[..other], values.len()).is_none());
            }
        }
    }

    #[test]
    fn join_merges_the_known_samples_of_both_pieces() {
        let mut one = piece(&[1.0, 2.0, 3.0]);
        let mut other = Piece::unknown(3);
        (other.values[0], other.values[1]) = (7.0, 9.0);
        other.known.insert(0);
        one.join(&other);
        assert_eq!(one.values, [7.0, 2.0, 3.0]);
        assert!(one.known.is_full());
    }
}

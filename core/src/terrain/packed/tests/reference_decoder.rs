//! A second reader, written only from the module's specification of the bytes; slow and simple.

use std::vec::Vec;

/// Maximum height that can be addressed.
const MAX: f32 = 536_870_912.0;

struct Bits(Vec<bool>, usize);

impl Bits {
    fn bit(&mut self) -> bool {
        self.1 += 1;
        self.0.get(self.1 - 1).copied().unwrap_or(false)
    }

    fn number(&mut self, count: u32) -> u64 {
        (0..count).fold(0, |number, _| 2 * number + u64::from(self.bit()))
    }

    fn zeros(&mut self, max: u32) -> u32 {
        let mut zeros = 0;
        while zeros < max && !self.bit() {
            zeros += 1;
        }
        zeros
    }
}

fn int(bytes: &[u8]) -> i64 {
    let top = bytes.len() * 8;
    let number = (0..)
        .zip(bytes)
        .map(|(i, byte)| i128::from(*byte) << (8 * i));
    let number: i128 = number.sum();
    let below_zero = number >> (top - 1) == 1;
    (number - if below_zero { 1 << top } else { 0 }) as i64
}

/// Decodes packed bytes into the bits of the heights.
pub(super) fn heights(bytes: &[u8]) -> Vec<u32> {
    let (kind, lines) = (bytes[0], usize::from(bytes[0] & 3));
    let line = |i: usize| {
        let at = &bytes[5 + 17 * i..][..17];
        (int(&at[..1]), int(&at[1..9]), int(&at[9..]))
    };
    let lines: Vec<(i64, i64, i64)> = (0..lines).map(line).collect();
    let codes = &bytes[5 + 17 * lines.len()..];
    let bits = codes
        .iter()
        .flat_map(|byte| (0..8).rev().map(move |i| byte >> i & 1 == 1));
    let mut bits = Bits(bits.collect(), 0);

    let mut is_gap = kind & 4 != 0 && !bits.bit();
    let mut remaining = if kind & 4 == 0 { 1089 } else { 0 };
    let mut mean = 16_u64 << (kind >> 3);
    let mut numbers = [[0_i32; 33]; 33];
    let mut heights = Vec::new();
    for row in 0..33 {
        for col in 0..33 {
            if remaining == 0 {
                is_gap = !is_gap;
                let zeros = bits.zeros(15);
                remaining = (1 << zeros) + bits.number(zeros);
            }
            remaining -= 1;
            let predicted = match (row, col) {
                (0, 0) => int(&bytes[1..5]) as i32,
                (0, _) => numbers[0][col - 1],
                (_, 0) => numbers[row - 1][0],
                _ => numbers[row][col - 1]
                    .wrapping_add(numbers[row - 1][col])
                    .wrapping_sub(numbers[row - 1][col - 1]),
            };
            if is_gap {
                numbers[row][col] = match (row, col) {
                    (0, 0) => predicted,
                    (_, 0) => numbers[row - 1][0],
                    _ => numbers[row][col - 1],
                };
                heights.push(f32::NAN.to_bits());
                continue;
            }
            let parameter = (mean >> 4).max(1).ilog2();
            let u = match bits.zeros(20) {
                20 => bits.number(32),
                zeros => (u64::from(zeros) << parameter) + bits.number(parameter),
            };
            mean = mean - (mean >> 4) + u.min(1 << 27);
            let difference = match u % 2 {
                0 => (u / 2) as i64,
                _ => -((u as i64 + 1) / 2),
            };
            let number = predicted.wrapping_add(difference as i32);
            numbers[row][col] = number;
            let height = height(number, &lines);
            let stored = if height.abs() <= MAX {
                height
            } else {
                f32::NAN
            };
            heights.push(stored.to_bits());
        }
    }
    heights
}

fn height(number: i32, lines: &[(i64, i64, i64)]) -> f32 {
    let on = |number: i32, (exponent, offset, step): (i64, i64, i64)| {
        let sum = offset.wrapping_add(step.wrapping_mul(i64::from(number)));
        (sum as f32) * 2_f32.powi(-exponent as i32)
    };
    match lines {
        [] if number < 0 => f32::from_bits((number as u32 & 0x7FFF_FFFF) ^ 0x7FFF_FFFF | 1 << 31),
        [] => f32::from_bits(number as u32),
        [line] => on(number, *line),
        [first, second, ..] => on(on(number, *first) as i32, *second),
    }
}

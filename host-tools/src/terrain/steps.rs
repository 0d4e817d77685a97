//! The step of which a file's heights are multiples: it makes their tiles small on the link.

use hapterra_core::terrain::packed::HeightStep;

/// Decimal units of heights in files, besides whole ones.
const DECIMALS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];
/// Number of decimals that single precision resolves at the heights of mountains.
const SINGLES: usize = 3;
/// Exponent of the binary unit below which decimals are tried.
const COARSE: i32 = -4;

/// The largest power of two of which numbers are multiples.
#[derive(Clone, Copy)]
pub(super) struct BinaryUnit(i32);

impl BinaryUnit {
    /// The unit of no numbers.
    pub(super) const ANY: Self = Self(i32::MAX);

    /// Returns the unit after another number. Infinite numbers and NaN are ignored.
    pub(super) fn with(self, height: f64) -> Self {
        let bits = height.to_bits();
        let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
        let exponent = (bits >> 52 & 0x7ff) as i32 - 1075;
        match height.is_normal() {
            true => Self(self.0.min(exponent + mantissa.trailing_zeros() as i32)),
            false => self,
        }
    }
}

/// Returns the possible steps of heights with a unit, the largest first, if a vertical unit is
/// `cells` cells.
pub(super) fn steps(unit: BinaryUnit, cells: f64) -> impl Iterator<Item = HeightStep> {
    let binary = f64::from(unit.0.min(0)).exp2();
    let decimals = DECIMALS
        .into_iter()
        .filter(move |decimal| *decimal > binary);
    let singles = decimals.clone().take(SINGLES);
    let decimals = decimals.map(move |unit| HeightStep::Cells(unit * cells));
    let singles = singles.map(move |unit| HeightStep::Single { unit, cells });
    let fine = unit.0 < COARSE;
    let decimals = decimals.chain(singles).filter(move |_| fine);
    decimals.chain([HeightStep::Cells(binary * cells)])
}

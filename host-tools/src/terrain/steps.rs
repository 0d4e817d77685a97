//! Of what the heights of a file are multiples: what makes their tiles small on the link.

use hapterra_core::terrain::packed::Step;

/// Decimal units that files have their heights in, besides whole ones.
const DECIMALS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];
/// Decimals that single precision tells apart at the heights of mountains.
const SINGLES: usize = 3;
/// A binary unit no finer than this is taken before decimals are tried.
const COARSE: i32 = -4;

/// The largest power of two that numbers are multiples of.
#[derive(Clone, Copy)]
pub(super) struct BinaryUnit(i32);

impl BinaryUnit {
    /// Of no number.
    pub(super) const ANY: Self = Self(i32::MAX);

    /// With another number. Infinite ones and NaN do not count.
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

/// Steps that heights with such a unit may have, the largest first, where a vertical unit
/// is so many `cells`.
pub(super) fn steps(unit: BinaryUnit, cells: f64) -> impl Iterator<Item = Step> {
    let binary = f64::from(unit.0.min(0)).exp2();
    let decimals = DECIMALS
        .into_iter()
        .filter(move |decimal| *decimal > binary);
    let singles = decimals.clone().take(SINGLES);
    let decimals = decimals.map(move |unit| Step::Cells(unit * cells));
    let singles = singles.map(move |unit| Step::Single { unit, cells });
    let fine = unit.0 < COARSE;
    let decimals = decimals.chain(singles).filter(move |_| fine);
    decimals.chain([Step::Cells(binary * cells)])
}

//! A loader's description of its flash: `@Internal Flash  /0x08000000/256*02Kg`. It has a name, the
//! first address, and runs of pages (UM0424, 4.3.2).

use super::error::UpdateError;

/// Maximum number of pages; the largest STM32 has fewer.
const MAX_PAGES: u64 = 4096;

/// The flash of a loader: consecutive pages of one size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The loader's text, to display: only its printable ASCII.
    pub description: String,
    /// First address.
    pub start: u64,
    /// Bytes of a page.
    pub page_bytes: u64,
    /// Number of pages.
    pub pages: u64,
}

impl Layout {
    /// Parses a loader's description.
    ///
    /// # Errors
    /// [`UpdateError::Layout`] unless it is one block of pages of one size that can be read, erased
    /// and written.
    pub fn read(description: &str) -> Result<Self, UpdateError> {
        let printable = |c: &char| c.is_ascii_graphic() || *c == ' ';
        let description: String = description.chars().filter(printable).take(100).collect();
        Self::parse(&description).ok_or(UpdateError::Layout(description))
    }

    fn parse(description: &str) -> Option<Self> {
        let mut fields = description.strip_prefix('@')?.split('/');
        let (_name, address, runs) = (fields.next()?, fields.next()?, fields.next()?);
        if fields.next().is_some() {
            return None;
        }
        let start = u64::from_str_radix(address.trim().strip_prefix("0x")?, 16).ok()?;
        let runs: Option<Vec<_>> = runs.split(',').map(run).collect();
        let runs = runs?;
        let (_, page_bytes) = *runs.first()?;
        let pages = runs.iter().map(|(pages, _)| pages).sum();
        let even = runs.iter().all(|(_, bytes)| *bytes == page_bytes);
        let believed = even && page_bytes > 0 && (1..=MAX_PAGES).contains(&pages);
        believed.then(|| Self {
            description: description.to_owned(),
            start,
            page_bytes,
            pages,
        })
    }
}

/// Parses a run of pages such as `256*02Kg`: their number, and the bytes of each.
fn run(text: &str) -> Option<(u64, u64)> {
    let (pages, size) = text.trim().split_once('*')?;
    let digits = size.len() - size.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let (number, unit) = size.split_at_checked(digits)?;
    // The low bits of the last letter are the permissions: bit 0 read, 1 erase, 2 write.
    let scale = match unit {
        "Kg" => 1024,
        "Mg" => 1024 * 1024,
        " g" | "Bg" => 1,
        _ => return None,
    };
    let pages: u64 = pages.trim().parse().ok().filter(|n| *n <= MAX_PAGES)?;
    let bytes: u64 = number.parse().ok().filter(|n| *n <= 1024 * 1024)?;
    Some((pages, bytes * scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_of_both_chips_are_parsed() {
        let read = |description| {
            Layout::read(description)
                .map(|l| (l.start, l.page_bytes, l.pages))
                .ok()
        };
        let g474 = "@Internal Flash   /0x08000000/256*02Kg";
        assert_eq!(read(g474), Some((0x0800_0000, 2048, 256)));
        let h743 = "@Internal Flash   /0x08000000/8*128Kg,8*128Kg";
        assert_eq!(read(h743), Some((0x0800_0000, 131_072, 16)));
    }

    #[test]
    fn malformed_flash_layout_is_refused_without_panic() {
        for description in [
            "",
            "@",
            "@Option Bytes   /0x1FF22000/01*048 e",
            "@OTP Memory /0x1FFF7000/01*0001Ke",
            "@Internal Flash /0x08000000",
            "@Internal Flash /0x08000000/",
            "@Internal Flash /0x08000000/*",
            "@Internal Flash /0x08000000/4*016Kg,1*064Kg",
            "@Internal Flash /0x08000000/99999999999999999999*02Kg",
            "@Internal Flash /0x08000000/4294967295*4294967295Mg",
            "@Internal Flash /08000000/256*02Kg",
            "@Internal Flash /0x08000000/256*02Kg/0x1FFF0000/1*2Kg",
            "@Internal Flash /0x08000000/256*0\u{e9}g",
            "@Internal Flash /0x08000000/256*02Ka",
        ] {
            assert!(Layout::read(description).is_err(), "{description:?}");
        }
    }

    #[test]
    fn control_characters_from_a_loader_are_removed() {
        let Err(UpdateError::Layout(description)) = Layout::read("@\u{1b}[2J\r\nFlash\u{202e}")
        else {
            panic!("refused");
        };
        assert_eq!(description, "@[2JFlash");
    }
}

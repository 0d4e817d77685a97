//! Functions of the tick that an H743 runs from flash, by the linker script.

const SCRIPT: &str = include_str!("../../../firmware/memory/nucleo-h743zi2.x");
/// Markers around the patterns.
const LIST_START: &str = "_tick_in_flash_start = .;";
const LIST_END: &str = "_tick_in_flash_end = .;";

/// Returns true if the function of this mangled name stays in flash.
#[must_use]
pub fn is_in_flash(name: &str) -> bool {
    patterns().any(|pattern| fits(name, pattern))
}

/// Returns the patterns without the prefix that all code sections share.
fn patterns() -> impl Iterator<Item = &'static str> {
    let list = SCRIPT
        .split(LIST_START)
        .nth(1)
        .and_then(|s| s.split(LIST_END).next());
    let lines = list.unwrap_or_default().lines();
    lines.filter_map(|line| line.trim().strip_prefix("*(.text.")?.strip_suffix(')'))
}

/// Returns true if a name matches a pattern whose only special character is `*`, at both ends.
fn fits(name: &str, pattern: &str) -> bool {
    let parts = pattern.split('*').filter(|part| !part.is_empty());
    let behind = |rest: Option<usize>, part: &str| {
        let rest = rest?;
        let at = name.get(rest..)?.find(part)?;
        Some(rest + at + part.len())
    };
    parts.fold(Some(0), behind).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn script_patterns_match_only_functions_left_in_flash() {
        assert!(patterns().count() > 10);
        for pattern in patterns() {
            assert!(
                pattern.starts_with('*') && pattern.ends_with('*'),
                "{pattern}"
            );
        }
        assert!(is_in_flash(
            "_ZN13hapterra_core7haptics16Haptics$LT$_$GT$9set_scene17h9bE"
        ));
        assert!(!is_in_flash(
            "_ZN13hapterra_core4feel4Feel12with_effects17h8c6b8f46a38d6445E"
        ));
        assert!(!is_in_flash("memcpy"));
    }
}

//! Level of detail of a rendered terrain.

use std::fmt;
use std::str::FromStr;

/// The text for a level that follows the hand's speed.
const BY_SPEED: &str = "by-speed";

/// Level of detail of a rendered terrain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LevelChoice {
    /// This level.
    Fixed(u8),
    /// Finer while the hand is slow, and coarser while it is fast.
    BySpeed,
}

impl FromStr for LevelChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            BY_SPEED => Ok(Self::BySpeed),
            number => {
                let level = number.parse().map(Self::Fixed);
                level.map_err(|_| format!("a whole number such as 2, or {BY_SPEED}"))
            }
        }
    }
}

impl fmt::Display for LevelChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed(level) => write!(f, "{level}"),
            Self::BySpeed => f.write_str(BY_SPEED),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::options::rendering::Rendering;

    #[test]
    fn level_by_speed_needs_a_hand() {
        for (level, is_valid) in [
            (Some(LevelChoice::BySpeed), false),
            (Some(LevelChoice::Fixed(2)), true),
            (None, true),
        ] {
            let rendering = Rendering {
                level,
                ..Rendering::default()
            };
            assert_eq!(rendering.check_level_without_hand().is_ok(), is_valid);
        }
    }

    #[test]
    fn levels_are_parsed() {
        for (text, expected) in [
            ("3", LevelChoice::Fixed(3)),
            ("by-speed", LevelChoice::BySpeed),
        ] {
            assert_eq!(text.parse(), Ok(expected));
            assert_eq!(expected.to_string().parse(), Ok(expected));
        }
        for bad in ["fast", "-1", "256", "", "1.5"] {
            assert!(bad.parse::<LevelChoice>().is_err(), "{bad}");
        }
    }
}

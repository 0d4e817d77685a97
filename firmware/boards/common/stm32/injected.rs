//! Three conversions that one tick starts and the next tick reads: an injected sequence of a
//! converter. embassy does not support injected sequences on both chips, and a tick must not wait
//! for a conversion.

use embassy_stm32::pac::adc::Adc;

use crate::chip::{DUMMY_CONVERSIONS, MONITOR_SHIFT};

/// The injected sequence of a converter that embassy has configured.
#[derive(Clone, Copy)]
pub(crate) struct Injected(pub(crate) Adc);

impl Injected {
    /// Configures the three channels, in the order of their results. Starts nothing.
    pub(crate) fn set_up(self, channels: [u8; 3]) {
        // The program starts each sequence; sequences are not queued.
        self.0.cfgr().modify(|w| w.set_jqdis(true));
        self.0.jsqr().write(|w| {
            w.set_jl((DUMMY_CONVERSIONS + 2) as u8);
            // A dummy conversion may be of any channel.
            w.set_jsq(0, channels[0]);
            for (n, channel) in channels.into_iter().enumerate() {
                w.set_jsq(DUMMY_CONVERSIONS + n, channel);
            }
        });
    }

    /// Starts the conversions.
    pub(crate) fn start(self) {
        self.0.cr().modify(|w| w.set_jadstart(true));
    }

    /// Returns the 12-bit codes of the conversions that have ended since the last call; `None` if
    /// they have not ended.
    pub(crate) fn read(self) -> Option<[u16; 3]> {
        let is_done = self.0.isr().read().jeos();
        // Writing 1 clears the flag.
        self.0.isr().write(|w| w.set_jeos(true));
        let code = |n| (self.0.jdr(DUMMY_CONVERSIONS + n).read().0 >> MONITOR_SHIFT) as u16;
        is_done.then_some([code(0), code(1), code(2)])
    }
}

//! Where the loop needs terrain, from what it recorded.

use hapterra_core::terrain::Focus;

use crate::channels::Record;

/// The focus after `record`, which followed `previous`. Its velocity is that of
/// a millisecond, which is what the puller counts time in, whatever the tick.
pub(crate) fn follow(previous: &Record, record: &Record, ticks_per_ms: u32) -> Focus {
    let (last, sample) = (&previous.sample, &record.sample);
    let ticks = sample.tick.wrapping_sub(last.tick);
    // A new scene counts its ticks from one again: no velocity from that.
    let moved = if ticks == 0 || ticks > 100 * ticks_per_ms {
        [0.0; 2]
    } else {
        let step = last.hip.to(&sample.hip) * (ticks_per_ms as f32 / ticks as f32);
        [step.x, step.y]
    };
    Focus {
        held_up_by: sample.held_up_by,
        proxy: sample.proxy.column(),
        hip: sample.hip.column(),
        velocity: moved,
    }
}

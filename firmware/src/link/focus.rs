//! Where the loop needs terrain, from what it recorded.

use hapterra_core::terrain::Focus;

use crate::channels::Record;

/// The focus after `record`, which followed `previous`.
pub(crate) fn follow(previous: &Record, record: &Record) -> Focus {
    let (last, sample) = (&previous.sample, &record.sample);
    let ticks = sample.tick.wrapping_sub(last.tick);
    // A new scene counts its ticks from one again: no velocity from that.
    let moved = if ticks == 0 || ticks > 100 {
        [0.0; 2]
    } else {
        let step = last.hip.to(&sample.hip) / ticks as f32;
        [step.x, step.y]
    };
    Focus {
        held_up_by: sample.held_up_by,
        proxy: sample.proxy.column(),
        hip: sample.hip.column(),
        velocity: moved,
    }
}

//! Points to a device and back, one at a time.

use std::time::{Duration, Instant, SystemTime};

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{HipCommand, SceneChange, Source, TickRecord};
use hapterra_core::terrain::TILE_CELLS;
use hapterra_core::wire::hello::DeviceHello;

use super::published::Published;
use crate::link::{Event, LinkError, LinkStats, Session, Timeouts, Transport};
use crate::terrain::Terrain;

/// A point may take so many times what an answer may take before the device counts as
/// stuck.
const ANSWERS_A_POINT: u32 = 8;

/// Feels points on a device, in a scene of its own.
pub struct OfflineDevice<'t> {
    terrain: Terrain<'t>,
    /// Tells the epochs of this replay from those of another.
    nonce: u32,
    /// Number of the view that is rendered.
    view: u8,
    session: Session<'t>,
    device: DeviceHello,
    seq: u32,
    published: Option<Published<'t>>,
    last: Option<GridPoint>,
}

impl<'t> OfflineDevice<'t> {
    /// Puts a fresh scene in force on a device.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn open(
        terrain: &'t Terrain<'t>,
        params: SurfaceParams,
        transport: Box<dyn Transport + 't>,
        patience: Timeouts,
    ) -> Result<Self, LinkError> {
        let mut scene = terrain.scene(params, Source::Points, GridPoint::default());
        // A device that holds the scene of an earlier replay would continue from
        // where that ended.
        let nonce = nonce();
        scene.epoch ^= nonce;
        let (session, device) = Session::open(terrain, scene, None, transport, patience)?;
        Ok(Self {
            terrain: terrain.clone(),
            nonce,
            view: 0,
            session,
            device,
            seq: 0,
            published: None,
            last: None,
        })
    }

    /// Renders the points by the paper's rule on the host from now on, and not on the device.
    #[must_use]
    pub fn by_published_rule(mut self, params: SurfaceParams) -> Self {
        self.published = Some(Published::new(self.terrain.clone(), params));
        self
    }

    /// The terrain that is rendered.
    #[must_use]
    pub const fn terrain(&self) -> &Terrain<'t> {
        &self.terrain
    }

    /// Goes over to another view of the terrain, with the HIP at a place in it next. A proxy
    /// that touches begins there on the surface, as it does on an arm.
    ///
    /// # Errors
    /// [`LinkError`]; the replay cannot continue after one.
    pub fn put_view(
        &mut self,
        terrain: Terrain<'t>,
        params: SurfaceParams,
        hip: GridPoint,
    ) -> Result<(), LinkError> {
        self.view = self.view.wrapping_add(1);
        self.last = None;
        let mut scene = terrain.scene(params, Source::Points, GridPoint::default());
        // One that comes again is another one.
        scene.epoch ^= self.nonce.rotate_left(8) ^ u32::from(self.view);
        let view = SceneChange {
            number: self.view,
            scene,
            hip,
            keeps_tiles: terrain.has_tiles_of(&self.terrain),
        };
        self.terrain = terrain.clone();
        if self.published.is_some() {
            self.published = Some(Published::new(terrain.clone(), params));
        }
        self.session.put_view(view, terrain)?;
        let deadline = Instant::now() + 2 * self.session.patience().give_up;
        while Instant::now() < deadline {
            let (mut answer, wait) = (None, Duration::from_millis(100));
            self.session.poll(wait, &mut |event| {
                if let Event::Viewed { taken, .. } = event {
                    answer = Some(taken);
                }
            })?;
            match answer {
                Some(true) => return Ok(()),
                Some(false) => return Err(LinkError::SceneRefused),
                None => {}
            }
        }
        Err(LinkError::Stuck(self.seq))
    }

    /// The device that feels it.
    #[must_use]
    pub const fn device(&self) -> &DeviceHello {
        &self.device
    }

    /// Returns true if a HIP is more than a window of the device away from the last one.
    #[must_use]
    pub fn is_leap_to(&self, hip: &GridPoint) -> bool {
        let window = u32::from(self.device.window) * TILE_CELLS as u32;
        self.last.is_some_and(|last| {
            let (from, to) = (last.column(), hip.column());
            from.x.abs_diff(to.x).max(from.y.abs_diff(to.y)) > window
        })
    }

    /// Returns the link's statistics.
    #[must_use]
    pub const fn tally(&self) -> &LinkStats {
        self.session.tally()
    }

    /// Steps the loop with the HIP at `hip` and returns its record.
    ///
    /// # Errors
    /// [`LinkError`]; the replay cannot continue after one.
    pub fn step(&mut self, hip: GridPoint) -> Result<TickRecord, LinkError> {
        self.last = Some(hip);
        let seq = self.seq;
        self.seq = seq.wrapping_add(1);
        if let Some(published) = &mut self.published {
            let sample = published.step(hip);
            return Ok(TickRecord {
                tick: seq,
                view: self.view,
                ..sample
            });
        }
        self.session.step(HipCommand { seq, hip })?;
        let deadline = Instant::now() + ANSWERS_A_POINT * self.session.patience().give_up;
        while Instant::now() < deadline {
            if let Some(sample) = self.answer(seq)? {
                return Ok(sample);
            }
        }
        Err(LinkError::Stuck(seq))
    }

    /// The answer to a point, if it comes soon.
    fn answer(&mut self, expected: u32) -> Result<Option<TickRecord>, LinkError> {
        let (mut answer, mut restarted) = (None, false);
        let wait = Duration::from_millis(100);
        self.session.poll(wait, &mut |event| match event {
            Event::Rendered { seq, sample } if seq == expected => answer = Some(*sample),
            Event::Opened { resumed, .. } => restarted = !resumed,
            _ => {}
        })?;
        match restarted {
            true => Err(LinkError::Restarted),
            false => Ok(answer),
        }
    }

    /// Ends the session; an emulated board ends its program.
    ///
    /// # Errors
    /// [`LinkError::NotConfirmed`].
    pub fn say_goodbye(&mut self) -> Result<(), LinkError> {
        self.session.say_goodbye(&mut |_| {})
    }
}

/// A number that the last replay did not have.
fn nonce() -> u32 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    now.map_or(0, |now| now.as_nanos() as u32) | 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::on_native;
    use crate::terrain::Scale;
    use heightfield::Raster;

    /// A device takes a view that has the next number, and a tile that has the epoch of the
    /// view: one that comes again is another one, also when the numbers begin again.
    #[test]
    fn every_view_has_the_next_number_and_an_epoch_of_its_own() {
        let raster = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
        let scale = Scale::new(1.0, 1.0).expect("scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let (params, hip) = (SurfaceParams::PREMIUM, GridPoint::default());
        let mut replayer = on_native(&terrain, params).expect("opened");
        let (mut epochs, mut last) = (std::collections::HashSet::new(), 0);
        for view in 0..300_u32 {
            if view > 0 {
                let again = terrain.clone();
                replayer.put_view(again, params, hip).expect("taken");
            }
            let sample = replayer.step(hip).expect("rendered");
            assert_eq!(u32::from(sample.view), view % 256);
            let epoch = replayer.session.scene().epoch;
            assert!(view == 0 || epoch != last, "view {view}");
            epochs.insert(epoch);
            last = epoch;
        }
        // As many as there are numbers, and the beginning.
        assert_eq!(epochs.len(), 257);
        let another = on_native(&terrain, params).expect("opened");
        assert!(!epochs.contains(&another.session.scene().epoch));
    }
}

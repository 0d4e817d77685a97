//! A device for replays: it renders one point at a time.

use std::time::{Duration, Instant, SystemTime};

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{HipCommand, SceneChange, Source, TickRecord};
use hapterra_core::terrain::TILE_CELLS;
use hapterra_core::wire::hello::DeviceHello;

use super::published::Published;
use crate::link::{Event, LinkError, LinkStats, Session, Timeouts, Transport};
use crate::terrain::Terrain;

/// Time-out of a point, as a multiple of that of an answer, after which the device counts as stuck.
const POINT_TIMEOUT_FACTOR: u32 = 8;

/// A device that renders points in a scene of its own.
pub struct OfflineDevice<'t> {
    terrain: Terrain<'t>,
    /// Distinguishes the epochs of this replay from those of another.
    nonce: u32,
    /// Number of the placement in force.
    view: u8,
    session: Session<'t>,
    device: DeviceHello,
    seq: u32,
    published: Option<Published<'t>>,
    last: Option<GridPoint>,
}

impl<'t> OfflineDevice<'t> {
    /// Puts a new scene in force on a device.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn open(
        terrain: &'t Terrain<'t>,
        params: SurfaceParams,
        transport: Box<dyn Transport + 't>,
        timeouts: Timeouts,
    ) -> Result<Self, LinkError> {
        let mut scene = terrain.scene(params, Source::Points, GridPoint::default());
        // A device that still has the scene of an earlier replay would continue from its end.
        let nonce = nonce();
        scene.epoch ^= nonce;
        let (session, device) = Session::open(terrain, scene, None, transport, timeouts)?;
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

    /// Renders all further points by the paper's rule on the host instead of the device.
    #[must_use]
    pub fn by_published_rule(mut self, params: SurfaceParams) -> Self {
        self.published = Some(Published::new(self.terrain.clone(), params));
        self
    }

    /// Returns the rendered terrain.
    #[must_use]
    pub const fn terrain(&self) -> &Terrain<'t> {
        &self.terrain
    }

    /// Changes to another placement of the terrain, with the HIP's next position in it. A proxy in
    /// contact starts there on the surface, as with an arm.
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
        // A repeated placement gets a new epoch.
        scene.epoch ^= self.nonce.rotate_left(8) ^ u32::from(self.view);
        let view = SceneChange {
            number: self.view,
            scene,
            hip,
            keeps_tiles: terrain.has_tiles_of(&self.terrain),
            in_contact: None,
        };
        self.terrain = terrain.clone();
        if self.published.is_some() {
            self.published = Some(Published::new(terrain.clone(), params));
        }
        self.session.put_view(view, terrain)?;
        let deadline = Instant::now() + 2 * self.session.timeouts().give_up;
        while Instant::now() < deadline {
            let (mut answer, wait) = (None, Duration::from_millis(100));
            self.session.poll(wait, &mut |event| {
                if let Event::SceneChangeResult { accepted, .. } = event {
                    answer = Some(accepted);
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

    /// Returns the device.
    #[must_use]
    pub const fn device(&self) -> &DeviceHello {
        &self.device
    }

    /// Returns true if the next HIP position is more than a window of the device away from the
    /// last.
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
    pub const fn stats(&self) -> &LinkStats {
        self.session.stats()
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
        let deadline = Instant::now() + POINT_TIMEOUT_FACTOR * self.session.timeouts().give_up;
        while Instant::now() < deadline {
            if let Some(sample) = self.answer(seq)? {
                return Ok(sample);
            }
        }
        Err(LinkError::Stuck(seq))
    }

    /// Returns the answer to a point, if it arrives soon.
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
    pub fn close(&mut self) -> Result<(), LinkError> {
        self.session.close(&mut |_| {})
    }
}

/// Returns a number that differs from that of the last replay.
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

    /// A device accepts a placement with the next number, and a tile with the placement's epoch: a
    /// repeated placement needs a new epoch, also after the numbers start again.
    #[test]
    fn placements_have_consecutive_numbers_and_unique_epochs() {
        let raster = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
        let scale = Scale::new(1.0, 1.0).expect("scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let (params, hip) = (SurfaceParams::PREMIUM, GridPoint::default());
        let mut replayer = on_native(&terrain, params).expect("opened");
        let (mut epochs, mut last) = (std::collections::HashSet::new(), 0);
        for view in 0..300_u32 {
            if view > 0 {
                let again = terrain.clone();
                replayer.put_view(again, params, hip).expect("accepted");
            }
            let sample = replayer.step(hip).expect("rendered");
            assert_eq!(u32::from(sample.view), view % 256);
            let epoch = replayer.session.scene().epoch;
            assert!(view == 0 || epoch != last, "view {view}");
            epochs.insert(epoch);
            last = epoch;
        }
        // One for each number, and the first scene.
        assert_eq!(epochs.len(), 257);
        let another = on_native(&terrain, params).expect("opened");
        assert!(!epochs.contains(&another.session.scene().epoch));
    }
}

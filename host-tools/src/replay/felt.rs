//! Points to a device and back, one at a time.

use std::time::{Duration, Instant, SystemTime};

use hapterra_core::contact::Rule;
use hapterra_core::force::ForceLaw;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{Point, Sample, Source};
use hapterra_core::wire::hello::DeviceHello;

use crate::link::{Event, LinkError, Patience, Session, Tally, Transport};
use crate::terrain::Terrain;

/// A point may take so many times what an answer may take before the device counts as
/// stuck.
const ANSWERS_A_POINT: u32 = 8;

/// Feels points on a device, in a scene of its own.
pub struct Replayer<'t> {
    terrain: &'t Terrain<'t>,
    session: Session<'t>,
    device: DeviceHello,
    seq: u32,
}

impl<'t> Replayer<'t> {
    /// Puts a fresh scene in force on a device.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn open(
        terrain: &'t Terrain<'t>,
        law: ForceLaw,
        rule: Rule,
        transport: Box<dyn Transport + 't>,
        patience: Patience,
    ) -> Result<Self, LinkError> {
        let mut scene = terrain.scene(law, rule, Source::Points, GridPoint::default());
        // A device that holds the scene of an earlier replay would go on from
        // where that ended.
        scene.epoch ^= nonce();
        let (session, device) = Session::open(terrain, scene, None, transport, patience)?;
        Ok(Self {
            terrain,
            session,
            device,
            seq: 0,
        })
    }

    /// The terrain that is felt.
    #[must_use]
    pub const fn terrain(&self) -> &'t Terrain<'t> {
        self.terrain
    }

    /// The device that feels it.
    #[must_use]
    pub const fn device(&self) -> &DeviceHello {
        &self.device
    }

    /// What went over the link so far.
    #[must_use]
    pub const fn tally(&self) -> &Tally {
        self.session.tally()
    }

    /// What the loop feels with the HIP at `hip` next.
    ///
    /// # Errors
    /// [`LinkError`]; the replay cannot go on after one.
    pub fn feel(&mut self, hip: GridPoint) -> Result<Sample, LinkError> {
        let seq = self.seq;
        self.seq = seq.wrapping_add(1);
        self.session.feel(Point { seq, hip })?;
        let deadline = Instant::now() + ANSWERS_A_POINT * self.session.patience().give_up;
        while Instant::now() < deadline {
            if let Some(sample) = self.answer(seq)? {
                return Ok(sample);
            }
        }
        Err(LinkError::Stuck(seq))
    }

    /// The answer to a point, if it comes soon.
    fn answer(&mut self, expected: u32) -> Result<Option<Sample>, LinkError> {
        let (mut answer, mut restarted) = (None, false);
        let wait = Duration::from_millis(100);
        self.session.poll(wait, &mut |event| match event {
            Event::Felt { seq, sample } if seq == expected => answer = Some(*sample),
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

//! The host's side of the conversation, without I/O.

use hapterra_core::guard::Report;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Sample, Scene};
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, encode};
use hapterra_core::wire::hello::{DeviceHello, HostHello, PROTOCOL};
use hapterra_core::wire::message::{TileMessage, ToDevice, ToHost};
use hapterra_core::wire::status::{Answer, Status};

use super::error::LinkError;
use super::messages::next_message;
use super::tally::Tally;
use crate::terrain::{Terrain, TileBuffer};

/// A message from the device, as it concerns whoever uses the session.
#[derive(Debug)]
pub enum Event<'e> {
    /// The scene is in force. `resumed` tells whether the device held it
    /// already and goes on where it was.
    Opened {
        /// How the device introduced itself.
        device: &'e DeviceHello,
        /// Whether it goes on with the scene it held.
        resumed: bool,
    },
    /// The sample of one tick of a scene whose HIP comes from the encoders.
    Sample(&'e Sample),
    /// The sample at one point of a replay.
    Felt {
        /// The number that the host gave the point.
        seq: u32,
        /// HIP, proxy, force and state at the point.
        sample: &'e Sample,
    },
    /// Where the device's guard stands; told at the beginning of a session and
    /// whenever it changes.
    Guard(&'e Report),
    /// The answer to a question for the status.
    Status(&'e Status),
    /// The calibration in force.
    Calibration(Option<&'e Calibration>),
    /// The answer to a request.
    Answer(&'e Answer),
}

/// How a session arms the device, in the same breath as it puts the scene in
/// force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arming {
    /// What the encoders read in the zero pose, where the host knows.
    pub zero: Option<[i32; 3]>,
}

impl Arming {
    /// For a virtual Phantom, which was switched on in its zero pose.
    pub const VIRTUAL: Self = Self { zero: Some([0; 3]) };
}

/// What the host waits for at the beginning of a session. An answer that is
/// not waited for is a duplicate of something earlier and changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Awaited {
    /// Nothing: no hello was said yet, or the scene is in force.
    Nothing,
    /// The device's hello.
    Hello,
    /// That the device takes the scene that it was sent.
    SceneTaken,
}

/// Serves one terrain to one device. Bytes from the device go into
/// [`Client::receive`]; bytes for it come out of there and of
/// [`Client::greet`].
pub struct Client<'t> {
    terrain: &'t Terrain<'t>,
    scene: Scene,
    arming: Option<Arming>,
    reader: Box<FrameReader<MAX_FRAME>>,
    frame: Box<[u8; MAX_FRAME]>,
    tile: TileBuffer,
    /// The device of the present session.
    device: Option<DeviceHello>,
    awaited: Awaited,
    tally: Tally,
}

impl<'t> Client<'t> {
    /// A client that has not said anything yet. It arms the device at the
    /// beginning of each session, if `arming` says how.
    #[must_use]
    pub fn new(terrain: &'t Terrain<'t>, scene: Scene, arming: Option<Arming>) -> Self {
        Self {
            terrain,
            scene,
            arming,
            reader: Box::default(),
            frame: Box::new([0; MAX_FRAME]),
            tile: TileBuffer::default(),
            device: None,
            awaited: Awaited::Nothing,
            tally: Tally::default(),
        }
    }

    /// The scene that is served.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Counts of what went over the link so far.
    #[must_use]
    pub const fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Begins a session, the first or another: appends the hello to `out`.
    pub fn greet(&mut self, out: &mut Vec<u8>) {
        // A zero first ends whatever may have been under way.
        out.push(0);
        self.awaited = Awaited::Hello;
        let protocol = PROTOCOL;
        self.say(&ToDevice::Hello(HostHello { protocol }), out);
    }

    /// Appends a message to `out`.
    pub fn say(&mut self, message: &ToDevice<'_>, out: &mut Vec<u8>) {
        out.extend_from_slice(framed(message, &mut self.frame));
    }

    /// Takes bytes from the device, appends the answers to `out` and reports
    /// what happened. Frames that make no sense are counted and passed over.
    ///
    /// # Errors
    /// [`LinkError::Version`] and [`LinkError::SceneRefused`].
    pub fn receive(
        &mut self,
        mut bytes: &[u8],
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        while let Some(message) = next_message(&mut self.reader, &mut bytes) {
            match message {
                Ok(message) => self.on_message(message, out, on)?,
                Err(bad) => {
                    self.tally.bad_frames += 1;
                    tracing::debug!(?bad, "a frame was not understood");
                }
            }
        }
        Ok(())
    }

    fn on_message(
        &mut self,
        message: ToHost,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        match message {
            ToHost::Hello(device) if device.protocol != PROTOCOL => {
                return Err(LinkError::version(device.protocol));
            }
            ToHost::Refused { protocol } => return Err(LinkError::version(protocol)),
            ToHost::Hello(device) if self.awaited == Awaited::Hello => {
                self.device = Some(device);
                self.awaited = Awaited::SceneTaken;
                self.say(&ToDevice::Scene(self.scene), out);
                if let Some(Arming { zero }) = self.arming {
                    if let Some(counts) = zero {
                        self.say(&ToDevice::Zero { counts }, out);
                    }
                    self.say(&ToDevice::Arm, out);
                }
            }
            ToHost::SceneTaken { epoch, accepted }
                if epoch == self.scene.epoch && self.awaited == Awaited::SceneTaken =>
            {
                self.awaited = Awaited::Nothing;
                self.on_scene_taken(accepted, on)?;
            }
            ToHost::Need { epoch, key } if epoch == self.scene.epoch => self.on_need(key, out),
            ToHost::Telemetry(telemetry) => {
                if self.tally.received(&telemetry) {
                    telemetry.samples.iter().for_each(|s| on(Event::Sample(s)));
                }
            }
            ToHost::PointAnswer { seq, sample } => on(Event::Felt {
                seq,
                sample: &sample,
            }),
            ToHost::Guard(report) => on(Event::Guard(&report)),
            ToHost::Status(status) => on(Event::Status(&status)),
            ToHost::Calibration(calibration) => on(Event::Calibration(calibration.as_ref())),
            ToHost::Answer(answer) => on(Event::Answer(&answer)),
            // Of an earlier session, or said twice.
            ToHost::Hello(_) | ToHost::SceneTaken { .. } | ToHost::Need { .. } => {}
        }
        Ok(())
    }

    fn on_scene_taken(
        &mut self,
        accepted: bool,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        if !accepted {
            return Err(LinkError::SceneRefused);
        }
        if let Some(device) = &self.device {
            self.tally.opened();
            let resumed = device.epoch == Some(self.scene.epoch);
            on(Event::Opened { device, resumed });
        }
        Ok(())
    }

    fn on_need(&mut self, key: TileKey, out: &mut Vec<u8>) {
        let Some(heights) = self.terrain.tile(key, &mut self.tile) else {
            tracing::warn!(?key, "the device asked for a tile that there is not");
            return;
        };
        let message = ToDevice::Tile(TileMessage {
            epoch: self.scene.epoch,
            key,
            heights,
        });
        let bytes = framed(&message, &mut self.frame);
        self.tally.sent_tile(key, bytes.len());
        tracing::trace!(?key, bytes = bytes.len(), "tile sent");
        out.extend_from_slice(bytes);
    }
}

fn framed<'b>(message: &ToDevice<'_>, frame: &'b mut [u8; MAX_FRAME]) -> &'b [u8] {
    // The longest message is a tile, and a frame holds one by definition.
    encode(message, frame).unwrap_or(&[])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::raster::Raster;
    use crate::terrain::Scale;
    use hapterra_core::contact::Rule;
    use hapterra_core::force::ForceLaw;
    use hapterra_core::grid::GridPoint;
    use hapterra_core::scene::Source;

    /// How a device introduces itself.
    pub(crate) fn hello() -> DeviceHello {
        DeviceHello {
            protocol: PROTOCOL,
            board: "test".try_into().expect("fits"),
            version: "1".try_into().expect("fits"),
            window: 4,
            tick_hz: 1000,
            clock_hz: 1_000_000,
            epoch: None,
        }
    }

    #[test]
    fn what_is_said_twice_opens_once() {
        let raster = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
        let scale = Scale::new(1.0, 1.0).expect("scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let home = GridPoint::default();
        let scene = terrain.scene(ForceLaw::PREMIUM, Rule::Swept, Source::Points, home);
        let mut client = Client::new(&terrain, scene, None);
        let hello = ToHost::Hello(hello());
        let taken = ToHost::SceneTaken {
            epoch: scene.epoch,
            accepted: true,
        };
        let (mut out, mut opened) = (Vec::new(), 0);
        client.greet(&mut out);
        for message in [&taken, &hello, &hello, &taken, &taken, &hello] {
            let mut frame = [0; MAX_FRAME];
            let bytes = encode(message, &mut frame).expect("fits");
            let mut count =
                |event: Event<'_>| opened += u32::from(matches!(event, Event::Opened { .. }));
            client
                .receive(bytes, &mut out, &mut count)
                .expect("understood");
        }
        assert_eq!((opened, client.tally().sessions), (1, 1));
    }
}

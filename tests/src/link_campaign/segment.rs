//! A segment of the campaign: one device with its arm, the line, and the program at the other end,
//! millisecond by millisecond.

use hapterra::terrain::Terrain;
use hapterra_core::force::SurfaceParams;
use hapterra_core::scene::{Scene, Source};
use hapterra_core::wire::session::SessionEnd;

use super::cable::{BYTES_PER_TICK, Channel};
use super::device::Board;
use super::fault::{Fault, Kind};
use super::frame_tap::{Moment, Tap};
use super::host::Host;
use super::hostile_programs;
use super::proxy_oracle;
use crate::random::Random;

/// Longest time that the user may see an outdated state on a working line, ms; also if another
/// program controls the device, which is reported to the user.
const STALE: u64 = 1_500;
/// Time after a stall of the line in which the device may still send old messages, ms.
const DRAINS: u64 = 50;
/// Time after the end of a host in which a requested arming may still happen, ms: the switch was
/// pressed just before.
const LATE_ARM: u64 = 500;

/// One device and its environment.
pub struct Segment<'t> {
    /// The terrain that correct hosts serve.
    pub terrain: &'t Terrain<'t>,
    /// The scene that they set.
    pub scene: Scene,
    /// The only source of chance.
    pub random: Random,
    /// The device and its arm.
    pub board: Board<'t>,
    /// The direction to the device.
    pub to_device: Channel,
    /// The direction to the host.
    pub to_host: Channel,
    /// Frames that leave the device, as the oracle reads them.
    pub tap: Tap,
    /// The correct host, if one runs.
    pub host: Option<Host<'t>>,
    /// Present fault of the line.
    pub fault: Option<Fault>,
    /// Milliseconds so far.
    pub now: u64,
    /// The last time at which the line or one of its ends was faulty.
    troubled: u64,
    /// The time until which the amplifiers may be switched on.
    wished: u64,
    was_on: bool,
    /// The last time at which the direction to the host had no room.
    full: u64,
    /// True if the device has disarmed because its host was silent, and no host has connected
    /// since.
    pub let_go: bool,
    /// True if this must be reported to the present host.
    owed: bool,
    /// The time since which the user has seen a wrong state.
    stale: Option<u64>,
    /// The largest distance of a proxy from the surface, cells.
    pub off_surface: f64,
    /// Samples in contact that were checked.
    pub touching: u64,
}

impl<'t> Segment<'t> {
    /// Creates a device after power-up, without a host.
    #[must_use]
    pub fn new(terrain: &'t Terrain<'t>, mut random: Random) -> Self {
        let mut board = Board::new(terrain, &mut random);
        board.lock_step = random.below(4) == 0;
        let scene = scene(terrain, &board, &mut random);
        Self {
            terrain,
            scene,
            random,
            board,
            to_device: Channel::default(),
            to_host: Channel::default(),
            tap: Tap::default(),
            host: None,
            fault: None,
            now: 0,
            troubled: 0,
            wished: 0,
            was_on: false,
            full: 0,
            let_go: false,
            owed: false,
            stale: None,
            off_surface: 0.0,
            touching: 0,
        }
    }

    /// Starts a correct host, with another scene or the last active one.
    pub fn start_host(&mut self, other_scene: bool) {
        if other_scene {
            self.scene = scene(self.terrain, &self.board, &mut self.random);
        }
        self.board.tick_checks.reset();
        self.owed = std::mem::take(&mut self.let_go);
        let mut out = Vec::new();
        let random = &mut self.random;
        let host = Host::start(self.terrain, self.scene, self.now, random, &mut out);
        self.tap.begin(Some(host.session()));
        self.host = Some(host);
        self.send(&out);
    }

    /// Kills the correct host: it sends nothing more.
    pub fn kill_host(&mut self) {
        self.host = None;
        self.troubled = self.now;
    }

    /// Restarts the device.
    pub fn restart_device(&mut self) {
        self.board.restart();
        self.tap.begin(None);
        (self.let_go, self.owed) = (false, false);
        self.troubled = self.now;
        self.was_on = false;
    }

    /// Starts a fault of the line.
    pub fn begin(&mut self, fault: Fault) {
        if fault.kind == Kind::HostileHost {
            (self.let_go, self.owed) = (false, false);
        }
        let [to_device, to_host] = fault.line_faults();
        self.to_device.set_faults(to_device);
        self.to_host.set_faults(to_host);
        self.fault = Some(fault);
    }

    /// Runs an action of the correct host; its frames enter the line.
    pub fn with_host(&mut self, act: impl FnOnce(&mut Host<'t>, u64, &mut Vec<u8>)) {
        let mut out = Vec::new();
        if let Some(host) = &mut self.host {
            act(host, self.now, &mut out);
        }
        self.send(&out);
    }

    /// Sends bytes to the device.
    pub fn send(&mut self, bytes: &[u8]) {
        self.to_device.send(bytes, self.now, &mut self.random);
    }

    /// Returns the time since the line and its ends were last faulty, ms.
    #[must_use]
    pub fn calm(&self) -> u64 {
        self.now - self.troubled
    }

    /// Advances everything by one millisecond.
    ///
    /// # Errors
    /// The broken invariant.
    pub fn step(&mut self) -> Result<(), String> {
        self.end_fault();
        self.send_hostile_bytes();
        self.deliver();
        self.board.tick()?;
        let mut buffer = [0; BYTES_PER_TICK];
        let sent = self.board.transmit(&mut buffer, self.to_host.room());
        if self.to_host.room() < BYTES_PER_TICK {
            self.full = self.now;
        }
        let when = Moment {
            now: self.now,
            ticks: self.board.ticks[0],
            flows: self.now > self.full + DRAINS,
        };
        self.tap.receive(sent, &when);
        self.to_host.send(sent, self.now, &mut self.random);
        let mut received = Vec::new();
        while let Some(transfer) = self.to_host.receive(self.now) {
            received.extend(transfer);
        }
        self.with_host(|host, now, out| host.step(now, &received, out));
        self.check()?;
        self.now += 1;
        Ok(())
    }

    fn end_fault(&mut self) {
        if self.fault.is_none() {
            return;
        }
        self.troubled = self.now;
        self.fault = self.fault.filter(|fault| self.now < fault.end);
        if self.fault.is_none() {
            self.to_device.set_faults(Default::default());
            self.to_host.set_faults(Default::default());
        }
    }

    /// Sends the bytes of another program to the device, during that fault.
    fn send_hostile_bytes(&mut self) {
        let hostile = self
            .fault
            .is_some_and(|fault| fault.kind == Kind::HostileHost);
        if hostile && self.to_device.room() > 0 {
            let bytes = hostile_programs::host(&mut self.random);
            self.send(&bytes);
        }
    }

    fn deliver(&mut self) {
        while let Some(transfer) = self.to_device.receive(self.now) {
            let taken = self.board.receive(&transfer);
            let rest = transfer.get(taken..).unwrap_or(&[]);
            if !rest.is_empty() {
                return self.to_device.put_back(rest, self.now);
            }
        }
    }

    fn check(&mut self) -> Result<(), String> {
        self.check_samples()?;
        self.check_force_request()?;
        self.check_view()?;
        self.check_last_end()
    }

    /// Checks that the first host after one that vanished receives the reason for the disarming.
    fn check_last_end(&mut self) -> Result<(), String> {
        let greeted = self.host.as_ref().and_then(|host| host.last_end);
        match greeted.filter(|_| self.owed) {
            None => Ok(()),
            Some(SessionEnd::HostSilent) => {
                self.owed = false;
                Ok(())
            }
            Some(other) => Err(format!(
                "the host before vanished, and the next receives {other:?}"
            )),
        }
    }

    fn check_samples(&mut self) -> Result<(), String> {
        let Some(host) = &mut self.host else {
            return Ok(());
        };
        for sample in std::mem::take(&mut host.samples) {
            self.board
                .tick_checks
                .check_sample(&sample, self.scene.params.max_force_n)?;
            let off = proxy_oracle::check(self.terrain, &sample)?;
            self.off_surface = self.off_surface.max(off);
            self.touching += u64::from(off > 0.0);
        }
        Ok(())
    }

    /// Checks that the amplifiers are switched on only if a live host has requested it.
    fn check_force_request(&mut self) -> Result<(), String> {
        let requests_arming = |host: &Host<'_>| host.requested_arming && host.end.is_none();
        if self.host.as_ref().is_some_and(requests_arming) {
            self.wished = self.now + LATE_ARM;
        }
        let (was, is) = (self.was_on, self.board.drive.enabled);
        self.was_on = is;
        match is && !was && self.now >= self.wished {
            true => Err("the amplifiers were switched on without a request of a host".into()),
            false => Ok(()),
        }
    }

    /// Checks that the user sees the true state, a moment after the line works again.
    fn check_view(&mut self) -> Result<(), String> {
        let is_on = self.board.drive.enabled;
        let is_in_mode = |host: &Host<'_>| {
            let live = host.opened && host.end.is_none();
            let view = host.view.map(|view| view.mode.is_driving());
            live.then_some(view)
        };
        let wrong = match self.host.as_ref().and_then(is_in_mode) {
            Some(seen) => seen != Some(is_on),
            None => false,
        };
        if !wrong || self.calm() < STALE {
            self.stale = None;
            return Ok(());
        }
        let since = *self.stale.get_or_insert(self.now);
        match self.now - since < STALE {
            true => Ok(()),
            false => Err(format!(
                "the user has seen {:?} for {} ms with the amplifiers {}",
                self.host.as_ref().and_then(|host| host.view),
                self.now - since,
                if is_on { "on" } else { "off" }
            )),
        }
    }
}

/// Draws a scene with a new number.
fn scene(terrain: &Terrain<'_>, board: &Board<'_>, random: &mut Random) -> Scene {
    let params = SurfaceParams {
        stiffness_n_per_mm: random.between(0.3, 0.8) as f32,
        max_force_n: 8.5,
        ..SurfaceParams::PREMIUM
    };
    let home = terrain.scale().to_grid(board.home_mm()).expect("in range");
    Scene {
        hold_clock: board.lock_step,
        materials: None,
        ..terrain.scene(params, Source::Encoders, home)
    }
}

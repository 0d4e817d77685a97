//! A stretch of the campaign: one device, one arm, every kind of mishap once, in
//! an order of its own. Nothing but the seed decides what happens.

use hapterra::phantom::PhantomModel;
use hapterra::raster::Raster;
use hapterra::synth::{Kind as Look, Synth};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::force::ForceLaw;
use hapterra_core::guard::{Drive, Mode, Sense};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, Source};
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::status::{BootReport, Status};
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::native::Device;
use hapterra_firmware::store::Stored;

use super::arm::{Arm, Mood};
use super::clock::{Reading, SetClock};
use super::effect::{Mishap, RULE};
use super::host::{Host, Tiles};
use super::kind::Kind;
use super::pipe::Unkind;
use super::tally::{Outcome, Tally};
use super::watch::{Truth, Watch};
use crate::chance::Chance;

/// Tiles along the side of the window, as on the smallest board.
const WINDOW: usize = 4;
/// Samples along the side of the terrain, and the side of a cell, mm.
const SAMPLES: u32 = 512;
const CELL_MM: f64 = 0.5;
/// Armed ticks between two mishaps, shortest and longest.
const CALM: (usize, usize) = (200, 1_500);
/// Ticks between the end of a mishap and the question what became of it.
const SETTLE: u64 = 400;
/// Ticks that an answer may take.
const ANSWER: u64 = 5_000;
/// Ticks that one try to arm takes, and tries before that is a violation: hot
/// motors have to cool.
const TRY: u64 = 4_000;
const TRIES: u64 = 40;
/// In each try, the ticks at which the host asks and the switch is pressed.
const ASK: u64 = 60;
const PRESS: u64 = 200;

/// What must not happen happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// The segment.
    pub segment: u64,
    /// The tick in it.
    pub tick: u64,
    /// What.
    pub what: String,
}

/// Runs a segment of a campaign and adds it to the tally.
///
/// # Errors
/// The first [`Violation`].
pub fn run(seed: u64, segment: u64, tally: &mut Tally) -> Result<(), Violation> {
    let mut chance = Chance::new(seed ^ segment.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let raster = terrain(&mut chance);
    let scale = Scale::new(CELL_MM, 1.0).expect("a scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("a terrain");
    let mut stretch = Stretch::new(&terrain, chance);
    let played = stretch.play(tally);
    tally.add(stretch.now, stretch.armed, &stretch.watch.extremes);
    played.map_err(|what| Violation {
        segment,
        tick: stretch.now,
        what,
    })
}

/// Hills with a hole in them.
fn terrain(chance: &mut Chance) -> Raster {
    let looks = [Look::Fractal, Look::Ridge, Look::Steps, Look::Fractal];
    let amplitude_mm = chance.between(6.0, 20.0);
    let synth = Synth::new(looks[chance.below(4)], chance.bits(), amplitude_mm);
    let hole = [150.0, 350.0].map(|at| at + chance.between(-40.0, 40.0));
    let raster = Raster::from_fn(SAMPLES, SAMPLES, |column, row| {
        let [east, north] = [f64::from(column) - hole[0], f64::from(row) - hole[1]];
        match libm::hypot(east, north) < 25.0 {
            true => f32::NAN,
            false => synth.height(column, row),
        }
    });
    raster.expect("a terrain")
}

struct Stretch<'t> {
    terrain: &'t Terrain<'t>,
    chance: Chance,
    clock: SetClock,
    device: Device<SetClock, WINDOW>,
    host: Host<'t>,
    scene: Scene,
    arm: Arm<'t>,
    watch: Watch,
    /// Counts that the encoders are off by.
    lost: [i32; 3],
    /// What the device was told that they read in its zero pose.
    zero: [i32; 3],
    dead_man: bool,
    drive: Drive,
    now: u64,
    /// Ticks with the amplifiers on.
    armed: u64,
}

impl<'t> Stretch<'t> {
    fn new(terrain: &'t Terrain<'t>, mut chance: Chance) -> Self {
        let record = Calibration::PREMIUM_1_5;
        // The two halves of the application hand tile buffers to each other by
        // reference, for as long as the program runs.
        let tiles = Box::leak(Box::new(TileBuffers::VACANT));
        let memory = Box::leak(Box::new(WorkingMemory::new()));
        let clock = SetClock::default();
        let stored = Stored::Found(record);
        let device = Device::new(tiles, memory, clock.clone(), stored, BootReport::default());
        let arm = Arm::new(terrain, &mut chance);
        let scene = scene(terrain, &arm, &mut chance);
        Self {
            terrain,
            chance,
            clock,
            device,
            host: Host::new(terrain, scene),
            scene,
            arm,
            watch: Watch::new(record, PhantomModel::premium_1_5()),
            lost: [0; 3],
            zero: [0; 3],
            dead_man: false,
            drive: Drive::default(),
            now: 0,
            armed: 0,
        }
    }

    fn play(&mut self, tally: &mut Tally) -> Result<(), String> {
        let mut deck = Kind::ALL;
        for left in (1..deck.len()).rev() {
            deck.swap(left, self.chance.below(left + 1));
        }
        for kind in deck {
            if !self.drive.enabled || self.status()?.health.report.mode != Mode::Armed {
                self.arm_it()?;
            }
            let calm = CALM.0 + self.chance.below(CALM.1 - CALM.0);
            for _ in 0..calm {
                self.tick(None)?;
            }
            if !self.drive.enabled {
                return Err(format!(
                    "the arm is off without a mishap: {:?}",
                    self.status()?
                ));
            }
            let (outcome, reaction) = self.mishap(kind)?;
            tally.count(kind, outcome, reaction)?;
        }
        Ok(())
    }

    /// Lets one thing go wrong and says what became of it, and for how many
    /// ticks after its first the amplifiers stayed on.
    fn mishap(&mut self, kind: Kind) -> Result<(Outcome, Option<u64>), String> {
        let mut mishap = Mishap::of(kind, self.now, &mut self.chance);
        let began = self.now;
        let mut off = None;
        match kind {
            Kind::Goodbye => self.say(&ToDevice::Bye),
            Kind::HostRestarted => {
                self.scene = scene(self.terrain, &self.arm, &mut self.chance);
                self.host.restart(self.scene, self.now, &mut self.chance);
                self.watch.forget();
            }
            _ => {}
        }
        let end = mishap.ticks.end + SETTLE;
        while self.now < end {
            let at = self.now - began;
            let under_way = mishap.ticks.contains(&self.now);
            self.tick(under_way.then_some(&mut mishap))?;
            if !self.drive.enabled {
                off.get_or_insert(at);
            }
        }
        let report = self.status()?.health.report;
        let outcome = match (report.fault, report.mode) {
            (Some(fault), _) => Outcome::Latched(fault),
            (None, Mode::Armed) if off.is_none() => Outcome::Ridden,
            (None, _) => Outcome::Disarmed,
        };
        Ok((outcome, off))
    }

    /// Asks for the status until there is an answer.
    fn status(&mut self) -> Result<Status, String> {
        self.host.status = None;
        let began = self.now;
        while self.now < began + ANSWER {
            if (self.now - began).is_multiple_of(100) {
                self.greet_if_closed();
                self.say(&ToDevice::Status);
            }
            self.tick(None)?;
            if let Some(status) = self.host.status.take() {
                return Ok(status);
            }
        }
        Err("the device does not tell its status".into())
    }

    fn greet_if_closed(&mut self) {
        if !self.host.opened {
            self.host.greet(self.now, &mut self.chance);
        }
    }

    /// Clears, zeroes and arms as a user would, until the force is in.
    fn arm_it(&mut self) -> Result<(), String> {
        for _ in 0..TRIES {
            if self.try_to_arm()? {
                return Ok(());
            }
        }
        Err(format!("the arm cannot be armed: {:?}", self.status()?))
    }

    fn try_to_arm(&mut self) -> Result<bool, String> {
        let began = self.now;
        self.dead_man = false;
        self.host.greet(self.now, &mut self.chance);
        while self.now < began + TRY {
            let at = self.now - began;
            match at {
                30 => self.say(&ToDevice::Disarm),
                40 => self.say(&ToDevice::ClearFault),
                50 => self.say_zero(),
                ASK => self.say(&ToDevice::Arm),
                PRESS => self.dead_man = true,
                _ => {}
            }
            let mood = if at > PRESS + 300 {
                Mood::Wanders
            } else {
                Mood::Lifted
            };
            self.tick_in(mood, None)?;
            let latest = self.watch.latest();
            if at > PRESS && self.drive.enabled && latest == Some(Mode::Armed) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// With the arm in its zero pose its encoders would read what they are off by.
    fn say_zero(&mut self) {
        self.zero = self.lost;
        self.say(&ToDevice::Zero { counts: self.zero });
    }

    fn say(&mut self, message: &ToDevice<'_>) {
        let kind = Unkind::default();
        self.host.say(message, self.now, &kind, &mut self.chance);
    }

    fn tick(&mut self, mishap: Option<&mut Mishap>) -> Result<(), String> {
        let mood = mishap
            .as_ref()
            .map_or(Mood::Wanders, |mishap| mishap.mood());
        self.tick_in(mood, mishap)
    }

    /// One tick of everything.
    fn tick_in(&mut self, mood: Mood, mishap: Option<&mut Mishap>) -> Result<(), String> {
        let mut sense = Sense {
            counts: self.arm.counts(),
            dead_man: self.dead_man,
            emergency_stop: false,
            hardware_failed: false,
        };
        for (count, lost) in sense.counts.iter_mut().zip(self.lost) {
            *count += lost;
        }
        let (mut unkind, mut tiles) = (Unkind::default(), Tiles::Sent);
        let (mut reading, mut stalls) = (Reading::default(), false);
        if let Some(mishap) = mishap {
            mishap.meddle(&mut sense, &mut self.lost, self.now, &mut self.chance);
            (unkind, tiles) = (mishap.unkind(), mishap.tiles());
            (reading, stalls) = (mishap.reading(), mishap.stalls());
            if mishap.unplugs(self.now) {
                self.device.link.interrupted();
            }
            if let Some(message) = mishap.misplaced(&mut self.chance, self.scene.epoch) {
                self.host.say(&message, self.now, &unkind, &mut self.chance);
            }
        }
        self.clock.set(reading);
        let device = &mut self.device;
        self.drive = if stalls {
            device.tick_alone(sense)
        } else {
            self.host
                .deliver(self.now, &mut |bytes| device.receive(bytes));
            device.tick(sense)
        };
        let mut said = [0; 1024];
        let length = if stalls {
            0
        } else {
            self.device.link.transmit(&mut said)
        };
        let said = &said[..length];
        self.host
            .hear(said, self.now, &unkind, tiles, &mut self.chance);
        self.look(&sense)?;
        let currents = self.drive.currents_a.to_array().map(f64::from);
        self.arm.step(currents, mood);
        self.armed += u64::from(self.drive.enabled);
        self.now += 1;
        Ok(())
    }

    fn look(&mut self, sense: &Sense) -> Result<(), String> {
        if let Some(error) = self.host.failed.take() {
            return Err(format!("the link broke: {error}"));
        }
        let plant = self.arm.plant();
        let truth = Truth {
            q_rad: plant.q_rad(),
            counts: plant.counts(),
            winding_c: plant.winding_c(),
        };
        self.watch.drive(&self.drive, sense, self.zero, &truth)?;
        for sample in std::mem::take(&mut self.host.samples) {
            self.watch.sample(&sample, self.scene.law.max_force_n)?;
        }
        Ok(())
    }
}

fn scene(terrain: &Terrain<'_>, arm: &Arm<'_>, chance: &mut Chance) -> Scene {
    let law = ForceLaw {
        stiffness_n_per_mm: chance.between(0.3, 0.8) as f32,
        max_force_n: 8.5,
    };
    let home = terrain.scale().to_grid(arm.home_mm()).expect("in range");
    Scene {
        // Real time: nothing waits for the host.
        hold_clock: false,
        ..terrain.scene(law, RULE, Source::Encoders, home)
    }
}

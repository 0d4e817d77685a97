//! A board that is powered and plugged in, with an arm that a test moves.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{Bulk, BulkEndpoints, Event, HostRequest, Session, Timeouts, Transport};
use hapterra::phantom::{ArmFrame, Encoder, PhantomModel, kinematics};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::{Mode, Report};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::status::Status;
use hapterra_tests::usb::host::{Found, ScriptedPipes, enumerate};
use heightfield::Raster;

use nusb::descriptors::ConfigurationDescriptor;

use crate::chip::{CHIPS, Chip};
use crate::elf::Image;
use crate::machine::Machine;
use crate::supply::Reset;

/// Counts of the arm's motion in a tick: a third of a metre a second.
const COUNTS_PER_TICK: i32 = 12;

/// Returns the machines with an image, which `cargo xtask test` builds and names. Prints a message
/// for each missing one.
#[must_use]
pub fn machines() -> Vec<Machine> {
    let image = |chip: &&'static Chip| {
        let path = std::env::var_os(chip.variable).filter(|path| !path.is_empty());
        if path.is_none() {
            eprintln!(
                "skipped: no image of {}: {} is not set",
                chip.board, chip.variable
            );
        }
        path.map(|path| Machine::new(chip, Image::read(path.as_ref())))
    };
    CHIPS.iter().filter_map(image).collect()
}

/// Opens a scene over `raster`, a millimetre a cell, on every board with an image. The HIP's home
/// is at `home_mm`.
///
/// # Panics
/// If the scene is invalid.
pub fn on_each_board(
    raster: &Raster,
    home_mm: [f64; 3],
    mut then: impl FnMut(Machine, &Terrain<'_>, Scene),
) {
    let scale = Scale::new(1.0, 1.0).expect("scale");
    let terrain = Terrain::new(raster, scale, 0).expect("terrain");
    let home = scale.to_grid(home_mm).expect("addressable");
    let scene = terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home);
    for machine in machines() {
        then(machine, &terrain, scene);
    }
}

/// Returns rough ground, and a home above its middle.
#[must_use]
pub fn rough_ground() -> (Raster, [f64; 3]) {
    let raster = Raster::from_fn(257, 257, |x, y| ((x * y) % 7) as f32);
    (raster.expect("raster"), [128.0, 128.0, 40.0])
}

/// A device with a session, rendered through its encoders.
pub struct Device<'t> {
    /// The board.
    pub machine: Rc<RefCell<Machine>>,
    session: Session<'t>,
    endpoints: BulkEndpoints,
    /// The encoders' counts.
    pub counts: [i32; 3],
    /// The latest sample.
    pub latest: Option<TickRecord>,
    /// State of the guard, as last reported.
    pub guard: Option<Report>,
    /// The latest status.
    pub status: Option<Status>,
    /// The latency that the board states, µs.
    pub latency_us: u16,
    /// Outcome of the latest request that was answered.
    pub answer: Option<(Request, Result<(), Refusal>)>,
    /// The ticks that were marked.
    pub marked: Vec<u32>,
}

impl<'t> Device<'t> {
    /// Powers up the board with the arm in its zero pose, plugs it in and opens a session in
    /// `scene`.
    ///
    /// # Panics
    /// If any of this fails.
    #[must_use]
    pub fn open(mut machine: Machine, terrain: &'t Terrain<'t>, scene: Scene) -> Self {
        let found = enumerate(&mut machine).expect("enumerated");
        let machine = Rc::new(RefCell::new(machine));
        let endpoints = endpoints(&found);
        let pipes = ScriptedPipes::new(Rc::clone(&machine), endpoints);
        let link = Box::new(Bulk(pipes));
        // No result depends on the speed of this machine.
        let (session, hello) =
            Session::open(terrain, scene, None, link, Timeouts::EMULATED).expect("a session");
        let mut device = Self {
            machine,
            session,
            endpoints,
            latency_us: hello.latency_us,
            counts: [0; 3],
            latest: None,
            guard: None,
            status: None,
            answer: None,
            marked: vec![],
        };
        device.run_ms(20);
        device
    }

    /// Same as [`Self::open`]; then calibrates, zeroes, requests arming and presses the dead-man
    /// switch: the amplifiers are on, and the force ramps up.
    ///
    /// # Panics
    /// If the amplifiers do not switch on.
    #[must_use]
    pub fn arm(machine: Machine, terrain: &'t Terrain<'t>, scene: Scene) -> Self {
        let mut device = Self::open(machine, terrain, scene);
        let calibration = Calibration::PREMIUM_1_5;
        device.request(Request::SetCalibration { calibration });
        device.run_ms(10);
        // The board may have found a fault when it started.
        let fault = device.guard.and_then(|report| report.fault);
        device.request(Request::ClearFault { fault });
        device.request(Request::Zero { counts: [0; 3] });
        device.request(Request::Arm);
        device.run_ms(30);
        let pin = device.machine.borrow().chip.dead_man;
        device.machine.borrow_mut().set_input(pin, false);
        let came_on = (0..400).any(|_| {
            device.run_ms(1);
            device.machine.borrow().is_enabled()
        });
        assert!(came_on, "{:?}", device.guard);
        device
    }

    /// Waits until the force is ramped up.
    ///
    /// # Panics
    /// If that does not happen.
    pub fn wait_for_full_force(&mut self) {
        let armed = (0..300).any(|_| {
            self.run_ms(10);
            self.guard.is_some_and(|report| report.mode == Mode::Armed)
        });
        assert!(armed, "{:?}", self.guard);
    }

    /// Pulls the cable and resets the chip, like its watchdog. Memory keeps its content.
    ///
    /// # Panics
    /// If the machine is already borrowed.
    #[must_use]
    pub fn reset(self) -> Machine {
        self.reset_by(Reset::Watchdog)
    }

    /// Pulls the cable and resets the chip. Memory keeps its content.
    ///
    /// # Panics
    /// If the machine is already borrowed.
    #[must_use]
    pub fn reset_by(self, cause: Reset) -> Machine {
        let Self {
            machine, session, ..
        } = self;
        drop(session);
        let machine = Rc::try_unwrap(machine).ok().expect("it has no other owner");
        let mut machine = machine.into_inner();
        machine.reset(cause);
        machine
    }

    /// Queries the status.
    ///
    /// # Panics
    /// If there is no answer.
    pub fn query_status(&mut self) -> Status {
        self.status = None;
        self.session.enqueue(HostRequest::Status);
        self.run_ms(150);
        self.status.clone().expect("an answer")
    }

    /// Sends a request.
    pub fn request(&mut self, request: Request) {
        self.session.request(request);
    }

    /// Sends bytes from outside the session.
    ///
    /// # Panics
    /// If the board does not accept them.
    pub fn send(&mut self, bytes: &[u8]) {
        let pipes = ScriptedPipes::new(Rc::clone(&self.machine), self.endpoints);
        Bulk(pipes).send(bytes).expect("taken");
    }

    /// Lets time pass while the host answers.
    ///
    /// # Panics
    /// If the link breaks.
    pub fn run_ms(&mut self, ms: u64) {
        let end_ns = self.machine.borrow().bus().now_ns + ms * 1_000_000;
        while self.machine.borrow().bus().now_ns < end_ns {
            let mut on_event = |event: Event<'_>| match event {
                Event::Sample(sample) => self.latest = Some(*sample),
                Event::Guard(report) => self.guard = Some(*report),
                Event::Status(status) => self.status = Some(status.clone()),
                Event::Answered { request, result } => self.answer = Some((*request, result)),
                Event::Marked { tick } => self.marked.push(tick),
                _ => {}
            };
            self.session
                .poll(Duration::from_millis(1), &mut on_event)
                .expect("it continues");
        }
    }

    /// Moves the arm to these counts, no faster than a hand.
    pub fn move_to(&mut self, counts: [i32; 3]) {
        while self.counts != counts {
            for (now, then) in self.counts.iter_mut().zip(counts) {
                *now += (then - *now).clamp(-COUNTS_PER_TICK, COUNTS_PER_TICK);
            }
            self.machine.borrow().bus().set_encoders(self.counts);
            self.run_ms(1);
        }
    }

    /// Returns the commands of axes 1 to 3: converter codes or compare counts.
    #[must_use]
    pub fn commands(&self) -> [i32; 3] {
        self.machine.borrow().bus().commands()
    }
}

/// Returns the link's endpoints, searched as in the real program.
fn endpoints(found: &Found) -> BulkEndpoints {
    let configuration = ConfigurationDescriptor::new(&found.configuration);
    let configuration = configuration.expect("a configuration descriptor");
    BulkEndpoints::find(&configuration).expect("the link's endpoints")
}

/// An inclined plane under the arm, and its force on a press, in f64 from the counts on, without
/// code of the device.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// The arm.
    pub model: PhantomModel,
    /// Position of the terrain.
    pub place: ArmFrame,
    /// Slope east and north.
    pub slope: [f64; 2],
    /// Height above the origin, mm.
    pub height_mm: f64,
    /// Spring and limit.
    pub params: SurfaceParams,
}

impl Plane {
    /// Creates a level plane at this height for a Premium 1.5, with its preset's parameters.
    #[must_use]
    pub fn level(home_mm: [f64; 3], height_mm: f64) -> Self {
        Self {
            model: PhantomModel::premium_1_5(),
            place: ArmFrame { home_mm },
            slope: [0.0; 2],
            height_mm,
            params: SurfaceParams::PREMIUM,
        }
    }

    /// Returns the height (mm) of a terrain point above the plane, along its normal.
    #[must_use]
    pub fn above_mm(&self, [east, north, up]: [f64; 3]) -> f64 {
        let surface = self.height_mm + self.slope[0] * east + self.slope[1] * north;
        (up - surface) * self.normal()[2]
    }

    /// Returns the unit normal: east, north, up.
    #[must_use]
    pub fn normal(&self) -> [f64; 3] {
        let [a, b] = self.slope;
        let length = (a * a + b * b + 1.0).sqrt();
        [-a / length, -b / length, 1.0 / length]
    }

    /// Returns the counts nearest to a tip `depth_mm` under the plane at an east and north.
    ///
    /// # Panics
    /// If the arm does not reach it.
    #[must_use]
    pub fn counts_at(&self, [east, north]: [f64; 2], depth_mm: f64) -> [i32; 3] {
        let surface = self.height_mm + self.slope[0] * east + self.slope[1] * north;
        let up = surface - depth_mm / self.normal()[2];
        let tip = self.place.to_device_m(&self.model, [east, north, up]);
        let q = kinematics::inverse(&self.model, tip).expect("in reach");
        std::array::from_fn(|axis| Encoder::new(&self.model.drive[axis]).counts(q[axis]))
    }

    /// Returns the motor currents (A) of axes 1 to 3 with the arm at these counts.
    #[must_use]
    pub fn currents_a(&self, counts: [i32; 3]) -> [f64; 3] {
        let q: [f64; 3] = std::array::from_fn(|axis| {
            Encoder::new(&self.model.drive[axis]).angle_rad(counts[axis])
        });
        let tip = kinematics::tip(&self.model, q);
        let depth_mm = -self.above_mm(self.place.to_terrain_mm(&self.model, tip));
        let newtons = (f64::from(self.params.stiffness_n_per_mm) * depth_mm)
            .clamp(0.0, self.params.max_force_n.into());
        let force = ArmFrame::turn_to_device(self.normal().map(|n| n * newtons));
        let jacobian = kinematics::jacobian(&self.model, q);
        // The torque that holds the links, by the record: -g2·cos q2 and -g3·sin q3 pull.
        let record = Calibration::PREMIUM_1_5;
        let gravity_torques = [
            0.0,
            f64::from(record.gravity_2_nm) * q[1].cos(),
            f64::from(record.gravity_3_nm) * q[2].sin(),
        ];
        std::array::from_fn(|joint| {
            let pressed: f64 = (0..3).map(|axis| jacobian[axis][joint] * force[axis]).sum();
            let torque = pressed + gravity_torques[joint];
            let drive = &self.model.drive[joint];
            drive.sign * torque / (drive.ratio * drive.motor.kt_nm_per_a)
        })
    }
}

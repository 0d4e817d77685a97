//! A device with an arm in a hand, and injected faults between them.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{Arming, Event, Native, Session, Timeouts};
use hapterra::phantom::{ArmFrame, HandModel, HeldPhantom, PhantomModel, Script, Touch};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::{GuardInputs, GuardOutputs, Report, WORKING_SHARE};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::native::StoppedClock;
use hapterra_firmware::store::Stored;
use hapterra_tests::faulty_links::Shared;
use heightfield::Raster;

/// Height of the touched plane, mm; the hand starts above its middle.
pub(crate) const PLANE_MM: f64 = 20.0;
pub(crate) const MIDDLE_MM: [f64; 2] = [100.0, 100.0];
/// Tick at which the script begins, and tick at which a press has settled.
pub(crate) const BEGIN: u64 = (1e3 * HeldPhantom::ARMED_S) as u64;
pub(crate) const PRESSED: u64 = BEGIN + 1_500;

/// Fault by tick.
pub(crate) type Wrong = fn(u64, &mut GuardInputs);
/// Inputs and outputs of each tick.
pub(crate) type Log = Rc<RefCell<Vec<(GuardInputs, GuardOutputs)>>>;

/// A device with an arm, its session, and all observations.
pub(crate) struct Bed<'t> {
    pub(crate) terrain: &'t Terrain<'t>,
    pub(crate) scene: Scene,
    pub(crate) device: Rc<RefCell<Native>>,
    pub(crate) session: Option<Session<'t>>,
    pub(crate) log: Log,
    pub(crate) samples: Vec<TickRecord>,
    pub(crate) reports: Vec<Report>,
    pub(crate) answers: Vec<(Request, Result<(), Refusal>)>,
}

impl<'t> Bed<'t> {
    pub(crate) fn new(terrain: &'t Terrain<'t>, script: Script, wrong: Wrong) -> Self {
        let stored = Stored::Found(Calibration::PREMIUM_1_5);
        Self::started(terrain, script, wrong, (stored, BootReport::default()))
    }

    pub(crate) fn started(
        terrain: &'t Terrain<'t>,
        script: Script,
        wrong: Wrong,
        (stored, boot): (Stored, BootReport),
    ) -> Self {
        let [x, y] = MIDDLE_MM;
        let home_mm = [x, y, PLANE_MM + 4.0];
        let model = PhantomModel::premium_1_5();
        let rig = HeldPhantom::new(model, HandModel::default(), ArmFrame { home_mm }, script);
        let rig = rig.expect("in reach").arming();
        let log = Log::default();
        let seen = Rc::clone(&log);
        let device = Native::started(StoppedClock, Some(Box::new(rig)), stored, boot)
            .with_fault_injector(Box::new(move |tick, sense, drive| {
                if let Some(last) = seen.borrow_mut().last_mut() {
                    last.1 = *drive;
                }
                wrong(tick, sense);
                seen.borrow_mut().push((*sense, GuardOutputs::default()));
            }));
        let home = terrain.scale().to_grid(home_mm).expect("addressable");
        let params = SurfaceParams::PREMIUM;
        Self {
            terrain,
            scene: terrain.scene(params, Source::Encoders, home),
            device: Rc::new(RefCell::new(device)),
            session: None,
            log,
            samples: Vec::new(),
            reports: Vec::new(),
            answers: Vec::new(),
        }
    }

    pub(crate) fn open(&mut self, arming: Option<Arming>) {
        let link = Box::new(Shared(Rc::clone(&self.device)));
        let (terrain, scene, timeout) = (self.terrain, self.scene, Timeouts::EMULATED);
        let opened = Session::open(terrain, scene, arming, link, timeout);
        self.session = Some(opened.expect("opened").0);
    }

    /// Runs until a tick of the scene.
    pub(crate) fn run(mut self, until: u64) -> Self {
        if self.session.is_none() {
            self.open(Some(Arming::VIRTUAL));
        }
        while (self.samples.last().map_or(0, |last| u64::from(last.tick))) < until {
            self.poll();
        }
        self
    }

    pub(crate) fn poll(&mut self) {
        let session = self.session.as_mut().expect("open");
        let (samples, reports) = (&mut self.samples, &mut self.reports);
        let answers = &mut self.answers;
        let polled = session.poll(Duration::ZERO, &mut |event| match event {
            Event::Sample(sample) => samples.push(*sample),
            Event::Guard(report) => reports.push(*report),
            Event::Answered { request, result } => answers.push((*request, result)),
            _ => {}
        });
        polled.expect("it continues");
    }

    pub(crate) fn request(&mut self, request: Request) {
        self.session.as_mut().expect("open").request(request);
    }

    pub(crate) fn sample(&self, tick: u64) -> &TickRecord {
        let index = usize::try_from(tick).expect("small") - 1;
        &self.samples[index]
    }

    /// Returns the first tick with inputs and the amplifiers off, after they had been on.
    pub(crate) fn off_at(&self) -> u64 {
        let log = self.log.borrow();
        let on = log.iter().position(|(_, drive)| drive.enabled);
        let on = on.expect("it was on");
        let off = log[on..].iter().position(|(_, drive)| !drive.enabled);
        (on + off.expect("it went off")) as u64
    }

    /// Checks that no force exceeds the clamp, no current the peak, and that no current flows while
    /// off.
    pub(crate) fn check_bounds(&self) {
        for (tick, (_, drive)) in self.log.borrow().iter().enumerate() {
            let most = drive.currents_a.abs().max_element();
            assert!(most <= 5.5, "{most} A at {tick}");
            assert!(drive.enabled || most == 0.0, "{most} A while off at {tick}");
        }
        for sample in &self.samples {
            assert!(sample.force_n.length() <= 8.5 * WORKING_SHARE);
            let driven = sample.mode.is_driving();
            assert!(driven || sample.force_n.length() == 0.0, "{}", sample.tick);
        }
    }
}

pub(crate) fn plane() -> Raster {
    Raster::from_fn(101, 101, |_, _| PLANE_MM as f32).expect("raster")
}

pub(crate) fn on_plane(raster: &Raster) -> Terrain<'_> {
    Terrain::new(raster, Scale::new(2.0, 1.0).expect("scale"), 0).expect("terrain")
}

/// Lowers the hand and presses for this time.
pub(crate) fn press_for(newtons: f64, seconds: f64) -> Touch<'static> {
    let wall = f64::from(SurfaceParams::PREMIUM.stiffness_n_per_mm);
    let hand = HandModel::default();
    Touch::start(&|_, _| Some(PLANE_MM), &hand, wall, MIDDLE_MM, 10.0).press(newtons, seconds)
}

/// Same, for a long time.
pub(crate) fn press(newtons: f64) -> Touch<'static> {
    press_for(newtons, 3.0)
}

/// Moves to and fro while pressing.
pub(crate) fn rub(newtons: f64, times: u32) -> Script {
    let [x, y] = MIDDLE_MM;
    let line: Vec<[f64; 2]> = (0..times)
        .flat_map(|_| [[x + 40.0, y + 10.0], [x - 40.0, y - 10.0]])
        .collect();
    press_for(newtons, 1.0).slide(&line, newtons, 40.0).finish()
}

pub(crate) const NOTHING: Wrong = |_, _| {};

//! A change of the placement while a hand presses: the device's own application, a virtual Phantom,
//! and the engine behind keys and commands.

mod level_by_speed;

use std::cell::Cell;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{Arming, Event, Native, Session, Timeouts};
use hapterra::phantom::{ArmFrame, HandModel, HeldPhantom, PhantomModel, Script, Touch};
use hapterra::place::{
    Bounds, Coordinates, PlacedSurface, Placement, PlacementChange, PlacementOptions, Reach,
    Sizing, SurfaceChange, Target,
};
use hapterra::steering::{Steer, Steering};
use hapterra::terrain::HapticCells;
use hapterra_core::Vec3;
use hapterra_core::contact::{ContactState, Friction};
use hapterra_core::force::{Damping, Pattern, Shading, SurfaceParams, Texture};
use hapterra_core::guard::{Limits, MAX_SLEW_N_PER_S, Mode};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::TickRecord;
use hapterra_firmware::native::StoppedClock;
use heightfield::{OpenOptions, Raster};

/// Samples along a side.
const SIZE: u32 = 4097;
/// Resolution of a coarse encoder, mm, so that nine levels of this terrain are wide enough for a
/// hand.
const RESOLUTION_MM: f64 = 0.5;
/// Press of the hand, N: the motors can hold it permanently, as this hand has no tremor.
const PUSH_N: f64 = 1.2;
/// Default ball of a hand, mm.
const TIP_MM: f64 = 7.0;
/// Stiffness of the spring, N/mm.
const STIFFNESS: f32 = SurfaceParams::PREMIUM.stiffness_n_per_mm;
/// Largest change of the force in a tick, N: it fades within 100 ticks, and the hand moves about
/// 0.1 mm.
const GENTLE_N: f32 = 0.12;

/// Minimum force of the hand's press while the placement changes, N.
const MIN_HELD_N: f32 = 0.95 * PUSH_N as f32;

/// Returns hills of every size, so that all levels look alike.
fn hills() -> Raster {
    hills_from(0, 0.02)
}

/// Returns hills from the size of 20 · 2^`first` samples, of this height as a share of their size.
fn hills_from(first: i32, height: f64) -> Raster {
    let raster = Raster::from_fn(SIZE, SIZE, |x, y| {
        let (x, y) = (f64::from(x), f64::from(y));
        let wave = |k: i32| {
            let long = 20.0 * 2f64.powi(k);
            height * long * ((x / long).sin() + (y / long + 1.0).cos())
        };
        (first..8).map(wave).sum::<f64>() as f32
    });
    raster.expect("a raster")
}

/// A session in which a hand presses, and the placement changes.
struct Touching<'t> {
    session: Session<'t>,
    steering: Steering<'t>,
    samples: Vec<TickRecord>,
    messages: Vec<String>,
    /// Ticks after which a change was cancelled.
    cancelled: Vec<u32>,
    /// True if the board's clutch input is held.
    pedal: Rc<Cell<bool>>,
}

/// Returns an arm without joint friction: the friction, 0.05 N at the tip, holds the hand at any
/// force within that of its press, which depends on the direction of the last motion.
fn arm_without_friction() -> PhantomModel {
    PhantomModel::premium_1_5().with_friction(0.0)
}

/// Plays at the smallest scale, level 8, with a hand that presses on the middle for this time.
fn pressed<T>(raster: &Raster, seconds: f64, play: impl FnOnce(&mut Touching<'_>) -> T) -> T {
    pressed_by(arm_without_friction(), raster, seconds, play)
}

/// As [`pressed`], by a hand that holds this arm.
fn pressed_by<T>(
    arm: PhantomModel,
    raster: &Raster,
    seconds: f64,
    play: impl FnOnce(&mut Touching<'_>) -> T,
) -> T {
    let options = PlacementOptions {
        target: Target::Whole,
        sizing: Sizing::CellMm(1.05 * RESOLUTION_MM / 256.0),
        level: Some(8),
        ..PlacementOptions::default()
    };
    pressed_at(arm, raster, &options, seconds, play)
}

/// Plays with a hand that presses on a placement's home position for this time.
fn pressed_at<T>(
    model: PhantomModel,
    raster: &Raster,
    options: &PlacementOptions,
    seconds: f64,
    play: impl FnOnce(&mut Touching<'_>) -> T,
) -> T {
    let by_point = (SurfaceParams::PREMIUM, 0.0);
    pressed_on(model, raster, options, by_point, seconds, play)
}

/// As [`pressed_at`], on this surface, with a ball of this radius in mm; 0 for a point.
fn pressed_on<T>(
    model: PhantomModel,
    raster: &Raster,
    options: &PlacementOptions,
    (params, tip_mm): (SurfaceParams, f64),
    seconds: f64,
    play: impl FnOnce(&mut Touching<'_>) -> T,
) -> T {
    let press = |touch: Touch<'_>, _| touch.press(PUSH_N, seconds).finish();
    let arm = (model, RESOLUTION_MM, params, tip_mm);
    touched_at(arm, raster, options, press, play)
}

/// As [`pressed_on`], with these encoders (resolution in mm): `touch` continues the plan of a hand
/// over the home position, given in device millimetres.
fn touched_at<T>(
    (model, resolution_mm, params, tip_mm): (PhantomModel, f64, SurfaceParams, f64),
    raster: &Raster,
    options: &PlacementOptions,
    touch: impl FnOnce(Touch<'_>, [f64; 2]) -> Script,
    play: impl FnOnce(&mut Touching<'_>) -> T,
) -> T {
    let grid = options.target.grid(raster, HapticCells::default());
    let grid = grid.expect("a grid").with_tip(tip_mm);
    let reach = Reach::of(&Calibration::PREMIUM_1_5);
    let view = Placement::new(&grid, &reach, options).expect("a view");
    let terrain = view.terrain(grid).expect("a terrain");
    let scene = view.scene(&terrain, params).expect("a scene");
    let [east, north, _] = view.home_mm;
    let surface = |x: f64, y: f64| terrain.height_mm(x, y);
    let (hand, wall) = (HandModel::default(), f64::from(params.stiffness_n_per_mm));
    let start = Touch::start(&surface, &hand, wall, [east, north], 10.0);
    let script = touch(start, [east, north]);
    let home_mm = view.home_mm;
    let arm = HeldPhantom::new(model, hand, ArmFrame { home_mm }, script).expect("in reach");
    let pedal = Rc::new(Cell::new(false));
    let foot = Rc::clone(&pedal);
    let device: Native = Native::new(StoppedClock, Some(Box::new(arm.arming())))
        .with_fault_injector(Box::new(move |_, sense, _| sense.clutch = foot.get()));
    let (arming, timeout) = (Some(Arming::VIRTUAL), Timeouts::EMULATED);
    let opened = Session::open(&terrain, scene, arming, Box::new(device), timeout);
    let bounds = Bounds {
        first: PlacedSurface { view, params },
        resolution_mm,
        level: None,
        tip_mm,
        coarser: 0,
    };
    let mut touching = Touching {
        session: opened.expect("opened").0,
        steering: Steering::new(bounds, terrain.clone()),
        samples: vec![],
        messages: vec![],
        cancelled: vec![],
        pedal,
    };
    // Armed, lowered, and at rest.
    touching.run_to(6_000);
    let played = play(&mut touching);
    let stats = touching.session.stats();
    assert_eq!(stats.lost + stats.dropped, 0);
    touching.session.close(&mut |_| {}).expect("confirmed");
    played
}

impl Touching<'_> {
    fn poll(&mut self) {
        let (samples, steering) = (&mut self.samples, &mut self.steering);
        let cancelled = &mut self.cancelled;
        let mut on_event = |event: Event<'_>| {
            steering.on_event(&event);
            match event {
                Event::Sample(sample) => samples.push(*sample),
                Event::ChangeCancelled => {
                    cancelled.push(samples.last().map_or(0, |last| last.tick));
                }
                _ => {}
            }
        };
        self.session
            .poll(Duration::ZERO, &mut on_event)
            .expect("it continues");
        for request in self.steering.requests() {
            self.session.enqueue(request);
        }
        if let Some(update) = self.steering.take_update() {
            self.session
                .put_view(update.view, update.terrain)
                .expect("reported");
        }
        self.messages.extend(self.steering.lines());
    }

    fn run_to(&mut self, tick: u32) {
        while self.samples.last().is_none_or(|last| last.tick < tick) {
            self.poll();
        }
    }

    fn run(&mut self, ticks: u32) -> TickRecord {
        let last = self.samples.last().expect("samples").tick;
        self.run_to(last + ticks);
        *self.samples.last().expect("samples")
    }

    /// Makes a request, and waits until it is done and the force is back.
    fn steer(&mut self, steer: Steer) -> TickRecord {
        self.steering.steer(steer);
        for _ in 0..200_000 {
            self.poll();
            if self.steering.is_settled() {
                return self.run(700);
            }
        }
        panic!("{steer:?} is never done: {:?}", self.messages);
    }

    fn change(&mut self, change: PlacementChange) -> TickRecord {
        self.steer(Steer::Change(change))
    }

    fn last(&self) -> TickRecord {
        *self.samples.last().expect("samples")
    }

    fn level(&self) -> u8 {
        self.steering.now().view.level
    }
}

/// Checks that the arm stays armed, that no tick changes the force by more than `max_n`, and that
/// no force exceeds the one at the start.
fn check_samples(samples: &[TickRecord], max_n: f32) {
    // The hand is pushed back, and its damping adds to the press during the motion.
    check_press(samples, max_n, 1.03);
}

/// Same as `judge`, with a limit of `max_ratio` the first force while the hand is pushed back.
fn check_press(samples: &[TickRecord], max_n: f32, max_ratio: f32) {
    for pair in samples.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        assert_eq!(after.mode, Mode::Armed, "tick {}", after.tick);
        assert_eq!(after.fault, None);
        let change = (after.force_n - before.force_n).length();
        assert!(change <= max_n, "tick {}: {change} N at once", after.tick);
        let share = MAX_SLEW_N_PER_S / 1_000.0;
        assert!(change <= share, "tick {}: {change} N", after.tick);
        let (force, first) = (after.force_n.length(), samples[0].force_n.length());
        assert!(force <= max_ratio * first, "tick {}: {force} N", after.tick);
    }
    let worst = samples
        .windows(2)
        .map(|p| (p[1].force_n - p[0].force_n).length());
    let worst = worst.fold(0.0, f32::max);
    eprintln!(
        "{} ticks, at most {worst:.4} N from one to the next",
        samples.len()
    );
}

/// Checks that the hand presses in every sample: the clutch never opens, and the force exceeds
/// `min_n`.
fn check_held(samples: &[TickRecord], min_n: f32) {
    let forces = samples.iter().map(|sample| sample.force_n.length());
    let least = forces.fold(f32::MAX, f32::min);
    eprintln!("at least {least:.4} N");
    assert!(least > min_n, "{least} N");
    let is_open = |sample: &&TickRecord| sample.limits.contains(Limits::CLUTCH_OPEN);
    let opened = samples.iter().find(is_open).map(|sample| sample.tick);
    assert_eq!(opened, None, "tick with an open clutch");
}

/// Checks that the ground is rendered again as before, with the same press.
fn assert_pressed(sample: &TickRecord, before: &TickRecord, what: &str) {
    assert_rendered(sample, what);
    let share = sample.force_n.length() / before.force_n.length();
    assert!((0.98..1.02).contains(&share), "{what}: {share} of before");
}

fn assert_rendered(sample: &TickRecord, what: &str) {
    assert_eq!(sample.state, ContactState::Touching, "{what}");
    // The passivity controller runs in every scene, and encoders of half a millimetre activate it.
    let others = sample.limits.difference(Limits::ENERGY_DISSIPATED);
    assert_eq!(others, Limits::empty(), "{what}");
}

/// Returns the ratio of the forces of a press with two springs, N/mm. The hand is a spring as well,
/// with a fixed end.
fn in_series(with: f32, of: f32) -> f32 {
    let compliance_mm_per_n = 1_000.0 * HandModel::default().compliance_m_per_n() as f32;
    (compliance_mm_per_n + 1.0 / of) / (compliance_mm_per_n + 1.0 / with)
}

/// Returns the share of a press that remains when the ground has moved to the hand's target.
fn remaining_press_share() -> f32 {
    let compliance_mm_per_n = 1_000.0 * HandModel::default().compliance_m_per_n() as f32;
    (1.0 / STIFFNESS) / (compliance_mm_per_n + 1.0 / STIFFNESS)
}

/// Safety: 15.
#[test]
fn force_makes_no_step_while_zooming_through_eight_levels() {
    let raster = hills();
    pressed_by(PhantomModel::premium_1_5(), &raster, 60.0, |touching| {
        let before = touching.last();
        assert_rendered(&before, "at the beginning");
        assert!((before.force_n.length() - PUSH_N as f32).abs() < 0.05);
        let began = touching.samples.len();
        assert_eq!(touching.level(), 8);
        for level in (0..8).rev() {
            let sample = touching.change(PlacementChange::Zoom(2.0));
            assert_pressed(&sample, &before, &format!("zoomed to level {level}"));
            assert_eq!(touching.level(), level, "{:?}", touching.messages);
        }
        for level in 1..=8 {
            let sample = touching.change(PlacementChange::Zoom(0.5));
            assert_pressed(&sample, &before, &format!("back to level {level}"));
            assert_eq!(touching.level(), level, "{:?}", touching.messages);
        }
        assert_eq!(touching.samples.last().map(|last| last.view), Some(16));
        assert_eq!(touching.messages, [""; 0]);
        check_samples(&touching.samples[began..], GENTLE_N);
        check_held(&touching.samples[began..], MIN_HELD_N);
    });
}

/// With the default ball of a hand, and on ground with friction.
///
/// Safety: 15.
#[test]
fn ball_with_friction_keeps_its_press_while_zooming() {
    // With detail between the samples of the fallback.
    let raster = hills_from(-4, 0.1);
    // A ball's radius is at most 8 cells.
    let options = PlacementOptions {
        target: Target::Whole,
        sizing: Sizing::CellMm(1.05 * TIP_MM / 8.0 / 256.0),
        level: Some(8),
        ..PlacementOptions::default()
    };
    let params = SurfaceParams {
        friction: Friction::coulomb(0.4),
        ..SurfaceParams::PREMIUM
    };
    let arm = PhantomModel::premium_1_5();
    pressed_on(arm, &raster, &options, (params, TIP_MM), 60.0, |touching| {
        // Friction holds the proxy in the middle of the terrain, where the fallback has a sample at
        // every level: elsewhere its height is another one than the tile's.
        let before = touching.change(PlacementChange::Pan {
            east_mm: 1.3,
            north_mm: -0.9,
        });
        assert_rendered(&before, "at the beginning");
        let began = touching.samples.len();
        let zooms_in = (0..8).rev().map(|level| (2.0, level));
        for (factor, level) in zooms_in.chain((1..=8).map(|level| (0.5, level))) {
            let sample = touching.change(PlacementChange::Zoom(factor));
            assert_rendered(&sample, &format!("zoomed to level {level}"));
            // The slope under the ball is another one at each level.
            let share = sample.force_n.length() / before.force_n.length();
            assert!((0.9..1.1).contains(&share), "level {level}: {share}");
            assert_eq!(touching.level(), level, "{:?}", touching.messages);
            let terrain = touching.steering.terrain();
            assert!(terrain.grid().tip_mm() == TIP_MM && terrain.tip_cells() > 0.0);
        }
        assert_eq!(touching.samples.last().map(|last| last.view), Some(17));
        assert_eq!(touching.messages, [""; 0]);
        check_press(&touching.samples[began..], GENTLE_N, 1.1);
        check_held(&touching.samples[began..], 0.9 * PUSH_N as f32);
    });
}

/// Safety: 15.
#[test]
fn force_makes_no_step_while_panning_and_scaling() {
    let raster = hills();
    pressed(&raster, 60.0, |touching| {
        let began = touching.samples.len();
        touching.change(PlacementChange::Zoom(64.0));
        let under = |touching: &Touching<'_>| {
            let sample = touching.samples.last().expect("samples");
            touching.steering.terrain().scale().to_mm(&sample.proxy)
        };
        let first = touching.last();
        let before = under(touching);
        let pan = PlacementChange::Pan {
            east_mm: 20.0,
            north_mm: -15.0,
        };
        assert_pressed(&touching.change(pan), &first, "panned");
        let after = under(touching);
        let moved = [after[0] - before[0], after[1] - before[1]];
        assert!(
            (moved[0] - 20.0).abs() < 1.5 && (moved[1] + 15.0).abs() < 1.5,
            "{moved:?}"
        );
        let steeper = touching.change(PlacementChange::Exaggerate(1.5));
        assert_pressed(&steeper, &first, "steeper");
        let softer = touching.change(PlacementChange::Stiffness(0.5));
        assert_rendered(&softer, "softer");
        let (soft, hard) = (0.5 * STIFFNESS, STIFFNESS);
        let share = softer.force_n.length() / steeper.force_n.length();
        assert!((share - in_series(soft, hard)).abs() < 0.02, "{share}");
        let harder = touching.change(PlacementChange::Stiffness(2.0));
        assert_pressed(&harder, &first, "as hard as before");
        let depth = |sample: &TickRecord| sample.hip.to(&sample.proxy).length();
        let deeper = depth(&softer) / depth(&harder);
        let expected = 2.0 * in_series(soft, hard);
        assert!(
            (deeper / expected - 1.0).abs() < 0.02,
            "a softer spring gives more"
        );
        let reset = touching.change(PlacementChange::Reset);
        assert_pressed(&reset, &first, "as at the beginning");
        assert_eq!(touching.level(), 8);
        assert_eq!(touching.messages, [""; 0]);
        check_samples(&touching.samples[began..], GENTLE_N);
        // With half the stiffness.
        check_held(
            &touching.samples[began..],
            in_series(soft, hard) * MIN_HELD_N,
        );
    });
}

#[test]
fn surface_command_during_contact_causes_no_force_step() {
    let raster = hills();
    pressed(&raster, 60.0, |touching| {
        let texture = Texture {
            pattern: Pattern::Grating,
            amplitude_mm: 0.1,
            wavelength_mm: 1.0,
            ..Texture::NONE
        };
        let friction = SurfaceChange::Friction {
            dynamic_mu: 0.3,
            static_mu: 0.5,
        };
        let first = touching.change(PlacementChange::Zoom(64.0));
        let began = touching.samples.len();
        let changes = [
            friction,
            SurfaceChange::ViscousFriction(0.005),
            SurfaceChange::Damping(5.0),
            SurfaceChange::Shading(Shading::Smooth),
            SurfaceChange::Texture(texture),
        ];
        for change in changes {
            let sample = touching.change(PlacementChange::Surface(change));
            assert_eq!(sample.state, ContactState::Touching, "{change:?}");
        }
        assert_eq!(touching.messages, [""; 0]);
        let params = touching.steering.now().params;
        let expected = SurfaceParams {
            friction: Friction {
                static_mu: 0.5,
                dynamic_mu: 0.3,
                viscous_s: 0.005,
            },
            damping: Damping {
                ns_per_m: 5.0,
                ..Damping::NONE
            },
            shading: Shading::Smooth,
            texture,
            ..SurfaceParams::PREMIUM
        };
        assert_eq!(params, expected);
        check_held(&touching.samples[began..], MIN_HELD_N);
        let friction = SurfaceChange::Friction {
            dynamic_mu: 11.0,
            static_mu: 11.0,
        };
        touching.change(PlacementChange::Surface(friction));
        assert!(
            touching.messages[0].contains("a friction of 11"),
            "{:?}",
            touching.messages
        );
        assert_eq!(
            touching.steering.now().params,
            expected,
            "it stays as it was"
        );
        let refused = touching.samples.len();
        let reset = touching.change(PlacementChange::Reset);
        assert_pressed(&reset, &first, "as at the beginning");
        assert_eq!(touching.steering.now().params, SurfaceParams::PREMIUM);
        check_samples(&touching.samples[began..], GENTLE_N);
        check_held(&touching.samples[refused..], MIN_HELD_N);
    });
}

#[test]
fn tip_command_during_contact_causes_no_force_step() {
    let raster = hills();
    pressed(&raster, 60.0, |touching| {
        let first = touching.change(PlacementChange::Zoom(64.0));
        let began = touching.samples.len();
        let tip = |touching: &Touching<'_>| {
            let terrain = touching.steering.terrain();
            (terrain.grid().tip_mm(), terrain.tip_cells() > 0.0)
        };
        for (expected_mm, is_ball) in [(2.0, true), (0.5, true), (0.0, false), (1.0, true)] {
            let sample = touching.change(PlacementChange::Tip(expected_mm));
            assert_rendered(&sample, &format!("by a tip of {expected_mm} mm"));
            // A ball rests beside a point's position, where the slope differs.
            let share = sample.force_n.length() / first.force_n.length();
            assert!((0.95..1.05).contains(&share), "{expected_mm} mm: {share}");
            assert_eq!(
                tip(touching),
                (expected_mm, is_ball),
                "{:?}",
                touching.messages
            );
        }
        assert_eq!(touching.messages, [""; 0]);
        check_held(&touching.samples[began..], MIN_HELD_N);
        touching.change(PlacementChange::Tip(-1.0));
        assert!(touching.messages[0].contains("a tip of -1 mm: from 0 to 100 mm"));
        assert_eq!(tip(touching), (1.0, true), "it stays as it was");
        let refused = touching.samples.len();
        let reset = touching.change(PlacementChange::Reset);
        assert_rendered(&reset, "by a point again");
        assert_eq!(tip(touching), (0.0, false));
        check_samples(&touching.samples[began..], GENTLE_N);
        check_held(&touching.samples[refused..], MIN_HELD_N);
    });
}

/// Safety: 15.
#[test]
fn clutch_carries_the_terrain_with_the_hand() {
    let raster = hills();
    pressed(&raster, 30.0, |touching| {
        let began = touching.samples.len();
        let before = touching.change(PlacementChange::Zoom(64.0));
        touching.steering.steer(Steer::Clutch(true));
        let open = touching.run(400);
        assert!(open.limits.contains(Limits::CLUTCH_OPEN));
        assert_eq!((open.force_n, open.mode), (Vec3::ZERO, Mode::Armed));
        let later = touching.run(300);
        assert!(later.hip.is_same(&open.hip), "it goes with the hand");
        // During a zoom it stays open.
        touching
            .steering
            .steer(Steer::Change(PlacementChange::Zoom(2.0)));
        let zoomed = touching.run(300);
        assert!(zoomed.limits.contains(Limits::CLUTCH_OPEN));
        assert_eq!(zoomed.view, 2);
        let closed = touching.steer(Steer::Clutch(false));
        assert_rendered(&closed, "let go");
        // The ground moves with a yielding hand, at most to the hand's target. Then two springs
        // share the force of one.
        let share = closed.force_n.length() / before.force_n.length();
        assert!((remaining_press_share()..1.0).contains(&share), "{share}");
        check_samples(&touching.samples[began..], GENTLE_N);
    });
}

#[test]
fn clutch_input_opens_clutch_and_allows_placement_changes() {
    let raster = hills();
    pressed(&raster, 30.0, |touching| {
        let began = touching.samples.len();
        let before = touching.change(PlacementChange::Zoom(64.0));
        touching.pedal.set(true);
        let open = touching.run(150);
        let limits = Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT;
        assert_eq!((open.limits, open.force_n), (limits, Vec3::ZERO));
        // The host leaves a clutch that it did not open, and changes the placement anyway.
        assert!(touching.steering.is_settled());
        for view in 2..=3 {
            let zoomed = touching.change(PlacementChange::Zoom(1.2));
            assert_eq!((zoomed.limits, zoomed.view), (limits, view));
        }
        touching.pedal.set(false);
        let closed = touching.run(700);
        assert_rendered(&closed, "let go");
        let share = closed.force_n.length() / before.force_n.length();
        assert!((remaining_press_share()..1.0).contains(&share), "{share}");
        // Released during a change of the placement: the host then holds the clutch to the end.
        touching.pedal.set(true);
        touching.run(150);
        touching
            .steering
            .steer(Steer::Change(PlacementChange::Zoom(1.2)));
        touching.poll();
        touching.pedal.set(false);
        let closed = touching.run(900);
        assert_rendered(&closed, "let go meanwhile");
        assert_eq!(closed.view, 4);
        assert_eq!(touching.messages, [""; 0]);
        check_samples(&touching.samples[began..], GENTLE_N);
    });
}

#[test]
fn impossible_change_is_reported_and_changes_nothing() {
    let raster = hills();
    pressed(&raster, 30.0, |touching| {
        let began = touching.samples.len();
        let far = PlacementChange::Pan {
            east_mm: 500.0,
            north_mm: 0.0,
        };
        let before = touching.last();
        assert_pressed(&touching.change(far), &before, "after a place outside");
        assert!(
            touching.messages[0].contains("outside"),
            "{:?}",
            touching.messages
        );
        assert_pressed(
            &touching.change(PlacementChange::Stiffness(50.0)),
            &before,
            "after too much",
        );
        assert_eq!(touching.messages.len(), 2);
        assert_eq!(touching.samples.last().map(|last| last.view), Some(0));
        let samples = &touching.samples[began..];
        check_samples(samples, GENTLE_N);
        check_held(samples, 0.9 * before.force_n.length());
    });
}

/// Returns a geographic grid from 43° to 46° N whose heights rise by a metre a metre on the ground
/// of WGS 84, to the east along each parallel, or to the north.
fn slope_of_degrees(axis: usize) -> Raster {
    const STEP: f64 = 0.002;
    let (a, e2) = (6_378_137.0_f64, 0.006_694_379_990_14);
    let metres = |latitude: f64| {
        let (sin, cos) = latitude.to_radians().sin_cos();
        let w = 1.0 - e2 * sin * sin;
        [a * cos / w.sqrt(), a * (1.0 - e2) / (w * w.sqrt())].map(|m| m.to_radians() * STEP)
    };
    let (columns, rows) = (61_u32, 1501_u32);
    let mut north_m = vec![0.0];
    for row in 1..rows {
        let middle = metres(43.0 + (f64::from(row) - 0.5) * STEP);
        north_m.push(north_m[row as usize - 1] + middle[1]);
    }
    let mut text =
        format!("ncols {columns}\nnrows {rows}\nxllcenter 10\nyllcenter 43\ncellsize {STEP}\n");
    for row in (0..rows).rev() {
        let [east, _] = metres(43.0 + f64::from(row) * STEP);
        // From the middle column, so that it rises only to the east there.
        let heights = (0..columns).map(|column| match axis {
            0 => (f64::from(column) - 30.0) * east,
            _ => north_m[row as usize],
        });
        let heights = heights.map(|height| format!("{height:.4}"));
        text += &(heights.collect::<Vec<_>>().join(" ") + "\n");
    }
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("degrees{axis}.asc"));
    std::fs::write(&path, text).expect("writable");
    let degrees = r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]"#;
    std::fs::write(path.with_extension("prj"), degrees).expect("writable");
    Raster::open(path, &OpenOptions::default()).expect("opens")
}

/// Returns the slope, east and north, from the force of a pressing hand.
fn slope_of_force(sample: &TickRecord) -> [f64; 2] {
    let [x, y, z] = sample.force_n.to_array().map(f64::from);
    [-x / z, -y / z]
}

/// At the southern end 1 mm is a haptic cell; commands bring the northern end under the hand, where
/// a degree of longitude is 4.7 % shorter, and back.
fn check_far_pan(axis: usize) {
    let raster = slope_of_degrees(axis);
    let options = PlacementOptions {
        target: Target::At([10.06, 43.1], Coordinates::Own),
        level: Some(0),
        ..PlacementOptions::default()
    };
    pressed_at(
        PhantomModel::premium_1_5(),
        &raster,
        &options,
        60.0,
        |touching| {
            let first = touching.last();
            assert_rendered(&first, "at the beginning");
            let began = touching.samples.len();
            // The effect of an empty change on a hand on such a slope.
            touching.change(PlacementChange::Stiffness(1.0));
            let max = max_ratio(&touching.samples[began..]);
            let began = touching.samples.len();
            let expected = [[1.0, 0.0], [0.0, 1.0]][axis];
            let is_true = |sample: &TickRecord, where_: &str| {
                let rendered = slope_of_force(sample);
                eprintln!("{where_}: {rendered:?}");
                for (rendered, expected) in rendered.iter().zip(expected) {
                    assert!(
                        (rendered - expected).abs() < 1e-3,
                        "{where_}: {rendered} for {expected}"
                    );
                }
            };
            is_true(&first, "in the south");
            let ground = |touching: &Touching<'_>| {
                let terrain = touching.steering.terrain();
                let (cell, at) = (terrain.scale().cell_mm(), touching.last().proxy);
                let [x, y, _] = terrain.scale().to_mm(&at).map(|mm| mm / cell);
                terrain.grid().to_ground([x, y])
            };
            let [_, south] = ground(touching);
            let metres = |north_m: f64| PlacementChange::PanGround {
                east_m: 0.0,
                north_m,
            };
            let there = touching.change(metres(310_000.0));
            assert_pressed(&there, &first, "panned to the north");
            assert!(ground(touching)[1] - south > 2.7, "{:?}", ground(touching));
            is_true(&there, "in the north");
            let scale = |touching: &Touching<'_>| {
                let view = &touching.steering.now().view;
                (view.ground_m_per_mm().expect("known"), view.exaggeration)
            };
            let (m_per_mm, times) = scale(touching);
            assert!((times.expect("known") - 1.0).abs() < 1e-9);
            let back = touching.change(metres(-310_000.0));
            assert_pressed(&back, &first, "panned back");
            is_true(&back, "in the south again");
            assert!((scale(touching).0 / m_per_mm - 1.0).abs() < 1e-12);
            // Beside the hand nothing else is measured: the same tiles are used.
            let cells = touching.steering.terrain().clone();
            touching.change(PlacementChange::Stiffness(0.9));
            assert!(touching.steering.terrain().has_tiles_of(&cells));
            assert_eq!(touching.messages, [""; 0]);
            check_press(&touching.samples[began..], GENTLE_N, max + 0.01);
            // The last change makes the spring softer by a tenth.
            check_held(&touching.samples[began..], 0.88 * first.force_n.length());
        },
    );
}

/// Returns the largest force of some samples, relative to the first.
fn max_ratio(samples: &[TickRecord]) -> f32 {
    let forces = samples.iter().map(|sample| sample.force_n.length());
    let max = forces.fold(0.0, f32::max) / samples[0].force_n.length();
    eprintln!("at most {max} times the force of the beginning");
    max
}

#[test]
fn slope_to_the_east_is_true_at_both_ends_of_degrees() {
    check_far_pan(0);
}

#[test]
fn slope_to_the_north_is_true_at_both_ends_of_degrees() {
    check_far_pan(1);
}

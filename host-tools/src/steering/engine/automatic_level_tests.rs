//! Changes of the level by the hand's speed, with devices that refuse, wait or restart.

use super::*;
use hapterra_core::wire::request::Refusal;

/// Samples in which a slow hand is certain to get a finer level.
const SLOW_SAMPLES: u32 = 1_000;
/// Samples in which a cancel is certain to end or to be requested again.
const MAX_CANCEL_SAMPLES: u32 = 1_502;

/// A hand that presses on the plane, and moves east and west.
struct Sliding<'s, 't> {
    steering: &'s mut Steering<'t>,
    tick: u32,
    east_mm: f64,
    /// The placement that the device renders.
    view: u8,
    limits: Limits,
    state: ContactState,
    /// Epoch of the latest change that was sent.
    epoch: u32,
}

impl Sliding<'_, '_> {
    /// Moves at a speed, mm a sample, and stops at the first change that is sent.
    fn slide(&mut self, mm: f64, samples: u32) -> Option<SceneChange> {
        for _ in 0..samples {
            self.tick += 1;
            self.east_mm = (self.east_mm + mm).clamp(2.0, 62.0);
            let scale = self.steering.terrain.scale();
            let [proxy, hip] = [0.0, -2.0].map(|dz| {
                let ground = scale.height_mm_per_unit() * self.east_mm;
                scale
                    .to_grid([self.east_mm, 32.0, ground + dz])
                    .expect("on the grid")
            });
            let sample = TickRecord {
                tick: self.tick,
                view: self.view,
                mode: Mode::Armed,
                state: self.state,
                limits: self.limits,
                hip,
                proxy,
                ..TickRecord::default()
            };
            self.steering.on_event(&Event::Sample(&sample));
            if let Some(update) = self.steering.take_update() {
                self.epoch = update.view.scene.epoch;
                return Some(update.view);
            }
        }
        None
    }

    /// Moves fast to and fro, one sample.
    fn move_on(&mut self) -> Option<SceneChange> {
        self.east_mm =
            if self.tick % 24 < 12 { 2.0 } else { 8.0 } + f64::from(self.tick % 12) * 5.0;
        self.slide(0.0, 1)
    }

    /// Moves fast from west to east.
    fn slide_fast(&mut self) -> Option<SceneChange> {
        self.slide(5.0, 12)
    }

    fn level(&self) -> u8 {
        self.steering.now().view.level
    }

    /// Moves fast until a coarser level is sent, which the device accepts.
    fn send_coarser(&mut self) -> SceneChange {
        let view = self.slide_fast().expect("a coarser level");
        assert!(view.in_contact.is_some() && view.scene.level > 0);
        report_result(self.steering, &view, true);
        assert!(self.steering.is_settled(), "the user waits for nothing");
        view
    }

    /// Returns true if a cancel of the latest change was requested, and nothing else.
    fn cancels(&mut self) -> bool {
        let requests = self.steering.requests();
        let cancel = HostRequest::Request(self.cancel());
        assert!(requests.is_empty() || requests == [cancel], "{requests:?}");
        !requests.is_empty()
    }

    /// Returns the request of a cancel of the latest change.
    fn cancel(&self) -> Request {
        Request::CancelChange { epoch: self.epoch }
    }

    /// Delivers the refusal of a cancel of the latest change.
    fn refuse_cancel(&mut self, why: Refusal) {
        let (request, result) = (&self.cancel(), Err(why));
        self.steering.on_event(&Event::Answered { request, result });
    }
}

fn sliding<T>(test: impl FnOnce(&mut Sliding<'_, '_>) -> T) -> T {
    with(|steering| {
        steering.follow_speed(1_000);
        let mut sliding = Sliding {
            steering,
            tick: 0,
            east_mm: 2.0,
            view: 0,
            limits: Limits::empty(),
            state: ContactState::Touching,
            epoch: 0,
        };
        let tested = test(&mut sliding);
        assert_eq!(sliding.steering.lines(), [""; 0]);
        tested
    })
}

#[test]
fn level_follows_the_speed_only_if_chosen() {
    with(|steering| {
        let mut sliding = Sliding {
            steering,
            tick: 0,
            east_mm: 2.0,
            view: 0,
            limits: Limits::empty(),
            state: ContactState::Touching,
            epoch: 0,
        };
        assert!(sliding.slide_fast().is_none());
    });
    sliding(|hand| {
        let view = hand.send_coarser();
        assert_eq!(hand.slide(0.1, 20), None, "it waits for the coarse tiles");
        assert!(!hand.cancels());
        hand.view = 1;
        hand.slide(0.0, 1);
        assert_eq!((hand.level(), hand.steering.number), (view.scene.level, 1));
        // While the force turns, nothing is sent.
        hand.limits = Limits::CLUTCH_MOVES;
        assert_eq!(hand.slide(0.0, SLOW_SAMPLES), None);
        hand.limits = Limits::empty();
        let finer = hand.slide(0.0, SLOW_SAMPLES).expect("a finer level");
        assert_eq!((finer.number, finer.scene.level), (2, 0));
        assert!(!hand.cancels());
    });
}

#[test]
fn hand_that_does_not_press_changes_no_level() {
    let states = [ContactState::Free, ContactState::Touching];
    for (state, limits) in states
        .into_iter()
        .zip([Limits::empty(), Limits::TERRAIN_COARSE])
    {
        sliding(|hand| {
            (hand.state, hand.limits) = (state, limits);
            assert_eq!(hand.slide_fast(), None);
            assert!(!hand.cancels());
            // Motion in the air is no motion over the ground.
            let is_at_once = state == ContactState::Touching;
            (hand.state, hand.limits) = (ContactState::Touching, Limits::empty());
            assert_eq!(hand.slide(-5.0, 1).is_some(), is_at_once);
            assert!(is_at_once || hand.slide(-5.0, 10).is_some());
        });
    }
}

/// A fast hand in the air, which lands and rests.
#[test]
fn landing_changes_no_level() {
    sliding(|hand| {
        hand.state = ContactState::Free;
        (0..100).for_each(|_| assert_eq!(hand.move_on(), None));
        hand.state = ContactState::Touching;
        assert_eq!(hand.slide(0.0, SLOW_SAMPLES), None);
        // A fast one on the ground, in the air.
        let view = hand.slide_fast().expect("a coarser level");
        report_result(hand.steering, &view, true);
        hand.view = 1;
        hand.slide(0.0, 1);
        hand.state = ContactState::Free;
        (0..SLOW_SAMPLES).for_each(|_| assert_eq!(hand.move_on(), None));
        hand.state = ContactState::Touching;
        assert_eq!(hand.slide(0.0, 1).expect("a finer level").scene.level, 0);
    });
}

/// The hand lifts off or leaves the tiles that have arrived, or the coarse tiles are late.
#[test]
fn level_that_cannot_be_made_is_cancelled_and_sent_later() {
    let lifts = (ContactState::Free, Limits::empty());
    let leaves = (ContactState::Touching, Limits::TERRAIN_COARSE);
    let waits = (ContactState::Touching, Limits::empty());
    for reason in [lifts, leaves, waits] {
        sliding(|hand| {
            hand.send_coarser();
            if reason == waits {
                hand.slide(0.0, 100);
                assert!(!hand.cancels());
            }
            (hand.state, hand.limits) = reason;
            hand.slide(0.0, 1);
            assert!(hand.cancels(), "{reason:?}");
            // Only once, and again if the device does not answer.
            hand.slide(0.0, 20);
            assert!(!hand.cancels() && hand.steering.is_settled());
            let request = HostRequest::Request(hand.cancel());
            hand.steering.on_event(&Event::Unanswered(&request));
            hand.slide(0.0, 1);
            assert!(hand.cancels());
            hand.steering.on_event(&Event::ChangeCancelled);
            assert_eq!((hand.level(), hand.steering.number), (0, 0));
            (hand.state, hand.limits) = waits;
            hand.east_mm = 2.0;
            assert_eq!(hand.slide_fast(), None, "after a pause");
            assert_eq!(hand.slide(0.0, 180), None);
            assert_eq!(hand.slide(0.0, 10).expect("a level").number, 1);
            assert!(!hand.cancels());
        });
    }
}

#[test]
fn change_that_was_made_before_its_cancel_is_in_force() {
    sliding(|hand| {
        let level = hand.send_coarser().scene.level;
        hand.slide(0.0, 101);
        assert!(hand.cancels());
        hand.refuse_cancel(Refusal::NoSuchChange);
        hand.slide(0.0, 3);
        hand.view = 1;
        hand.slide(0.0, 1);
        assert_eq!(hand.level(), level);
        assert!(!hand.cancels() && hand.steering.is_settled());
    });
}

#[test]
fn refused_level_opens_no_clutch() {
    sliding(|hand| {
        let view = hand.slide_fast().expect("a level");
        report_result(hand.steering, &view, false);
        hand.slide(0.0, 20);
        assert!(!hand.cancels() && hand.steering.is_settled());
        assert_eq!(hand.level(), 0);
    });
}

#[test]
fn change_of_the_user_cancels_that_of_the_level() {
    sliding(|hand| {
        hand.send_coarser();
        hand.steering.steer(ZOOM);
        assert_eq!(hand.slide(0.0, 1), None);
        assert!(hand.cancels());
        hand.steering.on_event(&Event::ChangeCancelled);
        let zoom = hand.slide(0.0, 1).expect("the user's change");
        assert_eq!((zoom.number, zoom.scene.level), (1, 0));
        report_result(hand.steering, &zoom, true);
        assert!(!hand.steering.is_settled());
    });
    // The clutch opens at once; the change is then made with it.
    sliding(|hand| {
        hand.send_coarser();
        hand.steering.steer(Steer::Clutch(true));
        hand.slide(0.0, 1);
        assert_eq!(requested_hold(hand.steering), Some(ClutchMode::WithHand));
    });
    // A device that does not answer a cancel does not delay the user.
    sliding(|hand| {
        hand.send_coarser();
        hand.steering.steer(ZOOM);
        hand.slide(0.0, MAX_SAMPLES_IN_CONTACT);
        assert!(hand.cancels());
        hand.slide(0.0, 1);
        assert_eq!(requested_hold(hand.steering), Some(ClutchMode::InPlace));
    });
}

#[test]
fn resumed_session_cancels_again_and_a_restarted_device_has_the_level() {
    for resumed in [true, false] {
        sliding(|hand| {
            let level = hand.send_coarser().scene.level;
            hand.slide(0.0, 101);
            assert!(hand.cancels());
            let device = &hello();
            hand.steering.on_event(&Event::Opened { device, resumed });
            hand.slide(0.0, 102);
            assert_eq!(hand.cancels(), resumed);
            assert_eq!(hand.level(), level);
            assert!(hand.steering.is_settled());
        });
    }
}

/// The clutch is requested before the device has answered the change, and is released later.
#[test]
fn clutch_opens_at_once_while_a_level_is_sent() {
    for accepted in [true, false] {
        sliding(|hand| {
            let view = hand.slide_fast().expect("a coarser level");
            hand.steering.steer(Steer::Clutch(true));
            hand.slide(0.0, 1);
            assert_eq!(requested_hold(hand.steering), Some(ClutchMode::WithHand));
            hand.slide(0.0, 5);
            assert_eq!(requested_hold(hand.steering), None, "once");
            hand.steering.steer(Steer::Clutch(false));
            report_result(hand.steering, &view, accepted);
            hand.slide(0.0, 1);
            answer(hand.steering, ClutchMode::WithHand);
            // An open clutch makes the change.
            hand.view = u8::from(accepted);
            hand.limits = Limits::CLUTCH_OPEN;
            hand.slide(0.0, 2);
            assert_eq!(requested_hold(hand.steering), Some(ClutchMode::Released));
            hand.limits = Limits::empty();
            hand.slide(0.0, 2);
            assert!(hand.steering.is_settled(), "accepted: {accepted}");
            assert_eq!(hand.steering.number, u8::from(accepted));
        });
    }
}

#[test]
fn refused_cancel_has_an_end() {
    // A busy device gets another cancel.
    sliding(|hand| {
        hand.send_coarser();
        hand.slide(0.0, 101);
        assert!(hand.cancels());
        hand.refuse_cancel(Refusal::Busy);
        hand.slide(0.0, 1);
        assert!(hand.cancels());
    });
    // The refusal of another cancel has no effect.
    sliding(|hand| {
        hand.send_coarser();
        hand.slide(0.0, 101);
        assert!(hand.cancels());
        let request = &Request::CancelChange { epoch: !hand.epoch };
        let result = Err(Refusal::Busy);
        hand.steering.on_event(&Event::Answered { request, result });
        hand.slide(0.0, 20);
        assert!(!hand.cancels());
    });
    // A device that has no such change, and still renders the placement before.
    sliding(|hand| {
        let level = hand.send_coarser().scene.level;
        hand.slide(0.0, 101);
        assert!(hand.cancels());
        for _ in 0..3 {
            hand.refuse_cancel(Refusal::NoSuchChange);
            hand.slide(0.0, MAX_CANCEL_SAMPLES);
            assert!(hand.cancels());
            assert_eq!((hand.level(), hand.steering.number), (level, 1));
        }
        hand.steering.steer(ZOOM);
        hand.slide(0.0, 1);
        assert_eq!(requested_hold(hand.steering), Some(ClutchMode::InPlace));
    });
    // A cancel whose answer never arrives, as after a request of the user, is requested again.
    sliding(|hand| {
        hand.send_coarser();
        hand.slide(0.0, 101);
        assert!(hand.cancels());
        hand.slide(0.0, MAX_CANCEL_SAMPLES);
        assert!(hand.cancels());
    });
}

#[test]
fn failed_clutch_cancels_the_level() {
    sliding(|hand| {
        hand.send_coarser();
        hand.steering.steer(Steer::Clutch(true));
        hand.slide(0.0, 1);
        hand.steering.requests();
        let clutch = Request::Clutch {
            hold: ClutchMode::WithHand,
        };
        let unanswered = HostRequest::Request(clutch);
        hand.steering.on_event(&Event::Unanswered(&unanswered));
        assert_eq!(hand.steering.lines().len(), 1);
        let release = Request::Clutch {
            hold: ClutchMode::Released,
        };
        let expected = [release, hand.cancel()].map(HostRequest::Request);
        assert_eq!(hand.steering.requests(), expected);
        // It waits for the result of the cancel.
        hand.slide(0.0, 2);
        assert!(matches!(hand.steering.stage, Stage::InContact { .. }));
        hand.steering.on_event(&Event::ChangeCancelled);
        assert!(hand.steering.is_settled());
        assert_eq!((hand.level(), hand.steering.number), (0, 0));
    });
}

/// The device answers the change after the clutch was given up.
#[test]
fn failed_clutch_keeps_the_level_that_is_sent() {
    sliding(|hand| {
        let view = hand.slide_fast().expect("a coarser level");
        hand.steering.steer(Steer::Clutch(true));
        hand.slide(0.0, 1);
        let hold = ClutchMode::WithHand;
        let unanswered = HostRequest::Request(Request::Clutch { hold });
        hand.steering.on_event(&Event::Unanswered(&unanswered));
        assert_eq!(hand.steering.lines().len(), 1);
        assert_eq!(requested_hold(hand.steering), Some(ClutchMode::Released));
        report_result(hand.steering, &view, true);
        hand.view = 1;
        hand.slide(0.0, 1);
        assert!(hand.steering.is_settled());
        assert_eq!(hand.steering.number, 1);
    });
}

#[test]
fn pause_doubles_after_each_cancel_until_a_success() {
    sliding(|hand| {
        hand.send_coarser();
        for pause in [200, 400, 800, 1_600, 3_200, 6_400, 6_400] {
            hand.steering.on_event(&Event::ChangeCancelled);
            for _ in 1..pause {
                assert_eq!(hand.move_on(), None, "{pause}");
            }
            let view = hand.move_on().expect("a level after the pause");
            report_result(hand.steering, &view, true);
        }
        hand.view = 1;
        assert_eq!(hand.move_on(), None);
        let view = hand.slide(0.0, SLOW_SAMPLES).expect("a finer level");
        report_result(hand.steering, &view, true);
        hand.steering.on_event(&Event::ChangeCancelled);
        assert_eq!(hand.slide(0.0, 199), None);
        assert!(hand.slide(0.0, 1).is_some());
    });
}

#[test]
fn lift_off_does_not_double_the_pause() {
    sliding(|hand| {
        hand.send_coarser();
        for _ in 0..4 {
            hand.state = ContactState::Free;
            hand.slide(0.0, 1);
            assert!(hand.cancels());
            hand.steering.on_event(&Event::ChangeCancelled);
            hand.state = ContactState::Touching;
            (1..200).for_each(|_| assert_eq!(hand.move_on(), None));
            let view = hand.move_on().expect("a level after the pause");
            report_result(hand.steering, &view, true);
        }
    });
}

#[test]
fn changes_that_were_given_up_open_no_clutch() {
    sliding(|hand| {
        hand.slide(0.0, 1);
        hand.steering.steer(ZOOM);
        let zoom = hand.slide(0.0, 1).expect("the user's change");
        assert!(zoom.in_contact.is_some());
        let hold = ClutchMode::Released;
        let unanswered = HostRequest::Request(Request::Clutch { hold });
        hand.steering.on_event(&Event::Unanswered(&unanswered));
        assert_eq!(hand.steering.lines().len(), 1);
        assert_eq!(requested_hold(hand.steering), Some(hold));
        report_result(hand.steering, &zoom, false);
        assert_eq!(hand.slide(0.0, 20), None);
        assert_eq!(requested_hold(hand.steering), None);
        assert!(hand.steering.is_settled());
    });
}

#[test]
fn level_that_the_terrain_does_not_have_is_requested_once() {
    sliding(|hand| {
        // The level stays, whatever the speed requires.
        hand.steering.bounds.level = Some(0);
        assert_eq!(hand.slide_fast(), None);
        hand.slide(0.0, 1);
        let automatic = hand.steering.automatic.as_ref().expect("by speed");
        assert!(automatic.rule.coarser() > 0);
        assert_eq!(hand.steering.bounds.coarser, automatic.rule.coarser());
        assert_eq!(automatic.pause, 0);
    });
}

/// A change of the user measures them again.
#[test]
fn change_of_the_level_keeps_the_cells_far_from_their_place() {
    with_raster(&degrees(), |steering| {
        steering.follow_speed(1_000);
        let sample = sample_at(steering, 80.0, Limits::empty());
        let sample = TickRecord {
            mode: Mode::Armed,
            state: ContactState::Touching,
            proxy: sample.hip,
            ..sample
        };
        assert!(
            steering
                .hand(&sample)
                .has_other_cell_size(&steering.terrain)
        );
        let automatic = steering.automatic.as_mut().expect("by speed");
        (0..100).for_each(|_| automatic.rule.take_motion([1.0, 0.0], 1, 0.1));
        steering.change_level(&sample);
        let update = steering.take_update().expect("a coarser level");
        assert!(update.view.in_contact.is_some());
        let measured = |terrain: &Terrain<'_>| terrain.grid().measured_at();
        assert_eq!(measured(&update.terrain), measured(&steering.terrain));
    });
}

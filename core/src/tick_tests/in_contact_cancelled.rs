//! Cancels of changes of placement that wait.

use super::*;

/// Serves the placement that was rendered before a change, as the link does after a cancel.
fn serve_again(arm: &mut PressedArm<'_>, height: fn(i32, i32) -> f32) {
    let scene = arm.device.haptics.scene.expect("a scene");
    arm.device.size = scene.size;
    arm.device.height = height;
    arm.device.fallback = scene.fallback.map(|fallback| (fallback, scene.level));
    arm.device.requester.reset(scene.level, scene.size);
    arm.device.requester.set_fallback(scene.fallback);
}

/// Takes the buffers that have become free, and returns their number.
fn spares(arm: &mut PressedArm<'_>) -> usize {
    let Device { haptics, spare, .. } = &mut arm.device;
    spare.extend(core::iter::from_fn(|| haptics.take_spare()));
    spare.len()
}

/// The fallback has not arrived, or has no height under the hand.
#[test]
fn cancelled_change_is_not_made_and_returns_its_buffers() {
    for arrives in [false, true] {
        let mut tiles = buffers::<4>();
        let mut arm = pressed(&mut tiles, ground);
        // A placement with a fallback of its own.
        arm.change(arm.zoom(1, 0, 0), ground);
        stays(&mut arm, 0, 1);
        stays(&mut arm, 1, 700);
        let (spare, force_n) = (spares(&mut arm), arm.last.sample.force_n);
        let change = arm.zoom(2, 0, 1);
        match arrives {
            true => arm.change(change, |_, _| f32::NAN),
            false => arm.send(Command::SceneChange(change)),
        }
        stays(&mut arm, 1, 20);
        assert_eq!(arm.device.haptics.epoch(), Some(102));
        assert_eq!(arm.device.haptics.window.has_next(), arrives);
        arm.send(Command::CancelChange(2));
        assert_eq!(arm.device.haptics.epoch(), Some(101));
        assert_eq!(spares(&mut arm), spare, "arrives: {arrives}");
        serve_again(&mut arm, ground);
        stays(&mut arm, 1, 50);
        assert!(arm.device.haptics.clutch.is_closed());
        assert_eq!(arm.last.sample.limits, Limits::empty());
        let change_n = (arm.last.sample.force_n - force_n).length();
        assert!(change_n < GENTLE_N, "{change_n} N");
        // The window requests the tiles of the placement again.
        assert!(arm.device.served > 0);
        arm.device.served = 0;
        arm.max_n = 1.0;
        for n in 0..1_500 {
            arm.counts[0] = n;
            assert_eq!(arm.tick().missing_tile, None, "{n}");
        }
        arm.max_n = GENTLE_N;
        assert!(arm.device.served > 0);
        assert_eq!(arm.last.sample.view, 1);
        // The same number can be used again.
        arm.change(arm.zoom(2, 0, 1), finer);
        stays(&mut arm, 1, 1);
        stays(&mut arm, 2, 20);
    }
}

#[test]
fn cancel_of_another_or_a_made_change_does_nothing() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, ground);
    arm.change(arm.zoom(1, 0, 1), finer);
    arm.send(Command::CancelChange(2));
    arm.send(Command::CancelChange(0));
    stays(&mut arm, 0, 1);
    stays(&mut arm, 1, 1);
    for number in 0..3 {
        arm.send(Command::CancelChange(number));
    }
    stays(&mut arm, 1, 700);
    assert_eq!(arm.device.haptics.epoch(), Some(101));
    assert_eq!(arm.last.sample.limits, Limits::empty());
}

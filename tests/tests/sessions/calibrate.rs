//! The calibration walk with a virtual Phantom whose true numbers differ from the preset, over the
//! real link.

use hapterra::calibrate::{Attendant, Plan, Review, VirtualUser, run_procedure};
use hapterra::link::{ControlSession, HostClock, LinkError, Native};
use hapterra::phantom::STANDARD_GRAVITY;
use hapterra_core::phantom::Calibration;
use hapterra_tests::timeouts::HANG;

/// The joints' friction, Nm: the largest error of a torque measured on a still arm.
const FRICTION_NM: f64 = 0.01;

fn calibrated(user: &mut VirtualUser) -> Review {
    let device = Native::new(HostClock::default(), None)
        .with_fault_injector(user.hands())
        .free_running();
    let opened = ControlSession::open(Box::new(device), HANG);
    let mut control = opened.expect("it answers");
    let plan = Plan {
        ratios: true,
        gravity: true,
    };
    let mut counts =
        || -> Result<[i32; 3], LinkError> { Ok(control.fresh_status()?.health.sense.counts) };
    let review =
        run_procedure(&Calibration::PREMIUM_1_5, plan, user, &mut counts).expect("a record");
    let stored = control.store(review.after).expect("it answers");
    assert_eq!(stored, Ok(()));
    assert_eq!(
        control.calibration().expect("it answers"),
        Some(review.after)
    );
    review
}

fn errors(user: &VirtualUser, review: &Review) -> ([f64; 3], [f64; 2]) {
    let (model, found) = (user.model(), &review.after);
    let ratios =
        std::array::from_fn(|i| (f64::from(found.ratio[i]) / model.drive[i].ratio - 1.0).abs());
    let weight = [
        f64::from(found.gravity_2_nm) - STANDARD_GRAVITY * model.lumped.g2,
        f64::from(found.gravity_3_nm) - STANDARD_GRAVITY * model.lumped.g3,
    ];
    (ratios, weight.map(f64::abs))
}

#[test]
fn calibration_recovers_true_ratios_signs_and_weights() {
    let mut user = VirtualUser::with_stylus();
    let review = calibrated(&mut user);
    let (ratios, weights) = errors(&user, &review);
    assert!(ratios.iter().all(|error| *error < 0.003), "{ratios:?}");
    let signs = [0, 1, 2].map(|i| f64::from(review.after.encoder_sign[i]));
    assert_eq!(signs, [0, 1, 2].map(|i| user.model().drive[i].sign));
    assert!(
        weights.iter().all(|error| *error < FRICTION_NM),
        "{weights:?}"
    );
    // The preset would have had a larger error.
    let preset = f64::from(Calibration::PREMIUM_1_5.gravity_2_nm);
    let truth = STANDARD_GRAVITY * user.model().lumped.g2;
    assert!((preset - truth).abs() > 3.0 * FRICTION_NM);
}

#[test]
fn ruler_error_of_half_a_millimetre_costs_one_per_cent() {
    let mut user = VirtualUser::with_stylus();
    user.ruler_error_mm = 0.5;
    let review = calibrated(&mut user);
    let (ratios, _) = errors(&user, &review);
    assert!(ratios.iter().all(|error| *error < 0.012), "{ratios:?}");
    assert!(ratios.iter().any(|error| *error > 0.004), "{ratios:?}");
}

#[test]
fn rejected_calibration_changes_nothing() {
    /// Refuses the result at the end.
    struct No(VirtualUser);

    impl Attendant for No {
        fn notify(&mut self, line: &str) {
            self.0.notify(line);
        }
        fn zero_pose(&mut self) -> Result<(), hapterra::calibrate::Stopped> {
            self.0.zero_pose()
        }
        fn move_along(
            &mut self,
            direction: hapterra::calibrate::Direction,
            mm: f64,
        ) -> Result<f64, hapterra::calibrate::Stopped> {
            self.0.move_along(direction, mm)
        }
        fn hold_still(
            &mut self,
            number: usize,
        ) -> Result<Option<[f64; 2]>, hapterra::calibrate::Stopped> {
            self.0.hold_still(number)
        }
        fn confirm_record(&mut self, _: &Review) -> Result<bool, hapterra::calibrate::Stopped> {
            Ok(false)
        }
    }

    let mut user = No(VirtualUser::with_stylus());
    let counts = user.0.counts();
    let plan = Plan {
        ratios: true,
        gravity: false,
    };
    let mut read = || Ok::<_, std::convert::Infallible>(counts.get());
    let refused = run_procedure(&Calibration::PREMIUM_1_5, plan, &mut user, &mut read);
    assert!(refused.is_err());
}

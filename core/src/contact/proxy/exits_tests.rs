//! Each phase takes all of its exits and no other.

use std::collections::BTreeSet;

use glam::Vec3;

use super::*;
use crate::cases::cases;
use crate::contact::test_random::Random;
use crate::terrain::FieldSize;
use crate::terrain::testing::{Field, buffers};

const SIZE: i32 = 128;

/// A HIP wanders around rough ground with no-data, and leaps now and then.
#[test]
fn each_phase_takes_exactly_its_listed_exits() {
    let mut random = Random(39);
    let holes = |x: i32, y: i32| {
        let hole = (x / 6 + y / 7) % 3 == 0;
        if hole {
            f32::NAN
        } else {
            ((x * 7 + y * 13) % 5) as f32
        }
    };
    let mut taken = BTreeSet::new();
    for _ in 0..cases(60, 60) {
        let mut tiles = buffers::<4>();
        let field = Field::<4>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), holes);
        let settings = ContactSettings {
            work_per_tick: ContactSettings::MIN_WORK,
            ..ContactSettings::AT_1_KHZ
        };
        let mut contact = Contact::new(settings);
        let mut at = [64.0; 2];
        for _ in 0..400 {
            let max_step = match random.unit() {
                x if x < 0.01 => 300.0,
                x if x < 0.1 => 40.0,
                _ => 1.0,
            };
            at = at.map(|x| (x + random.between(-max_step, max_step)).clamp(0.0, 126.0));
            let z = random.between(-2.0, 5.0);
            let hip = GridPoint::new([0; 3], Vec3::new(at[0] as f32, at[1] as f32, z as f32));
            let (from, exits) = contact.phase.exits();
            contact.step(&field.window, &hip);
            let (to, _) = contact.phase.exits();
            assert!(from == to || exits.contains(&to), "from {from} to {to}");
            taken.extend((from != to).then_some((from, to)));
        }
    }
    assert_eq!(taken.len(), 13, "{taken:?}");
}

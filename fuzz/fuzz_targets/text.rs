//! Arbitrary bytes as recordings, calibrations, tables of materials, logs and commands.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| hapterra_tests::fuzzing::text::run(data));

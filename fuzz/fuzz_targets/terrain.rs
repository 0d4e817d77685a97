//! Arbitrary bytes as terrain files of all formats that are read without GDAL.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    hapterra_tests::fuzzing::terrain::run(data);
});

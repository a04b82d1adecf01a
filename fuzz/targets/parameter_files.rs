#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| trajectory_selector_fuzz::parameter_files(bytes));

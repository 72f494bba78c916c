#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::downlink_payload(data));

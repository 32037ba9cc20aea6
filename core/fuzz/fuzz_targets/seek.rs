//! Seeking: a stream that decodes in order gives the same frames.

#![no_main]

use libfuzzer_sys::fuzz_target;
use quarc_fuzz::mend::mend;
use quarc_fuzz::{decode, seek};

fuzz_target!(|data: &[u8]| {
    let Some((&last, data)) = data.split_last() else { return };
    let start = u32::from(last);
    for stream in [data, &mend(data)] {
        let sought = seek(stream, start);
        assert!(sought.frames.iter().all(|frame| frame.0 >= start));
        let mut all = decode(stream, usize::MAX);
        if all.ended.is_ok() {
            all.frames.retain(|frame| frame.0 >= start);
            assert!(sought.frames.starts_with(&all.frames) && sought.ended.is_ok());
        }
    }
});
